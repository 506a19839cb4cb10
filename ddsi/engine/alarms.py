"""Alarms: what a participant waits for, and what happens when the time has come.

One table of all timers; each kind says in words what it is for.
"""

from __future__ import annotations

import math
from collections.abc import Hashable
from enum import Enum
from typing import TYPE_CHECKING

from ..discovery.participant_proxy import ParticipantProxy
from ..structure.guid import Guid
from .local_endpoints import LocalWriter
from .timers import Timers

if TYPE_CHECKING:
    from .participant import Participant

__all__ = ["Alarms", "Timer"]


class Timer(Enum):
    """Keys of the timer table are a Timer alone, or (Timer, Guid...)."""

    # Enum's own hash is written in Python and would be asked some ten times for each sample.
    __hash__ = object.__hash__

    SPDP = "announce ourselves"
    LEASE = "a remote participant has been silent for its lease"
    WRITER = "a writer's heartbeat, pace, lifespan or deadline"
    READER = "a reader's lifespan or deadline"
    SUBSCRIBER = "a subscriber has waited long enough for what comes first in its order"
    ACKNACK = "a reader's answer to one writer"
    ASSERTION = "assert automatic liveliness"
    WRITER_LIVELINESS = "a local manual writer was not asserted"
    REMOTE_LIVELINESS = "a remote writer's liveliness lease"
    FLUSH = "queued samples must leave"
    LINGER = "a closed writer has waited long enough for acknowledgment"
    ANNOUNCE = "an endpoint that withdrew what its type is made of is announced again"
    TYPE_LOOKUP = "a participant was asked about types, and has not answered"
    SECURITY = "the hooks asked to be called"


class Alarms:
    """Sets timers by what they are about, and acts when they are due."""

    def __init__(self, engine: Participant) -> None:
        self._engine = engine
        self._timers = Timers()
        self._flush_at = math.inf  # not in the table: it is set and reset with nearly every sample

    def next_deadline(self) -> float:
        deadline = self._timers.next_deadline()
        return deadline if deadline <= self._flush_at else self._flush_at

    @property
    def flush_is_set(self) -> bool:
        return self._flush_at != math.inf

    def run_due(self, now: float) -> None:
        """Act on every timer that is due, earliest first.

        What an alarm arms for this very moment runs too; a bound keeps a timer that re-arms itself at once
        (a mistake of ours) from stopping the program.
        """
        for _ in range(len(self._timers) + 10_000):
            key = self._pop_due(now)
            if key is None:
                return
            self._fire(key, now)

    def _pop_due(self, now: float) -> Hashable | None:
        if self._flush_at <= now and self._flush_at < self._timers.next_deadline():
            self._flush_at = math.inf
            return Timer.FLUSH
        return self._timers.pop_due(now)

    # --- setting -----------------------------------------------------------------------------------------

    def announce_at(self, deadline: float) -> None:
        self._timers.set(Timer.SPDP, deadline)

    def lease(self, participant: ParticipantProxy) -> None:
        self._timers.set((Timer.LEASE, participant.prefix), participant.lease_due)

    def no_lease(self, participant: ParticipantProxy) -> None:
        self._timers.cancel((Timer.LEASE, participant.prefix))

    def writer(self, writer: LocalWriter, deadline: float) -> None:
        writer.timer_due = deadline
        self._timers.set((Timer.WRITER, writer.guid), deadline)

    def reader(self, guid: Guid, deadline: float) -> None:
        self._timers.set((Timer.READER, guid), deadline)

    def subscriber(self, guid: Guid, deadline: float) -> None:
        self._timers.set((Timer.SUBSCRIBER, guid), deadline)

    def answer(self, reader: Guid, writer: Guid, deadline: float) -> None:
        self._timers.set((Timer.ACKNACK, reader, writer), deadline)

    def assertion(self, deadline: float) -> None:
        self._timers.set(Timer.ASSERTION, deadline)

    def writer_liveliness(self, writer: LocalWriter) -> None:
        self._timers.set((Timer.WRITER_LIVELINESS, writer.guid), writer.assertion_due)

    def remote_liveliness(self, guid: Guid, deadline: float) -> None:
        self._timers.set((Timer.REMOTE_LIVELINESS, guid), deadline)

    def flush(self, deadline: float) -> None:
        self._flush_at = deadline

    def linger(self, writer: Guid, deadline: float) -> None:
        self._timers.set((Timer.LINGER, writer), deadline)

    def announce_endpoint(self, guid: Guid, deadline: float) -> None:
        self._timers.set((Timer.ANNOUNCE, guid), deadline)

    def type_lookup(self, prefix: bytes, deadline: float) -> None:
        self._timers.set((Timer.TYPE_LOOKUP, prefix), deadline)

    def security(self, deadline: float) -> None:
        self._timers.set(Timer.SECURITY, deadline)

    def forget_writer(self, guid: Guid) -> None:
        for timer in (Timer.WRITER, Timer.LINGER, Timer.WRITER_LIVELINESS):
            self._timers.cancel((timer, guid))

    def forget_subscriber(self, guid: Guid) -> None:
        self._timers.cancel((Timer.SUBSCRIBER, guid))

    def forget_reader(self, guid: Guid) -> None:
        self._timers.cancel((Timer.READER, guid))

    # --- due ---------------------------------------------------------------------------------------------

    def _fire(self, key: Hashable, now: float) -> None:
        engine = self._engine
        timer, *subjects = key if isinstance(key, tuple) else (key,)
        assert isinstance(timer, Timer)
        engine.recorder.timer(timer.name.lower())
        match timer:
            case Timer.SPDP:
                engine.discovery.announce_due(now)
            case Timer.LEASE:
                engine.discovery.lease_due(subjects[0], now)
            case Timer.ACKNACK:
                engine.answer_writer(subjects[0], subjects[1], now)
            case Timer.READER:
                engine.timeliness.reader_due(subjects[0], now)
            case Timer.SUBSCRIBER:
                engine.presentation.subscriber_due(subjects[0], now)
            case Timer.ASSERTION:
                engine.liveliness.assert_automatic(now)
                self.assertion(now + engine.liveliness.assertion_period())
            case Timer.REMOTE_LIVELINESS:
                engine.liveliness.remote_writer_due(subjects[0], now)
            case Timer.FLUSH:
                engine.flush()
            case Timer.ANNOUNCE:
                engine.discovery.announce_again(subjects[0], now)
            case Timer.TYPE_LOOKUP:
                engine.types.answer_overdue(subjects[0], now)
            case Timer.SECURITY:
                engine.hook_effects.timer_fired()
                engine.hooks.handle_timeout(now)
            case _:
                writer = engine.local_writers.get(subjects[0])
                if writer is not None:
                    self._fire_for_writer(timer, writer, now)

    def _fire_for_writer(self, timer: Timer, writer: LocalWriter, now: float) -> None:
        engine = self._engine
        match timer:
            case Timer.WRITER:
                writer.timer_due = math.inf
                engine.timeliness.writer_due(writer, now)
                engine.writer_answers(writer, writer.behavior.handle_timeout(now))
            case Timer.WRITER_LIVELINESS:
                engine.liveliness.writer_due(writer, now)
            case Timer.LINGER:
                engine.linger_ended(writer, now)
