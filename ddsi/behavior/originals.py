"""Originals: which samples that a persistence service hands on are no news, as their writer sends or has sent them.

RTPS 2.5 §8.7.9 (original writer info).  A service keeps what durable writers wrote, and sends it to readers that come
later.  A sample that it hands on says whose it was and which number it had, and so the reader can tell it from news:
while the writer itself is matched it sends its history too, and when it is gone what it had said is known.
"""

from __future__ import annotations

from collections.abc import Container

from ..structure.cache_change import CacheChange
from ..structure.guid import GUID_UNKNOWN, Guid

__all__ = ["Originals"]

_MAX_WRITERS = 4096


class _Told:
    """What was said by one writer: by itself up to ``own_sn``, and by whoever hands it on now up to ``told_sn``."""

    __slots__ = ("own_sn", "teller", "told_sn")

    def __init__(self) -> None:
        self.own_sn = 0
        self.teller = GUID_UNKNOWN
        self.told_sn = 0


class Originals:
    """Of one reader.  Remembers 4,096 writers at most, of which the first to come are the first to go."""

    __slots__ = ("_told",)

    def __init__(self) -> None:
        self._told: dict[Guid, _Told] = {}

    def writer_ended(self, writer: Guid, last_sn: int) -> None:
        """A matched writer is gone, of which all up to ``last_sn`` was delivered or given up."""
        if last_sn > 0:
            told = self._of(writer)
            told.own_sn = max(told.own_sn, last_sn)

    def is_repeated(self, change: CacheChange, matched: Container[Guid]) -> bool:
        """Is the change one that another writer tells, or has told?  Numbers need not come in order."""
        if change.original is None:
            return False
        writer, number = change.original
        if writer in matched:
            return True
        told = self._of(writer)
        if told.teller != change.writer_guid:
            if told.teller in matched:
                return True  # two services tell the same
            told.own_sn = max(told.own_sn, told.told_sn)
            told.teller = change.writer_guid
        if number <= told.own_sn:
            return True
        told.told_sn = max(told.told_sn, number)
        return False

    def _of(self, writer: Guid) -> _Told:
        told = self._told.get(writer)
        if told is None:
            if len(self._told) >= _MAX_WRITERS:
                del self._told[next(iter(self._told))]
            told = self._told[writer] = _Told()
        return told
