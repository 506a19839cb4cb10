"""Authentication: handshakes per second, both sides on one core; as the floor, the bare operations of one."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from benchmarks.benchmark import FLOOR, OURS, Benchmark, Better, Figure, Side
from benchmarks.session import Session

__all__ = ["BENCHMARKS"]

_MODULE = "benchmarks.sides.security_handshake"
_COUNT = 300


def _measure(name: str, kind: str) -> Callable[[Side, Session], Mapping[str, float]]:
    def measure(side: Side, session: Session) -> Mapping[str, float]:
        role = "handshake" if side is OURS else "bare"
        worker = session.start_module(_MODULE, role, kind=kind, count=session.count(_COUNT))
        return {name: worker.result()["per_second"]}

    return measure


def _row(kind: str) -> Benchmark:
    name = f"handshake/{kind}"
    summary = f"authentications per second, {kind.upper()} identities, ECDH"
    return Benchmark(name, summary, (Figure(name, "/s", Better.HIGHER),), _measure(name, kind), (OURS, FLOOR))


BENCHMARKS = (_row("ec"), _row("rsa"))
