"""Worker: one process of a side, which plays a role and says so in lines of JSON on its standard output.

Every worker stays on the loopback interface, in a domain and under a domain tag of its own run, so that what else
runs on the machine is neither disturbed nor met.
"""

from __future__ import annotations

import atexit
import json
import os
import queue
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from types import TracebackType
from typing import IO, Self

__all__ = ["Worker", "WorkerFailed"]

_ROOT = Path(__file__).parents[1]
_INTERFACE = '<General><Interfaces><NetworkInterface name="lo"/></Interfaces></General>'
_GRACE_S = 3.0
_LAST_WORDS = 600


class WorkerFailed(Exception):
    """A process ended, or fell silent, before it had said what it was asked for."""


class Worker:
    """A running role of ``module``; as a context manager, it has ended when the block is left.

    ``deadline``: on ``time.monotonic``'s clock; whoever waits for the worker longer than that gets WorkerFailed.
    """

    def __init__(self, module: str, role: str, options: Mapping[str, object], *, tag: str, deadline: float) -> None:
        self.name = f"{module.rpartition('.')[2]} {role}"
        self._deadline = deadline
        self._errors: IO[bytes] = tempfile.TemporaryFile()  # noqa: SIM115  closed in stop()
        self._lines: queue.SimpleQueue[str | None] = queue.SimpleQueue()
        self._process = subprocess.Popen(
            [sys.executable, "-m", module, role, json.dumps(options)],
            cwd=_ROOT,
            env=_environment(tag),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=self._errors,
            text=True,
        )
        self._listener = threading.Thread(target=self._listen, daemon=True)
        self._listener.start()

    def _listen(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            self._lines.put(line)
        self._lines.put(None)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self.stop()

    def wait_ready(self) -> None:
        """Until the role can be talked to by another.  Raises WorkerFailed."""
        self._expect("ready")

    def result(self) -> dict[str, float]:
        """What the role measured, when it is done.  Raises WorkerFailed."""
        found = self._expect("result")
        if not isinstance(found, dict) or not all(isinstance(value, int | float) for value in found.values()):
            raise WorkerFailed(f"{self.name}: its result is no table of numbers: {found!r}")
        return {str(name): float(value) for name, value in found.items()}

    def _expect(self, word: str) -> object:
        while True:
            try:
                line = self._lines.get(timeout=max(self._deadline - time.monotonic(), 0.001))
            except queue.Empty:
                raise WorkerFailed(f"{self.name}: no {word} before the deadline{self._last_words()}") from None
            if line is None:
                status = self._process.wait()
                raise WorkerFailed(f"{self.name}: ended with status {status} before {word}{self._last_words()}")
            try:
                said = json.loads(line)
            except ValueError:
                continue  # somebody printed something; what counts is JSON
            if isinstance(said, dict) and word in said:
                return said[word]

    def _last_words(self) -> str:
        self._errors.seek(0, os.SEEK_END)
        self._errors.seek(max(self._errors.tell() - _LAST_WORDS, 0))
        text = self._errors.read().decode(errors="replace").strip()
        return f": ...{text}" if text else ""

    def stop(self) -> None:
        """End the process, politely first.  Safe twice."""
        if self._process.poll() is None:
            self._process.terminate()
            try:
                self._process.wait(_GRACE_S)
            except subprocess.TimeoutExpired:
                self._process.kill()
                self._process.wait()
        self._listener.join()
        if self._process.stdout is not None:
            self._process.stdout.close()
        self._errors.close()


def _environment(tag: str) -> dict[str, str]:
    """This process's environment with both stacks on loopback: a setting of the user's may name a network."""
    discovery = f"<Discovery><Tag>{tag}</Tag></Discovery>"
    environment = dict(os.environ)
    for variable, root in (("DDSI_URI", "DDSI"), ("CYCLONEDDS_URI", "CycloneDDS")):
        environment[variable] = f"<{root}><Domain>{_INTERFACE}{discovery}</Domain></{root}>"
    if environment.pop("PYTHONDONTWRITEBYTECODE", ""):
        environment["PYTHONPYCACHEPREFIX"] = _bytecode_folder()
    return environment


@cache
def _bytecode_folder() -> str:
    """Where nobody may keep bytecode, it lies here for this run: else each process would compile all that it imports,
    which is never so where packages are installed."""
    folder = tempfile.mkdtemp(prefix="benchmark-bytecode-")
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return folder
