"""Cyclone, codec: the same types and samples as ``ours_codec``, through ``serialize()`` and ``deserialize``.

Numbers are given as a list, the quickest form that the package takes (it refuses numpy arrays); the representation
is the package's default for each type.
"""

# The package's annotations (case[[1, 2], int32]) mean something at run time only.
# mypy: ignore-errors
# pyright: basic, reportInvalidTypeForm=false, reportInvalidTypeArguments=false, reportArgumentType=false
# pyright: reportCallIssue=false

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from cyclonedds.idl import IdlStruct, IdlUnion
from cyclonedds.idl.annotations import final, mutable
from cyclonedds.idl.types import case, default, float32, float64, int16, int32, sequence, uint8, uint32

from .bursts import quickest_burst
from .cyclone import maker_of
from .protocol import play


@dataclass
@final
class Time(IdlStruct):
    sec: int32
    nanosec: uint32


@dataclass
@final
class Header(IdlStruct):
    stamp: Time
    frame: str


@dataclass
@final
class Point(IdlStruct):
    x: float64
    y: float64
    z: float64


@dataclass
@final
class Cloud(IdlStruct):
    header: Header
    points: sequence[Point]


@dataclass
@mutable
class Settings(IdlStruct):
    number: int32
    name: str
    rate: float64
    enabled: bool
    data: sequence[uint8]


@final
class Reading(IdlUnion, discriminator=int32):
    count: case[[1, 2], int32]
    position: case[[3], Point]
    text: default[str]


@dataclass
@final
class Measurement(IdlStruct):
    sensor: uint32
    reading: Reading


@dataclass
@final
class Cell(IdlStruct):
    number: uint32
    x: int16
    y: int16
    level: float32


@dataclass
@final
class Cells(IdlStruct):
    cells: sequence[Cell]


@dataclass
@final
class Track(IdlStruct):
    number: uint32
    name: str
    x: float32
    y: float32


@dataclass
@final
class Tracks(IdlStruct):
    tracks: sequence[Track]


@dataclass
@final
class Signal(IdlStruct):
    values: sequence[float64]


def _points() -> Cloud:
    return Cloud(Header(Time(1, 2), "map"), [Point(float(i), i + 0.5, -float(i)) for i in range(100)])


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
    "float64": lambda: Signal([float(i) for i in range(1 << 17)]),
}


def serialise(name: str, count: int) -> dict[str, float]:
    sample = SAMPLES[name]()

    def burst(calls: int) -> None:
        for _ in range(calls):
            sample.serialize()

    return {"us": quickest_burst(burst, count)}


def deserialise(name: str, count: int) -> dict[str, float]:
    sample = SAMPLES[name]()
    kind: type[Any] = type(sample)
    data = sample.serialize()

    def burst(calls: int) -> None:
        for _ in range(calls):
            kind.deserialize(data)

    return {"us": quickest_burst(burst, count)}


if __name__ == "__main__":
    play({"serialise": serialise, "deserialise": deserialise})
