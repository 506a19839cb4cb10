"""When to send HEARTBEAT and ACKNACK: delays, back-off and suppression.

RTPS 2.5 §8.4.7.1 (heartbeatPeriod, nackResponseDelay, nackSuppressionDuration), §8.4.10.1
(heartbeatResponseDelay).  The specification names the durations and leaves their values open; the ones
below were chosen between what Cyclone DDS (100 ms, doubling) and Fast DDS (3 s, 5 ms) do.  All in seconds.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

__all__ = ["AckNackSchedule", "HeartbeatSchedule"]

HEARTBEAT_PERIOD_MIN = 0.05
HEARTBEAT_PERIOD_MAX = 4.0
HEARTBEATS_BEFORE_BACKOFF = 3
NACK_RESPONSE_SUPPRESSION = 0.005  # the same change is not sent again to the same reader within this

NACK_DELAY = 0.001  # a little reordering is no loss
NACK_REPEAT_FIRST = 0.05  # before it is known how long an answer takes, at least
NACK_REPEAT_MIN = 0.01
NACK_REPEAT_MAX = 2.0
PREEMPTIVE_MIN = 0.02
PREEMPTIVE_MAX = 5.0
_MAX_TIMED = 512  # how many numbers under way are timed


def heartbeat_period(unanswered: int) -> float:
    """Seconds until the next HEARTBEAT when so many were left unanswered: doubled after every third."""
    return min(HEARTBEAT_PERIOD_MIN * (1 << min(unanswered // HEARTBEATS_BEFORE_BACKOFF, 16)), HEARTBEAT_PERIOD_MAX)


class HeartbeatSchedule:
    """Periodic heartbeats while somebody has not acknowledged: 50 ms, doubled after every third, 4 s at most.

    A write and every acknowledgment that makes progress start it over; it stops when all is acknowledged.
    """

    __slots__ = ("_unanswered", "due")

    def __init__(self) -> None:
        self.due = math.inf
        self._unanswered = 0

    def written(self, now: float) -> None:
        """A change was added, or somebody lacks one: begin, or begin anew after a long silence."""
        if self.due - now > HEARTBEAT_PERIOD_MIN:
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
        self.due = now + heartbeat_period(self._unanswered)

    def stop(self) -> None:
        self.due = math.inf

    def _start(self, now: float) -> None:
        self._unanswered = 0
        self.due = now + HEARTBEAT_PERIOD_MIN


class AckNackSchedule:
    """When a reader answers one writer, and when it may ask for the same again.

    Preemptive ACKNACKs (20 ms, doubling to 5 s) until the first HEARTBEAT, as the writer may think that
    there is nothing to tell.  A wanted acknowledgment goes out at once.  Missing numbers are asked for after
    1 ms.  What was asked for is asked for again only when the answer is overdue: on a long link the repairs are still
    under way while newer losses are noticed, and asking for all of them each time would have each sent many times over.
    How long an answer takes is learnt from the answers; each vain repetition doubles the time, to 2 s.  But a HEARTBEAT
    shows that the writer is there, so what is overdue is asked for again with the answer to it.
    """

    __slots__ = (
        "_asked",
        "_asked_at",
        "_first_guess",
        "_matched_at",
        "_preemptive",
        "_preemptive_at",
        "_preemptive_period",
        "_repeat",
        "_response",
        "asked_sn",
        "due",
        "is_wanted",
        "preemptive_left",
    )

    def __init__(self) -> None:
        self.due = math.inf
        self.preemptive_left = math.inf  # so many times more the writer is called before its first HEARTBEAT
        self.asked_sn = 0  # the highest number that was asked for; what lies above is news
        self.is_wanted = False  # a HEARTBEAT wants an answer, whether anything is missing or not
        self._preemptive = True
        self._matched_at = math.inf
        self._first_guess = NACK_REPEAT_FIRST
        self._preemptive_at = -math.inf
        self._preemptive_period = PREEMPTIVE_MIN
        self._repeat = NACK_REPEAT_FIRST
        self._response = -1.0  # smoothed seconds from asking to the answer; negative: none was measured yet
        self._asked_at = -math.inf
        # Numbers that were asked for: how often, when first, when last.
        self._asked: dict[int, tuple[int, float, float]] = {}

    @property
    def is_preemptive(self) -> bool:
        """Has no HEARTBEAT come yet?"""
        return self._preemptive

    def matched(self, now: float) -> None:
        self.due = now
        self._matched_at = now

    def heartbeat_received(self, now: float) -> None:
        """The first one ends the preemptive ACKNACKs; how long it took is a first guess of how long answers take."""
        if self._preemptive:
            self._preemptive = False
            self.due = math.inf
            self._first_guess = min(max(1.5 * (now - self._matched_at), NACK_REPEAT_FIRST), 10 * NACK_REPEAT_FIRST)
            self._repeat = self._first_guess

    def preemptive_sent(self, now: float) -> None:
        self._preemptive_at = now
        self.preemptive_left -= 1
        self.due = now + self._preemptive_period if self.preemptive_left > 0 else math.inf
        self._preemptive_period = min(self._preemptive_period * 2, PREEMPTIVE_MAX)

    def acknowledge(self, now: float) -> None:
        """A HEARTBEAT wants an answer."""
        self.is_wanted = True
        self.due = min(self.due, now)

    def missing(self, now: float, *, is_news: bool) -> None:
        """Something is known to be missing; ``is_news``: some of it was not asked for yet."""
        if self._preemptive:  # samples come, but the HEARTBEAT that says where they begin was lost
            self.due = min(self.due, max(now + NACK_DELAY, self._preemptive_at + PREEMPTIVE_MIN))
            return
        self.due = min(self.due, now + NACK_DELAY if is_news else max(now + NACK_DELAY, self.repeat_due))

    @property
    def repeat_due(self) -> float:
        """From when on the same may be asked for again."""
        return self._asked_at + self._repeat

    @property
    def is_in_vain(self) -> bool:
        """Was the same asked for again and again, until asking more seldom is not possible?"""
        return self._repeat >= NACK_REPEAT_MAX

    def may_repeat(self, now: float) -> bool:
        """May what was asked for be asked for again: is the answer overdue?"""
        return now >= (self._asked_at + self._answer_time if self.is_wanted else self.repeat_due)

    @property
    def _answer_time(self) -> float:
        """How long an answer takes, generously."""
        if self._response < 0:
            return self._first_guess
        return min(max(2 * self._response + NACK_DELAY, NACK_REPEAT_MIN), NACK_REPEAT_MAX)

    def nack_sent(self, now: float, numbers: Sequence[int], *, is_repeat: bool, next_sn: int) -> None:
        """Asked for these (ascending, not empty); if nothing comes, ask again later.

        ``is_repeat``: for the old ones too, else for news only.  ``next_sn``: the lowest number that is not here.
        """
        if is_repeat and self.asked_sn >= numbers[-1]:
            self._repeat = min(self._repeat * 2, NACK_REPEAT_MAX)
        if is_repeat or next_sn > self.asked_sn:  # else the older ones count on from when they were asked for
            self._asked_at = now
        if len(self._asked) > _MAX_TIMED:
            self._asked.clear()
        for number in numbers:
            times, first, _ = self._asked.get(number, (0, now, now))
            self._asked[number] = (times + 1, first, now)
        self.asked_sn = max(self.asked_sn, numbers[-1])
        self.wait(max(self.repeat_due, now + NACK_DELAY))

    def wait(self, until: float) -> None:
        """Answered what was wanted; more is missing, but it is not yet time to ask for it."""
        self.is_wanted = False
        self.due = until

    def arrived(self, now: float, sequence_number: int) -> None:
        """This number, or a part of it, came.  If it had been asked for, the writer answers, and this is how fast.

        Where it was asked for more than once, nobody can tell which question is answered (Karn's rule for TCP), but
        this much: the time since the last is a lower bound, and of two questions what comes right behind the second
        answers the first, which was then repeated too soon.  Of more than two it does not: where most answers are
        lost, the first may lie seconds back, and who took that for the time of an answer would hardly ask any more.
        """
        if sequence_number > self.asked_sn:
            return
        asked = self._asked.pop(sequence_number, None)
        if asked is not None:
            times, first, last = asked
            if times == 1 or (times == 2 and now - last < self._response / 2):
                elapsed = now - first
                self._response = elapsed if self._response < 0 else self._response * 0.75 + elapsed * 0.25
            else:
                self._response = max(self._response, now - last)
        self._repeat = self._answer_time

    def complete(self) -> None:
        """Nothing is missing and nobody waits for an answer."""
        self.is_wanted = False
        if not self._preemptive:
            self.due = math.inf
            self._asked_at = -math.inf
            self._asked.clear()
