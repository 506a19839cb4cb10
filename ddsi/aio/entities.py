"""The entities for asyncio.  DDS 1.4 §2.2.2.

The arguments, results and errors are those of ``ddsi``; what differs is said here.  ``take`` and ``read`` are awaited,
as they ask another thread.
"""

from __future__ import annotations

from collections.abc import AsyncIterator, Callable, Iterable
from functools import partial
from types import TracebackType
from typing import TYPE_CHECKING, Any, Generic, Self, TypeVar, Unpack

from .. import dcps
from ..config import Config
from ..dcps.data_writer import Timestamp
from ..dcps.type_access import AnnouncedEndpoint
from ..portal.conditions import WaitSetPortal
from ..portal.endpoints import (
    B,
    BuiltinTopicReaderPortal,
    InstanceSelection,
    MultiTopicReaderPortal,
    ReaderPortal,
    SampleReaderPortal,
    Selection,
    WriterPortal,
)
from ..portal.entities import EntityPortal, ParticipantPortal, PublisherPortal, SubscriberPortal
from ..portal.fetching import EventStreamPortal, Fetching
from ..portal.topics import FilteredTopicPortal, MultiTopicPortal, TopicPortal
from ..structure.errors import AlreadyDeleted, PreconditionNotMet
from ..structure.qos import Qos
from ..structure.status import Status

if TYPE_CHECKING:
    from ..trace.sink import TraceSink

__all__ = [
    "BuiltinTopicReader",
    "ContentFilteredTopic",
    "DataReader",
    "DataWriter",
    "DomainParticipant",
    "EventStream",
    "MultiTopic",
    "MultiTopicReader",
    "Publisher",
    "Subscriber",
    "Topic",
    "WaitSet",
]

T = TypeVar("T")


class _Iterated(Fetching[T], AsyncIterator[T]):
    """``async for``: one after the other, waiting for more until there can be none."""

    def __aiter__(self) -> Self:
        return self

    async def __anext__(self) -> T:
        while not self._fetched:  # once more, where another task took what this one has fetched
            if self._is_at_end():
                raise StopAsyncIteration
            try:
                await self._engine.run_for_asyncio(self._fetch)
            except AlreadyDeleted:  # the participant has gone altogether
                raise StopAsyncIteration from None
        return self._fetched.popleft()


class EventStream(_Iterated[Status], EventStreamPortal):
    """``async for event in entity.events()``: the statuses of one entity as they change, until it is closed."""


class _Async(EntityPortal):
    """What all entities of this module have besides."""

    def events(self) -> EventStream:
        """The communication statuses from now on; what happened while nobody listened (the latest 64) comes first."""
        return EventStream(self)


class DomainParticipant(_Async, ParticipantPortal):
    """A member of a domain: ``async with DomainParticipant(0) as participant: ...``"""

    def __init__(
        self,
        domain_id: int = 0,
        *,
        qos: Qos | None = None,
        config: Config | None = None,
        trace: TraceSink | None = None,
    ) -> None:
        """As ``ddsi.DomainParticipant``.  Nothing happens before ``async with``."""
        super().__init__(domain_id, qos=qos, config=config, trace=trace)
        self._was_entered = False

    async def __aenter__(self) -> Self:
        if self._was_entered:
            raise PreconditionNotMet(f"{self!r} was entered before; a DomainParticipant is entered once, make another")
        self._was_entered = True
        stay = self._reserve()
        try:
            await self._engine.run_for_asyncio(stay.enter)
        except BaseException:
            self._has_failed(stay)
            raise
        self._has_entered()
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        stay = self._begin_to_leave()
        if stay is None or self._engine.is_of_parent:
            return
        try:
            await self._engine.run_for_asyncio(partial(stay.leave, at_once=error is not None))
        finally:
            self._engine.join()

    async def wait_for_discovery(self) -> None:
        """Until the tables of remote participants and endpoints change.  Raises AlreadyDeleted."""
        await self._engine.run_for_asyncio(self._inner.wait_for_discovery)

    async def discover_type(self, topic_name: str, *, timeout: float | None = 10.0) -> type[Any]:
        """The type of a topic that others write or read: see ``ddsi.DomainParticipant.discover_type``."""
        return await self._engine.run_for_asyncio(self._inner.discover_type, topic_name, timeout=timeout)

    async def endpoint_type(self, endpoint: AnnouncedEndpoint, *, timeout: float | None = 10.0) -> type[Any]:
        """The type of one remote writer or reader, as a class: see ``ddsi.DomainParticipant.endpoint_type``."""
        return await self._engine.run_for_asyncio(self._inner.endpoint_type, endpoint, timeout=timeout)


