"""``ddsi demo``: live data between processes on this host, with a foreign DDS among them where one is installed.

Two processes of ours run ``ddsi shapes``; the foreign one is Eclipse Cyclone DDS (``pip install cyclonedds``).  All are
told to use the loopback interface and nothing else, whatever DDSI_URI says.
"""

from __future__ import annotations

import argparse
import importlib.util
import os
import subprocess
import sys
from collections import Counter
from collections.abc import AsyncIterator, Sequence
from contextlib import asynccontextmanager
from pathlib import Path

import trio

from .arguments import domain_id
from .exit_status import ExitStatus
from .runner import run as run_async
from .tables import shown
from .terminal import uses_colour

__all__ = ["SUMMARY", "add_arguments", "run"]

SUMMARY = "show live data flowing between processes on this host"

_SAMPLES = 40
_RATE_HZ = 10
_DEADLINE_S = 45.0
_CHILD_DEADLINE_S = 35
_READY_S = 15.0
_PATIENCE_S = 3.0
_DOMAINS = range(20, 100)
"""Above what people use; from domain 101 on, ports run into those that Linux gives to anybody."""
_LOOPBACK = '<Domain><General><Interfaces><NetworkInterface address="127.0.0.1"/></Interfaces></General>{}</Domain>'
# Where the loopback has no multicast, Cyclone DDS must be told to look for others on this host, and be found there.
_FIND_BY_UNICAST = (
    "<Discovery><ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>9</MaxAutoParticipantIndex>"
    '<Peers><Peer Address="127.0.0.1"/></Peers></Discovery>'
)
_COLOURS = {"publisher": "\x1b[34m", "subscriber": "\x1b[32m", "cyclonedds": "\x1b[35m"}
_RESET = "\x1b[0m"
_MAX_LINE = 4096
_MAX_ERRORS = 20


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("-d", "--domain", type=domain_id, metavar="N", help="default: one that hardly anybody uses")


def run(arguments: argparse.Namespace) -> int:
    domain = arguments.domain if arguments.domain is not None else _DOMAINS[os.getpid() % len(_DOMAINS)]
    return run_async(_Demo(domain).run)


class _Actor:
    """One process: what it has said so far, counted by verb, topic and colour; and its errors."""

    def __init__(self, name: str, process: trio.Process, verb: str) -> None:
        self.name = name
        self.process = process
        self.verb = verb
        self.counts: Counter[tuple[str, str, str]] = Counter()
        self.errors: list[str] = []
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
            _say(self.name, f"{words[0]:<9}{' '.join(words[1:])}")

    async def _read_errors(self) -> None:
        async for line in _lines(self.process.stderr):
            self.errors = [*self.errors[-_MAX_ERRORS:], line]

    async def follow(self) -> None:
        """Until it has ended and all that it said is counted."""
        async with trio.open_nursery() as nursery:
            nursery.start_soon(self._read_output)
            nursery.start_soon(self._read_errors)
            await self.process.wait()
        self.has_ended.set()


