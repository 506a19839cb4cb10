"""ACKNACK and NACK_FRAG: what a reader has, and what it lacks.  RTPS 2.5 §8.3.8.1, §8.3.8.12, §9.4.5."""

from __future__ import annotations

import struct
from enum import IntFlag

from ..serialization.cursor import Octets, Reader, bitmap_words
from ..structure.dataclass import dataclass
from ..structure.guid import EntityId
from ..structure.sequence_number import MAX_SET_BITS, NumberSet
from .raw_submessage import LITTLE_ENDIAN, SubmessageKind

__all__ = ["AckNack", "AckNackFlag", "NackFrag"]


class AckNackFlag(IntFlag):
    LITTLE_ENDIAN = 0x01
    FINAL = 0x02


_FINAL = int(AckNackFlag.FINAL)

# With the submessage header, by the number of words in the bitmap.
_WORD_COUNTS = range(MAX_SET_BITS // 32 + 1)
_ACKNACK = {
    True: tuple(struct.Struct(f"<BBH4s4siII{count}II") for count in _WORD_COUNTS),
    False: tuple(struct.Struct(f">BBH4s4siII{count}II") for count in _WORD_COUNTS),
}
_NACK_FRAG = {
    True: tuple(struct.Struct(f"<BBH4s4siIII{count}II") for count in _WORD_COUNTS),
    False: tuple(struct.Struct(f">BBH4s4siIII{count}II") for count in _WORD_COUNTS),
}
_ACKNACK_LENGTH = 24
_NACK_FRAG_LENGTH = 28


@dataclass(frozen=True, slots=True)
class AckNack:
    """The reader's state: all below the base of ``reader_sn_state`` is acknowledged, its members are asked for.

        0        8        16       24       32
        +--------+--------+--------+--------+
        | 0x06   |X X X X X X F E | length 24 + 4 words
        +--------+--------+--------+--------+
        | readerId                          |
        | writerId                          |
        | base, high then low             8 |   readerSNState
        | numBits                           |
        | bitmap, 0 to 8 words ...          |
        | count                             |
        +-----------------------------------+

    ``final`` (F): no HEARTBEAT is asked for.  ``count``: 32 bits, serial arithmetic.
    """

    reader_id: EntityId
    writer_id: EntityId
    reader_sn_state: NumberSet
    count: int
    final: bool = False

    def encode(self, *, little_endian: bool = True) -> bytes:
        numbers = self.reader_sn_state
        words = bitmap_words(numbers)
        return _ACKNACK[little_endian][len(words)].pack(
            SubmessageKind.ACKNACK,
            (LITTLE_ENDIAN if little_endian else 0) | (_FINAL if self.final else 0),
            _ACKNACK_LENGTH + 4 * len(words),
            self.reader_id,
            self.writer_id,
            numbers.base >> 32,
            numbers.base & 0xFFFFFFFF,
            numbers.num_bits,
            *words,
            self.count & 0xFFFFFFFF,
        )

    @classmethod
    def decode(cls, flags: int, body: Octets) -> AckNack:
        """Malformed if the base is below 1 (RTPS 2.5 §8.3.8.1.3), but for the preemptive form.

        Fast DDS, RTI Connext, its Micro edition and CoreDX ask a writer that they have heard nothing of for a
        HEARTBEAT by base 0 and no bits.  Cyclone DDS takes that from just them; nothing is lost by taking it
        from everybody.
        """
        reader = Reader(body, little_endian=bool(flags & LITTLE_ENDIAN))
        reader_id, writer_id = reader.entity_id(), reader.entity_id()
        reader_sn_state = reader.sequence_number_set()
        if reader_sn_state.base < 1 and (reader_sn_state.base < 0 or reader_sn_state.num_bits > 0):
            raise reader.malformed(f"a set of {reader_sn_state.num_bits} numbers from {reader_sn_state.base} on")
        return cls(reader_id, writer_id, reader_sn_state, reader.u32(), bool(flags & _FINAL))


@dataclass(frozen=True, slots=True)
class NackFrag:
    """The reader's request for the fragments of ``writer_sn`` that are members of ``fragment_number_state``.

    0        8        16       24       32
    +--------+--------+--------+--------+
    | 0x12   |X X X X X X X E | length 28 + 4 words
    +--------+--------+--------+--------+
    | readerId                          |
    | writerId                          |
    | writerSN, high then low         8 |
    | base                              |   fragmentNumberState
    | numBits                           |
    | bitmap, 1 to 8 words ...          |
    | count                             |
    +-----------------------------------+
    """

    reader_id: EntityId
    writer_id: EntityId
    writer_sn: int
    fragment_number_state: NumberSet
    count: int

    def encode(self, *, little_endian: bool = True) -> bytes:
        numbers = self.fragment_number_state
        words = bitmap_words(numbers)
        return _NACK_FRAG[little_endian][len(words)].pack(
            SubmessageKind.NACK_FRAG,
            LITTLE_ENDIAN if little_endian else 0,
            _NACK_FRAG_LENGTH + 4 * len(words),
            self.reader_id,
            self.writer_id,
            self.writer_sn >> 32,
            self.writer_sn & 0xFFFFFFFF,
            numbers.base,
            numbers.num_bits,
            *words,
            self.count & 0xFFFFFFFF,
        )

    @classmethod
    def decode(cls, flags: int, body: Octets) -> NackFrag:
        """Malformed unless both numbers are 1 or more and there is at least one bit (RTPS 2.5 §8.3.8.12.3)."""
        reader = Reader(body, little_endian=bool(flags & LITTLE_ENDIAN))
        reader_id, writer_id = reader.entity_id(), reader.entity_id()
        writer_sn, fragments = reader.sequence_number(), reader.fragment_number_set()
        if writer_sn < 1 or fragments.base < 1 or fragments.num_bits < 1:
            raise reader.malformed(
                f"no change {writer_sn} with {fragments.num_bits} fragments from {fragments.base} on"
            )
        return cls(reader_id, writer_id, writer_sn, fragments, reader.u32())
