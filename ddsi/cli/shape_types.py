"""ShapeType, the type of the OMG's shapes demo, in the forms in which vendors ship it.

All are called ``ShapeType`` and begin with the same four members.  The graphical demos use the final form in XCDR1; the
OMG's interoperability suite the appendable one with a payload.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Protocol

from ..xtypes import idl

__all__ = ["COLOURS", "EXTENSIBILITIES", "FIELD_HEIGHT", "FIELD_WIDTH", "TOPICS", "Shape", "ShapeForm", "shape_form"]

TOPICS = ("Square", "Circle", "Triangle")
COLOURS = ("PURPLE", "BLUE", "RED", "GREEN", "YELLOW", "CYAN", "MAGENTA", "ORANGE")
FIELD_WIDTH, FIELD_HEIGHT = 240, 270
"""Where the centres of shapes lie: 0 to 240 from the left, 0 to 270 from the top."""


class Shape(Protocol):
    """What all forms have."""

    color: str
    x: int
    y: int
    shapesize: int


@idl.struct(typename="ShapeType", extensibility=idl.FINAL)
class _FinalShape:
    color: Annotated[str, idl.key, idl.bound(128)]
    x: idl.int32
    y: idl.int32
    shapesize: idl.int32


@idl.struct(typename="ShapeType", extensibility=idl.APPENDABLE)
class _AppendableShape:
    color: Annotated[str, idl.key, idl.bound(128)]
    x: idl.int32
    y: idl.int32
    shapesize: idl.int32


@idl.struct(typename="ShapeType", extensibility=idl.MUTABLE)
class _MutableShape:
    color: Annotated[str, idl.key, idl.bound(128)]
    x: idl.int32
    y: idl.int32
    shapesize: idl.int32


@idl.struct(typename="ShapeType", extensibility=idl.APPENDABLE)
class _ShapeWithPayload:
    color: Annotated[str, idl.key, idl.bound(128)]
    x: idl.int32
    y: idl.int32
    shapesize: idl.int32
    additional_payload_size: idl.sequence[idl.uint8] = b""


_TYPES: dict[str, type[Shape]] = {"final": _FinalShape, "appendable": _AppendableShape, "mutable": _MutableShape}
EXTENSIBILITIES = tuple(_TYPES)


@dataclass(frozen=True, slots=True)
class ShapeForm:
    """One of the forms, and how a sample of it is made."""

    type: type[Shape]
    payload: bytes | None = None

    def sample(self, color: str, x: int, y: int, shapesize: int) -> Shape:
        members: tuple[object, ...] = (color, x, y, shapesize)
        if self.payload is not None:
            members += (self.payload,)
        made: Shape = self.type(*members)
        return made


def shape_form(extensibility: str, payload_octets: int | None) -> ShapeForm:
    """The form of this extensibility; with a payload it is that of the OMG's suite, which is appendable."""
    if payload_octets is not None:
        return ShapeForm(_ShapeWithPayload, b"\xff" * payload_octets)
    return ShapeForm(_TYPES[extensibility])
