"""Drawing shapes: where they are, and hostile ones at no cost."""

from __future__ import annotations

import random
import re

import pytest

from ddsi.cli.shape_field import DrawnShape, ShapeField
from ddsi.cli.shape_motion import MovingShape
from ddsi.cli.shape_types import FIELD_HEIGHT, FIELD_WIDTH


# 48 by 27 cells, each 5 by 10 of the field's units.
def _drawn(*shapes: DrawnShape, columns: int = 50, rows: int = 29) -> list[str]:
    return ShapeField(columns, rows, colour=False, blocks=False).lines(shapes)


def test_an_empty_field_is_a_frame() -> None:
    lines = _drawn()
    assert lines[0] == lines[-1] == f"+{'-' * 48}+"
    assert set(lines[1:-1]) == {f"|{' ' * 48}|"}
    assert len(lines) == 29


def test_the_field_keeps_its_proportions() -> None:
    """240 by 270, of characters twice as high as wide; within what there is."""
    for columns, rows in [(200, 25), (30, 80), (100, 40)]:
        field = ShapeField(columns, rows, colour=False, blocks=False)
        assert field.width <= columns - 2
        assert field.height <= rows - 2
        assert field.width / field.height == pytest.approx(2 * FIELD_WIDTH / FIELD_HEIGHT, rel=0.1)


def test_a_square_is_where_its_centre_says() -> None:
    lines = _drawn(DrawnShape("Square", "BLUE", 120, 135, 58))
    rows = [line[1:-1] for line in lines[1:-1]]
    marked = [(row, column) for row, line in enumerate(rows) for column, sign in enumerate(line) if sign == "B"]
    assert min(marked) == (11, 18)
    assert max(marked) == (15, 29)
    assert len(marked) == 5 * 12


def test_a_triangle_stands_on_its_base_and_a_circle_has_no_corners() -> None:
    triangle = [line.count("R") for line in _drawn(DrawnShape("Triangle", "RED", 120, 135, 120))]
    widths = [width for width in triangle if width]
    assert widths == sorted(widths)
    assert widths[0] < widths[-1]
    circle = [width for line in _drawn(DrawnShape("Circle", "GREEN", 120, 135, 120)) if (width := line.count("G"))]
    assert circle == circle[::-1]
    assert circle[0] < max(circle)


def test_the_later_shape_lies_above() -> None:
    lines = _drawn(DrawnShape("Square", "BLUE", 120, 135, 60), DrawnShape("Square", "RED", 120, 135, 60))
    assert not any("B" in line for line in lines)


def test_a_tiny_shape_is_still_seen() -> None:
    for x, y in [(0, 0), (FIELD_WIDTH, FIELD_HEIGHT), (7, 261)]:
        assert sum(line.count("B") for line in _drawn(DrawnShape("Square", "BLUE", x, y, 1))) >= 1


@pytest.mark.parametrize(
    "shape",
    [
        DrawnShape("Square", "BLUE", 2**31 - 1, -(2**31), 2**31 - 1),
        DrawnShape("Circle", "BLUE", -(2**31), 0, 30),
        DrawnShape("Triangle", "BLUE", 120, 135, -(2**31)),
        DrawnShape("Circle", "\x1b[2J", 120, 135, 2**31 - 1),
        DrawnShape("Circle", "", 120, 135, 30),
    ],
)
def test_what_a_stranger_sends_cannot_break_the_picture(shape: DrawnShape) -> None:
    lines = _drawn(shape)
    assert len(lines) == 29
    assert {len(line) for line in lines} == {50}
    assert not any("\x1b" in line for line in lines)


def test_colours_change_where_shapes_do() -> None:
    """A run of one colour has its escapes once."""
    lines = ShapeField(50, 29, colour=True, blocks=True).lines([DrawnShape("Square", "RED", 120, 135, 58)])
    coloured = [line for line in lines if "\x1b" in line]
    assert len(coloured) == 5
    assert all(line.count("\x1b[38;5;196m") == 1 and "█" * 12 in line for line in coloured)
    assert {len(re.sub(r"\x1b\[[0-9;]*m", "", line)) for line in lines} == {50}


@pytest.mark.parametrize("size", [1, 30, 239, 240, 5000])
def test_moving_shapes_stay_in_the_field(size: int) -> None:
    shape = MovingShape(size, random.Random(1))
    seen = set()
    for _ in range(500):
        shape.move()
        assert 0 <= shape.x <= FIELD_WIDTH
        assert 0 <= shape.y <= FIELD_HEIGHT
        seen.add((shape.x, shape.y))
    assert len(seen) > 20
