"""The time at which a keystore is checked, and how far ahead "soon" is."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Self

__all__ = ["Horizon"]

_DAY_NS: Final = 86_400_000_000_000


@dataclass(frozen=True, slots=True)
class Horizon:
    """Nanoseconds since 1970; what ends before ``soon`` is worth a warning."""

    now: int
    soon: int

    @classmethod
    def of_days(cls, now: int, days: int) -> Self:
        return cls(now, now + days * _DAY_NS)

    def days_until(self, instant: int) -> int:
        """Whole days from now on."""
        return (instant - self.now) // _DAY_NS
