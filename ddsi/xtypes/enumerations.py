"""``enum.IntEnum`` as IDL enum, ``enum.IntFlag`` as IDL bitmask (DDS-XTypes 1.3 §7.2.2.4.1 and §7.2.2.4.2)."""

from __future__ import annotations

import enum
from typing import Any

from ..structure.errors import BadParameter
from .model import BitmaskType, EnumType, Extensibility

__all__ = ["bitmask_from", "bitmask_type", "describe_bitmask", "describe_enum", "enum_type"]

_ATTRIBUTE = "__idl_enumeration__"

_MOST_REMEMBERED = 4096


def enum_type(python_class: type[enum.IntEnum]) -> EnumType:
    """The description given by ``idl.enum``, or else the default one: 32 bits, first literal as default."""
    known = python_class.__dict__.get(_ATTRIBUTE)
    return known if isinstance(known, EnumType) else describe_enum(python_class)


def describe_enum(
    python_class: type[enum.IntEnum],
    *,
    type_name: str | None = None,
    bit_bound: int = 32,
    default: str | None = None,
    extensibility: Extensibility = Extensibility.FINAL,
) -> EnumType:
    name = python_class.__name__
    if not (isinstance(python_class, type) and issubclass(python_class, enum.IntEnum)):
        raise BadParameter(f"{name}: idl.enum decorates an enum.IntEnum")
    _check_bit_bound(name, bit_bound, 32)
    _check_extensibility(name, extensibility)
    literals = list(python_class)
    if not literals:
        raise BadParameter(f"{name}: an enum has one literal at least")
    if default is not None and default not in python_class.__members__:
        raise BadParameter(f"{name}: the default {default!r} is none of its literals")
    described = EnumType(
        python_class,
        type_name or name,
        bit_bound,
        literals[0] if default is None else python_class[default],
        extensibility,
    )
    limit = 2 ** (8 * described.size - 1)
    for literal in literals:
        if not -limit <= literal.value < limit:
            raise BadParameter(f"{name}.{literal.name}: {literal.value} does not fit {bit_bound} bits")
    _attach(python_class, described)
    return described


def bitmask_type(python_class: type[enum.IntFlag]) -> BitmaskType:
    """The description given by ``idl.bitmask``, or else the default one: 32 bits."""
    known = python_class.__dict__.get(_ATTRIBUTE)
    return known if isinstance(known, BitmaskType) else describe_bitmask(python_class)


def describe_bitmask(
    python_class: type[enum.IntFlag],
    *,
    type_name: str | None = None,
    bit_bound: int = 32,
    extensibility: Extensibility = Extensibility.FINAL,
) -> BitmaskType:
    name = python_class.__name__
    if not (isinstance(python_class, type) and issubclass(python_class, enum.IntFlag)):
        raise BadParameter(f"{name}: idl.bitmask decorates an enum.IntFlag")
    _check_bit_bound(name, bit_bound, 64)
    _check_extensibility(name, extensibility)
    if not list(python_class):
        raise BadParameter(f"{name}: a bitmask has one flag at least")
    for flag in python_class:
        if flag.value >= 2**bit_bound:
            raise BadParameter(f"{name}.{flag.name}: bit {flag.value.bit_length() - 1} is not one of {bit_bound}")
    described = BitmaskType(python_class, type_name or name, bit_bound, extensibility)
    _attach(python_class, described)
    return described


def bitmask_from(python_class: type[enum.IntFlag], number: int) -> enum.IntFlag:
    """The flags of a number that came from the network.

    ``IntFlag`` remembers every combination it ever made, for good.  A peer could fill the memory with combinations,
    so beyond a number of them they are made without being remembered.
    """
    known = python_class._value2member_map_.get(number)
    if known is not None:
        return known  # type: ignore[return-value]
    if len(python_class._value2member_map_) < _MOST_REMEMBERED:
        return python_class(number)
    flags: Any = int.__new__(python_class, number)
    flags._value_ = number
    flags._name_ = None
    return flags  # type: ignore[no-any-return]


def _check_bit_bound(name: str, bit_bound: int, most: int) -> None:
    if isinstance(bit_bound, bool) or not isinstance(bit_bound, int) or not 1 <= bit_bound <= most:
        raise BadParameter(f"{name}: bit_bound is a number from 1 to {most}, not {bit_bound!r}")


def _check_extensibility(name: str, extensibility: Extensibility) -> None:
    if extensibility not in (Extensibility.FINAL, Extensibility.APPENDABLE):
        raise BadParameter(f"{name}: extensibility is idl.FINAL or idl.APPENDABLE, not {extensibility!r}")


def _attach(python_class: type[Any], described: EnumType | BitmaskType) -> None:
    setattr(python_class, _ATTRIBUTE, described)
