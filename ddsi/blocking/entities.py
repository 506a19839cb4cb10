"""The entities for plain scripts and threads.  DDS 1.4 §2.2.2.

What waits in ``ddsi`` by ``await`` waits here in the calling thread; Ctrl-C ends any wait.  The arguments, results and
errors are those of ``ddsi``; what differs is said here.
"""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Iterable, Iterator
from contextlib import suppress
from functools import partial
from types import TracebackType
from typing import TYPE_CHECKING, Any, Generic, Self, TypeVar, Unpack

from .. import dcps
from ..config import Config
from ..dcps.data_writer import Timestamp
from ..dcps.entity import deadline_scope
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
from ..structure.errors import AlreadyDeleted, DdsTimeout
from ..structure.qos import Qos
from ..structure.status import Status
from .listener import Listener, Listening

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


class _Iterated(Fetching[T], Iterator[T]):
    """``for``: one after the other, waiting for more until there can be none."""

    def __iter__(self) -> Self:
        return self

    def __next__(self) -> T:
        while True:
            with suppress(IndexError):  # there is none, or another thread has just taken what this one fetched
                return self._fetched.popleft()
            if self._is_at_end():
                raise StopIteration
            try:
                self._engine.run(self._fetch)
            except AlreadyDeleted:  # the participant has gone altogether
                raise StopIteration from None


class EventStream(_Iterated[Status], EventStreamPortal):
    """``for event in entity.events()``: the statuses of one entity as they change, until it is closed."""


class _Blocking(EntityPortal):
    """What all entities of this module have besides."""

    _listening: Listening | None = None

    def events(self) -> EventStream:
        """The communication statuses from now on; what happened while nobody listened (the latest 64) comes first."""
        return EventStream(self)

    def set_listener(self, listener: Listener | None) -> None:
        """Have the ``listener`` called, in a thread of its own, instead of the one before; None: nobody."""
        if self._listening is not None:
            self._listening.stop()
        self._listening = Listening(self, listener) if listener is not None else None


class DomainParticipant(_Blocking, ParticipantPortal):
    """A member of a domain, from the moment it is made: use it by ``with``, or :meth:`close` it.

    One that is forgotten is closed when it is collected, and when the interpreter ends.
    """

    def __init__(
        self,
        domain_id: int = 0,
        *,
        qos: Qos | None = None,
        config: Config | None = None,
        trace: TraceSink | None = None,
        listener: Listener | None = None,
    ) -> None:
        """As ``ddsi.DomainParticipant``, entered at once: raises what entering that one raises too."""
        super().__init__(domain_id, qos=qos, config=config, trace=trace)
        stay = self._reserve()
        try:
            self._engine.run(stay.enter)
        except BaseException:
            self._has_failed(stay)
            raise
        self._has_entered()
        self.set_listener(listener)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self._leave(at_once=error is not None)

    def close(self) -> None:
        """Leave the domain.  Reliable samples under way get a second to be acknowledged.  Safe twice."""
        self._leave(at_once=False)

    def _leave(self, *, at_once: bool) -> None:
        stay = self._begin_to_leave()
        if stay is None:
            return
        if self._engine.is_of_parent:
            return
        try:
            self._engine.run(partial(stay.leave, at_once=at_once))
        finally:
            self._engine.join()

    def wait_for_discovery(self, timeout: float | None = None) -> None:
        """Until the tables of remote participants and endpoints change.  Raises DdsTimeout, AlreadyDeleted."""

        self._engine.run(_in_time, self._inner.wait_for_discovery, timeout, f"{self._inner!r}: nothing changed")

    def discover_type(self, topic_name: str, *, timeout: float | None = 10.0) -> type[Any]:
        """The type of a topic that others write or read: see ``ddsi.DomainParticipant.discover_type``."""
        return self._engine.run(self._inner.discover_type, topic_name, timeout=timeout)

    def endpoint_type(self, endpoint: AnnouncedEndpoint, *, timeout: float | None = 10.0) -> type[Any]:
        """The type of one remote writer or reader, as a class: see ``ddsi.DomainParticipant.endpoint_type``."""
        return self._engine.run(self._inner.endpoint_type, endpoint, timeout=timeout)


class Topic(_Blocking, TopicPortal[T], Generic[T]):
    """What writers and readers agree on: the topic's name and the type of its samples."""


