"""Validity: from when until when a grant holds.  DDS-Security 1.1 §9.4.1.3.2.1; XML Schema's dateTime.

Instants are nanoseconds since 1970, UTC, as the wall clock counts them.  A text without a time zone is UTC; Cyclone DDS
reads no fraction of more than nine digits.
"""

from __future__ import annotations

import re
from datetime import UTC, datetime, timedelta

from ddsi.structure.dataclass import dataclass

from .xml_document import Node

__all__ = ["Validity", "instant_text", "parse_instant"]

_DATE_TIME = re.compile(
    r"(\d{4})-(\d\d)-(\d\d)T(\d\d):(\d\d):(\d\d)(?:\.(\d{1,20}))?(Z|[+-]\d\d:\d\d)?", re.ASCII | re.IGNORECASE
)
_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
_SECOND = 1_000_000_000
_LARGEST_ZONE = timedelta(hours=14)


@dataclass(frozen=True, slots=True)
class Validity:
    """From ``not_before`` on, and before ``not_after``: then the permissions expire."""

    not_before: int
    not_after: int

    def __contains__(self, now: object) -> bool:
        return isinstance(now, int) and self.not_before <= now < self.not_after

    def problem(self, now: int) -> str:
        """Why it does not hold at ``now``; "" if it does."""
        if now < self.not_before:
            return f"is not valid before {instant_text(self.not_before)}, and now it is {instant_text(now)}"
        return f"expired at {instant_text(self.not_after)}" if now >= self.not_after else ""

    @classmethod
    def from_node(cls, node: Node) -> Validity:
        """From a ``<validity>`` that is valid by the schema.  Raises DocumentError."""
        begin, end = node.get("not_before"), node.get("not_after")
        validity = cls(_instant(begin), _instant(end))
        if validity.not_before >= validity.not_after:
            raise node.error(f"it ends at {end.text} before it begins at {begin.text}", remedy="exchange the two")
        return validity


def _instant(node: Node) -> int:
    try:
        return parse_instant(node.text)
    except ValueError as error:
        remedy = "write it as 2030-12-31T23:59:59Z"
        raise node.error(f"<{node.tag}> is no date and time: {error}", remedy=remedy) from error


def parse_instant(text: str) -> int:
    """``YYYY-MM-DDThh:mm:ss``, perhaps with a fraction and with ``Z`` or ``+hh:mm``.  Raises ValueError."""
    match = _DATE_TIME.fullmatch(text)
    if match is None:
        raise ValueError(repr(text[:40]))
    year, month, day, hour, minute, second = map(int, match.groups()[:6])
    whole = datetime(year, month, day, hour, minute, second, tzinfo=UTC) - _EPOCH
    fraction = int((match.group(7) or "")[:9].ljust(9, "0"))
    since_1970 = whole - _zone(match.group(8) or "Z")
    return (since_1970.days * 86_400 + since_1970.seconds) * _SECOND + fraction


def _zone(text: str) -> timedelta:
    if text in "Zz":
        return timedelta()
    hours, minutes = int(text[1:3]), int(text[4:6])
    zone = timedelta(hours=hours, minutes=minutes)
    if minutes > 59 or zone > _LARGEST_ZONE:
        raise ValueError(f"{text} is no time zone")
    return -zone if text[0] == "-" else zone


def instant_text(instant: int) -> str:
    """``2030-12-31T23:59:59Z``: to the second, in UTC."""
    try:
        return f"{_EPOCH + timedelta(seconds=instant // _SECOND):%Y-%m-%dT%H:%M:%SZ}"
    except OverflowError:
        return f"{instant // _SECOND} s after 1970"
