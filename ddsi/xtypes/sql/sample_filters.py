"""SampleFilters: SQL expressions as functions of a change, whose octets are made a sample as seldom as can be.

DDS 1.4 §2.2.2.3.3.  A filter that looks at key members alone is asked once for each instance; several filters of one
change share one sample.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Generic, TypeVar

from ...structure.cache_change import CacheChange
from ...structure.errors import MalformedSample
from ..type_support import TypeSupport
from .evaluation import Predicate
from .filter_expression import FilterExpression, checked_parameters

__all__ = ["SampleFilters"]

T = TypeVar("T")
_MOST_INSTANCES = 1024  # remembered by a filter of key members; more than that are looked at again


class SampleFilters(Generic[T]):
    """For the changes of one endpoint."""

    def __init__(self, support: TypeSupport[T]) -> None:
        self._support = support
        self._latest: tuple[CacheChange, T] | None = None

    def compile(self, expression: str, parameters: tuple[str, ...] = ()) -> Callable[[CacheChange], bool]:
        """The function that tells whether a change passes; one that cannot be decoded does: others will tell of it.

        Raises InvalidExpression.
        """
        checked = FilterExpression(expression, self._support.struct)
        holds = checked.bind(checked_parameters(parameters))
        return self._of_instance(holds) if checked.is_about_key else self.of_sample(holds)

    def of_sample(self, holds: Predicate) -> Callable[[CacheChange], bool]:
        """The same, of a predicate on samples of the type."""

        def passes(change: CacheChange) -> bool:
            try:
                return holds(self._sample(change))
            except MalformedSample:
                return True

        return passes

    def _of_instance(self, holds: Predicate) -> Callable[[CacheChange], bool]:
        known: dict[bytes, bool] = {}
        of_sample = self.of_sample(holds)

        def passes(change: CacheChange) -> bool:
            key = change.key
            if not key:
                return of_sample(change)
            verdict = known.get(key)
            if verdict is None:
                if len(known) >= _MOST_INSTANCES:
                    known.clear()
                verdict = known[key] = of_sample(change)
            return verdict

        return passes

    def _sample(self, change: CacheChange) -> Any:
        if self._latest is None or self._latest[0] is not change:
            self._latest = (change, self._support.deserialize(change.payload))
        return self._latest[1]
