"""The key of a type as types of its own: what identifies an instance, and how the key hash counts it.

DDS-XTypes 1.3 §7.6.8, RTPS 2.5 §9.6.4.8 (key hash).  Two projections of a struct on its key members (nested structs
reduced to theirs, or whole if they have none):

* the *key type* keeps declaration order and extensibility; a payload with the K flag is a sample of it;
* the *canonical key type* is final, with members in the order of their ids: its XCDR2 big-endian octets are "the key"
  in this program, and what an XCDR2 key hash is made of.
"""

from __future__ import annotations

from dataclasses import replace

from .layout import Encoding, largest_size
from .model import (
    ArrayType,
    Case,
    Composite,
    Extensibility,
    IdlType,
    MapType,
    Member,
    Primitive,
    SequenceType,
    StructType,
    UnionType,
    reachable_structs,
)

__all__ = [
    "KEY_HASH_OCTETS",
    "alignments_differ",
    "canonical_key_type",
    "hash_is_digest",
    "key_type",
    "undelimited_key_type",
]

KEY_HASH_OCTETS = 16


def key_type(struct: StructType) -> StructType | None:
    """The type of a key-only payload; None if there is no key."""
    return _Projection(canonical=False).top(struct)


def undelimited_key_type(struct: StructType) -> StructType | None:
    """The key type as if it were final, in declaration order, as Cyclone DDS 0.10 writes key-only payloads."""
    return _Projection(canonical=False, final=True).top(struct)


def canonical_key_type(struct: StructType) -> StructType | None:
    """The final type, ordered by member id, whose octets identify an instance; None if there is no key."""
    return _Projection(canonical=True).top(struct)


class _Projection:
    def __init__(self, *, canonical: bool, final: bool = False) -> None:
        self._canonical = canonical
        self._final = final or canonical
        self._done: dict[int, StructType] = {}
        self._unions: dict[int, UnionType] = {}

    def top(self, struct: StructType) -> StructType | None:
        return self._struct(struct) if any(member.is_key for member in struct.members) else None

    def _struct(self, struct: StructType) -> StructType:
        if id(struct) not in self._done:
            keys = tuple(member for member in struct.members if member.is_key) or struct.members
            chosen = sorted(keys, key=lambda member: member.id) if self._canonical else keys
            self._done[id(struct)] = StructType(
                struct.python_class,
                struct.type_name,
                Extensibility.FINAL if self._final else struct.extensibility,
                lambda: tuple(self._member(member) for member in chosen),
                omitted=tuple(member for member in struct.declared if member not in keys),
            )
        return self._done[id(struct)]

    def _union(self, union: UnionType) -> UnionType:
        """The discriminator is the key where it is marked as one; else the union is, whole."""
        if id(union) not in self._unions:
            discriminator_only = union.discriminator.is_key
            self._unions[id(union)] = UnionType(
                union.python_class,
                union.type_name,
                Extensibility.FINAL if self._final else union.extensibility,
                lambda: (union.discriminator, () if discriminator_only else tuple(map(self._case, union.cases))),
            )
        return self._unions[id(union)]

    def _case(self, case: Case) -> Case:
        return replace(case, type=self._type(case.type))

    def _member(self, member: Member) -> Member:
        return replace(member, type=self._type(member.type))

    def _type(self, type_: IdlType) -> IdlType:
        match type_:
            case StructType():
                return self._struct(type_)
            case SequenceType() | ArrayType():
                return replace(type_, element=self._type(type_.element))
            case UnionType():
                return self._union(type_)
            case _:
                return type_


def hash_is_digest(struct: StructType, canonical: StructType, encoding: Encoding) -> bool:
    """Whether the key hash is an MD5, since the largest possible key exceeds 16 octets.

    Cyclone DDS counts the parameter headers of XCDR1 into the largest key, though no header is hashed; any
    mutable type then exceeds 16 (measured).  We follow, since the peer's choice decides which hash matches.
    """
    if not encoding.is_xcdr2 and any(
        inner.extensibility is Extensibility.MUTABLE for inner in _structs_with_key(struct)
    ):
        return True
    return largest_size(canonical, 0, encoding, limit=KEY_HASH_OCTETS) > KEY_HASH_OCTETS


def _structs_with_key(struct: StructType) -> list[Composite]:
    projected = key_type(struct)
    return [] if projected is None else list(reachable_structs(projected))


def alignments_differ(canonical: StructType) -> bool:
    """Whether XCDR1 and XCDR2 may encode the key differently: there is an item of 8 octets, or a delimiter."""
    return any(_differs(member.type) for struct in reachable_structs(canonical) for member in struct.members)


def _differs(type_: IdlType) -> bool:
    match type_:
        case Primitive():
            return type_.size == 8
        case SequenceType() | ArrayType():
            return not isinstance(type_.element, Primitive) or _differs(type_.element)
        case MapType():
            return True
        case _:
            return getattr(type_, "size", 0) == 8
