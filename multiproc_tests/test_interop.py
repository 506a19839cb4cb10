"""Ours with every peer, in both directions, and ours with ours: each case in a namespace of its own.

An ordinary run plays the cases that are marked as quick; ``--all-peers`` plays all, also of the peers among themselves.
``python -m multiproc_tests.interop`` does the same from the command line and writes a report.
"""

from __future__ import annotations

import pytest

from .framework import Unavailable, async_test
from .matrix import ALL_CASES, Case, missing_ability
from .matrix.limits import known_limit
from .matrix.outcome import play
from .peers.catalogue import FOREIGN, OURS, PEERS
from .peers.peer import Peer


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    plays_all = metafunc.config.getoption("--all-peers", default=False)
    names = metafunc.fixturenames
    if names[:3] == ["case", "publisher", "subscriber"]:
        pairs = [(a, b) for a in PEERS for b in PEERS if plays_all or OURS in (a, b)]
        chosen = [
            pytest.param(case, *pair, id=f"{case.name}-{pair[0]}-{pair[1]}", marks=_marks(*pair))
            for case in ALL_CASES
            for pair in pairs
            if (plays_all or case.is_quick_for(pair[0].name, pair[1].name)) and missing_ability(case, *pair) is None
        ]
        metafunc.parametrize(("case", "publisher", "subscriber"), chosen)


def _marks(*pair: Peer) -> list[pytest.MarkDecorator]:
    return [pytest.mark.peers] if any(peer in FOREIGN for peer in pair) else []


@async_test
async def test_interop(case: Case, publisher: Peer, subscriber: Peer) -> None:
    """The claim of the case holds between the two; see ``matrix/cases.py`` for the claims.

    A case with a foreign peer is played once more when it fails: how others take a late scheduler is not ours to judge.
    Ours with ours has one chance.
    """
    limit = known_limit(case, publisher.name, subscriber.name)
    try:
        await play(case, publisher, subscriber)
    except Unavailable:
        raise
    except AssertionError as error:
        if limit is not None:
            pytest.xfail(f"{limit} ({error})")
        if not any(peer in FOREIGN for peer in (publisher, subscriber)):
            raise
        print(f"first attempt: {error}")
        await play(case, publisher, subscriber)
