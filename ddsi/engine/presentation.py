"""Presentation: coherent sets and group order, between publishers, subscribers and their endpoints.

DDS 1.4 §2.2.3.6 (PRESENTATION), §2.2.2.4.1.8-11, §2.2.2.5.2.8-10; RTPS 2.5 §8.7.5 and §8.7.6.  What is in a set, a
:class:`~ddsi.behavior.publisher_group.PublisherGroup` decides; what of it is visible, ``CoherentSets`` and
:class:`~ddsi.behavior.subscriber_group.SubscriberGroup`.  This is where they meet writers, readers, and what comes from
the wire.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..behavior.coherent_sets import CoherentSets, MakeVisible, Outlet
from ..behavior.publisher_group import PublisherGroup
from ..behavior.reader_history_cache import ReaderHistoryCache
from ..behavior.stateful_reader import ChangeSink
from ..behavior.subscriber_group import SubscriberGroup
from ..behavior.writer_proxy import WriterProxy
from ..messages.heartbeat import Heartbeat
from ..structure.coherence import Coherence
from ..structure.discovered import DiscoveredWriterData
from ..structure.guid import EntityId, EntityKind, Guid
from ..structure.qos import EndpointQos
from ..structure.qos_policies import AccessScope
from ..trace.reasons import LossReason, SampleLossReason
from .local_endpoints import LocalReader, LocalWriter

if TYPE_CHECKING:
    from .participant import Participant

__all__ = ["Presentation", "announced_group"]


class Presentation:
    """One for each participant."""

    def __init__(self, engine: Participant) -> None:
        self._engine = engine
        self._subscribers: dict[Guid, SubscriberGroup] = {}

    # --- publishers --------------------------------------------------------------------------------------

    def new_publisher(self) -> PublisherGroup:
        """For the writers that are created with it."""
        return PublisherGroup(self._engine.new_guid(EntityKind.WRITER_GROUP).entity_id)

    def writer_created(self, writer: LocalWriter, group: PublisherGroup) -> None:
        policy = writer.data.qos.presentation
        if policy.coherent_access or policy.access_scope is AccessScope.GROUP:  # others are spared the question
            writer.group = group
            group.writer_added(writer.guid, policy)

    def writer_gone(self, writer: LocalWriter) -> None:
        if writer.group is not None:
            writer.group.writer_removed(writer.guid)

    def end_coherent_changes(self, group: PublisherGroup, now: float, *, is_complete: bool = True) -> None:
        """End the innermost set; each writer says so whose readers may wait for it.

        One that is not ``is_complete`` is made so that nobody can take it for whole: a number is left out of it.
        """
        self._engine.now = now
        for guid, coherence in group.end_coherent_changes().items():
            writer = self._engine.local_writers.get(guid)
            if writer is not None and guid not in self._engine.closing:
                if not is_complete and coherence.set_sn:
                    self._leave_out_a_number(writer, coherence, now)
                change = writer.behavior.end_coherent_set(coherence, self._engine.wall_ticks(), now)
                self._engine.change_added(writer, change, now)

    def _leave_out_a_number(self, writer: LocalWriter, coherence: Coherence, now: float) -> None:
        behavior = writer.behavior
        behavior.withdraw(behavior.end_coherent_set(coherence, self._engine.wall_ticks(), now))

    def place(self, writer: LocalWriter, now: float) -> Coherence | None:
        """What goes with the change that is about to be written."""
        group = writer.group
        assert group is not None
        coherence = group.next_place(writer.guid, writer.behavior.cache.last_sn + 1)
        if coherence is not None and coherence.group_sn and writer.data.qos.presentation.ordered_access:
            self._tell_siblings(writer, group, now)
        return coherence

    def _tell_siblings(self, writer: LocalWriter, group: PublisherGroup, now: float) -> None:
        """A subscriber that does not read this topic must learn from the others that nothing is missing before theirs.

        By their HEARTBEATs, soon; for each writer once, however many changes there are until then.
        """
        for guid in group.writers:
            sibling = self._engine.local_writers.get(guid)
            if sibling is None or sibling is writer or sibling.behavior.has_group_news:
                continue
            if sibling.behavior.readers:
                sibling.behavior.has_group_news = True
                sibling.behavior.heartbeat.written(now)
                self._engine.alarms.writer(sibling, sibling.behavior.next_deadline())

    def suspend(self, writer: LocalWriter) -> None:
        """Send nothing new of this writer until :meth:`resume`."""
        writer.behavior.is_suspended = True

    def resume(self, writer: LocalWriter, now: float) -> None:
        engine = self._engine
        engine.now = now
        behavior = writer.behavior
        behavior.is_suspended = False
        engine.local_delivery.written(writer, now)
        engine.writer_answers(writer, behavior.unsent_changes(now))

    # --- subscribers -------------------------------------------------------------------------------------

    def new_subscriber(self) -> SubscriberGroup:
        """For the readers that are created with it."""
        guid = self._engine.new_guid(EntityKind.READER_GROUP)
        alarms = self._engine.alarms
        group = SubscriberGroup(
            guid, max_octets=self._engine.config.reader_octets, on_timer=lambda due: alarms.subscriber(guid, due)
        )
        self._subscribers[guid] = group
        return group

    def subscriber_gone(self, group: SubscriberGroup) -> None:
        self._subscribers.pop(group.guid, None)
        self._engine.alarms.forget_subscriber(group.guid)

    def subscriber_due(self, guid: Guid, now: float) -> None:
        """Something has waited long enough for its turn."""
        group = self._subscribers.get(guid)
        if group is not None:
            self.release(group, now)

    def release(self, group: SubscriberGroup, now: float) -> None:
        """Let become visible what may, and what waited for that."""
        self._engine.now = now
        group.release(now)
        for guid in group.withheld():
            reader = self._engine.local_readers.get(guid)
            if reader is not None:
                self._engine.resume(reader, now)

    # --- readers -----------------------------------------------------------------------------------------

    def sink_for(
        self, reader: LocalReader, history: ReaderHistoryCache, sink: ChangeSink, group: SubscriberGroup | None
    ) -> ChangeSink:
        """What stands before the history of a reader, as its policy asks for; ``sink`` itself if nothing need."""
        policy = reader.data.qos.presentation

        def on_lost(writer: Guid, first: int, count: int, why: str) -> None:
            self._lost(reader, writer, first, count, why)

        outlet: Outlet
        if (
            group is not None
            and policy.access_scope is AccessScope.GROUP
            and (policy.coherent_access or policy.ordered_access)
        ):
            outlet = group.join(reader.guid, policy, history, sink, on_lost)
            reader.subscriber = group
        elif policy.coherent_access and policy.access_scope is not AccessScope.INSTANCE:
            outlet = MakeVisible(history, sink)
        else:
            return sink
        max_octets = self._engine.config.reader_octets
        reader.sets = CoherentSets(outlet, assembles=policy.coherent_access, max_octets=max_octets, on_lost=on_lost)
        return reader.sets

    def _lost(self, reader: LocalReader, writer: Guid, first: int, count: int, why: str) -> None:
        self._engine.status(reader.guid, reader.samples_lost(count, why))
        self._engine.recorder.samples_lost(
            reader.guid, writer, first, first + count - 1, SampleLossReason.INCOMPLETE_SET, why
        )

    def samples_taken(self, reader: LocalReader, now: float) -> None:
        """What the subscriber's order held up for want of room may go on."""
        if reader.subscriber is not None:
            self.release(reader.subscriber, now)

    def reader_gone(self, reader: LocalReader, now: float) -> None:
        if reader.subscriber is not None:
            reader.subscriber.leave(reader.guid)
            self.release(reader.subscriber, now)

    def writer_matched(self, reader: LocalReader, data: DiscoveredWriterData) -> None:
        proxy = reader.behavior.writers.get(data.guid)
        if reader.subscriber is not None and proxy is not None:
            reader.subscriber.writer_matched(reader.guid, proxy)

    def local_writer_matched(self, reader: LocalReader, writer: LocalWriter, now: float) -> None:
        """What a HEARTBEAT would tell: what it wrote before is here, or was not for this reader."""
        if reader.subscriber is not None and writer.group is not None:
            last_sn, group = writer.behavior.cache.last_sn, writer.group
            reader.subscriber.told(reader.guid, writer.guid, last_sn, group.last_of(writer.guid), group.group_sn)
            reader.subscriber.passed(reader.guid, writer.guid, now)

    def writer_unmatched(
        self, reader: LocalReader, writer: Guid, reason: LossReason, now: float, *, may_return: bool
    ) -> None:
        """What it has begun and not ended is forgotten."""
        if reader.sets is not None:
            reader.sets.writer_unmatched(writer, now)
        if reader.subscriber is not None:
            reader.subscriber.writer_unmatched(
                reader.guid, writer, now, has_said_all=reason is LossReason.CLOSED, may_return=may_return
            )

    def heartbeat(self, reader: LocalReader, proxy: WriterProxy, heartbeat: Heartbeat) -> None:
        """It may say how far the writer's publisher is.  To be told before anything is delivered for it."""
        info = heartbeat.group_info
        if reader.subscriber is not None and info is not None:
            reader.subscriber.told(reader.guid, proxy.guid, heartbeat.last_sn, info.last_gsn, info.current_gsn)

    def passed(self, reader: LocalReader, proxy: WriterProxy, now: float) -> None:
        """A GAP or a HEARTBEAT: numbers are known not to come, and something may have waited for that."""
        if reader.sets is not None:
            reader.sets.passed(proxy.guid, proxy.next_sn, now)
        if reader.subscriber is not None:
            reader.subscriber.passed(reader.guid, proxy.guid, now)


def announced_group(qos: EndpointQos, entity_id: EntityId) -> EntityId:
    """The publisher or subscriber of an endpoint, where others have to know it: with access scope GROUP."""
    return entity_id if qos.presentation.access_scope is AccessScope.GROUP else EntityId.UNKNOWN
