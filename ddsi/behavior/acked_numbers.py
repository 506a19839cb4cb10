"""AckedNumbers: how far a writer's readers have acknowledged; the lowest of hundreds, without looking at each.

A domain of N participants has N readers at every builtin writer, and each of them acknowledges at least once.  A walk
over all readers with every ACKNACK would make discovery cost the cube of N.
"""

from __future__ import annotations

__all__ = ["NOBODY", "AckedNumbers"]

NOBODY = 1 << 63
"""The lowest number where there are no readers: beyond all that there are."""


class AckedNumbers:
    """The highest acknowledged number of each of several readers, which are not told apart.

    Readers that keep up share few numbers, so looking for the next lowest one, when nobody has the present one any
    more, looks at few.
    """

    __slots__ = ("_readers_at", "lowest")

    def __init__(self) -> None:
        self._readers_at: dict[int, int] = {}
        self.lowest = NOBODY

    def add(self, number: int) -> None:
        """One more reader has acknowledged up to here."""
        self._readers_at[number] = self._readers_at.get(number, 0) + 1
        self.lowest = min(self.lowest, number)

    def remove(self, number: int) -> None:
        """One reader fewer has."""
        remaining = self._readers_at[number] - 1
        if remaining:
            self._readers_at[number] = remaining
            return
        del self._readers_at[number]
        if number == self.lowest:
            self.lowest = min(self._readers_at, default=NOBODY)
