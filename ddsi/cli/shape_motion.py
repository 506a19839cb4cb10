"""How shapes move: each on its own way through the field, turned back at the edges."""

from __future__ import annotations

import random

from .shape_types import FIELD_HEIGHT, FIELD_WIDTH

__all__ = ["MovingShape"]

_FASTEST = 6


class MovingShape:
    """``x`` and ``y``: where its centre is now; ``size`` its width and height."""

    def __init__(self, size: int, chance: random.Random) -> None:
        self.size = size
        self._margin = min(size, FIELD_WIDTH - 2) // 2
        self.x = chance.randint(self._margin, FIELD_WIDTH - self._margin)
        self.y = chance.randint(self._margin, FIELD_HEIGHT - self._margin)
        self._dx = chance.choice((-1, 1)) * chance.randint(2, _FASTEST)
        self._dy = chance.choice((-1, 1)) * chance.randint(2, _FASTEST)

    def move(self) -> None:
        """One step."""
        self.x, self._dx = _step(self.x, self._dx, self._margin, FIELD_WIDTH - self._margin)
        self.y, self._dy = _step(self.y, self._dy, self._margin, FIELD_HEIGHT - self._margin)


def _step(position: int, velocity: int, low: int, high: int) -> tuple[int, int]:
    position += velocity
    if position < low:
        return min(2 * low - position, high), abs(velocity)
    if position > high:
        return max(2 * high - position, low), -abs(velocity)
    return position, velocity
