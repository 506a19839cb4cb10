"""Constant expressions: their values, and whether a value fits a type (OMG IDL 4.2 §7.4.1.4.3).

Integers are computed without loss within 64 bits and signs; division rounds towards zero.  Floating-point numbers
have the precision of a double.
"""

from __future__ import annotations

import math
import operator
import struct
from collections.abc import Callable

from ..model import BOOLEAN, CHAR, WCHAR, Primitive, String
from .conditions import divide, remainder
from .declarations import (
    Bitflag,
    BitmaskDeclaration,
    Constant,
    ConstantValue,
    Declaration,
    EnumDeclaration,
    Enumerator,
    TypeReference,
    unaliased,
)
from .source_text import IdlError, Place
from .syntax import Binary, Expression, Literal, Name, Unary

__all__ = ["Lookup", "evaluate", "fitted", "unsigned_bits"]

Lookup = Callable[[Name], Declaration]

_LARGEST = 1 << 65

_INTEGER_SIGNS: dict[str, Callable[[int, int], int]] = {
    "|": operator.or_,
    "^": operator.xor,
    "&": operator.and_,
    "<<": operator.lshift,
    ">>": operator.rshift,
    "+": operator.add,
    "-": operator.sub,
    "*": operator.mul,
    "/": divide,
    "%": remainder,
}
_FLOATING_SIGNS: dict[str, Callable[[float, float], float]] = {
    "+": operator.add,
    "-": operator.sub,
    "*": operator.mul,
    "/": operator.truediv,
}


def unsigned_bits(type_: TypeReference) -> int:
    """How many bits an unsigned integer type has; 0 for all others."""
    type_ = unaliased(type_)
    if isinstance(type_, Primitive) and type_.is_number and type_.code.isupper():
        return 8 * type_.size
    return 0


def evaluate(expression: Expression, lookup: Lookup, *, bits: int = 0) -> ConstantValue:
    """The value of an expression; ``lookup`` finds what a name means.  IdlError where it has none.

    ``bits`` are those of the unsigned type that the expression is for, in which ``~`` is (2**bits - 1) - value; 0 for
    other types, in which it is -(value + 1).
    """
    chain: list[Binary] = []
    while isinstance(expression, Binary):  # a loop, as a sum of thousands leans to the left
        chain.append(expression)
        expression = expression.left
    value = _operand(expression, lookup, bits)
    for binary in reversed(chain):
        value = _combined(binary, value, evaluate(binary.right, lookup, bits=bits))
    return value


def _operand(expression: Expression, lookup: Lookup, bits: int) -> ConstantValue:
    match expression:
        case Literal(value=value):
            return value
        case Name():
            found = lookup(expression)
            if isinstance(found, Constant):
                return found.value
            if isinstance(found, Enumerator):
                return found
            raise IdlError(expression.place, f"expected a constant; {expression} is none")
        case Unary(sign=sign, operand=operand, place=place):
            return _signed(sign, evaluate(operand, lookup, bits=bits), place, bits)
        case _:
            return evaluate(expression, lookup, bits=bits)


def _signed(sign: str, value: ConstantValue, place: Place, bits: int) -> ConstantValue:
    if isinstance(value, bool) or not isinstance(value, (int, float)) or (sign == "~" and isinstance(value, float)):
        raise IdlError(place, f"'{sign}' takes {'an integer' if sign == '~' else 'a number'}, not {_shown(value)}")
    if sign == "~":
        return ~int(value) & ((1 << bits) - 1) if bits else ~int(value)
    return -value if sign == "-" else value


