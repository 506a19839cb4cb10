"""A thousand random lives of a domain.  Each must end with every invariant held; see ``ddsi.simulation.invariants``.

They run in shards, so that a failure is found in one place and a parallel run can divide them.  A failing seed says how
to replay it alone.
"""

from __future__ import annotations

import pytest

from ddsi.simulation.run import run_seeds

SEEDS = 1000
SHARD = 50


@pytest.mark.parametrize(
    "start",
    [pytest.param(start, marks=[pytest.mark.slow] if start else []) for start in range(0, SEEDS, SHARD)],
)
def test_every_invariant_holds_for_every_seed(start: int) -> None:
    said: list[str] = []
    failed = run_seeds(range(start, start + SHARD), said.append)
    assert not failed, "\n".join(said)