class Topic(_Async, TopicPortal[T], Generic[T]):
    """What writers and readers agree on: the topic's name and the type of its samples."""


class ContentFilteredTopic(_Async, FilteredTopicPortal[T], Generic[T]):
    """Given to a DataReader in a Topic's place, lets it see only what passes: see ``ddsi.ContentFilteredTopic``."""


class MultiTopic(_Async, MultiTopicPortal[T], Generic[T]):
    """Several topics joined, selected from and filtered, for a MultiTopicReader: see ``ddsi.MultiTopic``."""


class Publisher(_Async, PublisherPortal):
    """The writers created with it have its policies wherever they do not set their own."""

    async def wait_for_acknowledgments(self, timeout: float | None = None) -> None:
        """Until all that its writers have written so far is acknowledged.  Raises DdsTimeout, AlreadyDeleted."""
        await self._engine.run_for_asyncio(self._inner.wait_for_acknowledgments, timeout)


class Subscriber(_Async, SubscriberPortal):
    """The readers created with it have its policies wherever they do not set their own."""

    async def get_datareaders(self, **selection: Unpack[InstanceSelection]) -> list[DataReader[Any]]:
        """The readers that have samples in these states: see ``ddsi.Subscriber.get_datareaders``."""
        found = await self._engine.run_for_asyncio(_soon, partial(self._inner.get_datareaders, **selection))
        return [reader for inner in found if isinstance(reader := self._readers.get(inner), DataReader)]

    async def wait(self) -> None:
        """Until one of the readers has a sample that has not been read.  Raises AlreadyDeleted."""
        await self._engine.run_for_asyncio(self._inner.wait)


class DataWriter(_Async, WriterPortal[T], Generic[T]):
    """Writes samples of a topic.  What several tasks write at once leaves in the order in which they asked."""

    def __init__(self, parent: DomainParticipant | Publisher, topic: Topic[T], qos: Qos | None = None) -> None:
        """Raises InconsistentPolicy, NotAllowedBySecurity, AlreadyDeleted; then nothing has been created."""
        super().__init__(parent, topic, qos)

    async def write(self, sample: T, *, timestamp: Timestamp | None = None) -> None:
        """Write one sample: see ``ddsi.DataWriter.write``."""
        write = partial(self._inner.write, sample, timestamp=timestamp)
        await self._engine.run_in_lane_for_asyncio(self._lane, write)

    async def write_all(self, samples: Iterable[T]) -> None:
        """Write them in order.  Several times faster than one by one, as threads are crossed once.

        What is raised for one leaves those before it written and those after it not.
        """
        await self._engine.run_in_lane_for_asyncio(self._lane, partial(self._write_all, list(samples)))

    async def dispose(self, sample: T, *, timestamp: Timestamp | None = None) -> None:
        """The instance that ``sample`` belongs to (only its key fields matter) has come to its end."""
        dispose = partial(self._inner.dispose, sample, timestamp=timestamp)
        await self._engine.run_in_lane_for_asyncio(self._lane, dispose)

    async def unregister(self, sample: T, *, timestamp: Timestamp | None = None) -> None:
        """This writer says nothing more of the instance."""
        unregister = partial(self._inner.unregister, sample, timestamp=timestamp)
        await self._engine.run_in_lane_for_asyncio(self._lane, unregister)

    async def wait_for_acknowledgments(self, timeout: float | None = None) -> None:
        """Until every matched reliable reader has all that was written so far.  Raises DdsTimeout."""
        await self._engine.run_for_asyncio(self._inner.wait_for_acknowledgments, timeout)

    async def wait_for_matched(self, count: int = 1, timeout: float | None = None) -> None:
        """Until at least ``count`` readers are matched.  Raises DdsTimeout after ``timeout`` seconds."""
        await self._engine.run_for_asyncio(self._inner.wait_for_matched, count, timeout)


