"""The words of a DDS SQL expression.  DDS 1.4 Annex B.2.1 (Tokens).

Beyond the grammar: ``!=`` for ``<>``, ``TRUE`` and ``FALSE``, ``a[3]`` for an element, and a quote that is doubled
within a text stands for one.  An enumerator is written as a text.
"""

from __future__ import annotations

import enum
import re

from ...structure.dataclass import dataclass
from .syntax import InvalidExpression

__all__ = ["MAX_CHARACTERS", "MAX_PARAMETERS", "MAX_TOKENS", "Token", "TokenKind", "tokenize"]

MAX_CHARACTERS = 8192
"""Of one expression.  Peers announce theirs, so what one costs has a bound."""
MAX_TOKENS = 1024
MAX_PARAMETERS = 100
"""%0 to %99.  DDS 1.4 Annex B.2.1."""


class TokenKind(enum.Enum):
    """The value of each is how an error names it."""

    NAME = "a name"
    NUMBER = "a number"
    TEXT = "a text"
    PARAMETER = "a parameter"
    SIGN = "a sign"
    END = "the end"


@dataclass(frozen=True, slots=True)
class Token:
    """``text`` is as it was written; ``value`` what a number, text or parameter means."""

    kind: TokenKind
    text: str
    value: int | float | str
    column: int

    @property
    def word(self) -> str:
        """A name in capitals, as keywords are compared; empty for all else."""
        return self.text.upper() if self.kind is TokenKind.NAME else ""

    def __str__(self) -> str:
        return self.kind.value if self.kind is TokenKind.END else self.text


# Each alternative is decided by its first characters and takes time linear in what it consumes.
_TOKEN = re.compile(
    r"(?P<float>[+-]?(?:[0-9]+\.[0-9]*(?:[eE][+-]?[0-9]+)?|\.[0-9]+(?:[eE][+-]?[0-9]+)?|[0-9]+[eE][+-]?[0-9]+))"
    r"|(?P<hex>[+-]?0[xX][0-9a-fA-F]+)"
    r"|(?P<integer>[+-]?[0-9]+)"
    r"|(?P<text>['`](?:[^'\n]|'')*')"
    r"|(?P<name>[A-Za-z_][A-Za-z0-9_]*)"
    r"|%(?P<parameter>[0-9]{1,2})(?![0-9])"
    r"|(?P<sign><=|>=|<>|!=|[=<>()\[\].,;*])"
)
_SPACE = re.compile(r"[ \t\r\n]*")
_MOST_DIGITS = 400  # of one number; Python refuses to read far longer ones in any case


def tokenize(text: str) -> list[Token]:
    """The words, END last.  Raises InvalidExpression."""
    if not isinstance(text, str):
        raise InvalidExpression(f"an expression is a str, not {text!r}")
    if len(text) > MAX_CHARACTERS:
        raise InvalidExpression(f"{len(text)} characters; {MAX_CHARACTERS} at most")
    tokens: list[Token] = []
    position = _skip_space(text, 0)
    while position < len(text):
        found = _TOKEN.match(text, position)
        if found is None:
            raise InvalidExpression(_why_no_token(text, position), text=text, column=position + 1)
        if len(tokens) >= MAX_TOKENS:
            raise InvalidExpression(f"more than {MAX_TOKENS} words", text=text, column=position + 1)
        tokens.append(_token(found, text))
        position = _skip_space(text, found.end())
    tokens.append(Token(TokenKind.END, "", "", len(text) + 1))
    return tokens


def _skip_space(text: str, position: int) -> int:
    found = _SPACE.match(text, position)
    return found.end() if found is not None else position


def _token(found: re.Match[str], text: str) -> Token:
    kind, written, column = found.lastgroup, found.group(), found.start() + 1
    if len(written) > _MOST_DIGITS and kind in ("float", "hex", "integer"):
        raise InvalidExpression(f"a number of {len(written)} characters", text=text, column=column)
    match kind:
        case "float":
            return Token(TokenKind.NUMBER, written, float(written), column)
        case "hex":
            return Token(TokenKind.NUMBER, written, int(written, 16), column)
        case "integer":
            return Token(TokenKind.NUMBER, written, int(written), column)
        case "text":
            return Token(TokenKind.TEXT, written, written[1:-1].replace("''", "'"), column)
        case "parameter":
            return Token(TokenKind.PARAMETER, written, int(written[1:]), column)
        case "name":
            return Token(TokenKind.NAME, written, written, column)
        case _:
            return Token(TokenKind.SIGN, "<>" if written == "!=" else written, "", column)


def _why_no_token(text: str, position: int) -> str:
    character = text[position]
    if character in "'`":
        return "this text has no closing quote ' on its line"
    if character == '"':
        return "a text stands between single quotes: 'RED'"
    if character == "%":
        return f"a parameter is %0 to %{MAX_PARAMETERS - 1}"
    return f"{character!r} means nothing here"
