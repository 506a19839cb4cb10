"""What the entities of ``ddsi.blocking`` and ``ddsi.aio`` share: all that never waits, done in the engine's thread.

DDS 1.4 §2.2.2.  Each holds the entity of ``dcps`` that it stands for.  What is fixed from the beginning (a topic's
name, a Guid, the QoS given) and statuses, which are values, are read where the caller is; everything else crosses over.
"""

from __future__ import annotations

import warnings
import weakref
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import partial
from typing import TYPE_CHECKING, ClassVar, Self, TypeVar

from .. import dcps
from ..config import Config
from ..discovery.explanation import Explanation
from ..discovery.matching import MatchRefusal
from ..structure.builtin_topic_data import ParticipantBuiltinTopicData
from ..structure.discovered import DiscoveredParticipantData, DiscoveredReaderData, DiscoveredWriterData
from ..structure.errors import AlreadyDeleted, BadParameter
from ..structure.guid import Guid
from ..structure.qos import Qos
from .engine_thread import EngineThread, engine_thread
from .stay import Stay

if TYPE_CHECKING:
    from ..trace.sink import TraceSink

__all__ = [
    "EntityPortal",
    "GroupPortal",
    "ParticipantPortal",
    "PublisherPortal",
    "SubscriberPortal",
    "check_parent",
]

S = TypeVar("S")


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

    @property
    def unused_policies(self) -> tuple[str, ...]:
        """The names of the policies that it was given and that mean nothing to such an entity."""
        return self._entity.unused_policies

    def set_qos(self, qos: Qos) -> None:
        """Change the policies that ``qos`` sets: see ``ddsi.Entity.set_qos``."""
        self._ask(partial(self._entity.set_qos, qos))

    def _running_engine(self) -> EngineThread:
        """The thread that it is in."""
        return self._engine

    def _ask(self, function: Callable[[], S]) -> S:
        """What ``function``, which does not wait, says in the engine's thread."""
        return self._engine.run_now(function)

    @property
    def is_closed(self) -> bool:
        return self._entity.is_closed

    @property
    def is_enabled(self) -> bool:
        """Does it take part?"""
        return self._entity.is_enabled

    def enable(self) -> None:
        """Let it take part, where EntityFactory had it wait: see ``ddsi.Entity.enable``."""
        self._ask(self._entity.enable)

    def status(self, kind: type[S]) -> S:
        """The present value of one status: see ``ddsi.Entity.status``."""
        return self._ask(partial(self._entity.status, kind))

    def status_changes(self) -> frozenset[type]:
        """The kinds of status that have changed since they were read by :meth:`status`."""
        return self._ask(self._entity.status_changes)

    def close(self) -> None:
        """End the entity; what it held is released at once, and peers are told.  Safe twice."""
        if not self._entity.is_closed:
            with suppress(AlreadyDeleted):  # it ends with its participant just now
                self._ask(self._entity.close)


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

    def explain(self, *asked: str | Guid) -> Explanation:
        """Why writers and readers match or do not.  See ``ddsi.DomainParticipant.explain``."""
        return self._ask(partial(self._inner.explain, *asked))

    def drop_counts(self) -> Counter[str]:
        """How many datagrams, submessages and announcements were not acted upon, by reason."""
        return self._ask(self._inner.drop_counts)

    def ignore_participant(self, guid: Guid) -> None:
        """Act as if that participant were not there, from now on."""
        self._ask(partial(self._inner.ignore_participant, guid))

    def ignore_publication(self, guid: Guid) -> None:
        """Act as if that remote writer were not there, from now on."""
        self._ask(partial(self._inner.ignore_publication, guid))

    def ignore_subscription(self, guid: Guid) -> None:
        """Act as if that remote reader were not there, from now on."""
        self._ask(partial(self._inner.ignore_subscription, guid))

    def ignore_topic(self, topic_name: str) -> None:
        """Act as if no remote participant had writers or readers of that topic, from now on."""
        self._ask(partial(self._inner.ignore_topic, topic_name))

    def knows_all_announced(self) -> bool:
        """Has every endpoint come that the participants known now had when they were discovered?"""
        return self._ask(self._inner.knows_all_announced)

    def contains_entity(self, handle: Guid) -> bool:
        """Is this the Guid of an endpoint that belongs to it, or to a group of it?"""
        return self._ask(partial(self._inner.contains_entity, handle))

    def delete_contained_entities(self) -> None:
        """Close all that was made with it; itself it stays open."""
        self._ask(self._inner.delete_contained_entities)

    def assert_liveliness(self) -> None:
        """Say that all writers of manual-by-participant liveliness are alive."""
        self._ask(self._inner.assert_liveliness)

    def _running_engine(self) -> EngineThread:
        """Raises PreconditionNotMet (not entered yet) and AlreadyDeleted, as everything that needs one that is open."""
        _ = self._inner.guid
        return self._engine

    def _ask(self, function: Callable[[], S]) -> S:
        """As of any entity; of a participant that is not there, what it says of itself."""
        if self._stay is None or self._inner.is_closed:
            return function()
        return self._engine.run_now(function)


