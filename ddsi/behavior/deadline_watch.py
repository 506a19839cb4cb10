"""DeadlineWatch: which instances of one endpoint missed their DEADLINE.  DDS 1.4 §2.2.3.7.

All instances have the same period, so the one that was heard of longest ago is always the next to miss it: a dict in
that order is enough, and a sample costs a move in it and no timer.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

__all__ = ["DeadlineWatch"]

_SHORTEST_PERIOD_S = 0.001  # nobody can keep a shorter one, and telling of misses would be all that we do


class DeadlineWatch:
    """``due``: when to ask :meth:`missed`, in the engine's seconds.  It may be early, never late."""

    __slots__ = ("_heard_at", "_period", "due")

    def __init__(self, period: float) -> None:
        self._period = max(period, _SHORTEST_PERIOD_S)
        self._heard_at: dict[bytes, float] = {}
        self.due = math.inf

    @classmethod
    def anew(
        cls, before: DeadlineWatch | None, period: float, keys: Iterable[bytes], now: float
    ) -> DeadlineWatch | None:
        """The watch for a policy that may have changed; None: there is no deadline.

        Where it has, the period of each instance begins now.  ``keys``: the instances that are expected where nobody
        watched ``before``.
        """
        if period == math.inf:
            return None
        watch = cls(period)
        if before is not None and before._period == watch._period:
            return before
        for key in before._heard_at if before is not None else keys:
            watch.heard(key, now)
        return watch

    def heard(self, key: bytes, now: float) -> None:
        """A sample of the instance was written, or came: its period begins anew."""
        self._heard_at.pop(key, None)
        self._heard_at[key] = now
        if self.due == math.inf:
            self.due = now + self._period

    def forget(self, key: bytes) -> None:
        """The instance has come to its end: nothing is expected of it."""
        self._heard_at.pop(key, None)

    def missed(self, now: float) -> list[bytes]:
        """The instances whose period has ended; the next one of each begins."""
        missed = []
        for key, heard_at in self._heard_at.items():
            if heard_at + self._period > now:
                break
            missed.append(key)
        for key in missed:
            self.heard(key, now)
        oldest = next(iter(self._heard_at.values()), math.inf)
        self.due = oldest + self._period
        return missed
