"""DurableTopic: what a persistence service does for one topic - record what is written, and tell it to who comes later.

DDS 1.4 §2.2.3.4 (DURABILITY: TRANSIENT, PERSISTENT), RTPS 2.5 §8.7.9 (original writer info).  A recorder reads what the
topic's writers write.  A teller is a writer that offers the same durability, so that late joiners match it when the
writers are gone; it sends each of them what the store holds, straight from there, so that a long history needs no
memory.  What it sends says whose it was: readers of ours drop what the writer itself sends or has sent.

Other vendors' readers cannot tell.  They are sent nothing of writers that are alive, which keep history themselves;
when such a writer is lost, those that joined while it may have been dead already are sent it then.  So they have
everything at least once.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from ..behavior.filtering_writer import FilteringWriter
from ..discovery.endpoint_parameters import decode_writer
from ..engine import LocalWriter
from ..storage import SampleStore, StoredSample, StoredTopic
from ..structure.cache_change import CacheChange, ChangeKind
from ..structure.dataclass import dataclass
from ..structure.discovered import REPLAY_USER_DATA, DiscoveredReaderData, DiscoveredWriterData
from ..structure.errors import AlreadyDeleted
from ..structure.guid import Guid
from ..structure.qos import EndpointQos
from ..structure.qos_policies import (
    Automatic,
    Deadline,
    DurabilityService,
    KeepAll,
    OwnershipStrength,
    Presentation,
    Reliable,
    ResourceLimits,
    UserData,
)
from ..structure.sample_info import SampleInfo
from ..structure.status import PublicationMatched, Status
from ..structure.time import Time
from ..structure.vendor import OUR_VENDOR_ID
from ..xtypes.type_support import TypeSupport
from .data_reader import key_codec
from .entity import Entity
from .sample import Sample
from .sample_reader import SampleReader

if TYPE_CHECKING:
    from .participant import DomainParticipant

__all__ = ["DurableTopic"]

_PORTION = 64
"""Samples that are read from the store, or recorded, in one go."""
_KEY_HASH_OCTETS = 16
_MOST_OCTETS = 8 << 20
"""That may be under way to all readers together."""
_WEAKEST = -(1 << 31)
"""Under exclusive ownership any writer that is alive goes before the teller."""


class _Recorder(SampleReader[CacheChange]):
    """Reads a topic's changes as they are, without making samples of them."""

    def __init__(
        self, participant: DomainParticipant, data: DiscoveredWriterData, support: TypeSupport[Any] | None
    ) -> None:
        super().__init__(participant, None)
        keys = key_codec(support) if support is not None and support.is_keyed else None
        self._reader = self._pump.engine.create_reader(
            data.topic_name, data.type_name, _recorder_qos(data.qos), self._pump.now(),
            is_keyed=data.is_keyed, keys=keys, types=None if support is None else support.type_description,
        )  # fmt: skip
        assert self._reader.history is not None
        self._history = self._reader.history
        participant._adopt(self)
        participant._register(self._reader.guid, self)

    def _sample(self, info: SampleInfo, change: CacheChange) -> Sample[CacheChange]:
        return Sample(change, info)

    def _after_taking(self) -> None:
        self._pump.engine.samples_taken(self._reader, self._pump.now())

    def _on_close(self) -> None:
        super()._on_close()
        self._participant._disown(self)
        self._participant._deregister(self._reader.guid)
        self._participant._when_running(lambda pump: pump.engine.delete_reader(self._reader, pump.now()))


@dataclass(slots=True, eq=False)
class _Listener:
    """A late joiner: it has been told up to ``place``, and is to be told up to ``end``.

    ``since``: when it was matched.  ``untold``: writers that were alive then, whose samples it was not told.
    """

    data: DiscoveredReaderData
    end: int
    since: float
    untold: frozenset[Guid] = frozenset()
    place: int = 0
    only: Guid | None = None
    """Tell it of this writer alone: of what it was not told before."""


