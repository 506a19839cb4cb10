"""Scale: what one more instance, reader or topic costs where there are many.

``growth``: the cost of each, divided by what it is with a tenth as many.  1 is linear: what there is costs the same
however much more there is.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

from benchmarks.benchmark import OURS, Benchmark, Better, Figure, Side
from benchmarks.session import Session

__all__ = ["BENCHMARKS"]

_TENTH = 10
_THINGS = {
    "instances": (10_000, "a sample to each of 10,000 instances, of which the reader keeps the latest"),
    "readers": (100, "a sample to each of 100 readers of one topic"),
    "topics": (1_000, "1,000 topics with a writer and a reader each, until all are matched"),
}


def _measure(name: str, role: str, count: int) -> Callable[[Side, Session], Mapping[str, float]]:
    def measure(side: Side, session: Session) -> Mapping[str, float]:
        many = session.count(count, least=2 * _TENTH)
        few, found = (
            session.start_module("benchmarks.sides.scale", role, domain=session.domain, count=number).result()
            for number in (many // _TENTH, many)
        )
        return {
            name: found["us"],
            f"{name} growth": found["us"] / few["us"],
            f"{name} memory": found["kib"],
            "us/each of a tenth": few["us"],
            "KiB/each of a tenth": few["kib"],
        }

    return measure


BENCHMARKS = tuple(
    Benchmark(
        name := f"scale/{count}-{role}",
        summary,
        (
            Figure(name, "us/each", Better.LOWER),
            Figure(f"{name} growth", "x a tenth", Better.LOWER),
            Figure(f"{name} memory", "KiB/each", Better.LOWER),
        ),
        _measure(name, role, count),
        (OURS,),
    )
    for role, (count, summary) in _THINGS.items()
)
