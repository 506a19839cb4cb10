"""Hooks: what a participant without security pays for the moments at which the core asks its security hooks.

The time that these calls take alone, of the processor time that a small sample takes, at both ends together.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from benchmarks.benchmark import OURS, Benchmark, Better, Figure, Side
from benchmarks.session import Session

from .throughput import measure_throughput

__all__ = ["BENCHMARKS"]

_NAME = "hooks/plain"
_COUNT = 20_000


def _measure(side: Side, session: Session) -> Mapping[str, float]:
    plain = measure_throughput(side, session, 0, _COUNT)
    options = {"domain": session.domain, "octets": 0, "count": session.count(_COUNT)}
    counting = replace(side, module="benchmarks.sides.hooks")
    receiver = session.start(counting, "receive", **options)
    receiver.wait_ready()
    ends = [session.start(counting, "send", **options).result(), receiver.result()]
    hooks_us = sum(end["hooks_us"] for end in ends)
    return {
        _NAME: hooks_us / (plain["receiver_us"] + plain["sender_us"]) * 100,
        "calls/sample": sum(end["calls"] for end in ends),
        "us/sample": hooks_us,
    }


BENCHMARKS = (
    Benchmark(
        _NAME,
        "share of the plaintext hooks in the processor time of a small sample",
        (Figure(_NAME, "%", Better.LOWER),),
        _measure,
        (OURS,),
    ),
)
