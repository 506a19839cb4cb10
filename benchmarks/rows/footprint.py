"""Footprint: what it costs to have the stack at all - the import, and the memory of a participant that does nothing.

The floor is trio alone, which our side is made with and the peer is not.
"""

from __future__ import annotations

from collections.abc import Mapping

from benchmarks.benchmark import FLOOR, OURS, PEER, Benchmark, Better, Figure, Side
from benchmarks.session import Session

__all__ = ["BENCHMARKS"]

_IMPORT = "import"
_MEMORY = "memory/idle"
_GROWTH = "memory/1000-endpoints"
_ENDPOINTS = 1_000
_IMPORTS_A_ROUND = 3


def _measure_import(side: Side, session: Session) -> Mapping[str, float]:
    """The quickest of some: the others waited for the disk or for their turn."""
    workers = (
        session.start_module("benchmarks.sides.importing", "import", modules=side.imports)
        for _ in range(_IMPORTS_A_ROUND)
    )
    return {_IMPORT: min(worker.result()["ms"] for worker in workers)}


def _measure_memory(side: Side, session: Session) -> Mapping[str, float]:
    return {_MEMORY: session.start(side, "idle", domain=session.domain).result()["mib"]}


def _measure_growth(side: Side, session: Session) -> Mapping[str, float]:
    endpoints = session.count(_ENDPOINTS, least=100)
    watching = session.start(side, "watch", domain=session.domain)
    watching.wait_ready()
    session.start(side, "crowd", domain=session.domain, endpoints=endpoints).wait_ready()
    return {_GROWTH: watching.result()["mib"] * _ENDPOINTS / endpoints}


BENCHMARKS = (
    Benchmark(
        _IMPORT,
        "import what an application needs",
        (Figure(_IMPORT, "ms", Better.LOWER),),
        _measure_import,
        (OURS, PEER, FLOOR),
    ),
    Benchmark(
        _MEMORY,
        "resident memory of an idle participant",
        (Figure(_MEMORY, "MiB", Better.LOWER),),
        _measure_memory,
        (OURS, PEER, FLOOR),
    ),
    Benchmark(
        _GROWTH,
        "what 1000 endpoints of another participant add to it",
        (Figure(_GROWTH, "MiB", Better.LOWER),),
        _measure_growth,
    ),
)