class ContentFilteredTopic(_Blocking, FilteredTopicPortal[T], Generic[T]):
    """Given to a DataReader in a Topic's place, lets it see only what passes: see ``ddsi.ContentFilteredTopic``."""


class MultiTopic(_Blocking, MultiTopicPortal[T], Generic[T]):
    """Several topics joined, selected from and filtered, for a MultiTopicReader: see ``ddsi.MultiTopic``."""


class Publisher(_Blocking, PublisherPortal):
    """The writers created with it have its policies wherever they do not set their own."""

    def wait_for_acknowledgments(self, timeout: float | None = None) -> None:
        """Until all that its writers have written so far is acknowledged.  Raises DdsTimeout, AlreadyDeleted."""
        self._engine.run(self._inner.wait_for_acknowledgments, timeout)


class Subscriber(_Blocking, SubscriberPortal):
    """The readers created with it have its policies wherever they do not set their own."""

    def get_datareaders(self, **selection: Unpack[InstanceSelection]) -> list[DataReader[Any]]:
        """The readers that have samples in these states: see ``ddsi.Subscriber.get_datareaders``."""
        found = self._ask(partial(self._inner.get_datareaders, **selection))
        return [reader for inner in found if isinstance(reader := self._readers.get(inner), DataReader)]

    def wait(self, timeout: float | None = None) -> None:
        """Until one of the readers has a sample that has not been read.  Raises DdsTimeout, AlreadyDeleted."""
        self._engine.run(_in_time, self._inner.wait, timeout, f"{self._entity!r}: no samples")


class DataWriter(_Blocking, WriterPortal[T], Generic[T]):
    """Writes samples of a topic."""

    def __init__(
        self,
        parent: DomainParticipant | Publisher,
        topic: Topic[T],
        qos: Qos | None = None,
        *,
        listener: Listener | None = None,
    ) -> None:
        """Raises InconsistentPolicy, NotAllowedBySecurity, AlreadyDeleted; then nothing has been created."""
        super().__init__(parent, topic, qos)
        self.set_listener(listener)

    def write(self, sample: T, *, timestamp: Timestamp | None = None) -> None:
        """Write one sample: see ``ddsi.DataWriter.write``."""
        self._engine.run_in_lane(self._lane, partial(self._inner.write, sample, timestamp=timestamp))

    def write_all(self, samples: Iterable[T]) -> None:
        """Write them in order.  Several times faster than one by one, as threads are crossed once.

        What is raised for one leaves those before it written and those after it not.
        """
        self._engine.run_in_lane(self._lane, partial(self._write_all, list(samples)))

    def dispose(self, sample: T, *, timestamp: Timestamp | None = None) -> None:
        """The instance that ``sample`` belongs to (only its key fields matter) has come to its end."""
        self._engine.run_in_lane(self._lane, partial(self._inner.dispose, sample, timestamp=timestamp))

    def unregister(self, sample: T, *, timestamp: Timestamp | None = None) -> None:
        """This writer says nothing more of the instance."""
        self._engine.run_in_lane(self._lane, partial(self._inner.unregister, sample, timestamp=timestamp))

    def wait_for_acknowledgments(self, timeout: float | None = None) -> None:
        """Until every matched reliable reader has all that was written so far.  Raises DdsTimeout."""
        self._engine.run(self._inner.wait_for_acknowledgments, timeout)

    def wait_for_matched(self, count: int = 1, timeout: float | None = None) -> None:
        """Until at least ``count`` readers are matched.  Raises DdsTimeout after ``timeout`` seconds."""
        self._engine.run(self._inner.wait_for_matched, count, timeout)


