"""All targets, by the names of the folders in ``corpus/``."""

from __future__ import annotations

from tests.fuzz.plain import PLAIN_TARGETS
from tests.fuzz.target import Target

__all__ = ["TARGETS"]

TARGETS: dict[str, Target] = {**PLAIN_TARGETS}
