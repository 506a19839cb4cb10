"""DiscoveryAgent: who is there, what endpoints they have, and telling them of ours.

RTPS 2.5 §8.5.3 (SPDP) and §8.5.4 (SEDP).  Everything that strangers fill - participants, their endpoints - has its
bound here.  A participant is admitted by the hooks before any of its endpoints is matched.
"""

from __future__ import annotations

from collections import deque
from dataclasses import replace
from typing import TYPE_CHECKING

from ..behavior.stateless_writer import StatelessWriter
from ..discovery.builtin_endpoints import ANNOUNCED_ENDPOINTS
from ..discovery.departures import Departures
from ..discovery.parameters import (
    decode_key,
    decode_participant,
    decode_reader,
    decode_writer,
    encode_key,
    encode_participant,
    encode_reader,
    encode_writer,
    participant_parameters,
)
from ..discovery.participant_proxy import ParticipantProxy
from ..discovery.spdp import SpdpAnnouncer
from ..messages.data import Data
from ..serialization.parameter_id import ParameterId
from ..serialization.parameter_list import MustUnderstandUnknown, ParameterList
from ..spi import Announcement
from ..structure import builtin_entity_ids as ids
from ..structure.cache_change import CacheChange, ChangeKind
from ..structure.discovered import (
    DiscoveredEndpointData,
    DiscoveredParticipantData,
    DiscoveredReaderData,
    DiscoveredWriterData,
)
from ..structure.errors import MalformedMessage
from ..structure.guid import EntityId, Guid
from ..structure.locator import Locator
from ..trace.reasons import DropReason, LossReason
from .eviction import Eviction
from .inbound import Incoming
from .local_endpoints import LocalReader, LocalWriter

if TYPE_CHECKING:
    from .participant import Participant

__all__ = ["DiscoveryAgent"]

_KEEP_FAREWELLS_S = 600.0
_MAX_FAREWELLS = 8192
_GONE_S = 0.3
"""How long an endpoint stays away.  Cyclone DDS forgets one a moment after it was told so, and would forget the new one
of the same Guid with it; and it is the time that others have to ask for what was lost."""


