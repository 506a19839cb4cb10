"""What the other implementation cannot do, with itself or with ours: failures that are expected and explained.

A case that passes all the same is reported as passed.
"""

from __future__ import annotations

from .cases import SuiteCase

__all__ = ["known_limit"]

_LIMITS: dict[tuple[str, str, str], str] = {
    ("FinalInstanceState_1", "ddsi", "cyclone"): (
        "Cyclone 0.10 reads the key of an appendable type in XCDR2 without its delimiter header"
    ),
}
"""By case, publisher and subscriber."""


def known_limit(case: SuiteCase, publisher: str, subscriber: str) -> str | None:
    """Why this combination is expected to fail, or None."""
    return _LIMITS.get((case.name, publisher, subscriber))
