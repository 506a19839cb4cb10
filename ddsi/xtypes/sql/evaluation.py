"""From the tree of a condition to a function of a sample: checked against the type once, then only called.

DDS 1.4 Annex B.3 (type compatibility).  A predicate about what a sample lacks does not hold, nor does its negation, as
in SQL; hence a NOT is taken down to the predicates that it negates.  A value that is compared with a float32 is
rounded to one, so that ``x = 0.1`` holds for the sample written with 0.1.
"""

from __future__ import annotations

import operator
import struct as octets
from collections.abc import Callable, Sequence
from typing import Any, NoReturn

from ..model import BOOLEAN, EnumType, StructType
from .field_path import FieldPath, ValueKind, nearest
from .like import like
from .parser import parse_literal
from .syntax import And, Between, Comparison, Condition, Field, InvalidExpression, Literal, Not, Operand, Or, Parameter

__all__ = ["Predicate", "compile_condition", "fields_of", "parameters_of"]

Predicate = Callable[[Any], bool]
Value = int | float | str | bool

_OPERATORS: dict[str, Callable[[Any, Any], Any]] = {
    "=": operator.eq,
    "<>": operator.ne,
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
}
_MIRRORED = {"=": "=", "<>": "<>", "<": ">", "<=": ">=", ">": "<", ">=": "<="}


def fields_of(condition: Condition) -> list[Field]:
    """Every member that is mentioned, in order."""
    return [operand for operand in _operands(condition) if isinstance(operand, Field)]


def parameters_of(condition: Condition) -> list[Parameter]:
    """Every parameter that is mentioned, in order."""
    return [operand for operand in _operands(condition) if isinstance(operand, Parameter)]


def _operands(condition: Condition) -> list[Operand]:
    match condition:
        case Comparison(left, _, right):
            return [left, right]
        case Between(field, low, high):
            return [field, low, high]
        case Not(inner):
            return _operands(inner)
        case And(operands) | Or(operands):
            return [operand for part in operands for operand in _operands(part)]


def compile_condition(
    condition: Condition, struct: StructType, parameters: Sequence[str] = (), text: str = ""
) -> Predicate:
    """The function that tells whether a sample of the type fulfils the condition; it does not raise.

    Raises InvalidExpression: a member that the type has not, values that do not compare, a parameter that is missing.
    """
    return _Compiler(struct, parameters, text).condition(condition, wanted=True)


