"""Access control: permissions documents of peers read per second, and checks of their endpoints by these."""

from __future__ import annotations

from collections.abc import Mapping

from benchmarks.benchmark import FLOOR, OURS, Benchmark, Better, Figure, Side
from benchmarks.session import Session

__all__ = ["BENCHMARKS"]

_MODULE = "benchmarks.sides.security_permissions"


def _row(role: str, count: int, summary: str) -> Benchmark:
    name = f"permissions/{role}"

    def measure(side: Side, session: Session) -> Mapping[str, float]:
        worker = session.start_module(_MODULE, role, bare=side is FLOOR, count=session.count(count))
        return {name: worker.result()["per_second"]}

    return Benchmark(name, summary, (Figure(name, "/s", Better.HIGHER),), measure, (OURS, FLOOR))


BENCHMARKS = (
    _row("read", 500, "signed permissions of a peer read per second"),
    _row("check", 10_000, "remote writers checked per second, against 20 rules"),
)
