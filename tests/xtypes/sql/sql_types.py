"""The type that the tests of SQL expressions filter, with every kind of member; and samples of it."""

from __future__ import annotations

import enum
from dataclasses import field
from typing import Annotated, Any

import numpy as np
import numpy.typing as npt

from ddsi.xtypes import idl
from ddsi.xtypes.definition import struct_type
from ddsi.xtypes.model import StructType


class Color(enum.IntEnum):
    RED = 0
    GREEN = 1
    BLUE = 2


class Flags(enum.IntFlag):
    HOT = 1
    WET = 2


@idl.bitset()
class Bits:
    low: Annotated[idl.uint8, idl.bits(3)]
    high: Annotated[idl.uint8, idl.bits(5)]


@idl.struct
class Point:
    x: idl.int32 = 0
    y: idl.int32 = 0


@idl.union
class Shade:
    color: Color = idl.switch
    grey: idl.uint8 = idl.case(Color.RED)
    place: Point = idl.case(Color.GREEN)


@idl.struct
class Everything:
    name: Annotated[str, idl.key]
    place: Point
    shade: Shade
    bits: Bits
    size: idl.int32 = 0
    big: idl.uint64 = 0
    ratio: idl.float32 = 0.0
    exact: idl.float64 = 0.0
    is_on: idl.boolean = False
    letter: idl.char = "a"
    color: Color = Color.RED
    flags: Flags = Flags(0)
    numbers: idl.sequence[idl.int32] = ()
    grid: Annotated[idl.sequence[idl.sequence[idl.int32]], idl.array(2, 3)] = ((0, 0, 0), (0, 0, 0))
    points: Annotated[idl.sequence[Point], idl.bound(4)] = ()
    maybe: idl.int32 | None = None
    far: Point | None = None
    samples: Annotated[npt.NDArray[np.int16], idl.sequence_of(idl.int16)] = field(
        default_factory=lambda: np.zeros(0, np.int16)
    )


STRUCT: StructType = struct_type(Everything)


def everything(**changes: Any) -> Everything:
    """A sample with a few members set; the rest is as small as can be."""
    values: dict[str, Any] = {
        "name": "BLUE", "place": Point(), "shade": Shade(grey=7), "bits": Bits(low=0, high=0), **changes,
    }  # fmt: skip
    return Everything(**values)
