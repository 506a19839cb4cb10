"""Test vectors from a real peer: ``cyclonedds_vectors.json``, whose ``origin`` tells how they were made.

Octets as hex, encapsulation options 0 and without padding; values as JSON, enums by literal, bitmasks as ``bits``.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ddsi.xtypes.definition import struct_type
from ddsi.xtypes.model import ArrayType, BitmaskType, EnumType, IdlType, SequenceType, StructType, UnionType

from .vector_types import TYPES

ALL = json.loads(Path(__file__).with_name("cyclonedds_vectors.json").read_text())["vectors"]


@dataclass(frozen=True)
class Vector:
    """One sample of one type."""

    name: str
    type: type[Any]
    value: Any
    octets: dict[str, bytes]

    def __str__(self) -> str:
        return self.name


def _load() -> list[Vector]:
    vectors = []
    for entry in ALL:
        type_ = TYPES[entry["name"][:3]]
        for number, sample in enumerate(entry["samples"]):
            octets = {key: bytes.fromhex(text) for key, text in sample.items() if key != "value" and _is_hex(text)}
            value = sample_of(struct_type(type_), sample["value"])
            vectors.append(Vector(f"{entry['name']}-{number}", type_, value, octets))
    return vectors


def _is_hex(text: object) -> bool:
    return isinstance(text, str) and all(digit in "0123456789abcdef" for digit in text)


def sample_of(type_: IdlType, value: Any) -> Any:
    """The Python value that a JSON value means."""
    match type_:
        case _ if value is None:
            return None
        case StructType():
            named = {member.name: sample_of(member.type, value[member.name]) for member in type_.members}
            return type_.python_class(**named)
        case UnionType():
            return union_of(type_, value)
        case SequenceType() | ArrayType():
            return [_row(type_, item) for item in value]
        case EnumType():
            return type_.python_class[value]
        case BitmaskType():
            return type_.python_class(value["bits"])
        case _:
            return value


def union_of(type_: UnionType, value: Any) -> Any:
    discriminator = sample_of(type_.discriminator.type, value["discriminator"])
    case = type_.case_of(discriminator)
    held = {} if case is None else {case.name: sample_of(case.type, value["value"])}
    return type_.python_class(**{type_.discriminator.name: discriminator, **held})


def _row(type_: SequenceType | ArrayType, item: Any) -> Any:
    """An element, or in an array of several dimensions a row of them."""
    if isinstance(type_, ArrayType) and len(type_.dimensions) > 1:
        return [_row(ArrayType(type_.element, type_.dimensions[1:]), inner) for inner in item]
    return sample_of(type_.element, item)


VECTORS = _load()
