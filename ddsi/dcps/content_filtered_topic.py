"""ContentFilteredTopic: a topic as a reader wants it, with only the samples that pass an expression.

DDS 1.4 §2.2.2.3.3 (ContentFilteredTopic), Annex B (the grammar).  Samples are filtered at the reader, in any case, and
before anything else is done with them; and at writers of other participants, where these can.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, ClassVar, TypeVar
from weakref import WeakSet

from ..behavior.content_filter import SQL_FILTER_CLASS, CompileFilter, Evaluate
from ..structure.discovered import ContentFilterProperty
from ..structure.errors import BadParameter, PreconditionNotMet
from ..xtypes.type_support import TypeSupport
from .topic import Topic
from .topic_description import TopicDescription

if TYPE_CHECKING:
    from .data_reader import DataReader
    from .participant import DomainParticipant

__all__ = ["ContentFilteredTopic", "filter_compiler"]

T = TypeVar("T")
_MAX_OCTETS = 32_000  # of names, expression and parameters, which have to fit one announcement


class ContentFilteredTopic(TopicDescription[T]):
    """Given to a DataReader in a Topic's place, lets it see only what passes: ``"size > %0 AND color = 'RED'"``.

    Members are named as in the IDL, nested ones ``place.x``, elements ``path[0]``; enumerators and texts stand between
    single quotes.  There are ``= <> < <= > >=``, ``BETWEEN 1 AND 5``, ``LIKE 'R%'``, ``AND``, ``OR``, ``NOT`` and
    parentheses.  Each ``%n`` is a parameter; they can be changed at any time.  The end of an instance always passes.
    """

    STATUSES: ClassVar[tuple[type, ...]] = ()

    def __init__(
        self,
        participant: DomainParticipant,
        name: str,
        topic: Topic[T],
        expression: str,
        parameters: Sequence[str] = (),
    ) -> None:
        """``parameters``: the values of %0, %1 and so on, each as it would stand in the text: ``["20", "'RED'"]``.

        Raises BadParameter, saying where and why, for an expression that cannot be meant, names what the type has
        not, or lacks a parameter; PreconditionNotMet for another participant's topic.
        """
        if not isinstance(topic, Topic):
            raise BadParameter(f"a ContentFilteredTopic is made of a ddsi.Topic, not {topic!r}")
        super().__init__(participant, name, topic.type_support, None)
        topic._check_open()
        if topic.participant is not participant:
            raise PreconditionNotMet(f"{topic!r} was made with {topic.participant!r}; make one with {participant!r}")
        self._related_topic: Topic[T] = topic
        self._compile = filter_compiler(topic.type_support)
        self._announced, self._evaluate = self._checked(expression, parameters)
        self._readers: WeakSet[DataReader[T]] = WeakSet()
        participant._adopt(self)

    def __repr__(self) -> str:
        return f"<ContentFilteredTopic {self._name!r} of {self._related_topic.name!r}: {self.filter_expression!r}>"

    @property
    def related_topic(self) -> Topic[T]:
        """Whose samples they are; the name of this one is its own."""
        return self._related_topic

    @property
    def filter_expression(self) -> str:
        return self._announced.filter_expression

    @property
    def expression_parameters(self) -> tuple[str, ...]:
        return self._announced.expression_parameters

    def set_expression_parameters(self, parameters: Sequence[str]) -> None:
        """From now on these are the values of %0, %1 and so on.

        Its readers act on it at once and keep what they hold; their writers are told, and do not send again what they
        kept back before.  Raises BadParameter, and then nothing has changed; AlreadyDeleted.
        """
        self._check_open()
        self._announced, self._evaluate = self._checked(self.filter_expression, parameters)
        for reader in self._readers:
            if not reader.is_closed:
                reader._set_content_filter(self._announced, self._evaluate)

    def _checked(self, expression: str, parameters: Sequence[str]) -> tuple[ContentFilterProperty, Evaluate]:
        if isinstance(parameters, Sequence) and not isinstance(parameters, str):
            parameters = tuple(parameters)
        evaluate = self._compile(expression, parameters)  # type: ignore[arg-type]  # it checks what they are
        announced = ContentFilterProperty(
            content_filtered_topic_name=self._name,
            related_topic_name=self._related_topic.name,
            filter_class_name=SQL_FILTER_CLASS,
            filter_expression=expression,
            expression_parameters=tuple(parameters),
        )
        strings = (self._name, self._related_topic.name, expression, *parameters)
        try:
            octets = sum(len(string.encode()) for string in strings)
        except UnicodeEncodeError as error:
            raise BadParameter(f"{self._name!r}: an expression or parameter is no text: {error}") from error
        if octets > _MAX_OCTETS or any("\0" in string for string in strings):
            raise BadParameter(
                f"{self._name!r}: expression and parameters have at most {_MAX_OCTETS} octets, and no NUL"
            )
        return announced, evaluate


def filter_compiler(support: TypeSupport[T]) -> CompileFilter:
    """What makes functions of filter expressions for the samples of a type; SQL is learnt when the first one comes."""
    compilers: list[CompileFilter] = []

    def compile_filter(expression: str, parameters: tuple[str, ...]) -> Evaluate:
        if not compilers:
            from ..xtypes.sql import SampleFilters  # most programs filter nothing

            compilers.append(SampleFilters(support).compile)
        return compilers[0](expression, parameters)

    return compile_filter
