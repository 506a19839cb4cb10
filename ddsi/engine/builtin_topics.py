"""BuiltinTopics: our endpoints of the builtin topics, their matches with others' endpoints, and what comes in by them.

RTPS 2.5 §8.5.4.3 (no discovery of these: a participant's announcement says which it has), DDS-Security 1.1 §8.8.
They match without a judgement of QoS, but never without asking security; where keys are under way, the pair waits.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING

from ..behavior.stateful_reader import StatefulReader
from ..behavior.stateless_reader import StatelessReader
from ..discovery.builtin_endpoints import BUILTIN_TOPICS, BuiltinTopic, Delivery, Stage
from ..discovery.participant_proxy import ParticipantProxy
from ..spi import ADMITTED, PENDING, Admission, Outcome, Refused
from ..structure import builtin_entity_ids as ids
from ..structure.builtin_entity_ids import BuiltinEndpoints
from ..structure.cache_change import CacheChange
from ..structure.discovered import DiscoveredReaderData, DiscoveredWriterData
from ..structure.guid import EntityId, Guid
from ..structure.status import SecurityRefused
from ..structure.vendor import OUR_VENDOR_ID, VendorId
from ..trace.reasons import SecurityStep
from .local_endpoints import LocalReader, LocalWriter

if TYPE_CHECKING:
    from .participant import Participant

__all__ = ["BuiltinTopics"]

EndpointData = DiscoveredWriterData | DiscoveredReaderData

# Most participants never ask about types.  A writer that has nothing to say is called for some hundred milliseconds and
# then left alone: when it has, its sample or its HEARTBEAT will tell.
_SELDOM = frozenset(topic.name for topic in BUILTIN_TOPICS if topic.delivery is Delivery.ADDRESSED)
_CALLS = 4


class _Inbox:
    """A ChangeSink for a builtin topic: changes wait here until the datagram has been read to its end."""

    __slots__ = ("_reader_id", "_waiting")

    def __init__(self, reader_id: EntityId, waiting: list[tuple[EntityId, CacheChange]]) -> None:
        self._reader_id = reader_id
        self._waiting = waiting

    def add(self, change: CacheChange, now: float) -> bool:
        self._waiting.append((self._reader_id, change))
        return True


class BuiltinTopics:
    """Of one participant.  ``waiting``: changes that came in, in order, with the reader that they came to."""

    def __init__(self, engine: Participant) -> None:
        self._engine = engine
        self._topics: list[BuiltinTopic] = []
        self._pending: dict[tuple[Guid, Guid], EndpointData] = {}
        self.waiting: list[tuple[EntityId, CacheChange]] = []
        discovery, liveliness = engine.discovery, engine.liveliness
        self._takers: dict[EntityId, Callable[[CacheChange, float], None]] = {
            ids.SEDP_PUBLICATIONS_READER: partial(discovery.receive_publication, is_secure=False),
            ids.SEDP_PUBLICATIONS_SECURE_READER: partial(discovery.receive_publication, is_secure=True),
            ids.SEDP_SUBSCRIPTIONS_READER: partial(discovery.receive_subscription, is_secure=False),
            ids.SEDP_SUBSCRIPTIONS_SECURE_READER: partial(discovery.receive_subscription, is_secure=True),
            ids.PARTICIPANT_MESSAGE_READER: partial(liveliness.receive_participant_message, is_secure=False),
            ids.PARTICIPANT_MESSAGE_SECURE_READER: partial(liveliness.receive_participant_message, is_secure=True),
            ids.SPDP_SECURE_READER: discovery.receive_secure_spdp,
            ids.TYPE_LOOKUP_REQUEST_READER: partial(engine.types.receive_request, is_secure=False),
            ids.TYPE_LOOKUP_REQUEST_SECURE_READER: partial(engine.types.receive_request, is_secure=True),
            ids.TYPE_LOOKUP_REPLY_READER: engine.types.receive_reply,
            ids.TYPE_LOOKUP_REPLY_SECURE_READER: engine.types.receive_reply,
        }

    def create(self, announced: BuiltinEndpoints) -> None:
        """Our endpoints: those whose bits we announce, and no others."""
        for topic in BUILTIN_TOPICS:
            if topic.announcer in announced:
                self._engine.add_writer(_writer_data(topic, self._guid(topic.writer_id)), filters=topic.filters)
            if topic.detector in announced:
                reader = self._engine.add_reader(
                    _reader_data(topic, self._guid(topic.reader_id)),
                    _Inbox(topic.reader_id, self.waiting),
                    None,
                    behavior_class=StatelessReader if topic.delivery is Delivery.STATELESS else StatefulReader,
                )
                reader.uses_filter = topic.is_directed
            if announced & (topic.announcer | topic.detector):
                self._topics.append(topic)

    def writer(self, writer_id: EntityId) -> LocalWriter | None:
        """Our writer of this id, if we have it."""
        return self._engine.local_writers.get(self._guid(writer_id))

    def reader(self, reader_id: EntityId) -> LocalReader | None:
        return self._engine.local_readers.get(self._guid(reader_id))

    def process_waiting(self, now: float) -> None:
        """Act on what came in."""
        waiting = list(self.waiting)
        self.waiting.clear()
        for reader_id, change in waiting:
            take = self._takers.get(reader_id)
            if take is not None:
                take(change, now)
                continue
            outcome = self._engine.hooks.receive_message(change, now)
            if isinstance(outcome, Outcome):
                self._engine.inbound.undecodable(outcome, None)

    # --- matching ----------------------------------------------------------------------------------------

    def match(self, proxy: ParticipantProxy, stage: Stage, now: float) -> None:
        """Match the endpoints of this stage with those that the participant announced.  Harmless when done already."""
        announced = proxy.data.builtin_endpoints
        for topic in self._topics:
            if topic.stage is not stage:
                continue
            writer, reader = self.writer(topic.writer_id), self.reader(topic.reader_id)
            if writer is not None and topic.detector in announced:
                reader_data = _reader_data(topic, Guid.of(proxy.prefix, topic.reader_id), proxy.vendor_id)
                if reader_data.guid not in writer.behavior.readers:
                    self._decide(writer.guid, reader_data, self._engine.hooks.match(writer.guid, reader_data), now)
            if reader is not None and topic.announcer in announced:
                writer_data = _writer_data(topic, Guid.of(proxy.prefix, topic.writer_id), proxy.vendor_id)
                if writer_data.guid not in reader.behavior.writers:
                    self._decide(reader.guid, writer_data, self._engine.hooks.match(reader.guid, writer_data), now)

    def decided(self, local: Guid, remote: Guid, admission: Admission, now: float) -> None:
        """Security made up its mind about a pair that was pending; or, matched already, the pair is to begin anew."""
        data = self._pending.pop((local, remote), None) or self._unmatch(local, remote, now)
        if data is not None:
            self._decide(local, data, admission, now)

    def _decide(self, local: Guid, data: EndpointData, admission: Admission, now: float) -> None:
        engine = self._engine
        if isinstance(admission, Refused):
            engine.status(engine.guid, SecurityRefused(remote=data.guid, reason=admission.reason))
            engine.recorder.security(data.guid, SecurityStep.REFUSED, f"{data.topic_name}: {admission.reason}")
        elif admission is PENDING:
            self._pending[(local, data.guid)] = data
            engine.recorder.security(data.guid, SecurityStep.KEYS_AWAITED, data.topic_name)
        else:
            assert admission is ADMITTED
            self._match(local, data, engine.participants[data.guid.prefix], now)

    def _match(self, local: Guid, data: EndpointData, proxy: ParticipantProxy, now: float) -> None:
        engine = self._engine
        if isinstance(data, DiscoveredReaderData):
            writer = engine.local_writers[local]
            transmissions = writer.behavior.matched_reader_add(data, proxy.metatraffic, now)
            engine.receivers_changed(writer)
            engine.writer_answers(writer, transmissions)
        else:
            reader = engine.local_readers[local]
            engine.matchmaker.attach_writer(reader, data, proxy, proxy.metatraffic, now)
            if data.topic_name in _SELDOM:
                reader.behavior.writers[data.guid].schedule.preemptive_left = _CALLS

    # --- the end of matches ------------------------------------------------------------------------------

    def participant_lost(self, proxy: ParticipantProxy, now: float) -> None:
        """Nothing of it stays in any table; the hooks hear of the participant, not of each pair."""
        self._forget(proxy, self._topics, now)

    def begin_anew(self, proxy: ParticipantProxy, now: float) -> None:
        """It started again: its numbers and ours are void, but for the topics that security begins anew by itself."""
        self._forget(proxy, [topic for topic in self._topics if not topic.is_directed], now)
        self.match(proxy, Stage.ADMITTED, now)

    def _forget(self, proxy: ParticipantProxy, topics: list[BuiltinTopic], now: float) -> None:
        for topic in topics:
            for ours, theirs in ((topic.writer_id, topic.reader_id), (topic.reader_id, topic.writer_id)):
                remote = Guid.of(proxy.prefix, theirs)
                self._pending.pop((self._guid(ours), remote), None)
                self._unmatch(self._guid(ours), remote, now)

    def _unmatch(self, local: Guid, remote: Guid, now: float) -> EndpointData | None:
        """Undo :meth:`_match`; returns what was known of the remote endpoint, if the two were matched."""
        engine = self._engine
        writer, reader = engine.local_writers.get(local), engine.local_readers.get(local)
        if writer is not None and remote in writer.behavior.readers:
            reader_data = writer.behavior.readers[remote].data
            writer.behavior.matched_reader_remove(remote, now)
            engine.receivers_changed(writer)
            engine.writer_answers(writer, writer.behavior.unsent_changes(now))  # the window may have waited for it
            return reader_data
        if reader is not None and remote in reader.behavior.writers:
            writer_data = reader.behavior.writers[remote].data
            engine.matchmaker.detach_writer(reader, remote, now)
            return writer_data
        return None

    def _guid(self, entity_id: EntityId) -> Guid:
        return Guid.of(self._engine.guid.prefix, entity_id)


def _writer_data(topic: BuiltinTopic, guid: Guid, vendor_id: VendorId = OUR_VENDOR_ID) -> DiscoveredWriterData:
    return DiscoveredWriterData(
        guid=guid, topic_name=topic.name, type_name=topic.name, qos=topic.qos, vendor_id=vendor_id
    )


def _reader_data(topic: BuiltinTopic, guid: Guid, vendor_id: VendorId = OUR_VENDOR_ID) -> DiscoveredReaderData:
    return DiscoveredReaderData(
        guid=guid, topic_name=topic.name, type_name=topic.name, qos=topic.qos, vendor_id=vendor_id
    )
