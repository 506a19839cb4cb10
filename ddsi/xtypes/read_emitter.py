"""Lines of code that take a sample's octets apart: runs, positions, what waits for a run.

Consecutive items of fixed size become one *run*, a single ``unpack_from``.  Statements that use the run's names
are held back until the run is complete.  Positions are indices into the payload ``d``, as a variable and a
constant; alignment counts from an origin (the payload's body, or in XCDR1 the value of a parameter), which is
a multiple of 4, so that it matters to alignment 8 alone.

This module knows no types; ``read_source.py`` drives it.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from .layout import Encoding, Residue
from .source import Source

__all__ = ["ReadEmitter"]


class ReadEmitter:
    """The state of one function being generated."""

    def __init__(self, source: Source, encoding: Encoding, *, base: str, offset: int, residue: Residue) -> None:
        self.source = source
        self.encoding = encoding
        self.origin = "4"
        self.residue = residue
        self._base = base
        self._offset = offset
        self._run: list[tuple[str, str]] = []
        self._run_start = 0
        self._held: list[str] = []

    # --- position --------------------------------------------------------------------------------------

    @property
    def position(self) -> str:
        """The expression of the index of the next octet."""
        return self.position_after(0)

    def position_after(self, octets: int) -> str:
        return self._at(self._offset + octets)

    def _at(self, offset: int) -> str:
        if not self._base:
            return str(offset)
        return f"{self._base} + {offset}" if offset > 0 else f"{self._base} - {-offset}" if offset else self._base

    def move(self, base: str, residue: Residue) -> None:
        """Go on at an index that a variable holds."""
        self.flush()
        self._base, self._offset, self.residue = base, 0, residue

    def align(self, alignment: int) -> None:
        padding = self.residue.padding(alignment)
        if padding is not None:
            if padding:
                if self._run:
                    self._run.append((f"{padding}x", ""))
                self._advance(padding)
            return
        self.flush()
        name = self.source.fresh("p")
        if alignment < 8:
            self.source.line(f"{name} = {self.position_after(alignment - 1)} & -{alignment}")
        else:
            self.source.line(f"{name} = {self.position} + (-({self.position} - {self.origin}) & 7)")
        self.move(name, self.residue.align(alignment))

    def _advance(self, octets: int) -> None:
        self._offset += octets
        self.residue = self.residue.advance(octets)

    # --- items and statements ----------------------------------------------------------------------------

    def item(self, code: str, size: int, prefix: str = "r") -> str:
        """The name under which the next item is found once the run is complete; the caller has aligned."""
        if not self._run:
            self._run_start = self._offset
        name = self.source.fresh(prefix)
        self._run.append((code, name))
        self._advance(size)
        return name

    def pass_over(self, octets: int) -> None:
        """Octets that nobody wants; inside a run they are part of it."""
        if self._run:
            self._run.append((f"{octets}x", ""))
        self._advance(octets)

    def skip(self, octets: int) -> None:
        """Octets that were read otherwise."""
        self.flush()
        self._advance(octets)

    def then(self, line: str) -> None:
        """A statement that may use the names of the run."""
        if self._run:
            self._held.append(line)
        else:
            self.source.line(line)

    def refuse(self, condition: str) -> None:
        """Leave the straight path when the octets are not as this type's own writer makes them."""
        self.then(f"if {condition}: raise ValueError")

    def flush(self) -> None:
        """Complete the run: emit its ``unpack`` and the statements that waited for it."""
        if self._run:
            codes, names = self.take_run()
            unpack = self.source.unpacker(self.encoding.order + codes)
            self.source.line(f"{', '.join(names)}, = {unpack}(d, {self._at(self._run_start)})")
        self.emit_held()

    def take_run(self) -> tuple[str, list[str]]:
        """(codes, names) of the run so far, for a caller that unpacks it in its own way."""
        while self._run and not self._run[-1][1]:
            self._run.pop()
        run, self._run = self._run, []
        return "".join(code for code, _ in run), [name for _, name in run if name]

    def emit_held(self) -> None:
        held, self._held = self._held, []
        for line in held:
            self.source.line(line)

    # --- control flow ------------------------------------------------------------------------------------

    @contextmanager
    def loop(self, head: str, residue: Residue) -> Iterator[None]:
        """The body runs any number of times; at its start and behind the loop the position has ``residue``."""
        self.flush()
        name = self.source.fresh("p")
        self.source.line(f"{name} = {self.position}")
        self.move(name, residue)
        with self.source.block(head):
            yield
            self.flush()
            self.source.line(f"{name} = {self.position}")
        self.move(name, residue)

    @contextmanager
    def branches(self) -> Iterator[ReadBranches]:
        """Alternatives, each inside :meth:`ReadBranches.branch`."""
        self.flush()
        alternatives = ReadBranches(self)
        yield alternatives
        self.move(alternatives.name, alternatives.residue())


class ReadBranches:
    """The arms of one ``if``; every arm leaves the position in the same variable."""

    def __init__(self, emitter: ReadEmitter) -> None:
        self._emitter = emitter
        self._start = (emitter._base, emitter._offset, emitter.residue, emitter.origin)
        self.name = emitter.source.fresh("p")
        self._residues: list[Residue] = []

    @contextmanager
    def branch(self, head: str) -> Iterator[None]:
        emitter = self._emitter
        emitter._base, emitter._offset, emitter.residue, emitter.origin = self._start
        with emitter.source.block(head):
            yield
            emitter.flush()
            emitter.source.line(f"{self.name} = {emitter.position}")
        self._residues.append(emitter.residue)
        emitter.origin = self._start[3]

    def residue(self) -> Residue:
        residue = self._residues[0]
        for other in self._residues[1:]:
            residue = residue.meet(other)
        return residue
