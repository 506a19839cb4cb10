"""Summary: from the values of the rounds to a median, a spread and a ratio."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from statistics import median

from .benchmark import Better, Figure

__all__ = ["Row", "Values", "summarise"]


@dataclass(frozen=True, slots=True)
class Values:
    """What one side reached, a value a round."""

    values: tuple[float, ...]

    @property
    def median(self) -> float:
        return median(self.values)

    @property
    def spread(self) -> float:
        """(highest - lowest) / median: 0.1 means that the rounds lay within a tenth of each other."""
        return (max(self.values) - min(self.values)) / self.median if self.median else 0.0


@dataclass(frozen=True, slots=True)
class Row:
    """One line of the table.  ``ratio`` is that of the medians, above 1 when we are better.

    ``ratio_low`` and ``ratio_high`` are the least and greatest of the ratios of single rounds: both sides of a
    round are measured one after the other, so that what slows the machine slows both.
    """

    figure: Figure
    sides: Mapping[str, Values]
    ratio: float | None = None
    ratio_low: float | None = None
    ratio_high: float | None = None
    notes: tuple[str, ...] = field(default=())


def summarise(figure: Figure, measured: Mapping[str, Sequence[float]], notes: tuple[str, ...] = ()) -> Row:
    """``measured``: per column the values of the rounds, in order; a side that gave none is left out."""
    sides = {column: Values(tuple(values)) for column, values in measured.items() if values}
    if "ours" not in sides or "peer" not in sides:
        return Row(figure, sides, notes=notes)
    ours, peer = sides["ours"], sides["peer"]
    rounds = [_ratio(figure, a, b) for a, b in zip(ours.values, peer.values, strict=False)]
    return Row(figure, sides, _ratio(figure, ours.median, peer.median), min(rounds), max(rounds), notes)


def _ratio(figure: Figure, ours: float, peer: float) -> float:
    if figure.better is Better.LOWER:
        ours, peer = peer, ours
    return ours / peer if peer else float("inf")
