"""Throughput: one writer, one reader, reliable and KEEP_ALL, each in its own process; samples received in a second.

The reader measures from its first sample to its last, and checks that it got every one.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

from benchmarks.benchmark import FLOOR, OURS, PEER, Benchmark, Better, Figure, Side
from benchmarks.session import Session

__all__ = ["BENCHMARKS", "measure_throughput"]

# Octets beside the index (0: a ShapeType), and samples in a round: about a second on the slower side.
_SAMPLES = {"shape": (0, 40_000), "1KiB": (1 << 10, 20_000), "16KiB": (1 << 14, 3_000), "1MiB": (1 << 20, 60)}


def measure_throughput(
    side: Side, session: Session, octets: int, count: int, enclaves: tuple[str, str] | None = None
) -> dict[str, float]:
    """``per_second``, and the processor time that a sample costs its ``receiver_us`` and its ``sender_us``.

    ``enclaves``: the keystore folders of receiver and sender, where they are secured.
    """
    options = {"domain": session.domain, "octets": octets, "count": session.count(count)}
    receiving, sending = ({"enclave": enclave} for enclave in enclaves) if enclaves else ({}, {})
    with session.start(side, "receive", **options, **receiving) as receiver:
        receiver.wait_ready()
        with session.start(side, "send", **options, **sending) as sender:
            received, sent = receiver.result(), sender.result()
    return {
        "per_second": received["per_second"],
        "receiver_us": received["processor_us"],
        "sender_us": sent["processor_us"],
    }


def _measure(name: str, octets: int, count: int) -> Callable[[Side, Session], Mapping[str, float]]:
    def measure(side: Side, session: Session) -> Mapping[str, float]:
        found = measure_throughput(side, session, octets, count)
        return {
            name: found["per_second"],
            "receiver processor us/sample": found["receiver_us"],
            "sender processor us/sample": found["sender_us"],
        }

    return measure


BENCHMARKS = tuple(
    Benchmark(
        name := f"throughput/{label}",
        f"reliable samples received in a second ({'ShapeType' if not octets else f'{label} of octets'})",
        (Figure(name, "samples/s", Better.HIGHER),),
        _measure(name, octets, count),
        (OURS, PEER, FLOOR),
    )
    for label, (octets, count) in _SAMPLES.items()
)
