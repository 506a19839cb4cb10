"""The drawing of one line."""

import pytest

from ddsi.trace.lanes import ASCII, Lanes, Stroke

LANES = Lanes(3, 6)


@pytest.mark.parametrize(
    ("drawn", "line"),
    [
        (LANES.head(["A", "B", "C"]), "A     B     C     "),
        (LANES.bars(), "│     │     │     "),
        (LANES.event(1), "│     ●     │     "),
        (LANES.arrow(0, [1]), "├────▶│     │     "),
        (LANES.arrow(1, [0]), "│◀────┤     │     "),
        (LANES.arrow(0, [2]), "├─────┼────▶│     "),
        (LANES.arrow(2, [0]), "│◀────┼─────┤     "),
        (LANES.arrow(0, [1, 2]), "├────▶│────▶│     "),
        (LANES.arrow(1, [0, 2]), "│◀────┼────▶│     "),
        (LANES.arrow(1, [1]), "│     ├──▶  │     "),
        (LANES.arrow(2, []), "│     │     ├──▶  "),
        (LANES.arrow(0, [1], stroke=Stroke.DOTTED), "├┄┄┄┄▶│     │     "),
        (LANES.lost(0, 1), "├┄┄✗  │     │     "),
        (LANES.lost(1, 0), "│  ✗┄┄┤     │     "),
        (LANES.lost(0, 2), "├┄┄┄┄┄┼┄┄✗  │     "),
        (LANES.lost(2, None), "│     │     ├┄┄✗  "),
        (Lanes(1, 6).arrow(0, []), "├──▶  "),
    ],
)
def test_lines(drawn: str, line: str) -> None:
    assert drawn == line


def test_every_character_has_an_ascii_form() -> None:
    drawn = LANES.arrow(1, [0, 2]) + LANES.lost(0, 1) + LANES.lost(2, 1) + LANES.event(0) + "…"
    assert drawn.translate(ASCII).isascii()
