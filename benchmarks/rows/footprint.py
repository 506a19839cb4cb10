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


BENCHMARKS = tuple(
    Benchmark(name, summary, (Figure(name, unit, Better.LOWER),), measure, (OURS, PEER, FLOOR))
    for name, unit, summary, measure in (
        (_IMPORT, "ms", "import what an application needs", _measure_import),
        (_MEMORY, "MiB", "resident memory of an idle participant", _measure_memory),
    )
)
