"""Topic: a name and a type.  DDS 1.4 §2.2.2.3 (Topic-Definition Module)."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, ClassVar, TypeVar

from ..structure.qos import Qos
from ..structure.qos_changes import check_changeable
from ..structure.status import InconsistentTopic
from ..xtypes.type_support import type_support
from .endpoint import follow_all
from .topic_description import TopicDescription, check_topic_name

if TYPE_CHECKING:
    from .participant import DomainParticipant

__all__ = ["Topic"]

T = TypeVar("T")


class Topic(TopicDescription[T]):
    """What writers and readers agree on: the topic's name and the type of its samples.

    ``qos`` serves the topic's writers and readers wherever they do not set a policy themselves.  Closing a topic does
    not close them; it only makes no more.
    """

    STATUSES: ClassVar[tuple[type, ...]] = (InconsistentTopic,)

    def __init__(self, participant: DomainParticipant, name: str, type_: type[T], qos: Qos | None = None) -> None:
        """``name``: 1 to 255 octets of UTF-8.  Raises BadParameter, also when ``type_`` cannot be a topic's type."""
        check_topic_name(name)  # first: where name and type are exchanged, both are wrong, and this says which is which
        super().__init__(participant, name, type_support(type_), qos)
        self._is_enabled = participant._enables_members
        self._inconsistent_count = 0
        participant._adopt(self)

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

    def __repr__(self) -> str:
        return f"<Topic {self._name!r} of {self.type_name}>"
