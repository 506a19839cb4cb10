"""The numbers of DDS-XTypes 1.3 Annex B: type kinds, discriminators of identifiers, flags of types and members."""

from __future__ import annotations

import enum

__all__ = [
    "COMPLETE",
    "COMPONENT",
    "EITHER",
    "MINIMAL",
    "Collection",
    "MemberFlag",
    "TypeFlag",
    "TypeKind",
    "member_flags",
    "type_flags",
]

MINIMAL = 0xF1
"""EK_MINIMAL: what follows is the hash of a minimal TypeObject, or is one."""

COMPLETE = 0xF2
"""EK_COMPLETE: the same of a complete TypeObject."""

EITHER = 0xF3
"""EK_BOTH, of a collection whose element needs no hash: its identifier is the same in both kinds."""

COMPONENT = 0xB0
"""TI_STRONGLY_CONNECTED_COMPONENT: one of some types that need each other."""


class TypeKind(enum.IntEnum):
    """TypeKind.  Those up to CHAR16 are also the whole identifier of a primitive type."""

    NONE = 0x00
    BOOLEAN = 0x01
    BYTE = 0x02
    INT16 = 0x03
    INT32 = 0x04
    INT64 = 0x05
    UINT16 = 0x06
    UINT32 = 0x07
    UINT64 = 0x08
    FLOAT32 = 0x09
    FLOAT64 = 0x0A
    FLOAT128 = 0x0B
    INT8 = 0x0C
    UINT8 = 0x0D
    CHAR8 = 0x10
    CHAR16 = 0x11
    STRING8 = 0x20
    STRING16 = 0x21
    ALIAS = 0x30
    ENUM = 0x40
    BITMASK = 0x41
    ANNOTATION = 0x50
    STRUCTURE = 0x51
    UNION = 0x52
    BITSET = 0x53
    SEQUENCE = 0x60
    ARRAY = 0x61
    MAP = 0x62


class Collection(enum.IntEnum):
    """Identifiers that say a type themselves; a LARGE one has bounds above 255, in four octets each."""

    STRING8_SMALL = 0x70
    STRING8_LARGE = 0x71
    STRING16_SMALL = 0x72
    STRING16_LARGE = 0x73
    SEQUENCE_SMALL = 0x80
    SEQUENCE_LARGE = 0x81
    ARRAY_SMALL = 0x90
    ARRAY_LARGE = 0x91
    MAP_SMALL = 0xA0
    MAP_LARGE = 0xA1


class TypeFlag(enum.IntFlag):
    """TypeFlag: extensibility, and how the type was declared."""

    FINAL = 1 << 0
    APPENDABLE = 1 << 1
    MUTABLE = 1 << 2
    NESTED = 1 << 3
    AUTOID_HASH = 1 << 4


class MemberFlag(enum.IntFlag):
    """MemberFlag.  The two lowest bits say what becomes of a value that does not fit: 1 discard the sample, 2 use the
    default, 3 trim."""

    TRY_CONSTRUCT_1 = 1 << 0
    TRY_CONSTRUCT_2 = 1 << 1
    EXTERNAL = 1 << 2
    OPTIONAL = 1 << 3
    MUST_UNDERSTAND = 1 << 4
    KEY = 1 << 5
    DEFAULT = 1 << 6


def member_flags(number: int) -> MemberFlag:
    """Those of a number from the network; bits without a meaning are dropped, since an IntFlag remembers all it saw."""
    return MemberFlag(number & 0x7F)


def type_flags(number: int) -> TypeFlag:
    """As :func:`member_flags`."""
    return TypeFlag(number & 0x1F)