class GroupPortal(EntityPortal):
    """A publisher or a subscriber."""

    def __init__(self, participant: ParticipantPortal, create: Callable[[], dcps.Publisher | dcps.Subscriber]) -> None:
        self._participant = participant
        self._inner = participant._ask(create)
        super().__init__(participant._engine, self._inner)

    def contains_entity(self, handle: Guid) -> bool:
        """Is this the Guid of an endpoint that belongs to it?"""
        return self._ask(partial(self._inner.contains_entity, handle))

    def delete_contained_entities(self) -> None:
        """Close all that was made with it; itself it stays open."""
        self._ask(self._inner.delete_contained_entities)


class PublisherPortal(GroupPortal):
    """A publisher.  Other threads may write meanwhile: what they write into a coherent set is in it."""

    _inner: dcps.Publisher

    def __init__(self, participant: ParticipantPortal, qos: Qos | None = None) -> None:
        """As ``ddsi.Publisher``; ``participant`` is one of this module's."""
        check_parent(participant, ParticipantPortal)
        super().__init__(participant, partial(dcps.Publisher, participant._inner, qos))

    def begin_coherent_changes(self) -> None:
        """See ``ddsi.Publisher.begin_coherent_changes``."""
        self._ask(self._inner.begin_coherent_changes)

    def end_coherent_changes(self) -> None:
        """The set is whole."""
        self._ask(self._inner.end_coherent_changes)

    @contextmanager
    def coherent_changes(self) -> Iterator[None]:
        """``with publisher.coherent_changes():`` what is written in the body is one set; none if the body raises."""
        changes = self._inner.coherent_changes()
        self._ask(changes.__enter__)
        try:
            yield
        except BaseException as error:
            self._ask(partial(changes.__exit__, type(error), error, error.__traceback__))
            raise
        self._ask(partial(changes.__exit__, None, None, None))

    def suspend_publications(self) -> None:
        """Until :meth:`resume_publications`, what the publisher's writers write is kept and not sent."""
        self._ask(self._inner.suspend_publications)

    def resume_publications(self) -> None:
        """Send what was kept."""
        self._ask(self._inner.resume_publications)


class SubscriberPortal(GroupPortal):
    """A subscriber."""

    STATUSES = dcps.Subscriber.STATUSES
    _inner: dcps.Subscriber

    def __init__(self, participant: ParticipantPortal, qos: Qos | None = None) -> None:
        """As ``ddsi.Subscriber``; ``participant`` is one of this module's."""
        check_parent(participant, ParticipantPortal)
        self._readers: dict[dcps.Entity, EntityPortal] = {}  # that stand for those of the inner subscriber
        super().__init__(participant, partial(dcps.Subscriber, participant._inner, qos))

    def begin_access(self) -> None:
        """See ``ddsi.Subscriber.begin_access``."""
        self._ask(self._inner.begin_access)

    def end_access(self) -> None:
        """What has come meanwhile becomes visible."""
        self._ask(self._inner.end_access)

    @contextmanager
    def access(self) -> Iterator[Self]:
        """``with subscriber.access():`` :meth:`begin_access` and :meth:`end_access` around the body."""
        self.begin_access()
        try:
            yield self
        finally:
            if not self.is_closed:
                self.end_access()

    def notify_datareaders(self) -> None:
        """Wake whoever waits for one of the readers that has samples."""
        self._ask(self._inner.notify_datareaders)


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
