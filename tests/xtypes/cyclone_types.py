# mypy: ignore-errors
# pyright: basic, reportInvalidTypeForm=false, reportInvalidTypeArguments=false
"""The types of ``test_cyclonedds.py`` as cyclonedds-python spells them.  Importing this needs that package."""

from dataclasses import dataclass
from typing import Optional

from cyclonedds.idl import IdlStruct
from cyclonedds.idl._support import Endianness
from cyclonedds.idl.annotations import appendable, final, key, mutable
from cyclonedds.idl.types import array, bounded_str, float32, float64, int32, int64, sequence, uint8

__all__ = ["Endianness", "PeerMessage", "PeerPoint", "PeerShape"]


@dataclass
@appendable
class PeerShape(IdlStruct, typename="ShapeType"):
    color: bounded_str[128]
    key("color")
    x: int32
    y: int32
    shapesize: int32
    additional_payload_size: sequence[uint8]


@dataclass
@final
class PeerPoint(IdlStruct, typename="Point"):
    id: uint8
    x: float64
    y: float32


@dataclass
@mutable
class PeerMessage(IdlStruct, typename="Message"):
    id: int64
    key("id")
    path: sequence[PeerPoint]
    names: sequence[str]
    values: sequence[float64]
    corners: array[PeerPoint, 2]
    note: Optional[str]  # noqa: UP045 - the binding does not know the other form
