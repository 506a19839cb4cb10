"""HookEffects: what security wants done - messages, decisions about participants and pairs, jobs - and when.

The hooks are a part of the engine that cannot act itself (``spi/hooks.py``): they say what they want when they are
asked, which they are whenever effects are drained.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING

from ..behavior.filtering_writer import FilteringWriter
from ..spi import Admission, Decided, HookEffect, Publish, Revoked, SendMessage
from ..spi import Compute as HookCompute
from ..structure.cache_change import CacheChange, ChangeKind
from ..structure.errors import NotAllowedBySecurity
from ..structure.guid import Guid
from ..structure.status import SecurityRevoked
from ..trace.reasons import LossReason, SecurityStep
from .effects import Compute
from .local_endpoints import LocalWriter

if TYPE_CHECKING:
    from .participant import Participant

__all__ = ["HookEffects"]


class HookEffects:
    """``emit`` takes what the shell has to do."""

    def __init__(self, engine: Participant, emit: Callable[[Compute], None]) -> None:
        self._engine = engine
        self._emit = emit
        self._deadline = math.inf
        self._writers: dict[str, LocalWriter] = {}
        """By topic: those that the hooks publish with."""

    def timer_fired(self) -> None:
        """The hooks' deadline is no longer armed, whatever it was."""
        self._deadline = math.inf

    def act(self) -> None:
        """Until they want nothing more: a match that they admit may bring keys that are to be sent."""
        engine = self._engine
        while effects := engine.hooks.drain_effects():
            for effect in effects:
                self._act_on(effect)
            engine.flush()
        deadline = engine.hooks.next_deadline()
        if deadline != self._deadline:
            self._deadline = deadline
            engine.alarms.security(deadline)

    def _act_on(self, effect: HookEffect) -> None:
        engine = self._engine
        match effect:
            case SendMessage(writer_id, change):
                self._send_generic_message(engine.local_writers[Guid.of(engine.guid.prefix, writer_id)], change)
            case Publish():
                self._publish(effect)
            case HookCompute():
                self._emit(Compute(effect.job, partial(self._computed, effect)))
            case Decided(local, remote, admission):
                self._decided(local, remote, admission)
            case Revoked(reason):
                engine.status(engine.guid, SecurityRevoked(reason=reason))
                engine.recorder.security(None, SecurityStep.REVOKED, reason)

    def _computed(self, effect: HookCompute, result: object, now: float) -> None:
        """A job has come back; whether anybody still waits for it, the hooks tell by its generation."""
        engine = self._engine
        engine.now = now
        if not engine.is_closed:
            engine.hooks.computed(effect, result, now)

    def _send_generic_message(self, writer: LocalWriter, change: CacheChange) -> None:
        """What the hooks have to tell another participant; one that never acknowledges is given up.

        The change is told how it went.  Given again, its fragments go again: it is the same message, not another.
        """
        engine, destination, behavior = self._engine, change.destination, writer.behavior
        if change.fragment_octets and isinstance(behavior, FilteringWriter):
            engine.writer_answers(writer, behavior.fragments_again(change))
            return
        if isinstance(behavior, FilteringWriter) and behavior.is_given_up(destination, engine.now):
            engine.discovery.participant_lost(destination, LossReason.UNRESPONSIVE, engine.now)
            return
        written = engine.write(
            writer, change.kind, bytes(change.payload), change.key, engine.now, destination=destination
        )
        change.sequence_number, change.source_timestamp = written.sequence_number, written.source_timestamp
        change.fragment_octets = written.fragment_octets

    def _publish(self, effect: Publish) -> None:
        """What the hooks have to tell everybody, with a writer of theirs on that topic."""
        engine = self._engine
        writer = self._writers.get(effect.topic_name)
        if writer is None:
            try:
                writer = engine.create_writer(
                    effect.topic_name, effect.type_name, effect.qos, engine.now, is_keyed=False
                )
            except NotAllowedBySecurity:
                return
            self._writers[effect.topic_name] = writer
        if writer.guid in engine.local_writers and writer.behavior.lacks_room(len(effect.payload), b"") is None:
            engine.write(writer, ChangeKind.ALIVE, effect.payload, b"", engine.now)

    def _decided(self, local: Guid, remote: Guid, admission: Admission) -> None:
        engine = self._engine
        if local != engine.guid:
            pairs = engine.builtin if local.entity_id.is_builtin else engine.matchmaker
            pairs.decided(local, remote, admission, engine.now)
            return
        proxy = engine.participants.get(remote[:12])
        if proxy is not None:
            engine.admission.decided(proxy, admission, engine.now)
