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
        except BaseExceptionGroup as wrapped:
            leaving = _unwrapped(wrapped, error)
        failure = self._failure
        if failure is not None:
            if leaving is None or isinstance(leaving, trio.Cancelled):
                raise failure from failure.__cause__
            leaving.add_note(f"Meanwhile the participant's own task failed: {failure!r}")
        if leaving is not None and leaving is not error:
            raise leaving

    @trio.lowlevel.enable_ki_protection
    async def _in_background(self) -> None:
        # Shielded: a body that is cancelled may still have something to say while it cleans up.
        with trio.CancelScope(shield=True):
            try:
                await self._run()
            except BaseException as failure:
                assert self._nursery is not None
                self._failure = _innermost(failure)
                self._nursery.cancel_scope.cancel()


def _unwrapped(wrapped: BaseExceptionGroup[BaseException], error: BaseException | None) -> BaseException | None:
    """What the nursery has wrapped: the body's error, without cancellations if they were the nursery's own."""
    interrupts = [member for member in wrapped.exceptions if isinstance(member, KeyboardInterrupt)]
    if interrupts:  # it may have come while we waited
        return interrupts[0]
    if not isinstance(error, BaseExceptionGroup) or error.split(trio.Cancelled)[0] is None:
        return error
    return error if wrapped.split(trio.Cancelled)[0] is not None else wrapped.exceptions[0]


def _innermost(failure: BaseException) -> BaseException:
    """The first real failure in what a nursery raised."""
    while isinstance(failure, BaseExceptionGroup):
        real = failure.split(trio.Cancelled)[1]
        failure = (real or failure).exceptions[0]
    return failure
