"""Dice: all chance in a simulation, from one seed.

``random.Random`` promises the same numbers on every Python version for ``random()`` and ``getrandbits()`` alone; its
other methods have changed over time.  A seed must replay for years, so everything here is made of these two.
"""

from __future__ import annotations

from collections.abc import Sequence
from random import Random
from typing import TypeVar

__all__ = ["Dice"]

_T = TypeVar("_T")


class Dice:
    """A stream of chances.  Same seed, same stream."""

    __slots__ = ("_random",)

    def __init__(self, seed: int) -> None:
        self._random = Random(seed)

    def chance(self, probability: float) -> bool:
        """True with this probability.  Where it is 0 or 1 nothing is drawn, so that a feature which is off leaves
        the rest of the run as it was."""
        if probability <= 0.0:
            return False
        return probability >= 1.0 or self._random.random() < probability

    def between(self, low: float, high: float) -> float:
        """A number from ``low`` to ``high``; nothing is drawn where they are equal."""
        return low if high <= low else low + (high - low) * self._random.random()

    def below(self, end: int) -> int:
        """A whole number from 0 to ``end`` (exclusive)."""
        return int(self._random.random() * end)

    def pick(self, options: Sequence[_T]) -> _T:
        return options[self.below(len(options))]

    def octets(self, count: int) -> bytes:
        return self._random.getrandbits(8 * count).to_bytes(count, "big") if count else b""

    def fork(self) -> Dice:
        """Dice of their own for one part of the simulation, so that parts do not disturb each other."""
        return Dice(self._random.getrandbits(64))

    def fork_random(self) -> Random:
        """The same for an engine, which takes a ``Random``."""
        return Random(self._random.getrandbits(64))
