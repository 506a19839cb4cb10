"""Writers and readers of ``ddsi.blocking`` and ``ddsi.aio``: what of them never waits, and what both do alike.

DDS 1.4 §2.2.2.4.2 (DataWriter), §2.2.2.5.3 (DataReader).
"""

from __future__ import annotations

import weakref
from collections import deque
from functools import partial
from typing import Any, Generic, TypedDict, TypeVar

from .. import dcps
from ..dcps.sample_reader import SampleReader
from ..structure.builtin_topic_data import (
    ParticipantBuiltinTopicData,
    PublicationBuiltinTopicData,
    SubscriptionBuiltinTopicData,
    TopicBuiltinTopicData,
)
from ..structure.guid import Guid
from ..structure.qos import EndpointQos, Qos
from .call import Lane
from .engine_thread import EngineThread
from .entities import EntityPortal, GroupPortal, ParticipantPortal, SubscriberPortal, check_parent
from .fetching import Fetching
from .topics import FilteredTopicPortal, MultiTopicPortal, TopicPortal

__all__ = [
    "BuiltinTopicReaderPortal",
    "InstanceSelection",
    "MultiTopicReaderPortal",
    "ReaderPortal",
    "SampleReaderPortal",
    "Selection",
    "WriterPortal",
]

T = TypeVar("T")
B = TypeVar(
    "B",
    ParticipantBuiltinTopicData,
    TopicBuiltinTopicData,
    PublicationBuiltinTopicData,
    SubscriptionBuiltinTopicData,
)
_FETCHED_AT_ONCE = 64


class InstanceSelection(TypedDict, total=False):
    """The keywords of ``take_next_instance`` and ``read_next_instance``, as those of ``ddsi.DataReader``."""

    condition: dcps.ReadCondition | None
    sample_states: int
    view_states: int
    instance_states: int


class Selection(InstanceSelection, total=False):
    """The keywords of ``take`` and ``read``; their meaning and defaults are those of ``ddsi.DataReader.take``."""

    instance: bytes | None


class WriterPortal(EntityPortal, Generic[T]):
    """A writer, and the lane in which its writes go one after the other."""

    STATUSES = dcps.DataWriter.STATUSES

    def __init__(self, parent: ParticipantPortal | GroupPortal, topic: TopicPortal[T], qos: Qos | None = None) -> None:
        """As ``ddsi.DataWriter``; ``parent`` and ``topic`` are of this module."""
        check_parent(parent, ParticipantPortal, GroupPortal)
        check_parent(topic, TopicPortal)
        self._parent = parent
        self._topic = topic
        participant = topic._participant
        self._lane = Lane()

        def create() -> dcps.DataWriter[T]:
            writer: dcps.DataWriter[T] = dcps.DataWriter(parent._inner, topic._inner, qos)  # type: ignore[arg-type]
            participant._engine.begin(self._lane.run)
            return writer

        self._inner = participant._ask(create)
        # A lane that nobody puts anything into any more ends, and with it the task.
        weakref.finalize(self, participant._engine.post, self._lane.close).atexit = False
        super().__init__(participant._engine, self._inner)

    @property
    def topic(self) -> TopicPortal[T]:
        return self._topic

    @property
    def guid(self) -> Guid:
        return self._inner.guid

    @property
    def endpoint_qos(self) -> EndpointQos:
        """Every policy as it holds for this writer, defaults filled in."""
        return self._inner.endpoint_qos

    def register_instance(self, sample: T) -> bytes:
        """Announce that the instance that ``sample`` belongs to will be written; returns its handle."""
        return self._ask(partial(self._inner.register_instance, sample))

    def lookup_instance(self, sample: T) -> bytes | None:
        """The handle of the instance that ``sample`` belongs to; None if it is not registered here."""
        return self._ask(partial(self._inner.lookup_instance, sample))

    def get_key_value(self, handle: bytes) -> T:
        """A sample with the key of a registered instance, the type's defaults elsewhere.  Raises BadParameter."""
        return self._ask(partial(self._inner.get_key_value, handle))

    def matched_subscriptions(self) -> list[Guid]:
        """The Guids of the readers that are matched now."""
        return self._engine.run_now(self._inner.matched_subscriptions)

    def matched_subscription_data(self, handle: Guid) -> SubscriptionBuiltinTopicData:
        """See ``ddsi.DataWriter.matched_subscription_data``."""
        return self._engine.run_now(self._inner.matched_subscription_data, handle)

    def assert_liveliness(self) -> None:
        """Say that this writer is alive, where its liveliness is manual."""
        self._engine.run_now(self._inner.assert_liveliness)

    def close(self) -> None:
        """End the writer; writes that still wait raise AlreadyDeleted."""
        self._engine.post(self._lane.close)
        super().close()

    async def _write_all(self, samples: list[T]) -> None:
        for sample in samples:
            await self._inner.write(sample)


