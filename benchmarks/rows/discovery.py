"""Discovery: what it costs a participant that others are there, in simulated domains of growing size.

Everybody has to hear of everybody, so all figures are for each participant and each that it finds: the same in every
row means that nothing grows faster than it must.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

from benchmarks.benchmark import OURS, Benchmark, Better, Figure, Side
from benchmarks.session import Session

__all__ = ["BENCHMARKS"]

_MODULE = "benchmarks.sides.discovery"
_PARTICIPANTS = (10, 50, 200, 500)


def _figures(name: str) -> dict[str, Figure]:
    return {
        "datagrams": Figure(f"{name} datagrams", "/found", Better.LOWER),
        "octets": Figure(f"{name} octets", "/found", Better.LOWER),
        "us": Figure(f"{name} processor", "us/found", Better.LOWER),
    }


def _measure(name: str, participants: int) -> Callable[[Side, Session], Mapping[str, float]]:
    def measure(side: Side, session: Session) -> Mapping[str, float]:
        count = session.count(participants)
        found = session.start_module(_MODULE, "discover", participants=count).result()
        values = {figure.name: found[key] / (count - 1) for key, figure in _figures(name).items()}
        return values | {
            "datagrams sent/participant": found["datagrams"],
            "datagrams received/participant": found["received"],
            "octets sent/participant": found["octets"],
            "processor ms/participant": found["us"] / 1e3,
        }

    return measure


BENCHMARKS = tuple(
    Benchmark(
        name := f"discovery/{participants}",
        f"a simulated domain of {participants} participants that start within a second",
        tuple(_figures(name).values()),
        _measure(name, participants),
        (OURS,),
        is_long=participants > 100,
    )
    for participants in _PARTICIPANTS
)
