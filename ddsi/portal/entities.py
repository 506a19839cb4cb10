"""What the entities of ``ddsi.blocking`` and ``ddsi.aio`` share: all that never waits, done in the engine's thread.

DDS 1.4 §2.2.2.  Each holds the entity of ``dcps`` that it stands for.  What is fixed from the beginning (a topic's
name, a Guid, the QoS given) and statuses, which are values, are read where the caller is; everything else crosses over.
"""

from __future__ import annotations

import warnings
import weakref
from collections import Counter, deque
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from typing import TYPE_CHECKING, Any, ClassVar, Generic, TypedDict, TypeVar

from .. import dcps
from ..config import Config
from ..discovery.matching import MatchRefusal
from ..structure.builtin_topic_data import (
    ParticipantBuiltinTopicData,
    PublicationBuiltinTopicData,
    SubscriptionBuiltinTopicData,
)
from ..structure.discovered import DiscoveredParticipantData, DiscoveredReaderData, DiscoveredWriterData
from ..structure.errors import AlreadyDeleted, BadParameter
from ..structure.guid import Guid
from ..structure.qos import EndpointQos, Qos
from .call import Lane
from .engine_thread import EngineThread, engine_thread
from .stay import Stay

if TYPE_CHECKING:
    from ..trace.sink import TraceSink

__all__ = [
    "EntityPortal",
    "GroupPortal",
    "ParticipantPortal",
    "ReaderPortal",
    "SampleReaderPortal",
    "Selection",
    "TopicPortal",
    "WriterPortal",
]

T = TypeVar("T")
S = TypeVar("S")
_FETCHED_AT_ONCE = 64


class Selection(TypedDict, total=False):
    """The keywords of ``take`` and ``read``; their meaning and defaults are those of ``ddsi.DataReader.take``."""

    condition: dcps.ReadCondition | None
    sample_states: int
    view_states: int
    instance_states: int
    instance: bytes | None


class EntityPortal:
    """The base of all."""

    STATUSES: ClassVar[tuple[type, ...]] = ()

    def __init__(self, engine: EngineThread, inner: dcps.Entity) -> None:
        self._engine = engine
        self._entity = inner

    def __repr__(self) -> str:
        return f"{self._entity!r} in the engine's thread"

    @property
    def qos(self) -> Qos:
        """The Qos that the entity has."""
        return self._entity.qos

    def set_qos(self, qos: Qos) -> None:
        """Change the policies that ``qos`` sets: see ``ddsi.Entity.set_qos``."""
        self._ask(partial(self._entity.set_qos, qos))

    def _ask(self, function: Callable[[], S]) -> S:
        """What ``function``, which does not wait, says in the engine's thread."""
        return self._engine.run_now(function)

    @property
    def is_closed(self) -> bool:
        return self._entity.is_closed

    def status(self, kind: type[S]) -> S:
        """The present value of one status.  Raises BadParameter where an entity of this kind has no such status."""
        return self._entity.status(kind)

    def close(self) -> None:
        """End the entity; what it held is released at once, and peers are told.  Safe twice."""
        if not self._entity.is_closed:
            with suppress(AlreadyDeleted):  # it ends with its participant just now
                self._engine.run_now(self._entity.close)


class ParticipantPortal(EntityPortal):
    """A participant before, during and after its stay in the engine's thread."""

    STATUSES = dcps.DomainParticipant.STATUSES

    def __init__(self, domain_id: int, *, qos: Qos | None, config: Config | None, trace: TraceSink | None) -> None:
        self._inner = dcps.DomainParticipant(domain_id, qos=qos, config=config, trace=trace)
        self._stay: Stay | None = None
        self._finalizer: weakref.finalize[..., ParticipantPortal] | None = None
        self._entity = self._inner

    @property
    def domain_id(self) -> int:
        return self._inner.domain_id

    @property
    def config(self) -> Config:
        return self._inner.config

    @property
    def guid(self) -> Guid:
        return self._inner.guid

    def _reserve(self) -> Stay:
        """Begin the stay: the caller has it entered, and tells :meth:`_has_entered` or :meth:`_has_failed`."""
        self._engine = engine_thread()
        self._stay = Stay(self._engine, self._inner)
        return self._stay

    def _has_entered(self) -> None:
        assert self._stay is not None
        self._finalizer = weakref.finalize(self, _forgotten, self._engine, self._stay, repr(self._inner))
        self._finalizer.atexit = False  # the thread itself sees to that

    def _has_failed(self, stay: Stay) -> None:
        self._engine.post(stay.close)

    def _begin_to_leave(self) -> Stay | None:
        """The stay that the caller shall have left, once."""
        if self._finalizer is not None:
            self._finalizer.detach()
        stay, self._stay = self._stay, None
        return stay

    def close(self) -> None:
        """End the participant and all that belongs to it now; safe twice."""
        super().close()

    def discovered_participants(self) -> list[DiscoveredParticipantData]:
        """The remote participants that are known now."""
        return self._ask(self._inner.discovered_participants)

    def discovered_participant_data(self, handle: Guid) -> ParticipantBuiltinTopicData:
        """See ``ddsi.DomainParticipant.discovered_participant_data``."""
        return self._ask(partial(self._inner.discovered_participant_data, handle))

    def discovered_publications(self) -> list[DiscoveredWriterData]:
        """The remote writers that are known now."""
        return self._ask(self._inner.discovered_publications)

    def discovered_subscriptions(self) -> list[DiscoveredReaderData]:
        """The remote readers that are known now."""
        return self._ask(self._inner.discovered_subscriptions)

    def match_refusals(self) -> dict[tuple[Guid, Guid], MatchRefusal]:
        """For every (own, other) pair of endpoints of one topic that does not match: why not."""
        return self._ask(self._inner.match_refusals)

    def drop_counts(self) -> Counter[str]:
        """How many datagrams, submessages and announcements were not acted upon, by reason."""
        return self._ask(self._inner.drop_counts)

    def ignore_participant(self, guid: Guid) -> None:
        """Act as if that participant were not there, from now on."""
        self._ask(partial(self._inner.ignore_participant, guid))

    def assert_liveliness(self) -> None:
        """Say that all writers of manual-by-participant liveliness are alive."""
        self._ask(self._inner.assert_liveliness)

    def _ask(self, function: Callable[[], S]) -> S:
        """As of any entity; of a participant that is not there, what it says of itself."""
        if self._stay is None or self._inner.is_closed:
            return function()
        return self._engine.run_now(function)