class SampleReaderPortal(Fetching[dcps.Sample[T]], EntityPortal, Generic[T]):
    """What readers of topics, of builtin topics and of joined ones share.

    Iteration fetches what is there, at most 64 samples at once, as crossing threads costs more than a sample does.
    What was fetched and not yet handed out has been taken as far as the reader is concerned.
    """

    def __init__(self, engine: EngineThread, inner: SampleReader[T]) -> None:
        super().__init__(engine, inner)
        self._source = inner
        self._fetched: deque[dcps.Sample[T]] = deque()

    def _is_at_end(self) -> bool:
        return self._entity.is_closed

    async def _fetch(self) -> None:
        try:
            self._fetched.append(await self._source.__anext__())
        except StopAsyncIteration:
            return
        # No await from here on: a cancellation finds either nothing taken or all of it kept.  As iteration does it, and
        # not by `take`, which puts the samples of an instance together.
        source = self._source
        while len(self._fetched) < _FETCHED_AT_ONCE and (taken := source._history.take_next()) is not None:
            sample = source._sample(*taken)
            if sample is not None:
                self._fetched.append(sample)
        source._after_taking()

    def _take_now(self, max_samples: int | None, selection: Selection) -> list[dcps.Sample[T]]:
        """In the engine's thread."""
        fetched: list[dcps.Sample[T]] = []
        if not any(value is not None for value in selection.values()):
            while self._fetched and (max_samples is None or len(fetched) < max_samples):
                fetched.append(self._fetched.popleft())
        if max_samples is not None and len(fetched) >= max_samples > 0:
            return fetched
        rest = None if max_samples is None else max_samples - len(fetched)
        return fetched + self._source.take(rest, **selection)

    async def _wait_now(self, condition: dcps.ReadCondition | None) -> None:
        """In the engine's thread."""
        if not self._fetched or condition is not None:
            await self._source.wait(condition)

    def close(self) -> None:
        super().close()
        self._fetched.clear()


class BuiltinTopicReaderPortal(SampleReaderPortal[B]):
    """A reader of a builtin topic."""

    def __init__(self, participant: ParticipantPortal, kind: type[B]) -> None:
        """As ``ddsi.BuiltinTopicReader``; ``participant`` is one of this module's."""
        check_parent(participant, ParticipantPortal)
        self._participant = participant
        create = partial(dcps.BuiltinTopicReader, participant._inner, kind)
        self._inner: dcps.BuiltinTopicReader[Any] = participant._ask(create)
        super().__init__(participant._engine, self._inner)

    @property
    def guid(self) -> Guid:
        """Its own, which no other participant knows."""
        return self._inner.guid


class MultiTopicReaderPortal(SampleReaderPortal[T]):
    """A reader of joined topics."""

    STATUSES = dcps.MultiTopicReader.STATUSES

    def __init__(
        self, parent: ParticipantPortal | GroupPortal, topic: MultiTopicPortal[T], qos: Qos | None = None
    ) -> None:
        """As ``ddsi.MultiTopicReader``; ``parent`` and ``topic`` are of this module."""
        check_parent(parent, ParticipantPortal, GroupPortal)
        check_parent(topic, MultiTopicPortal)
        self._parent = parent
        self._topic = topic
        create = partial(dcps.MultiTopicReader, parent._inner, topic._inner, qos)  # type: ignore[arg-type]
        self._inner: dcps.MultiTopicReader[T] = topic._participant._ask(create)
        super().__init__(topic._participant._engine, self._inner)

    @property
    def topic(self) -> MultiTopicPortal[T]:
        return self._topic


class ReaderPortal(SampleReaderPortal[T]):
    """A reader of a topic."""

    STATUSES = dcps.DataReader.STATUSES

    def __init__(
        self,
        parent: ParticipantPortal | GroupPortal,
        topic: TopicPortal[T] | FilteredTopicPortal[T],
        qos: Qos | None = None,
    ) -> None:
        """As ``ddsi.DataReader``; ``parent`` and ``topic`` are of this module."""
        check_parent(parent, ParticipantPortal, GroupPortal)
        check_parent(topic, TopicPortal, FilteredTopicPortal)
        self._parent = parent
        self._topic = topic.related_topic if isinstance(topic, FilteredTopicPortal) else topic
        create = partial(dcps.DataReader, parent._inner, topic._inner, qos)  # type: ignore[arg-type]
        self._inner: dcps.DataReader[T] = topic._participant._ask(create)
        super().__init__(topic._participant._engine, self._inner)
        if isinstance(parent, SubscriberPortal):
            parent._readers[self._inner] = self

    @property
    def guid(self) -> Guid:
        return self._inner.guid

    def close(self) -> None:
        super().close()
        if isinstance(self._parent, SubscriberPortal):
            self._parent._readers.pop(self._inner, None)

    @property
    def topic(self) -> TopicPortal[T]:
        return self._topic

    @property
    def endpoint_qos(self) -> EndpointQos:
        """Every policy as it holds for this reader, defaults filled in."""
        return self._inner.endpoint_qos

    def lookup_instance(self, sample: T) -> bytes | None:
        """The handle of the instance that ``sample`` belongs to; None if the reader does not know it."""
        return self._engine.run_now(self._inner.lookup_instance, sample)

    def get_key_value(self, handle: bytes) -> T:
        """A sample with the key of a known instance, the type's defaults elsewhere.  Raises BadParameter."""
        return self._ask(partial(self._inner.get_key_value, handle))

    def matched_publications(self) -> list[Guid]:
        """The Guids of the writers that are matched now."""
        return self._engine.run_now(self._inner.matched_publications)

    def matched_publication_data(self, handle: Guid) -> PublicationBuiltinTopicData:
        """See ``ddsi.DataReader.matched_publication_data``."""
        return self._engine.run_now(self._inner.matched_publication_data, handle)
