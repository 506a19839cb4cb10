"""Codec: a sample to octets and back, in one process, without a participant.

Both stacks are given values in the form that is quickest for each: octets as ``bytes``, a megabyte of numbers as a
numpy array here and as a list there.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

from benchmarks.benchmark import FLOOR, OURS, PEER, Benchmark, Better, Figure, Side
from benchmarks.session import Session

__all__ = ["BENCHMARKS"]

# What it is, and operations in a round: some tenths of a second on the slower side.
_SAMPLES = {
    "shape": ("ShapeType", 20_000),
    "1KiB": ("1 KiB of octets", 5_000),
    "64KiB": ("64 KiB of octets", 100),
    "1MiB": ("1 MiB of octets", 8),
    "points": ("a header and 100 points", 500),
    "mutable": ("a mutable struct", 10_000),
    "union": ("a union in a struct", 20_000),
    "structs": ("1,000 structs of numbers", 50),
    "named-structs": ("1,000 structs of numbers and a string", 50),
    "float64": ("1 MiB of float64, numpy", 50),
}


def _measure(role: str, name: str, label: str, count: int) -> Callable[[Side, Session], Mapping[str, float]]:
    def measure(side: Side, session: Session) -> Mapping[str, float]:
        worker = session.start_module(f"{side.module}_codec", role, name=label, count=session.count(count))
        return {name: worker.result()["us"]}

    return measure


BENCHMARKS = tuple(
    Benchmark(
        name := f"{role}/{label}",
        f"{role} one sample ({what})",
        (Figure(name, "us", Better.LOWER),),
        _measure(role, name, label, count),
        (OURS, PEER, FLOOR),
    )
    for role in ("serialise", "deserialise")
    for label, (what, count) in _SAMPLES.items()
)
