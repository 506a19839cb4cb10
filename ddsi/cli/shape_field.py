"""The field of the shapes demo as characters: where each shape lies, in its colour.  Drawing only.

Everything about a shape may come from the network: a huge or far one is cut to the field before any work is done.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import groupby
from operator import itemgetter

from .shape_types import FIELD_HEIGHT, FIELD_WIDTH

__all__ = ["DrawnShape", "ShapeField"]

_CELL_RATIO = 2.0
"""A character is about twice as high as it is wide."""
_PALETTE = {
    "PURPLE": 93,
    "BLUE": 27,
    "RED": 196,
    "GREEN": 40,
    "YELLOW": 226,
    "CYAN": 51,
    "MAGENTA": 201,
    "ORANGE": 208,
}
"""Colours of the 256-colour palette."""
_OTHER_COLOUR = 250
_RESET = "\x1b[0m"
_Cell = tuple[int, str]
"""A colour (0: the terminal's own) and a character."""
_EMPTY: _Cell = (0, " ")
_SMALLEST_ROWS, _SMALLEST_COLUMNS = 3, 6


@dataclass(frozen=True, slots=True)
class DrawnShape:
    """A shape of a topic, its centre at (x, y)."""

    topic: str
    color: str
    x: int
    y: int
    size: int


class ShapeField:
    """A frame of at most ``columns`` by ``rows`` characters, itself included."""

    def __init__(self, columns: int, rows: int, *, colour: bool, blocks: bool) -> None:
        """``colour``: with ANSI colours; ``blocks``: with box drawing and full blocks, else ASCII letters."""
        height = max(rows - 2, _SMALLEST_ROWS)
        width = max(min(columns - 2, round(height * _CELL_RATIO * FIELD_WIDTH / FIELD_HEIGHT)), _SMALLEST_COLUMNS)
        self.height = min(height, max(round(width / _CELL_RATIO * FIELD_HEIGHT / FIELD_WIDTH), _SMALLEST_ROWS))
        self.width = width
        self._colour = colour
        self._blocks = blocks

    def lines(self, shapes: Iterable[DrawnShape]) -> list[str]:
        """The frame with the shapes in it, later ones above earlier ones."""
        cells = [[_EMPTY] * self.width for _ in range(self.height)]
        for shape in shapes:
            sign = self._sign(shape)
            for row, column in self._cells_of(shape):
                cells[row][column] = sign
        top, side, bottom = ("┌─┐", "│", "└─┘") if self._blocks else ("+-+", "|", "+-+")
        return [
            top[0] + top[1] * self.width + top[2],
            *(f"{side}{_joined(row)}{side}" for row in cells),
            bottom[0] + bottom[1] * self.width + bottom[2],
        ]

    def _sign(self, shape: DrawnShape) -> _Cell:
        first = shape.color[:1]
        letter = first if first.isascii() and first.isalnum() else "?"
        if not self._colour:
            return (0, letter)
        return (_PALETTE.get(shape.color.upper(), _OTHER_COLOUR), "█" if self._blocks else letter)

    def _cells_of(self, shape: DrawnShape) -> list[tuple[int, int]]:
        """The cells that the shape covers; at least the one where its centre is, if that lies in the field."""
        radius = min(max(shape.size, 1), 2 * FIELD_HEIGHT) / 2
        columns = self._range(shape.x - radius, shape.x + radius, FIELD_WIDTH, self.width)
        rows = self._range(shape.y - radius, shape.y + radius, FIELD_HEIGHT, self.height)
        covered = [
            (row, column)
            for row in rows
            for column in columns
            if _covers(
                shape.topic,
                (column + 0.5) * FIELD_WIDTH / self.width - shape.x,
                (row + 0.5) * FIELD_HEIGHT / self.height - shape.y,
                radius,
            )
        ]
        if covered or not (0 <= shape.x <= FIELD_WIDTH and 0 <= shape.y <= FIELD_HEIGHT):
            return covered
        centre_row = min(int(shape.y * self.height / FIELD_HEIGHT), self.height - 1)
        return [(centre_row, min(int(shape.x * self.width / FIELD_WIDTH), self.width - 1))]

    @staticmethod
    def _range(low: float, high: float, extent: int, cells: int) -> range:
        """The cells along one axis that [low, high] of the field touches."""
        start = max(math.floor(max(low, 0) * cells / extent), 0)
        end = min(math.ceil(min(high, extent) * cells / extent), cells)
        return range(start, end)


def _covers(topic: str, dx: float, dy: float, radius: float) -> bool:
    if topic == "Circle":
        return dx * dx + dy * dy <= radius * radius
    if topic == "Triangle":
        return abs(dy) <= radius and abs(dx) <= (dy + radius) / 2
    return abs(dx) <= radius and abs(dy) <= radius


def _joined(row: list[_Cell]) -> str:
    """A row's cells as text; a run of one colour has its escapes once."""
    runs = ((code, "".join(glyph for _, glyph in run)) for code, run in groupby(row, key=itemgetter(0)))
    return "".join(f"\x1b[38;5;{code}m{glyphs}{_RESET}" if code else glyphs for code, glyphs in runs)
