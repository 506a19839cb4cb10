"""Lines of code that gather the octets of a sample: runs, parts, positions, deferred lengths.

The generated function collects *parts* (objects with octets) and joins them once.  Consecutive items of fixed size,
padding included, become one *run*: a single ``Struct.pack``.  A length that is known only later, such as a
delimiter, is a *deferred* name inside a run; the run is evaluated after the name has its value, which costs nothing
as long as no loop or branch comes between.  There the parts so far go into a list, and a run that still
waits leaves its place free and fills it later.

This module knows no types; ``write_source.py`` drives it.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

from ..structure.dataclass import dataclass
from .layout import ALIGNED, UNKNOWN, Encoding, Residue
from .source import Source
from .stride import Stride

__all__ = ["Position", "WriteEmitter"]


@dataclass(frozen=True, slots=True)
class Position:
    """Where the next octet goes, counted from the origin of alignment: a sum of expressions, and its residue."""

    terms: tuple[str, ...] = ()
    offset: int = 0
    residue: Residue = ALIGNED

    def advance(self, octets: int) -> Position:
        return replace(self, offset=self.offset + octets, residue=self.residue.advance(octets))

    def __str__(self) -> str:
        offset = [str(self.offset)] if self.offset or not self.terms else []
        return " + ".join([*self.terms, *offset])

    def minus(self, start: Position) -> str:
        """The expression of the distance from ``start`` to here."""
        terms = list(self.terms)
        missing = []
        for term in start.terms:
            if term in terms:
                terms.remove(term)
            else:
                missing.append(f" - {term}")
        offset = self.offset - start.offset
        positive = str(Position(tuple(terms), offset)) if offset >= 0 else f"{' + '.join(terms) or '0'} - {-offset}"
        return positive + "".join(missing)


@dataclass(slots=True)
class _Part:
    expression: str
    waits_for: set[str]


class WriteEmitter:
    """The state of one function being generated."""

    def __init__(self, source: Source, encoding: Encoding, position: Position, *, listed: bool) -> None:
        self.source = source
        self.encoding = encoding
        self.position = position
        self._run: list[tuple[str, str]] = []
        self._run_waits_for: set[str] = set()
        self._parts: list[_Part] = []
        self._listed = listed
        self._unresolved: set[str] = set()
        self._places: list[tuple[str, _Part]] = []

    # --- items and parts ---------------------------------------------------------------------------------

    def align(self, alignment: int) -> None:
        padding = self.position.residue.padding(alignment)
        if padding is None:
            self._align_when_run(alignment)
        elif padding:
            self.pad(padding)

    def pad(self, octets: int) -> None:
        """Zero octets, a known number of them.  The NUL behind a string is one too."""
        self._run.append((f"{octets}x", ""))
        self.position = self.position.advance(octets)

    def item(self, code: str, size: int, expression: str) -> None:
        """One item for ``struct``; the caller has aligned."""
        self._run.append((code, expression))
        self._run_waits_for |= self._unresolved & {expression}
        self.position = self.position.advance(size)

    def uncounted(self, code: str, expression: str) -> None:
        """An item before the origin of alignment: the encapsulation header."""
        self._run.append((code, expression))
        self._run_waits_for |= self._unresolved & {expression}

    def part(self, expression: str, octets: str, residue: Residue) -> None:
        """An object whose octets go as they are; ``octets`` is the expression of their number."""
        self._end_run()
        self._parts.append(_Part(expression, set()))
        self.position = Position((*self.position.terms, octets), self.position.offset, residue)

    def _align_when_run(self, alignment: int) -> None:
        zeros = 0
        while self._run and not self._run[-1][1]:
            zeros += int(self._run.pop()[0][:-1])
        self._end_run()
        terms, offset = self.position.terms, self.position.offset
        table = tuple(bytes(zeros + -(offset + rest) % alignment) for rest in range(alignment))
        table_name = self.source.define("ZEROS_", repr(table))
        name = self.source.fresh("z")
        self.source.line(f"{name} = {table_name}[{_parenthesised(terms)} & {alignment - 1}]")
        self._parts.append(_Part(name, set()))
        residue = self.position.residue.align(alignment)
        self.position = Position((*terms, f"len({name})"), offset - zeros, residue)

    def _end_run(self) -> None:
        if not self._run:
            return
        expressions = [expression for _, expression in self._run if expression]
        codes = "".join(code for code, _ in self._run)
        if expressions:
            pack = self.source.packer(self.encoding.order + codes)
            expression = f"{pack}({', '.join(expressions)})"
        else:
            expression = repr(bytes(sum(int(code[:-1]) for code, _ in self._run)))
        self._parts.append(_Part(expression, self._run_waits_for))
        self._run, self._run_waits_for = [], set()

    # --- deferred lengths --------------------------------------------------------------------------------

    def defer(self, prefix: str) -> str:
        """A name that items may use before :meth:`resolve` gives its value."""
        name = self.source.fresh(prefix)
        self._unresolved.add(name)
        return name

    def resolve(self, name: str, expression: str) -> None:
        self._unresolved.discard(name)
        self._run_waits_for.discard(name)
        self.source.line(f"{name} = {expression}")
        for part in self._parts:
            part.waits_for.discard(name)
        for place, part in list(self._places):
            if name in part.waits_for:
                part.waits_for.discard(name)
                if not part.waits_for:
                    self.source.line(f"parts[{place}] = {part.expression}")
                    self._places.remove((place, part))

    # --- the list of parts -------------------------------------------------------------------------------

    def flush(self) -> None:
        """Put the parts so far into the list: control flow comes next."""
        self._end_run()
        if not self._listed:
            self.source.line("parts = []")
            self._listed = True
        ready: list[str] = []
        for part in self._parts:
            if part.waits_for:
                self._append(ready)
                ready = []
                place = self.source.fresh("i")
                self.source.line(f"{place} = len(parts)")
                self.source.line('parts.append(b"")')
                self._places.append((place, part))
            else:
                ready.append(part.expression)
        self._append(ready)
        self._parts = []

    def _append(self, expressions: list[str]) -> None:
        if len(expressions) == 1:
            self.source.line(f"parts.append({expressions[0]})")
        elif expressions:
            self.source.line(f"parts += ({', '.join(expressions)})")

    def joined(self) -> str:
        """The expression of all octets, at the end of the function."""
        self._end_run()
        assert not self._unresolved, self._unresolved
        if self._listed:
            self.flush()
            return 'b"".join(parts)'
        if len(self._parts) == 1:
            return self._parts[0].expression
        return f'b"".join(({", ".join(part.expression for part in self._parts)}))' if self._parts else 'b""'

    # --- control flow ------------------------------------------------------------------------------------

    @contextmanager
    def loop(self, head: str, residue: Residue) -> Iterator[None]:
        """The body runs any number of times; at its start and behind the loop the position has ``residue``."""
        self.flush()
        name = self.source.fresh("p")
        self.source.line(f"{name} = {self.position}")
        self.position = Position((name,), 0, residue)
        with self.source.block(head):
            yield
            self.flush()
            self.source.line(f"{name} = {self.position}")
        self.position = Position((name,), 0, residue)

    @contextmanager
    def repeat(self, head: str, count: str, step: Stride) -> Iterator[None]:
        """The body runs ``count`` times and writes one element: a loop that need not know where it is."""
        self.flush()
        start = self.position
        self.position = Position((), 0, step.residue)
        with self.source.block(head):
            yield
            if step.gap:
                self.pad(step.gap)
            self.flush()
        octets = f"{count} * {step.octets}"
        if step.gap:  # behind the last element there is none
            condition = "" if count.isdecimal() else f"if {count}"
            self.source.line(f"{condition}{condition and ': '}parts[-1] = parts[-1][:-{step.gap}]")
            octets = f"({octets} - {step.gap}{condition and f' {condition} else 0'})"
        self.position = Position((*start.terms, octets), start.offset, step.behind(start.residue, count))

    @contextmanager
    def branches(self) -> Iterator[Branches]:
        """Alternatives, each inside :meth:`Branches.branch`; behind them only what holds of all is known."""
        self.flush()
        alternatives = Branches(self)
        yield alternatives
        self.position = alternatives.end()

    def call(self, function: str, value: str, depth: str) -> None:
        """Let another generated function write ``value`` into the list."""
        self.flush()
        name = self.source.fresh("p")
        self.source.line(f"{name} = {function}({value}, parts, {self.position}, {depth})")
        self.position = Position((name,), 0, UNKNOWN)


class Branches:
    """The arms of one ``if``; every arm leaves the position in the same variable."""

    def __init__(self, emitter: WriteEmitter) -> None:
        self._emitter = emitter
        self._start = emitter.position
        self._name = emitter.source.fresh("p")
        self._residues: list[Residue] = []

    @contextmanager
    def branch(self, head: str) -> Iterator[None]:
        emitter = self._emitter
        emitter.position = self._start
        with emitter.source.block(head):
            yield
            emitter.flush()
            emitter.source.line(f"{self._name} = {emitter.position}")
        self._residues.append(emitter.position.residue)

    def end(self) -> Position:
        residue = self._residues[0]
        for other in self._residues[1:]:
            residue = residue.meet(other)
        return Position((self._name,), 0, residue)


def _parenthesised(terms: tuple[str, ...]) -> str:
    if not terms:
        return "0"
    return terms[0] if len(terms) == 1 else f"({' + '.join(terms)})"
