# pyright: strict
"""A user's program, for type checkers (``test_typing.py``): it must pass them in their strictest mode, and run."""

import enum
from dataclasses import field
from typing import Annotated, assert_type

import numpy as np
import numpy.typing as npt

from ddsi.xtypes import deserialize, idl, serialize


class Color(enum.IntEnum):
    RED = 0
    GREEN = 1


@idl.enum(bit_bound=8)
class Level(enum.IntEnum):
    LOW = 0
    HIGH = 1


@idl.bitmask(bit_bound=8)
class Options(enum.IntFlag):
    FAST = 1
    LOUD = 2


@idl.union(extensibility=idl.FINAL)
class Measurement:
    kind: Color = idl.switch
    count: idl.int32 = idl.case(Color.RED)
    text: str = idl.case(default=True)


@idl.bitset()
class Bits:
    low: Annotated[idl.uint8, idl.bits(3)] = 0
    flag: Annotated[idl.boolean, idl.bits(1)] = False


@idl.struct
class Collected:
    measurements: idl.sequence[Measurement]
    by_name: idl.map[str, Measurement]
    bits: Bits
    wide: Annotated[idl.wstring, idl.bound(8)]


@idl.struct
class Point:
    x: idl.float64 = 0.0
    y: idl.float64 = 0.0


@idl.struct(typename="geometry::Shape", extensibility=idl.APPENDABLE)
class Shape:
    name: Annotated[str, idl.key, idl.bound(128)]
    size: idl.int32
    visible: idl.boolean
    color: Color
    level: Level
    options: Options
    center: Point
    outline: idl.sequence[Point]
    initial: idl.char
    payload: idl.sequence[idl.uint8] = b""
    raw: bytes = b""
    counts: Annotated[idl.sequence[idl.int32], idl.bound(8)] = ()
    matrix: Annotated[idl.sequence[idl.sequence[idl.float32]], idl.array(2, 2)] = ((1, 0), (0, 1))
    weights: Annotated[npt.NDArray[np.float64], idl.sequence_of(idl.float64)] = field(
        default_factory=lambda: np.zeros(0)
    )
    note: str | None = None
    tags: idl.sequence[str] = field(default_factory=list[str])


@idl.struct(extensibility=idl.FINAL)
class Named(Point):
    label: str = ""


def program() -> None:
    shape = Shape("box", 3, True, Color.RED, Level.HIGH, Options.FAST | Options.LOUD, Point(1, 2), [Point()], "b")
    assert_type(shape.name, str)
    assert_type(shape.size, int)
    assert_type(shape.visible, bool)
    assert_type(shape.color, Color)
    assert_type(shape.level, Level)
    assert_type(shape.center, Point)
    assert_type(shape.center.x, float)
    assert_type(shape.payload, idl.sequence[int])
    assert_type(shape.note, str | None)
    shape.payload = b"octets"
    shape.payload = bytearray(3)
    shape.payload = [1, 2, 3]
    shape.counts = np.arange(3, dtype=np.int32).tolist()
    again = deserialize(Shape, serialize(shape))
    assert_type(again, Shape)
    assert again == shape
    assert_type(Named(label="x").label, str)
    assert repr(Named(1, label="x")) == "Named(x=1, y=0.0, label='x')"
    measured = Collected([Measurement(count=1)], {"x": Measurement(kind=Color.GREEN, text="y")}, Bits(low=3), "wide")
    assert_type(measured.by_name["x"].text, str)
    assert_type(measured.measurements[0].kind, Color)
    assert_type(measured.bits.flag, bool)
    assert_type(measured.wide, str)
    assert deserialize(Collected, serialize(measured)) == measured
    assert "struct Collected" in idl.to_idl(Collected)


if __name__ == "__main__":
    program()
