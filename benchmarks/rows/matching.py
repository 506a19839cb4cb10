"""Matching: from the start of a participant until its writer and its reader are matched with one that is there already.

What has been imported before does not count.
"""

from __future__ import annotations

from collections.abc import Mapping

from benchmarks.benchmark import Benchmark, Better, Figure, Side
from benchmarks.session import Session

__all__ = ["BENCHMARKS"]

_NAME = "matched"


def _measure(side: Side, session: Session) -> Mapping[str, float]:
    session.start(side, "await_company", domain=session.domain).wait_ready()
    joined = session.start(side, "join", domain=session.domain)
    return {_NAME: joined.result()["ms"]}


BENCHMARKS = (
    Benchmark(
        _NAME,
        "from the start of a participant until its endpoints are matched",
        (Figure(_NAME, "ms", Better.LOWER),),
        _measure,
    ),
)
