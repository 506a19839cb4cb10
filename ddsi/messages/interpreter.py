"""The submessages that say how to read those after them: INFO_TS, INFO_SRC, INFO_DST, INFO_REPLY; and PAD.

RTPS 2.5 §8.3.8.8 to §8.3.8.13, §9.4.5 ("interpreter submessages").  Their effect is in ``receiver``.
"""

from __future__ import annotations

import struct
from enum import IntFlag

from ..serialization.cursor import Octets, Reader, Writer
from ..structure.dataclass import dataclass
from ..structure.guid import GuidPrefix
from ..structure.locator import Locator, LocatorKind
from ..structure.vendor import VendorId
from .raw_submessage import LITTLE_ENDIAN, SubmessageKind

__all__ = [
    "InfoDestination",
    "InfoReply",
    "InfoReplyFlag",
    "InfoReplyIp4",
    "InfoSource",
    "InfoTimestamp",
    "InfoTimestampFlag",
    "Pad",
]


class InfoTimestampFlag(IntFlag):
    LITTLE_ENDIAN = 0x01
    INVALIDATE = 0x02


class InfoReplyFlag(IntFlag):
    """The flags of INFO_REPLY and of INFO_REPLY_IP4."""

    LITTLE_ENDIAN = 0x01
    MULTICAST = 0x02


_INVALIDATE = int(InfoTimestampFlag.INVALIDATE)
_MULTICAST = int(InfoReplyFlag.MULTICAST)

# With the submessage header.
_HEAD = {True: struct.Struct("<BBH"), False: struct.Struct(">BBH")}
_TIMESTAMP = {True: struct.Struct("<BBHII"), False: struct.Struct(">BBHII")}
_SOURCE = {True: struct.Struct("<BBHIBB2s12s"), False: struct.Struct(">BBHIBB2s12s")}
_DESTINATION = {True: struct.Struct("<BBH12s"), False: struct.Struct(">BBH12s")}


@dataclass(frozen=True, slots=True)
class InfoTimestamp:
    """The source timestamp, in ticks (2^-32 s since 1970), of the changes that follow; None: they have none.

    0        8        16       24       32
    +--------+--------+--------+--------+
    | 0x09   |X X X X X X I E | length 8, or 0 if I
    +--------+--------+--------+--------+
    | seconds                           |   only if not I
    | fraction                          |
    +-----------------------------------+
    """

    timestamp: int | None

    def encode(self, *, little_endian: bool = True) -> bytes:
        flags = LITTLE_ENDIAN if little_endian else 0
        if self.timestamp is None:
            return _HEAD[little_endian].pack(SubmessageKind.INFO_TS, flags | _INVALIDATE, 0)
        return _TIMESTAMP[little_endian].pack(
            SubmessageKind.INFO_TS, flags, 8, self.timestamp >> 32, self.timestamp & 0xFFFFFFFF
        )

    @classmethod
    def decode(cls, flags: int, body: Octets) -> InfoTimestamp:
        if flags & _INVALIDATE:
            return cls(None)
        return cls(Reader(body, little_endian=bool(flags & LITTLE_ENDIAN)).ticks())


@dataclass(frozen=True, slots=True)
class InfoSource:
    """The participant that the submessages which follow are from, instead of the header's.

    0        8        16       24       32
    +--------+--------+--------+--------+
    | 0x0c   |X X X X X X X E | length 20
    +--------+--------+--------+--------+
    | unused                            |
    | major  | minor  | vendorId        |
    | guidPrefix                     12 |
    +-----------------------------------+
    """

    protocol_version: tuple[int, int]
    vendor_id: VendorId
    guid_prefix: GuidPrefix

    def encode(self, *, little_endian: bool = True) -> bytes:
        flags = LITTLE_ENDIAN if little_endian else 0
        major, minor = self.protocol_version
        return _SOURCE[little_endian].pack(
            SubmessageKind.INFO_SRC, flags, 20, 0, major, minor, self.vendor_id, self.guid_prefix
        )

    @classmethod
    def decode(cls, flags: int, body: Octets) -> InfoSource:
        reader = Reader(body, little_endian=bool(flags & LITTLE_ENDIAN))
        reader.skip(4)
        return cls((reader.u8(), reader.u8()), bytes(reader.octets(2)), reader.guid_prefix())


