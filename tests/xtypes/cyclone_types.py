# mypy: ignore-errors
# pyright: basic, reportInvalidTypeForm=false, reportInvalidTypeArguments=false
"""The types of ``test_cyclonedds.py`` as cyclonedds-python spells them.  Importing this needs that package."""

from dataclasses import dataclass
from typing import Optional

from cyclonedds.idl import IdlStruct, IdlUnion
from cyclonedds.idl._support import Endianness
from cyclonedds.idl.annotations import appendable, final, key, mutable
from cyclonedds.idl.types import (
    array,
    bounded_str,
    case,
    default,
    float32,
    float64,
    int16,
    int32,
    int64,
    sequence,
    uint8,
)

__all__ = ["Endianness", "PeerChoice", "PeerChoices", "PeerMessage", "PeerPoint", "PeerShape"]


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


@appendable
class PeerChoice(IdlUnion, discriminator=int16, typename="Choice"):
    number: case[1, int64]
    texts: case[[2, -3], sequence[str]]
    point: default[PeerPoint]


@dataclass
@appendable
class PeerChoices(IdlStruct, typename="Choices"):
    before: uint8
    choice: PeerChoice
    more: sequence[PeerChoice]
    after: float64
