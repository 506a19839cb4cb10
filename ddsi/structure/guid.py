"""GuidPrefix, EntityId and Guid: who is who on the wire.

RTPS 2.5 §8.2.4 (Identifying RTPS entities), §9.3.1 (their octets).  All three *are* octets, subclasses
of ``bytes``: they hash and compare as fast as ``bytes`` do, a slice of a datagram finds them in a dict,
and nothing has to be converted on the way to the wire.  They are never byte-swapped.
"""

from __future__ import annotations

from enum import IntEnum
from typing import Self

__all__ = ["GUID_UNKNOWN", "EntityId", "EntityKind", "Guid", "GuidPrefix"]


class EntityKind(IntEnum):
    """The low six bits of an EntityId's last octet.  RTPS 2.5 §9.3.1.2, table 9.1."""

    UNKNOWN = 0x00
    PARTICIPANT = 0x01
    WRITER_WITH_KEY = 0x02
    WRITER_NO_KEY = 0x03
    READER_NO_KEY = 0x04
    READER_WITH_KEY = 0x07
    WRITER_GROUP = 0x08
    READER_GROUP = 0x09


_BUILTIN_BITS = 0xC0
_WRITER_KINDS = frozenset({EntityKind.WRITER_WITH_KEY, EntityKind.WRITER_NO_KEY})
_READER_KINDS = frozenset({EntityKind.READER_WITH_KEY, EntityKind.READER_NO_KEY})


class _FixedOctets(bytes):
    """``bytes`` of one fixed length; anything else is a programming error and raises ValueError."""

    __slots__ = ()
    LENGTH = 0

    def __new__(cls, octets: bytes | bytearray | memoryview) -> Self:
        self = super().__new__(cls, octets)
        if len(self) != cls.LENGTH:
            raise ValueError(f"a {cls.__name__} has {cls.LENGTH} octets, not {len(self)}")
        return self

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self})"

    def __str__(self) -> str:
        return self.hex()


class GuidPrefix(_FixedOctets):
    """Twelve octets that name a participant and all its entities; octets 0 and 1 are the vendor's id."""

    __slots__ = ()
    LENGTH = 12
    UNKNOWN: GuidPrefix

    def __str__(self) -> str:
        return f"{self[:4].hex()}:{self[4:8].hex()}:{self[8:].hex()}"


GuidPrefix.UNKNOWN = GuidPrefix(bytes(12))


class EntityId(_FixedOctets):
    """Four octets that name an entity within its participant: a key of three, and a kind of one."""

    __slots__ = ()
    LENGTH = 4
    UNKNOWN: EntityId
    PARTICIPANT: EntityId

    @classmethod
    def user(cls, key: int, kind: EntityKind) -> EntityId:
        """The application's entity with this 24-bit key."""
        return cls(key.to_bytes(3, "big") + bytes((kind,)))

    @property
    def kind(self) -> int:
        """The six bits that :class:`EntityKind` names; a number that it does not know stays a number."""
        return self[3] & ~_BUILTIN_BITS

    @property
    def is_builtin(self) -> bool:
        return self[3] & _BUILTIN_BITS == _BUILTIN_BITS

    @property
    def is_writer(self) -> bool:
        return self.kind in _WRITER_KINDS

    @property
    def is_reader(self) -> bool:
        return self.kind in _READER_KINDS

    @property
    def is_keyed(self) -> bool:
        return self.kind in (EntityKind.WRITER_WITH_KEY, EntityKind.READER_WITH_KEY)


EntityId.UNKNOWN = EntityId(bytes(4))
EntityId.PARTICIPANT = EntityId(b"\x00\x00\x01\xc1")


class Guid(_FixedOctets):
    """Sixteen octets: a GuidPrefix and an EntityId."""

    __slots__ = ()
    LENGTH = 16

    @classmethod
    def of(cls, prefix: bytes, entity_id: bytes) -> Guid:
        return cls(prefix + entity_id)

    @property
    def prefix(self) -> GuidPrefix:
        return GuidPrefix(self[:12])

    @property
    def entity_id(self) -> EntityId:
        return EntityId(self[12:])

    @property
    def participant(self) -> Guid:
        """The Guid of the participant that this entity belongs to."""
        return Guid(self[:12] + EntityId.PARTICIPANT)

    def __str__(self) -> str:
        return f"{self[:4].hex()}:{self[4:8].hex()}:{self[8:12].hex()}:{self[12:].hex()}"


GUID_UNKNOWN = Guid(bytes(16))
