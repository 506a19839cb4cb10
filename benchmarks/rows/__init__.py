"""The benchmarks by theme, in the order of the table.  A new one stands in the file of its theme."""

from benchmarks.benchmark import Benchmark

from . import (
    codec,
    discovery,
    filters,
    floors,
    footprint,
    hooks,
    matching,
    round_trip,
    scale,
    secured,
    security_handshake,
    security_permissions,
    security_transform,
    throughput,
)

__all__ = ["BENCHMARKS"]

BENCHMARKS: tuple[Benchmark, ...] = (
    *codec.BENCHMARKS,
    *throughput.BENCHMARKS,
    *round_trip.BENCHMARKS,
    *matching.BENCHMARKS,
    *footprint.BENCHMARKS,
    *discovery.BENCHMARKS,
    *filters.BENCHMARKS,
    *scale.BENCHMARKS,
    *hooks.BENCHMARKS,
    *secured.BENCHMARKS,
    *security_handshake.BENCHMARKS,
    *security_permissions.BENCHMARKS,
    *security_transform.BENCHMARKS,
    *floors.BENCHMARKS,
)
