"""GAP: sequence numbers that a reader need not wait for.  RTPS 2.5 §8.3.8.4, §9.4.5."""

from __future__ import annotations

import struct
from enum import IntFlag

from ..serialization.cursor import Octets, Reader, bitmap_words
from ..structure.dataclass import dataclass
from ..structure.guid import EntityId
from ..structure.sequence_number import MAX_SET_BITS, NumberSet
from .raw_submessage import LITTLE_ENDIAN, SubmessageKind

__all__ = ["Gap", "GapFlag", "GapGroupInfo"]


class GapFlag(IntFlag):
    LITTLE_ENDIAN = 0x01
    GROUP_INFO = 0x02
    FILTERED_COUNT = 0x04


_GROUP_INFO = int(GapFlag.GROUP_INFO)
_FILTERED_COUNT = int(GapFlag.FILTERED_COUNT)

# With the submessage header, by the number of words in the bitmap.
_GAP = {
    True: tuple(struct.Struct(f"<BBH4s4siIiII{count}I") for count in range(MAX_SET_BITS // 32 + 1)),
    False: tuple(struct.Struct(f">BBH4s4siIiII{count}I") for count in range(MAX_SET_BITS // 32 + 1)),
}
_GROUP = {True: struct.Struct("<iIiI"), False: struct.Struct(">iIiI")}
_COUNT = {True: struct.Struct("<I"), False: struct.Struct(">I")}
_GAP_LENGTH = 28


@dataclass(frozen=True, slots=True)
class GapGroupInfo:
    """The group sequence numbers that the gap stands for, both ends inclusive, when the flag G is set."""

    gap_start_gsn: int
    gap_end_gsn: int


@dataclass(frozen=True, slots=True)
class Gap:
    """Irrelevant are the numbers from ``gap_start`` up to, not including, the base of ``gap_list``, and its members.

        0        8        16       24       32
        +--------+--------+--------+--------+
        | 0x08   |X X X X X C G E | length 28 + 4 words
        +--------+--------+--------+--------+
        | readerId                          |
        | writerId                          |
        | gapStart, high then low         8 |
        | base, high then low             8 |   gapList
        | numBits                           |
        | bitmap, 0 to 8 words ...          |
        +-----------------------------------+
        | gapStartGSN, gapEndGSN         16 |   only if G
        | filteredCount                     |   only if C
        +-----------------------------------+

    A base below ``gap_start`` leaves the range empty: then only the members count.
    """

    reader_id: EntityId
    writer_id: EntityId
    gap_start: int
    gap_list: NumberSet
    group_info: GapGroupInfo | None = None
    filtered_count: int | None = None

    def encode(self, *, little_endian: bool = True) -> bytes:
        flags = LITTLE_ENDIAN if little_endian else 0
        tail = b""
        group = self.group_info
        if group is not None:
            flags |= _GROUP_INFO
            start, end = group.gap_start_gsn, group.gap_end_gsn
            tail = _GROUP[little_endian].pack(start >> 32, start & 0xFFFFFFFF, end >> 32, end & 0xFFFFFFFF)
        if self.filtered_count is not None:
            flags |= _FILTERED_COUNT
            tail += _COUNT[little_endian].pack(self.filtered_count)
        words = bitmap_words(self.gap_list)
        return (
            _GAP[little_endian][len(words)].pack(
                SubmessageKind.GAP,
                flags,
                _GAP_LENGTH + 4 * len(words) + len(tail),
                self.reader_id,
                self.writer_id,
                self.gap_start >> 32,
                self.gap_start & 0xFFFFFFFF,
                self.gap_list.base >> 32,
                self.gap_list.base & 0xFFFFFFFF,
                self.gap_list.num_bits,
                *words,
            )
            + tail
        )

    @classmethod
    def decode(cls, flags: int, body: Octets) -> Gap:
        """Malformed unless ``gap_start`` and the list's base are 1 or more (RTPS 2.5 §8.3.8.4.3)."""
        reader = Reader(body, little_endian=bool(flags & LITTLE_ENDIAN))
        reader_id, writer_id = reader.entity_id(), reader.entity_id()
        gap_start, gap_list = reader.sequence_number(), reader.sequence_number_set()
        if gap_start < 1 or gap_list.base < 1:
            raise reader.malformed(f"a gap from {gap_start} to {gap_list.base}")
        group_info = None
        if flags & _GROUP_INFO:
            group_info = GapGroupInfo(reader.sequence_number(), reader.sequence_number())
        filtered_count = reader.u32() if flags & _FILTERED_COUNT else None
        return cls(reader_id, writer_id, gap_start, gap_list, group_info, filtered_count)
