"""Timers: one heap of deadlines with lazy deletion.

Five hundred participants have thousands of timers; setting, cancelling and finding the next one must not
depend on how many there are.  A timer is named by any hashable key; setting it again replaces it.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Hashable

__all__ = ["Timers"]


class Timers:
    """Deadlines by key, in engine seconds.  Equal deadlines come out in the order in which they were set."""

    __slots__ = ("_deadlines", "_heap", "_order")

    def __init__(self) -> None:
        self._deadlines: dict[Hashable, float] = {}
        self._heap: list[tuple[float, int, Hashable]] = []
        self._order = 0

    def __len__(self) -> int:
        return len(self._deadlines)

    def set(self, key: Hashable, deadline: float) -> None:
        """Arm or re-arm; ``math.inf`` disarms."""
        if deadline == math.inf:
            self._deadlines.pop(key, None)
            return
        if self._deadlines.get(key) == deadline:
            return
        self._deadlines[key] = deadline
        self._order += 1
        heapq.heappush(self._heap, (deadline, self._order, key))
        if len(self._heap) > 64 + 4 * len(self._deadlines):
            self._compact()

    def cancel(self, key: Hashable) -> None:
        self._deadlines.pop(key, None)

    def next_deadline(self) -> float:
        """The earliest deadline, ``math.inf`` when there is none."""
        heap, deadlines = self._heap, self._deadlines
        while heap:
            deadline, _, key = heap[0]
            if deadlines.get(key) == deadline:
                return deadline
            heapq.heappop(heap)
        return math.inf

    def pop_due(self, now: float) -> Hashable | None:
        """The key of the earliest timer that is due, disarmed; None when none is."""
        if self.next_deadline() > now:
            return None
        _, _, key = heapq.heappop(self._heap)
        del self._deadlines[key]
        return key

    def _compact(self) -> None:
        self._heap = [entry for entry in self._heap if self._deadlines.get(entry[2]) == entry[0]]
        heapq.heapify(self._heap)
