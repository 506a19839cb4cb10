"""Lead: who reads the unicast socket, the pump's own task or one of the application's that waits for what comes there.

A task that waits for samples can as well wait for the socket itself: what arrives is then handled, and the task goes on
with its sample at once, without another one having to be scheduled in between.  While it leads, the pump's task, its
deputy, rests; when it leaves, and no other takes over before the scheduler comes round, the deputy reads again.

A leader that got what it waited for goes on before the engine's effects are acted upon: it may well write at once, and
then that is done together; else its deputy does it, or whoever waits first.
"""

from __future__ import annotations

import socket
from collections.abc import Callable
from contextlib import suppress

import trio

from ..behavior.reader_history_cache import ReaderHistoryCache

__all__ = ["Lead"]

# Of the scheduler: who was woken takes its sample in the first, may have to yield for a second, and then waits again.
_ROUNDS_OF_GRACE = 3


class Lead:
    """Of one socket.  ``is_free``: nobody waits for it now."""

    __slots__ = ("_deputy", "_history", "_is_offered", "_settle", "_waits_for", "is_disturbed", "is_free")

    def __init__(self, settle: Callable[[], None]) -> None:
        """``settle`` acts on what a leader has read and not acted upon."""
        self._settle = settle
        self._deputy = trio.lowlevel.ParkingLot()
        self._history: ReaderHistoryCache | None = None
        self._waits_for: socket.socket | None = None
        self._is_offered = False
        self.is_free = True
        self.is_disturbed = False
        """There may be news for the leader that it did not read itself."""

    def take(self, history: ReaderHistoryCache) -> None:
        """The calling task leads, until it calls :meth:`leave`; it waits for news of ``history``."""
        assert self.is_free
        self._history = history
        self.is_free = self.is_disturbed = False

    def leave(self) -> None:
        self._history = None
        self.is_free = True
        self._deputy.unpark_all()

    async def wait(self, sock: socket.socket) -> None:
        """Until there is something to read, or the leader is disturbed, or its interface is gone."""
        self._waits_for = sock
        try:
            with suppress(trio.ClosedResourceError):
                await trio.lowlevel.wait_readable(sock)
        finally:
            self._waits_for = None

    def disturb(self, history: ReaderHistoryCache | None) -> None:
        """Wake the leader if this is what it waits for (None: whoever leads)."""
        if history is None or history is self._history:
            self.is_disturbed = True
            if self._waits_for is not None:
                trio.lowlevel.notify_closing(self._waits_for)

    def offer(self) -> None:
        """A task that waited, while the deputy read, was woken: it may want to lead when it waits again."""
        self._is_offered = True

    async def deputise(self, sock: socket.socket) -> None:
        """Wait for the socket, as the deputy: not while anybody leads, or may do so presently."""
        if self._is_offered:
            self._is_offered = False
            for _ in range(_ROUNDS_OF_GRACE):
                await trio.lowlevel.checkpoint()
        self._settle()
        while not self.is_free:
            await self._deputy.park()
            self._settle()
        if sock.fileno() < 0:  # closed meanwhile
            raise trio.ClosedResourceError
        self.is_free = False
        try:
            await trio.lowlevel.wait_readable(sock)
        finally:
            self.is_free = True
            if self._deputy:  # of another socket, which is the one to wait for from now on
                self._deputy.unpark_all()
