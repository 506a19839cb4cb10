"""Rooms: buffers for large octets, each of which is used again when nobody holds it any more.

Nothing of DDS is known here.  The same few buffers again and again stay in the processor's caches; to write to fresh
ones costs as much as to encrypt what is written.  And each has space at both ends: what goes around its octets next is
written there, so that they need not be copied to be joined with it.
"""

from __future__ import annotations

from collections import deque
from typing import Final

from ddsi.serialization.cursor import Octets

__all__ = ["Rooms"]

_MOST: Final = 4
"""As many as there are layers of protection, and one that waits to be sent."""
_OCTETS: Final = 1 << 16
"""What goes into one datagram is no larger."""
_BEFORE: Final = 256
_BEHIND: Final = 64
_SIZE: Final = _BEFORE + _OCTETS + _BEHIND


class Rooms:
    """For one participant, in one thread."""

    __slots__ = ("_latest", "_rooms", "_within")

    def __init__(self) -> None:
        self._rooms: deque[bytearray] = deque()
        self._latest: memoryview | None = None
        """What was given out last, as long as nothing was written around it; and where it lies."""
        self._within = bytearray()

    def room(self, length: int) -> memoryview:
        """So many octets, which hold anything, and are the caller's for as long as any view of them lives."""
        self._latest = None
        if length > _OCTETS:
            return memoryview(bytearray(length))
        rooms = self._rooms
        try:
            room = rooms[0]
            room.append(0)
        except (IndexError, BufferError):  # a bytearray does not change its length while there are views of it
            room = self._another()
        else:
            del room[-1]
            rooms.rotate()
        self._within = room
        self._latest = view = memoryview(room)[_BEFORE : _BEFORE + length]
        return view

    def _another(self) -> bytearray:
        rooms = self._rooms
        for room in rooms:
            try:
                room.append(0)
            except BufferError:
                continue
            del room[-1]
            return room
        room = bytearray(_SIZE)
        if len(rooms) < _MOST:
            rooms.append(room)
        return room

    def shortened(self, room: memoryview, octets: int) -> memoryview:
        """``room``, which was given out last, without so many octets at its end: they may be written over."""
        self._latest = view = room[:-octets]
        return view

    def around(self, before: Octets, content: Octets, behind: Octets) -> Octets:
        """All three as one.  They are not copied to be joined if ``content`` is what was given out last.

        That is so once only: nothing else is ever written there while somebody holds it.
        """
        start = _BEFORE - len(before)
        if content is not self._latest or start < 0 or len(behind) > _BEHIND:
            return b"".join((before, content, behind))
        self._latest = None
        room = self._within
        room[start:_BEFORE] = before
        end = _BEFORE + len(content)
        if behind:
            room[end : end + len(behind)] = behind
            end += len(behind)
        return memoryview(room)[start:end]

    def wipe(self) -> None:
        """What was decrypted last is not to be found in memory any more."""
        for room in self._rooms:
            room[:] = bytes(_SIZE)
