"""What a member is when a sample leaves it out.

DDS-XTypes 1.3 §7.2.2.4.4.4.7 (default values): the member's own default, None if it is optional, else the zero of
its type: 0, False, "", the first literal, nothing in a sequence, every element of an array its zero.
"""

from __future__ import annotations

from array import array
from typing import Any

from .buffers import nest
from .model import (
    ArrayType,
    BitmaskType,
    BitsetType,
    EnumType,
    IdlType,
    MapType,
    Member,
    Primitive,
    SequenceType,
    String,
    StructType,
    UnionType,
)

__all__ = ["default_cost", "default_value", "elements_value", "union_zero", "zero_cost", "zero_value"]


def default_value(member: Member) -> Any:
    """The value of a member that is not there; a new one each time where it could be changed."""
    if member.default is not None:
        return member.default()
    return None if member.is_optional else zero_value(member.type)


def zero_value(type_: IdlType) -> Any:
    """The default of a type."""
    match type_:
        case Primitive():
            return type_.zero
        case String():
            return ""
        case EnumType():
            return type_.default
        case BitmaskType():
            return type_.python_class(0)
        case BitsetType():
            return type_.python_class()
        case MapType():
            return {}
        case UnionType():
            return union_zero(type_)
        case SequenceType():
            return elements_value(type_, [])
        case ArrayType():
            elements = [zero_value(type_.element) for _ in range(type_.count)]
            return elements_value(type_, elements)
        case StructType():
            value = object.__new__(type_.python_class)
            for member in type_.declared:
                setattr(value, member.name, default_value(member))
            return value


def union_zero(type_: UnionType) -> Any:
    """The discriminator's default, and the default of the member that it selects."""
    value = object.__new__(type_.python_class)
    value._idl_discriminator = default_value(type_.discriminator)
    case = type_.case_of(value._idl_discriminator)
    value._idl_value = None if case is None else default_value(case)
    return value


def default_cost(member: Member) -> int:
    """About how many Python values :func:`default_value` makes."""
    return 1 if member.default is not None or member.is_optional else zero_cost(member.type)


def zero_cost(type_: IdlType) -> int:
    """About how many Python values :func:`zero_value` makes: large where arrays are, or structs multiply."""
    match type_:
        case ArrayType():
            return 1 + type_.count * zero_cost(type_.element)
        case StructType():
            if type_.zero_cost is None:
                type_.zero_cost = 1 + sum(default_cost(member) for member in type_.declared)
            return type_.zero_cost
        case UnionType():
            case = type_.case_of(default_value(type_.discriminator))
            return 1 if case is None else 1 + default_cost(case)
        case _:
            return 1


def elements_value(type_: SequenceType | ArrayType, elements: list[Any]) -> Any:
    """The Python form in which a sequence or array comes back: octets as bytes, characters as str, numbers as
    ``array.array`` (numpy where the member says so), else a list; arrays of several dimensions as rows of rows."""
    element = type_.element
    flat: Any = elements
    if isinstance(element, Primitive):
        if type_.numpy:
            return numpy_array(type_, elements)
        if element.is_octet:
            flat = bytes(elements)
        elif element.is_number:
            flat = array(element.code, elements)
        elif element.name != "boolean":
            flat = "".join(elements)
    return nest(flat, type_.dimensions) if isinstance(type_, ArrayType) else flat


def numpy_array(type_: SequenceType | ArrayType, elements: Any) -> Any:
    """A numpy array of the element's dtype.  numpy is imported here, since the user's annotation named it."""
    import numpy

    assert isinstance(type_.element, Primitive)
    flat = numpy.array(elements, dtype=numpy_dtype(type_.element))
    return flat.reshape(type_.dimensions) if isinstance(type_, ArrayType) else flat


def numpy_dtype(primitive: Primitive, order: str = "=") -> str:
    """numpy's name of a primitive type in a byte order (< > =)."""
    if primitive.name == "boolean":
        return "?"
    kind = "f" if primitive.code in "fd" else "i" if primitive.code.islower() else "u"
    return f"{order}{kind}{primitive.size}"
