"""Rooms: buffers for large octets, each of which is used again when nobody holds it any more.

Nothing of DDS is known here.  The same few buffers again and again stay in the processor's caches; to write to fresh
ones costs as much as to encrypt what is written.
"""

from __future__ import annotations

from typing import Final

__all__ = ["Rooms"]

_MOST: Final = 4
"""As many as there are layers of protection, and one that waits to be sent."""
_OCTETS: Final = 1 << 16
"""What goes into one datagram is no larger."""


class Rooms:
    """For one participant, in one thread."""

    __slots__ = ("_rooms",)

    def __init__(self) -> None:
        self._rooms: list[bytearray] = []

    def room(self, length: int) -> memoryview:
        """So many octets, which hold anything, and are the caller's for as long as any view of them lives."""
        if length > _OCTETS:
            return memoryview(bytearray(length))
        for room in self._rooms:
            try:
                room.append(0)
            except BufferError:  # a bytearray does not change its length while there are views of it
                continue
            del room[_OCTETS:]
            return memoryview(room)[:length]
        room = bytearray(_OCTETS)
        if len(self._rooms) < _MOST:
            self._rooms.append(room)
        return memoryview(room)[:length]

    def wipe(self) -> None:
        """What was decrypted last is not to be found in memory any more."""
        for room in self._rooms:
            room[:] = bytes(_OCTETS)
