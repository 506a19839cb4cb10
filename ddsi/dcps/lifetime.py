"""Lifetime: a background task that lives as long as the body of an ``async with``, and cannot change what leaves it.

Not part of DDS.  A nursery wraps whatever leaves it into an ExceptionGroup, as two things may fail at once.  For the
users of a participant there is one thing, their own code; so here it goes by these rules:

- What the body raises leaves as itself.  That the background failed as well is said in a note on it.
- When the background fails, the body is cancelled, and the failure leaves in the place of that cancellation.
- A cancellation from outside leaves as it came.
"""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from contextlib import AbstractAsyncContextManager
from types import TracebackType

import trio

__all__ = ["Lifetime"]


class Lifetime:
    """``run`` is the background: it ends when whoever made it says so, and its failure ends the body."""

    def __init__(self, run: Callable[[], Awaitable[None]]) -> None:
        self._run = run
        self._manager: AbstractAsyncContextManager[trio.Nursery] = trio.open_nursery(strict_exception_groups=True)
        self._nursery: trio.Nursery | None = None
        self._failure: BaseException | None = None

    @trio.lowlevel.enable_ki_protection
    async def enter(self) -> None:
        """Start the background.  No checkpoint: it cannot be cancelled in the middle."""
        self._nursery = await self._manager.__aenter__()
        self._nursery.start_soon(self._in_background, name="ddsi participant")

    @trio.lowlevel.enable_ki_protection
    async def leave(self, error: BaseException | None) -> None:
        """Wait for the end of the background, which has been told to end; ``error`` is what the body raised.

        Returns when ``error``, if there is one, is what shall leave; else raises that.
        """
        kind = type(error) if error is not None else None
        traceback: TracebackType | None = error.__traceback__ if error is not None else None
        leaving = error
        try:
            if await self._manager.__aexit__(kind, error, traceback):
                leaving = None  # a cancellation that was the nursery's own
        except BaseExceptionGroup as group:
            # What is not the body's error itself is the part of it that was no cancellation, or a KeyboardInterrupt
            # that came while we waited.
            leaving = next((member for member in group.exceptions if member is not error), error)
        failure = self._failure
        if failure is not None:
            if leaving is None or _is_cancellation(leaving):
                raise failure from failure.__cause__
            leaving.add_note(f"Meanwhile the participant's own task failed: {failure!r}")
        if leaving is not None and leaving is not error:
            raise leaving

    @trio.lowlevel.enable_ki_protection
    async def _in_background(self) -> None:
        try:
            await self._run()
        except BaseException as failure:
            if _is_cancellation(failure):
                raise
            assert self._nursery is not None
            self._failure = _innermost(failure)
            self._nursery.cancel_scope.cancel()


def _is_cancellation(error: BaseException) -> bool:
    if isinstance(error, BaseExceptionGroup):
        return error.split(trio.Cancelled)[1] is None
    return isinstance(error, trio.Cancelled)


def _innermost(failure: BaseException) -> BaseException:
    """The first real failure in what a nursery raised."""
    while isinstance(failure, BaseExceptionGroup):
        real = failure.split(trio.Cancelled)[1]
        failure = (real or failure).exceptions[0]
    return failure
