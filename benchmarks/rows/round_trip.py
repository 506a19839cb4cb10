"""Round trip: a ShapeType there and back over two reliable topics, two processes; the floor is a bare UDP ping-pong.

The peer waits in its wait-set and takes, as its examples do.
"""

from __future__ import annotations

from collections.abc import Mapping

from benchmarks.benchmark import FLOOR, OURS, PEER, Benchmark, Better, Figure, Side
from benchmarks.session import Session

__all__ = ["BENCHMARKS", "measure_round_trip"]

_COUNT = 4_000
_MEDIAN = "round-trip/median"
_P99 = "round-trip/p99"


def measure_round_trip(
    side: Side, session: Session, enclaves: tuple[str, str] | None = None, **options: object
) -> dict[str, float]:
    """``median_us`` and ``p99_us`` between the roles "echo" and "ping" of a side, in these keystore folders, if any."""
    options |= {"domain": session.domain, "count": session.count(_COUNT)}
    echoing, pinging = ({"enclave": enclave} for enclave in enclaves) if enclaves else ({}, {})
    with session.start(side, "echo", **options, **echoing) as echo:
        echo.wait_ready()
        with session.start(side, "ping", **options, **pinging) as ping:
            return ping.result()


def _measure(side: Side, session: Session) -> Mapping[str, float]:
    result = measure_round_trip(side, session)
    values = {_MEDIAN: result["median_us"], _P99: result["p99_us"]}
    if "processor_us" in result:
        values["ping processor us/round trip"] = result["processor_us"]
    return values


BENCHMARKS = (
    Benchmark(
        "round-trip",
        "a reliable ShapeType there and back",
        (Figure(_MEDIAN, "us", Better.LOWER), Figure(_P99, "us", Better.LOWER)),
        _measure,
        (OURS, PEER, FLOOR),
    ),
)
