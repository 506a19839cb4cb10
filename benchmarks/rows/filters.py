"""Content filters: what a sample costs a writer whose readers filter, and how that grows with their number.

Each reader wants one of 32 samples, so with 32 readers of different filters every sample is evaluated 32 times, and
goes to one of them, behind a GAP.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

from benchmarks.benchmark import OURS, Benchmark, Better, Figure, Side
from benchmarks.session import Session

__all__ = ["BENCHMARKS"]

_COUNT = 6_400


def _measure(name: str, readers: int) -> Callable[[Side, Session], Mapping[str, float]]:
    def measure(side: Side, session: Session) -> Mapping[str, float]:
        filtering = replace(side, module="benchmarks.sides.filters")
        options = {"domain": session.domain, "readers": readers, "count": session.count(_COUNT)}
        with session.start(filtering, "receive", **options) as receiver:
            receiver.wait_ready()
            with session.start(filtering, "send", **options) as sender:
                received, sent = receiver.result(), sender.result()
        return {
            name: sent["processor_us"],
            "receiver processor us/sample": received["processor_us"],
            "MiB of readers": received["mib"],
        }

    return measure


BENCHMARKS = tuple(
    Benchmark(
        name := f"filters/{readers}",
        f"a sample at a writer whose readers have {readers} different content filter{'s' if readers > 1 else ''}",
        (Figure(name, "us/sample", Better.LOWER),),
        _measure(name, readers),
        (OURS,),
    )
    for readers in (1, 8, 32)
)
