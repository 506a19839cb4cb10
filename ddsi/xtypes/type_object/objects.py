"""TypeObjects as values: what a type is made of, as programs tell each other (DDS-XTypes 1.3 §7.3.4 and Annex B).

Minimal and complete TypeObjects are the same classes.  A complete one has names; a minimal one has the first four
octets of the MD5 of each member's name.  Of annotations those that IDL itself has are kept: what ``@hashid`` was given,
``@unit`` and ``@range``; custom ones are not.
"""

from __future__ import annotations

import hashlib

from ...structure.dataclass import dataclass
from ..model import Limits
from .identifiers import TypeIdentifier
from .kinds import MemberFlag, TypeFlag, TypeKind

__all__ = [
    "AliasObject",
    "ArrayObject",
    "BitfieldObject",
    "BitflagObject",
    "BitmaskObject",
    "BitsetObject",
    "CaseObject",
    "EnumObject",
    "LiteralObject",
    "MapObject",
    "MemberObject",
    "Named",
    "SequenceObject",
    "StructObject",
    "TypeBody",
    "TypeObject",
    "UnionObject",
    "name_hash",
    "named",
]


def name_hash(name: str) -> bytes:
    """NameHash: what stands for a member's name in a minimal TypeObject."""
    return hashlib.md5(name.encode(), usedforsecurity=False).digest()[:4]


@dataclass(frozen=True, slots=True)
class Named:
    """A member's name.  ``text`` is empty where only the hash is known."""

    hash: bytes
    text: str = ""

    def __str__(self) -> str:
        return self.text or f"(name with hash {self.hash.hex()})"


def named(text: str) -> Named:
    return Named(name_hash(text), text)


@dataclass(frozen=True, slots=True)
class MemberObject:
    """A member of a struct."""

    id: int
    flags: MemberFlag
    type: TypeIdentifier
    name: Named
    hash_name: str | None = None
    unit: str | None = None
    limits: Limits | None = None


@dataclass(frozen=True, slots=True)
class StructObject:
    """``members`` are the struct's own; those of ``base`` come before them."""

    flags: TypeFlag
    base: TypeIdentifier | None
    members: tuple[MemberObject, ...]
    type_name: str = ""


@dataclass(frozen=True, slots=True)
class CaseObject:
    """A member of a union; ``MemberFlag.DEFAULT`` marks the default one."""

    id: int
    flags: MemberFlag
    type: TypeIdentifier
    labels: tuple[int, ...]
    name: Named
    hash_name: str | None = None
    unit: str | None = None
    limits: Limits | None = None


@dataclass(frozen=True, slots=True)
class UnionObject:
    flags: TypeFlag
    discriminator_flags: MemberFlag
    discriminator: TypeIdentifier
    cases: tuple[CaseObject, ...]
    type_name: str = ""


@dataclass(frozen=True, slots=True)
class AliasObject:
    related: TypeIdentifier
    type_name: str = ""


@dataclass(frozen=True, slots=True)
class LiteralObject:
    """A literal of an enum; ``MemberFlag.DEFAULT`` marks the default one."""

    value: int
    flags: MemberFlag
    name: Named


@dataclass(frozen=True, slots=True)
class EnumObject:
    flags: TypeFlag
    bit_bound: int
    literals: tuple[LiteralObject, ...]
    type_name: str = ""


@dataclass(frozen=True, slots=True)
class BitflagObject:
    """A flag of a bitmask."""

    position: int
    name: Named


@dataclass(frozen=True, slots=True)
class BitmaskObject:
    flags: TypeFlag
    bit_bound: int
    bitflags: tuple[BitflagObject, ...]
    type_name: str = ""


@dataclass(frozen=True, slots=True)
class BitfieldObject:
    """A field of a bitset: ``width`` bits from ``position`` up, which are an integer of the kind ``holder``."""

    position: int
    width: int
    holder: TypeKind
    name: Named


@dataclass(frozen=True, slots=True)
class BitsetObject:
    fields: tuple[BitfieldObject, ...]
    type_name: str = ""


@dataclass(frozen=True, slots=True)
class SequenceObject:
    """A sequence whose element does not fit a plain identifier; no vendor is known to send one."""

    element: TypeIdentifier
    bound: int


@dataclass(frozen=True, slots=True)
class ArrayObject:
    element: TypeIdentifier
    bounds: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class MapObject:
    key: TypeIdentifier
    element: TypeIdentifier
    bound: int


TypeBody = (
    StructObject
    | UnionObject
    | AliasObject
    | EnumObject
    | BitmaskObject
    | BitsetObject
    | SequenceObject
    | ArrayObject
    | MapObject
)


@dataclass(frozen=True, slots=True)
class TypeObject:
    """One type, minimal or complete."""

    is_complete: bool
    body: TypeBody
