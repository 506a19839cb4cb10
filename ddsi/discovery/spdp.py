"""SPDP: announcing ourselves, and when.  RTPS 2.5 §8.5.3 (The Simple Participant Discovery Protocol).

Announcements go to the multicast group and to configured peers: six in quick succession, as nobody knows who
listens already, then one a period, with a jitter so that hosts that started together do not stay together.
A participant that is new to us gets one of its own at once.  One that was lost is called again for some
minutes, less and less often, so that it comes back by itself after an outage.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from ..structure.locator import Locator

__all__ = ["SpdpAnnouncer"]

_FIRST_INTERVAL_S = 0.1
_QUICK_ANNOUNCEMENTS = 5
_JITTER = 0.1
_LOST_INTERVAL_S = 1.0
_LOST_INTERVAL_MAX_S = 30.0
_LOST_FOR_S = 600.0
_MAX_LOST = 64


class SpdpAnnouncer:
    """Answers "where to announce now?"; the content of the announcement is the engine's."""

    __slots__ = ("_announced_count", "_due", "_lost", "_period", "_random", "destinations")

    def __init__(self, destinations: tuple[Locator, ...], period: float, random: Callable[[], float]) -> None:
        """``destinations``: the multicast group and the peers.  ``random`` gives numbers from 0 to 1."""
        self.destinations = destinations
        self._period = period
        self._random = random
        self._announced_count = 0
        self._due = math.inf
        # Lost participants: where to call, when next, how long between calls, until when.
        self._lost: dict[tuple[Locator, ...], tuple[float, float, float]] = {}

    def start(self, now: float) -> None:
        self._due = now

    def start_again(self, destinations: tuple[Locator, ...], now: float) -> None:
        """We may be somewhere else: announce there, and as at the start, as nobody knows when others can hear us."""
        self.destinations = destinations
        self._announced_count = 0
        self._due = now

    def announce_soon(self, now: float) -> None:
        """What we announce has changed."""
        self._due = min(self._due, now)

    def next_deadline(self) -> float:
        return min(self._due, min((next_call for next_call, _, _ in self._lost.values()), default=math.inf))

    def due_destinations(self, now: float) -> list[Locator]:
        """Where to send the announcement now; arms the next."""
        due: list[Locator] = []
        if self._due <= now:
            due.extend(self.destinations)
            self._due = now + self._next_interval()
        for locators, (next_call, interval, until) in list(self._lost.items()):
            if next_call > now:
                continue
            due.extend(locators)
            if now >= until:
                del self._lost[locators]
            else:
                longer = min(interval * 2, _LOST_INTERVAL_MAX_S)
                self._lost[locators] = (now + interval, longer, until)
        return due

    def participant_lost(self, locators: tuple[Locator, ...], now: float) -> None:
        """A lease ran out: keep calling at these addresses."""
        if not locators:
            return
        while len(self._lost) >= _MAX_LOST:
            del self._lost[next(iter(self._lost))]
        self._lost[locators] = (now + _LOST_INTERVAL_S, _LOST_INTERVAL_S, now + _LOST_FOR_S)

    def participant_found(self, locators: tuple[Locator, ...]) -> None:
        self._lost.pop(locators, None)

    def _next_interval(self) -> float:
        self._announced_count += 1
        if self._announced_count <= _QUICK_ANNOUNCEMENTS:
            return min(_FIRST_INTERVAL_S * 2.0 ** (self._announced_count - 1), self._period)
        return self._period * (1 + _JITTER * (2 * self._random() - 1))
