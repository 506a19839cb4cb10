"""Values as Cyclone's files write them: ``10 s``, ``64 kB``, ``true``.  Whoever cannot read one raises ValueError with
what it takes.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping

__all__ = ["parse_boolean", "parse_duration", "parse_integer", "parse_memory"]

_SECONDS = {"ns": 1e-9, "us": 1e-6, "ms": 1e-3, "s": 1.0, "min": 60.0, "hr": 3600.0, "day": 86400.0}
# Cyclone's kB is 1024 octets, as its KiB is; a file must mean the same here.
_OCTETS = {"B": 1, "kB": 1 << 10, "KiB": 1 << 10, "MB": 1 << 20, "MiB": 1 << 20, "GB": 1 << 30, "GiB": 1 << 30}

_AMOUNT = re.compile(r"(\d{1,18}(?:\.\d{0,18})?|\.\d{1,18})([eE][+-]?\d{1,2})?\s*([A-Za-z]*)", re.ASCII)


def parse_duration(text: str) -> float:
    """Seconds; ``inf`` is infinite.  A unit is required, as in Cyclone, except with 0."""
    if text == "inf":
        return math.inf
    amount, scale = _amount(text, _SECONDS, "a duration with its unit (ns, us, ms, s, min, hr, day), such as '10 s'")
    # Rounded as durations are on the wire: 0.1 is 0.1, however many units it was written in.
    return round(amount * scale, 9)


def parse_memory(text: str) -> int:
    """Octets.  A unit is required, as in Cyclone, except with 0."""
    expected = "an amount of memory with its unit (B, kB, KiB, MB, MiB, GB, GiB), such as '64 kB'"
    amount, scale = _amount(text, _OCTETS, expected)
    return round(amount * scale)


def parse_integer(text: str) -> int:
    if not re.fullmatch(r"[+-]?\d{1,19}", text, re.ASCII):
        raise ValueError("a whole number")
    return int(text)


def parse_boolean(text: str) -> bool:
    if text.lower() not in ("true", "false"):
        raise ValueError("true or false")
    return text.lower() == "true"


def _amount(text: str, units: Mapping[str, float], expected: str) -> tuple[float, float]:
    match = _AMOUNT.fullmatch(text)
    if match is None:
        raise ValueError(expected)
    number, exponent, unit = match.groups(default="")
    amount = float(number + exponent)
    if unit in units:
        return amount, units[unit]
    if not unit and amount == 0:
        return 0.0, 1.0
    raise ValueError(expected)
