"""Floors: what the machine, Python and trio take before any protocol runs.  They have a floor and nothing beside it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

from benchmarks.benchmark import FLOOR, Benchmark, Better, Figure, Side
from benchmarks.session import Session

from .round_trip import measure_round_trip

__all__ = ["BENCHMARKS"]

_UDP = "floor/udp"
_CHECKPOINTS = 20_000
_BURSTS = 400


def _round_trip_through_trio(side: Side, session: Session) -> Mapping[str, float]:
    return {"floor/trio": measure_round_trip(side, session, through_trio=True)["median_us"]}


def _one_process(name: str, role: str, count: int) -> Callable[[Side, Session], Mapping[str, float]]:
    def measure(side: Side, session: Session) -> Mapping[str, float]:
        return {name: session.start(side, role, count=session.count(count)).result()["us"]}

    return measure


def _floor(name: str, summary: str, measure: Callable[[Side, Session], Mapping[str, float]]) -> Benchmark:
    return Benchmark(name, summary, (Figure(name, "us", Better.LOWER),), measure, (FLOOR,))


def _aead(label: str, octets: int) -> Benchmark:
    name = f"floor/aead/{label}"

    def measure(side: Side, session: Session) -> Mapping[str, float]:
        worker = session.start_module("benchmarks.sides.aead", "bare", octets=octets, count=session.count(_BURSTS))
        found = worker.result()
        return {name: found.pop("encrypt_us")} | found

    side = replace(FLOOR, distribution="cryptography")
    return Benchmark(name, f"one bare AES-GCM call, {label}", (Figure(name, "us", Better.LOWER),), measure, (side,))


BENCHMARKS = (
    _floor("floor/trio", "a UDP ping-pong between two bare trio loops, median", _round_trip_through_trio),
    _floor("floor/checkpoint", "one trio checkpoint", _one_process("floor/checkpoint", "checkpoint", _CHECKPOINTS)),
    _aead("64B", 64),
    _aead("64KiB", 1 << 16),
    _floor(_UDP, "send and receive one small datagram, one process", _one_process(_UDP, "datagram", _CHECKPOINTS)),
)
