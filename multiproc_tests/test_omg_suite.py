"""The OMG's interoperability suite, each case in a namespace of its own: ours with ours, and with Cyclone DDS.

An ordinary run plays some cases, none that counts milliseconds, with fewer samples; ``--all-peers`` plays all as the
suite does, and ``python -m multiproc_tests.omg`` writes ``docs/interop/omg.md`` from them.
"""

from __future__ import annotations

import os
import pty
import select
import subprocess

import pytest

from .framework import async_test, namespace
from .omg import CASES, CYCLONE, FULL, OURS, PROGRAMS, QUICK, Effort, ShapeMain, SuiteCase, play
from .omg.limits import LIMITS, known_limit
from .omg.play import Unsupported
from .peers.peer import ROOT, network_environment

QUICK_AMONG_OURS = (
    "Domain_2",
    "DataRepresentation_1",
    "Reliability_0",
    "Reliability_5",
    "Partition_1",
    "Durability_16",
    "Durability_17",
    "Ownership_3",
    "Deadline_3",
    "Cft_1",
    "OrderedAccess_5",
    "CoherentSets_11",
    "CoherentSets_21",
)
QUICK_WITH_CYCLONE = (
    "DataRepresentation_0",
    "DataRepresentation_3",
    "Reliability_5",
    "Durability_7",
    "Durability_17",
    "LargeData_0",
    "CoherentSets_8",
)


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    if metafunc.fixturenames[:4] == ["case", "publisher", "subscriber", "effort"]:
        plays_all = metafunc.config.getoption("--all-peers", default=False)
        effort = FULL if plays_all else QUICK
        pairs = [(a, b) for a in PROGRAMS for b in PROGRAMS if OURS in (a, b)]
        chosen = [
            pytest.param(case, *pair, effort, id=f"{case}-{pair[0]}-{pair[1]}", marks=_marks(*pair))
            for case in CASES
            for pair in pairs
            if plays_all or case.name in (QUICK_WITH_CYCLONE if CYCLONE in pair else QUICK_AMONG_OURS)
        ]
        metafunc.parametrize(("case", "publisher", "subscriber", "effort"), chosen)


def _marks(*pair: ShapeMain) -> list[pytest.MarkDecorator]:
    return [pytest.mark.peers] if CYCLONE in pair else []


@async_test
async def test_omg_suite(case: SuiteCase, publisher: ShapeMain, subscriber: ShapeMain, effort: Effort) -> None:
    """The suite's codes are found.  What a program says it does not support is skipped, but by the ordinary run."""
    limit = known_limit(case, publisher.name, subscriber.name)
    try:
        await play(case, publisher, subscriber, effort)
    except Unsupported as error:
        if effort is QUICK:
            raise
        pytest.skip(str(error))
    except AssertionError as error:
        if limit is not None:
            pytest.xfail(f"{limit} ({error})")
        raise


def test_it_speaks_line_by_line_to_a_terminal_and_leaves_on_ctrl_c() -> None:
    """As the suite's scripts start it: in a pseudo-terminal, told to leave by the character that means SIGINT."""
    with namespace() as host:
        ours, theirs = pty.openpty()
        # setsid makes the terminal the one whose Ctrl+C is meant for the program.
        command = ["setsid", "--ctty", *host.command([*OURS.locate(), "-P", "-t", "Square", "-x", "2", "-w"])]
        environment = {**os.environ, **network_environment(host.interface)}
        process = subprocess.Popen(command, stdin=theirs, stdout=theirs, stderr=theirs, env=environment, cwd=ROOT)
        os.close(theirs)
        try:
            _read_until(ours, b"[20]\r\n")
            os.write(ours, b"\x03")
            _read_until(ours, b"Done.\r\n")
            assert process.wait(timeout=30) == 0
        finally:
            process.kill()
            process.wait()
            os.close(ours)


def _read_until(terminal: int, words: bytes) -> None:
    seen = b""
    while words not in seen:
        ready, _, _ = select.select([terminal], [], [], 30)
        assert ready, f"{words!r} did not come after {seen[-500:]!r}"
        seen += os.read(terminal, 4096)


def test_what_is_quick_or_limited_exists() -> None:
    names = {case.name for case in CASES}
    assert {*QUICK_AMONG_OURS, *QUICK_WITH_CYCLONE} <= names
    assert {name for name, _, _ in LIMITS} <= names
    assert not any((name, OURS.name, OURS.name) in LIMITS for name in names), "what we cannot do is a failure"
