"""Numbers, ranges and foreign text as a trace's reader sees them.

Names and details may come from the network: what would move a terminal's cursor or switch its colours is replaced
before it gets there.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

__all__ = ["count_text", "number_ranges", "printable", "range_text", "seconds_text"]

_MAX_RANGES = 8
_MAX_NAME_CHARACTERS = 48


def printable(text: str, *, limit: int = _MAX_NAME_CHARACTERS) -> str:
    """``text`` on one line, of at most ``limit`` characters; whatever does not print is shown as ``?``."""
    shown = "".join(character if character.isprintable() else "?" for character in text[: limit + 1])
    return shown if len(shown) <= limit else shown[: limit - 1] + "…"


def count_text(count: int, noun: str) -> str:
    """``1 octet``, ``2 octets``."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def range_text(first: int, last: int) -> str:
    """``3..5``, or ``3`` where both are the same; both inclusive."""
    return str(first) if first == last else f"{first}..{last}"


def number_ranges(numbers: Iterable[int]) -> str:
    """Ascending numbers as a set of ranges: ``{4,6..9}``; beyond eight ranges only how many numbers follow."""
    ranges: list[list[int]] = []
    rest = 0
    for number in numbers:
        if ranges and not rest and number == ranges[-1][1] + 1:
            ranges[-1][1] = number
        elif len(ranges) < _MAX_RANGES:
            ranges.append([number, number])
        else:
            rest += 1
    shown = [range_text(first, last) for first, last in ranges]
    return f"{{{','.join((*shown, f'and {rest} more') if rest else shown)}}}"


def seconds_text(seconds: float) -> str:
    """``2.5 s``, ``3 ms``, ``infinite``."""
    if math.isinf(seconds):
        return "infinite"
    return f"{seconds:g} s" if abs(seconds) >= 1 or seconds == 0 else f"{round(seconds * 1000, 6):g} ms"
