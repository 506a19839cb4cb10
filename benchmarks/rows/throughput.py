"""Throughput: one writer, one reader, reliable and KEEP_ALL, each in its own process; samples received in a second.

The reader measures from its first sample to its last, and checks that it got every one.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

from benchmarks.benchmark import Benchmark, Better, Figure, Side
from benchmarks.session import Session

__all__ = ["BENCHMARKS"]

# Octets beside the index (0: a ShapeType), and samples in a round: about a second on the slower side.
_SAMPLES = {"shape": (0, 40_000), "1KiB": (1 << 10, 20_000), "16KiB": (1 << 14, 3_000), "1MiB": (1 << 20, 60)}


def _measure(name: str, octets: int, count: int) -> Callable[[Side, Session], Mapping[str, float]]:
    def measure(side: Side, session: Session) -> Mapping[str, float]:
        options = {"domain": session.domain, "octets": octets, "count": session.count(count)}
        receiver = session.start(side, "receive", **options)
        receiver.wait_ready()
        sender = session.start(side, "send", **options)
        received, sent = receiver.result(), sender.result()
        return {
            name: received["per_second"],
            "receiver processor us/sample": received["processor_us"],
            "sender processor us/sample": sent["processor_us"],
        }

    return measure


BENCHMARKS = tuple(
    Benchmark(
        name := f"throughput/{label}",
        f"reliable samples received in a second ({'ShapeType' if not octets else f'{label} of octets'})",
        (Figure(name, "samples/s", Better.HIGHER),),
        _measure(name, octets, count),
    )
    for label, (octets, count) in _SAMPLES.items()
)
