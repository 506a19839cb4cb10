"""DataReader: reads samples of one topic.  DDS 1.4 §2.2.2.5.3 (DataReader)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, ClassVar, Generic, TypeVar

import trio

from ..behavior.reader_history_cache import ReaderHistoryCache, SampleSelector
from ..engine import KeyCodec, LocalReader
from ..structure.cache_change import CacheChange
from ..structure.errors import DdsTimeout, MalformedSample
from ..structure.guid import Guid
from ..structure.qos import EndpointQos, Qos, reader_qos
from ..structure.qos_policies import DataRepresentation, DataRepresentationId
from ..structure.sample_info import ANY_INSTANCE_STATE, ANY_SAMPLE_STATE, ANY_VIEW_STATE, SampleInfo, SampleState
from ..structure.status import (
    InconsistentTopic,
    LivelinessChanged,
    RequestedDeadlineMissed,
    RequestedIncompatibleQos,
    SampleLost,
    SampleRejected,
    SecurityRefused,
    Status,
    SubscriptionMatched,
)
from .conditions import ReadCondition
from .entity import Entity, deadline_scope
from .groups import Subscriber, check_family
from .sample import Sample
from .topic import Topic

if TYPE_CHECKING:
    from .participant import DomainParticipant

__all__ = ["DataReader"]

T = TypeVar("T")

_LOOK_FOR_HISTORY_S = 0.005
_UNREAD = ReadCondition(sample_states=SampleState.NOT_READ)


class DataReader(Entity, Generic[T]):
    """Reads samples of a topic: ``async for sample in reader``, or ``take`` and ``read``, which never wait."""

    STATUSES: ClassVar[tuple[type, ...]] = (
        SubscriptionMatched,
        RequestedIncompatibleQos,
        LivelinessChanged,
        RequestedDeadlineMissed,
        SampleLost,
        SampleRejected,
        InconsistentTopic,
        SecurityRefused,
    )

    def __init__(self, parent: DomainParticipant | Subscriber, topic: Topic[T], qos: Qos | None = None) -> None:
        """``qos`` goes before the subscriber's, and that before the topic's; the rest is the OMG's default.

        Raises InconsistentPolicy, NotAllowedBySecurity, AlreadyDeleted; then nothing has been created.
        """
        participant = check_family(parent, topic, Subscriber)
        group_qos = parent.qos if isinstance(parent, Subscriber) else Qos()
        super().__init__(qos)
        self._qos = topic.qos | group_qos | self._qos
        self._parent = parent
        self._participant = participant
        self._topic = topic
        support = topic.type_support
        self._deserialize = support.deserialize
        self._deserialize_key = support.deserialize_key
        self._endpoint_qos = _with_representations(reader_qos(self._qos))
        self._news = trio.lowlevel.ParkingLot()
        self._undecodable: list[CacheChange] = []
        self._pump = participant._running_pump()
        self._reader: LocalReader = self._pump.engine.create_reader(
            topic.name,
            support.type_name,
            self._endpoint_qos,
            self._pump.now(),
            is_keyed=support.is_keyed,
            keys=_key_codec(topic) if support.is_keyed else None,
        )
        history = self._reader.history
        assert history is not None
        self._history: ReaderHistoryCache = history
        parent._adopt(self)
        participant._register(self._reader.guid, self)
        self._pump.settle()

    def __repr__(self) -> str:
        return f"<DataReader of {self._topic.name!r} {self.guid}, {len(self._history)} samples>"

    @property
    def topic(self) -> Topic[T]:
        return self._topic

    @property
    def guid(self) -> Guid:
        return self._reader.guid

    @property
    def endpoint_qos(self) -> EndpointQos:
        """Every policy as it holds for this reader, defaults filled in."""
        return self._endpoint_qos

    # --- reading -----------------------------------------------------------------------------------------

    def __aiter__(self) -> DataReader[T]:
        return self

    async def __anext__(self) -> Sample[T]:
        """Take the next sample, waiting for one.  Iteration ends when the reader is closed.

        Raises NotAllowedBySecurity when it was closed because its participant's rights have ended.
        """
        await self._pump.checkpoint(self._pump.now())
        while not self._is_closed:
            taken = self._history.take_next()
            if taken is not None:
                sample = self._sample(*taken)
                self._after_taking()
                if sample is not None:
                    return sample
                continue
            await self._wait_for_news()
        self._check_not_revoked()
        raise StopAsyncIteration

    def take(
        self,
        max_samples: int | None = None,
        *,
        condition: ReadCondition | None = None,
        sample_states: int = ANY_SAMPLE_STATE,
        view_states: int = ANY_VIEW_STATE,
        instance_states: int = ANY_INSTANCE_STATE,
        instance: bytes | None = None,
    ) -> list[Sample[T]]:
        """Samples that are here now, oldest first, removed from the reader; never waits.

        ``max_samples``: at most so many.  Masks select by state, ``condition`` brings masks of its own,
        ``instance`` (an ``info.instance_handle``) selects one instance.  Raises AlreadyDeleted.
        """
        self._check_open()
        states, selector = self._selection(condition, sample_states, view_states, instance_states)
        self._history.seen()
        taken = self._history.take(max_samples, **states, instance=instance, selector=selector)
        samples = [sample for info, change in taken if (sample := self._sample(info, change)) is not None]
        self._drop_undecodable()
        self._after_taking()
        return samples

    def read(
        self,
        max_samples: int | None = None,
        *,
        condition: ReadCondition | None = None,
        sample_states: int = ANY_SAMPLE_STATE,
        view_states: int = ANY_VIEW_STATE,
        instance_states: int = ANY_INSTANCE_STATE,
        instance: bytes | None = None,
    ) -> list[Sample[T]]:
        """As :meth:`take`, but the samples stay in the reader and count as read from now on."""
        self._check_open()
        states, selector = self._selection(condition, sample_states, view_states, instance_states)
        self._history.seen()
        found = self._history.read(max_samples, **states, instance=instance, selector=selector)
        samples = [sample for info, change in found if (sample := self._sample(info, change)) is not None]
        self._drop_undecodable()
        return samples

    async def wait(self, condition: ReadCondition | None = None) -> None:
        """Until there is a sample that fits ``condition`` (none given: one that has not been read).

        Raises AlreadyDeleted, also when the reader is closed meanwhile.
        """
        self._check_open()
        await self._pump.checkpoint(self._pump.now())
        states, selector = self._selection(condition or _UNREAD, ANY_SAMPLE_STATE, ANY_VIEW_STATE, ANY_INSTANCE_STATE)
        while not self._history.matches(selector=selector, **states):
            self._drop_undecodable()
            self._check_open()
            await self._wait_for_news()
        self._drop_undecodable()

    def lookup_instance(self, sample: T) -> bytes | None:
        """The handle of the instance that ``sample`` belongs to; None if the reader does not know it."""
        key = self._topic.type_support.key(sample)
        return key if key in self._history.instances else None

    # --- waiting -----------------------------------------------------------------------------------------

    async def wait_for_matched(self, count: int = 1, timeout: float | None = None) -> None:
        """Until at least ``count`` writers are matched.  Raises DdsTimeout after ``timeout`` seconds."""
        await self._participant._wait_until(
            self, lambda: self._reader.matched.current_count >= count, timeout,
            f"reader of {self._topic.name!r} has not matched {count} writer(s)",
        )  # fmt: skip

    async def wait_for_historical_data(self, timeout: float | None = None) -> None:
        """Until all that the matched transient-local writers held at the match has come.  Raises DdsTimeout.

        DDS 1.4 §2.2.2.5.3.31.  Returns at once where no matched writer keeps history.
        """
        self._check_open()
        scope = deadline_scope(timeout)
        self._pump.before_waiting()
        await trio.lowlevel.checkpoint()
        with scope:
            # Looked at now and then: a HEARTBEAT that says "there was nothing" is no news for anybody else.
            while not all(proxy.has_historical_data for proxy in self._reader.behavior.writers.values()):
                await trio.sleep(_LOOK_FOR_HISTORY_S)
                self._check_open()
            return
        raise DdsTimeout(f"reader of {self._topic.name!r} still lacks historical data after {timeout} s")

    def matched_publications(self) -> list[Guid]:
        """The Guids of the writers that are matched now."""
        return list(self._reader.behavior.writers)

    # --- inside ------------------------------------------------------------------------------------------

    async def _wait_for_news(self) -> None:
        """Until something may have changed.  What this task has written must not wait meanwhile."""
        self._history.seen()
        self._pump.before_waiting()
        await self._news.park()

    def _has_news(self) -> None:
        self._news.unpark_all()
        self._changed.unpark_all()

    def _sample(self, info: SampleInfo, change: CacheChange) -> Sample[T] | None:
        """The sample as an object; None, and counted as lost, if its octets are not one."""
        try:
            if info.valid_data:
                return Sample(self._deserialize(change.payload), info)
            return Sample(self._key_sample(change, info), info)
        except MalformedSample as error:
            if not any(change is known for known in self._undecodable):
                self._undecodable.append(change)
                self._pump.engine.sample_malformed(self._reader, change, str(error))
                self._pump.settle()
            return None

    def _drop_undecodable(self) -> None:
        """What was found not to decode while it stays in the cache: nobody shall meet it again."""
        if self._undecodable:
            undecodable, self._undecodable = self._undecodable, []
            self._history.take(selector=lambda info: any(info.change is known for known in undecodable))
            self._after_taking()

    def _key_sample(self, change: CacheChange, info: SampleInfo) -> T:
        if len(change.payload) >= 4:
            return self._deserialize_key(change.payload)
        return self._topic.type_support.sample_from_key(info.instance_handle)

    def _after_taking(self) -> None:
        """There is room again: a reliable writer whose samples had to wait may go on."""
        if self._history.is_withholding:
            self._history.is_withholding = False
            self._pump.engine.samples_taken(self._reader, self._pump.now())
            self._pump.settle()

    def _selection(
        self, condition: ReadCondition | None, sample_states: int, view_states: int, instance_states: int
    ) -> tuple[dict[str, int], SampleSelector | None]:
        selector: SampleSelector | None = None
        if condition is not None:
            sample_states &= condition.sample_states
            view_states &= condition.view_states
            instance_states &= condition.instance_states
            query = condition.query
            if query is not None:
                selector = self._selector(query)
        states = {"sample_states": sample_states, "view_states": view_states, "instance_states": instance_states}
        return states, selector

    def _selector(self, query: Callable[[T], bool]) -> SampleSelector:
        def selects(info: SampleInfo) -> bool:
            change = info.change
            sample = self._sample(info, change) if change is not None else None
            return sample is not None and bool(query(sample.data))

        return selects

    def _status_changed(self, status: Status) -> None:
        if isinstance(status, InconsistentTopic):
            self._topic._found_inconsistent(status.remote_type_name)
        super()._status_changed(status)

    def _on_close(self) -> None:
        self._parent._disown(self)
        self._news.unpark_all()
        self._participant._deregister(self._reader.guid)
        self._participant._when_running(lambda pump: pump.engine.delete_reader(self._reader, pump.now()))


def _with_representations(qos: EndpointQos) -> EndpointQos:
    """A reader understands both, unless told to insist on one."""
    if qos.data_representation.ids:
        return qos
    both = DataRepresentation(DataRepresentationId.XCDR1, DataRepresentationId.XCDR2)
    return replace(qos, data_representation=both)


def _key_codec(topic: Topic[T]) -> KeyCodec:
    support = topic.type_support
    return KeyCodec(
        from_payload=support.key_from_payload,
        from_key_payload=support.key_from_key_payload,
        from_key_hash=support.key_from_key_hash,
        to_key_hash=lambda key: support.key_hash(key, DataRepresentationId.XCDR1),
        to_secret_key_hash=lambda key: support.key_hash(key, DataRepresentationId.XCDR1, is_secret=True),
    )
