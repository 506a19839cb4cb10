"""LIKE: does a text fit a pattern?  ``%`` stands for any characters, ``_`` for one.  DDS 1.4 Annex B.3.

Patterns come from strangers, so the time is bounded: a pattern is cut at its ``%`` into parts, each of which is looked
for once, behind the one before it.  A regular expression with several ``.*`` could try all ways to divide the text.
"""

from __future__ import annotations

import re
from collections.abc import Callable

from .syntax import InvalidExpression

__all__ = ["like"]

MAX_PATTERN = 1024


def like(pattern: str) -> Callable[[str], bool]:
    """The test for one pattern.  Raises InvalidExpression for one of more than 1024 characters."""
    if len(pattern) > MAX_PATTERN:
        raise InvalidExpression(f"a pattern of {len(pattern)} characters; {MAX_PATTERN} at most")
    first, *others = pattern.split("%")
    begins = _part(first)
    if not others:
        return lambda text: begins.fullmatch(text) is not None
    *between, last = others
    middle = [_part(part) for part in between if part]
    ends, end_length = _part(last), len(last)

    def fits(text: str) -> bool:
        beginning = begins.match(text)
        if beginning is None:
            return False
        position, end = beginning.end(), len(text) - end_length
        for part in middle:
            found = part.search(text, position, max(end, position))
            if found is None:
                return False
            position = found.end()
        return end >= position and ends.fullmatch(text, end) is not None

    return fits


def _part(part: str) -> re.Pattern[str]:
    """Characters that stand for themselves, and ``_``: every match is as long as the part."""
    return re.compile("".join("." if character == "_" else re.escape(character) for character in part), re.DOTALL)
