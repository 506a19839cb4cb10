"""The preprocessor: files to the tokens that the parser sees (OMG IDL 4.2 §7.3, ISO C as far as IDL files use it).

``#include`` in both forms, ``#define`` with and without parameters, ``#undef``, ``#if`` and its family, ``#error``,
``#pragma once``; other pragmas reach the parser as one token.  Whatever a file says, includes, macros, conditions and
tokens are bounded; beyond that it is refused.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path

from .conditions import evaluate_condition
from .macros import Macro, arguments_of, macro_of, replacement
from .source_text import IdlError, IdlWarning, Place, SourceText
from .tokens import Token, TokenKind, refuse_odd, tokenize

__all__ = ["Preprocessor"]

DEEPEST_INCLUDE = 32
MOST_INCLUDES = 2_000
DEEPEST_CONDITION = 256
MOST_TOKENS = 500_000
"""Of all files together: more than any real file has."""
MOST_EXPANDED = 100_000
"""Of all macros together."""
LONGEST_CALL = 10_000
DEEPEST_CALL = 50
LARGEST_FILE = 1 << 22
MOST_OCTETS = 1 << 24
"""Of all files together, each as often as it is included."""


@dataclass(slots=True)
class _Condition:
    """One ``#if`` that is open."""

    place: Place
    is_active: bool
    """It holds, and so do all around it."""
    was_active: bool
    """Some branch was taken already."""
    in_else: bool = False