class _Teller(Entity):
    """The writer that hands on what the store holds of one topic."""

    def __init__(
        self,
        participant: DomainParticipant,
        data: DiscoveredWriterData,
        support: TypeSupport[Any] | None,
        topic: DurableTopic,
    ) -> None:
        super().__init__(None)
        self._participant = participant
        self._pump = participant._running_pump()
        self._topic = topic
        self._support = support
        self._has_written = False
        self._listeners: dict[Guid, list[_Listener]] = {}
        self._writer: LocalWriter = self._pump.engine.create_writer(
            data.topic_name, data.type_name, _teller_qos(data.qos), self._pump.now(),
            is_keyed=data.is_keyed, filters=True, types=None if support is None else support.type_description,
        )  # fmt: skip
        self._writer.wants_acknowledgment += 1  # each one makes room for the next portion
        participant._adopt(self)
        participant._register(self._writer.guid, self)
        self._tell()

    def writer_lost(self, writer: Guid, now: float, lease: float) -> None:
        """Who joined when it may have been dead already has missed what it wrote."""
        for listeners in list(self._listeners.values()):
            for listener in list(listeners):
                if writer in listener.untold:
                    listener.untold -= {writer}
                    if listener.since >= now - lease:
                        listeners.append(_Listener(listener.data, listener.end, now, only=writer))
        self._tell()

    def _status_changed(self, status: Status) -> None:
        if isinstance(status, PublicationMatched):
            self._tell()

    def _made_progress(self) -> None:
        self._tell()

    def _tell(self) -> None:
        """As much as may be under way to each reader."""
        behavior, store, now = self._writer.behavior, self._topic.store, self._pump.now()
        readers = {guid: proxy.data for guid, proxy in behavior.readers.items()}
        self._listeners = {guid: found for guid, found in self._listeners.items() if guid in readers}
        for guid, data in readers.items():
            wants_history = data.qos.is_transient_local and data.qos.is_reliable
            if guid not in self._listeners and wants_history and not _is_of_service(data):
                untold = frozenset() if data.vendor_id == OUR_VENDOR_ID else self._topic.alive()
                self._listeners[guid] = [_Listener(data, store.last_place(), now, untold)]
            for listener in self._listeners.get(guid, ()):
                self._tell_one(listener)
        if self._has_written:
            self._has_written = False
            self._pump.call_soon(self._pump.settle)

    def _tell_one(self, listener: _Listener) -> None:
        behavior = self._writer.behavior
        assert isinstance(behavior, FilteringWriter)
        while (
            listener.place < listener.end
            and not behavior.has_overflow(listener.data.guid)
            and behavior.cache.octets < _MOST_OCTETS
        ):
            portion = self._topic.store.samples(self._topic.stored, after=listener.place, limit=_PORTION)
            if not portion:
                listener.place = listener.end
            for sample in portion:
                listener.place = sample.place
                is_wanted = sample.writer == listener.only if listener.only else sample.writer not in listener.untold
                if sample.place <= listener.end and is_wanted:
                    self._write(sample, listener.data.guid)

    def _write(self, sample: StoredSample, reader: Guid) -> None:
        now = self._pump.now()
        change = self._writer.behavior.new_change(
            sample.kind, sample.payload, sample.key, sample.timestamp, now,
            key_hash=self._key_hash(sample), destination=reader,
        )  # fmt: skip
        change.original = sample.writer, sample.number
        self._pump.engine.change_added(self._writer, change, now)
        self._has_written = True

    def _key_hash(self, sample: StoredSample) -> bytes:
        is_secret = self._writer.protection.key_protected
        if self._support is None:
            return sample.key if len(sample.key) == _KEY_HASH_OCTETS else b""
        if sample.kind is ChangeKind.ALIVE and not is_secret:
            return b""
        representation = self._writer.data.qos.data_representation.ids[0]
        return self._support.key_hash(sample.key, representation, is_secret=is_secret)

    def _on_close(self) -> None:
        self._participant._disown(self)
        self._participant._deregister(self._writer.guid)
        self._participant._when_running(lambda pump: pump.engine.delete_writer(self._writer, pump.now()))


class DurableTopic:
    """For one topic of the store: ``stored`` says which, ``store`` holds what was said."""

    def __init__(
        self,
        participant: DomainParticipant,
        store: SampleStore,
        stored: StoredTopic,
        support: TypeSupport[Any] | None,
        leases: dict[Guid, float],
    ) -> None:
        """``support``: of its type; None where nobody tells it, so that instances cannot be told apart.

        ``leases``: as of :meth:`writers_changed`.  Raises NotAllowedBySecurity.
        """
        self.store = store
        self.stored = stored
        self.knows_type = support is not None
        data = decode_writer(stored.announcement, OUR_VENDOR_ID)
        self._limits = data.qos.durability_service if support is not None or not data.is_keyed else _WITHOUT_KEYS
        self._writers = dict(leases)
        self._recorder = _Recorder(participant, data, support)
        try:
            self._teller = _Teller(participant, data, support, self)
        except BaseException:
            self._recorder.close()
            raise

    def alive(self) -> frozenset[Guid]:
        """The writers that speak for themselves."""
        return frozenset(self._writers)

    def writers_changed(self, leases: dict[Guid, float], now: float) -> None:
        """These writers of the topic are there now; each with the lease of its participant, in seconds."""
        lost = {guid: lease for guid, lease in self._writers.items() if guid not in leases}
        self._writers = dict(leases)
        for guid, lease in lost.items():
            self._teller.writer_lost(guid, now, lease)

    async def record(self) -> None:
        """Keep what is written, until it is closed."""
        with suppress(AlreadyDeleted):
            while True:
                await self._recorder.wait()
                for sample in self._recorder.take(_PORTION):
                    self._keep(sample.data)
                self.store.commit()

    def _keep(self, change: CacheChange) -> None:
        key = change.key or change.key_hash
        if change.kind is not ChangeKind.ALIVE and not key and self.stored.is_keyed:
            return  # the end of nobody knows what
        self.store.add(
            self.stored, change.writer_guid, change.sequence_number, change.kind, key, bytes(change.payload),
            change.source_timestamp, limits=self._limits, now=Time(change.source_timestamp),
        )  # fmt: skip

    def close(self) -> None:
        self._recorder.close()
        self._teller.close()


_WITHOUT_KEYS = DurabilityService(history=KeepAll(), max_samples=10_000)
"""For a type that nobody tells: its samples cannot be told apart by instance."""


def _is_of_service(data: DiscoveredReaderData) -> bool:
    return data.qos.user_data.value == REPLAY_USER_DATA


def _recorder_qos(offered: EndpointQos) -> EndpointQos:
    """What asks for all that the writer offers, and gives up nothing."""
    return EndpointQos(
        reliability=offered.reliability,
        durability=offered.durability,
        history=KeepAll(),
        ownership=offered.ownership,
        partition=offered.partition,
        data_representation=offered.data_representation,
        user_data=UserData(REPLAY_USER_DATA),
    )


def _teller_qos(offered: EndpointQos) -> EndpointQos:
    return replace(
        offered,
        reliability=Reliable(),
        history=KeepAll(),
        resource_limits=ResourceLimits(),
        deadline=Deadline(),
        liveliness=Automatic(),
        ownership_strength=OwnershipStrength(_WEAKEST),
        presentation=Presentation(),
        user_data=UserData(REPLAY_USER_DATA),
    )
