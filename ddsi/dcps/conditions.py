"""Conditions: which samples a reader shall wait for, read or take; and what else a WaitSet may wait for.

DDS 1.4 §2.2.2.1.7 (GuardCondition), .8 (StatusCondition), §2.2.2.5.8 (ReadCondition), .9 (QueryCondition).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import trio

from ..behavior.content_filter import ContentFilter
from ..behavior.reader_history_cache import SampleSelector
from ..structure.discovered import ContentFilterProperty
from ..structure.errors import BadParameter, PreconditionNotMet
from ..structure.sample_info import (
    ANY_INSTANCE_STATE,
    ANY_SAMPLE_STATE,
    ANY_VIEW_STATE,
    SampleInfo,
    check_states,
)
from .entity import Entity

if TYPE_CHECKING:
    from .sample_reader import SampleReader

__all__ = ["Condition", "GuardCondition", "QueryCondition", "ReadCondition", "StatusCondition"]

_QUERY = "query"  # in the place of a filter class: what queries find out has a signature of its own


class Condition:
    """What a :class:`~ddsi.WaitSet` can wait for."""

    @property
    def trigger_value(self) -> bool:
        """Does it hold now?"""
        raise NotImplementedError

    def _lot(self) -> trio.lowlevel.ParkingLot:
        """Where one waits until it may have changed."""
        raise NotImplementedError

    def _before_waiting(self) -> None:
        """Somebody is about to wait for a change."""

    @property
    def _is_void(self) -> bool:
        """Will it never hold, as what it is about has ended?"""
        return False


class GuardCondition(Condition):
    """Holds while the application says so."""

    def __init__(self) -> None:
        self._value = False
        self._waiting = trio.lowlevel.ParkingLot()

    @property
    def trigger_value(self) -> bool:
        return self._value

    def set_trigger_value(self, value: bool) -> None:
        """From now on it holds, or does not; who waits for it is woken.  From trio's thread only."""
        self._value = bool(value)
        if self._value:
            self._waiting.unpark_all()

    def _lot(self) -> trio.lowlevel.ParkingLot:
        return self._waiting


class StatusCondition(Condition):
    """Holds while a status of an entity has changed and was not read since (``entity.status(kind)`` reads it)."""

    def __init__(self, entity: Entity, *kinds: type) -> None:
        """``kinds``: of status, such as ``ddsi.SubscriptionMatched``; all that the entity has, if none is named."""
        if not isinstance(entity, Entity):
            raise BadParameter(f"a StatusCondition is of an entity, not of {entity!r}")
        for kind in kinds:
            if kind not in entity.STATUSES:
                names = ", ".join(known.__name__ for known in entity.STATUSES) or "none"
                raise BadParameter(f"a {type(entity).__name__} has the statuses {names}, but no {kind!r}")
        self._entity = entity
        self._kinds = frozenset(kinds or entity.STATUSES)

    @property
    def entity(self) -> Entity:
        return self._entity

    @property
    def enabled_statuses(self) -> frozenset[type]:
        return self._kinds

    @property
    def trigger_value(self) -> bool:
        self._entity._check_open()
        return bool(self._entity.status_changes() & self._kinds)

    def _lot(self) -> trio.lowlevel.ParkingLot:
        return self._entity._changed

    @property
    def _is_void(self) -> bool:
        return self._entity.is_closed


