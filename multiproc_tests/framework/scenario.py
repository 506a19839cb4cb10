"""A scenario: several processes, one deadline over all, and their stories side by side when something goes wrong.

Whatever happens in the block (a failed expectation, an exception, a deadline, a cancellation from outside), all that
was started is ended before the block is left, each by its own pid, and nothing else is.  An exception leaves the block
as itself, with the transcript of all processes added as a note, which pytest prints below the traceback.
"""

from __future__ import annotations

import os
import subprocess
import time
from collections.abc import AsyncIterator, Mapping, Sequence
from contextlib import asynccontextmanager
from pathlib import Path

import trio

from .errors import DeadlineExceeded
from .namespace import Namespace
from .process import Process

__all__ = ["LOG_FOLDER_VARIABLE", "Scenario", "scenario"]

LOG_FOLDER_VARIABLE = "DDSI_MULTIPROC_LOGS"
"""Environment variable: a folder in which the transcript of every scenario is kept, also of those that pass."""

SHOWN_LINES = 300
"""Lines of each process, the last ones, that a transcript shows."""

SHOWN_COLUMNS = 300
"""Characters of each line that a transcript shows."""


class Scenario:
    """The processes of one scenario; use :func:`scenario` to make one."""

    def __init__(self, title: str, *, nursery: trio.Nursery, scope: trio.CancelScope) -> None:
        self.title = title
        self.processes: list[Process] = []
        self.failure: DeadlineExceeded | None = None
        self._began_at = time.monotonic()
        self._nursery = nursery
        self._scope = scope

    async def start(
        self,
        name: str,
        command: Sequence[str | os.PathLike[str]],
        *,
        namespace: Namespace | None = None,
        environment: Mapping[str, str] | None = None,
        folder: Path | None = None,
        deadline: float | None = None,
    ) -> Process:
        """Starts a process and returns at once; what it prints is collected from now on.

        ``environment`` is added to ours.  A process that still runs ``deadline`` seconds after its start fails the
        scenario; without one, only the scenario's own deadline holds.  A name may be used again: a process that was
        killed and returns is another process in the same part.
        """
        words = [os.fspath(word) for word in command]
        if namespace is not None:
            words = namespace.command(words)
        child = await trio.lowlevel.open_process(
            words,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            cwd=folder,
            env={**os.environ, "PYTHONUNBUFFERED": "1", **(environment or {})},
        )
        # No checkpoint between the two: once there is a child, it is in the list of those that are ended.
        process = Process(name, words, child, began_at=self._began_at)
        self.processes.append(process)
        self._nursery.start_soon(process.read_output)
        self._nursery.start_soon(process.read_errors)
        self._nursery.start_soon(process.watch_end)
        if deadline is not None:
            self._nursery.start_soon(self._watch_deadline, process, deadline)
        return process

    async def all_exit(self, status: int = 0, *, timeout: float = 10.0) -> None:
        """Waits, ``timeout`` seconds for each, until every process has ended with ``status``."""
        for process in self.processes:
            await process.expect_exit(status, timeout=timeout)

    @property
    def outcome(self) -> dict[str, int | None]:
        """Status by name (of the last process of that name); None for one that runs."""
        return {process.name: process.returncode for process in self.processes}

    def transcript(self) -> str:
        """What all processes printed and were told, by time, the name of the process before each line."""
        width = max((len(process.name) for process in self.processes), default=0)
        shown = [(line, process.name) for process in self.processes for line in process.lines[-SHOWN_LINES:]]
        shown.sort(key=lambda entry: entry[0].at)
        text = [f"{line.at:8.3f} {name:{width}} {line.stream:3} {line.text[:SHOWN_COLUMNS]}" for line, name in shown]
        for process in self.processes:
            hidden = process.dropped_lines + max(0, len(process.lines) - SHOWN_LINES)
            if hidden:
                text.append(f"({hidden} lines of {process.name} are not shown)")
        return "\n".join([f"--- {self.title}: {self.outcome}", *text])

    async def _watch_deadline(self, process: Process, deadline: float) -> None:
        with trio.move_on_after(deadline):
            await process.wait(timeout=float("inf"))
            return
        self.failure = self.failure or DeadlineExceeded(f"{process.name} ran longer than {deadline:g} s")
        self._scope.cancel()

    async def _stop_all(self) -> None:
        with trio.CancelScope(shield=True):
            async with trio.open_nursery() as stoppers:
                for process in self.processes:
                    stoppers.start_soon(process.stop)
            for process in self.processes:
                await process.close_input()
            # A grandchild that holds a pipe open must not hold us: what is readable now has been read in a second.
            with trio.move_on_after(1):
                for process in self.processes:
                    await process.wait(timeout=float("inf"))


@asynccontextmanager
async def scenario(title: str, *, deadline: float = 60.0) -> AsyncIterator[Scenario]:
    """A scenario that takes at most ``deadline`` seconds; raises DeadlineExceeded in the place where it then is."""
    raised: BaseException | None = None
    async with trio.open_nursery() as nursery:
        scope = trio.CancelScope(deadline=trio.current_time() + deadline)
        stage = Scenario(title, nursery=nursery, scope=scope)
        # Kept and raised again behind the nursery, which would wrap it in an ExceptionGroup.
        try:
            with scope:
                yield stage
        except BaseException as error:
            raised = error
        if scope.cancelled_caught and stage.failure is None:
            stage.failure = DeadlineExceeded(f"the scenario took longer than {deadline:g} s")
        await stage._stop_all()
        nursery.cancel_scope.cancel()
    _keep_transcript(stage)
    failure = raised or stage.failure
    if failure is not None:
        failure.add_note(stage.transcript())
        raise failure


def _keep_transcript(stage: Scenario) -> None:
    if folder := os.environ.get(LOG_FOLDER_VARIABLE):
        Path(folder).mkdir(parents=True, exist_ok=True)
        name = "".join(letter if letter.isalnum() or letter in "-_." else "_" for letter in stage.title)
        Path(folder, f"{name}.txt").write_text(stage.transcript() + "\n")
