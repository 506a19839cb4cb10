"""Captures: what really went over the wire of a namespace, and what tshark makes of it.

``dumpcap`` and ``tshark`` come with Wireshark (Debian: the package ``tshark``).  A capture starts before the processes
whose traffic it shall hold, and says when it is ready; tshark then reads the file.
"""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
from collections.abc import AsyncIterator, Sequence
from contextlib import asynccontextmanager
from dataclasses import dataclass
from pathlib import Path

import trio

from .errors import ExpectationFailed, Unavailable
from .namespace import Namespace

__all__ = ["Capture", "capture", "require_capture_tools"]

READY_TIMEOUT = 15.0
SETTLING_TIME = 0.3
"""Seconds before the end of a capture: the kernel hands packets to dumpcap in batches."""

MAX_OCTETS = 256 << 20
"""dumpcap stops here by itself."""


@dataclass(frozen=True, slots=True)
class Capture:
    """A capture file, complete once its block is left."""

    path: Path

    def fields(self, display_filter: str, *names: str) -> list[dict[str, list[str]]]:
        """For each frame that passes the filter, the values of the fields named, in the order of the frame."""
        separator = "\x1f"
        options = [word for name in names for word in ("-e", name)]
        options += ["-E", "separator=\t", "-E", f"aggregator={separator}", "-E", "occurrence=a"]
        output = self.tshark("-Y", display_filter, "-T", "fields", *options)
        rows = [line.split("\t") for line in output.splitlines()]
        return [
            {name: cell.split(separator) if cell else [] for name, cell in zip(names, row, strict=False)}
            for row in rows
        ]

    def dissection(self, display_filter: str) -> str:
        """Every frame that passes the filter, as the full tree of text that Wireshark shows."""
        return self.tshark("-Y", display_filter, "-V")

    def count(self, display_filter: str) -> int:
        """Number of frames that pass the filter."""
        return len(self.fields(display_filter, "frame.number"))

    def malformed(self, display_filter: str) -> list[str]:
        """A line for every frame of the filter that the dissector calls malformed or in error; empty if all is well."""
        bad = f"({display_filter}) && (_ws.malformed || _ws.short || _ws.expert.severity == error)"
        rows = self.fields(bad, "frame.number", "frame.protocols", "_ws.expert.message")
        return [" ".join(f"{name}={','.join(values)}" for name, values in row.items()) for row in rows]

    def marks(self, display_filter: str, pattern: str, flags: int = 0) -> list[str]:
        """Distinct lines of the dissection that ``pattern`` is found in, in order of appearance."""
        expression = re.compile(pattern, flags)
        lines = (line.strip() for line in self.dissection(display_filter).splitlines())
        return list(dict.fromkeys(line for line in lines if expression.search(line)))

    def tshark(self, *options: str) -> str:
        """What ``tshark -r FILE OPTIONS`` prints."""
        result = subprocess.run(
            ["tshark", "-r", os.fspath(self.path), "-n", *options], check=False, capture_output=True, text=True
        )
        if result.returncode != 0:
            raise RuntimeError(f"tshark {' '.join(options)} failed: {result.stderr.strip()}")
        return result.stdout


@asynccontextmanager
async def capture(
    inside: Namespace, path: Path, *, interface: str | None = None, packet_filter: str = "udp"
) -> AsyncIterator[Capture]:
    """Captures what passes the namespace's interface, from before the block begins until after it ends."""
    require_capture_tools()
    options = ["-q", "-i", interface or inside.interface, "-f", packet_filter, "-a", f"filesize:{MAX_OCTETS >> 10}"]
    process = await trio.lowlevel.open_process(
        inside.command(["dumpcap", *options, "-w", os.fspath(path)]), stderr=subprocess.PIPE
    )
    try:
        await _until_ready(process)
        yield Capture(path)
        await trio.sleep(SETTLING_TIME)
    finally:
        with trio.CancelScope(shield=True):
            await _finish(process)


def require_capture_tools() -> None:
    """Raises Unavailable where the programs are missing."""
    for program in ("dumpcap", "tshark"):
        if shutil.which(program) is None:
            raise Unavailable(f"the program {program!r} is missing: apt-get install tshark")


async def _until_ready(process: trio.Process) -> None:
    # It says "Capturing on" first, and "File:" once the interface is open and the file written to.
    assert process.stderr is not None
    said = b""
    with trio.move_on_after(READY_TIMEOUT):
        async for piece in process.stderr:
            said += piece
            if _is_ready(said.splitlines()):
                return
    raise ExpectationFailed(f"dumpcap did not begin to capture: {said.decode(errors='replace').strip()}")


def _is_ready(lines: Sequence[bytes]) -> bool:
    return any(line.startswith(b"Capturing on") for line in lines) and any(line.startswith(b"File:") for line in lines)


async def _finish(process: trio.Process) -> None:
    """SIGINT lets dumpcap write out what it has; it is killed if that does not end it."""
    assert process.stderr is not None
    if process.poll() is None:
        process.send_signal(signal.SIGINT)
    with trio.move_on_after(5):
        async for _ in process.stderr:
            pass
        await process.wait()
    if process.poll() is None:
        process.kill()
        await process.wait()
    await process.stderr.aclose()
