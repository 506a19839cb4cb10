"""Where ``ddsi demo`` plays: processes that are started, listened to, and never left behind."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections import Counter
from collections.abc import AsyncIterator, Iterable, Mapping, Sequence
from contextlib import asynccontextmanager
from pathlib import Path
from xml.sax.saxutils import escape

import trio

from .tables import shown
from .terminal import uses_colour

__all__ = ["OURS", "Actor", "Stage", "failures", "open_stage", "say"]

OURS = ("-m", f"{__package__}")
"""``python -m ddsi.cli``: what follows is what one would type after ``ddsi``."""
_PATIENCE_S = 3.0
_LOOPBACK = '<Domain><General><Interfaces><NetworkInterface address="127.0.0.1"/></Interfaces></General>{}</Domain>'
# Where the loopback has no multicast, Cyclone DDS must be told to look for others on this host, and be found there.
_FIND_BY_UNICAST = (
    "<Discovery><ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>9</MaxAutoParticipantIndex>"
    '<Peers><Peer Address="127.0.0.1"/></Peers></Discovery>'
)
_CAPTURE = "<Tracing><PacketCaptureFile>{}</PacketCaptureFile></Tracing>"
_BLUE, _GREEN, _MAGENTA, _RED = "\x1b[34m", "\x1b[32m", "\x1b[35m", "\x1b[31m"
_INTRUDER = "mallory"
_COLOURS = {
    "publisher": _BLUE,
    "subscriber": _GREEN,
    "cyclonedds": _MAGENTA,
    "alice": _BLUE,
    "bob": _GREEN,
    _INTRUDER: _RED,
}
_RESET = "\x1b[0m"
_MAX_LINE = 4096
_MAX_ERRORS = 20
_REFUSED = re.compile(r"ddsi shapes: (?:\w+: )?refused (?:participant )?\S+: (.+)")
"""What our command says of a participant, or of an endpoint of a topic, that security keeps out."""


class Actor:
    """One process: what it has said so far, counted by verb, topic and colour; whom it refused; and its errors."""

    def __init__(self, name: str, process: trio.Process, verb: str) -> None:
        self.name = name
        self.process = process
        self.verb = verb
        self.counts: Counter[tuple[str, str, str]] = Counter()
        self.errors: list[str] = []
        self.refusals: set[str] = set()
        self._refused = trio.lowlevel.ParkingLot()
        self.is_ready = trio.Event()
        self.has_ended = trio.Event()

    async def _read_output(self) -> None:
        async for line in _lines(self.process.stdout):
            if line == "READY":
                self.is_ready.set()
                continue
            words = line.split()
            if self.verb:  # our own command says the sample only
                words.insert(0, self.verb)
            self.counts[(words[0], *words[1:3])] += 1  # type: ignore[index]
            say(self.name, f"{words[0]:<9}{' '.join(words[1:])}")

    async def _read_errors(self) -> None:
        async for line in _lines(self.process.stderr):
            self.errors = [*self.errors[-_MAX_ERRORS:], line]
            if self.name != _INTRUDER and (refusal := _REFUSED.fullmatch(line)):  # whom she refuses matters to nobody
                say(self.name, f"refused  {refusal[1]}")
                self.refusals.add(refusal[1])
                self._refused.unpark_all()

    async def wait_for_refusals(self, count: int) -> None:
        """Until it has refused for so many different reasons."""
        while len(self.refusals) < count:
            await self._refused.park()

    async def follow(self) -> None:
        """Until it has ended and all that it said is counted."""
        async with trio.open_nursery() as nursery:
            nursery.start_soon(self._read_output)
            nursery.start_soon(self._read_errors)
            await self.process.wait()
        self.has_ended.set()

    async def stop(self) -> None:
        """Ask it to end, then make it."""
        if self.process.poll() is None:
            self.process.terminate()
            with trio.move_on_after(_PATIENCE_S):
                await self.process.wait()
        if self.process.poll() is None:
            self.process.kill()
            await self.process.wait()


class Stage:
    """Starts actors, all of them on the loopback interface.  ``folder`` is for their files, and goes at the end."""

    def __init__(self, nursery: trio.Nursery, folder: Path) -> None:
        self._nursery = nursery
        self.folder = folder
        self.actors: list[Actor] = []

    async def start(
        self,
        name: str,
        arguments: Sequence[str],
        *,
        verb: str,
        capture: Path | None = None,
        modules: Path | None = None,
    ) -> Actor:
        """Python with these arguments; OURS are those of our own command.

        ``capture`` gets what our own command sends and receives, as pcapng; from ``modules`` it may import.
        """
        process = await trio.lowlevel.open_process(
            [sys.executable, *arguments],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            env=_environment(capture, modules),
        )
        actor = Actor(name, process, verb)
        self.actors.append(actor)
        self._nursery.start_soon(actor.follow)
        return actor

    async def run_ours(self, words: Sequence[str]) -> tuple[int, list[str]]:
        """Our own command behind the scenes, to its end: its status, and what it complained of."""
        done = await trio.run_process(
            [sys.executable, *OURS, *words],
            stdin=subprocess.DEVNULL,
            capture_stdout=True,
            capture_stderr=True,
            check=False,
            env=_environment(),
        )
        return done.returncode, done.stderr.decode(errors="replace").splitlines()

    async def dismiss(self, actor: Actor) -> None:
        self.actors.remove(actor)
        await actor.stop()


@asynccontextmanager
async def open_stage(folder: Path) -> AsyncIterator[Stage]:
    """Whatever happens, no process is left behind."""
    actors: list[Actor] = []
    try:
        async with trio.open_nursery() as nursery:
            stage = Stage(nursery, folder)
            actors = stage.actors
            yield stage
            nursery.cancel_scope.cancel()
    finally:
        with trio.CancelScope(shield=True):
            for actor in actors:
                await actor.stop()


def failures(actors: Iterable[Actor]) -> list[str]:
    """Who ended otherwise than well, in words."""
    return [
        f"{actor.name} ended with status {actor.process.returncode}" for actor in actors if actor.process.returncode
    ]


def say(name: str, text: str) -> None:
    """A line of this actor, in its colour."""
    start, end = (_COLOURS[name], _RESET) if uses_colour() else ("", "")
    print(f"{start}{name:<11}{shown(text)}{end}", flush=True)


def _environment(capture: Path | None = None, modules: Path | None = None) -> Mapping[str, str]:
    tracing = _CAPTURE.format(escape(os.fspath(capture))) if capture is not None else ""
    paths = [os.fspath(modules)] if modules is not None else []
    paths += [given] if (given := os.environ.get("PYTHONPATH")) else []
    return {
        **os.environ,
        "PYTHONPATH": os.pathsep.join(paths),
        "DDSI_URI": f"<DDSI>{_LOOPBACK.format(tracing)}</DDSI>",
        "CYCLONEDDS_URI": f"<CycloneDDS>{_LOOPBACK.format(_FIND_BY_UNICAST)}</CycloneDDS>",
        "PYTHONUNBUFFERED": "1",
    }


async def _lines(pipe: trio.abc.ReceiveStream | None) -> AsyncIterator[str]:
    assert pipe is not None
    rest = b""
    async for octets in pipe:
        *whole, rest = (rest + octets).split(b"\n")
        rest = rest[-_MAX_LINE:]
        for line in whole:
            yield line.decode(errors="replace").rstrip()
