"""What happens to packets on the way: loss, delay, duplication, reordering and blackouts, decided from a seed.

A :class:`Link` is one direction between two ends.  It moves no packets; it is asked once for each and answers when,
and how often, that packet arrives.  The answers depend on the seed, the link's name, the weather and the packet's
number on that link, and on nothing else (blackouts: on the time since the link was made): a run can be had again.
"""

from __future__ import annotations

import random
from dataclasses import asdict, dataclass

__all__ = ["CALM", "Link", "LinkCounters", "Weather"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Weather:
    """Probabilities (0 to 1) and durations (seconds).

    ``jitter`` is the largest addition to ``delay`` and by itself never changes the order of packets; ``reorder`` is the
    probability that a packet is held back by ``reorder_delay``, so that later ones overtake it.  With
    ``blackout_every`` the link is dead for ``blackout_for`` seconds, beginning at times that lie between half and
    one and a half of ``blackout_every`` apart.
    """

    loss: float = 0.0
    delay: float = 0.0
    jitter: float = 0.0
    duplicate: float = 0.0
    reorder: float = 0.0
    reorder_delay: float = 0.02
    blackout_every: float = 0.0
    blackout_for: float = 0.0

    def __post_init__(self) -> None:
        for name in ("loss", "duplicate", "reorder"):
            if not 0.0 <= getattr(self, name) <= 1.0:
                raise ValueError(f"Weather.{name} is a probability from 0 to 1, not {getattr(self, name)!r}")
        for name in ("delay", "jitter", "reorder_delay", "blackout_every", "blackout_for"):
            if getattr(self, name) < 0.0:
                raise ValueError(f"Weather.{name} is a duration of 0 or more seconds, not {getattr(self, name)!r}")


CALM = Weather()
"""Every packet arrives at once, once."""


@dataclass(slots=True)
class LinkCounters:
    """What became of the packets of one link; ``arrivals`` counts copies, the others the packets that were sent."""

    packets: int = 0
    octets: int = 0
    lost: int = 0
    blacked_out: int = 0
    duplicated: int = 0
    reordered: int = 0
    arrivals: int = 0
    overflowed: int = 0

    def __str__(self) -> str:
        return " ".join(f"{name}={count}" for name, count in asdict(self).items())


class Link:
    """One direction from ``source`` to ``destination``; times are seconds on any clock that does not run backwards."""

    def __init__(self, source: str, destination: str, *, weather: Weather, seed: int, now: float) -> None:
        self.name = f"{source}->{destination}"
        self.weather = weather
        self.is_cut = False
        self.counters = LinkCounters()
        self._dice = random.Random(f"{seed}/{self.name}")
        self._calendar = random.Random(f"{seed}/{self.name}/blackouts")
        self._latest_arrival = now
        self._blackout_starts = self._blackout_ends = now
        if weather.blackout_every:
            self._plan_blackout(now)

    def __repr__(self) -> str:
        return f"<Link {self.name} {self.counters}>"

    def set_weather(self, weather: Weather, *, now: float) -> None:
        """The weather from now on.  The dice go on where they are; blackouts are planned anew."""
        self.weather = weather
        self._blackout_starts = self._blackout_ends = now
        if weather.blackout_every:
            self._plan_blackout(now)

    def fate(self, octets: int, now: float) -> list[float]:
        """When the packet that enters now arrives: no time at all if it is lost, two if it is duplicated."""
        # Five numbers for each packet, whatever becomes of it: so that a change of one probability leaves the
        # decisions about the others, and about later packets, as they were.
        loss, jitter, duplicate, second_jitter, reorder = (self._dice.random() for _ in range(5))
        weather, counters = self.weather, self.counters
        counters.packets += 1
        counters.octets += octets
        if self.is_cut or self._is_blacked_out(now):
            counters.blacked_out += 1
            return []
        if loss < weather.loss:
            counters.lost += 1
            return []
        arrivals = [self._in_order(now + weather.delay + jitter * weather.jitter)]
        if duplicate < weather.duplicate:
            counters.duplicated += 1
            arrivals.append(arrivals[0] + second_jitter * weather.jitter)
        if reorder < weather.reorder:
            counters.reordered += 1
            arrivals = [arrival + weather.reorder_delay for arrival in arrivals]
        counters.arrivals += len(arrivals)
        return arrivals

    def _in_order(self, arrival: float) -> float:
        """``arrival``, but not before the packet ahead of it; held back packets are not waited for."""
        self._latest_arrival = max(self._latest_arrival, arrival)
        return self._latest_arrival

    def _is_blacked_out(self, now: float) -> bool:
        if not self.weather.blackout_every:
            return False
        while now >= self._blackout_ends:
            self._plan_blackout(self._blackout_ends)
        return now >= self._blackout_starts

    def _plan_blackout(self, after: float) -> None:
        # At least a millisecond each, so that catching up with the clock takes a bounded number of steps.
        pause = max(0.001, self.weather.blackout_every * (0.5 + self._calendar.random()))
        self._blackout_starts = after + pause
        self._blackout_ends = self._blackout_starts + self.weather.blackout_for
