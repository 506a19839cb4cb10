"""The cursors of ``serialization`` with what XCDR2 adds: numbers align themselves, and objects have a DHEADER.

DDS-XTypes 1.3 §7.4.3.  Alignment counts from the first octet that the cursor was given, in nested objects too.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from ...serialization.cursor import Reader, Writer

__all__ = ["ObjectReader", "ObjectWriter"]


MOST_ELEMENTS = 1 << 16
"""Members, literals, labels or dimensions that are read of a peer's type."""


class ObjectWriter(Writer):
    """Writes XCDR2, little endian, as hashes are computed."""

    __slots__ = ()

    def u16(self, value: int) -> None:
        self.align(2)
        super().u16(value)

    def u32(self, value: int) -> None:
        self.align(4)
        super().u32(value)

    def i32(self, value: int) -> None:
        self.align(4)
        super().i32(value)

    @contextmanager
    def delimited(self) -> Iterator[None]:
        """What is written meanwhile has a DHEADER before it: the number of its octets."""
        self.u32(0)
        begin = self.position
        yield
        self._buffer[begin - 4 : begin] = (self.position - begin).to_bytes(4, "little")


class ObjectReader(Reader):
    """Reads XCDR2; as its base it raises MalformedMessage and nothing else."""

    __slots__ = ()

    def u16(self) -> int:
        self.align(2)
        return super().u16()

    def u32(self) -> int:
        self.align(4)
        return super().u32()

    def i32(self) -> int:
        self.align(4)
        return super().i32()

    @contextmanager
    def delimited(self) -> Iterator[None]:
        """What is read meanwhile lies behind a DHEADER; octets that are left there are of a later version: skipped."""
        length = self.u32()
        if length > self.remaining:
            raise self.malformed(f"an object of {length} octets, {self.remaining} left")
        outer, self._end = self._end, self._position + length
        yield
        self._position, self._end = self._end, outer

    def count(self, *, least_octets: int) -> int:
        """The number of elements of a sequence; there must be room for them, each of ``least_octets`` or more."""
        count = self.u32()
        if count > MOST_ELEMENTS:
            raise self.malformed(f"a sequence of {count} elements; no type has more than {MOST_ELEMENTS} of anything")
        if count * least_octets > self.remaining:
            raise self.malformed(f"a sequence of {count} elements in {self.remaining} octets")
        return count

    def delimited_octets(self) -> memoryview:
        """An object that is to be looked into later, its DHEADER included; not copied."""
        self.align(4)
        begin = self.position
        self.skip_delimited()
        return self._octets[begin : self.position]

    def skip_delimited(self) -> None:
        """An object that is of no interest."""
        with self.delimited():
            pass
