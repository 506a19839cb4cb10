"""FilterExpression: a content filter, checked against a topic's type.  DDS 1.4 §2.2.2.3.3 (ContentFilteredTopic)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ..model import StructType
from .evaluation import Predicate, compile_condition, fields_of, parameters_of
from .field_path import FieldPath
from .parser import parse_filter
from .syntax import InvalidExpression
from .tokens import MAX_CHARACTERS, MAX_PARAMETERS

__all__ = ["FilterExpression", "checked_parameters"]


class FilterExpression:
    """The expression without its parameters, which may change: :meth:`bind` gives it some."""

    def __init__(self, text: str, struct: StructType) -> None:
        """Raises InvalidExpression where the text is no condition, or names what the type has not."""
        self.text = text
        self._struct = struct
        self._condition = parse_filter(text)
        fields = fields_of(self._condition) if self._condition is not None else []
        paths = [FieldPath.find(struct, field, text) for field in fields]
        self.parameter_count = _parameter_count(self._condition)
        self.is_about_key = bool(paths) and all(path.is_key for path in paths)
        """Does what holds for one sample hold for its instance?"""

    def __repr__(self) -> str:
        return f"<FilterExpression {self.text!r} of {self._struct}>"

    def bind(self, parameters: Sequence[str] = ()) -> Predicate:
        """The function that tells whether a sample passes.

        Raises InvalidExpression where a parameter is missing, or has not the type of what it is compared with.
        """
        if self._condition is None:
            return _passes_all
        return compile_condition(self._condition, self._struct, parameters, self.text)


def checked_parameters(parameters: object) -> tuple[str, ...]:
    """Parameters as an application gives them: a sequence of texts.  Raises InvalidExpression."""
    if isinstance(parameters, str) or not isinstance(parameters, Sequence):
        raise InvalidExpression(f'the parameters are a list of str, as ["20", "\'RED\'"], not {parameters!r}')
    if len(parameters) > MAX_PARAMETERS:
        raise InvalidExpression(f"{len(parameters)} parameters; {MAX_PARAMETERS} at most")
    for index, parameter in enumerate(parameters):
        if not isinstance(parameter, str):
            raise InvalidExpression(f"parameter %{index} is a str, as {str(parameter)!r}, not {parameter!r}")
    if sum(map(len, parameters)) > MAX_CHARACTERS:
        raise InvalidExpression(f"the parameters have more than {MAX_CHARACTERS} characters together")
    return tuple(parameters)


def _parameter_count(condition: Any) -> int:
    return max((parameter.index + 1 for parameter in parameters_of(condition)), default=0) if condition else 0


def _passes_all(sample: Any) -> bool:
    return True
