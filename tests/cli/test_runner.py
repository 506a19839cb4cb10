"""Async commands: signals cancel them, their errors come out as themselves, and a lost output ends them."""

from __future__ import annotations

import signal
import subprocess
import sys
import textwrap

import pytest
import trio

from ddsi.cli.exit_status import CommandError
from ddsi.cli.runner import run


def test_the_status_is_the_commands() -> None:
    async def command() -> int:
        await trio.sleep(0)
        return 5

    assert run(command) == 5


def test_an_error_leaves_as_itself() -> None:
    """Through any number of nurseries."""

    async def fail() -> None:
        raise CommandError("no")

    async def command() -> int:
        async with trio.open_nursery() as outer, trio.open_nursery() as inner:
            outer.start_soon(trio.sleep_forever)
            inner.start_soon(fail)
        return 0

    with pytest.raises(CommandError, match="no"):
        run(command)


def test_two_errors_are_not_made_one() -> None:
    async def fail(error: Exception) -> None:
        try:
            await trio.sleep_forever()
        finally:
            raise error

    async def command() -> int:
        async with trio.open_nursery() as nursery:
            nursery.start_soon(fail, ValueError("a"))
            nursery.start_soon(fail, ValueError("b"))
            nursery.cancel_scope.cancel()
        return 0

    with pytest.raises(ExceptionGroup):
        run(command)


_WAITING = textwrap.dedent(
    """
    import sys, trio
    from ddsi.cli.runner import run
    async def command():
        try:
            print("READY", flush=True)
            await trio.sleep(30)
        finally:
            print("TIDY", file=sys.stderr, flush=True)
        return 0
    try:
        sys.exit(run(command))
    except BrokenPipeError:
        sys.stderr.write("BROKEN\\n")
    """
)


def _start() -> subprocess.Popen[str]:
    process = subprocess.Popen(
        [sys.executable, "-c", _WAITING], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "READY\n"
    return process


@pytest.mark.parametrize(("number", "status"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_a_signal_ends_it_tidily(number: signal.Signals, status: int) -> None:
    with _start() as process:
        process.send_signal(number)
        _, errors = process.communicate(timeout=20)
    assert process.returncode == status
    assert errors == "TIDY\n"


@pytest.mark.skipif(not hasattr(__import__("select"), "epoll"), reason="only epoll tells of a pipe that nobody reads")
def test_it_ends_when_nobody_reads_its_output_though_it_writes_nothing() -> None:
    with _start() as process:
        assert process.stdout is not None
        assert process.stderr is not None
        process.stdout.close()
        assert process.wait(timeout=20) == 0
        assert process.stderr.read() == "TIDY\nBROKEN\n"
