"""ReorderBuffer: changes that came before their turn, and the numbers that will never come.

RTPS 2.5 §8.4.10.4 (the statuses of changes_from_writer), which leaves the data structure open; Cyclone DDS
calls it reorder.  One per (local reader, remote writer).

``next_sn`` is the number whose turn it is: all below were delivered, are irrelevant, or are lost.  Above it the buffer
holds changes by number and irrelevant numbers as ranges, so that a GAP over a billion numbers costs as
much as one over two.  Both are bounded: what does not fit is dropped and asked for again later.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Container, Iterator

from ..structure.cache_change import CacheChange
from ..structure.sequence_number import MAX_SET_BITS, NumberSet

__all__ = ["ReorderBuffer"]

_MAX_RANGES = 512


class ReorderBuffer:
    """Bounded in changes (``max_samples``) and in octets of payload (``max_octets``)."""

    __slots__ = ("_changes", "_max_octets", "_max_samples", "_octets", "_range_ends", "_range_starts", "next_sn")

    def __init__(self, *, max_samples: int, max_octets: int) -> None:
        self.next_sn = 1
        self._max_samples = max_samples
        self._max_octets = max_octets
        self._octets = 0
        self._changes: dict[int, CacheChange] = {}
        # Irrelevant numbers beyond next_sn, as disjoint ranges [start, end), ascending.
        self._range_starts: list[int] = []
        self._range_ends: list[int] = []

    def __len__(self) -> int:
        return len(self._changes)

    def __bool__(self) -> bool:
        """Is anything here that the fast path must not overtake?"""
        return bool(self._changes or self._range_starts)

    def __contains__(self, number: object) -> bool:
        """Is this number's change held, or is it irrelevant?"""
        return number in self._changes or (isinstance(number, int) and self.is_irrelevant(number))

    @property
    def octets(self) -> int:
        return self._octets

    def add(self, change: CacheChange) -> bool:
        """Keep a change for later; False when it is known already, or when there is no room.

        Its number must not lie below ``next_sn``.
        """
        number = change.sequence_number
        if number in self:
            return False
        size = len(change.payload)
        if number != self.next_sn and (
            len(self._changes) >= self._max_samples or self._octets + size > self._max_octets
        ):
            return False
        self._changes[number] = change
        self._octets += size
        return True

    def drop_farthest(self, *, beyond: int) -> int:
        """Let the change go that is farthest off, if it lies ``beyond``: returns its number, 0 if there is none.

        What is nearer is wanted sooner; and a number that nobody will ever reach must not keep a place for ever.
        """
        farthest = max(self._changes, default=0)
        if farthest <= beyond:
            return 0
        self._octets -= len(self._changes.pop(farthest).payload)
        return farthest

    @property
    def highest_sn(self) -> int:
        """The highest number that is held; where none is, that before ``next_sn``."""
        return max(self._changes, default=self.next_sn - 1)

    def head(self) -> CacheChange | None:
        """The change whose turn it is, if it is here; steps over irrelevant numbers first."""
        while self._range_starts and self._range_starts[0] <= self.next_sn:
            self.next_sn = max(self.next_sn, self._range_ends[0])
            del self._range_starts[0], self._range_ends[0]
        return self._changes.get(self.next_sn)

    def pop_head(self) -> None:
        """The change whose turn it is was delivered."""
        change = self._changes.pop(self.next_sn)
        self._octets -= len(change.payload)
        self.next_sn += 1

    def add_irrelevant(self, start: int, end: int) -> None:
        """Numbers in [start, end) will never come."""
        start = max(start, self.next_sn)
        if start >= end:
            return
        for number in self._held_within(start, end):
            self._octets -= len(self._changes.pop(number).payload)
        self._merge(start, end)
        if len(self._range_starts) > _MAX_RANGES:  # bounded: the farthest is forgotten and will be told again
            del self._range_starts[-1], self._range_ends[-1]

    def skip_to(self, sequence_number: int) -> int:
        """Nothing below this number is to be had any more: returns how many numbers are lost thereby.

        What is held below it is not lost; it stays, and its turn comes.
        """
        if sequence_number <= self.next_sn:
            return 0
        held = sorted(number for number in self._changes if number < sequence_number)
        irrelevant = sum(
            min(end, sequence_number) - max(start, self.next_sn)
            for start, end in zip(self._range_starts, self._range_ends, strict=True)
            if start < sequence_number and end > self.next_sn
        )
        lost = sequence_number - self.next_sn - len(held) - irrelevant
        holes = zip([self.next_sn, *(number + 1 for number in held)], [*held, sequence_number], strict=True)
        below = [(start, end) for start, end in holes if start < end]
        above = [
            (max(start, sequence_number), end)
            for start, end in zip(self._range_starts, self._range_ends, strict=True)
            if end > sequence_number
        ]
        self._range_starts = [start for start, _ in below + above]
        self._range_ends = [end for _, end in below + above]
        return lost

    def is_irrelevant(self, number: int) -> bool:
        index = bisect_right(self._range_starts, number) - 1
        return index >= 0 and number < self._range_ends[index]

    def missing(self, last_sn: int, excluded: Container[int] = (), above: int = 0) -> NumberSet:
        """The numbers up to ``last_sn`` (inclusive) that neither came nor are irrelevant nor ``excluded``, beyond
        ``above``.

        At most 256 from ``base`` on, which is ``next_sn``: what must not be acknowledged.
        """
        self.head()
        base = self.next_sn
        end = min(last_sn + 1, base + MAX_SET_BITS)
        unknown = self._unknown(max(base, above + 1), end)
        return NumberSet.of(base, (number for number in unknown if number not in excluded))

    def _unknown(self, number: int, end: int) -> Iterator[int]:
        """Numbers from ``number`` to ``end`` (exclusive) that are neither held nor irrelevant."""
        while number < end:
            index = bisect_right(self._range_starts, number) - 1
            if index >= 0 and number < self._range_ends[index]:
                number = self._range_ends[index]
                continue
            if number not in self._changes:
                yield number
            number += 1

    def _held_within(self, start: int, end: int) -> list[int]:
        if end - start < len(self._changes):
            return [number for number in range(start, end) if number in self._changes]
        return [number for number in self._changes if start <= number < end]

    def _merge(self, start: int, end: int) -> None:
        starts, ends = self._range_starts, self._range_ends
        low = bisect_right(ends, start - 1)  # the first range that touches [start, end) or lies beyond
        high = bisect_right(starts, end)  # one past the last that touches it
        if low < high:
            start, end = min(start, starts[low]), max(end, ends[high - 1])
        starts[low:high] = [start]
        ends[low:high] = [end]