class DiscoveryAgent:
    """SPDP and SEDP of one participant."""

    def __init__(self, engine: Participant, announce_to: tuple[Locator, ...], data: DiscoveredParticipantData) -> None:
        self._engine = engine
        self._announcement = Announcement()
        self.data = data
        self._prepare(data)
        self._spdp_writer = StatelessWriter(Guid.of(engine.guid.prefix, ids.SPDP_WRITER))
        self._announcer = SpdpAnnouncer(announce_to, engine.config.announcement_period, engine.random.random)
        self._eviction = Eviction(engine)
        self._ignored: set[Guid] = set()
        self._ignored_topics: set[str] = set()
        self._departures = Departures()
        # "Endpoint gone", oldest first: said when, by which builtin writer, under which number.
        self._farewells: deque[tuple[float, EntityId, int]] = deque()

    # --- ourselves ---------------------------------------------------------------------------------------

    def _prepare(self, data: DiscoveredParticipantData) -> None:
        """Make ``data`` what we announce, with what security adds to it."""
        hooks = self._engine.hooks
        announcement = self._announcement = hooks.announcement()
        self.data = replace(
            data,
            builtin_endpoints=ANNOUNCED_ENDPOINTS | announcement.builtin_endpoints,
            security_parameters=announcement.parameters,
        )
        hooks.announced(participant_parameters(self.data, little_endian=False).encode())

    def start(self, now: float) -> None:
        self._write_spdp(now)
        self._announcer.start(now)
        self._arm()

    def _write_spdp(self, now: float) -> None:
        """What SPDP says from now on: in clear again and again; to those who are authenticated once, and reliably."""
        self._spdp_writer.new_change(ChangeKind.ALIVE, encode_participant(self.data), self._engine.wall_ticks())
        if self._engine.builtin.writer(ids.SPDP_SECURE_WRITER) is not None:
            parameters = self.data.security_parameters + self._announcement.protected_parameters
            payload = encode_participant(replace(self.data, security_parameters=parameters))
            self._engine.write_builtin(ids.SPDP_SECURE_WRITER, ChangeKind.ALIVE, payload, self._engine.guid, now)

    def announce_due(self, now: float) -> None:
        self._send_spdp(tuple(dict.fromkeys([*self._announcer.due_destinations(now), *self._unicast_only()])))
        self._arm()

    def announce_change(self, data: DiscoveredParticipantData, now: float) -> None:
        """What we announce of ourselves (user data, locators) is now this."""
        self._prepare(data)
        self._write_spdp(now)
        self._announcer.announce_soon(now)
        self._send_spdp(tuple(locator for proxy in self._engine.participants.values() for locator in proxy.metatraffic))
        self._arm()

    def network_changed(self, data: DiscoveredParticipantData, announce_to: tuple[Locator, ...], now: float) -> None:
        """We are reached elsewhere, or at the same place again: ``data`` says where."""
        self._announcer.start_again(announce_to, now)
        self.announce_change(data, now)

    def say_goodbye(self, now: float) -> None:
        """Dispose ourselves towards everybody; RTPS 2.5 §8.5.3.2.2.  Lost goodbyes are what leases are for."""
        guid, kind = self._engine.guid, ChangeKind.NOT_ALIVE_DISPOSED_UNREGISTERED
        payload = encode_key(guid, ParameterId.PARTICIPANT_GUID)
        if self._engine.builtin.writer(ids.SPDP_SECURE_WRITER) is not None:
            self._engine.write_builtin(ids.SPDP_SECURE_WRITER, kind, payload, guid, now)
            self._engine.flush()  # so that those who believe only this one hear it first
        change = self._spdp_writer.new_change(kind, payload, self._engine.wall_ticks(), key_hash=guid)
        known = [locator for proxy in self._engine.participants.values() for locator in proxy.metatraffic]
        destinations = tuple(dict.fromkeys([*self._announcer.destinations, *known]))
        self._send_spdp(destinations, change)

    def _unicast_only(self) -> list[Locator]:
        """Participants that our multicast does not reach: they announce no multicast locator, or we have none."""
        we_multicast = bool(self.data.metatraffic_multicast)
        return [
            locator
            for proxy in self._engine.participants.values()
            if not (we_multicast and proxy.data.metatraffic_multicast)
            for locator in proxy.metatraffic
        ]

    def _send_spdp(self, destinations: tuple[Locator, ...], change: CacheChange | None = None) -> None:
        change = change or self._spdp_writer.latest
        if change is None or not destinations:
            return
        inline_qos = None
        if change.kind is not ChangeKind.ALIVE:
            status = bytes((0, 0, 0, change.kind))
            inline_qos = ParameterList([(ParameterId.KEY_HASH, change.key_hash), (ParameterId.STATUS_INFO, status)])
        data = Data(
            ids.SPDP_READER,
            ids.SPDP_WRITER,
            change.sequence_number,
            inline_qos,
            change.payload,
            is_key=change.kind is not ChangeKind.ALIVE,
        )
        self._engine.send_spdp(data.encode(), destinations)

    def _arm(self) -> None:
        self._engine.alarms.announce_at(self._announcer.next_deadline())

    # --- participants ------------------------------------------------------------------------------------

    def receive_spdp(self, incoming: Incoming, change: CacheChange) -> None:
        """SPDPdiscoveredParticipantData, or the end of a participant."""
        said: tuple[bytes, tuple[int, int], bytes] | None
        said = (incoming.vendor_id, incoming.version, bytes(change.payload))
        proxy = self._engine.participants.get(change.writer_guid.prefix)
        if proxy is not None and proxy.announcement == said and change.kind is ChangeKind.ALIVE:
            self._repeated(proxy, incoming.now)
            return
        try:
            if change.kind is not ChangeKind.ALIVE:
                guid = decode_key(change.payload, ParameterId.PARTICIPANT_GUID, key_hash=change.key_hash)
                if guid[:12] == incoming.prefix and guid[:12] in self._engine.participants:
                    self._departures.note(guid, change.sequence_number, incoming.now)
                    self.participant_lost(guid, LossReason.GOODBYE, incoming.now)
                return
            data = decode_participant(
                change.payload,
                source_prefix=change.writer_guid.prefix,
                vendor_id=incoming.vendor_id,
                protocol_version=incoming.version,
            )
        except MalformedMessage as error:
            is_must = isinstance(error, MustUnderstandUnknown)
            reason = DropReason.MUST_UNDERSTAND if is_must else DropReason.MALFORMED_DISCOVERY_DATA
            self._engine.dropped(reason, incoming.source, str(error))
            return
        if proxy is None and self._departures.overtook(data.guid, change.sequence_number, incoming.now):
            self._engine.dropped(DropReason.OUT_OF_ORDER, incoming.source, f"{data.guid} has said goodbye since")
            return
        if not data.metatraffic_unicast and not data.default_unicast:
            data = replace(data, metatraffic_unicast=(incoming.source,))
            said = None  # the next may come from elsewhere
        self._participant_announced(incoming, data)
        proxy = self._engine.participants.get(data.guid.prefix)
        if proxy is not None and proxy.data == data:
            proxy.announcement = said

    def _repeated(self, proxy: ParticipantProxy, now: float) -> None:
        """It says the same as before; among many participants hardly anything else is heard."""
        if proxy.refusal:
            self._engine.admission.announced_again(proxy, now)

    def receive_secure_spdp(self, change: CacheChange, now: float) -> None:
        """What an authenticated participant says of itself.  DDS-Security 1.1 §7.4.1.6 (DCPSParticipantsSecure)."""
        proxy = self._engine.participants.get(change.writer_guid.prefix)
        if proxy is None:
            return
        try:
            if change.kind is not ChangeKind.ALIVE:
                guid = decode_key(change.payload, ParameterId.PARTICIPANT_GUID, key_hash=change.key_hash)
                if guid == proxy.guid:
                    self.participant_lost(guid, LossReason.GOODBYE, now)
                return
            data = decode_participant(
                change.payload,
                source_prefix=proxy.prefix,
                vendor_id=proxy.vendor_id,
                protocol_version=proxy.data.protocol_version,
            )
        except MalformedMessage as error:
            self._engine.dropped_discovery(change, str(error))
            return
        if not data.metatraffic_unicast and not data.default_unicast:
            data = replace(
                data,
                metatraffic_unicast=proxy.data.metatraffic_unicast,
                default_unicast=proxy.data.default_unicast,
            )
        self._participant_announced_again(proxy, data, now)

    def _participant_announced(self, incoming: Incoming, data: DiscoveredParticipantData) -> None:
        engine = self._engine
        if data.guid.prefix == engine.guid.prefix:  # by way of an INFO_SRC
            engine.dropped(DropReason.OWN_MESSAGE, incoming.source)
        elif data.domain_id is not None and data.domain_id != engine.domain_id:
            engine.dropped(DropReason.WRONG_DOMAIN, incoming.source, f"domain {data.domain_id}")
        elif data.domain_tag != self.data.domain_tag:
            engine.dropped(DropReason.DOMAIN_TAG, incoming.source, repr(data.domain_tag))
        elif data.guid in self._ignored:
            engine.dropped(DropReason.IGNORED, incoming.source)
        elif data.guid.prefix in engine.participants:
            self._participant_announced_again(engine.participants[data.guid.prefix], data, incoming.now)
        elif self._eviction.participants_are_full and not self._evict_participant(incoming.now):
            engine.dropped(DropReason.TABLE_FULL_PARTICIPANTS, incoming.source)
        else:
            self._new_participant(incoming, data)

    def _new_participant(self, incoming: Incoming, data: DiscoveredParticipantData) -> None:
        engine, now = self._engine, incoming.now
        proxy = engine.participants[data.guid.prefix] = ParticipantProxy(data, now)
        proxy.heard_from(incoming.source)
        incoming.participant = proxy
        engine.alarms.lease(proxy)
        engine.recorder.participant(data, is_new=True)
        # One announcement for one received, so that the newcomer need not wait a period for ours.  A host that is only
        # announced and has not spoken gets no more than this one (DESIGN: no amplification).
        greeting = proxy.metatraffic or _first_unicast(data)
        self._announcer.participant_found(proxy.metatraffic)
        self._send_spdp(greeting)
        engine.admission.found(proxy, now)
        engine.discovery_changed()
        self._arm()

    def _participant_announced_again(
        self, proxy: ParticipantProxy, data: DiscoveredParticipantData, now: float
    ) -> None:
        engine = self._engine
        if data == proxy.data:
            self._repeated(proxy, now)
            return
        before, proxy.data, proxy.announcement = proxy.data, data, None
        engine.alarms.lease(proxy)
        engine.recorder.participant(data, is_new=False)
        engine.admission.announced_again(proxy, now)
        if proxy.prefix not in engine.participants:
            return
        if proxy.is_admitted:
            engine.builtin_readers.announced(data, now)
        if (before.metatraffic_unicast, before.default_unicast) != (data.metatraffic_unicast, data.default_unicast):
            engine.host_heard(proxy, now)
        engine.discovery_changed()

    def participant_lost(self, guid: Guid, reason: LossReason, now: float, detail: str = "") -> None:
        """It said goodbye, or its lease ran out: nothing of it stays."""
        engine = self._engine
        proxy = engine.participants.get(guid[:12])
        if proxy is None:
            return
        is_silent = reason is LossReason.LEASE_EXPIRED
        self.endpoints_lost(proxy, reason if is_silent else LossReason.PARTICIPANT_LOST, now)
        engine.builtin.participant_lost(proxy, now)
        del engine.participants[proxy.prefix]
        engine.alarms.no_lease(proxy)
        engine.types.participant_lost(proxy.prefix)
        engine.hooks.remote_participant_lost(proxy.guid)
        if reason is LossReason.LEASE_EXPIRED:
            self._announcer.participant_lost(proxy.metatraffic, now)
            self._arm()
        engine.builtin_readers.lost(proxy.guid, reason, now)
        engine.recorder.participant_lost(proxy.guid, reason, detail)
        engine.discovery_changed()

    def endpoints_lost(self, proxy: ParticipantProxy, reason: LossReason, now: float) -> None:
        """All that it announced is void."""
        engine = self._engine
        for writer_data in engine.known_writers.of_participant(proxy.prefix):
            self._writer_lost(writer_data.guid, reason, now)
        for reader_data in engine.known_readers.of_participant(proxy.prefix):
            self._reader_lost(reader_data.guid, reason, now)

    def lease_due(self, prefix: bytes, now: float) -> None:
        proxy = self._engine.participants.get(prefix)
        if proxy is None:
            return
        if proxy.lease_due <= now:
            self.participant_lost(proxy.guid, LossReason.LEASE_EXPIRED, now)
        else:
            self._engine.alarms.lease(proxy)

    def ignore(self, guid: Guid, now: float) -> None:
        """Act as if this participant were not there.  DDS 1.4 §2.2.2.2.1.14 (ignore_participant)."""
        self._ignored.add(guid)
        self.participant_lost(guid, LossReason.IGNORED, now)

    def ignore_endpoint(self, guid: Guid, now: float) -> None:
        """The same of one writer or reader.  DDS 1.4 §2.2.2.2.1.16-17 (ignore_publication, ignore_subscription)."""
        self._ignored.add(guid)
        self._writer_lost(guid, LossReason.IGNORED, now)
        self._reader_lost(guid, LossReason.IGNORED, now)

    def ignore_topic(self, topic_name: str, now: float) -> None:
        """The same of all endpoints of a topic.  DDS 1.4 §2.2.2.2.1.15 (ignore_topic)."""
        self._ignored_topics.add(topic_name)
        for writer_data in self._engine.known_writers.of_topic(topic_name):
            self._writer_lost(writer_data.guid, LossReason.IGNORED, now)
        for reader_data in self._engine.known_readers.of_topic(topic_name):
            self._reader_lost(reader_data.guid, LossReason.IGNORED, now)

    def participant_restarted(self, incoming: Incoming) -> None:
        """Its writers have begun anew: another incarnation under the same GUID.  What we knew of the former is void.

        Stacks that make their prefix from host and process number come back so (in a container, each time).  Without
        this their discovery data, numbered from 1 again, would be taken for duplicates as long as they live.
        """
        proxy = self._engine.participants.get(incoming.prefix)
        if proxy is not None:
            self.participant_lost(proxy.guid, LossReason.RESTARTED, incoming.now)
            self._new_participant(incoming, proxy.data)

    def _evict_participant(self, now: float) -> bool:
        victim = self._eviction.idle_participant(now)
        if victim is not None:
            self.participant_lost(victim.guid, LossReason.EVICTED, now)
        return victim is not None

    def _evict_endpoint(self, newcomer: ParticipantProxy, now: float) -> bool:
        victim = self._eviction.surplus_endpoint(newcomer)
        if isinstance(victim, DiscoveredWriterData):
            self._writer_lost(victim.guid, LossReason.EVICTED, now)
        elif victim is not None:
            self._reader_lost(victim.guid, LossReason.EVICTED, now)
        return victim is not None

    # --- our endpoints -----------------------------------------------------------------------------------

    def announce_writer(self, writer: LocalWriter, now: float) -> None:
        self._announce(_sedp_writer(writer), writer.guid, encode_writer(writer.data), now)

    def announce_reader(self, reader: LocalReader, now: float) -> None:
        self._announce(_sedp_writer(reader), reader.guid, encode_reader(reader.data), now)

    def withdraw_types(self, endpoint: LocalWriter | LocalReader, now: float) -> None:
        """From now on the endpoint says nothing of what its type is made of, so that peers go by the type's name.

        Peers take no change of that of an endpoint that they know; so it is gone, and in a moment there again.
        """
        if not endpoint.data.type_information:
            return
        if isinstance(endpoint, LocalWriter):
            endpoint.data = replace(endpoint.data, type_information=b"")
        else:
            endpoint.data = replace(endpoint.data, type_information=b"")
        self.announce_gone(endpoint, now)
        self._engine.alarms.announce_endpoint(endpoint.guid, now + _GONE_S)

    def announce_again(self, guid: Guid, now: float) -> None:
        """An endpoint that was gone for a moment is there, unless it has been deleted meanwhile."""
        writer, reader = self._engine.local_writers.get(guid), self._engine.local_readers.get(guid)
        if writer is not None and guid not in self._engine.closing:
            self.announce_writer(writer, now)
        elif reader is not None:
            self.announce_reader(reader, now)

    def announce_gone(self, endpoint: LocalWriter | LocalReader, now: float) -> None:
        self._announce_gone(_sedp_writer(endpoint), endpoint.guid, now)

    def _announce(self, writer_id: EntityId, guid: Guid, payload: bytes, now: float) -> None:
        self._prune_farewells(now)
        self._engine.write_builtin(writer_id, ChangeKind.ALIVE, payload, guid, now)

    def _announce_gone(self, writer_id: EntityId, guid: Guid, now: float) -> None:
        self._prune_farewells(now)
        payload = encode_key(guid, ParameterId.ENDPOINT_GUID)
        change = self._engine.write_builtin(writer_id, ChangeKind.NOT_ALIVE_DISPOSED_UNREGISTERED, payload, guid, now)
        self._farewells.append((now, writer_id, change.sequence_number))

    def _prune_farewells(self, now: float) -> None:
        """Forget "endpoint gone" once nobody can lack it any more: latecomers never knew the endpoint.

        That all who are matched have acknowledged it is not enough.  A peer that we lost may not have lost us: when it
        hears us again, it has to learn what ended meanwhile.  But it forgets us when it hears nothing for our lease;
        twice that leaves it time to ask.
        """
        keep = min(2 * self.data.lease_duration, _KEEP_FAREWELLS_S)
        while self._farewells:
            said_at, writer_id, number = self._farewells[0]
            behavior = self._engine.local_writers[Guid.of(self._engine.guid.prefix, writer_id)].behavior
            is_settled = now - said_at > keep and number <= behavior.min_acked_sn()
            if not is_settled and len(self._farewells) <= _MAX_FAREWELLS:
                break
            self._farewells.popleft()
            behavior.cache.remove(number)

    # --- their endpoints ---------------------------------------------------------------------------------

    def receive_publication(self, change: CacheChange, now: float, *, is_secure: bool) -> None:
        """DiscoveredWriterData on the builtin topic DCPSPublication, or DCPSPublicationsSecure; or its end."""
        try:
            if change.kind is not ChangeKind.ALIVE:
                guid = decode_key(change.payload, ParameterId.ENDPOINT_GUID, key_hash=change.key_hash)
                known_writer = self._engine.known_writers.get(guid)
                if known_writer is not None and self._belongs_here(change, known_writer, is_secure=is_secure):
                    self._writer_lost(guid, LossReason.GOODBYE, now)
                return
            data = decode_writer(change.payload, self._vendor_of(change))
        except MalformedMessage as error:
            self._engine.dropped_discovery(change, str(error))
            return
        is_known = self._engine.known_writers.get(data.guid) is not None
        if self._belongs_here(change, data, is_secure=is_secure) and self._may_enter(data, now, is_known=is_known):
            before = self._engine.known_writers.put(data)
            self._note_endpoint(data, before, now)
            if before is not None and before.topic_name != data.topic_name:
                self._engine.matchmaker.remote_writer_gone(before, LossReason.QOS_CHANGED, now)
            self._engine.matchmaker.remote_writer_appeared(data, now)

    def receive_subscription(self, change: CacheChange, now: float, *, is_secure: bool) -> None:
        """DiscoveredReaderData on the builtin topic DCPSSubscription, or DCPSSubscriptionsSecure; or its end."""
        try:
            if change.kind is not ChangeKind.ALIVE:
                guid = decode_key(change.payload, ParameterId.ENDPOINT_GUID, key_hash=change.key_hash)
                known_reader = self._engine.known_readers.get(guid)
                if known_reader is not None and self._belongs_here(change, known_reader, is_secure=is_secure):
                    self._reader_lost(guid, LossReason.GOODBYE, now)
                return
            data = decode_reader(change.payload, self._vendor_of(change))
        except MalformedMessage as error:
            self._engine.dropped_discovery(change, str(error))
            return
        is_known = self._engine.known_readers.get(data.guid) is not None
        if self._belongs_here(change, data, is_secure=is_secure) and self._may_enter(data, now, is_known=is_known):
            before = self._engine.known_readers.put(data)
            self._note_endpoint(data, before, now)
            if before is not None and before.topic_name != data.topic_name:
                self._engine.matchmaker.remote_reader_gone(before, LossReason.QOS_CHANGED, now)
            self._engine.matchmaker.remote_reader_appeared(data, now)

    def _vendor_of(self, change: CacheChange) -> bytes:
        proxy = self._engine.participants.get(change.writer_guid.prefix)
        return proxy.vendor_id if proxy is not None else b"\0\0"

    def _belongs_here(
        self, change: CacheChange, data: DiscoveredWriterData | DiscoveredReaderData, *, is_secure: bool
    ) -> bool:
        """A participant speaks of its own endpoints only, and of each on the topic that governance names for it."""
        engine = self._engine
        if data.guid.prefix != change.writer_guid.prefix:
            engine.dropped_discovery(change, f"speaks of {data.guid}, which is not its own")
            return False
        if not engine.hooks.admits_announcement(data, is_secure=is_secure):
            reason = DropReason.REJECTED_BY_SECURITY if is_secure else DropReason.CLEAR_TEXT
            engine.dropped(reason, None, f"{data.guid} is announced on the {'secure' if is_secure else 'plain'} topic")
            return False
        return True

    def _may_enter(self, data: DiscoveredEndpointData, now: float, *, is_known: bool) -> bool:
        """All endpoints together have a bound."""
        engine, guid = self._engine, data.guid
        if guid in self._ignored or data.topic_name in self._ignored_topics:
            engine.dropped(DropReason.IGNORED, None, str(guid))
            return False
        proxy = engine.participants.get(guid.prefix)
        if proxy is None:
            return False
        if is_known:
            return True
        if self._eviction.endpoints_are_full and not self._evict_endpoint(proxy, now):
            engine.dropped(DropReason.TABLE_FULL_ENDPOINTS, None, str(guid))
            return False
        proxy.endpoint_count += 1
        return True

    def _note_endpoint(
        self,
        data: DiscoveredWriterData | DiscoveredReaderData,
        before: DiscoveredEndpointData | None,
        now: float,
    ) -> None:
        engine = self._engine
        proxy = engine.participants.get(data.guid.prefix)
        if proxy is not None:
            proxy.endpoint_announced(data.unicast)
        engine.recorder.endpoint(data, is_new=before is None)
        engine.builtin_readers.announced(data, now)
        engine.discovery_changed()

    def _writer_lost(self, guid: Guid, reason: LossReason, now: float) -> None:
        data = self._engine.known_writers.remove(guid)
        if data is not None:
            self._endpoint_lost(guid, reason, now)
            self._engine.matchmaker.remote_writer_gone(data, reason, now)

    def _reader_lost(self, guid: Guid, reason: LossReason, now: float) -> None:
        data = self._engine.known_readers.remove(guid)
        if data is not None:
            self._endpoint_lost(guid, reason, now)
            self._engine.matchmaker.remote_reader_gone(data, reason, now)

    def _endpoint_lost(self, guid: Guid, reason: LossReason, now: float) -> None:
        engine = self._engine
        proxy = engine.participants.get(guid.prefix)
        if proxy is not None:
            proxy.endpoint_count -= 1
        engine.builtin_readers.lost(guid, reason, now)
        engine.recorder.endpoint_lost(guid, reason)
        engine.discovery_changed()


def _sedp_writer(endpoint: LocalWriter | LocalReader) -> EntityId:
    """Which of our builtin writers announces it: one alone.  DDS-Security 1.1 §7.4.1.7, §7.4.1.8."""
    is_secure = endpoint.protection.discovery_protected
    if isinstance(endpoint, LocalWriter):
        return ids.SEDP_PUBLICATIONS_SECURE_WRITER if is_secure else ids.SEDP_PUBLICATIONS_WRITER
    return ids.SEDP_SUBSCRIPTIONS_SECURE_WRITER if is_secure else ids.SEDP_SUBSCRIPTIONS_WRITER


def _first_unicast(data: DiscoveredParticipantData) -> tuple[Locator, ...]:
    for locator in (*data.metatraffic_unicast, *data.default_unicast):
        if not locator.is_multicast and not locator.is_unspecified:
            return (locator,)
    return ()