@dataclass(frozen=True, slots=True)
class InfoDestination:
    """The participant that the submessages which follow are for; all zero: for every one.

    0        8        16       24       32
    +--------+--------+--------+--------+
    | 0x0e   |X X X X X X X E | length 12
    +--------+--------+--------+--------+
    | guidPrefix                     12 |
    +-----------------------------------+
    """

    guid_prefix: GuidPrefix

    def encode(self, *, little_endian: bool = True) -> bytes:
        flags = LITTLE_ENDIAN if little_endian else 0
        return _DESTINATION[little_endian].pack(SubmessageKind.INFO_DST, flags, 12, self.guid_prefix)

    @classmethod
    def decode(cls, flags: int, body: Octets) -> InfoDestination:
        return cls(Reader(body, little_endian=bool(flags & LITTLE_ENDIAN)).guid_prefix())


@dataclass(frozen=True, slots=True)
class InfoReply:
    """Where answers to the submessages that follow are to be sent.

    0        8        16       24       32
    +--------+--------+--------+--------+
    | 0x0f   |X X X X X X M E | length
    +--------+--------+--------+--------+
    | count, then as many Locators, 24 octets each   unicastLocatorList
    | count, then as many Locators ...               multicastLocatorList, only if M
    +-----------------------------------+
    """

    unicast_locators: tuple[Locator, ...]
    multicast_locators: tuple[Locator, ...] | None = None

    def encode(self, *, little_endian: bool = True) -> bytes:
        writer = Writer(little_endian=little_endian)
        flags = LITTLE_ENDIAN if little_endian else 0
        _write_locators(writer, self.unicast_locators)
        if self.multicast_locators is not None:
            flags |= _MULTICAST
            _write_locators(writer, self.multicast_locators)
        return _HEAD[little_endian].pack(SubmessageKind.INFO_REPLY, flags, writer.position) + writer.getvalue()

    @classmethod
    def decode(cls, flags: int, body: Octets) -> InfoReply:
        reader = Reader(body, little_endian=bool(flags & LITTLE_ENDIAN))
        unicast_locators = _read_locators(reader)
        return cls(unicast_locators, _read_locators(reader) if flags & _MULTICAST else None)


def _write_locators(writer: Writer, locators: tuple[Locator, ...]) -> None:
    writer.u32(len(locators))
    for locator in locators:
        writer.locator(locator)


def _read_locators(reader: Reader) -> tuple[Locator, ...]:
    count = reader.u32()
    if count > reader.remaining // 24:  # before any is made: the count is a stranger's
        raise reader.malformed(f"{count} locators in {reader.remaining} octets")
    return tuple(reader.locator() for _ in range(count))


@dataclass(frozen=True, slots=True)
class InfoReplyIp4:
    """As :class:`InfoReply`, for one UDPv4 address each.

        0        8        16       24       32
        +--------+--------+--------+--------+
        | 0x0d   |X X X X X X M E | length 8, or 16 if M
        +--------+--------+--------+--------+
        | address, port, a uint32 each      |   unicastLocator
        | address, port                     |   multicastLocator, only if M
        +-----------------------------------+

    The address is a number here, its first octet on top, and so it is swapped: RTPS 2.5 §9.3.2 (LocatorUDPv4_t).
    """

    unicast_locator: Locator
    multicast_locator: Locator | None = None

    def encode(self, *, little_endian: bool = True) -> bytes:
        writer = Writer(little_endian=little_endian)
        flags = LITTLE_ENDIAN if little_endian else 0
        _write_udp_v4(writer, self.unicast_locator)
        if self.multicast_locator is not None:
            flags |= _MULTICAST
            _write_udp_v4(writer, self.multicast_locator)
        return _HEAD[little_endian].pack(SubmessageKind.INFO_REPLY_IP4, flags, writer.position) + writer.getvalue()

    @classmethod
    def decode(cls, flags: int, body: Octets) -> InfoReplyIp4:
        reader = Reader(body, little_endian=bool(flags & LITTLE_ENDIAN))
        unicast_locator = _read_udp_v4(reader)
        return cls(unicast_locator, _read_udp_v4(reader) if flags & _MULTICAST else None)


def _write_udp_v4(writer: Writer, locator: Locator) -> None:
    writer.u32(int.from_bytes(locator.address[12:], "big"))
    writer.u32(locator.port)


def _read_udp_v4(reader: Reader) -> Locator:
    address, port = reader.u32(), reader.u32()
    return Locator(LocatorKind.UDPV4, port, address.to_bytes(16, "big"))


@dataclass(frozen=True, slots=True)
class Pad:
    """Octets without a meaning, a multiple of 4 of them, to bring what follows to an alignment."""

    length: int = 0

    def encode(self, *, little_endian: bool = True) -> bytes:
        head = _HEAD[little_endian].pack(SubmessageKind.PAD, LITTLE_ENDIAN if little_endian else 0, self.length)
        return head + bytes(self.length)

    @classmethod
    def decode(cls, flags: int, body: Octets) -> Pad:
        return cls(len(body))
