"""Departures: who said goodbye a moment ago, so that what it announced before that is not taken for a return.

RTPS 2.5 §8.5.3 (SPDP is best effort).  A participant announces itself, and says goodbye, on several paths: multicast
and unicast, each with a socket of its own.  What waits in one while the goodbye is read from another would bring it
back, for as long as its lease lasts where the second goodbye is lost.  Other name: deleted_participants (Cyclone DDS).

Who really returns under its Guid counts from 1 again, and so is let in a second later at most.
"""

from __future__ import annotations

from ..structure.guid import Guid

__all__ = ["Departures"]

_REMEMBERED_S = 1.0
_MAX_REMEMBERED = 1024


class Departures:
    """The goodbyes of the last second, at most 1024, oldest first."""

    __slots__ = ("_goodbyes",)

    def __init__(self) -> None:
        self._goodbyes: dict[Guid, tuple[float, int]] = {}

    def note(self, guid: Guid, sequence_number: int, now: float) -> None:
        """A participant that was known said goodbye, in the SPDP change of this number."""
        while self._goodbyes:
            oldest = next(iter(self._goodbyes))
            if len(self._goodbyes) < _MAX_REMEMBERED and now - self._goodbyes[oldest][0] <= _REMEMBERED_S:
                break
            del self._goodbyes[oldest]
        self._goodbyes[guid] = now, sequence_number

    def overtook(self, guid: Guid, sequence_number: int, now: float) -> bool:
        """Is an announcement of this number older than the goodbye that was heard already?"""
        said_at, goodbye_number = self._goodbyes.get(guid, (now, 0))
        return sequence_number <= goodbye_number and now - said_at <= _REMEMBERED_S
