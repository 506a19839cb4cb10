"""``ddsi demo``: live data between processes on this host, with a foreign DDS among them where one is installed.

Two processes of ours run ``ddsi shapes``; the foreign one is Eclipse Cyclone DDS (``pip install cyclonedds``).  Then a
secured pair and an intruder play (:mod:`.demo_secured`).  All are told to use the loopback interface and nothing else,
whatever DDSI_URI says.
"""

from __future__ import annotations

import argparse
import importlib.util
import os
import sys
import tempfile
from pathlib import Path

import trio

from .arguments import domain_id
from .demo_secured import SecuredScene, missing_packages
from .demo_stage import OURS, Actor, Stage, failures, open_stage
from .exit_status import ExitStatus
from .runner import run as run_async
from .tables import shown

__all__ = ["SUMMARY", "add_arguments", "run"]

SUMMARY = "show live data flowing between processes on this host"

_SAMPLES = 40
_RATE_HZ = 10
_DEADLINE_S = 50.0
"""Processes that are stopped then get a few seconds more; with them it must end within a minute."""
_CHILD_DEADLINE_S = 35
_READY_S = 15.0
_DOMAINS = range(20, 100)
"""Above what people use; from domain 101 on, ports run into those that Linux gives to anybody."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("-d", "--domain", type=domain_id, metavar="N", help="default: one that hardly anybody uses")


def run(arguments: argparse.Namespace) -> int:
    domain = arguments.domain if arguments.domain is not None else _DOMAINS[os.getpid() % len(_DOMAINS)]
    return run_async(_Demo(domain).run)


class _Demo:
    """The play: who acts, what must arrive, and what became of it."""

    def __init__(self, domain: int) -> None:
        self._domain = domain

    async def run(self) -> int:
        print(f"Live data between processes on this host: domain {self._domain}, loopback only.", flush=True)
        flaws: list[str] = []
        actors: list[Actor] = []
        with tempfile.TemporaryDirectory(prefix="ddsi-demo-") as folder, trio.move_on_after(_DEADLINE_S) as deadline:
            async with open_stage(Path(folder)) as stage:
                actors = stage.actors
                flaws = await self._play(stage)
        if deadline.cancelled_caught:
            flaws = [f"the demo did not come to its end within {_DEADLINE_S:g} s"]
        return _conclude(flaws, actors)

    async def _play(self, stage: Stage) -> list[str]:
        """Both scenes; the second only if the first went well."""
        capture = stage.folder / "publisher.pcapng"
        missing = missing_packages()
        secured = SecuredScene(stage, self._domain)
        async with trio.open_nursery() as nursery:
            if not missing:
                nursery.start_soon(secured.prepare)
            flaws = await self._play_in_clear(stage, capture)
        if missing:
            print(f"Security is not shown: {' and '.join(missing)} missing; pip install 'ddsi[security]'.")
        if flaws or missing:
            return flaws
        return await secured.play() or secured.compare_wires(capture)

    async def _play_in_clear(self, stage: Stage, capture: Path) -> list[str]:
        foreign = await self._start_foreign(stage)
        ours = await self._start_ours(stage, with_foreign=foreign is not None, capture=capture)
        for actor in stage.actors:
            await actor.has_ended.wait()
        return _flaws(*ours, foreign)

    async def _start_foreign(self, stage: Stage) -> Actor | None:
        """The foreign peer, once it is up: the play must not wait for one that cannot come."""
        if importlib.util.find_spec("cyclonedds") is None:
            print("No other DDS is installed here (pip install cyclonedds): two processes of ours.", flush=True)
            return None
        script = os.fspath(Path(__file__).with_name("cyclone_peer.py"))
        # -P: modules beside the script must not take the place of the standard library's.
        command = ["-P", script, str(self._domain), str(_SAMPLES), str(_CHILD_DEADLINE_S)]
        actor = await stage.start("cyclonedds", command, verb="")
        with trio.move_on_after(_READY_S):
            async with trio.open_nursery() as waiting:
                waiting.start_soon(_then_cancel, actor.is_ready, waiting.cancel_scope)
                waiting.start_soon(_then_cancel, actor.has_ended, waiting.cancel_scope)
        if actor.is_ready.is_set():
            return actor
        await stage.dismiss(actor)
        reason = f" ({shown(actor.errors[-1], 200)})" if actor.errors else ""
        print(f"The cyclonedds that is installed here does not start{reason}: two processes of ours.", flush=True)
        return None

    async def _start_ours(self, stage: Stage, *, with_foreign: bool, capture: Path) -> tuple[Actor, Actor]:
        common = ["-d", str(self._domain), "--reliable", "--keep-all", "--time", str(_CHILD_DEADLINE_S)]
        topics, total, readers = ("Square,Circle", 2 * _SAMPLES, 2) if with_foreign else ("Square", _SAMPLES, 1)
        subscribe = ["shapes", "sub", "-t", topics, "-n", str(total)]
        publish = ["shapes", "pub", "-t", "Square", "-c", "BLUE", "-n", str(_SAMPLES), "--rate", str(_RATE_HZ)]
        publish += ["--wait", str(readers), "--transient-local"]
        subscriber = await stage.start("subscriber", [*OURS, *subscribe, *common], verb="received")
        publisher = await stage.start("publisher", [*OURS, *publish, *common], verb="wrote", capture=capture)
        return subscriber, publisher


def _flaws(subscriber: Actor, publisher: Actor, foreign: Actor | None) -> list[str]:
    """What did not arrive, in words."""
    expected = [(subscriber, publisher, "Square", "BLUE")]
    if foreign is not None:
        expected += [(subscriber, foreign, "Circle", "RED"), (foreign, publisher, "Square", "BLUE")]
    flaws = []
    for receiver, sender, topic, colour in expected:
        count = receiver.counts["received", topic, colour]
        if count != _SAMPLES:
            flaws.append(f"{receiver.name} received {count} of {_SAMPLES} samples of {sender.name}")
        else:
            print(f"{receiver.name} received all {count} samples of {sender.name}.", flush=True)
    return flaws or failures([actor for actor in (subscriber, publisher, foreign) if actor is not None])


def _conclude(flaws: list[str], actors: list[Actor]) -> int:
    if not flaws:
        return ExitStatus.OK
    print(f"ddsi demo: {'; '.join(flaws)}", file=sys.stderr)
    for actor in actors:
        for line in actor.errors:
            print(f"  {actor.name}: {shown(line)}", file=sys.stderr)
    return ExitStatus.NOT_AS_HOPED


async def _then_cancel(event: trio.Event, scope: trio.CancelScope) -> None:
    await event.wait()
    scope.cancel()
