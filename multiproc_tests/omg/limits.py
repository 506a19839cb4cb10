"""What the other implementation cannot do, with itself or with ours: failures that are expected and explained.

A case that passes all the same is reported as passed.
"""

from __future__ import annotations

from .cases import SuiteCase

__all__ = ["LIMITS", "known_limit"]

_NO_TIME_FILTER = "Cyclone announces a time-based filter, and lets everything pass"

LIMITS: dict[tuple[str, str, str], str] = {
    ("TimeBasedFilter_0", "ddsi", "cyclone"): _NO_TIME_FILTER,
    ("TimeBasedFilter_1", "ddsi", "cyclone"): _NO_TIME_FILTER,
    ("FinalInstanceState_1", "ddsi", "cyclone"): (
        "Cyclone 0.10 reads the key of an appendable type in XCDR2 without its delimiter header"
    ),
}
"""By case, publisher and subscriber."""


def known_limit(case: SuiteCase, publisher: str, subscriber: str) -> str | None:
    """Why this combination is expected to fail, or None."""
    return LIMITS.get((case.name, publisher, subscriber))
