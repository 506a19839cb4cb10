"""One process of a scenario: what it printed and when, waiting for it to print more, and its end.

A process is told apart by its name, the part it plays (``pub``, ``sub``, ``victim``).  Its standard output is read as
events, one a line, and :meth:`Process.expect` waits for them in order; its standard error is only kept to be shown.
This file starts nothing: :mod:`.scenario` does, and it alone knows when all must end.
"""

from __future__ import annotations

import re
import signal
import time
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import trio

from .errors import ExpectationFailed

__all__ = ["Line", "Process"]

MAX_LINES = 200_000
"""Lines kept of one process.  What it prints beyond them is read, so that it does not block, counted and dropped."""

MAX_LINE_OCTETS = 1 << 16
"""A line longer than this is cut into several, so that a process that never ends its line cannot fill the memory."""


@dataclass(frozen=True, slots=True)
class Line:
    """One line of a process: seconds since its scenario began, where it was seen, and the text without its end.

    ``out`` and ``err`` are what it printed, ``in`` what was sent to it, ``--`` what happened to it.
    """

    at: float
    stream: Literal["out", "err", "in", "--"]
    text: str


class Process:
    """A running or ended process; made by :meth:`.scenario.Scenario.start`.

    ``expect`` reads the output once, from top to bottom: each call begins behind the line that the call before it
    found, so that a test reads as the dialogue that it describes.  ``matches`` looks at everything printed so far.
    """

    def __init__(self, name: str, command: list[str], child: trio.Process, *, began_at: float) -> None:
        self.name = name
        self.command = command
        self.lines: list[Line] = []
        self.dropped_lines = 0
        self._child = child
        self._began_at = began_at
        self._cursor = 0
        self._changed = trio.Event()
        self._open_streams = 2
        self.note(f"started, pid {child.pid}: {' '.join(command)}")

    def __repr__(self) -> str:
        state = "running" if self.returncode is None else f"status {self.returncode}"
        return f"<Process {self.name!r} pid {self.pid}, {state}, {len(self.lines)} lines>"

    @property
    def pid(self) -> int:
        return self._child.pid

    @property
    def returncode(self) -> int | None:
        """Exit status, minus the signal's number if one ended it, None while it runs (as ``subprocess`` has it)."""
        return self._child.returncode

    # --- what it printed ---------------------------------------------------------------------------------

    async def expect(self, pattern: str, *, timeout: float = 10.0) -> re.Match[str]:
        """The next line of standard output that ``pattern`` matches from end to end; waits ``timeout`` seconds for it.

        Lines before it are passed over.  Raises ExpectationFailed if it does not come in time, and at once if the
        process has ended and all its output was read.
        """
        expression = re.compile(pattern)
        with trio.move_on_after(timeout):
            while True:
                if found := self._advance(expression):
                    return found
                if self._is_silent_for_good:
                    end = f"{self.name} ended with status {self.returncode}"
                    raise ExpectationFailed(f"{end} and never printed {pattern!r}{self._last_words()}")
                await self._changed.wait()
        raise ExpectationFailed(f"{self.name} did not print {pattern!r} within {timeout:g} s{self._last_words()}")

    def matches(self, pattern: str) -> list[re.Match[str]]:
        """All lines of standard output so far that ``pattern`` matches from end to end, in order."""
        expression = re.compile(pattern)
        return [found for line in self.lines if line.stream == "out" and (found := expression.fullmatch(line.text))]

    def _advance(self, expression: re.Pattern[str]) -> re.Match[str] | None:
        while self._cursor < len(self.lines):
            line = self.lines[self._cursor]
            self._cursor += 1
            if line.stream == "out" and (found := expression.fullmatch(line.text)):
                return found
        return None

    def _last_words(self) -> str:
        printed = [line.text for line in self.lines if line.stream == "out"]
        return f"; its last line was {printed[-1][:200]!r}" if printed else "; it printed nothing"

    # --- what it is told ---------------------------------------------------------------------------------

    async def send(self, line: str) -> None:
        """Writes ``line`` and a line end to the standard input of the process."""
        self._record("in", line)
        assert self._child.stdin is not None
        try:
            await self._child.stdin.send_all(line.encode() + b"\n")
        except (trio.BrokenResourceError, trio.ClosedResourceError) as error:
            raise ExpectationFailed(f"{self.name} takes no more input: it could not be told {line!r}") from error

    async def close_input(self) -> None:
        """Ends the standard input of the process; safe twice."""
        assert self._child.stdin is not None
        await self._child.stdin.aclose()

    def suspend(self) -> None:
        """SIGSTOP: it stands still, its sockets stay open and fill up."""
        self.signal(signal.SIGSTOP)

    def resume(self) -> None:
        self.signal(signal.SIGCONT)

    def kill(self) -> None:
        """SIGKILL: it ends now and says goodbye to nobody."""
        self.signal(signal.SIGKILL)

    def signal(self, number: signal.Signals) -> None:
        """Sends a signal, by pid; does nothing if the process has ended."""
        if self._child.poll() is None:
            self.note(f"gets {number.name}")
            self._child.send_signal(number)

    # --- its end -----------------------------------------------------------------------------------------

    async def wait(self, *, timeout: float = 10.0) -> int:
        """Waits until the process has ended and its output is read; returns its status (see ``returncode``)."""
        with trio.move_on_after(timeout):
            while not self._is_silent_for_good:
                await self._changed.wait()
            assert self.returncode is not None
            return self.returncode
        raise ExpectationFailed(f"{self.name} did not end within {timeout:g} s")

    async def expect_exit(self, status: int = 0, *, timeout: float = 10.0) -> None:
        """Waits for the end of the process and checks its status."""
        found = await self.wait(timeout=timeout)
        if found != status:
            raise ExpectationFailed(f"{self.name} ended with status {found}, not {status}")

    async def stop(self, *, grace: float = 2.0) -> None:
        """Ends the process: SIGTERM, then after ``grace`` seconds SIGKILL.  Does nothing if it has ended."""
        if self._child.poll() is None:
            self.signal(signal.SIGTERM)
            self._child.send_signal(signal.SIGCONT)  # a suspended process would not notice the SIGTERM
            with trio.move_on_after(grace):
                await self._child.wait()
        if self._child.poll() is None:
            self.kill()
            await self._child.wait()

    @property
    def _is_silent_for_good(self) -> bool:
        return self.returncode is not None and self._open_streams == 0

    # --- for the scenario --------------------------------------------------------------------------------

    def note(self, text: str) -> None:
        """Adds a line of our own to what is shown of this process."""
        self._record("--", text)

    async def read_output(self) -> None:
        """Reads standard output until its end.  The scenario runs this as a task, and the two below."""
        await self._read("out", self._child.stdout)

    async def read_errors(self) -> None:
        await self._read("err", self._child.stderr)

    async def watch_end(self) -> None:
        await self._child.wait()
        self.note(f"ended with status {self.returncode}")
        self._announce_change()

    async def _read(self, stream: Literal["out", "err"], pipe: trio.abc.ReceiveStream | None) -> None:
        assert pipe is not None
        rest = b""
        async with pipe:
            async for piece in pipe:
                *whole, rest = _split_lines(rest + piece)
                for line in whole:
                    self._record(stream, line.decode(errors="replace"))
                self._announce_change()
        if rest:
            self._record(stream, rest.decode(errors="replace"))
        self._open_streams -= 1
        self._announce_change()

    def _record(self, stream: Literal["out", "err", "in", "--"], text: str) -> None:
        if len(self.lines) < MAX_LINES or stream == "--":
            self.lines.append(Line(time.monotonic() - self._began_at, stream, text))
        else:
            self.dropped_lines += 1

    def _announce_change(self) -> None:
        """Wakes everybody who waits for output or the end; each looks again for itself."""
        self._changed.set()
        self._changed = trio.Event()


def _split_lines(octets: bytes) -> Iterator[bytes]:
    """The whole lines in ``octets`` without their ends, and last what follows them (perhaps nothing)."""
    *whole, rest = octets.split(b"\n")
    for line in whole:
        yield from _pieces(line.removesuffix(b"\r"))
    yield from _pieces(rest)


def _pieces(line: bytes) -> Iterator[bytes]:
    yield line[:MAX_LINE_OCTETS]
    for start in range(MAX_LINE_OCTETS, len(line), MAX_LINE_OCTETS):
        yield line[start : start + MAX_LINE_OCTETS]
