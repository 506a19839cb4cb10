"""Topics of ``ddsi.blocking`` and ``ddsi.aio``: of what is fixed from the beginning, and the parameters of filters.

DDS 1.4 §2.2.2.3.  Nothing of a topic ever waits.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Generic, TypeVar

from .. import dcps
from ..dcps.topic_description import TopicDescription
from ..structure.qos import Qos
from .entities import EntityPortal, ParticipantPortal, check_parent

__all__ = ["FilteredTopicPortal", "MultiTopicPortal", "TopicDescriptionPortal", "TopicPortal"]

T = TypeVar("T")


class TopicDescriptionPortal(EntityPortal, Generic[T]):
    """A name and a type, and the participant that they are known in."""

    def __init__(self, participant: ParticipantPortal, inner: TopicDescription[T]) -> None:
        super().__init__(participant._engine, inner)
        self._participant = participant
        self._description = inner

    @property
    def name(self) -> str:
        return self._description.name

    @property
    def type(self) -> type[T]:
        return self._description.type

    @property
    def type_name(self) -> str:
        return self._description.type_name


class TopicPortal(TopicDescriptionPortal[T]):
    """A topic; what it offers is fixed."""

    STATUSES = dcps.Topic.STATUSES

    def __init__(self, participant: ParticipantPortal, name: str, type_: type[T], qos: Qos | None = None) -> None:
        """As ``ddsi.Topic``; ``participant`` is one of this module's."""
        check_parent(participant, ParticipantPortal)
        self._inner: dcps.Topic[T] = participant._ask(partial(dcps.Topic, participant._inner, name, type_, qos))
        super().__init__(participant, self._inner)


class _ExpressionPortal(TopicDescriptionPortal[T]):
    """One that is made by an expression, which may have parameters."""

    def __init__(
        self, participant: ParticipantPortal, inner: dcps.ContentFilteredTopic[T] | dcps.MultiTopic[T]
    ) -> None:
        super().__init__(participant, inner)
        self._expression = inner

    @property
    def expression_parameters(self) -> tuple[str, ...]:
        return self._expression.expression_parameters

    def set_expression_parameters(self, parameters: Sequence[str]) -> None:
        """From now on these are the values of %0, %1 and so on: see the class of the same name in ``ddsi``."""
        self._ask(partial(self._expression.set_expression_parameters, parameters))


class FilteredTopicPortal(_ExpressionPortal[T]):
    """Given to a reader in a topic's place, lets it see only what passes."""

    STATUSES = dcps.ContentFilteredTopic.STATUSES

    def __init__(
        self,
        participant: ParticipantPortal,
        name: str,
        topic: TopicPortal[T],
        expression: str,
        parameters: Sequence[str] = (),
    ) -> None:
        """As ``ddsi.ContentFilteredTopic``; ``participant`` and ``topic`` are of this module."""
        check_parent(participant, ParticipantPortal)
        check_parent(topic, TopicPortal)
        self._topic = topic
        create = partial(dcps.ContentFilteredTopic, participant._inner, name, topic._inner, expression, parameters)
        self._inner: dcps.ContentFilteredTopic[T] = participant._ask(create)
        super().__init__(participant, self._inner)

    @property
    def related_topic(self) -> TopicPortal[T]:
        return self._topic

    @property
    def filter_expression(self) -> str:
        return self._inner.filter_expression


class MultiTopicPortal(_ExpressionPortal[T]):
    """Several topics joined, for a reader of these."""

    STATUSES = dcps.MultiTopic.STATUSES

    def __init__(
        self,
        participant: ParticipantPortal,
        name: str,
        type_: type[T],
        expression: str,
        parameters: Sequence[str] = (),
    ) -> None:
        """As ``ddsi.MultiTopic``; ``participant``, and the topics that the expression names, are of this module."""
        check_parent(participant, ParticipantPortal)
        create = partial(dcps.MultiTopic, participant._inner, name, type_, expression, parameters)
        self._inner: dcps.MultiTopic[T] = participant._ask(create)
        super().__init__(participant, self._inner)

    @property
    def subscription_expression(self) -> str:
        return self._inner.subscription_expression
