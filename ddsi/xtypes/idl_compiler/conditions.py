"""The expression behind ``#if`` and ``#elif``: integers, ``defined``, the operators of C (OMG IDL 4.2 §7.3).

The preprocessor has expanded macros already; names that are left are 0, as in C.
"""

from __future__ import annotations

import operator
import re
from collections.abc import Callable, Sequence

from .source_text import IdlError, Place
from .tokens import Token, TokenKind

__all__ = ["divide", "evaluate_condition", "remainder"]

_INTEGER = re.compile(r"(0[xX][0-9A-Fa-f]{1,40}|[0-9]{1,40})[uUlL]{0,3}")
"""With the suffixes of C, as in ``__cplusplus >= 201103L``."""

_DEEPEST = 120
_LARGEST = 1 << 64


def divide(left: int, right: int) -> int:
    """Rounded towards zero, as in C and IDL."""
    quotient = abs(left) // abs(right)
    return quotient if (left < 0) == (right < 0) else -quotient


def remainder(left: int, right: int) -> int:
    """With the sign of ``left``."""
    return left - right * divide(left, right)


_LEVELS: tuple[dict[str, Callable[[int, int], int]], ...] = (
    {"||": lambda left, right: int(bool(left or right))},
    {"&&": lambda left, right: int(bool(left and right))},
    {"|": operator.or_},
    {"^": operator.xor},
    {"&": operator.and_},
    {"==": lambda left, right: int(left == right), "!=": lambda left, right: int(left != right)},
    {
        "<": lambda left, right: int(left < right),
        "<=": lambda left, right: int(left <= right),
        ">": lambda left, right: int(left > right),
        ">=": lambda left, right: int(left >= right),
    },
    {"<<": lambda left, right: left << min(right, 64), ">>": lambda left, right: left >> min(right, 64)},
    {"+": operator.add, "-": operator.sub},
    {"*": operator.mul, "/": divide, "%": remainder},
)
"""Binary operators, weakest binding first."""

_LEVEL_OF = {sign: level for level, signs in enumerate(_LEVELS) for sign in signs}


def evaluate_condition(tokens: Sequence[Token], place: Place) -> bool:
    """Whether the condition holds; ``place`` is that of the directive.  IdlError where it is none."""
    condition = _Condition(tokens, place)
    value = condition.ternary(0)
    condition.expect_end()
    return value != 0


class _Condition:
    def __init__(self, tokens: Sequence[Token], place: Place) -> None:
        self._tokens = tokens
        self._next = 0
        self._place = place

    def ternary(self, depth: int) -> int:
        condition = self._binary(0, depth + 1)
        if self._operator() != "?":
            return condition
        self._next += 1
        chosen = self.ternary(depth + 1)
        if self._operator() != ":":
            raise self._unexpected("':'")
        self._next += 1
        other = self.ternary(depth + 1)
        return chosen if condition else other

    def expect_end(self) -> None:
        if self._next < len(self._tokens):
            raise self._unexpected("the end of the line")

    def _binary(self, level: int, depth: int) -> int:
        """Operators that bind at least as strongly as ``level``."""
        if depth > _DEEPEST:
            raise IdlError(self._place, f"the condition nests deeper than {_DEEPEST}")
        value = self._unary(depth)
        while (own_level := _LEVEL_OF.get(sign := self._operator(), -1)) >= level:
            place = self._tokens[self._next].place
            self._next += len(sign) if sign in (">>", ">=", "<=") else 1
            right = self._binary(own_level + 1, depth + 1)
            if sign in ("/", "%") and right == 0:
                raise IdlError(place, "the condition divides by zero")
            value = _LEVELS[own_level][sign](value, right) if right >= 0 or sign not in ("<<", ">>") else 0
            if abs(value) >= _LARGEST:
                raise IdlError(place, "the condition exceeds 64 bits")
        return value

    def _unary(self, depth: int) -> int:
        token = self._take()
        match token.text:
            case "!":
                return int(not self._descend(depth))
            case "-":
                return -self._descend(depth)
            case "+":
                return self._descend(depth)
            case "~":
                return ~self._descend(depth)
            case "(":
                value = self.ternary(depth + 1)
                if self._operator() != ")":
                    raise self._unexpected("')'")
                self._next += 1
                return value
        if number := _INTEGER.fullmatch(token.text):
            digits = number[1]
            return int(digits, 16 if digits[:2] in ("0x", "0X") else 8 if _is_octal(digits) else 10)
        if token.kind is TokenKind.NAME:
            return int(token.text in ("TRUE", "true"))
        self._next -= 1
        raise self._unexpected("a number, a name or '('")

    def _descend(self, depth: int) -> int:
        if depth > _DEEPEST:
            raise IdlError(self._place, f"the condition nests deeper than {_DEEPEST}")
        return self._unary(depth + 1)

    def _operator(self) -> str:
        """The next operator: ``>`` and ``=`` come as tokens of their own."""
        tokens = self._tokens[self._next : self._next + 2]
        if not tokens:
            return ""
        if len(tokens) == 2 and tokens[0].text + tokens[1].text in (">>", ">=", "<=") and not tokens[1].spaced:
            return tokens[0].text + tokens[1].text
        return tokens[0].text

    def _take(self) -> Token:
        if self._next == len(self._tokens):
            raise self._unexpected("a number, a name or '('")
        self._next += 1
        return self._tokens[self._next - 1]

    def _unexpected(self, expected: str) -> IdlError:
        if self._next < len(self._tokens):
            token = self._tokens[self._next]
            return IdlError(token.place, f"expected {expected} in the condition, found {token}")
        return IdlError(self._place, f"expected {expected} in the condition, found its end")


def _is_octal(text: str) -> bool:
    return len(text) > 1 and text[0] == "0" and all(digit in "01234567" for digit in text)
