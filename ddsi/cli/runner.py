"""Runs an async command to its end, or until a signal ends it: SIGINT and SIGTERM cancel, so that nothing is torn.

A participant that is cancelled says goodbye to its peers; a KeyboardInterrupt, thrown into whatever line happens to be
running, could prevent that.
"""

from __future__ import annotations

import os
import signal
import stat
import sys
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import suppress

import trio

from .exit_status import ExitStatus

__all__ = ["abandon_output", "run"]

_SIGNAL_BASE = 128


def run(command: Callable[[], Awaitable[int]]) -> int:
    """The status of ``command``, or 128 and the number of the signal that ended it.

    What the command raises is raised here, out of any ExceptionGroup that holds it alone.
    """
    try:
        return trio.run(_supervised, command)
    except BaseExceptionGroup as group:
        raise _innermost(group) from None


def abandon_output() -> None:
    """Whoever read our output is gone; what is buffered must not be tried again when the interpreter ends."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, sys.stdout.fileno())
    os.close(nowhere)


async def _supervised(command: Callable[[], Awaitable[int]]) -> int:
    status = 0
    ended_by = 0  # the status that a signal, or the loss of our output, asks for

    async def watch_signals(signals: AsyncIterator[int]) -> None:
        nonlocal ended_by
        async for number in signals:
            ended_by = ended_by or _SIGNAL_BASE + number
            nursery.cancel_scope.cancel()

    async def watch_output() -> None:
        nonlocal ended_by
        await _output_lost()
        ended_by = ended_by or ExitStatus.BROKEN_PIPE
        nursery.cancel_scope.cancel()

    with trio.open_signal_receiver(signal.SIGINT, signal.SIGTERM) as signals:
        async with trio.open_nursery() as nursery:
            nursery.start_soon(watch_signals, signals)
            nursery.start_soon(watch_output)
            status = await command()
            nursery.cancel_scope.cancel()
    if ended_by == ExitStatus.BROKEN_PIPE:
        raise BrokenPipeError
    return ended_by or status


async def _output_lost() -> None:
    """Until whoever reads our output is gone (``ddsi ls --watch | head -1``).

    Writing would tell, but a command that waits for news may not write for hours.  epoll reports the end of a pipe that
    is written to as readable; where there is no epoll, the next write must do.
    """
    if trio.lowlevel.current_statistics().io_statistics.backend == "epoll" and sys.stdout is not None:
        # ValueError: no real file; OSError: one that epoll does not take.
        with suppress(OSError, ValueError):
            descriptor = sys.stdout.fileno()
            if stat.S_ISFIFO(os.fstat(descriptor).st_mode):
                await trio.lowlevel.wait_readable(descriptor)
                return
    await trio.sleep_forever()


def _innermost(group: BaseExceptionGroup[BaseException]) -> BaseException:
    """What a group holds if it holds one thing, through all layers; else the group."""
    error: BaseException = group
    while isinstance(error, BaseExceptionGroup) and len(error.exceptions) == 1:
        error = error.exceptions[0]
    return error