class TopicPortal(EntityPortal, Generic[T]):
    """A topic; what it offers is fixed."""

    STATUSES = dcps.Topic.STATUSES

    def __init__(self, participant: ParticipantPortal, name: str, type_: type[T], qos: Qos | None = None) -> None:
        """As ``ddsi.Topic``; ``participant`` is one of this module's."""
        check_parent(participant, ParticipantPortal)
        self._participant = participant
        self._inner: dcps.Topic[T] = participant._ask(partial(dcps.Topic, participant._inner, name, type_, qos))
        super().__init__(participant._engine, self._inner)

    @property
    def name(self) -> str:
        return self._inner.name

    @property
    def type(self) -> type[T]:
        return self._inner.type

    @property
    def type_name(self) -> str:
        return self._inner.type_name


class GroupPortal(EntityPortal):
    """A publisher or a subscriber."""

    _KIND: ClassVar[type[dcps.Publisher] | type[dcps.Subscriber]]

    def __init__(self, participant: ParticipantPortal, qos: Qos | None = None) -> None:
        """As ``ddsi.Publisher`` and ``ddsi.Subscriber``; ``participant`` is one of this module's."""
        check_parent(participant, ParticipantPortal)
        self._participant = participant
        self._inner = participant._ask(partial(self._KIND, participant._inner, qos))
        super().__init__(participant._engine, self._inner)


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


class SampleReaderPortal(EntityPortal, Generic[T]):
    """What readers of topics and of builtin topics share.

    Iteration fetches what is there, at most 64 samples at once, as crossing threads costs more than a sample does.
    What was fetched and not yet handed out has been taken as far as the reader is concerned.
    """

    def __init__(self, engine: EngineThread, inner: dcps.DataReader[T] | dcps.BuiltinTopicReader[Any]) -> None:
        super().__init__(engine, inner)
        self._source = inner
        self._fetched: deque[dcps.Sample[T]] = deque()

    @property
    def guid(self) -> Guid:
        return self._source.guid

    async def _fetch(self) -> None:
        """In the engine's thread: wait for samples.  Leaves without any when the reader is closed."""
        try:
            self._fetched.append(await self._source.__anext__())
        except StopAsyncIteration:
            return
        # No await from here on: a cancellation finds either nothing taken or all of it kept.
        self._fetched.extend(self._source.take(_FETCHED_AT_ONCE - 1))

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


class ReaderPortal(SampleReaderPortal[T]):
    """A reader of a topic."""

    STATUSES = dcps.DataReader.STATUSES

    def __init__(self, parent: ParticipantPortal | GroupPortal, topic: TopicPortal[T], qos: Qos | None = None) -> None:
        """As ``ddsi.DataReader``; ``parent`` and ``topic`` are of this module."""
        check_parent(parent, ParticipantPortal, GroupPortal)
        check_parent(topic, TopicPortal)
        self._parent = parent
        self._topic = topic
        create = partial(dcps.DataReader, parent._inner, topic._inner, qos)  # type: ignore[arg-type]
        self._inner: dcps.DataReader[T] = topic._participant._ask(create)
        super().__init__(topic._participant._engine, self._inner)

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

    def matched_publications(self) -> list[Guid]:
        """The Guids of the writers that are matched now."""
        return self._engine.run_now(self._inner.matched_publications)

    def matched_publication_data(self, handle: Guid) -> PublicationBuiltinTopicData:
        """See ``ddsi.DataReader.matched_publication_data``."""
        return self._engine.run_now(self._inner.matched_publication_data, handle)


def check_parent(given: object, *kinds: type[EntityPortal]) -> None:
    """Raises BadParameter for what is not of this room, as an entity that lives in trio."""
    if not isinstance(given, kinds):
        raise BadParameter(
            f"an entity of ddsi.blocking or ddsi.aio is made with entities of that module, not with {given!r}"
        )


def _forgotten(engine: EngineThread, stay: Stay, name: str) -> None:
    """Nothing refers to the participant any more, and it was not closed.  May run in any thread, at any moment."""
    engine.post(stay.close)
    warnings.warn(f"{name} was forgotten without close(); use `with`", ResourceWarning, stacklevel=1)
