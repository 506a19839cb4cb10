"""Lanes: one line of a sequence diagram, as characters in columns.

A participant is a bar; a message is an arrow from bar to bar.  Only drawing: who talks to whom is decided in
``sequence_diagram``.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from enum import StrEnum

__all__ = ["ASCII", "Lanes", "Stroke"]

_BAR, _EVENT, _LOST = "│", "●", "✗"
_LEAVES_RIGHT, _LEAVES_LEFT, _CROSSES = "├", "┤", "┼"
_HEAD_RIGHT, _HEAD_LEFT = "▶", "◀"
_STUB_ROOM = 6  # a stub of four characters, and two to keep it off the text
ASCII = str.maketrans("│●✗├┤┼▶◀─┄…", "|*x||+><-..")
"""For terminals and files that cannot show the others."""


class Stroke(StrEnum):
    """What the arrow is drawn with: whole for what goes through, dotted for what the network does to it."""

    WHOLE = "─"
    DOTTED = "┄"


@dataclass(frozen=True, slots=True)
class Lanes:
    """``count`` bars, ``pitch`` characters apart (5 at least, or arrows have no room), with room for a stub behind."""

    count: int
    pitch: int

    @property
    def width(self) -> int:
        return (self.count - 1) * self.pitch + _STUB_ROOM if self.count else 0

    def head(self, letters: list[str]) -> str:
        """The columns' names above their bars."""
        return "".join(letter.ljust(self.pitch) for letter in letters)[: self.width].ljust(self.width)

    def bars(self) -> str:
        """Nothing but the bars: for lines that go on with the text of the one before."""
        return "".join(self._bars())

    def event(self, column: int) -> str:
        """Something happened in one participant."""
        cells = self._bars()
        cells[column * self.pitch] = _EVENT
        return "".join(cells)

    def arrow(self, sender: int, receivers: Collection[int], *, stroke: Stroke = Stroke.WHOLE) -> str:
        """A message on its way to each of the receivers; a stub beside the sender where none of them has a column."""
        others = [column for column in receivers if column != sender]
        cells = self._bars()
        if not others:
            return self._stub(cells, sender, stroke, _HEAD_RIGHT)
        leftmost, rightmost = min(*others, sender), max(*others, sender)
        self._draw(cells, leftmost * self.pitch, rightmost * self.pitch, stroke)
        for column in others:
            at = column * self.pitch
            cells[at] = _BAR
            cells[at + 1 if column < sender else at - 1] = _HEAD_LEFT if column < sender else _HEAD_RIGHT
        goes_left, goes_right = leftmost < sender, rightmost > sender
        leaves = _CROSSES if goes_left and goes_right else _LEAVES_LEFT if goes_left else _LEAVES_RIGHT
        cells[sender * self.pitch] = leaves
        return "".join(cells)

    def lost(self, sender: int, receiver: int | None) -> str:
        """A message that ends just before the receiver, or just beside the sender if that is unknown."""
        cells = self._bars()
        if receiver is None or receiver == sender:
            return self._stub(cells, sender, Stroke.DOTTED, _LOST)
        half = self.pitch // 2
        start, end = sender * self.pitch, receiver * self.pitch + (half if receiver < sender else -half)
        self._draw(cells, min(start, end), max(start, end), Stroke.DOTTED)
        cells[start] = _LEAVES_RIGHT if end > start else _LEAVES_LEFT
        cells[end] = _LOST
        return "".join(cells)

    def _stub(self, cells: list[str], sender: int, stroke: Stroke, end: str) -> str:
        at = sender * self.pitch
        cells[at : at + 4] = [_LEAVES_RIGHT, stroke, stroke, end]
        return "".join(cells)

    def _draw(self, cells: list[str], first: int, last: int, stroke: Stroke) -> None:
        for at in range(first, last + 1):
            cells[at] = stroke if cells[at] == " " else _CROSSES

    def _bars(self) -> list[str]:
        cells = [" "] * self.width
        for column in range(self.count):
            cells[column * self.pitch] = _BAR
        return cells
