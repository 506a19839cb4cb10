"""ExpiryWatch: which identities expire when.  DDS-Security 1.1 §8.3.2.11.12 (on_revoke_identity).

By the wall clock, which may be set; so the caller asks again now and then, and nothing here counts seconds.
"""

from __future__ import annotations

import heapq
from itertools import count
from typing import Final

from ..handles import IdentityHandle

__all__ = ["ExpiryWatch"]


class ExpiryWatch:
    """A heap with lazy deletion: what is no longer watched is dropped when it comes up."""

    __slots__ = ("_heap", "_order", "_watched")

    def __init__(self) -> None:
        self._watched: Final[set[IdentityHandle]] = set()
        self._heap: Final[list[tuple[int, int, IdentityHandle]]] = []
        self._order: Final = count()

    def watch(self, handle: IdentityHandle, valid_until: int) -> None:
        """To watch what is watched already changes nothing."""
        if handle not in self._watched:
            self._watched.add(handle)
            heapq.heappush(self._heap, (valid_until, next(self._order), handle))

    def forget(self, handle: IdentityHandle) -> None:
        self._watched.discard(handle)

    def next(self) -> int | None:
        """When the first expires, in nanoseconds since 1970."""
        while self._heap and self._heap[0][2] not in self._watched:
            heapq.heappop(self._heap)
        return self._heap[0][0] if self._heap else None

    def pop(self, now: int) -> tuple[IdentityHandle, int] | None:
        """One that has expired by now, if any, and when; it is told once."""
        valid_until = self.next()
        if valid_until is None or now < valid_until:
            return None
        handle = heapq.heappop(self._heap)[2]
        self.forget(handle)
        return handle, valid_until
