"""Protocol: how a side's program is started and what it prints.

``python -m MODULE ROLE '{"option": value}'``.  On standard output, JSON objects, one a line: ``{"ready": true}`` when
another process may talk to it, ``{"result": {name: number}}`` at its end.  It imports little, as sides are also
measured for their memory and import time.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Mapping
from typing import Any

__all__ = ["PAYLOAD_BYTE", "play", "say_ready", "summarise_round_trips"]

PAYLOAD_BYTE = b"\xa5"
Role = Callable[..., Mapping[str, float] | None]


def play(roles: Mapping[str, Role]) -> None:
    """Play the role that the command line names, with its options, and print what it returns."""
    role, options = sys.argv[1], json.loads(sys.argv[2])
    result = roles[role](**options)
    if result is not None:
        _say({"result": dict(result)})


def say_ready() -> None:
    _say({"ready": True})


def _say(words: dict[str, Any]) -> None:
    print(json.dumps(words), flush=True)


def summarise_round_trips(seconds: list[float], processor_s: float) -> dict[str, float]:
    """``median_us``, ``p99_us`` and the processor time of one of them."""
    ordered = sorted(seconds)
    return {
        "median_us": ordered[len(ordered) // 2] * 1e6,
        "p99_us": ordered[min(len(ordered) * 99 // 100, len(ordered) - 1)] * 1e6,
        "processor_us": processor_s / len(ordered) * 1e6,
    }
