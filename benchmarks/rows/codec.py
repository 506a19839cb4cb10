"""Codec: a sample to octets and back, in one process, without a participant.

Both stacks are given octets in the form that is quickest for each: ``bytes``.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

from benchmarks.benchmark import FLOOR, OURS, PEER, Benchmark, Better, Figure, Side
from benchmarks.session import Session

__all__ = ["BENCHMARKS"]

# Octets beside the index (0: a ShapeType), and operations in a round: some tenths of a second on the slower side.
_SAMPLES = {"shape": (0, 20_000), "1KiB": (1 << 10, 5_000), "64KiB": (1 << 16, 100), "1MiB": (1 << 20, 8)}


def _measure(role: str, name: str, octets: int, count: int) -> Callable[[Side, Session], Mapping[str, float]]:
    def measure(side: Side, session: Session) -> Mapping[str, float]:
        worker = session.start(side, role, octets=octets, count=session.count(count))
        return {name: worker.result()["us"]}

    return measure


BENCHMARKS = tuple(
    Benchmark(
        name := f"{role}/{label}",
        f"{role} one sample ({'ShapeType' if not octets else f'{label} of octets'})",
        (Figure(name, "us", Better.LOWER),),
        _measure(role, name, octets, count),
        (OURS, PEER, FLOOR),
    )
    for role in ("serialise", "deserialise")
    for label, (octets, count) in _SAMPLES.items()
)
