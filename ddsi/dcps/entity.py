"""Entity: what all DCPS entities share - a Qos, statuses as values and as a stream of events, and an end.

DDS 1.4 §2.2.2.1.1 (Entity), §2.2.4 (Listeners, Conditions and Wait-sets; here: ``async for``).
"""

from __future__ import annotations

from collections import deque
from collections.abc import AsyncIterator
from dataclasses import fields, replace
from typing import TYPE_CHECKING, Any, ClassVar, TypeVar
from weakref import WeakSet

import trio

from ..structure.errors import (
    AlreadyDeleted,
    BadParameter,
    ImmutablePolicy,
    NotAllowedBySecurity,
    PreconditionNotMet,
)
from ..structure.guid import Guid
from ..structure.qos import Qos
from ..structure.qos_concerns import QosOwner, unused_policies
from ..structure.status import DataAvailable, DataOnReaders, Status

if TYPE_CHECKING:
    from .participant import DomainParticipant

__all__ = ["Entity", "EventStream", "Parent", "check_count", "check_participant", "deadline_scope"]

_S = TypeVar("_S")
_MAX_EVENTS = 1024
_MAX_EARLY_EVENTS = 64


class EventStream(AsyncIterator[Status]):
    """The statuses of one entity as they change.  It ends when the entity is closed.

    At most 1024 wait unread; then the oldest are forgotten and :attr:`dropped` counts them.
    """

    def __init__(self, early: deque[Status]) -> None:
        self._events = deque(early)
        self._lot = trio.lowlevel.ParkingLot()
        self._is_closed = False
        self.dropped = 0

    def put(self, event: Status) -> None:
        if isinstance(event, (DataAvailable, DataOnReaders)) and self._events and self._events[-1] == event:
            return  # the same news
        if len(self._events) >= _MAX_EVENTS:
            self._events.popleft()
            self.dropped += 1
        self._events.append(event)
        self._lot.unpark_all()

    def close(self) -> None:
        self._is_closed = True
        self._lot.unpark_all()

    def __aiter__(self) -> EventStream:
        return self

    async def __anext__(self) -> Status:
        await trio.lowlevel.checkpoint_if_cancelled()
        while not self._events:
            if self._is_closed:
                raise StopAsyncIteration
            await self._lot.park()
        return self._events.popleft()


