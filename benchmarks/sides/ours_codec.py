"""Ours, codec: samples to octets and back, through ``ddsi.serialize`` and ``ddsi.deserialize``.

A program of its own: it imports numpy, which would count as memory of a participant in the other one.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any

import numpy as np
import numpy.typing as npt

import ddsi
from ddsi import idl

from .bursts import quickest_burst
from .ours import maker_of
from .protocol import play


@idl.struct(extensibility=idl.FINAL)
class Time:
    sec: idl.int32
    nanosec: idl.uint32


@idl.struct(extensibility=idl.FINAL)
class Header:
    stamp: Time
    frame: str


@idl.struct(extensibility=idl.FINAL)
class Point:
    x: idl.float64
    y: idl.float64
    z: idl.float64


@idl.struct(extensibility=idl.FINAL)
class Cloud:
    header: Header
    points: idl.sequence[Point]


@idl.struct(extensibility=idl.MUTABLE)
class Settings:
    number: idl.int32
    name: str
    rate: idl.float64
    enabled: idl.boolean
    data: idl.sequence[idl.uint8]


@idl.union(extensibility=idl.FINAL)
class Reading:
    kind: idl.int32 = idl.switch
    count: idl.int32 = idl.case(1, 2)
    position: Point = idl.case(3)
    text: str = idl.case(default=True)


@idl.struct(extensibility=idl.FINAL)
class Measurement:
    sensor: idl.uint32
    reading: Reading


@idl.struct(extensibility=idl.FINAL)
class Cell:
    number: idl.uint32
    x: idl.int16
    y: idl.int16
    level: idl.float32


@idl.struct(extensibility=idl.FINAL)
class Cells:
    cells: idl.sequence[Cell]


@idl.struct(extensibility=idl.FINAL)
class Track:
    number: idl.uint32
    name: str
    x: idl.float32
    y: idl.float32


@idl.struct(extensibility=idl.FINAL)
class Tracks:
    tracks: idl.sequence[Track]


@idl.struct(extensibility=idl.FINAL)
class Signal:
    values: Annotated[npt.NDArray[np.float64], idl.sequence_of(idl.float64)]


def _points() -> Cloud:
    return Cloud(Header(Time(1, 2), "map"), [Point(float(i), i + 0.5, -float(i)) for i in range(100)])


# How each sample is made, by its row's name; a test holds them to those of the peer.
SAMPLES: dict[str, Callable[[], Any]] = {
    "shape": lambda: maker_of(0)(7),
    "1KiB": lambda: maker_of(1 << 10)(7),
    "64KiB": lambda: maker_of(1 << 16)(7),
    "1MiB": lambda: maker_of(1 << 20)(7),
    "points": _points,
    "mutable": lambda: Settings(1, "name", 2.5, True, b"12345678"),
    "union": lambda: Measurement(1, Reading(count=3)),
    "structs": lambda: Cells([Cell(i, i % 100, -i % 100, i / 2) for i in range(1000)]),
    "named-structs": lambda: Tracks([Track(i, f"track {i}", i / 2, -i / 2) for i in range(1000)]),
    "float64": lambda: Signal(np.arange(1 << 17, dtype=np.float64)),
}


def representation_of(name: str) -> Any:
    """XCDR1, as a writer has it by default, except for the mutable type."""
    return ddsi.XCDR2 if name == "mutable" else ddsi.XCDR1


def serialise(name: str, count: int) -> dict[str, float]:
    sample, representation = SAMPLES[name](), representation_of(name)

    def burst(calls: int) -> None:
        for _ in range(calls):
            ddsi.serialize(sample, representation=representation)

    return {"us": quickest_burst(burst, count)}


def deserialise(name: str, count: int) -> dict[str, float]:
    sample = SAMPLES[name]()
    kind: type[Any] = type(sample)
    data = ddsi.serialize(sample, representation=representation_of(name))

    def burst(calls: int) -> None:
        for _ in range(calls):
            ddsi.deserialize(kind, data)

    return {"us": quickest_burst(burst, count)}


if __name__ == "__main__":
    play({"serialise": serialise, "deserialise": deserialise})
