"""Conditions and wait sets of ``ddsi.blocking`` and ``ddsi.aio``.  DDS 1.4 §2.2.2.1.6 to .9, §2.2.2.5.8, .9.

They are those of ``dcps``, made with entities of these modules and looked at in the engine's thread.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

from .. import dcps
from ..structure.sample_info import ANY_INSTANCE_STATE, ANY_SAMPLE_STATE, ANY_VIEW_STATE
from .endpoints import SampleReaderPortal
from .entities import EntityPortal, ParticipantPortal, check_parent

__all__ = ["GuardCondition", "QueryCondition", "ReadCondition", "StatusCondition", "WaitSetPortal"]


class ReadCondition(dcps.ReadCondition):
    """As ``ddsi.ReadCondition``."""

    def __init__(
        self,
        reader: SampleReaderPortal[Any],
        sample_states: int = ANY_SAMPLE_STATE,
        view_states: int = ANY_VIEW_STATE,
        instance_states: int = ANY_INSTANCE_STATE,
        query: Callable[[Any], bool] | None = None,
    ) -> None:
        """``query`` runs in the engine's thread, and may look at the sample only."""
        check_parent(reader, SampleReaderPortal)
        super().__init__(reader._source, sample_states, view_states, instance_states, query)
        self._engine = reader._engine

    @property
    def trigger_value(self) -> bool:
        return self._engine.within(lambda: super(ReadCondition, self).trigger_value)


class QueryCondition(dcps.QueryCondition):
    """As ``ddsi.QueryCondition``."""

    def __init__(
        self,
        reader: SampleReaderPortal[Any],
        sample_states: int = ANY_SAMPLE_STATE,
        view_states: int = ANY_VIEW_STATE,
        instance_states: int = ANY_INSTANCE_STATE,
        expression: str = "",
        parameters: Sequence[str] = (),
    ) -> None:
        """Raises BadParameter, saying where and why, for what cannot be meant or does not fit the reader's type."""
        check_parent(reader, SampleReaderPortal)
        self._engine = reader._engine
        super().__init__(reader._source, sample_states, view_states, instance_states, expression, parameters)

    @property
    def trigger_value(self) -> bool:
        return self._engine.within(lambda: super(QueryCondition, self).trigger_value)

    def set_query_parameters(self, parameters: Sequence[str]) -> None:
        """From now on these are the values of %0, %1 and so on.  Raises BadParameter, and then nothing has changed."""
        self._engine.within(partial(super().set_query_parameters, parameters))


class StatusCondition(dcps.StatusCondition):
    """As ``ddsi.StatusCondition``."""

    def __init__(self, entity: EntityPortal, *kinds: type) -> None:
        check_parent(entity, EntityPortal)
        super().__init__(entity._entity, *kinds)
        self._engine = entity._engine

    @property
    def trigger_value(self) -> bool:
        return self._engine.within(lambda: super(StatusCondition, self).trigger_value)


class GuardCondition(dcps.GuardCondition):
    """Holds while the application says so, from any thread."""

    def __init__(self, participant: ParticipantPortal) -> None:
        """``participant``: one that is open, in whose engine's thread it is waited for."""
        check_parent(participant, ParticipantPortal)
        super().__init__()
        self._engine = participant._running_engine()

    def set_trigger_value(self, value: bool) -> None:
        """From now on it holds, or does not; who waits for it is woken."""
        self._engine.within(partial(super().set_trigger_value, value))


class WaitSetPortal:
    """A wait set and the thread in which it waits."""

    def __init__(self, participant: ParticipantPortal, *conditions: dcps.Condition) -> None:
        """``participant``: any that is open while this waits; ``conditions``: of this module, of whatever entities."""
        check_parent(participant, ParticipantPortal)
        self._engine = participant._running_engine()
        self._inner: dcps.WaitSet = self._engine.within(partial(dcps.WaitSet, *conditions))

    @property
    def conditions(self) -> tuple[dcps.Condition, ...]:
        """What it waits for, in the order in which it was attached."""
        return self._inner.conditions

    def attach(self, condition: dcps.Condition) -> None:
        """Wait for this one too, at once if somebody waits.  Twice is once.  Raises BadParameter."""
        self._engine.within(partial(self._inner.attach, condition))

    def detach(self, condition: dcps.Condition) -> None:
        """Wait for this one no more.  Raises PreconditionNotMet if it was not attached."""
        self._engine.within(partial(self._inner.detach, condition))
