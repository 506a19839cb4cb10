"""The time of day, for those who may not look at a clock themselves: the engine, the plugins, commands of packages."""

from __future__ import annotations

import time

__all__ = ["wall_clock"]


def wall_clock() -> int:
    """Nanoseconds since 1970, UTC."""
    return time.time_ns()
