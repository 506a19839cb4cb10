"""Time_t and Duration_t: 32 bits of seconds and 32 bits of fraction, 2^-32 s each.

RTPS 2.5 §9.3.2.1 (Time_t), §9.3.2.3 (Duration_t).  Inside the core a time stamp is its 64-bit number of
*ticks* (2^-32 s since the Unix epoch), which is exact and what the wire holds; a duration is a float of
seconds, ``math.inf`` for infinite, as users write it.
"""

from __future__ import annotations

import math
from datetime import UTC, datetime
from typing import Self

__all__ = [
    "DURATION_INFINITE",
    "DURATION_ZERO",
    "TICKS_INVALID",
    "TICKS_PER_SECOND",
    "Time",
    "duration_from_wire",
    "duration_to_wire",
    "ticks_from_nanoseconds",
]

TICKS_PER_SECOND = 1 << 32
TICKS_INVALID = 0xFFFFFFFF_FFFFFFFF
DURATION_ZERO = 0.0
DURATION_INFINITE = math.inf
_NANOSECONDS = 1_000_000_000
_INFINITE_SECONDS, _INFINITE_FRACTION = 0x7FFFFFFF, 0xFFFFFFFF


def ticks_from_nanoseconds(nanoseconds: int) -> int:
    """Nanoseconds since the epoch as ticks, rounded down."""
    seconds, rest = divmod(nanoseconds, _NANOSECONDS)
    return (seconds << 32) + (rest << 32) // _NANOSECONDS


class Time(float):
    """A point in time: a float of seconds since the Unix epoch that also keeps the exact ticks.

    It compares and computes as the float that ``time.time()`` returns; :attr:`nanoseconds` is exact.
    """

    __slots__ = ("ticks",)
    ticks: int

    def __new__(cls, ticks: int) -> Self:
        self = super().__new__(cls, ticks / TICKS_PER_SECOND)
        self.ticks = ticks
        return self

    @classmethod
    def from_seconds(cls, seconds: float) -> Time:
        """From seconds since the epoch; what a float cannot hold (below 0.3 microseconds) is lost."""
        if isinstance(seconds, Time):
            return seconds
        if not 0 <= seconds < 1 << 32:
            raise ValueError(f"a time stamp counts seconds since 1970 (0 to 2^32), not {seconds!r}")
        return cls(int(seconds * TICKS_PER_SECOND))

    @classmethod
    def from_nanoseconds(cls, nanoseconds: int) -> Time:
        return cls(ticks_from_nanoseconds(nanoseconds))

    @property
    def nanoseconds(self) -> int:
        """Nanoseconds since the epoch, rounded to the nearest."""
        return (self.ticks * _NANOSECONDS + (1 << 31)) >> 32

    def to_datetime(self) -> datetime:
        return datetime.fromtimestamp(self, UTC)

    def __reduce__(self) -> tuple[type[Time], tuple[int]]:
        return (type(self), (self.ticks,))


def duration_to_wire(seconds: float) -> tuple[int, int]:
    """A duration as (int32 seconds, uint32 fraction); what is too long for the field becomes infinite."""
    if seconds >= _INFINITE_SECONDS:
        return _INFINITE_SECONDS, _INFINITE_FRACTION
    whole = math.floor(seconds)
    nanoseconds = round((seconds - whole) * _NANOSECONDS)
    if nanoseconds == _NANOSECONDS:
        return whole + 1, 0
    # The next tick up, as Cyclone DDS and Fast DDS do.  Fast DDS rounds down to nanoseconds as it reads: told the tick
    # below, it takes our 0.7 for less than its own 0.7, and does not match a reader that asks for it.
    return whole, -(-nanoseconds * TICKS_PER_SECOND // _NANOSECONDS)


def duration_from_wire(seconds: int, fraction: int) -> float:
    """The reverse of :func:`duration_to_wire`.

    Some stacks write infinite as 7fffffff ffffffff, some as 7fffffff 7fffffff: any fraction will do.
    The result is rounded to the nanosecond, so that policies compare as the numbers that people wrote.
    """
    if seconds == _INFINITE_SECONDS:
        return DURATION_INFINITE
    return round(seconds + fraction / TICKS_PER_SECOND, 9)
