"""BuiltinTopicReaders: the application's readers of DCPSParticipant, DCPSTopic, DCPSPublication and DCPSSubscription.

DDS 1.4 §2.2.5 (Built-in Topics).  What discovery learns goes into their caches as changes, one instance for each
entity; from there on they are read as all readers are.  Reliable, transient-local, KEEP_LAST 1, as the specification
wants it: a reader that comes late sees all that is known.  Entities of the participant itself are not reported: the
specification takes it that whoever made them knows of them.

An instance that its participant said goodbye for is disposed; one that ended otherwise (a lease that ran out, an
endpoint whose participant went, whom security refuses by now) has no writers any more.  A topic ends with the last of
the endpoints that it is known by.

Participants come here once they are admitted, and endpoints are announced by admitted participants alone.  As long as
there is no such reader nothing is made and nothing is kept.  Strangers may come and go as often as they like: of those
that are gone and were not taken the newest 1024 are kept.
"""

from __future__ import annotations

from dataclasses import field
from typing import TYPE_CHECKING

from ..behavior.reader_history_cache import ReaderHistoryCache
from ..structure.builtin_topic_data import (
    BuiltinTopicData,
    ParticipantBuiltinTopicData,
    PublicationBuiltinTopicData,
    SubscriptionBuiltinTopicData,
    TopicBuiltinTopicData,
)
from ..structure.cache_change import CacheChange, ChangeKind
from ..structure.dataclass import dataclass
from ..structure.discovered import DiscoveredParticipantData, DiscoveredReaderData, DiscoveredWriterData
from ..structure.guid import EntityKind, Guid
from ..structure.qos import EndpointQos
from ..structure.qos_policies import KeepLast, Reliable, TransientLocal
from ..structure.time import TICKS_PER_SECOND
from ..trace.reasons import LossReason
from .builtin_topic_data import participant_data, publication_data, subscription_data, topic_data

if TYPE_CHECKING:
    from .participant import Participant

__all__ = ["BuiltinTopicChange", "BuiltinTopicReaders", "LocalBuiltinTopicReader"]

_QOS = EndpointQos(reliability=Reliable(), durability=TransientLocal(), history=KeepLast(1))
_MAX_ENDED = 1024

Announced = DiscoveredParticipantData | DiscoveredWriterData | DiscoveredReaderData
_KIND_OF: dict[type, type[BuiltinTopicData]] = {
    DiscoveredParticipantData: ParticipantBuiltinTopicData,
    DiscoveredWriterData: PublicationBuiltinTopicData,
    DiscoveredReaderData: SubscriptionBuiltinTopicData,
}


class BuiltinTopicChange(CacheChange):
    """A change that nobody serialised: ``data`` is its sample, at an instance's end what was known of it last."""

    __slots__ = ("data",)

    def __init__(
        self, kind: ChangeKind, announcer: Guid, data: BuiltinTopicData, sequence_number: int, source_timestamp: int
    ) -> None:
        super().__init__(kind, announcer, sequence_number, b"", data.key, source_timestamp)
        self.data = data


@dataclass(slots=True)
class LocalBuiltinTopicReader:
    """One reader.  ``known``: the entities that live, as they were reported last; ``ended``: others, oldest first."""

    guid: Guid
    kind: type[BuiltinTopicData]
    history: ReaderHistoryCache
    known: dict[Guid, BuiltinTopicData] = field(default_factory=dict)
    ended: dict[Guid, None] = field(default_factory=dict)
    last_sn: int = 0


