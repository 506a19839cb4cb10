"""Publisher and Subscriber: groups of writers and of readers that share a partition, presentation and group data.

DDS 1.4 §2.2.2.4.1 (Publisher), §2.2.2.5.2 (Subscriber).  A participant may stand in their place.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, ClassVar, TypeVar, cast

from ..structure.errors import BadParameter, PreconditionNotMet
from ..structure.qos import Qos
from ..structure.qos_changes import check_changeable
from ..structure.status import DataAvailable, DataOnReaders
from .endpoint import Endpoint, follow_all
from .entity import Entity, Parent
from .topic import Topic

if TYPE_CHECKING:
    from .participant import DomainParticipant

__all__ = ["Publisher", "Subscriber", "check_family"]


S = TypeVar("S")

_ON_READERS = DataOnReaders(is_available=True)


class _Group(Parent):
    def __init__(self, participant: DomainParticipant, qos: Qos | None = None) -> None:
        super().__init__(qos)
        participant._running_pump()
        self._participant = participant
        participant._adopt(self)

    def __repr__(self) -> str:
        return f"<{type(self).__name__} in domain {self._participant.domain_id}, {len(self._members)} members>"

    @property
    def participant(self) -> DomainParticipant:
        return self._participant

    @property
    def endpoint_defaults(self) -> Qos:
        return self._qos

    def _change_qos(self, after: Qos) -> None:
        check_changeable(self._qos, after, f"a {type(self).__name__}")
        follow_all(member._plan(group=after) for member in self._members if isinstance(member, Endpoint))
        self._own_qos = self._qos = after

    def _on_close(self) -> None:
        super()._on_close()
        self._participant._disown(self)


class Publisher(_Group):
    """The writers created with it have its policies wherever they do not set their own."""


class Subscriber(_Group):
    """The readers created with it have its policies wherever they do not set their own."""

    STATUSES: ClassVar[tuple[type, ...]] = (DataOnReaders,)

    def status(self, kind: type[S]) -> S:
        if kind is DataOnReaders:
            return cast(S, DataOnReaders(is_available=bool(self._readers_with_news())))
        return super().status(kind)

    def status_changes(self) -> frozenset[type]:
        return frozenset({DataOnReaders}) if self._readers_with_news() else frozenset()

    def _readers_with_news(self) -> list[Entity]:
        return [member for member in self._members if DataAvailable in member.status_changes()]

    def _has_news(self) -> None:
        for stream in self._streams:
            stream.put(_ON_READERS)


def check_family(parent: Parent, topic: Topic[Any], group: type[Publisher] | type[Subscriber]) -> DomainParticipant:
    """The participant in which ``parent`` (itself, or such a ``group`` of it) makes an endpoint of ``topic``.

    Raises BadParameter, PreconditionNotMet (not entered; the topic is another participant's), AlreadyDeleted.
    """
    if not isinstance(parent, Parent) or (isinstance(parent, _Group) and not isinstance(parent, group)):
        raise BadParameter(f"the first argument is a DomainParticipant or a {group.__name__}, not {parent!r}")
    if not isinstance(topic, Topic):
        raise BadParameter(f"the second argument is a ddsi.Topic(participant, name, type), not {topic!r}")
    parent._check_open()
    topic._check_open()
    participant = parent.participant
    participant._running_pump()
    if topic.participant is not participant:
        raise PreconditionNotMet(f"{topic!r} was made with {topic.participant!r}; make one with {participant!r}")
    return participant
