"""Lead: who reads the unicast socket, the pump's own task or one of the application's that waits for what comes there.

A task that waits for samples can as well wait for the socket itself: what arrives is then handled, and the task goes on
with its sample at once, without another one having to be scheduled in between.  While it leads, the pump's task, its
deputy, rests; when it leaves, and no other takes over before the scheduler comes round, the deputy reads again.

A leader that got what it waited for goes on before the engine's effects are acted upon: it may well write at once, and
then that is done together; else its deputy does it, or whoever waits first.

Where question and answer follow each other within moments, as the last wait has shown, and no other task has anything
to do, a leader stays where it is and waits for the socket alone: a round of the scheduler takes as long as all that is
done with a sample.
"""

from __future__ import annotations

import select
import socket
from collections.abc import Callable
from contextlib import suppress

import trio

from ..behavior.reader_history_cache import ReaderHistoryCache

__all__ = ["Lead"]

# Of the scheduler: who was woken takes its sample in the first, may have to yield for a second, and then waits again.
_ROUNDS_OF_GRACE = 3
_MOMENT_S = 200e-6
"""Nobody else is served for so long, at most: no longer than it takes to decode a large sample."""


class Lead:
    """Of one socket.  ``is_free``: nobody waits for it now."""

    __slots__ = (
        "_deputy", "_history", "_is_deputy_awake", "_is_offered", "_is_prompt", "_settle", "_waits_for",
        "is_disturbed", "is_free",
    )  # fmt: skip

    def __init__(self, settle: Callable[[], None]) -> None:
        """``settle`` acts on what a leader has read and not acted upon."""
        self._settle = settle
        self._deputy = trio.lowlevel.ParkingLot()
        self._history: ReaderHistoryCache | None = None
        self._waits_for: socket.socket | None = None
        self._is_offered = self._is_deputy_awake = False
        self._is_prompt = False  # did the last wait last for a moment?
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
        if self._deputy:
            self._is_deputy_awake = True
            self._deputy.unpark_all()

    async def wait(self, sock: socket.socket) -> bool:
        """Until there is something to read, or the leader is disturbed, or its interface is gone.

        Returns whether others had their turn meanwhile.
        """
        if self._is_prompt and self._glance(sock):
            return False
        began = trio.current_time()
        self._waits_for = sock
        try:
            with suppress(trio.ClosedResourceError):
                await trio.lowlevel.wait_readable(sock)
        finally:
            self._waits_for = None
            self._is_prompt = trio.current_time() - began < _MOMENT_S
        return True

    def _glance(self, sock: socket.socket) -> bool:
        """Wait for a moment, unless anybody else wants to run; is there something to read?"""
        others = trio.lowlevel.current_statistics()
        if (
            others.tasks_runnable > self._is_deputy_awake
            or others.run_sync_soon_queue_size
            or others.seconds_to_next_deadline < _MOMENT_S
        ):
            return False
        try:
            self._is_prompt = bool(select.select((sock,), (), (), _MOMENT_S)[0])
        except (OSError, ValueError):  # closed, or its number is beyond what select takes
            self._is_prompt = False
        return self._is_prompt

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
            self._is_deputy_awake = False
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
