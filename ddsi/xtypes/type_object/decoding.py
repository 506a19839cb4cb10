"""TypeObjects from the octets that peers send: the mirror of ``encoding.py``, and hostile-safe.

Time and memory are linear in the octets: a count is checked against the octets that are left before anything is made of
it, and collections nest to a bound.  What later versions may add to appendable parts is skipped, as are annotations.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TypeVar

from ...serialization.cursor import Octets
from ..model import Limits
from .cursors import ObjectReader
from .identifiers import PrimitiveIdentifier, TypeIdentifier, read_identifier
from .kinds import COMPLETE, MINIMAL, MemberFlag, TypeKind, member_flags, type_flags
from .objects import (
    AliasObject,
    ArrayObject,
    BitfieldObject,
    BitflagObject,
    BitmaskObject,
    BitsetObject,
    CaseObject,
    EnumObject,
    LiteralObject,
    MapObject,
    MemberObject,
    Named,
    SequenceObject,
    StructObject,
    TypeBody,
    TypeObject,
    UnionObject,
    named,
)
from .parameter_values import read_number

__all__ = ["decode_type_object", "read_type_object"]

LONGEST_NAME = 256
"""The bound of names in the specification's IDL."""

_NO_TYPE = PrimitiveIdentifier(TypeKind.NONE)

_T = TypeVar("_T")


def decode_type_object(octets: Octets, *, little_endian: bool = True) -> TypeObject:
    """The TypeObject at the beginning of ``octets``, leading DHEADER included.  MalformedMessage where there is none.

    Which type it is, the caller finds by hashing the same octets: see ``encoding.equivalence_hash``.
    """
    return read_type_object(ObjectReader(octets, little_endian=little_endian))


def read_type_object(reader: ObjectReader) -> TypeObject:
    with reader.delimited():
        equivalence = reader.u8()
        if equivalence not in (MINIMAL, COMPLETE):
            raise reader.malformed(f"a TypeObject of the kind {equivalence:#x}")
        is_complete = equivalence == COMPLETE
        kind = reader.u8()
        read = _BODIES.get(kind)
        if read is None:
            raise reader.malformed(f"a TypeObject of a type of the kind {kind:#x}")
        return TypeObject(is_complete, read(_Part(reader, is_complete=is_complete)))


_Annotations = tuple[str | None, str | None, Limits | None]


