"""Macros: what ``#define`` says, and what stands in a macro's place (ISO C §6.10.3, to which OMG IDL 4.2 §7.3 points).

``#`` before a parameter makes a string of its argument, ``##`` joins what stands on both sides to one token; neither
looks into the macros of the argument.  No variable arguments.  When a macro is replaced, the preprocessor knows.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from .source_text import IdlError
from .tokens import Token, TokenKind, kind_of

__all__ = ["Macro", "arguments_of", "macro_of", "replacement"]

LONGEST_MADE = 1_000
"""Characters of a token that ``#`` or ``##`` makes."""


@dataclass(frozen=True, slots=True)
class Macro:
    body: tuple[Token, ...]
    parameters: tuple[str, ...] | None = None
    """None for a macro without parentheses."""


def macro_of(name: Token, rest: Sequence[Token]) -> Macro:
    """What ``#define name rest`` says.  Raises IdlError."""
    parameters: tuple[str, ...] | None = None
    if rest and rest[0].text == "(" and not rest[0].spaced:
        parameters, rest = _parameters(name, rest)
    for index, token in enumerate(rest):
        if _is(token, "##") and index in (0, len(rest) - 1):
            raise IdlError(token.place, f"'##' joins two tokens, and stands at an end of {name.text}")
        if _is(token, "#") and parameters is not None:
            following = rest[index + 1] if index + 1 < len(rest) else None
            if following is None or following.text not in parameters:
                raise IdlError(token.place, f"expected a parameter of {name.text} behind '#'")
    return Macro(tuple(rest), parameters)


def _parameters(name: Token, rest: Sequence[Token]) -> tuple[tuple[str, ...], Sequence[Token]]:
    found: list[str] = []
    for index in range(1, len(rest)):
        token = rest[index]
        if token.text == ")":
            return tuple(found), rest[index + 1 :]
        if index % 2 == 0 and token.text != ",":
            raise IdlError(token.place, f"expected ',' or ')' in the parameters of {name.text}, found {token}")
        if index % 2 == 1:
            if token.kind is not TokenKind.NAME:
                raise IdlError(token.place, f"expected a parameter of {name.text}, found {token}")
            found.append(token.text)
    raise IdlError(name.place, f"the parameters of {name.text} have no end; expected ')'")


def arguments_of(name: Token, pending: deque[Token]) -> list[list[Token]]:
    """The arguments of a call, taken from ``pending``, which begins with their parenthesis."""
    pending.popleft()
    arguments: list[list[Token]] = [[]]
    depth = 0
    while pending:
        token = pending.popleft()
        if token.text == ")" and depth == 0:
            return arguments
        if token.text == "," and depth == 0:
            arguments.append([])
            continue
        depth += {"(": 1, ")": -1}.get(token.text, 0)
        arguments[-1].append(token)
    raise IdlError(name.place, f"the arguments of {name.text} have no end; expected ')'")


def replacement(
    call: Token, macro: Macro, arguments: list[list[Token]], expanded: Callable[[list[Token]], list[Token]]
) -> Iterator[Token]:
    """The tokens in the macro's place.  ``expanded``: an argument once its own macros are replaced.

    They come one by one: how many there are to be, the caller bounds.
    """
    parameters = macro.parameters or ()
    if len(arguments) != len(parameters) and not (not parameters and arguments == [[]]):
        raise IdlError(call.place, f"{call.text} takes {len(parameters)} arguments, not {len(arguments)}")
    given = dict(zip(parameters, arguments, strict=False))
    ready: dict[str, list[Token]] = {}
    last = nothing = Token(TokenKind.ODD, "", call.place)  # last: the one before, which '##' may still join to the next
    joins = makes_string = False
    for index, token in enumerate(macro.body):
        if _is(token, "##"):
            joins = True
            continue
        if _is(token, "#") and macro.parameters is not None:
            makes_string = True
            continue
        parts: Sequence[Token] = (token,)
        if token.kind is TokenKind.NAME and token.text in given:
            argument = given[token.text]
            if makes_string:
                parts = (_string_of(call, argument),)
            elif joins or _is_before_joint(macro, index):
                parts = argument or (nothing,)
            else:
                if token.text not in ready:
                    ready[token.text] = expanded(argument)
                parts = ready[token.text]
        for part in parts:
            if joins:
                part = _joined(call, last, part)
            elif last is not nothing:
                yield last
            last, joins = part, False
        makes_string = False
    if last is not nothing:
        yield last


def _is_before_joint(macro: Macro, index: int) -> bool:
    return index + 1 < len(macro.body) and _is(macro.body[index + 1], "##")


def _is(token: Token, operator: str) -> bool:
    return token.kind is TokenKind.PUNCTUATION and token.text == operator


def _joined(call: Token, left: Token, right: Token) -> Token:
    if not left.text or not right.text:  # an argument was empty
        return left if left.text else right
    text = left.text + right.text
    kind = kind_of(text) if len(text) <= LONGEST_MADE else None
    if kind is None:
        raise IdlError(call.place, f"'{left.text[:40]}' and '{right.text[:40]}', joined by '##', are no token")
    return Token(kind, text, call.place, spaced=left.spaced)


def _string_of(call: Token, argument: list[Token]) -> Token:
    text = ""
    for index, token in enumerate(argument):
        word = token.text
        if token.kind in (TokenKind.STRING, TokenKind.CHARACTER):
            word = word.replace("\\", "\\\\").replace('"', '\\"')
        text += " " + word if index and token.spaced else word
        if len(text) > LONGEST_MADE:
            raise IdlError(call.place, f"the string that {call.text} makes has more than {LONGEST_MADE} characters")
    return Token(TokenKind.STRING, f'"{text}"', call.place)
