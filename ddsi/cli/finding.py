"""Finding: one thing that ``ddsi doctor`` looked at, and what is to be done about it."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

__all__ = ["Finding", "Verdict"]


class Verdict(StrEnum):
    OK = "ok"
    WARNING = "warning"
    """It works, but not as well as it could, or not for everybody."""
    FAULT = "fault"
    """A participant cannot work like this."""


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing that was looked at; ``advice`` is empty where there is nothing to do."""

    subject: str
    verdict: Verdict
    text: str
    advice: str = ""
