"""Cryptography: what protecting and opening octets costs, in multiples of one bare AES-GCM call of that size.

By level and kind of protection.  A submessage's length has 16 bits, so 64 KiB fit into payloads only, and the other
levels come as near to that as their envelopes let them.
"""

from __future__ import annotations

from collections.abc import Mapping

from benchmarks.benchmark import OURS, Benchmark, Better, Figure, Side
from benchmarks.session import Session

__all__ = ["BENCHMARKS"]

_MODULE = "benchmarks.sides.security_transform"
_BURSTS = 400

_SMALL = {"64B": 64, "1KiB": 1 << 10}
_PAYLOADS = _SMALL | {"64KiB": 1 << 16, "1MiB": 1 << 20}
_ENVELOPES = _SMALL | {"63KiB": 63 << 10}
_KINDS = ("sign", "encrypt", "sign-origin", "encrypt-origin")
# No payload bears a receiver's MAC.
_LEVELS = {
    "payload": (_PAYLOADS, _KINDS[:2]),
    "submessage": (_ENVELOPES, _KINDS),
    "message": (_ENVELOPES, _KINDS),
}


def _row(level: str, kind: str, label: str, octets: int) -> Benchmark:
    name = f"protect/{level}/{kind}/{label}"
    figures = tuple(Figure(f"{direction} {name[8:]}", "x bare", Better.LOWER) for direction in ("encode", "decode"))

    def measure(side: Side, session: Session) -> Mapping[str, float]:
        bursts = session.count(max(_BURSTS * (1 << 16) // max(octets, 1 << 16), 1))
        found = session.start_module(_MODULE, "transform", level=level, kind=kind, octets=octets, count=bursts).result()
        ratios = {figure.name: found.pop(figure.name.partition(" ")[0]) for figure in figures}
        return ratios | found

    return Benchmark(name, f"{label} of {level}, {kind}, beside one bare AES-GCM call", figures, measure, (OURS,))


BENCHMARKS = tuple(
    _row(level, kind, label, octets)
    for level, (sizes, kinds) in _LEVELS.items()
    for kind in kinds
    for label, octets in sizes.items()
)
