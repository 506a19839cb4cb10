"""From when until when a certificate or a grant holds.  RFC 5280 §4.1.2.5, DDS-Security 1.1 §9.4.1.3.2.2 (Validity)."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from typing import Final, Self

from ddsi.structure.errors import BadParameter

__all__ = ["DEFAULT_DAYS", "Validity", "utc"]

DEFAULT_DAYS: Final = 3650
_MAX_DAYS: Final = 36500
_SLACK: Final = timedelta(days=1)
"""Valid from a day ago on: the clock of another machine may be behind, and one without a battery by hours."""


@dataclass(frozen=True, slots=True)
class Validity:
    """Both ends belong to it; whole seconds of UTC, as certificates have them."""

    not_before: datetime
    not_after: datetime

    @classmethod
    def of_days(cls, now_ns: int, days: int = DEFAULT_DAYS) -> Self:
        """``days`` from now (ns since 1970) on.  Raises BadParameter unless there are 1 to 36500."""
        if not 1 <= days <= _MAX_DAYS:
            raise BadParameter(f"valid for {days} days? Say a number from 1 to {_MAX_DAYS}")
        now = utc(now_ns)
        return cls(now - _SLACK, now + timedelta(days=days))

    def within(self, other: Validity) -> Validity:
        """Its part inside the other: what an authority issues must not outlive it."""
        return Validity(max(self.not_before, other.not_before), min(self.not_after, other.not_after))


def utc(now_ns: int) -> datetime:
    """Nanoseconds since 1970 as a time in UTC, down to the second."""
    return datetime.fromtimestamp(now_ns // 1_000_000_000, UTC)