class _Reading(_Blocking, _Iterated[dcps.Sample[T]], SampleReaderPortal[T], Generic[T]):
    """``for sample in reader`` takes one after the other, and waits for more until the reader is closed."""

    def take(self, max_samples: int | None = None, **selection: Unpack[Selection]) -> list[dcps.Sample[T]]:
        """Samples that are here now, oldest first, removed from the reader; never waits for one."""
        return self._engine.run_now(self._take_now, max_samples, selection)

    def read(self, max_samples: int | None = None, **selection: Unpack[Selection]) -> list[dcps.Sample[T]]:
        """As :meth:`take`, but the samples stay in the reader and count as read from now on."""
        return self._engine.run_now(partial(self._source.read, max_samples, **selection))

    def take_next_instance(
        self, previous: bytes | None, max_samples: int | None = None, **selection: Unpack[InstanceSelection]
    ) -> list[dcps.Sample[T]]:
        """As :meth:`take`, of the first instance behind the handle ``previous`` that has such samples."""
        return self._ask(partial(self._source.take_next_instance, previous, max_samples, **selection))

    def read_next_instance(
        self, previous: bytes | None, max_samples: int | None = None, **selection: Unpack[InstanceSelection]
    ) -> list[dcps.Sample[T]]:
        """As :meth:`take_next_instance`, but the samples stay and count as read."""
        return self._ask(partial(self._source.read_next_instance, previous, max_samples, **selection))

    def wait(self, condition: dcps.ReadCondition | None = None, timeout: float | None = None) -> None:
        """Until there is a sample that fits ``condition`` (none given: one that has not been read).

        Raises DdsTimeout after ``timeout`` seconds; AlreadyDeleted, also when the reader is closed meanwhile.
        """

        self._engine.run(_in_time, partial(self._wait_now, condition), timeout, f"{self._entity!r}: no such sample")


class DataReader(_Reading[T], ReaderPortal[T], Generic[T]):
    """Reads samples of a topic: ``for sample in reader``, or ``take`` and ``read``."""

    def __init__(
        self,
        parent: DomainParticipant | Subscriber,
        topic: Topic[T] | ContentFilteredTopic[T],
        qos: Qos | None = None,
        *,
        listener: Listener | None = None,
    ) -> None:
        """Raises InconsistentPolicy, NotAllowedBySecurity, AlreadyDeleted; then nothing has been created."""
        ReaderPortal.__init__(self, parent, topic, qos)
        self.set_listener(listener)

    def wait_for_matched(self, count: int = 1, timeout: float | None = None) -> None:
        """Until at least ``count`` writers are matched.  Raises DdsTimeout after ``timeout`` seconds."""
        self._engine.run(self._inner.wait_for_matched, count, timeout)

    def wait_for_historical_data(self, timeout: float | None = None) -> None:
        """Until all that the matched transient-local writers held at the match has come.  Raises DdsTimeout."""
        self._engine.run(self._inner.wait_for_historical_data, timeout)


class MultiTopicReader(_Reading[T], MultiTopicReaderPortal[T], Generic[T]):
    """Reads the joined samples of a MultiTopic: see ``ddsi.MultiTopicReader``."""

    def __init__(
        self,
        parent: DomainParticipant | Subscriber,
        topic: MultiTopic[T],
        qos: Qos | None = None,
        *,
        listener: Listener | None = None,
    ) -> None:
        """Raises what DataReader raises; then nothing has been created."""
        MultiTopicReaderPortal.__init__(self, parent, topic, qos)
        self.set_listener(listener)

    def wait_for_matched(self, count: int = 1, timeout: float | None = None) -> None:
        """Until of each topic at least ``count`` writers are matched.  Raises DdsTimeout after ``timeout`` seconds."""
        self._engine.run(self._inner.wait_for_matched, count, timeout)


class BuiltinTopicReader(_Reading[B], BuiltinTopicReaderPortal[B], Generic[B]):
    """Reads of remote participants, topics, writers or readers: see ``ddsi.BuiltinTopicReader``."""

    def __init__(self, participant: DomainParticipant, kind: type[B], *, listener: Listener | None = None) -> None:
        """``kind``: ParticipantBuiltinTopicData, or Topic..., Publication... or SubscriptionBuiltinTopicData."""
        BuiltinTopicReaderPortal.__init__(self, participant, kind)
        self.set_listener(listener)


class WaitSet(WaitSetPortal):
    """Waits for any of several conditions: see ``ddsi.WaitSet``."""

    def wait(self, timeout: float | None = None) -> list[dcps.Condition]:
        """The conditions that hold; waits until one does.  Raises DdsTimeout, AlreadyDeleted."""
        return self._engine.run(self._inner.wait, timeout)


async def _in_time(wait: Callable[[], Awaitable[None]], timeout: float | None, otherwise: str) -> None:
    with deadline_scope(timeout):
        await wait()
        return
    raise DdsTimeout(f"{otherwise} in {timeout} s")