class Entity:
    """The base of all entities.  ``close()`` is synchronous, may be called twice, and closes what is inside first."""

    STATUSES: ClassVar[tuple[type, ...]] = ()
    """The kinds of status that such an entity has, and of its events."""
    _QOS_OWNER: ClassVar[QosOwner] = "topic"

    def __init__(self, qos: Qos | None) -> None:
        if qos is not None and not isinstance(qos, Qos):
            raise BadParameter(f"{type(self).__name__}: qos is a ddsi.Qos(...), not {qos!r}")
        self._own_qos = self._qos = qos if qos is not None else Qos()
        self._is_closed = False
        self._is_enabled = True
        self._revocation: str | None = None  # why security closed it, if it did
        self._changed = trio.lowlevel.ParkingLot()
        self._statuses: dict[type, Status] = {}
        self._status_changes: set[type] = set()
        # Weakly: a stream lives as long as somebody reads it, and ends with the loop that did.
        self._streams: WeakSet[EventStream] = WeakSet()
        # What happened before anybody listened (a match within the participant happens at once).
        self._early_events: deque[Status] = deque(maxlen=_MAX_EARLY_EVENTS)

    @property
    def qos(self) -> Qos:
        """The Qos that the entity was given, and what it has from others; changed by :meth:`set_qos`."""
        return self._qos

    @property
    def unused_policies(self) -> tuple[str, ...]:
        """The names of the policies that it was given and that mean nothing to such an entity.  DDS 1.4 §2.2.3.

        A Qos may be shared: a writer takes no notice of its time_based_filter, nor a reader of its lifespan.
        """
        return unused_policies(self._own_qos, self._QOS_OWNER)

    def set_qos(self, qos: Qos) -> None:
        """Change the policies that ``qos`` sets; all others stay as they are.  DDS 1.4 §2.2.2.1.1.3.

        Peers are told, and pairs judged again.  Raises ImmutablePolicy for what is fixed by now, InconsistentPolicy,
        NotAllowedBySecurity (say, for a partition), AlreadyDeleted; then nothing has changed.
        """
        self._check_open()
        if not isinstance(qos, Qos):
            raise BadParameter(f"{type(self).__name__}: qos is a ddsi.Qos(...), not {qos!r}")
        self._change_qos(self._own_qos | qos)

    @property
    def is_enabled(self) -> bool:
        """Does it take part?  Not where EntityFactory says otherwise, until :meth:`enable`.  DDS 1.4 §2.2.3.20."""
        return self._is_enabled

    def enable(self) -> None:
        """Let it take part: it is announced and matched from now on, and some policies are fixed.

        What belongs to it is enabled too, if its EntityFactory policy says so.  Raises PreconditionNotMet when what it
        belongs to is not enabled yet; AlreadyDeleted.  DDS 1.4 §2.2.2.1.1.7.
        """
        self._check_open()
        if self._is_enabled:
            return
        factory = self._factory
        if factory is not None and not factory.is_enabled:
            raise PreconditionNotMet(f"{self!r}: enable {factory!r} first, which it belongs to")
        self._is_enabled = True
        self._on_enable()

    @property
    def _factory(self) -> Parent | None:
        """The entity that it was made with."""
        return None

    def _on_enable(self) -> None:
        """What the kind of entity does when it begins to take part."""

    def _change_qos(self, after: Qos) -> None:
        """What the kind of entity does to have these policies."""
        raise ImmutablePolicy(f"{self!r} has no policy that can be changed")

    @property
    def is_closed(self) -> bool:
        return self._is_closed

    def events(self) -> EventStream:
        """The communication statuses from now on, one event a change.

        What happened while nobody listened (the latest 64) comes first.
        """
        stream = EventStream(self._early_events)
        self._early_events.clear()
        if self._is_closed:
            stream.close()
        self._streams.add(stream)
        return stream

    def status(self, kind: type[_S]) -> _S:
        """The present value of one status, for instance ``writer.status(PublicationMatched).current_count``.

        Its ``..._change`` fields tell what changed since it was read last, by this method, and are 0 from now on
        (events are another matter: each tells its own change).  Raises BadParameter where an entity of this kind has
        no such status.  DDS 1.4 §2.2.4.1.
        """
        if not any(kind is known for known in self.STATUSES):
            names = ", ".join(known.__name__ for known in self.STATUSES) or "none"
            raise BadParameter(f"a {type(self).__name__} has the statuses {names}, but no {kind!r}")
        value = self._statuses.get(kind)
        if not isinstance(value, kind):
            return kind()
        if kind in self._status_changes:
            self._status_changes.discard(kind)
            self._statuses[kind] = _unchanged(value)
        return value

    def status_changes(self) -> frozenset[type]:
        """The kinds of status that have changed since they were read by :meth:`status`.

        DDS 1.4 §2.2.2.1.1.6 (get_status_changes).
        """
        return frozenset(self._status_changes)

    def close(self) -> None:
        """End the entity; what it held is released at once, and peers are told."""
        if self._is_closed:
            return
        self._is_closed = True
        self._on_close()
        self._changed.unpark_all()
        for stream in self._streams:
            stream.close()

    def _on_close(self) -> None:
        """What the kind of entity does at its end."""

    def _has_news(self) -> None:
        """A reader: there are samples to take."""

    def _made_progress(self) -> None:
        """A writer: something was acknowledged."""

    def _status_changed(self, status: Status) -> None:
        kind = type(status)
        before = self._statuses.get(kind)
        self._statuses[kind] = _accumulated(before, status) if kind in self._status_changes and before else status
        self._status_changes.add(kind)
        self._changed.unpark_all()
        if not self._streams:
            self._early_events.append(status)
        for stream in self._streams:
            stream.put(status)

    def _revoke(self, reason: str) -> None:
        """Security is about to close it: what is asked of it afterwards fails and says why."""
        self._revocation = reason

    def _check_not_revoked(self) -> None:
        if self._revocation is not None:
            raise NotAllowedBySecurity(f"{self!r} was closed: {self._revocation}")

    def _check_open(self) -> None:
        if self._is_closed:
            self._check_not_revoked()
            raise AlreadyDeleted(f"{self!r} was closed, by close() or with what it belongs to; make another")

    def _check_enabled(self) -> None:
        self._check_open()
        if not self._is_enabled:
            raise PreconditionNotMet(f"{self!r} is not enabled: call enable() first, or leave EntityFactory alone")