class _Demo:
    """The play: who acts, what must arrive, and what became of it."""

    def __init__(self, domain: int) -> None:
        self._domain = domain
        self._actors: list[_Actor] = []

    async def run(self) -> int:
        print(f"Live data between processes on this host: domain {self._domain}, loopback only.", flush=True)
        flaws: list[str] = []
        with trio.move_on_after(_DEADLINE_S) as deadline:
            async with self._stage() as nursery:
                foreign = await self._start_foreign(nursery)
                await self._start_ours(nursery, with_foreign=foreign is not None)
                for actor in self._actors:
                    await actor.has_ended.wait()
                flaws = self._flaws(foreign)
        if deadline.cancelled_caught:
            flaws = [f"the demo did not come to its end within {_DEADLINE_S:g} s"]
        return self._conclude(flaws)

    @asynccontextmanager
    async def _stage(self) -> AsyncIterator[trio.Nursery]:
        """Whatever happens, no process is left behind."""
        try:
            async with trio.open_nursery() as nursery:
                yield nursery
                nursery.cancel_scope.cancel()
        finally:
            with trio.CancelScope(shield=True):
                for actor in self._actors:
                    await _stop(actor.process)

    async def _start_foreign(self, nursery: trio.Nursery) -> _Actor | None:
        """The foreign peer, once it is up: the play must not wait for one that cannot come."""
        if importlib.util.find_spec("cyclonedds") is None:
            print("No other DDS is installed here (pip install cyclonedds): two processes of ours.", flush=True)
            return None
        script = os.fspath(Path(__file__).with_name("cyclone_peer.py"))
        # -P: modules beside the script must not take the place of the standard library's.
        command = ["-P", script, str(self._domain), str(_SAMPLES), str(_CHILD_DEADLINE_S)]
        actor = await self._start(nursery, "cyclonedds", command, verb="")
        with trio.move_on_after(_READY_S):
            async with trio.open_nursery() as waiting:
                waiting.start_soon(_then_cancel, actor.is_ready, waiting.cancel_scope)
                waiting.start_soon(_then_cancel, actor.has_ended, waiting.cancel_scope)
        if actor.is_ready.is_set():
            return actor
        self._actors.remove(actor)
        await _stop(actor.process)
        reason = f" ({shown(actor.errors[-1], 200)})" if actor.errors else ""
        print(f"The cyclonedds that is installed here does not start{reason}: two processes of ours.", flush=True)
        return None

    async def _start_ours(self, nursery: trio.Nursery, *, with_foreign: bool) -> None:
        common = ["-d", str(self._domain), "--reliable", "--keep-all", "--time", str(_CHILD_DEADLINE_S)]
        topics, total, readers = ("Square,Circle", 2 * _SAMPLES, 2) if with_foreign else ("Square", _SAMPLES, 1)
        subscribe = ["shapes", "sub", "-t", topics, "-n", str(total)]
        publish = ["shapes", "pub", "-t", "Square", "-c", "BLUE", "-n", str(_SAMPLES), "--rate", str(_RATE_HZ)]
        publish += ["--wait", str(readers)]
        ours = ["-m", f"{__package__}"]
        await self._start(nursery, "subscriber", [*ours, *subscribe, *common], verb="received")
        await self._start(nursery, "publisher", [*ours, *publish, *common], verb="wrote")

    async def _start(self, nursery: trio.Nursery, name: str, arguments: Sequence[str], *, verb: str) -> _Actor:
        process = await trio.lowlevel.open_process(
            [sys.executable, *arguments],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            env={**os.environ, **_environment()},
        )
        actor = _Actor(name, process, verb)
        self._actors.append(actor)
        nursery.start_soon(actor.follow)
        return actor

    def _flaws(self, foreign: _Actor | None) -> list[str]:
        """What did not arrive, in words."""
        by_name = {actor.name: actor for actor in self._actors}
        expected = [("subscriber", "publisher", "Square", "BLUE")]
        if foreign is not None:
            expected += [("subscriber", "cyclonedds", "Circle", "RED"), ("cyclonedds", "publisher", "Square", "BLUE")]
        flaws = []
        for receiver, sender, topic, colour in expected:
            count = by_name[receiver].counts["received", topic, colour]
            if count != _SAMPLES:
                flaws.append(f"{receiver} received {count} of {_SAMPLES} samples of {sender}")
            else:
                print(f"{receiver} received all {count} samples of {sender}.")
        for actor in self._actors:
            if actor.process.returncode and not flaws:
                flaws.append(f"{actor.name} ended with status {actor.process.returncode}")
        return flaws

    def _conclude(self, flaws: list[str]) -> int:
        if not flaws:
            return ExitStatus.OK
        print(f"ddsi demo: {'; '.join(flaws)}", file=sys.stderr)
        for actor in self._actors:
            for line in actor.errors:
                print(f"  {actor.name}: {shown(line)}", file=sys.stderr)
        return ExitStatus.NOT_AS_HOPED


def _environment() -> dict[str, str]:
    return {
        "DDSI_URI": f"<DDSI>{_LOOPBACK.format('')}</DDSI>",
        "CYCLONEDDS_URI": f"<CycloneDDS>{_LOOPBACK.format(_FIND_BY_UNICAST)}</CycloneDDS>",
        "PYTHONUNBUFFERED": "1",
    }


def _say(name: str, text: str) -> None:
    start, end = (_COLOURS[name], _RESET) if uses_colour() else ("", "")
    print(f"{start}{name:<11}{shown(text)}{end}", flush=True)


async def _lines(pipe: trio.abc.ReceiveStream | None) -> AsyncIterator[str]:
    assert pipe is not None
    rest = b""
    async for octets in pipe:
        *whole, rest = (rest + octets).split(b"\n")
        rest = rest[-_MAX_LINE:]
        for line in whole:
            yield line.decode(errors="replace").rstrip()


async def _then_cancel(event: trio.Event, scope: trio.CancelScope) -> None:
    await event.wait()
    scope.cancel()


async def _stop(process: trio.Process) -> None:
    if process.poll() is None:
        process.terminate()
        with trio.move_on_after(_PATIENCE_S):
            await process.wait()
    if process.poll() is None:
        process.kill()
        await process.wait()