class _Part:
    """The body of one TypeObject, behind its kind."""

    def __init__(self, reader: ObjectReader, *, is_complete: bool) -> None:
        self._reader = reader
        self._is_complete = is_complete

    def struct(self) -> StructObject:
        reader = self._reader
        flags = type_flags(reader.u16())
        with reader.delimited():
            base = read_identifier(reader)
            type_name = self._type_detail()
        return StructObject(flags, None if base == _NO_TYPE else base, self._sequence(self._member), type_name)

    def _member(self) -> MemberObject:
        id_, flags, type_ = self._common()
        name, (hash_name, unit, limits) = self._name_and_annotations()
        return MemberObject(id_, flags, type_, name, hash_name, unit, limits)

    def _common(self) -> tuple[int, MemberFlag, TypeIdentifier]:
        reader = self._reader
        return reader.u32(), member_flags(reader.u16()), read_identifier(reader)

    def union(self) -> UnionObject:
        reader = self._reader
        flags = type_flags(reader.u16())
        with reader.delimited():
            type_name = self._type_detail()
        with reader.delimited():
            discriminator_flags, discriminator = self._element()
        return UnionObject(flags, discriminator_flags, discriminator, self._sequence(self._case), type_name)

    def _case(self) -> CaseObject:
        id_, flags, type_ = self._common()
        labels = tuple(self._reader.i32() for _ in range(self._reader.count(least_octets=4)))
        name, (hash_name, unit, limits) = self._name_and_annotations()
        return CaseObject(id_, flags, type_, labels, name, hash_name, unit, limits)

    def alias(self) -> AliasObject:
        reader = self._reader
        reader.u16()  # flags, of which there are none
        with reader.delimited():
            type_name = self._type_detail()
        with reader.delimited():
            _, related = self._element()
        return AliasObject(related, type_name)

    def enum(self) -> EnumObject:
        reader = self._reader
        flags = type_flags(reader.u16())
        with reader.delimited():
            bit_bound, type_name = reader.u16(), self._type_detail()
        return EnumObject(flags, bit_bound, self._sequence(self._literal), type_name)

    def _literal(self) -> LiteralObject:
        with self._reader.delimited():
            value, flags = self._reader.i32(), member_flags(self._reader.u16())
        return LiteralObject(value, flags, self._name())

    def bitmask(self) -> BitmaskObject:
        reader = self._reader
        with reader.delimited():
            flags = type_flags(reader.u16())
            with reader.delimited():
                bit_bound, type_name = reader.u16(), self._type_detail()
            return BitmaskObject(flags, bit_bound, self._sequence(self._bitflag), type_name)

    def _bitflag(self) -> BitflagObject:
        position, _ = self._reader.u16(), self._reader.u16()
        return BitflagObject(position, self._name())

    def bitset(self) -> BitsetObject:
        reader = self._reader
        with reader.delimited():
            reader.u16()  # flags, of which there are none
            with reader.delimited():
                type_name = self._type_detail()
            return BitsetObject(self._sequence(self._bitfield), type_name)

    def _bitfield(self) -> BitfieldObject:
        reader = self._reader
        position, _, width, holder = reader.u16(), reader.u16(), reader.u8(), reader.u8()
        if holder not in _KINDS:
            raise reader.malformed(f"a bit field of the kind {holder:#x}")
        return BitfieldObject(position, width, TypeKind(holder), self._name())

    # --- collections that have a TypeObject --------------------------------------------------------------

    def sequence(self) -> SequenceObject:
        self._reader.u16()
        bound = self._bound()
        return SequenceObject(self._delimited_element(), bound)

    def array(self) -> ArrayObject:
        reader = self._reader
        with self._array_frame():
            reader.u16()
            with reader.delimited():
                bounds = tuple(reader.u32() for _ in range(reader.count(least_octets=4)))
                self._type_detail()
            return ArrayObject(self._delimited_element(), bounds)

    @contextmanager
    def _array_frame(self) -> Iterator[None]:
        """The complete TypeObject of an array is appendable, the minimal one final."""
        if self._is_complete:
            with self._reader.delimited():
                yield
        else:
            yield

    def map(self) -> MapObject:
        self._reader.u16()
        bound = self._bound()
        key = self._delimited_element()
        return MapObject(key, self._delimited_element(), bound)

    def _bound(self) -> int:
        reader = self._reader
        with reader.delimited():
            bound = reader.u32()
            if self._is_complete and reader.boolean():
                self._type_detail()
        return bound

    def _delimited_element(self) -> TypeIdentifier:
        with self._reader.delimited():
            return self._element()[1]

    # --- parts -------------------------------------------------------------------------------------------

    def _sequence(self, read: Callable[[], _T]) -> tuple[_T, ...]:
        """A sequence of appendable structs."""
        reader = self._reader
        found = []
        with reader.delimited():
            for _ in range(reader.count(least_octets=8)):
                with reader.delimited():
                    found.append(read())
        return tuple(found)

    def _element(self) -> tuple[MemberFlag, TypeIdentifier]:
        """Flags, the type, and in complete TypeObjects annotations."""
        flags, type_ = member_flags(self._reader.u16()), read_identifier(self._reader)
        self._skip_annotations()
        return flags, type_

    def _type_detail(self) -> str:
        """The type's name, empty in a minimal TypeObject."""
        if not self._is_complete:
            return ""
        self._skip_annotations()
        return self._text()

    def _name(self) -> Named:
        if not self._is_complete:
            return Named(bytes(self._reader.octets(4)))
        text = self._text()
        self._skip_annotations()
        return named(text)

    def _name_and_annotations(self) -> tuple[Named, _Annotations]:
        """The name of a member, what ``@hashid`` was given if it was there, its unit and its limits."""
        annotations: _Annotations = None, None, None
        if not self._is_complete:
            return self._name(), annotations
        text = self._text()
        if self._reader.boolean():
            with self._reader.delimited():
                annotations = self._builtin_annotations()
        if self._reader.boolean():
            self._reader.skip_delimited()
        return named(text), annotations

    def _builtin_annotations(self) -> _Annotations:
        reader = self._reader
        unit = self._text() if reader.boolean() else None
        limits: list[float | None] = []
        for _ in range(2):
            limits.append(None)
            if reader.boolean():
                limits[-1] = read_number(reader)
                if limits[-1] is None:  # then its end is not known either, and what follows is left
                    return None, unit, None
        minimum, maximum = limits
        found = None if minimum is None and maximum is None else Limits(minimum, maximum)
        return reader.string() if reader.boolean() else None, unit, found

    def _text(self) -> str:
        text = self._reader.string()
        if len(text) > LONGEST_NAME or not text.isprintable():
            raise self._reader.malformed(f"a name of {len(text)} characters, or with some that cannot be printed")
        return text

    def _skip_annotations(self) -> None:
        """Builtin and custom ones: two optional members, each with a DHEADER."""
        if self._is_complete:
            for _ in range(2):
                if self._reader.boolean():
                    self._reader.skip_delimited()


_KINDS = frozenset(TypeKind)

_BODIES: dict[int, Callable[[_Part], TypeBody]] = {
    TypeKind.STRUCTURE: _Part.struct,
    TypeKind.UNION: _Part.union,
    TypeKind.ALIAS: _Part.alias,
    TypeKind.ENUM: _Part.enum,
    TypeKind.BITMASK: _Part.bitmask,
    TypeKind.BITSET: _Part.bitset,
    TypeKind.SEQUENCE: _Part.sequence,
    TypeKind.ARRAY: _Part.array,
    TypeKind.MAP: _Part.map,
}
