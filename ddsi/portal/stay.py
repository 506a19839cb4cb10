"""Stay: a participant's time in the engine's thread, from entering it to leaving it.

Not part of DDS.  ``async with`` of a DomainParticipant must begin and end in one task; this is that task.
"""

from __future__ import annotations

import trio

from ..dcps import DomainParticipant
from .engine_thread import EngineThread

__all__ = ["Stay"]


class Stay:
    """All methods are for the engine's thread, :meth:`abandon` excepted."""

    def __init__(self, engine: EngineThread, participant: DomainParticipant) -> None:
        self._engine = engine
        self._participant = participant
        self._entered = trio.Event()
        self._leave = trio.Event()
        self._left = trio.Event()
        self._failure: BaseException | None = None
        self._has_begun = False

    async def enter(self) -> None:
        """Raises what entering the participant raises; then it has left already."""
        self._has_begun = True
        self._engine.enter(self)
        self._engine.begin(self._live)
        try:
            await self._entered.wait()
        except trio.Cancelled:
            self._leave.set()
            raise
        self._raise_failure()

    async def leave(self, *, at_once: bool) -> None:
        """Close the participant; unless ``at_once``, samples under way get a moment.  Raises what ended it before."""
        if at_once:
            self._participant.close()
        self._leave.set()
        try:
            await self._left.wait()
        except trio.Cancelled:
            self._participant.close()
            raise
        self._raise_failure()

    def begin_to_leave(self) -> None:
        """As :meth:`leave`, for somebody who does not wait for it."""
        self._leave.set()

    def close(self) -> None:
        """Close the participant now, without a moment for anything; also where it never came to enter."""
        self._participant.close()
        self._leave.set()
        if not self._has_begun:
            self._has_begun = True
            self._engine.release(self)

    def abandon(self) -> None:
        """In the child of a fork: the participant is the parent's."""
        self._participant.abandon()

    async def _live(self) -> None:
        try:
            async with self._participant:
                self._entered.set()
                await self._leave.wait()
        except trio.Cancelled:
            raise
        except BaseException as failure:  # it leaves where the participant is entered or left
            self._failure = failure
        finally:
            self._entered.set()
            self._left.set()
            self._engine.release(self)

    def _raise_failure(self) -> None:
        failure, self._failure = self._failure, None
        if failure is not None:
            raise failure
