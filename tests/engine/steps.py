"""Parse steps: what a datagram costs, counted and not timed, so that it is the same on every machine.

A step is one line of Python that is executed, in the stack or in what it calls: a loop over something a stranger chose
shows as many steps as it has turns, whatever the turns are made of.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from types import FrameType
from typing import Any

__all__ = ["steps_of"]


def steps_of(call: Callable[[], object]) -> int:
    """How many lines ``call`` executes."""
    count = 0

    def line(frame: FrameType, event: str, argument: Any) -> Any:
        nonlocal count
        if event == "line":
            count += 1
        return line

    before = sys.gettrace()
    sys.settrace(line)
    try:
        call()
    finally:
        sys.settrace(before)
    return count
