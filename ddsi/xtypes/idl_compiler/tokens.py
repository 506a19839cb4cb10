"""The lexer: text to tokens (OMG IDL 4.2 §7.2), for the preprocessor and the parser alike.

Comments are dropped, but the comment right before a token stays with it, since it may describe what the token
begins, and so do comments ``//@...`` behind it.  A backslash at the end of a line joins it to the next.  ``>`` is
always a token of its own: two of them close nested templates, or are a shift, as the parser finds.  What is no token of
IDL is an odd one, and refused only where it matters (:func:`refuse_odd`): conditions may leave out text in other
languages.  Time is linear in the text.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum

from .source_text import IdlError, Place, SourceText

__all__ = ["Token", "TokenKind", "kind_of", "refuse_odd", "tokenize"]


class TokenKind(Enum):
    NAME = "name"
    INTEGER = "integer"
    FLOATING = "floating-point number"
    STRING = "string"
    CHARACTER = "character"
    PUNCTUATION = "punctuation"
    PRAGMA = "pragma"
    ODD = "odd"
    """No token of IDL: a stray character or quote, or a number such as ``201103L``."""
    END = "end of the text"


@dataclass(eq=False, slots=True)
class Token:
    """One token; not frozen, which would double the time of a large file."""

    kind: TokenKind
    text: str
    place: Place
    starts_line: bool = False
    spaced: bool = False
    """White space or a comment is before it."""
    comment: str = ""
    """What the comment before it says."""
    directives: tuple[tuple[str, Place], ...] = ()
    """What comments ``//@...`` behind it say, without these three characters, and where."""

    def __str__(self) -> str:
        return self.kind.value if self.kind is TokenKind.END else f"'{self.text}'"


_SPACE = re.compile(r"(?:[ \t\r\f\v]+|\\[ \t]*\r?\n)+")
_TOKEN = re.compile(
    r"""
    (?P<string>   L?"(?:[^"\\\n]|\\.)*" )
  | (?P<character>L?'(?:[^'\\\n]|\\.)+' )
  | (?P<name>     [A-Za-z_][A-Za-z0-9_]* )
  | (?P<floating> (?:[0-9]+\.[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?[A-Za-z0-9_]* | [0-9]+[eE][+-]?[0-9]+[A-Za-z0-9_]* )
  | (?P<integer>  0[xX][0-9A-Fa-f]*[A-Za-z0-9_]* | [0-9]+[A-Za-z0-9_]* )
  | (?P<punctuation> :: | << | && | \|\| | == | != | \#\# | [-{}()\[\];:,<>=+*/%&|^~!@#?.] )
    """,
    re.VERBOSE,
)
_NUMBER = re.compile(
    r"0[xX][0-9A-Fa-f]+|[0-9]+|(?:[0-9]+\.[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?[fFdD]?|[0-9]+[eE][+-]?[0-9]+[fFdD]?"
)
_LONGEST_NUMBER = 400
"""Digits; Python takes quadratic time to read more of them."""

_MOST_DIRECTIVES = 16
"""Behind one token."""

_KINDS = {
    "string": TokenKind.STRING,
    "character": TokenKind.CHARACTER,
    "name": TokenKind.NAME,
    "floating": TokenKind.FLOATING,
    "integer": TokenKind.INTEGER,
    "punctuation": TokenKind.PUNCTUATION,
}


def tokenize(source: SourceText) -> Iterator[Token]:
    """The tokens of a text, the end as the last.  IdlError for a comment without end."""
    text, position, end = source.text, 0, len(source.text)
    starts_line, spaced, comments = True, False, list[str]()
    token: Token | None = None
    while position < end:
        character = text[position]
        if character == "\n":
            if comments and text[position + 1 : position + 2] in ("\n", "\r"):
                comments = []  # a blank line: the comment belongs to nothing in particular
            starts_line, spaced, position = True, True, position + 1
        elif found := _SPACE.match(text, position):
            spaced, position = True, found.end()
        elif text.startswith("//", position) or text.startswith("/*", position):
            start = position
            position, comment = _comment(source, position)
            if text.startswith("//@", start) and token is not None and len(token.directives) < _MOST_DIRECTIVES:
                token.directives += ((comment.removeprefix("@"), Place(source, start)),)
            if starts_line:  # one behind something else on the line belongs to that
                comments.append(comment)
            spaced = True
        else:
            found = _TOKEN.match(text, position)
            kind, word = TokenKind.ODD, character
            if found is not None:
                kind, word = _KINDS[found.lastgroup or ""], found.group()
                if kind in (TokenKind.INTEGER, TokenKind.FLOATING) and not _is_number(word):
                    kind = TokenKind.ODD
            token = Token(kind, word, Place(source, position), starts_line, spaced, "\n".join(comments))
            yield token
            starts_line, spaced, comments, position = False, False, [], position + len(word)
    yield Token(TokenKind.END, "", Place(source, end), True, True)


def kind_of(text: str) -> TokenKind | None:
    """What ``text`` is as a token of its own; None if it is not one token."""
    found = _TOKEN.fullmatch(text)
    if found is None:
        return None
    kind = _KINDS[found.lastgroup or ""]
    return kind if kind not in (TokenKind.INTEGER, TokenKind.FLOATING) or _is_number(text) else TokenKind.ODD


def _is_number(text: str) -> bool:
    return len(text) <= _LONGEST_NUMBER and _NUMBER.fullmatch(text) is not None


def _comment(source: SourceText, start: int) -> tuple[int, str]:
    """(where it ends, what it says)."""
    text = source.text
    if text.startswith("//", start):
        end = text.find("\n", start)
        while end > 0 and text[max(start, end - 2) : end].rstrip("\r").endswith("\\"):
            end = text.find("\n", end + 1)
        end = len(text) if end < 0 else end
        return end, text[start:end].lstrip("/!<").strip()
    end = text.find("*/", start + 2)
    if end < 0:
        raise IdlError(Place(source, start), "the comment has no end; expected '*/'")
    lines = [line.strip().lstrip("*").strip() for line in text[start + 2 : end].lstrip("*!<").splitlines()]
    return end + 2, "\n".join(lines).strip()


def refuse_odd(token: Token) -> Token:
    """The token; IdlError where it is an odd one, with what is odd about it."""
    if token.kind is not TokenKind.ODD:
        return token
    word = token.text
    if word in ("'", '"'):
        what = "string" if word == '"' else "character"
        raise IdlError(token.place, f"the {what} has no end on this line; expected {word}")
    if len(word) == 1:
        raise IdlError(token.place, f"the character {word!r} has no meaning here")
    raise IdlError(token.place, f"'{word[:80]}' is no number")