class Preprocessor:
    """Reads one file and all that it includes.  ``warnings`` grow meanwhile."""

    def __init__(self, include: Sequence[Path], defines: Mapping[str, str]) -> None:
        self._include = include
        self._macros = {name: _macro_given(name, value) for name, value in defines.items()}
        self._once: set[Path] = set()
        self._includes = 0
        self._tokens = 0
        self._octets = 0
        self._expanded = 0
        self.warnings: list[IdlWarning] = []

    def tokens(self, source: SourceText, path: Path | None = None) -> list[Token]:
        """The tokens of ``source`` after preprocessing, the end as the last.  ``path`` is where it was read."""
        found = list(map(refuse_odd, self._file(source, path, depth=0)))
        return [*found, Token(TokenKind.END, "", Place(source, len(source.text)))]

    # --- files and lines ---------------------------------------------------------------------------------

    def _file(self, source: SourceText, path: Path | None, *, depth: int) -> Iterator[Token]:
        conditions: list[_Condition] = []
        pending: deque[Token] = deque()
        opened: int | None = None
        for line in self._lines(source):
            if line[0].text == "#" and line[0].starts_line:
                yield from self._expand(pending)
                yield from self._directive(line, conditions, path, depth)
            elif _is_active(conditions):
                opened = self._opened(line, opened if pending else None)
                pending.extend(line)
                if opened is None:
                    yield from self._expand(pending)
                elif len(pending) > LONGEST_CALL:
                    raise IdlError(line[0].place, f"the arguments of a macro have more than {LONGEST_CALL} tokens")
        yield from self._expand(pending)
        if conditions:
            raise IdlError(conditions[-1].place, "this condition has no #endif")

    def _lines(self, source: SourceText) -> Iterator[list[Token]]:
        line: list[Token] = []
        for token in tokenize(source):
            if token.starts_line and line:
                yield line
                line = []
            if token.kind is not TokenKind.END:
                self._tokens += 1
                if self._tokens > MOST_TOKENS:
                    raise IdlError(token.place, f"there are more than {MOST_TOKENS} tokens in all files")
                line.append(token)

    def _directive(
        self, line: list[Token], conditions: list[_Condition], path: Path | None, depth: int
    ) -> Iterator[Token]:
        hash_, words = line[0], line[1:]
        name = words[0].text if words else ""
        arguments = words[1:]
        if name in ("if", "ifdef", "ifndef", "elif", "else", "endif"):
            self._conditional(name, hash_.place, arguments, conditions)
            return
        if not _is_active(conditions):
            return
        match name:
            case "include":
                yield from self._included(hash_.place, arguments, path, depth)
            case "define":
                self._define(hash_.place, arguments)
            case "undef":
                self._macros.pop(_one_name(hash_.place, arguments, "#undef").text, None)
            case "pragma":
                yield from self._pragma(hash_, arguments, path)
            case "error":
                raise IdlError(hash_.place, f"#error {' '.join(token.text for token in arguments)}")
            case "warning":
                text = " ".join(token.text for token in arguments)
                self.warnings.append(IdlWarning(hash_.place, f"#warning {text}"))
            case "line" | "ident" | "":
                pass  # the places are ours
            case _ if words[0].kind is TokenKind.INTEGER:
                pass  # what a C preprocessor leaves behind: # 12 "file.idl"
            case _:
                raise IdlError(words[0].place, f"the directive #{name} is unknown")

    # --- conditions --------------------------------------------------------------------------------------

    def _conditional(self, name: str, place: Place, arguments: list[Token], conditions: list[_Condition]) -> None:
        if name in ("if", "ifdef", "ifndef"):
            if len(conditions) >= DEEPEST_CONDITION:
                raise IdlError(place, f"conditions nest deeper than {DEEPEST_CONDITION}")
            holds = _is_active(conditions) and self._holds(name, place, arguments)
            conditions.append(_Condition(place, holds, holds))
            return
        if not conditions:
            raise IdlError(place, f"#{name} without an #if before it")
        condition = conditions[-1]
        if name == "endif":
            conditions.pop()
            return
        if condition.in_else:
            raise IdlError(place, f"#{name} behind the #else of the same condition")
        condition.in_else = name == "else"
        reached = _is_active(conditions[:-1]) and not condition.was_active
        condition.is_active = reached and (name == "else" or self._holds("if", place, arguments))
        condition.was_active = condition.was_active or condition.is_active

    def _holds(self, name: str, place: Place, arguments: list[Token]) -> bool:
        if name != "if":
            defined = _one_name(place, arguments, f"#{name}").text in self._macros
            return defined == (name == "ifdef")
        return evaluate_condition(list(self._expand(deque(self._without_defined(arguments)))), place)

    def _without_defined(self, tokens: list[Token]) -> Iterator[Token]:
        """``defined NAME`` and ``defined(NAME)`` as 1 or 0, before macros are expanded."""
        index = 0
        while index < len(tokens):
            token = tokens[index]
            index += 1
            if token.text != "defined":
                yield token
                continue
            names = [following.text for following in tokens[index : index + 3]]
            if len(names) == 3 and names[0] == "(" and names[2] == ")":
                name, index = names[1], index + 3
            elif names and tokens[index].kind is TokenKind.NAME:
                name, index = names[0], index + 1
            else:
                raise IdlError(token.place, "expected a name behind 'defined'")
            yield replace(token, kind=TokenKind.INTEGER, text=str(int(name in self._macros)))

    # --- includes and pragmas ----------------------------------------------------------------------------

    def _included(self, place: Place, arguments: list[Token], path: Path | None, depth: int) -> Iterator[Token]:
        arguments = arguments if arguments[:1] and arguments[0].text == "<" else list(self._expand(deque(arguments)))
        name, is_quoted = _included_name(place, arguments)
        self._includes += 1
        if depth >= DEEPEST_INCLUDE:
            raise IdlError(place, f"includes nest deeper than {DEEPEST_INCLUDE}; does a file include itself?")
        if self._includes > MOST_INCLUDES:
            raise IdlError(place, f"there are more than {MOST_INCLUDES} includes")
        found = self._find(place, name, path, is_quoted=is_quoted)
        if found.resolve() in self._once:
            return
        source = read_source(found, place)
        self._octets += len(source.text)
        if self._octets > MOST_OCTETS:
            raise IdlError(place, f"all included files together have more than {MOST_OCTETS} octets")
        yield from self._file(source, found, depth=depth + 1)

    def _find(self, place: Place, name: str, path: Path | None, *, is_quoted: bool) -> Path:
        own = [path.parent] if path is not None else []
        folders = [*own, *self._include] if is_quoted else [*self._include, *own]
        for folder in folders:
            candidate = folder / name
            if candidate.is_file():
                return candidate
        looked = ", ".join(map(str, folders)) or "no folder; give include="
        raise IdlError(place, f"the file {name!r} is not found; looked in {looked}")

    def _pragma(self, hash_: Token, arguments: list[Token], path: Path | None) -> Iterator[Token]:
        words = [token.text for token in arguments]
        if words[:1] == ["once"] and path is not None:
            self._once.add(path.resolve())
        elif words:
            yield Token(TokenKind.PRAGMA, " ".join(words), hash_.place)

    def _opened(self, line: list[Token], opened: int | None) -> int | None:
        """How many parentheses of a macro's call are open behind the line; None where the line ends no call early.

        ``opened`` is what the line before said.  0: a call's name came last, its arguments may follow.
        """
        start = 0
        if opened is None:
            calls = (index for index, token in enumerate(line) if self._takes_parameters(token))
            first = next(calls, None)
            if first is None:
                return None
            start, opened = first + 1, 0
            if start == len(line):
                return 0
        for token in line[start:]:
            opened += {"(": 1, ")": -1}.get(token.text, 0)
        return opened if opened > 0 else None

    def _takes_parameters(self, token: Token) -> bool:
        macro = self._macros.get(token.text) if token.kind is TokenKind.NAME else None
        return macro is not None and macro.parameters is not None

    # --- macros ------------------------------------------------------------------------------------------

    def _define(self, place: Place, arguments: list[Token]) -> None:
        if not arguments or arguments[0].kind is not TokenKind.NAME:
            raise IdlError(arguments[0].place if arguments else place, "expected a name behind #define")
        self._macros[arguments[0].text] = macro_of(arguments[0], arguments[1:])

    def _expand(self, pending: deque[Token], depth: int = 0) -> Iterator[Token]:
        """Expand macros in ``pending``, which is empty afterwards.

        What a macro gave is looked at again, with a mark of where the macro's text ends: until then the macro's own
        name stands for itself.
        """
        hidden: dict[str, int] = {}
        ends: deque[tuple[int, str]] = deque()
        while pending:
            while ends and len(pending) < ends[-1][0]:
                hidden[ends.pop()[1]] -= 1
            token = pending.popleft()
            macro = self._macros.get(token.text) if token.kind is TokenKind.NAME else None
            if macro is None or hidden.get(token.text, 0):
                yield token
                continue
            arguments: list[list[Token]] = []
            if macro.parameters is not None:
                if not pending or pending[0].text != "(":
                    yield token
                    continue
                if depth >= DEEPEST_CALL:
                    raise IdlError(token.place, f"calls of macros nest deeper than {DEEPEST_CALL}")
                arguments = arguments_of(token, pending)
            body = replacement(token, macro, arguments, lambda argument: list(self._expand(deque(argument), depth + 1)))
            after = len(pending)
            placed = [
                Token(part.kind, part.text, token.place, spaced=part.spaced)
                for part in islice(body, MOST_EXPANDED + 1 - self._expanded)
            ]
            if placed:
                placed[0].comment = token.comment
            self._expanded += max(len(placed), len(macro.body)) + 1  # empty arguments leave nothing of much work
            if self._expanded > MOST_EXPANDED:
                raise IdlError(token.place, f"the macros expand to more than {MOST_EXPANDED} tokens")
            pending.extendleft(reversed(placed))
            hidden[token.text] = hidden.get(token.text, 0) + 1
            ends.append((after + 1, token.text))