def _combined(binary: Binary, left: ConstantValue, right: ConstantValue) -> ConstantValue:
    sign, place = binary.sign, binary.place
    for operand in (left, right):
        if isinstance(operand, bool) or not isinstance(operand, (int, float)):
            raise IdlError(place, f"'{sign}' takes numbers, not {_shown(operand)}")
    if sign in ("/", "%") and right == 0:
        raise IdlError(place, "division by zero")
    if isinstance(left, int) and isinstance(right, int):
        if sign in ("<<", ">>") and not 0 <= right < 64:
            raise IdlError(place, f"'{sign}' shifts by 0 to 63 bits, not {right}")
        result = _INTEGER_SIGNS[sign](left, right)
        if abs(result) >= _LARGEST:
            raise IdlError(place, "the result exceeds 64 bits")
        return result
    assert isinstance(left, (int, float))
    assert isinstance(right, (int, float))
    if sign not in _FLOATING_SIGNS:
        raise IdlError(place, f"'{sign}' takes integers, not {_shown(left if isinstance(left, float) else right)}")
    try:
        return _FLOATING_SIGNS[sign](float(left), float(right))
    except OverflowError:
        raise IdlError(place, "the result is too large") from None


def fitted(value: ConstantValue, type_: TypeReference, place: Place) -> ConstantValue:
    """The value as one of a type: an integer for a float becomes one.  IdlError where it does not fit."""
    type_ = unaliased(type_)
    match type_:
        case String(bound=bound, wide=wide):
            if not isinstance(value, str):
                raise IdlError(place, f"expected a string, found {_shown(value)}")
            if "\0" in value:
                raise IdlError(place, "a string contains no NUL, which ends it on the wire")
            length = (
                len(value.encode("utf-16-le", "surrogatepass")) // 2 if wide else len(value.encode(errors="replace"))
            )
            if bound is not None and length > bound:
                raise IdlError(place, f"a string of {length} exceeds its bound of {bound}")
            return value
        case EnumDeclaration():
            if not isinstance(value, Enumerator) or value.enum is not type_:
                raise IdlError(place, f"expected a literal of {type_.scoped_name}, found {_shown(value)}")
            return value
        case BitmaskDeclaration():
            if not isinstance(value, Bitflag) or value.bitmask is not type_:
                raise IdlError(place, f"expected a flag of {type_.scoped_name}, found {_shown(value)}")
            return value
        case Primitive():
            return _fitted_primitive(value, type_, place)
        case _:
            raise IdlError(place, "a constant is a number, character, boolean, string or enum literal")


def _fitted_primitive(value: ConstantValue, type_: Primitive, place: Place) -> ConstantValue:
    if type_ == BOOLEAN:
        if not isinstance(value, bool):
            raise IdlError(place, f"expected TRUE or FALSE, found {_shown(value)}")
        return value
    if type_ in (CHAR, WCHAR):
        if not isinstance(value, str) or len(value) != 1 or ord(value) >= 256**type_.size:
            raise IdlError(place, f"expected one character that fits a {type_}, found {_shown(value)}")
        return value
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise IdlError(place, f"expected a number, found {_shown(value)}")
    if type_.code in "fd":
        return _fitted_float(value, type_, place)
    if not isinstance(value, int):
        raise IdlError(place, f"expected an integer, found {value}")
    bits = 8 * type_.size
    lowest, highest = (-(1 << bits - 1), (1 << bits - 1) - 1) if type_.code.islower() else (0, (1 << bits) - 1)
    if value < 0 and type_.code.isupper() and value >= -(1 << bits - 1):
        raise IdlError(place, f"{value} is negative; {type_} has no sign")
    if not lowest <= value <= highest:
        raise IdlError(place, f"{value} does not fit {type_} ({lowest} to {highest})")
    return value


def _fitted_float(value: float, type_: Primitive, place: Place) -> float:
    try:
        number = float(value)
        struct.pack(type_.code, number)
    except OverflowError:
        number = math.inf
    if math.isinf(number):
        raise IdlError(place, f"the number is too large for a {type_}")
    return number


def _shown(value: ConstantValue) -> str:
    match value:
        case Enumerator():
            return f"the literal {value.name}"
        case Bitflag():
            return f"the flag {value.name}"
        case bool():
            return "TRUE" if value else "FALSE"
        case str():
            return f'"{value}"' if len(value) <= 40 else f'"{value[:37]}..."'
        case _:
            return str(value)
