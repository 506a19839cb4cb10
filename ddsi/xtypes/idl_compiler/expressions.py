"""Half of the parser: single tokens, names and constant expressions (OMG IDL 4.2 §7.4.1.4.3).

Operators of C bind as in C.  Inside ``<...>`` a ``>`` closes, so that a shift to the right stands in parentheses there.
Nesting is bounded, so that no text exhausts Python's stack.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from .source_text import IdlError
from .syntax import Binary, Expression, Literal, Name, Unary
from .tokens import Token, TokenKind

__all__ = ["KEYWORDS", "ExpressionParser"]

KEYWORDS = frozenset(
    [
        "any",
        "bitfield",
        "bitmask",
        "bitset",
        "boolean",
        "case",
        "char",
        "const",
        "default",
        "double",
        "enum",
        "exception",
        "FALSE",
        "fixed",
        "float",
        "int16",
        "int32",
        "int64",
        "int8",
        "interface",
        "long",
        "map",
        "module",
        "native",
        "Object",
        "octet",
        "sequence",
        "short",
        "string",
        "struct",
        "switch",
        "TRUE",
        "typedef",
        "uint16",
        "uint32",
        "uint64",
        "uint8",
        "union",
        "unsigned",
        "valuetype",
        "void",
        "wchar",
        "wstring",
    ]
)
"""Words that name nothing else.  Those of building blocks that hold no data types are free."""

_FOLDED_KEYWORDS = {word.lower(): word for word in KEYWORDS}

DEEPEST = 64
"""Nesting of modules, of templates, and of parentheses and signs."""

_PRECEDENCE = {"|": 1, "^": 2, "&": 3, "<<": 4, ">>": 4, "+": 5, "-": 5, "*": 6, "/": 6, "%": 6}

_ESCAPE = re.compile(r"\\(?:u([0-9A-Fa-f]{1,4})|x([0-9A-Fa-f]{1,2})|([0-7]{1,3})|(.))", re.DOTALL)
_ESCAPED = {"n": "\n", "t": "\t", "v": "\v", "b": "\b", "r": "\r", "f": "\f", "a": "\a"}


class ExpressionParser:
    """Walks over the tokens of one file, of which the last is the end."""

    def __init__(self, tokens: Sequence[Token]) -> None:
        self._tokens = tokens
        self._index = 0
        self._depth = 0

    # --- tokens ------------------------------------------------------------------------------------------

    @property
    def token(self) -> Token:
        """The next token; pragmas are seen only where a definition may begin."""
        return self._tokens[self._index]

    def _after(self) -> Token:
        return self._tokens[min(self._index + 1, len(self._tokens) - 1)]

    def take(self) -> Token:
        token = self.token
        if token.kind is not TokenKind.END:
            self._index += 1
        return token

    def expect(self, text: str, where: str) -> Token:
        if self.token.text != text or self.token.kind is TokenKind.STRING:
            raise self.unexpected(f"'{text}' {where}".rstrip())
        return self.take()

    def unexpected(self, expected: str) -> IdlError:
        return IdlError(self.token.place, f"expected {expected}, found {self.token}")

    @contextmanager
    def deeper(self) -> Iterator[None]:
        self._depth += 1
        if self._depth > DEEPEST:
            raise IdlError(self.token.place, f"this nests deeper than {DEEPEST}")
        yield
        self._depth -= 1

    # --- names -------------------------------------------------------------------------------------------

    def name(self, of: str, *, any_word: bool = False) -> Token:
        """A name that is defined or used; ``_name`` escapes a keyword."""
        token = self.token
        if token.kind is not TokenKind.NAME:
            raise self.unexpected(f"the name {of}")
        if not any_word:
            keyword = _FOLDED_KEYWORDS.get(token.text.lower())
            if keyword == token.text:
                raise IdlError(token.place, f"expected the name {of}, found the keyword {token}; escape it: _{keyword}")
            if keyword is not None:
                raise IdlError(token.place, f"{token} differs from the keyword '{keyword}' only in case")
        self.take()
        if token.text.startswith("_") and len(token.text) > 1 and not any_word:
            return Token(token.kind, token.text[1:], token.place)
        return token

    def scoped_name(self, of: str) -> Name:
        place = self.token.place
        is_absolute = self.token.text == "::"
        if is_absolute:
            self.take()
        parts = [self.name(of).text]
        while self.token.text == "::":
            self.take()
            parts.append(self.name(of).text)
        return Name(tuple(parts), is_absolute, place)

    # --- expressions -------------------------------------------------------------------------------------

    def expression(self, *, in_template: bool = False) -> Expression:
        with self.deeper():
            return self._binary(1, in_template=in_template)

    def _binary(self, weakest: int, *, in_template: bool) -> Expression:
        left = self._unary()
        while (precedence := _PRECEDENCE.get(sign := self._operator(in_template=in_template), 0)) >= weakest:
            place = self.token.place
            for _ in range(2 if sign == ">>" else 1):
                self.take()
            left = Binary(sign, left, self._binary(precedence + 1, in_template=in_template), place)
        return left

    def _operator(self, *, in_template: bool) -> str:
        if self.token.text == ">" and self._after().text == ">" and not in_template:
            return ">>"
        return self.token.text if self.token.kind is TokenKind.PUNCTUATION else ""

    def _unary(self) -> Expression:
        token = self.token
        if token.text in ("-", "+", "~"):
            self.take()
            with self.deeper():
                return Unary(token.text, self._unary(), token.place)
        if token.text == "(":
            self.take()
            inner = self.expression()
            self.expect(")", "behind the expression")
            return inner
        return self._primary()

    def _primary(self) -> Expression:
        token = self.token
        match token.kind:
            case TokenKind.INTEGER:
                self.take()
                return Literal(_integer(token), token.place)
            case TokenKind.FLOATING:
                self.take()
                return Literal(float(token.text.rstrip("fFdD")), token.place)
            case TokenKind.CHARACTER:
                self.take()
                character = _unescaped(token)
                if len(character) != 1:
                    raise IdlError(token.place, f"{token} is not one character")
                return Literal(character, token.place, is_character=True)
            case TokenKind.STRING:
                parts: list[str] = []
                while self.token.kind is TokenKind.STRING:  # adjacent ones are one
                    parts.append(_unescaped(self.take()))
                return Literal("".join(parts), token.place)
            case TokenKind.NAME if token.text in ("TRUE", "FALSE", "true", "false"):  # small ones are common
                self.take()
                return Literal(token.text.upper() == "TRUE", token.place)
            case TokenKind.NAME:
                return self.scoped_name("of a constant")
        if token.text == "::":
            return self.scoped_name("of a constant")
        raise self.unexpected("a constant, a number or '('")


def _integer(token: Token) -> int:
    text = token.text
    if text[:2] in ("0x", "0X"):
        return int(text, 16)
    if len(text) > 1 and text[0] == "0":
        if not set(text) <= set("01234567"):
            raise IdlError(token.place, f"'{text}' is octal, as it begins with 0, but has other digits")
        return int(text, 8)
    return int(text)


def _unescaped(token: Token) -> str:
    text = token.text.removeprefix("L")[1:-1]

    def character(found: re.Match[str]) -> str:
        code, hexadecimal, octal, other = found.groups()
        if code or hexadecimal:
            return chr(int(code or hexadecimal, 16))
        if octal:
            return chr(int(octal, 8))
        return _ESCAPED.get(other, other)

    return _ESCAPE.sub(character, text)