class _Reading(_Async, _Iterated[dcps.Sample[T]], SampleReaderPortal[T], Generic[T]):
    """``async for sample in reader`` takes one after the other, and waits for more until the reader is closed."""

    async def take(self, max_samples: int | None = None, **selection: Unpack[Selection]) -> list[dcps.Sample[T]]:
        """Samples that are here now, oldest first, removed from the reader; waits for none to come."""
        return await self._engine.run_for_asyncio(_soon, partial(self._take_now, max_samples, selection))

    async def read(self, max_samples: int | None = None, **selection: Unpack[Selection]) -> list[dcps.Sample[T]]:
        """As :meth:`take`, but the samples stay in the reader and count as read from now on."""
        return await self._engine.run_for_asyncio(_soon, partial(self._source.read, max_samples, **selection))

    async def take_next_instance(
        self, previous: bytes | None, max_samples: int | None = None, **selection: Unpack[InstanceSelection]
    ) -> list[dcps.Sample[T]]:
        """As :meth:`take`, of the first instance behind the handle ``previous`` that has such samples."""
        take = partial(self._source.take_next_instance, previous, max_samples, **selection)
        return await self._engine.run_for_asyncio(_soon, take)

    async def read_next_instance(
        self, previous: bytes | None, max_samples: int | None = None, **selection: Unpack[InstanceSelection]
    ) -> list[dcps.Sample[T]]:
        """As :meth:`take_next_instance`, but the samples stay and count as read."""
        read = partial(self._source.read_next_instance, previous, max_samples, **selection)
        return await self._engine.run_for_asyncio(_soon, read)

    async def wait(self, condition: dcps.ReadCondition | None = None) -> None:
        """Until there is a sample that fits ``condition`` (none given: one that has not been read).

        Raises AlreadyDeleted, also when the reader is closed meanwhile.
        """
        await self._engine.run_for_asyncio(self._wait_now, condition)


class DataReader(_Reading[T], ReaderPortal[T], Generic[T]):
    """Reads samples of a topic: ``async for sample in reader``, or ``take`` and ``read``."""

    def __init__(
        self,
        parent: DomainParticipant | Subscriber,
        topic: Topic[T] | ContentFilteredTopic[T],
        qos: Qos | None = None,
    ) -> None:
        """Raises InconsistentPolicy, NotAllowedBySecurity, AlreadyDeleted; then nothing has been created."""
        ReaderPortal.__init__(self, parent, topic, qos)

    async def wait_for_matched(self, count: int = 1, timeout: float | None = None) -> None:
        """Until at least ``count`` writers are matched.  Raises DdsTimeout after ``timeout`` seconds."""
        await self._engine.run_for_asyncio(self._inner.wait_for_matched, count, timeout)

    async def wait_for_historical_data(self, timeout: float | None = None) -> None:
        """Until all that the matched transient-local writers held at the match has come.  Raises DdsTimeout."""
        await self._engine.run_for_asyncio(self._inner.wait_for_historical_data, timeout)


class MultiTopicReader(_Reading[T], MultiTopicReaderPortal[T], Generic[T]):
    """Reads the joined samples of a MultiTopic: see ``ddsi.MultiTopicReader``."""

    def __init__(self, parent: DomainParticipant | Subscriber, topic: MultiTopic[T], qos: Qos | None = None) -> None:
        """Raises what DataReader raises; then nothing has been created."""
        MultiTopicReaderPortal.__init__(self, parent, topic, qos)

    async def wait_for_matched(self, count: int = 1, timeout: float | None = None) -> None:
        """Until of each topic at least ``count`` writers are matched.  Raises DdsTimeout after ``timeout`` seconds."""
        await self._engine.run_for_asyncio(self._inner.wait_for_matched, count, timeout)


class BuiltinTopicReader(_Reading[B], BuiltinTopicReaderPortal[B], Generic[B]):
    """Reads of remote participants, topics, writers or readers: see ``ddsi.BuiltinTopicReader``."""

    def __init__(self, participant: DomainParticipant, kind: type[B]) -> None:
        """``kind``: ParticipantBuiltinTopicData, or Topic..., Publication... or SubscriptionBuiltinTopicData."""
        BuiltinTopicReaderPortal.__init__(self, participant, kind)


class WaitSet(WaitSetPortal):
    """Waits for any of several conditions: see ``ddsi.WaitSet``."""

    async def wait(self, timeout: float | None = None) -> list[dcps.Condition]:
        """The conditions that hold; waits until one does.  Raises DdsTimeout, AlreadyDeleted."""
        return await self._engine.run_for_asyncio(self._inner.wait, timeout)


async def _soon(function: Callable[[], T]) -> T:
    """What does not wait, as something that is awaited."""
    return function()
