"""HEARTBEAT and HEARTBEAT_FRAG: what a writer has.  RTPS 2.5 §8.3.8.6, §8.3.8.7, §9.4.5."""

from __future__ import annotations

import struct
from enum import IntFlag

from ..serialization.cursor import Octets, Reader
from ..structure.dataclass import dataclass
from ..structure.guid import EntityId
from .raw_submessage import LITTLE_ENDIAN, SubmessageKind

__all__ = ["Heartbeat", "HeartbeatFlag", "HeartbeatFrag", "HeartbeatGroupInfo"]


class HeartbeatFlag(IntFlag):
    LITTLE_ENDIAN = 0x01
    FINAL = 0x02
    LIVELINESS = 0x04
    GROUP_INFO = 0x08


_FINAL = int(HeartbeatFlag.FINAL)
_LIVELINESS = int(HeartbeatFlag.LIVELINESS)
_GROUP_INFO = int(HeartbeatFlag.GROUP_INFO)

# With the submessage header: kind, flags, length, then the body as drawn below.
_HEARTBEAT = {True: struct.Struct("<BBH4s4siIiII"), False: struct.Struct(">BBH4s4siIiII")}
_GROUP = {True: struct.Struct("<iIiIiI4s4s"), False: struct.Struct(">iIiIiI4s4s")}
_HEARTBEAT_FRAG = {True: struct.Struct("<BBH4s4siIII"), False: struct.Struct(">BBH4s4siIII")}
_HEARTBEAT_LENGTH = 28
_HEARTBEAT_FRAG_LENGTH = 24


@dataclass(frozen=True, slots=True)
class HeartbeatGroupInfo:
    """What a HEARTBEAT says of its writer's group (publisher) when the flag G is set.  The digests are opaque."""

    current_gsn: int
    first_gsn: int
    last_gsn: int
    writer_set: bytes
    secure_writer_set: bytes


@dataclass(frozen=True, slots=True)
class Heartbeat:
    """The writer's announcement of the sequence numbers it holds: ``first_sn`` to ``last_sn``, inclusive.

        0        8        16       24       32
        +--------+--------+--------+--------+
        | 0x07   |X X X X G L F E | length 28
        +--------+--------+--------+--------+
        | readerId                          |
        | writerId                          |
        | firstSN, high then low          8 |
        | lastSN, high then low           8 |
        | count                             |
        +-----------------------------------+
        | currentGSN, firstGSN, lastGSN  24 |   only if G
        | writerSet, secureWriterSet      8 |
        +-----------------------------------+

    ``last_sn`` = ``first_sn`` - 1 says that there is nothing.  ``final`` (F): no ACKNACK is asked for.
    ``liveliness`` (L): the application asserted that it is alive.  ``count``: 32 bits, serial arithmetic.
    """

    reader_id: EntityId
    writer_id: EntityId
    first_sn: int
    last_sn: int
    count: int
    final: bool = False
    liveliness: bool = False
    group_info: HeartbeatGroupInfo | None = None

    def encode(self, *, little_endian: bool = True) -> bytes:
        flags = (
            (LITTLE_ENDIAN if little_endian else 0)
            | (_FINAL if self.final else 0)
            | (_LIVELINESS if self.liveliness else 0)
        )
        length = _HEARTBEAT_LENGTH
        group = b""
        if self.group_info is not None:
            flags |= _GROUP_INFO
            group = _encode_group(self.group_info, little_endian=little_endian)
            length += len(group)
        return (
            _HEARTBEAT[little_endian].pack(
                SubmessageKind.HEARTBEAT,
                flags,
                length,
                self.reader_id,
                self.writer_id,
                self.first_sn >> 32,
                self.first_sn & 0xFFFFFFFF,
                self.last_sn >> 32,
                self.last_sn & 0xFFFFFFFF,
                self.count & 0xFFFFFFFF,
            )
            + group
        )

    @classmethod
    def decode(cls, flags: int, body: Octets) -> Heartbeat:
        """Malformed unless ``first_sn`` >= 1 and ``last_sn`` >= ``first_sn`` - 1 (RTPS 2.5 §8.3.8.6.3)."""
        reader = Reader(body, little_endian=bool(flags & LITTLE_ENDIAN))
        reader_id, writer_id = reader.entity_id(), reader.entity_id()
        first_sn, last_sn = reader.sequence_number(), reader.sequence_number()
        if first_sn < 1 or last_sn < first_sn - 1:
            raise reader.malformed(f"no range of sequence numbers goes from {first_sn} to {last_sn}")
        count = reader.u32()
        group_info = _decode_group(reader) if flags & _GROUP_INFO else None
        final, liveliness = bool(flags & _FINAL), bool(flags & _LIVELINESS)
        return cls(reader_id, writer_id, first_sn, last_sn, count, final, liveliness, group_info)


def _encode_group(group: HeartbeatGroupInfo, *, little_endian: bool) -> bytes:
    return _GROUP[little_endian].pack(
        group.current_gsn >> 32,
        group.current_gsn & 0xFFFFFFFF,
        group.first_gsn >> 32,
        group.first_gsn & 0xFFFFFFFF,
        group.last_gsn >> 32,
        group.last_gsn & 0xFFFFFFFF,
        group.writer_set,
        group.secure_writer_set,
    )


def _decode_group(reader: Reader) -> HeartbeatGroupInfo:
    return HeartbeatGroupInfo(
        reader.sequence_number(),
        reader.sequence_number(),
        reader.sequence_number(),
        bytes(reader.octets(4)),
        bytes(reader.octets(4)),
    )


@dataclass(frozen=True, slots=True)
class HeartbeatFrag:
    """The writer's announcement that it holds the fragments 1 to ``last_fragment_num``, inclusive, of a change.

    0        8        16       24       32
    +--------+--------+--------+--------+
    | 0x13   |X X X X X X X E | length 24
    +--------+--------+--------+--------+
    | readerId                          |
    | writerId                          |
    | writerSN, high then low         8 |
    | lastFragmentNum                   |
    | count                             |
    +-----------------------------------+
    """

    reader_id: EntityId
    writer_id: EntityId
    writer_sn: int
    last_fragment_num: int
    count: int

    def encode(self, *, little_endian: bool = True) -> bytes:
        return _HEARTBEAT_FRAG[little_endian].pack(
            SubmessageKind.HEARTBEAT_FRAG,
            LITTLE_ENDIAN if little_endian else 0,
            _HEARTBEAT_FRAG_LENGTH,
            self.reader_id,
            self.writer_id,
            self.writer_sn >> 32,
            self.writer_sn & 0xFFFFFFFF,
            self.last_fragment_num,
            self.count & 0xFFFFFFFF,
        )

    @classmethod
    def decode(cls, flags: int, body: Octets) -> HeartbeatFrag:
        """Malformed unless both numbers are 1 or more (RTPS 2.5 §8.3.8.7.3)."""
        reader = Reader(body, little_endian=bool(flags & LITTLE_ENDIAN))
        reader_id, writer_id = reader.entity_id(), reader.entity_id()
        writer_sn, last_fragment_num = reader.sequence_number(), reader.u32()
        if writer_sn < 1 or last_fragment_num < 1:
            raise reader.malformed(f"no change has the number {writer_sn} and {last_fragment_num} fragments")
        return cls(reader_id, writer_id, writer_sn, last_fragment_num, reader.u32())