def read_source(path: Path, place: Place | None = None) -> SourceText:
    """The text of a file; ``place`` is that of the include.  IdlError, or OSError without a place."""
    try:
        with path.open("rb") as file:
            octets = file.read(LARGEST_FILE + 1)
    except OSError as error:
        if place is None:
            raise
        raise IdlError(place, f"{path} cannot be read: {error.strerror or error}") from error
    source = SourceText(str(path), octets[:LARGEST_FILE].decode("utf-8-sig", "replace").replace("\r\n", "\n"))
    if len(octets) > LARGEST_FILE:
        raise IdlError(place or Place(source, 0), f"{path} has more than {LARGEST_FILE} octets")
    return source


def _macro_given(name: str, value: str) -> Macro:
    """One of ``defines``."""
    source = SourceText(f"<definition of {name}>", str(value))
    named = Token(TokenKind.NAME, name, Place(source, 0))
    body = [token for token in tokenize(source) if token.kind is not TokenKind.END]
    if body:
        body[0].spaced = True  # it has no parameters
    return macro_of(named, body)


def _one_name(place: Place, arguments: list[Token], directive: str) -> Token:
    if not arguments or arguments[0].kind is not TokenKind.NAME:
        raise IdlError(arguments[0].place if arguments else place, f"expected a name behind {directive}")
    return arguments[0]


def _included_name(place: Place, arguments: list[Token]) -> tuple[str, bool]:
    """(name, whether it was quoted)."""
    if arguments and arguments[0].kind is TokenKind.STRING and not arguments[0].text.startswith("L"):
        return arguments[0].text[1:-1], True
    if arguments and arguments[0].text == "<":
        opened = arguments[0].place
        line = opened.source.line_at(opened.offset)[opened.column :]
        if ">" in line:
            return line[: line.index(">")].strip(), False
    raise IdlError(arguments[0].place if arguments else place, 'expected "file" or <file> behind #include')


def _is_active(conditions: Sequence[_Condition]) -> bool:
    return not conditions or conditions[-1].is_active
