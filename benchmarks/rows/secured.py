"""Secured: what protection costs, beside our own figures without it, which are measured in turns with it.

``x plain``: the plain time divided by the secured one, so that 1 means that protection costs nothing.  The other two
go by processor time, of the busier of the two processes, as that does not tell what else the machine does.
``us/layer``: what each layer of protection adds to it for a sample.  ``x bare``, for large samples: what a plain sample
takes together with one bare AEAD call a layer and one copy, divided by what a secured one takes.  Of each the best turn
counts: whatever else the machine does adds to processor time, as caches are shared, and never takes any away.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping

from benchmarks.benchmark import SECURED, SECURED_PEER, Benchmark, Better, Figure, Side
from benchmarks.session import Session

from .round_trip import measure_round_trip
from .throughput import measure_throughput

__all__ = ["BENCHMARKS"]

# Layers of protection by the names of the rows, and which bare call each of them comes down to.
_LAYERS: Mapping[str, Mapping[str, str]] = {
    "payload": {"data": "encrypt_us"},
    "submessage": {"metadata": "encrypt_us"},
    "message": {"rtps": "sign_us"},
    "all": {"data": "encrypt_us", "metadata": "encrypt_us", "rtps": "sign_us"},
}
_SAMPLES = {"shape": (0, 15_000), "64KiB": (1 << 16, 2_000), "1MiB": (1 << 20, 100)}
_TURNS = 3
_BURSTS = 400
_FIRST = "secured/first-sample"


def _enclaves(kind: str) -> tuple[str, str]:
    from benchmarks.keystores import enclaves  # needs `cryptography`, which may be missing

    return enclaves(tuple(_LAYERS[kind]))


def _throughput(name: str, kind: str, octets: int, count: int) -> Callable[[Side, Session], Mapping[str, float]]:
    def measure(side: Side, session: Session) -> Mapping[str, float]:
        turns = [
            (
                measure_throughput(side, session, octets, count),
                measure_throughput(side, session, octets, count, _enclaves(kind)),
            )
            for _ in range(_TURNS)
        ]
        plain, secured = (_best(found) for found in zip(*turns, strict=True))
        plain_us, secured_us = (max(found["receiver_us"], found["sender_us"]) for found in (plain, secured))
        values = {
            name: secured["per_second"] / plain["per_second"],
            f"{name} added": (secured_us - plain_us) / len(_LAYERS[kind]),
            "samples/s": secured["per_second"],
            "plain samples/s": plain["per_second"],
            "x plain by processor time": plain_us / secured_us,
        }
        for end in ("receiver", "sender"):
            values[f"{end} processor us/sample"] = secured[f"{end}_us"]
            values[f"plain {end} processor us/sample"] = plain[f"{end}_us"]
        if octets:
            bursts = session.count(max(_BURSTS * (1 << 16) // octets, 1))
            bare = session.start_module("benchmarks.sides.aead", "bare", octets=octets, count=bursts).result()
            bare_us = sum(bare[call] for call in _LAYERS[kind].values()) + bare["copy_us"]
            values[f"{name} floor"] = (plain_us + bare_us) / secured_us
            values["bare us"] = bare_us
        return values

    return measure


def _best(turns: Iterable[Mapping[str, float]]) -> Mapping[str, float]:
    """Of each figure by itself: most samples in a second, least processor time."""
    found = list(turns)
    return {name: (max if name == "per_second" else min)(turn[name] for turn in found) for name in found[0]}


def _throughput_row(kind: str, label: str, octets: int, count: int) -> Benchmark:
    name = f"secured/throughput/{label}/{kind}"
    figures = [Figure(name, "x plain", Better.HIGHER), Figure(f"{name} added", "us/layer", Better.LOWER)]
    if octets:
        figures.append(Figure(f"{name} floor", "x bare", Better.HIGHER))
    summary = f"{_protected(kind)}, samples received in a second ({'ShapeType' if not octets else label})"
    return Benchmark(name, summary, tuple(figures), _throughput(name, kind, octets, count), (SECURED,))


def _round_trip(name: str, kind: str) -> Callable[[Side, Session], Mapping[str, float]]:
    def measure(side: Side, session: Session) -> Mapping[str, float]:
        plain = measure_round_trip(side, session)
        secured = measure_round_trip(side, session, _enclaves(kind))
        plain_us, secured_us = plain["median_us"], secured["median_us"]
        return {
            name: plain_us / secured_us,
            f"{name} added": (secured["processor_us"] - plain["processor_us"]) / len(_LAYERS[kind]),
            "x plain by processor time": plain["processor_us"] / secured["processor_us"],
            "median us": secured_us,
            "plain median us": plain_us,
            "ping processor us/round trip": secured["processor_us"],
            "plain ping processor us/round trip": plain["processor_us"],
        }

    return measure


def _round_trip_row(kind: str) -> Benchmark:
    name = f"secured/round-trip/{kind}"
    figures = (Figure(name, "x plain", Better.HIGHER), Figure(f"{name} added", "us/layer", Better.LOWER))
    return Benchmark(
        name, f"{_protected(kind)}, a ShapeType there and back, median", figures, _round_trip(name, kind), (SECURED,)
    )


def _protected(kind: str) -> str:
    return "all three layers protected" if kind == "all" else f"{kind} protected"


def _first_sample(side: Side, session: Session) -> Mapping[str, float]:
    from benchmarks.keystores import enclaves

    alice, bob = enclaves(tuple(_LAYERS["all"]), discovery="ENCRYPT")
    with session.start(side, "offer_secret", domain=session.domain, enclave=alice) as offering:
        offering.wait_ready()
        result = session.start(side, "learn_secret", domain=session.domain, enclave=bob).result()
    return {_FIRST: result["ms"], "processor ms": result["processor_ms"]}


BENCHMARKS = (
    *(_round_trip_row(kind) for kind in _LAYERS),
    *(_throughput_row(kind, label, octets, count) for label, (octets, count) in _SAMPLES.items() for kind in _LAYERS),
    Benchmark(
        _FIRST,
        "from the start of a participant until it has a sample, everything protected",
        (Figure(_FIRST, "ms", Better.LOWER),),
        _first_sample,
        (SECURED, SECURED_PEER),
    ),
)
