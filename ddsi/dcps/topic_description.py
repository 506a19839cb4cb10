"""TopicDescription: what readers are made of - a name and a type in a participant.  DDS 1.4 §2.2.2.3.1."""

from __future__ import annotations

from typing import TYPE_CHECKING, Generic, TypeVar

from ..structure.errors import BadParameter
from ..structure.qos import Qos
from ..xtypes.type_support import TypeSupport
from .entity import Entity, check_participant

if TYPE_CHECKING:
    from .participant import DomainParticipant

__all__ = ["TopicDescription", "check_topic_name"]

T = TypeVar("T")
_MAX_NAME_OCTETS = 255


class TopicDescription(Entity, Generic[T]):
    """The base of Topic, ContentFilteredTopic and MultiTopic."""

    def __init__(self, participant: DomainParticipant, name: str, support: TypeSupport[T], qos: Qos | None) -> None:
        """``name``: 1 to 255 octets of UTF-8.  The participant adopts it when it is made, which is not yet."""
        super().__init__(qos)
        check_topic_name(name)
        check_participant(participant)
        participant._running_pump()
        self._participant = participant
        self._name = name
        self._type_support = support

    @property
    def participant(self) -> DomainParticipant:
        return self._participant

    @property
    def name(self) -> str:
        return self._name

    @property
    def type(self) -> type[T]:
        return self._type_support.python_class

    @property
    def type_name(self) -> str:
        return self._type_support.type_name

    @property
    def type_support(self) -> TypeSupport[T]:
        return self._type_support

    def _on_close(self) -> None:
        self._participant._disown(self)


def check_topic_name(name: object) -> None:
    """Raises BadParameter."""
    if not isinstance(name, str) or not 1 <= len(name.encode()) <= _MAX_NAME_OCTETS or "\0" in name:
        raise BadParameter(f"a topic's name is a str of 1 to 255 octets without NUL, not {name!r}")
