"""When to send HEARTBEAT and ACKNACK: delays, back-off and suppression.

RTPS 2.5 §8.4.7.1 (heartbeatPeriod, nackResponseDelay, nackSuppressionDuration), §8.4.10.1
(heartbeatResponseDelay).  The specification names the durations and leaves their values open; the ones
below were chosen between what Cyclone DDS (100 ms, doubling) and Fast DDS (3 s, 5 ms) do.  All in seconds.
"""

from __future__ import annotations

import math

__all__ = ["AckNackSchedule", "HeartbeatSchedule"]

HEARTBEAT_PERIOD_MIN = 0.05
HEARTBEAT_PERIOD_MAX = 4.0
HEARTBEATS_BEFORE_BACKOFF = 3
NACK_RESPONSE_SUPPRESSION = 0.005  # the same change is not sent again to the same reader within this

NACK_DELAY = 0.001  # a little reordering is no loss
NACK_REPEAT_MIN = 0.05
NACK_REPEAT_MAX = 2.0
PREEMPTIVE_MIN = 0.02
PREEMPTIVE_MAX = 5.0


class HeartbeatSchedule:
    """Periodic heartbeats while somebody has not acknowledged: 50 ms, doubled after every third, 4 s at most.

    A write and every acknowledgment that makes progress start it over; it stops when all is acknowledged.
    """

    __slots__ = ("_period", "_unanswered", "due")

    def __init__(self) -> None:
        self.due = math.inf
        self._period = HEARTBEAT_PERIOD_MIN
        self._unanswered = 0

    def written(self, now: float) -> None:
        """A change was added.  Leaves a running timer alone: it is never further away than its period."""
        if self.due == math.inf:
            self._start(now)

    def progress(self, now: float, *, complete: bool) -> None:
        """A reader acknowledged more than before; ``complete``: nobody lacks anything any more."""
        if complete:
            self.due = math.inf
        elif self._unanswered:
            self._start(now)

    def sent(self, now: float) -> None:
        """A periodic heartbeat was sent: the next one."""
        self._unanswered += 1
        if self._unanswered % HEARTBEATS_BEFORE_BACKOFF == 0:
            self._period = min(self._period * 2, HEARTBEAT_PERIOD_MAX)
        self.due = now + self._period

    def stop(self) -> None:
        self.due = math.inf

    def _start(self, now: float) -> None:
        self._period = HEARTBEAT_PERIOD_MIN
        self._unanswered = 0
        self.due = now + self._period


class AckNackSchedule:
    """When a reader answers one writer.

    Preemptive ACKNACKs (20 ms, doubling to 5 s) until the first HEARTBEAT, as the writer may think that
    there is nothing to tell.  A wanted acknowledgment goes out at once.  Missing numbers are asked for after
    1 ms, then again at 50 ms, doubling to 2 s; progress starts this over.
    """

    __slots__ = ("_last_nack", "_preemptive", "_preemptive_period", "_repeat", "due")

    def __init__(self) -> None:
        self.due = math.inf
        self._preemptive = True
        self._preemptive_period = PREEMPTIVE_MIN
        self._repeat = NACK_REPEAT_MIN
        self._last_nack = -math.inf

    @property
    def is_preemptive(self) -> bool:
        """Has no HEARTBEAT come yet?"""
        return self._preemptive

    def matched(self, now: float) -> None:
        self.due = now

    def heartbeat_received(self) -> None:
        if self._preemptive:
            self._preemptive = False
            self.due = math.inf

    def preemptive_sent(self, now: float) -> None:
        self.due = now + self._preemptive_period
        self._preemptive_period = min(self._preemptive_period * 2, PREEMPTIVE_MAX)

    def acknowledge(self, now: float) -> None:
        """A HEARTBEAT wants an answer."""
        self.due = min(self.due, now)

    def missing(self, now: float) -> None:
        """Something is known to be missing: ask soon, but not for the same again within the repeat time."""
        self.due = min(self.due, max(now + NACK_DELAY, self._last_nack + self._repeat))

    def nack_sent(self, now: float) -> None:
        """Asked; if nothing comes, ask again later."""
        self._last_nack = now
        self.due = now + self._repeat
        self._repeat = min(self._repeat * 2, NACK_REPEAT_MAX)

    def progress(self) -> None:
        """Something that was missing came."""
        self._repeat = NACK_REPEAT_MIN
        self._last_nack = -math.inf

    def complete(self) -> None:
        """Nothing is missing and nobody waits for an answer."""
        if not self._preemptive:
            self.due = math.inf
            self._repeat = NACK_REPEAT_MIN
            self._last_nack = -math.inf
