"""Runs an async command to its end, or until a signal ends it: SIGINT and SIGTERM cancel, so that nothing is torn.

A participant that is cancelled says goodbye to its peers; a KeyboardInterrupt, thrown into whatever line happens to be
running, could prevent that.
"""

from __future__ import annotations

import signal
from collections.abc import AsyncIterator, Awaitable, Callable

import trio

__all__ = ["run"]

_SIGNAL_BASE = 128


def run(command: Callable[[], Awaitable[int]]) -> int:
    """The status of ``command``, or 128 and the number of the signal that ended it.

    What the command raises is raised here, out of any ExceptionGroup that holds it alone.
    """
    try:
        return trio.run(_supervised, command)
    except BaseExceptionGroup as group:
        raise _innermost(group) from None


async def _supervised(command: Callable[[], Awaitable[int]]) -> int:
    status = 0
    caught = 0

    async def watch(signals: AsyncIterator[int], scope: trio.CancelScope) -> None:
        nonlocal caught
        async for number in signals:
            caught = number
            scope.cancel()

    with trio.open_signal_receiver(signal.SIGINT, signal.SIGTERM) as signals:
        async with trio.open_nursery() as nursery:
            nursery.start_soon(watch, signals, nursery.cancel_scope)
            status = await command()
            nursery.cancel_scope.cancel()
    return _SIGNAL_BASE + caught if caught else status


def _innermost(group: BaseExceptionGroup[BaseException]) -> BaseException:
    """What a group holds if it holds one thing, through all layers; else the group."""
    error: BaseException = group
    while isinstance(error, BaseExceptionGroup) and len(error.exceptions) == 1:
        error = error.exceptions[0]
    return error
