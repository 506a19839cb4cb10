"""Call: one thing that another thread wants done in the engine's thread, and what came of it.

Not part of DDS.  An outcome is told once, in the engine's thread, by ``notify``; whoever asked then reads it.  A call
that is cancelled before it began is over at once.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Awaitable, Callable
from typing import Generic, TypeVar, cast

import trio

from ..structure.errors import AlreadyDeleted

__all__ = ["Call", "Lane"]

R = TypeVar("R")


class Call(Generic[R]):
    """``notify`` is called in the engine's thread when the call is over; it must not raise, nor wait."""

    __slots__ = ("_error", "_function", "_is_done", "_notify", "_result", "_scope")

    def __init__(self, function: Callable[[], R] | Callable[[], Awaitable[R]], notify: Callable[[], object]) -> None:
        self._function = function
        self._notify = notify
        self._result: R | None = None
        self._error: BaseException | None = None
        self._scope: trio.CancelScope | None = None
        self._is_done = False

    # --- in the engine's thread --------------------------------------------------------------------------

    def run_now(self) -> None:
        """Do what takes no time."""
        try:
            self._result = cast("Callable[[], R]", self._function)()
        except BaseException as error:  # whoever asked gets it, whatever it is
            self._error = error
        self._end()

    async def run(self) -> None:
        """Do what may have to wait.  Raises nothing but the cancellation of the whole thread's work."""
        if self._is_done:
            return
        self._error = AlreadyDeleted("the participant was closed while this was waited for")
        try:
            with trio.CancelScope() as self._scope:
                try:
                    self._result = await cast("Callable[[], Awaitable[R]]", self._function)()
                    self._error = None
                except trio.Cancelled:
                    raise
                except BaseException as error:
                    self._error = error
        finally:
            self._end()

    def cancel(self, then: Callable[[], object]) -> None:
        """Nobody wants the outcome any more.  ``then`` is called as soon as it is over."""
        self._notify = then
        if self._is_done:
            then()
        elif self._scope is not None:
            self._scope.cancel()
        else:
            self._end()

    def fail(self, error: BaseException) -> None:
        """It will never be done: the thread has ended."""
        if not self._is_done:
            self._error = error
            self._end()

    def _end(self) -> None:
        self._is_done = True
        self._notify()

    @property
    def is_done(self) -> bool:
        """Is it over, one way or the other?"""
        return self._is_done

    # --- in the thread that asked ------------------------------------------------------------------------

    def outcome(self) -> R:
        """What the function returned.  Raises what it raised, the very object."""
        error, self._error = self._error, None
        if error is None:
            return cast("R", self._result)
        try:
            raise error
        finally:
            del error  # it holds this frame, and so would hold itself


class Lane:
    """Calls that are done one after the other, in the order in which they came: the writes of one writer.

    Tasks alone would not do: trio starts those that become ready at once in any order.
    """

    def __init__(self) -> None:
        self._calls: deque[Call[None]] = deque()
        self._lot = trio.lowlevel.ParkingLot()
        self._is_closed = False

    def put(self, call: Call[None]) -> None:
        if self._is_closed:
            call.fail(AlreadyDeleted("the writer was closed"))
            return
        self._calls.append(call)
        self._lot.unpark_all()

    def close(self) -> None:
        """No more are taken; those that wait fail."""
        self._is_closed = True
        self._lot.unpark_all()

    async def run(self) -> None:
        try:
            while not self._is_closed:
                while self._calls:
                    await self._calls.popleft().run()
                if not self._is_closed:
                    await self._lot.park()
        finally:
            self._is_closed = True
            for call in self._calls:
                call.fail(AlreadyDeleted("the writer was closed"))