class Parent(Entity):
    """An entity that others belong to, and end with: DomainParticipant, Publisher, Subscriber."""

    def __init__(self, qos: Qos | None) -> None:
        super().__init__(qos)
        self._members: dict[Entity, None] = {}

    @property
    def participant(self) -> DomainParticipant:
        """The participant that it belongs to, or is."""
        raise NotImplementedError

    @property
    def endpoint_defaults(self) -> Qos:
        """The policies that its endpoints have wherever they do not set their own."""
        return Qos()

    def contained_entities(self) -> list[Entity]:
        """What was made with it and lives: of a participant its groups, topics, and endpoints made without a group."""
        return list(self._members)

    def contains_entity(self, handle: Guid) -> bool:
        """Is this the Guid of an endpoint that belongs to it, or to a group of it?  DDS 1.4 §2.2.2.2.1.25."""
        return any(
            member.contains_entity(handle) if isinstance(member, Parent) else getattr(member, "guid", None) == handle
            for member in self._members
        )

    def delete_contained_entities(self) -> None:
        """Close all of them; itself it stays open.  DDS 1.4 §2.2.2.2.1.18."""
        for entity in reversed(self.contained_entities()):
            entity.close()

    @property
    def _enables_members(self) -> bool:
        """Does what is made with it take part at once?"""
        policy = self._own_qos.entity_factory
        return self._is_enabled and (policy is None or policy.autoenable_created_entities)

    def _on_enable(self) -> None:
        if self._enables_members:
            for entity in self.contained_entities():
                entity.enable()

    def _adopt(self, entity: Entity) -> None:
        self._members[entity] = None

    def _revoke(self, reason: str) -> None:
        super()._revoke(reason)
        for entity in self._members:
            entity._revoke(reason)

    def _disown(self, entity: Entity) -> None:
        self._members.pop(entity, None)

    def _on_close(self) -> None:
        self.delete_contained_entities()


def _changes_of(kind: type) -> tuple[str, ...]:
    return tuple(item.name for item in fields(kind) if item.name.endswith("_change"))


def _accumulated(before: Status, status: Status) -> Status:
    """What ``status`` tells, its changes added to those that nobody has read."""
    changes = {name: getattr(before, name) + getattr(status, name) for name in _changes_of(type(status))}
    return replace(status, **changes) if changes else status


def _unchanged(status: Any) -> Any:
    return replace(status, **dict.fromkeys(_changes_of(type(status)), 0))


def check_participant(participant: object) -> None:
    """Is it one, as what belongs to no group needs?  Raises BadParameter."""
    if not isinstance(participant, Parent) or participant.participant is not participant:
        raise BadParameter(f"the first argument is a ddsi.DomainParticipant, not {participant!r}")


def check_count(name: str, value: object) -> None:
    """A number of things, 0 or more.  Raises BadParameter."""
    if not isinstance(value, int) or value < 0:
        raise BadParameter(f"{name} is a whole number, 0 or more, not {value!r}")


def deadline_scope(timeout: float | None) -> trio.CancelScope:
    """A scope that ends ``timeout`` seconds from now; None, as ``math.inf``: never.  Raises BadParameter."""
    if timeout is None:
        return trio.CancelScope()
    if not isinstance(timeout, (int, float)) or not timeout >= 0:
        raise BadParameter(f"timeout is a number of seconds, 0 or more, or None to wait for ever, not {timeout!r}")
    return trio.move_on_after(timeout)
