"""Bounded cursors: :class:`Reader` over octets that came, :class:`Writer` for octets that go.

RTPS 2.5 §9.3.2 (basic types), §9.4.2 (submessage elements), and the plain CDR (XCDR1) of parameter values.
All octets given to a Reader are untrusted: whatever they hold, it raises :class:`MalformedMessage` and
nothing else, and never reads beyond its end.  Samples of users' types have their own codecs, in ``xtypes``.

The byte order is chosen once, when the cursor is made.  Numbers are read where the cursor stands: RTPS lays
submessages out so that nothing needs padding.  Strings and sequences are the CDR elements of parameter values
and align themselves to 4, counted from ``start``.
"""

from __future__ import annotations

import struct

from ..structure.errors import MalformedMessage
from ..structure.guid import EntityId, Guid, GuidPrefix
from ..structure.locator import Locator
from ..structure.sequence_number import MAX_SET_BITS, NumberSet
from ..structure.time import duration_from_wire, duration_to_wire

__all__ = ["Octets", "Reader", "Writer", "bitmap_words"]

Octets = bytes | bytearray | memoryview
"""What parsers take: anything that slices to octets."""


class _Order:
    """The precompiled formats of one byte order."""

    __slots__ = ("i16", "i32", "locator", "signed_pair", "u16", "u32", "u64", "unsigned_pair", "words")

    def __init__(self, mark: str) -> None:
        self.u16 = struct.Struct(mark + "H")
        self.i16 = struct.Struct(mark + "h")
        self.u32 = struct.Struct(mark + "I")
        self.i32 = struct.Struct(mark + "i")
        self.u64 = struct.Struct(mark + "Q")
        # SequenceNumber_t (high, low) and Duration_t (seconds, fraction): int32 and uint32, each in this order.
        self.signed_pair = struct.Struct(mark + "iI")
        self.unsigned_pair = struct.Struct(mark + "II")
        self.locator = struct.Struct(mark + "iI16s")
        # Bitmaps of 0 to 256 bits: by the number of 32-bit words.
        self.words = tuple(struct.Struct(f"{mark}{count}I") for count in range(MAX_SET_BITS // 32 + 1))


_LITTLE, _BIG = _Order("<"), _Order(">")


class Reader:
    """Reads elements one after the other from ``octets[start:end]``; every method moves :attr:`position`.

    ``position`` and the offset in errors count from the beginning of ``octets``, alignment from ``start``.
    Raises MalformedMessage when ``start`` and ``end`` are not inside the octets: they come from length fields.
    """

    __slots__ = ("_end", "_octets", "_order", "_position", "_start", "little_endian")

    def __init__(self, octets: Octets, *, little_endian: bool, start: int = 0, end: int | None = None) -> None:
        self._octets = memoryview(octets)
        self._end = len(self._octets) if end is None else end
        if not 0 <= start <= self._end <= len(self._octets):
            reason = f"octets {start} to {self._end} do not lie inside the {len(self._octets)} that there are"
            raise MalformedMessage(reason, offset=start)
        self._start = self._position = start
        self._order = _LITTLE if little_endian else _BIG
        self.little_endian = little_endian

    @property
    def position(self) -> int:
        """Where the next element begins."""
        return self._position

    @property
    def remaining(self) -> int:
        """How many octets are left."""
        return self._end - self._position

    def _advance(self, count: int) -> int:
        """Claim ``count`` octets and return where they begin: the one place that checks the bound."""
        position = self._position
        if not 0 <= count <= self._end - position:
            raise MalformedMessage(f"{count} octets expected, {self._end - position} left", offset=position)
        self._position = position + count
        return position

    def malformed(self, reason: str) -> MalformedMessage:
        """The error for an element that ended here and holds what it must not; for the caller to raise."""
        return MalformedMessage(reason, offset=self._position)

    # --- octets and numbers ------------------------------------------------------------------------------

    def octets(self, count: int) -> memoryview:
        """The next ``count`` octets, not copied."""
        position = self._advance(count)
        return self._octets[position : position + count]

    def skip(self, count: int) -> None:
        self._advance(count)

    def align(self, boundary: int) -> None:
        """Skip to the next multiple of ``boundary`` octets from ``start``; the padding may hold anything."""
        self._advance(-(self._position - self._start) % boundary)

    def u8(self) -> int:
        return self._octets[self._advance(1)]

    def boolean(self) -> bool:
        """One octet, 0 or 1; anything else is malformed."""
        value = self._octets[self._advance(1)]
        if value > 1:
            raise self.malformed(f"a boolean is 0 or 1, not {value}")
        return value == 1

    def u16(self) -> int:
        value: int = self._order.u16.unpack_from(self._octets, self._advance(2))[0]
        return value

    def i16(self) -> int:
        value: int = self._order.i16.unpack_from(self._octets, self._advance(2))[0]
        return value

    def u32(self) -> int:
        value: int = self._order.u32.unpack_from(self._octets, self._advance(4))[0]
        return value

    def i32(self) -> int:
        value: int = self._order.i32.unpack_from(self._octets, self._advance(4))[0]
        return value

    def u64(self) -> int:
        value: int = self._order.u64.unpack_from(self._octets, self._advance(8))[0]
        return value

    # --- RTPS elements -----------------------------------------------------------------------------------

    def sequence_number(self) -> int:
        """SequenceNumber_t: int32 high, uint32 low.  Any value; whether it is valid the submessage knows."""
        high, low = self._order.signed_pair.unpack_from(self._octets, self._advance(8))
        return int(high << 32 | low)

    def sequence_number_set(self) -> NumberSet:
        """SequenceNumberSet: base, uint32 numBits (0 to 256), the bitmap's words."""
        return self._number_set(self.sequence_number())

    def fragment_number_set(self) -> NumberSet:
        """FragmentNumberSet: uint32 base, uint32 numBits (0 to 256), the bitmap's words."""
        return self._number_set(self.u32())

    def _number_set(self, base: int) -> NumberSet:
        num_bits = self.u32()
        if num_bits > MAX_SET_BITS:
            raise self.malformed(f"a number set holds at most {MAX_SET_BITS} bits, not {num_bits}")
        word_count = (num_bits + 31) // 32
        bitmap = 0
        for word in self._order.words[word_count].unpack_from(self._octets, self._advance(4 * word_count)):
            bitmap = bitmap << 32 | word
        # The shift drops the bits of the last word that are beyond numBits, which mean nothing.
        return NumberSet(base, num_bits, bitmap >> (32 * word_count - num_bits))

    def ticks(self) -> int:
        """Time_t as its 64-bit number of ticks (2^-32 s since 1970)."""
        seconds, fraction = self._order.unsigned_pair.unpack_from(self._octets, self._advance(8))
        return int(seconds << 32 | fraction)

    def duration(self) -> float:
        """Duration_t in seconds, ``math.inf`` for infinite; one below zero is malformed."""
        seconds, fraction = self._order.signed_pair.unpack_from(self._octets, self._advance(8))
        if seconds < 0:
            raise self.malformed(f"a duration of {seconds} seconds")
        return duration_from_wire(seconds, fraction)

    def locator(self) -> Locator:
        """Locator_t, 24 octets, of whatever kind."""
        return Locator(*self._order.locator.unpack_from(self._octets, self._advance(24)))

    def guid(self) -> Guid:
        return Guid(self.octets(16))

    def guid_prefix(self) -> GuidPrefix:
        return GuidPrefix(self.octets(12))

    def entity_id(self) -> EntityId:
        return EntityId(self.octets(4))

    # --- CDR elements of parameter values ----------------------------------------------------------------

    def string(self) -> str:
        """A CDR string: padding to 4, uint32 length with the NUL, UTF-8 octets, NUL.

        A length of 0 is read as the empty string, as some stacks write it so.
        """
        octets = self.octet_sequence()
        if not octets:
            return ""
        if octets[-1] != 0:
            raise self.malformed("a string does not end with a NUL")
        try:
            return str(octets[:-1], "utf-8")
        except UnicodeDecodeError as error:
            raise self.malformed("a string is not UTF-8") from error

    def octet_sequence(self) -> memoryview:
        """A CDR sequence of octets, not copied: padding to 4, uint32 count, the octets."""
        self.align(4)
        return self.octets(self.u32())

    def sequence_length(self, *, most: int) -> int:
        """The uint32 count of a CDR sequence, after padding to 4; more than ``most`` is malformed."""
        self.align(4)
        count = self.u32()
        if count > most:
            raise self.malformed(f"a sequence of {count} elements, {most} are allowed")
        return count


class Writer:
    """Appends elements to a growing buffer: the mirror of :class:`Reader`, method by method.

    A value that does not fit its field is the caller's mistake and raises ``struct.error``.
    """

    __slots__ = ("_buffer", "_order", "little_endian")

    def __init__(self, *, little_endian: bool = True) -> None:
        self._buffer = bytearray()
        self._order = _LITTLE if little_endian else _BIG
        self.little_endian = little_endian

    @property
    def position(self) -> int:
        """How many octets were written."""
        return len(self._buffer)

    def getvalue(self) -> bytes:
        """All that was written."""
        return bytes(self._buffer)

    # --- octets and numbers ------------------------------------------------------------------------------

    def octets(self, octets: Octets) -> None:
        self._buffer += octets

    def skip(self, count: int) -> None:
        """Append ``count`` zeros."""
        self._buffer += bytes(count)

    def align(self, boundary: int) -> None:
        """Append zeros up to the next multiple of ``boundary`` octets."""
        self._buffer += bytes(-len(self._buffer) % boundary)

    def u8(self, value: int) -> None:
        self._buffer.append(value)

    def boolean(self, value: bool) -> None:
        self._buffer.append(value)

    def u16(self, value: int) -> None:
        self._buffer += self._order.u16.pack(value)

    def i16(self, value: int) -> None:
        self._buffer += self._order.i16.pack(value)

    def u32(self, value: int) -> None:
        self._buffer += self._order.u32.pack(value)

    def i32(self, value: int) -> None:
        self._buffer += self._order.i32.pack(value)

    def u64(self, value: int) -> None:
        self._buffer += self._order.u64.pack(value)

    # --- RTPS elements -----------------------------------------------------------------------------------

    def sequence_number(self, number: int) -> None:
        self._buffer += self._order.signed_pair.pack(number >> 32, number & 0xFFFFFFFF)

    def sequence_number_set(self, numbers: NumberSet) -> None:
        self.sequence_number(numbers.base)
        self._number_set(numbers)

    def fragment_number_set(self, numbers: NumberSet) -> None:
        self.u32(numbers.base)
        self._number_set(numbers)

    def _number_set(self, numbers: NumberSet) -> None:
        words = bitmap_words(numbers)
        self.u32(numbers.num_bits)
        self._buffer += self._order.words[len(words)].pack(*words)

    def ticks(self, ticks: int) -> None:
        self._buffer += self._order.unsigned_pair.pack(ticks >> 32, ticks & 0xFFFFFFFF)

    def duration(self, seconds: float) -> None:
        self._buffer += self._order.signed_pair.pack(*duration_to_wire(seconds))

    def locator(self, locator: Locator) -> None:
        self._buffer += self._order.locator.pack(*locator)

    def guid(self, guid: Guid) -> None:
        self._buffer += guid

    def guid_prefix(self, prefix: GuidPrefix) -> None:
        self._buffer += prefix

    def entity_id(self, entity_id: EntityId) -> None:
        self._buffer += entity_id

    # --- CDR elements of parameter values ----------------------------------------------------------------

    def string(self, text: str) -> None:
        self.octet_sequence(text.encode() + b"\0")

    def octet_sequence(self, octets: Octets) -> None:
        self.align(4)
        self.u32(len(octets))
        self._buffer += octets

    def sequence_length(self, count: int) -> None:
        self.align(4)
        self.u32(count)


def bitmap_words(numbers: NumberSet) -> list[int]:
    """The bitmap as 0 to 8 words of 32 bits, the most significant bit of the first standing for the base."""
    word_count = (numbers.num_bits + 31) // 32
    bitmap = numbers.bitmap << (32 * word_count - numbers.num_bits)
    return [bitmap >> 32 * (word_count - 1 - index) & 0xFFFFFFFF for index in range(word_count)]