class BuiltinTopicReaders:
    """Of one participant.  Told by discovery and admission of all that becomes known, changes, and is lost."""

    def __init__(self, engine: Participant) -> None:
        self._engine = engine
        self._readers: dict[Guid, LocalBuiltinTopicReader] = {}

    def create(self, kind: type[BuiltinTopicData], now: float) -> LocalBuiltinTopicReader:
        """A reader of one kind of entity, which holds all that are known already.  Its Guid is announced to nobody."""
        engine = self._engine
        guid = engine.new_guid(EntityKind.READER_WITH_KEY)
        history = ReaderHistoryCache(
            _QOS,
            max_octets=1,  # there are none in it
            max_instances=engine.config.max_participants + engine.config.max_endpoints + _MAX_ENDED + 1,
            clock_offset=engine.wall_ticks() / TICKS_PER_SECOND - now,
            on_news=lambda: engine.data_available(guid),
        )
        reader = self._readers[guid] = LocalBuiltinTopicReader(guid, kind, history)
        for proxy in engine.participants.values():
            if proxy.is_admitted:
                self._report(reader, proxy.data, now)
        for publication in engine.known_writers.all():
            self._report(reader, publication, now)
        for subscription in engine.known_readers.all():
            self._report(reader, subscription, now)
        return reader

    def delete(self, reader: LocalBuiltinTopicReader) -> None:
        self._readers.pop(reader.guid, None)

    def announced(self, announced: Announced, now: float) -> None:
        """An entity of an admitted participant is known, or what is known of it has changed."""
        for reader in self._readers.values():
            self._report(reader, announced, now)

    def lost(self, guid: Guid, reason: LossReason, now: float) -> None:
        """An entity is gone."""
        has_said_so = reason is LossReason.GOODBYE
        kind = ChangeKind.NOT_ALIVE_DISPOSED_UNREGISTERED if has_said_so else ChangeKind.NOT_ALIVE_UNREGISTERED
        for reader in self._readers.values():
            if reader.kind is TopicBuiltinTopicData:
                for key in [key for key, data in reader.known.items() if not self._is_used(data)]:
                    self._end(reader, kind, key, now)
            elif guid in reader.known:
                self._end(reader, kind, guid, now)

    def _is_used(self, topic: BuiltinTopicData) -> bool:
        """Does anybody write or read it?"""
        assert isinstance(topic, TopicBuiltinTopicData)
        engine = self._engine
        return any(
            endpoint.type_name == topic.type_name
            for known in (engine.known_writers, engine.known_readers)
            for endpoint in known.of_topic(topic.name)
        )

    def _end(self, reader: LocalBuiltinTopicReader, kind: ChangeKind, key: Guid, now: float) -> None:
        self._add(reader, kind, reader.known.pop(key), now)
        reader.ended[key] = None
        if len(reader.ended) > _MAX_ENDED:
            oldest = next(iter(reader.ended))
            del reader.ended[oldest]
            reader.history.take(instance=oldest)

    def _report(self, reader: LocalBuiltinTopicReader, announced: Announced, now: float) -> None:
        data: BuiltinTopicData
        if reader.kind is TopicBuiltinTopicData and not isinstance(announced, DiscoveredParticipantData):
            data = topic_data(announced)
            if data.key in reader.known:
                return
        elif _KIND_OF[type(announced)] is reader.kind:
            data = self._data(announced)
        else:
            return
        if reader.known.get(data.key) != data:
            reader.known[data.key] = data
            reader.ended.pop(data.key, None)
            self._add(reader, ChangeKind.ALIVE, data, now)

    def _data(self, announced: Announced) -> BuiltinTopicData:
        hooks = self._engine.hooks
        match announced:
            case DiscoveredParticipantData():
                return participant_data(announced, hooks)
            case DiscoveredWriterData():
                return publication_data(announced, hooks)
            case DiscoveredReaderData():
                return subscription_data(announced, hooks)

    def _add(self, reader: LocalBuiltinTopicReader, kind: ChangeKind, data: BuiltinTopicData, now: float) -> None:
        reader.last_sn += 1
        # That there is a topic nobody announces: we have found it out.
        announcer = self._engine.guid if isinstance(data, TopicBuiltinTopicData) else data.key.participant
        change = BuiltinTopicChange(kind, announcer, data, reader.last_sn, self._engine.wall_ticks())
        is_taken = reader.history.add(change, now)
        assert is_taken, "there is room for as many as the tables of discovery hold"
