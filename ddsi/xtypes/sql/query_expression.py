"""QueryExpression: which samples a query wants, and in which order.  DDS 1.4 §2.2.2.5.9, Annex B.2.2."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from ..model import StructType
from .evaluation import Predicate, compile_condition, fields_of
from .field_path import FieldPath
from .parser import parse_query

__all__ = ["QueryExpression"]


class QueryExpression:
    """``condition ORDER BY members``, checked against a type; either part may be absent."""

    def __init__(self, text: str, struct: StructType) -> None:
        """Raises InvalidExpression."""
        self.text = text
        self._struct = struct
        query = parse_query(text)
        self._condition = query.condition
        self._order = tuple(FieldPath.find(struct, field, text) for field in query.order)
        fields = fields_of(query.condition) if query.condition is not None else []
        self.is_about_key = bool(fields) and all(FieldPath.find(struct, field, text).is_key for field in fields)
        """Does what holds for one sample hold for its instance, and for its end?"""

    @property
    def is_ordered(self) -> bool:
        return bool(self._order)

    def bind(self, parameters: Sequence[str] = ()) -> Predicate | None:
        """The function that tells whether a sample is wanted; None where all are.  Raises InvalidExpression."""
        if self._condition is None:
            return None
        return compile_condition(self._condition, self._struct, parameters, self.text)

    @property
    def sort_key(self) -> Callable[[Any], tuple[Any, ...]]:
        """What samples are sorted by; what lacks a member comes before what has it."""
        getters = [path.get for path in self._order]

        def key(sample: Any) -> tuple[Any, ...]:
            values = (get(sample) for get in getters)
            return tuple((value is not None, value if value is not None else 0) for value in values)

        return key
