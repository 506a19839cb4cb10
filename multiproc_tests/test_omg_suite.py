"""The OMG's interoperability suite, each case in a namespace of its own: ours with ours, and with Cyclone DDS.

An ordinary run plays some cases with fewer samples; ``--all-peers`` plays all as the suite does, and ``python -m
multiproc_tests.omg`` writes ``docs/interop/omg.md`` from them.
"""

from __future__ import annotations

import pytest

from .framework import async_test
from .omg import CASES, CYCLONE, FULL, OURS, PROGRAMS, QUICK, Effort, ShapeMain, SuiteCase, play
from .omg.limits import known_limit
from .omg.play import Unsupported

QUICK_AMONG_OURS = (
    "Domain_2",
    "DataRepresentation_1",
    "Reliability_0",
    "Reliability_1",
    "History_1",
    "Partition_1",
    "Durability_16",
    "Durability_17",
)
QUICK_WITH_CYCLONE = (
    "DataRepresentation_0",
    "DataRepresentation_3",
    "Reliability_5",
    "Durability_7",
    "Durability_17",
    "LargeData_0",
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
    """The suite's codes are found.  What a program says it does not support is skipped."""
    limit = known_limit(case, publisher.name, subscriber.name)
    try:
        await play(case, publisher, subscriber, effort)
    except Unsupported as error:
        pytest.skip(str(error))
    except AssertionError as error:
        if limit is not None:
            pytest.xfail(f"{limit} ({error})")
        raise


def test_what_is_quick_exists() -> None:
    assert {*QUICK_AMONG_OURS, *QUICK_WITH_CYCLONE} <= {case.name for case in CASES}