class _Compiler:
    def __init__(self, struct: StructType, parameters: Sequence[str], text: str) -> None:
        self._struct = struct
        self._parameters = parameters
        self._text = text

    def refuse(self, reason: str, column: int) -> NoReturn:
        raise InvalidExpression(reason, text=self._text, column=column)

    def condition(self, condition: Condition, *, wanted: bool) -> Predicate:
        """``wanted``: what the condition is to be for the result to hold."""
        match condition:
            case Comparison():
                return self._comparison(condition, wanted=wanted)
            case Between():
                return self._between(condition, wanted=wanted)
            case Not(inner):
                return self.condition(inner, wanted=not wanted)
            case And(operands) | Or(operands):
                parts = [self.condition(operand, wanted=wanted) for operand in operands]
                return _all(parts) if isinstance(condition, And) == wanted else _any(parts)

    # --- predicates --------------------------------------------------------------------------------------

    def _comparison(self, comparison: Comparison, *, wanted: bool) -> Predicate:
        left, sign, right = comparison.left, comparison.operator, comparison.right
        if not isinstance(left, Field):
            left, sign, right = right, _MIRRORED[sign], left
        assert isinstance(left, Field)
        path = FieldPath.find(self._struct, left, self._text)
        if sign == "LIKE":
            return self._like(path, right, wanted=wanted)
        compare = _OPERATORS[sign]
        if isinstance(right, Field):
            other = FieldPath.find(self._struct, right, self._text)
            self._check_alike(path, other)
            return _compares_members(path, compare, other, wanted=wanted)
        return _compares_value(path, compare, self._value(path, right), wanted=wanted)

    def _like(self, path: FieldPath, right: Operand, *, wanted: bool) -> Predicate:
        if path.kind is not ValueKind.TEXT:
            self.refuse(f"LIKE is for texts; {path.field} is {path.kind.value}", path.field.column)
        if isinstance(right, Field):
            self.refuse("the pattern of LIKE is a text or a parameter", right.column)
        try:
            fits = like(str(self._value(path, right)))
        except InvalidExpression as error:
            self.refuse(error.reason, right.column)
        get = path.get

        def holds(sample: Any) -> bool:
            value = get(sample)
            return value is not None and fits(value) is wanted

        return holds

    def _between(self, between: Between, *, wanted: bool) -> Predicate:
        path = FieldPath.find(self._struct, between.field, self._text)
        for end in (between.low, between.high):
            if isinstance(end, Field):
                self.refuse("the ends of BETWEEN are values or parameters", end.column)
        low, high = self._value(path, between.low), self._value(path, between.high)
        get = path.get

        def holds(sample: Any) -> bool:
            value = get(sample)
            return value is not None and bool(low <= value <= high) is wanted

        return holds

    # --- values ------------------------------------------------------------------------------------------

    def _check_alike(self, left: FieldPath, right: FieldPath) -> None:
        texts = {ValueKind.TEXT, ValueKind.CHARACTER}
        if left.kind is not right.kind and not {left.kind, right.kind} <= texts:
            self.refuse(f"{left.field} is {left.kind.value}, {right.field} is {right.kind.value}", left.field.column)
        if left.kind is ValueKind.ENUMERATOR and left.type != right.type:
            self.refuse(f"{left.field} is of {left.type}, {right.field} of {right.type}", left.field.column)

    def _value(self, path: FieldPath, operand: Operand) -> Any:
        """What the member is compared with, in the form that the member's values have."""
        if isinstance(operand, Parameter):
            return self._fitted(path, self._parameter(operand), operand.column, f"parameter %{operand.index}, ")
        assert isinstance(operand, Literal)
        return self._fitted(path, operand.value, operand.column, "")

    def _parameter(self, parameter: Parameter) -> Value:
        given = self._parameters
        if parameter.index >= len(given):
            there = f"%0 to %{len(given) - 1}" if len(given) > 1 else "%0 alone" if given else "none"
            self.refuse(f"parameter %{parameter.index} has no value; given were {there}", parameter.column)
        try:
            return parse_literal(given[parameter.index]).value
        except InvalidExpression as error:
            self.refuse(f"the value of parameter %{parameter.index}: {error.reason}", parameter.column)

    def _fitted(self, path: FieldPath, value: Value, column: int, which: str) -> Any:
        described = f"{which}{value!r}"
        match path.kind:
            case ValueKind.NUMBER:
                if isinstance(value, str):
                    self.refuse(f"{path.field} is a number; {described} is a text", column)
                if isinstance(value, bool) and path.type != BOOLEAN:
                    self.refuse(f"{path.field} is no boolean, but {path.type}", column)
                return _as_float32(value) if path.is_float32 else value
            case ValueKind.TEXT | ValueKind.CHARACTER:
                if not isinstance(value, str):
                    self.refuse(f"{path.field} is {path.kind.value}; {described} has no quotes: '{value}'", column)
                return value
            case ValueKind.ENUMERATOR:
                return self._enumerator(path, value, column, described)

    def _enumerator(self, path: FieldPath, value: Value, column: int, described: str) -> int:
        assert isinstance(path.type, EnumType)
        literals = path.type.python_class.__members__
        if isinstance(value, str):
            if value not in literals:
                self.refuse(f"{path.type} has no enumerator {described}; {nearest(value, list(literals))}", column)
            return literals[value].value
        if isinstance(value, bool) or not isinstance(value, int):
            self.refuse(f"{path.field} is an enumerator, as '{next(iter(literals))}', not {described}", column)
        return value


def _as_float32(value: Any) -> Any:
    try:
        return octets.unpack("<f", octets.pack("<f", value))[0]
    except OverflowError:  # larger than any float32: it compares as it is
        return value


def _compares_value(path: FieldPath, compare: Callable[[Any, Any], Any], value: Any, *, wanted: bool) -> Predicate:
    get = path.get
    if path.is_certain and wanted:
        return lambda sample: bool(compare(get(sample), value))

    def holds(sample: Any) -> bool:
        found = get(sample)
        return found is not None and bool(compare(found, value)) is wanted

    return holds


def _compares_members(
    path: FieldPath, compare: Callable[[Any, Any], Any], other: FieldPath, *, wanted: bool
) -> Predicate:
    get, get_other = path.get, other.get

    def holds(sample: Any) -> bool:
        found, compared = get(sample), get_other(sample)
        return found is not None and compared is not None and bool(compare(found, compared)) is wanted

    return holds


def _all(parts: list[Predicate]) -> Predicate:
    if len(parts) == 2:
        first, second = parts
        return lambda sample: first(sample) and second(sample)
    return lambda sample: all(part(sample) for part in parts)


def _any(parts: list[Predicate]) -> Predicate:
    if len(parts) == 2:
        first, second = parts
        return lambda sample: first(sample) or second(sample)
    return lambda sample: any(part(sample) for part in parts)