class ReadCondition(Condition):
    """Samples in one of these states; masks of SampleState, ViewState and InstanceState, all by default.

    Without a ``reader`` it serves any reader's ``read``, ``take`` and ``wait``; a WaitSet needs one with its reader.
    """

    def __init__(
        self,
        reader: SampleReader[Any] | None = None,
        sample_states: int = ANY_SAMPLE_STATE,
        view_states: int = ANY_VIEW_STATE,
        instance_states: int = ANY_INSTANCE_STATE,
        query: Callable[[Any], bool] | None = None,
    ) -> None:
        """``query``, if given, is asked for the data of each sample that has the right states."""
        found = getattr(reader, "_entity", reader)  # of `ddsi.blocking` and `ddsi.aio`: what it stands for
        if found is not None and not hasattr(found, "_history"):
            raise BadParameter(f"the reader of a condition is a DataReader or a BuiltinTopicReader, not {reader!r}")
        check_states(sample_states, view_states, instance_states)
        self._reader: SampleReader[Any] | None = found
        self.sample_states = sample_states
        self.view_states = view_states
        self.instance_states = instance_states
        self.query = query

    @property
    def reader(self) -> SampleReader[Any] | None:
        return self._reader

    @property
    def trigger_value(self) -> bool:
        """Does its reader hold such a sample?  Raises AlreadyDeleted, PreconditionNotMet (it has no reader)."""
        reader = self._its_reader()
        reader._check_open()
        return reader._matches(self)

    def _its_reader(self) -> SampleReader[Any]:
        if self._reader is None:
            raise PreconditionNotMet("this ReadCondition has no reader; make it with one: ReadCondition(reader, ...)")
        return self._reader

    def _lot(self) -> trio.lowlevel.ParkingLot:
        return self._its_reader()._changed

    def _before_waiting(self) -> None:
        reader = self._its_reader()
        reader._history.seen()
        reader._pump.before_waiting()

    @property
    def _is_void(self) -> bool:
        return self._its_reader().is_closed

    # --- for readers -------------------------------------------------------------------------------------

    def _selector(self, reader: SampleReader[Any]) -> SampleSelector | None:
        """What else samples of the right states have to fulfil.  Raises PreconditionNotMet: another reader's."""
        if self._reader is not None and self._reader is not reader:
            raise PreconditionNotMet(f"the condition was made with {self._reader!r}, and cannot serve {reader!r}")
        return reader._selector(self.query) if self.query is not None else None

    @property
    def _sort_key(self) -> Callable[[Any], Any] | None:
        """What samples are sorted by; None: they come as they would."""
        return None


class QueryCondition(ReadCondition):
    """Samples in one of these states, whose data fulfil an expression: ``"size > %0 ORDER BY color, place.x"``.

    The expression is that of a ContentFilteredTopic; ``ORDER BY`` members says how ``read`` and ``take`` sort.  The end
    of an instance is no sample with data: it is found only by an expression about key members alone.
    """

    def __init__(
        self,
        reader: SampleReader[Any],
        sample_states: int = ANY_SAMPLE_STATE,
        view_states: int = ANY_VIEW_STATE,
        instance_states: int = ANY_INSTANCE_STATE,
        expression: str = "",
        parameters: Sequence[str] = (),
    ) -> None:
        """``parameters``: the values of %0, %1 and so on, as in ``["20", "'RED'"]``.

        Raises BadParameter, saying where and why, for what cannot be meant or does not fit the reader's type.
        """
        super().__init__(reader, sample_states, view_states, instance_states)
        from ..xtypes.sql import QueryExpression, SampleFilters  # most programs query nothing

        support = getattr(getattr(self._reader, "topic", None), "type_support", None)
        if support is None:
            raise BadParameter(f"a QueryCondition is of a DataReader, not of {reader!r}")
        self._support = support
        self._filters: SampleFilters[Any] = SampleFilters(support)
        self._expression = QueryExpression(expression, support.struct)
        self.set_query_parameters(parameters)

    @property
    def query_expression(self) -> str:
        return self._expression.text

    @property
    def query_parameters(self) -> tuple[str, ...]:
        return self._parameters

    def set_query_parameters(self, parameters: Sequence[str]) -> None:
        """From now on these are the values of %0, %1 and so on, for who waits already too.

        Raises BadParameter, and then nothing has changed.
        """
        from ..xtypes.sql import checked_parameters

        checked = checked_parameters(parameters)
        self._holds = self._expression.bind(checked)
        self._parameters = checked
        self._remembering: ContentFilter | None = None
        if self._holds is not None:
            asked = ContentFilterProperty(
                content_filtered_topic_name="",
                related_topic_name="",
                filter_class_name=_QUERY,
                filter_expression=self._expression.text,
                expression_parameters=checked,
            )
            self._remembering = ContentFilter(asked, self._filters.of_sample(self._holds))
        self._its_reader()._reconsider()

    def _selector(self, reader: SampleReader[Any]) -> SampleSelector | None:
        super()._selector(reader)
        remembering, holds = self._remembering, self._holds
        if remembering is None or holds is None:
            return None
        is_about_key, sample_from_key = self._expression.is_about_key, self._support.sample_from_key

        def selects(info: SampleInfo) -> bool:
            if info.valid_data:
                return info.change is not None and remembering.passes(info.change)
            return is_about_key and holds(sample_from_key(info.instance_handle))

        return selects

    @property
    def _sort_key(self) -> Callable[[Any], Any] | None:
        return self._expression.sort_key if self._expression.is_ordered else None
