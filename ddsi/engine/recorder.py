"""Recorder: what the engine does, told to a trace; nothing at all when there is none.

The classes of the events are imported with the first event, so a program that does not trace never pays for them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from .. import trace as tracing
from ..behavior.stateful_reader import ChangeSink
from ..discovery.matching import MatchRefusal
from ..structure.cache_change import CacheChange
from ..structure.discovered import DiscoveredEndpointData, DiscoveredParticipantData
from ..structure.guid import Guid
from ..structure.locator import Locator
from ..trace.reasons import DropReason, LossReason, RejectReason, SampleLossReason, SecurityStep, TypeStep
from .effects import SendDatagram

if TYPE_CHECKING:
    from ..trace.sink import TraceSink
    from .participant import Participant

__all__ = ["Recorder"]

Octets = bytes | bytearray | memoryview


class Recorder:
    """One method for each kind of event.  On the way of every datagram and sample ask :attr:`is_on` first."""

    __slots__ = ("_engine", "_prefix", "_sink", "is_on")

    def __init__(self, engine: Participant, sink: TraceSink | None) -> None:
        self._engine = engine
        self._prefix = engine.guid.prefix
        self._sink = sink
        self.is_on = sink is not None

    def _put(self, name: str, *arguments: object) -> None:
        """The event class of this name, with the time and whose engine this is, and its own arguments."""
        if self._sink is not None:
            self._sink(getattr(tracing.events, name)(self._engine.now, self._prefix, *arguments))

    # --- ourselves ---------------------------------------------------------------------------------------

    def created(self) -> None:
        self._put("ParticipantCreated", self._engine.domain_id, self._engine.config.vendor_id)

    def closed(self) -> None:
        self._put("ParticipantClosed")

    def endpoint_created(self, data: DiscoveredEndpointData) -> None:
        if self._sink is not None:
            self._sink(tracing.events.EndpointCreated.of(self._engine.now, self._prefix, data))

    def endpoint_closed(self, guid: Guid) -> None:
        self._put("EndpointClosed", guid)

    def timer(self, name: str) -> None:
        self._put("TimerFired", name, self._engine.now)

    # --- messages ----------------------------------------------------------------------------------------

    def received(self, source: Locator, octets: Octets) -> None:
        self._put("MessageReceived", source, bytes(octets))

    def sent(self, effect: SendDatagram) -> None:
        self._put("MessageSent", effect.destinations, b"".join(effect.parts))

    def dropped(self, reason: DropReason, source: Locator | None, detail: str, remote: Guid | None = None) -> None:
        self._put("Dropped", reason, source, detail, remote)

    # --- discovery and matching --------------------------------------------------------------------------

    def participant(self, data: DiscoveredParticipantData, *, is_new: bool) -> None:
        if self._sink is not None:
            kind = tracing.events.ParticipantDiscovered if is_new else tracing.events.ParticipantChanged
            self._sink(kind.of(self._engine.now, self._prefix, data))

    def participant_lost(self, guid: Guid, reason: LossReason, detail: str) -> None:
        self._put("ParticipantLost", guid, reason, detail)

    def endpoint(self, data: DiscoveredEndpointData, *, is_new: bool) -> None:
        if self._sink is not None:
            kind = tracing.events.EndpointDiscovered if is_new else tracing.events.EndpointChanged
            self._sink(kind.of(self._engine.now, self._prefix, data))

    def endpoint_lost(self, guid: Guid, reason: LossReason) -> None:
        self._put("EndpointLost", guid, reason)

    def matched(self, local: Guid, remote: Guid, topic_name: str) -> None:
        self._put("Matched", local, remote, topic_name)

    def unmatched(self, local: Guid, remote: Guid, topic_name: str, reason: LossReason) -> None:
        self._put("Unmatched", local, remote, topic_name, reason)

    def refused(self, local: Guid, remote: Guid, topic_name: str, refusal: MatchRefusal) -> None:
        """One event for each policy; for a type, a partition or security, one that names it."""
        for reason in refusal.incompatibilities:
            self._put("Incompatible", local, remote, topic_name, reason.policy, reason.offered, reason.requested)
        if not refusal.incompatibilities:
            requested = f"{refusal.requested}: {refusal.detail}" if refusal.detail else refusal.requested
            self._put("Incompatible", local, remote, topic_name, refusal.kind, refusal.offered, requested)

    def types_compared(self, local: Guid, remote: Guid, topic_name: str, step: TypeStep, detail: str) -> None:
        self._put("TypesCompared", local, remote, topic_name, step, detail)

    def security(self, remote: Guid | None, step: SecurityStep, detail: str = "") -> None:
        self._put("SecurityEvent", remote, step, detail)

    # --- data and statuses -------------------------------------------------------------------------------

    def written(self, change: CacheChange) -> None:
        self._put("ChangeWritten", change.writer_guid, change.sequence_number, change.kind, len(change.payload))

    def acknowledged(self, writer: Guid, reader: Guid, sequence_number: int) -> None:
        self._put("Acknowledged", writer, reader, sequence_number)

    def delivering(self, reader: Guid, history: ChangeSink) -> ChangeSink:
        """The reader's history, or with tracing on one that also tells what it was given."""
        return history if self._sink is None else _TracedHistory(self, reader, history)

    def delivered(self, reader: Guid, change: CacheChange) -> None:
        self._put("SampleDelivered", reader, change.writer_guid, change.sequence_number)

    def samples_lost(
        self, reader: Guid, writer: Guid, first: int, last: int, reason: SampleLossReason, detail: str = ""
    ) -> None:
        self._put("SampleLost", reader, writer, first, last, reason, detail)

    def sample_rejected(self, reader: Guid, change: CacheChange, reason: str) -> None:
        if self._sink is not None:
            self._put("SampleRejected", reader, change.writer_guid, change.sequence_number, RejectReason(reason))

    def liveliness(self, reader: Guid, writer: Guid, *, alive: bool) -> None:
        self._put("LivelinessChanged", reader, writer, alive)

    def status(self, entity: Guid, status: object) -> None:
        if self._sink is not None:
            self._put("StatusChanged", entity, type(status).__name__, repr(status))


class _TracedHistory:
    """A ChangeSink before another: a change that it took is an event."""

    __slots__ = ("_history", "_reader", "_recorder")

    def __init__(self, recorder: Recorder, reader: Guid, history: ChangeSink) -> None:
        self._recorder = recorder
        self._reader = reader
        self._history = history

    def add(self, change: CacheChange, now: float) -> bool:
        taken = self._history.add(change, now)
        if taken:
            self._recorder.delivered(self._reader, change)
        return taken
