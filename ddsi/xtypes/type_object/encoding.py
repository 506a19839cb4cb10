"""TypeObjects to the octets that are hashed and sent: XCDR2, little endian (DDS-XTypes 1.3 §7.3.4.5 and Annex B).

The layouts follow the specification's IDL, irregularities included: bitmasks and bitsets are appendable and have a
DHEADER of their own, the others are final.  Only what the builder makes is written; TypeObjects of sequences, arrays
and maps, which nobody needs, are read but never written.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence

from ...structure.errors import BadParameter
from ..model import Limits
from .cursors import ObjectWriter
from .identifiers import HASH_LENGTH, HashIdentifier, PrimitiveIdentifier, TypeIdentifier, write_identifier
from .kinds import COMPLETE, MINIMAL, TypeKind
from .objects import (
    AliasObject,
    BitmaskObject,
    BitsetObject,
    CaseObject,
    EnumObject,
    MemberObject,
    Named,
    StructObject,
    TypeObject,
    UnionObject,
)
from .parameter_values import write_number

__all__ = ["encode_type_object", "equivalence_hash", "hash_of_objects", "hashed"]

_NO_TYPE = PrimitiveIdentifier(TypeKind.NONE)


def encode_type_object(type_object: TypeObject) -> bytes:
    """With the leading DHEADER, without encapsulation header and padding: what is hashed."""
    writer = ObjectWriter()
    _write_object(writer, type_object)
    return writer.getvalue()


def equivalence_hash(octets: bytes) -> bytes:
    """EquivalenceHash: the first 14 octets of the MD5."""
    return hashlib.md5(octets, usedforsecurity=False).digest()[:HASH_LENGTH]


def hashed(type_object: TypeObject) -> tuple[HashIdentifier, bytes]:
    """The identifier of a TypeObject, and its octets."""
    octets = encode_type_object(type_object)
    kind = COMPLETE if type_object.is_complete else MINIMAL
    return HashIdentifier(kind, equivalence_hash(octets)), octets


def hash_of_objects(type_objects: Sequence[TypeObject]) -> bytes:
    """The hash of a strongly connected component: of its TypeObjects as one sequence (§7.3.4.9).

    Cyclone DDS's C generator hashes the sequence without the DHEADER that XCDR2 would put before it.
    """
    writer = ObjectWriter()
    writer.u32(len(type_objects))
    for type_object in type_objects:
        _write_object(writer, type_object)
    return equivalence_hash(writer.getvalue())


def _write_object(writer: ObjectWriter, type_object: TypeObject) -> None:
    with writer.delimited():
        writer.u8(COMPLETE if type_object.is_complete else MINIMAL)
        body = type_object.body
        part = _Part(writer, is_complete=type_object.is_complete)
        match body:
            case StructObject():
                part.struct(body)
            case UnionObject():
                part.union(body)
            case AliasObject():
                part.alias(body)
            case EnumObject():
                part.enum(body)
            case BitmaskObject():
                part.bitmask(body)
            case BitsetObject():
                part.bitset(body)
            case _:
                raise BadParameter(f"{type(body).__name__}: collections are their own identifiers")


class _Part:
    """The body of one TypeObject; each method writes the kind and what the specification's struct of it holds."""

    def __init__(self, writer: ObjectWriter, *, is_complete: bool) -> None:
        self._writer = writer
        self._is_complete = is_complete

    def struct(self, struct: StructObject) -> None:
        writer = self._writer
        writer.u8(TypeKind.STRUCTURE)
        writer.u16(struct.flags)
        with writer.delimited():
            write_identifier(writer, struct.base or _NO_TYPE)
            self._type_detail(struct.type_name)
        with writer.delimited():
            writer.u32(len(struct.members))
            for member in struct.members:
                with writer.delimited():
                    self._member(member)
                    self._name(member.name, member)

    def union(self, union: UnionObject) -> None:
        writer = self._writer
        writer.u8(TypeKind.UNION)
        writer.u16(union.flags)
        with writer.delimited():
            self._type_detail(union.type_name)
        with writer.delimited():
            writer.u16(union.discriminator_flags)
            write_identifier(writer, union.discriminator)
            self._no_annotations()
        with writer.delimited():
            writer.u32(len(union.cases))
            for case in union.cases:
                with writer.delimited():
                    self._member(case)
                    writer.u32(len(case.labels))
                    for label in case.labels:
                        writer.i32(label)
                    self._name(case.name, case)

    def _member(self, member: MemberObject | CaseObject) -> None:
        self._writer.u32(member.id)
        self._writer.u16(member.flags)
        write_identifier(self._writer, member.type)

    def alias(self, alias: AliasObject) -> None:
        self._writer.u8(TypeKind.ALIAS)
        self._writer.u16(0)
        with self._writer.delimited():
            self._type_detail(alias.type_name)
        with self._writer.delimited():
            self._related(alias.related)

    def _related(self, type_: TypeIdentifier) -> None:
        self._writer.u16(0)
        write_identifier(self._writer, type_)
        self._no_annotations()

    def enum(self, enum: EnumObject) -> None:
        writer = self._writer
        writer.u8(TypeKind.ENUM)
        writer.u16(enum.flags)
        with writer.delimited():
            writer.u16(enum.bit_bound)
            self._type_detail(enum.type_name)
        with writer.delimited():
            writer.u32(len(enum.literals))
            for literal in enum.literals:
                with writer.delimited():
                    with writer.delimited():
                        writer.i32(literal.value)
                        writer.u16(literal.flags)
                    self._name(literal.name)

    def bitmask(self, bitmask: BitmaskObject) -> None:
        writer = self._writer
        writer.u8(TypeKind.BITMASK)
        with writer.delimited():
            writer.u16(bitmask.flags)
            with writer.delimited():
                writer.u16(bitmask.bit_bound)
                self._type_detail(bitmask.type_name)
            with writer.delimited():
                writer.u32(len(bitmask.bitflags))
                for bitflag in bitmask.bitflags:
                    with writer.delimited():
                        writer.u16(bitflag.position)
                        writer.u16(0)
                        self._name(bitflag.name)

    def bitset(self, bitset: BitsetObject) -> None:
        writer = self._writer
        writer.u8(TypeKind.BITSET)
        with writer.delimited():
            writer.u16(0)
            with writer.delimited():
                self._type_detail(bitset.type_name)
            with writer.delimited():
                writer.u32(len(bitset.fields))
                for field in bitset.fields:
                    with writer.delimited():
                        writer.u16(field.position)
                        writer.u16(0)
                        writer.u8(field.width)
                        writer.u8(field.holder)
                        self._name(field.name)

    # --- what only complete TypeObjects have -------------------------------------------------------------

    def _type_detail(self, type_name: str) -> None:
        """CompleteTypeDetail: no annotations, and the name."""
        self._no_annotations()
        if self._is_complete:
            self._writer.string(type_name)

    def _name(self, name: Named, annotated: MemberObject | CaseObject | None = None) -> None:
        """CompleteMemberDetail or MinimalMemberDetail."""
        if not self._is_complete:
            self._writer.octets(name.hash)
            return
        self._writer.string(name.text)
        if annotated is None or (annotated.unit, annotated.limits, annotated.hash_name) == (None, None, None):
            self._no_annotations()
        else:
            self._builtin_annotations(annotated)
            self._writer.boolean(False)  # custom annotations

    def _builtin_annotations(self, member: MemberObject | CaseObject) -> None:
        """AppliedBuiltinMemberAnnotations: four optional members."""
        limits = member.limits or Limits()
        self._writer.boolean(True)
        with self._writer.delimited():
            self._optional_string(member.unit)
            self._optional_number(limits.minimum)
            self._optional_number(limits.maximum)
            self._optional_string(member.hash_name)

    def _optional_string(self, text: str | None) -> None:
        self._writer.boolean(text is not None)
        if text is not None:
            self._writer.string(text)

    def _optional_number(self, number: float | None) -> None:
        self._writer.boolean(number is not None)
        if number is not None:
            write_number(self._writer, number)

    def _no_annotations(self) -> None:
        """Two optional members, builtin and custom annotations, that are not there."""
        if self._is_complete:
            self._writer.skip(2)
