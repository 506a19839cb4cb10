"""A class as IDL bitset: bit fields in one integer (OMG IDL 4.2 §7.4.13.4.3.2, DDS-XTypes 1.3 §7.2.2.4.1).

On the wire it is the smallest unsigned integer that holds all fields, the first field in the lowest bits.
"""

from __future__ import annotations

import contextlib
import dataclasses
import sys
from typing import Any

from ..structure.errors import BadParameter
from . import model
from .definition import own_annotations
from .model import Bitfield, BitsetType, Primitive
from .resolution import STRUCT_ATTRIBUTE, Resolver, Scope

__all__ = ["bitset_from", "define_bitset"]

_INTEGERS = (model.INT8, model.INT16, model.INT32, model.INT64)


def define_bitset(python_class: type[Any], *, type_name: str | None, frame: Scope) -> type[Any]:
    """The decorated class; see :func:`ddsi.idl.bitset`."""
    name = python_class.__name__
    bases = [base.__dict__.get(STRUCT_ATTRIBUTE) for base in python_class.__bases__]
    base = next((found for found in bases if isinstance(found, BitsetType)), None)
    fields = _fields(python_class, base, frame)
    for field in fields:
        if base is None or field not in base.fields:
            with contextlib.suppress(AttributeError):
                delattr(python_class, field.name)
            setattr(python_class, field.name, _zero(field))
    decorated: type[Any] = dataclasses.dataclass(slots=True)(python_class)
    described = BitsetType(decorated, type_name or name, fields, base)
    setattr(decorated, STRUCT_ATTRIBUTE, described)
    decorated.__index__ = lambda self: _number(described, self)  # what struct packs
    return decorated


def bitset_from(type_: BitsetType, number: int) -> Any:
    """The object of a number from the network.  Bits of no field are dropped, as there is no place for them."""
    value = object.__new__(type_.python_class)
    for field in type_.fields:
        bits = number >> field.position & ((1 << field.width) - 1)
        if field.type == model.BOOLEAN:
            setattr(value, field.name, bits != 0)
        elif field.type in _INTEGERS and bits >> (field.width - 1):
            setattr(value, field.name, bits - (1 << field.width))
        else:
            setattr(value, field.name, bits)
    return value


def _number(type_: BitsetType, value: Any) -> int:
    number = 0
    for field in type_.fields:
        item = getattr(value, field.name)
        lowest, highest = _range(field)
        if not isinstance(item, int) or not lowest <= item <= highest:
            raise BadParameter(f"{field.name}: {item!r} does not fit {field.width} bits ({lowest} to {highest})")
        number |= (int(item) & ((1 << field.width) - 1)) << field.position
    return number


def _range(field: Bitfield) -> tuple[int, int]:
    if field.type in _INTEGERS:
        return -(1 << (field.width - 1)), (1 << (field.width - 1)) - 1
    return 0, (1 << field.width) - 1


def _zero(field: Bitfield) -> Any:
    return False if field.type == model.BOOLEAN else 0


def _fields(python_class: type[Any], base: BitsetType | None, frame: Scope) -> tuple[Bitfield, ...]:
    name = python_class.__name__
    module = sys.modules.get(python_class.__module__)
    resolver = Resolver(dict(vars(module)) if module is not None else {}, frame.f_locals)
    fields = list(base.fields) if base is not None else []
    for field_name, annotation in own_annotations(python_class).items():
        resolved = resolver.resolve(annotation)
        bits = resolved.bits
        if bits is None:
            raise BadParameter(
                f"{name}.{field_name}: a bitset's field says its width, as in Annotated[..., idl.bits(3)]"
            )
        position = bits.at
        if position is None:
            position = fields[-1].position + fields[-1].width if fields else 0
        if not isinstance(resolved.type, Primitive) or not (resolved.type.is_number or resolved.type == model.BOOLEAN):
            raise BadParameter(f"{name}.{field_name}: bits are a boolean or an integer, not {resolved.type}")
        if resolved.type.code in "fd":
            raise BadParameter(f"{name}.{field_name}: bits are a boolean or an integer, not {resolved.type}")
        fields.append(_checked(name, Bitfield(field_name, position, bits.width, resolved.type), fields))
    if not fields:
        raise BadParameter(f"{name}: a bitset has one field at least")
    return tuple(fields)


def _checked(name: str, field: Bitfield, before: list[Bitfield]) -> Bitfield:
    where = f"{name}.{field.name}"
    if field.position + field.width > 64:
        raise BadParameter(f"{where}: it would end at bit {field.position + field.width}; a bitset has 64")
    if field.width > (1 if field.type == model.BOOLEAN else 8 * field.type.size):
        raise BadParameter(f"{where}: {field.width} bits are more than a {field.type} has")
    for other in before:
        if field.position < other.position + other.width and other.position < field.position + field.width:
            raise BadParameter(f"{where}: its bits are also those of {other.name}")
    return field
