"""MultiTopic: several topics joined, selected from and filtered, as if they were one.  DDS 1.4 §2.2.2.3.5.

A :class:`~ddsi.MultiTopicReader` reads of it; nobody writes to it, and nothing of it is on the wire.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, TypeVar
from weakref import WeakSet

from ..structure.errors import BadParameter
from ..xtypes.type_support import type_support
from .topic import Topic
from .topic_description import TopicDescription

if TYPE_CHECKING:
    from .multi_topic_reader import MultiTopicReader
    from .participant import DomainParticipant

__all__ = ["MultiTopic"]

T = TypeVar("T")


class MultiTopic(TopicDescription[T]):
    """``"SELECT flight, x, y, airline AS name FROM Position NATURAL JOIN Plan WHERE x < %0"``.

    A natural join brings together the samples that agree in all members of the same name; the topics have one at least
    in common.  ``SELECT *`` fills every member of the result that has a name of theirs.  The condition is that of a
    ContentFilteredTopic, over the members of all the topics.
    """

    def __init__(
        self,
        participant: DomainParticipant,
        name: str,
        type_: type[T],
        expression: str,
        parameters: Sequence[str] = (),
    ) -> None:
        """``type_``: of the result.  The topics are those of the participant that bear the names in the expression.

        Raises BadParameter, saying where and why, for what cannot be meant or does not fit the types, AlreadyDeleted.
        """
        super().__init__(participant, name, type_support(type_), None)
        from ..xtypes.sql import JoinPlan, checked_parameters, parse_topic_expression  # few programs join

        parsed = parse_topic_expression(expression)
        self._topics: tuple[Topic[Any], ...] = tuple(_topic(participant, wanted) for wanted in parsed.topics)
        structs = [topic.type_support.struct for topic in self._topics]
        self._plan = JoinPlan(parsed, structs, self._type_support.struct, expression)
        self._parameters = checked_parameters(parameters)
        self._holds = self._plan.bind(self._parameters)
        self._readers: WeakSet[MultiTopicReader[T]] = WeakSet()
        participant._adopt(self)

    def __repr__(self) -> str:
        return f"<MultiTopic {self._name!r}: {self.subscription_expression!r}>"

    @property
    def topics(self) -> tuple[Topic[Any], ...]:
        """What it is made of, in the order of the expression."""
        return self._topics

    @property
    def subscription_expression(self) -> str:
        return self._plan.text

    @property
    def expression_parameters(self) -> tuple[str, ...]:
        return self._parameters

    def set_expression_parameters(self, parameters: Sequence[str]) -> None:
        """From now on these are the values of %0, %1 and so on; what its readers hold follows.

        Raises BadParameter, and then nothing has changed; AlreadyDeleted.
        """
        self._check_open()
        from ..xtypes.sql import checked_parameters

        checked = checked_parameters(parameters)
        self._holds = self._plan.bind(checked)
        self._parameters = checked
        for reader in self._readers:
            if not reader.is_closed:
                reader._join_again()


def _topic(participant: DomainParticipant, name: str) -> Topic[Any]:
    from ..xtypes.sql import nearest

    known = {entity.name: entity for entity in participant._members if isinstance(entity, Topic)}
    if name not in known:
        raise BadParameter(f"{participant!r} has no topic {name!r}; {nearest(name, list(known))}")
    return known[name]
