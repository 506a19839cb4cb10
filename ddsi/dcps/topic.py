"""Topic: a name and a type.  DDS 1.4 §2.2.2.3 (Topic-Definition Module)."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, ClassVar, Generic, TypeVar

from ..structure.errors import BadParameter
from ..structure.qos import Qos
from ..structure.qos_changes import check_changeable
from ..structure.status import InconsistentTopic
from ..xtypes.type_support import TypeSupport, type_support
from .endpoint import follow_all
from .entity import Entity

if TYPE_CHECKING:
    from .participant import DomainParticipant

__all__ = ["Topic"]

T = TypeVar("T")
_MAX_NAME_OCTETS = 255


class Topic(Entity, Generic[T]):
    """What writers and readers agree on: the topic's name and the type of its samples.

    ``qos`` serves the topic's writers and readers wherever they do not set a policy themselves.  Closing a topic does
    not close them; it only makes no more.
    """

    STATUSES: ClassVar[tuple[type, ...]] = (InconsistentTopic,)

    def __init__(self, participant: DomainParticipant, name: str, type_: type[T], qos: Qos | None = None) -> None:
        """``name``: 1 to 255 octets of UTF-8.  Raises BadParameter, also when ``type_`` cannot be a topic's type."""
        super().__init__(qos)
        if not isinstance(name, str) or not 1 <= len(name.encode()) <= _MAX_NAME_OCTETS or "\0" in name:
            raise BadParameter(f"a topic's name is a str of 1 to 255 octets without NUL, not {name!r}")
        participant._running_pump()
        self._participant = participant
        self._name = name
        self._type = type_
        self._type_support: TypeSupport[T] = type_support(type_)
        self._is_enabled = participant._enables_members
        self._inconsistent_count = 0
        participant._adopt(self)

    @property
    def participant(self) -> DomainParticipant:
        return self._participant

    @property
    def name(self) -> str:
        return self._name

    @property
    def type(self) -> type[T]:
        return self._type

    @property
    def type_name(self) -> str:
        return self._type_support.type_name

    @property
    def type_support(self) -> TypeSupport[T]:
        return self._type_support

    @property
    def _factory(self) -> DomainParticipant:
        return self._participant

    def _change_qos(self, after: Qos) -> None:
        if self._is_enabled:
            check_changeable(self._qos, after, f"topic {self._name!r}")
        endpoints = self._participant._endpoints()
        follow_all(endpoint._plan(topic=after) for endpoint in endpoints if endpoint.topic is self)
        self._own_qos = self._qos = after

    def _found_inconsistent(self, met: InconsistentTopic) -> None:
        """One of its writers or readers met a peer that uses the name with another type."""
        self._inconsistent_count += 1
        self._status_changed(replace(met, total_count=self._inconsistent_count, total_count_change=1))

    def _on_close(self) -> None:
        self._participant._disown(self)

    def __repr__(self) -> str:
        return f"<Topic {self._name!r} of {self.type_name}>"
