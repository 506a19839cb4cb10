"""Participant: one DDS participant as a machine without sockets, clock or tasks.

RTPS 2.5 §8.2.4.1.  The contract with whoever drives it:

1. Give it one input: :meth:`receive_datagram`, :meth:`handle_timeout`, or one of the application's verbs.
2. Act on everything that :meth:`drain_effects` returns, in order.  Datagrams are among it, unless the constructor is
   told where they go: then they leave as they are made, and what they are made of is free for the next.
3. Wait for the next input, at most until :meth:`next_deadline`; then call :meth:`handle_timeout`.

``now`` is a clock in seconds that never runs backward, the same for all calls; wall time and randomness are
given to the constructor.  Nothing a peer sends makes any of these methods raise.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import field, replace
from random import Random
from typing import TYPE_CHECKING

from ..behavior.content_filter import CompileFilter, ContentFilter, Evaluate
from ..behavior.content_filtering_writer import ContentFilteringWriter
from ..behavior.defrag import DefragBudget
from ..behavior.filtering_writer import FilteringWriter
from ..behavior.publisher_group import PublisherGroup
from ..behavior.reader_history_cache import ReaderHistoryCache
from ..behavior.stateful_reader import ChangeSink, RemoteWriter, StatefulReader
from ..behavior.stateful_writer import StatefulWriter
from ..behavior.subscriber_group import SubscriberGroup
from ..behavior.transmissions import WriterTransmission
from ..behavior.writer_proxy import WriterProxy
from ..config import Config
from ..discovery.endpoint_registry import EndpointRegistry
from ..discovery.participant_proxy import ParticipantProxy
from ..messages.header import Header
from ..spi import (
    PLAINTEXT,
    LocalParticipant,
    Octets,
    SecurityHooks,
)
from ..structure.cache_change import CacheChange, ChangeKind
from ..structure.dataclass import dataclass
from ..structure.discovered import (
    ContentFilterProperty,
    DiscoveredParticipantData,
    DiscoveredReaderData,
    DiscoveredWriterData,
)
from ..structure.guid import GUID_UNKNOWN, EntityId, EntityKind, Guid, GuidPrefix
from ..structure.locator import Locator
from ..structure.qos import EndpointQos
from ..structure.qos_policies import KeepAll, Properties, Volatile, propagated
from ..structure.status import Status
from ..structure.time import ticks_from_nanoseconds
from ..structure.vendor import PROTOCOL_VERSION
from ..trace.reasons import DropReason, SampleLossReason
from .admission import AdmissionDesk
from .alarms import Alarms
from .builtin_topic_readers import BuiltinTopicReaders
from .builtin_topics import BuiltinTopics
from .discovery_agent import DiscoveryAgent
from .effects import (
    DataAvailable,
    DiscoveryChanged,
    Effect,
    MatchRefused,
    SendDatagram,
    StatusChanged,
    WriterProgress,
)
from .hook_effects import HookEffects
from .inbound import Inbound
from .liveliness import Liveliness
from .local_delivery import LocalDelivery
from .local_endpoints import KeyCodec, LocalReader, LocalWriter
from .matchmaker import Matchmaker
from .outbound import Outbound, fragment_octets_for
from .presentation import Presentation, announced_group
from .qos_changes import QosChanges
from .recorder import Recorder
from .timeliness import Timeliness
from .type_lookup import TypeLookup
from .type_matching import TypeMatching
from .user_endpoints import UserEndpoints

if TYPE_CHECKING:
    from ..trace.sink import TraceSink
    from ..xtypes.type_object import TypeDescription

__all__ = ["Participant", "ParticipantSetup"]

_LOSS_TEXT = {
    SampleLossReason.BEST_EFFORT: "skipped by a best-effort stream",
    SampleLossReason.NOT_AVAILABLE: "the writer no longer has it",
    SampleLossReason.WRITER_LOST: "the writer was gone before there was room for it",
}
_FLUSH_AFTER_S = 0.001
_LINGER_S = 1.0
_REORDER_MAX_OCTETS = 64 << 20
_STATELESS_DEFRAG_OCTETS = 4 << 20  # what strangers may begin and never finish; a handshake message has some thousands


@dataclass(frozen=True, slots=True, kw_only=True)
class ParticipantSetup:
    """Where and as whom a participant lives; made by transport or simulation.

    ``announce_to``: multicast groups and peers.  ``max_message_octets``: the largest UDP payload to send.
    """

    domain_id: int
    guid_prefix: GuidPrefix
    config: Config = field(default_factory=Config)
    metatraffic_unicast: tuple[Locator, ...] = ()
    metatraffic_multicast: tuple[Locator, ...] = ()
    default_unicast: tuple[Locator, ...] = ()
    default_multicast: tuple[Locator, ...] = ()
    announce_to: tuple[Locator, ...] = ()
    max_message_octets: int = 1452
    entity_name: str = ""
    user_data: bytes = b""
    properties: Properties = field(default_factory=dict)


class Participant:
    """See the module's text for how to drive it.  Other names: domain participant, ``participant`` in Cyclone DDS."""

    def __init__(
        self,
        setup: ParticipantSetup,
        *,
        random: Random,
        wall_clock: Callable[[], int],
        hooks: SecurityHooks = PLAINTEXT,
        trace: TraceSink | None = None,
        send: Callable[[SendDatagram], None] | None = None,
    ) -> None:
        """``wall_clock()``: nanoseconds since 1970.  ``send`` takes datagrams, and must not call the participant.

        Raises NotAllowedBySecurity if the hooks refuse the participant.
        """
        self.config = setup.config
        self.domain_id = setup.domain_id
        self.hooks = hooks
        self.random = random
        self.now = 0.0
        candidate = LocalParticipant(
            guid=Guid.of(setup.guid_prefix, EntityId.PARTICIPANT),
            domain_id=setup.domain_id,
            domain_tag=setup.config.domain_tag,
            properties=setup.properties,
        )
        self.guid = hooks.local_participant(candidate)
        self._wall_clock = wall_clock
        self.recorder = Recorder(self, trace)
        self.alarms = Alarms(self)
        self._effects: list[Effect] = []
        self.hook_effects = HookEffects(self, self._effects.append)
        self._next_entity_key = 1
        self._is_closed = False
        self.drops: Counter[DropReason] = Counter()
        self.participants: dict[bytes, ParticipantProxy] = {}
        self.known_writers: EndpointRegistry[DiscoveredWriterData] = EndpointRegistry()
        self.known_readers: EndpointRegistry[DiscoveredReaderData] = EndpointRegistry()
        self.local_writers: dict[bytes, LocalWriter] = {}
        self.local_readers: dict[bytes, LocalReader] = {}
        self.user_endpoints = UserEndpoints(self)
        self.remote_writers: dict[bytes, RemoteWriter] = {}
        self.closing: set[Guid] = set()
        self.defrag_budget = DefragBudget(setup.config.max_defrag_octets)
        self.stateless_defrag_budget = DefragBudget(_STATELESS_DEFRAG_OCTETS)
        header = Header(PROTOCOL_VERSION, setup.config.vendor_id, self.guid.prefix).encode()
        self._max_message_octets = setup.max_message_octets
        self._send = send or self._effects.append
        emit = self._send_recorded if self.recorder.is_on else self._send
        self.outbound = Outbound(header, setup.max_message_octets, setup.config.fragment_size, hooks, emit)
        self.inbound = Inbound(self)
        self.matchmaker = Matchmaker(self)
        self.qos_changes = QosChanges(self)
        self.liveliness = Liveliness(self)
        self.timeliness = Timeliness(self)
        self.presentation = Presentation(self)
        self.local_delivery = LocalDelivery(self)
        self.admission = AdmissionDesk(self)
        self.builtin_readers = BuiltinTopicReaders(self)
        self.types = TypeLookup(self)
        self.type_matching = TypeMatching(self)
        try:
            self.discovery = DiscoveryAgent(self, setup.announce_to, _own_data(setup, self.guid))
            self.builtin = BuiltinTopics(self)
            self.builtin.create(self.discovery.data.builtin_endpoints)
        except BaseException:  # what we would say of ourselves cannot be written, say
            hooks.local_participant_deleted()
            raise

    # --- the four calls ----------------------------------------------------------------------------------

    def start(self, now: float) -> None:
        """Begin to announce; the first input."""
        self.now = now
        self.recorder.created()
        self.discovery.start(now)

    def receive_datagram(self, octets: Octets, source: Locator, now: float) -> None:
        """One datagram from the network; what is kept of ``octets`` is copied.

        Where they can be written to, protected ones may be opened in place.
        """
        if self._is_closed:
            return
        self.now = now
        if self.recorder.is_on:
            self.recorder.received(source, octets)
        self.inbound.receive(octets, source, now)
        if self.builtin.waiting:
            self.builtin.process_waiting(now)

    def handle_timeout(self, now: float) -> None:
        """Run every timer that is due."""
        self.now = now
        if self._is_closed:
            return
        self.alarms.run_due(now)
        if self.builtin.waiting:
            self.builtin.process_waiting(now)

    def next_deadline(self) -> float:
        """When :meth:`handle_timeout` is wanted at the latest, in engine seconds; ``math.inf`` for never."""
        return math.inf if self._is_closed else self.alarms.next_deadline()

    def network_changed(
        self,
        *,
        unicast: tuple[Locator, ...],
        multicast: tuple[Locator, ...],
        announce_to: tuple[Locator, ...],
        max_message_octets: int,
        now: float,
    ) -> None:
        """Interfaces came or went: from now on we are reached there, and messages have at most that size.

        Everybody is told, by SPDP; matches stay.  RTPS 2.5 §8.5.3.3: who hears other locators from us takes these.
        """
        if self._is_closed:
            return
        self.now = now
        self.flush()
        self._max_message_octets = max_message_octets
        self.outbound.message_size_changed(max_message_octets, self.local_writers.values())
        data = replace(
            self.discovery.data, metatraffic_unicast=unicast, metatraffic_multicast=multicast, default_unicast=unicast
        )
        self.discovery.network_changed(data, announce_to, now)

    def drain_effects(self) -> list[Effect]:
        """Everything to be done now, in order.  Open messages are closed first: nothing waits behind this call."""
        self.flush()
        if not self._is_closed:
            self.hook_effects.act()
        if not self._effects:
            return []
        effects = list(self._effects)
        self._effects.clear()
        return effects

    def take_finished(self) -> list[Effect]:
        """As :meth:`drain_effects`, but messages that are not full stay open: for a burst of writes."""
        effects = list(self._effects)
        self._effects.clear()
        return effects

    @property
    def is_closed(self) -> bool:
        return self._is_closed

    @property
    def has_effects(self) -> bool:
        """Is anything to be done at once?  Queued samples do not count until their message is full or due."""
        return bool(self._effects)

    def _send_recorded(self, effect: SendDatagram) -> None:
        self.recorder.sent(effect)
        self._send(effect)

    def flush(self) -> None:
        """Send what is queued: several small samples may have been waiting for each other."""
        if not self.outbound.is_idle:
            self.outbound.flush()
        self.alarms.flush(math.inf)

    # --- endpoints ---------------------------------------------------------------------------------------

    def create_writer(
        self,
        topic_name: str,
        type_name: str,
        qos: EndpointQos,
        now: float,
        *,
        is_keyed: bool,
        compile_filter: CompileFilter | None = None,  # evaluates content filters, to spare readers what they would drop
        filters: bool = False,
        is_enabled: bool = True,
        types: TypeDescription | None = None,
        group: PublisherGroup | None = None,
    ) -> LocalWriter:
        """Create, announce and match a writer.  Raises NotAllowedBySecurity, and nothing has changed then.

        ``types``: what its type is made of, if others are to know.
        """
        self.now = now
        kind = EntityKind.WRITER_WITH_KEY if is_keyed else EntityKind.WRITER_NO_KEY
        data = DiscoveredWriterData(
            guid=self.new_guid(kind), topic_name=topic_name, type_name=type_name, qos=qos,
            vendor_id=self.config.vendor_id, type_information=self.types.announced(types),
        )  # fmt: skip
        if group is not None:
            data = replace(data, group_entity_id=announced_group(qos, group.entity_id))
        protection = self.hooks.local_writer(data)
        data = replace(data, security_parameters=protection.parameters)
        writer = self.add_writer(data, filters=filters)
        writer.compile_filter = compile_filter
        writer.protection = protection
        if group is not None:
            self.presentation.writer_created(writer, group)
        if is_enabled:
            self.user_endpoints.enable_writer(writer, now)
        return writer

    def create_reader(
        self,
        topic_name: str,
        type_name: str,
        qos: EndpointQos,
        now: float,
        *,
        is_keyed: bool,
        keys: KeyCodec | None = None,
        types: TypeDescription | None = None,
        content_filter: tuple[ContentFilterProperty, Evaluate] | None = None,
        uses_filter: bool = False,
        is_enabled: bool = True,
        group: SubscriberGroup | None = None,
    ) -> LocalReader:
        """Create, announce and match a reader.  Raises NotAllowedBySecurity, and nothing has changed then.

        ``types``: what its type is made of, if others are to know.
        ``uses_filter``: its writers send each reader its own changes only, so that skipped numbers are no loss.
        ``content_filter``: what it lets pass, as announced and as evaluated; it implies ``uses_filter``.
        """
        self.now = now
        kind = EntityKind.READER_WITH_KEY if is_keyed else EntityKind.READER_NO_KEY
        data = DiscoveredReaderData(
            guid=self.new_guid(kind), topic_name=topic_name, type_name=type_name, qos=qos,
            vendor_id=self.config.vendor_id, type_information=self.types.announced(types),
        )  # fmt: skip
        if content_filter is not None:
            data = replace(data, content_filter=content_filter[0])
        if group is not None:
            data = replace(data, group_entity_id=announced_group(qos, group.guid.entity_id))
        protection = self.hooks.local_reader(data)
        data = replace(data, security_parameters=protection.parameters)
        guid = data.guid
        history = ReaderHistoryCache(
            qos,
            max_octets=self.config.reader_octets,
            max_instances=self.config.max_instances,
            clock_offset=self._wall_clock() / 1e9 - now,
            on_news=lambda: self._effects.append(DataAvailable(guid)),
            on_rejected=lambda limit, change, is_final: self._sample_rejected(guid, limit, change, is_final=is_final),
            on_timer=lambda due: self.alarms.reader(guid, due),
            wall_time=lambda now: self._wall_clock() / 1e9,
        )
        reader = self.add_reader(data, history, keys)
        sink = self.recorder.delivering(guid, history)
        reader.behavior.history = self.presentation.sink_for(reader, history, sink, group)
        reader.behavior.on_repeat = history.written_again
        reader.protection = protection
        reader.uses_filter = uses_filter or content_filter is not None
        if content_filter is not None:
            history.content_filter = ContentFilter(*content_filter)
        if is_enabled:
            self.user_endpoints.enable_reader(reader, now)
        return reader

    def set_content_filter(
        self, reader: LocalReader, announced: ContentFilterProperty, evaluate: Evaluate, now: float
    ) -> None:
        """From now on the reader lets something else pass; its writers are told.  What it holds it keeps."""
        self.now = now
        assert reader.history is not None
        reader.history.content_filter = ContentFilter(announced, evaluate)
        reader.data = replace(reader.data, content_filter=announced)
        if any(known is reader for known in self.user_endpoints.readers(reader.data.topic_name)):
            self.discovery.announce_reader(reader, now)  # others are announced when they are enabled

    def delete_writer(self, writer: LocalWriter, now: float) -> None:
        """Say that it is gone; but first its readers may, for a second at most, ask for what they miss."""
        self.now = now
        if writer.guid not in self.local_writers or writer.guid in self.closing:
            return
        self.closing.add(writer.guid)
        behavior = writer.behavior
        has_readers = behavior.readers or behavior.local_readers
        if behavior.is_reliable and has_readers and behavior.min_acked_sn() < behavior.cache.last_sn:
            self.alarms.linger(writer.guid, now + _LINGER_S)
            self.writer_answers(writer, behavior.request_acknowledgment())
        else:
            self._finish_writer(writer, now)

    def _finish_writer(self, writer: LocalWriter, now: float) -> None:
        self.matchmaker.writer_gone(writer, now)
        self.presentation.writer_gone(writer)
        self.hooks.local_endpoint_deleted(writer.guid)
        self.closing.discard(writer.guid)
        del self.local_writers[writer.guid]
        self.alarms.forget_writer(writer.guid)
        if self.user_endpoints.remove_writer(writer):
            self.discovery.announce_gone(writer, now)
            self.recorder.endpoint_closed(writer.guid)

    def linger_ended(self, writer: LocalWriter, now: float) -> None:
        """All was acknowledged, or a closed writer waited long enough."""
        if writer.guid in self.closing:
            self._finish_writer(writer, now)

    def delete_reader(self, reader: LocalReader, now: float) -> None:
        self.now = now
        if reader.guid not in self.local_readers:
            return
        self.presentation.reader_gone(reader, now)  # first: that it goes spoils no set for the others
        self.matchmaker.reader_gone(reader, now)
        self.hooks.local_endpoint_deleted(reader.guid)
        del self.local_readers[reader.guid]
        self.alarms.forget_reader(reader.guid)
        if self.user_endpoints.remove_reader(reader):
            self.discovery.announce_gone(reader, now)
            self.recorder.endpoint_closed(reader.guid)

    def close(self, now: float) -> None:
        """Goodbye: endpoints first, then the participant.  The effects that this leaves must still be drained."""
        if self._is_closed:
            return
        self.now = now
        for writer in list(self.user_writers()):
            self._finish_writer(writer, now)
        for reader in list(self.user_readers()):
            self.delete_reader(reader, now)
        self.outbound.flush()
        self.discovery.say_goodbye(now)
        self.flush()
        self._is_closed = True
        self.hooks.local_participant_deleted()  # the effects that are left hold octets that are protected already
        self.recorder.closed()

    def user_writers(self, topic_name: str | None = None) -> list[LocalWriter]:
        """The application's writers, of all topics or of one."""
        return self.user_endpoints.writers(topic_name)

    def user_readers(self, topic_name: str | None = None) -> list[LocalReader]:
        """The application's readers, of all topics or of one."""
        return self.user_endpoints.readers(topic_name)

    # --- writing -----------------------------------------------------------------------------------------

    def write(
        self,
        writer: LocalWriter,
        kind: ChangeKind,
        payload: bytes,
        key: bytes,
        now: float,
        *,
        source_timestamp: int | None = None,
        key_hash: bytes = b"",
        destination: Guid = GUID_UNKNOWN,
        related: tuple[Guid, int] | None = None,
    ) -> CacheChange:
        """One change into the history, and on its way.  Ask ``writer.behavior.lacks_room`` first.

        ``source_timestamp`` in ticks.  It leaves when its message is full, at the next flush, or after 1 ms.
        """
        self.now = now
        behavior = writer.behavior
        change = behavior.new_change(
            kind,
            payload,
            key,
            self.wall_ticks() if source_timestamp is None else source_timestamp,
            now,
            key_hash=key_hash,
            destination=destination,
            related=related,
            coherence=self.presentation.place(writer, now) if writer.group is not None else None,
        )
        self.change_added(writer, change, now)
        return change

    def change_added(self, writer: LocalWriter, change: CacheChange, now: float) -> None:
        """What is new in a writer's history goes on its way."""
        behavior = writer.behavior
        if self.recorder.is_on:
            self.recorder.written(change)
        if behavior.local_readers and not behavior.is_suspended:
            self.local_delivery.written(writer, now)
        if behavior.sends_directly(change):
            self.outbound.send_change(writer, change)
        else:
            self.outbound.transmit(writer, behavior.unsent_changes(now))
        if writer.assertion_due != math.inf:
            self.liveliness.written(writer, now)
        due = behavior.next_deadline()
        if due != writer.timer_due:
            self.alarms.writer(writer, due)
        if not self.alarms.flush_is_set and not self.outbound.is_idle:
            self.alarms.flush(now + _FLUSH_AFTER_S)

    def write_builtin(
        self, writer_id: EntityId, kind: ChangeKind, payload: bytes, key: bytes, now: float
    ) -> CacheChange:
        """A change of a builtin topic; its key is its key hash (RTPS 2.5 §9.6.4.8)."""
        writer = self.local_writers[Guid.of(self.guid.prefix, writer_id)]
        return self.write(writer, kind, payload, key, now, key_hash=key if kind is not ChangeKind.ALIVE else b"")

    def samples_taken(self, reader: LocalReader, now: float) -> None:
        """The application took samples: what waited for room goes on, and its writers are told."""
        self.now = now
        self.presentation.samples_taken(reader, now)
        self.resume(reader, now)

    def resume(self, reader: LocalReader, now: float) -> None:
        """There may be room for what a reader could not take."""
        for proxy in reader.behavior.resume(now):
            self.proxy_touched(reader.behavior, proxy)
        self.local_delivery.resume(reader, now)

    def request_acknowledgment(self, writer: LocalWriter, now: float) -> None:
        """Somebody waits: ask all who lack something, now."""
        self.now = now
        self.writer_answers(writer, writer.behavior.request_acknowledgment())

    # --- what the parts of the engine tell each other ------------------------------------------------------

    def receivers_changed(self, writer: LocalWriter) -> None:
        """A remote reader was matched with the writer, or is no more."""
        writer.receivers = tuple(writer.behavior.readers)
        self.outbound.receivers_changed(writer)

    def writer_answers(self, writer: LocalWriter, transmissions: Sequence[WriterTransmission]) -> None:
        """A writer decided to send these; its timer may have moved and somebody may wait for its progress."""
        if transmissions:
            self.outbound.transmit(writer, transmissions)
        self.alarms.writer(writer, writer.behavior.next_deadline())
        self.writer_progressed(writer)

    def writer_progressed(self, writer: LocalWriter) -> None:
        if writer.wants_acknowledgment:
            self._effects.append(WriterProgress(writer.guid))
        if writer.guid in self.closing and writer.behavior.min_acked_sn() >= writer.behavior.cache.last_sn:
            self.alarms.linger(writer.guid, self.now)

    def proxy_touched(self, reader: StatefulReader, proxy: WriterProxy) -> None:
        """A reader's schedule towards one writer moved."""
        self.alarms.answer(reader.guid, proxy.guid, proxy.schedule.due)

    def forget_proxy(self, reader: Guid, writer: Guid) -> None:
        self.alarms.answer(reader, writer, math.inf)

    def fragments_announced(self, reader: LocalReader, proxy: WriterProxy, number: int, last_fragment: int) -> None:
        """HEARTBEAT_FRAG: ask for fragments that should be here, if any of that sample is."""
        remote = self.remote_writers.get(proxy.guid)
        if remote is None:
            return
        sample = remote.defragmenter.partial_for(reader.guid.entity_id).get(number)
        missing = sample.missing(last_fragment) if sample is not None else None
        if missing:
            self.outbound.answer(reader.guid, proxy, [proxy.nack_frag(number, missing)])

    def host_heard(self, participant: ParticipantProxy, now: float) -> None:
        """It spoke from another host, or announced other locators: whom we could not reach we perhaps can now."""
        for writer in self.local_writers.values():
            for guid, reader in list(writer.behavior.readers.items()):
                if guid.startswith(participant.prefix):
                    builtin = guid.entity_id.is_builtin
                    locators = participant.metatraffic if builtin else participant.user_traffic(reader.data.unicast)
                    writer.behavior.matched_reader_update(guid, reader.data, locators)
        for remote in self.remote_writers.values():
            if remote.participant is participant:
                builtin = remote.guid.entity_id.is_builtin
                locators = participant.metatraffic if builtin else participant.user_traffic(remote.data.unicast)
                for _, proxy in remote.readers:
                    proxy.locators = locators

    def status(self, entity: Guid, status: Status) -> None:
        self._effects.append(StatusChanged(entity, status))
        self.recorder.status(entity, status)

    def match_refused(self, local: Guid, remote: Guid) -> None:
        self._effects.append(MatchRefused(local, remote))

    def data_available(self, reader: Guid) -> None:
        self._effects.append(DataAvailable(reader))

    def discovery_changed(self) -> None:
        if not self._effects or not isinstance(self._effects[-1], DiscoveryChanged):
            self._effects.append(DiscoveryChanged())

    def dropped(self, reason: DropReason, source: Locator | None, detail: str = "") -> None:
        """Count something that was not acted upon."""
        self.drops[reason] += 1
        if self.recorder.is_on:
            self.recorder.dropped(reason, source, detail)

    def _dropped_by_endpoint(self, reason: DropReason, remote: Guid, number: int) -> None:
        """One of our readers or writers had no use for this: a sequence number, or a count."""
        self.drops[reason] += 1
        if self.recorder.is_on:
            self.recorder.dropped(reason, None, f"#{number}", remote)

    def dropped_discovery(self, change: CacheChange, detail: str) -> None:
        self.dropped(DropReason.MALFORMED_DISCOVERY_DATA, None, f"{change.writer_guid}: {detail}")

    def samples_lost(
        self, reader: LocalReader, proxy: WriterProxy, count: int, first: int, why: SampleLossReason
    ) -> None:
        """Numbers that will never be delivered to this reader, if there are any."""
        if not count:
            return
        self.status(reader.guid, reader.samples_lost(count, _LOSS_TEXT[why]))
        self.recorder.samples_lost(reader.guid, proxy.guid, first, first + count - 1, why)

    def sample_malformed(self, reader: LocalReader, change: CacheChange, detail: str) -> None:
        """Octets that are no sample of the topic's type: lost, with the reason."""
        number, writer = change.sequence_number, change.writer_guid
        self.status(reader.guid, reader.samples_lost(1, f"sample {number} of {writer} does not decode: {detail}"))
        self.recorder.samples_lost(reader.guid, writer, number, number, SampleLossReason.MALFORMED_SAMPLE, detail)

    def _sample_rejected(self, guid: Guid, limit: str, change: CacheChange, *, is_final: bool) -> None:
        """A reader has no room; a reliable writer will offer it again, so that it is not dropped."""
        status = self.local_readers[guid].sample_rejected(limit, change.key)
        if is_final:
            is_by_instances = limit == "max_instances"
            self.dropped(DropReason.TABLE_FULL_INSTANCES if is_by_instances else DropReason.READER_FULL, None, limit)
        self.recorder.sample_rejected(guid, change, status.last_reason)
        self.status(guid, status)

    def send_spdp(self, submessage: bytes, destinations: tuple[Locator, ...]) -> None:
        self.outbound.send_plain((submessage,), destinations)

    def wall_ticks(self) -> int:
        """The wall clock in ticks."""
        return ticks_from_nanoseconds(self._wall_clock())

    def answer_writer(self, reader_guid: Guid, writer_guid: Guid, now: float) -> None:
        """A reader's schedule towards one writer is due."""
        reader = self.local_readers.get(reader_guid)
        proxy = reader.behavior.writers.get(writer_guid) if reader is not None else None
        if reader is None or proxy is None:
            return
        answers = reader.behavior.handle_timeout(proxy, self.remote_writers.get(writer_guid), now)
        self.outbound.answer(reader_guid, proxy, answers)
        self.proxy_touched(reader.behavior, proxy)

    # --- making endpoints --------------------------------------------------------------------------------

    def add_writer(self, data: DiscoveredWriterData, *, filters: bool = False) -> LocalWriter:
        """A writer in our tables, announced by nobody and matched with nobody."""
        is_builtin = data.guid.entity_id.is_builtin
        behavior_class = FilteringWriter if filters else StatefulWriter if is_builtin else ContentFilteringWriter
        # What it keeps for whom is its user's affair; a change goes when those that it is for have it.
        qos = replace(data.qos, durability=Volatile(), history=KeepAll()) if data.is_replay else data.qos
        behavior = behavior_class(
            data.guid,
            qos,
            fragment_octets=fragment_octets_for(
                self._max_message_octets, self.config.fragment_size, self.hooks.overhead(data.guid, ())
            ),
            unacknowledged_octets_max=self.config.unacknowledged_octets,
            on_dropped=self._dropped_by_endpoint,
        )
        writer = self.local_writers[data.guid] = LocalWriter(data, behavior, self.outbound.new_packer())
        return writer

    def add_reader(
        self,
        data: DiscoveredReaderData,
        history: ChangeSink,
        keys: KeyCodec | None,
        *,
        behavior_class: type[StatefulReader] = StatefulReader,
    ) -> LocalReader:
        """A reader in our tables, announced by nobody and matched with nobody."""
        behavior = behavior_class(
            data.guid,
            data.qos,
            history,
            reorder_max_samples=self.config.max_reorder_samples,
            reorder_max_octets=_REORDER_MAX_OCTETS,
            on_dropped=self._dropped_by_endpoint,
        )
        cache = history if isinstance(history, ReaderHistoryCache) else None
        reader = self.local_readers[data.guid] = LocalReader(data, behavior, cache, keys)
        return reader

    def new_guid(self, kind: EntityKind) -> Guid:
        key = self._next_entity_key
        self._next_entity_key += 1
        return Guid.of(self.guid.prefix, EntityId.user(key, kind))


def _own_data(setup: ParticipantSetup, guid: Guid) -> DiscoveredParticipantData:
    """What SPDP says of us; properties only where they are to be propagated."""
    return DiscoveredParticipantData(
        guid=guid,
        vendor_id=setup.config.vendor_id,
        domain_id=setup.domain_id,
        domain_tag=setup.config.domain_tag,
        metatraffic_unicast=setup.metatraffic_unicast,
        metatraffic_multicast=setup.metatraffic_multicast,
        default_unicast=setup.default_unicast,
        default_multicast=setup.default_multicast,
        lease_duration=setup.config.lease_duration,
        entity_name=setup.entity_name,
        user_data=setup.user_data,
        properties=tuple(propagated(setup.properties.items())),
    )
