"""Fifty participants on one host, a process each: everybody finds everybody, soon and at a fair price."""

from __future__ import annotations

import os
import sys
import time

import pytest

from .framework import async_test, namespace, scenario
from .peers.peer import ROOT, network_environment

PROCESSES = 50
SECONDS = 30.0
"""From the first start to the last match, where nothing else runs; two cores take 22 to 24."""

CPU_SECONDS_PER_PAIR = 0.015
"""For one to match with another; two cores with fifty processes between them take 0.010."""

QUIET = 2.0
"""Where starting took longer than this many times its processor time, a clock says nothing about discovery."""

PROGRAM = "multiproc_tests.peers.programs.crowd"


@pytest.mark.alone
@async_test
async def test_fifty_processes_on_one_host_all_match() -> None:
    """Processor time has a bound of its own; what they say to each other meanwhile, asking again, grows with the time.

    Starting needs nothing but the processor: where it took twice the time that it used, somebody else had half.
    """
    with namespace() as host:
        async with scenario(f"a crowd of {PROCESSES}", deadline=500) as stage:
            began_at = time.monotonic()
            command = [sys.executable, "-m", PROGRAM, str(PROCESSES)]
            environment = network_environment(host.interface)
            crowd = [
                await stage.start(f"one {number}", command, namespace=host, environment=environment, folder=ROOT)
                for number in range(PROCESSES)
            ]
            started = [float((await one.expect(r"READY (\S+)", timeout=300))[1]) for one in crowd]
            stretch = max(1.0, (time.monotonic() - began_at) * (os.cpu_count() or 1) / sum(started))
            matched = [float((await one.expect(r"MATCHED (\S+)", timeout=300))[1]) for one in crowd]
            seconds = time.monotonic() - began_at
            # Who leaves first still has them all; the others see it go.
            await crowd[0].send("leave")
            found = int((await crowd[0].expect(r"DONE \S+ (\d+)", timeout=60))[1])
            for one in crowd[1:]:
                await one.send("leave")
            await stage.all_exit(timeout=120)
    per_pair = (sum(matched) - sum(started)) / (PROCESSES * (PROCESSES - 1))
    print(f"{seconds:.1f} s, stretched {stretch:.1f} times; {sum(started):.1f} s of processor time for starting")
    print(f"{1000 * per_pair:.1f} ms of processor time a pair for matching")
    assert per_pair < CPU_SECONDS_PER_PAIR * stretch
    if stretch < QUIET:
        assert seconds < SECONDS * stretch
        assert found == PROCESSES
