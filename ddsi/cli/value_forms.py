"""Samples as JSON has values, for any type: what ``ddsi echo`` prints and ``ddsi pub`` takes.

There and back it is the same: a struct is an object, a sequence or array a list, octets are hexadecimal, an enum's
literal is its name, flags are names with ``|`` between, a map is an object, a union an object of its discriminator and
the member that this selects, an optional member that is not there null.  Numbers that JSON cannot say are "nan", "inf"
and "-inf".  Characters and strings are texts.
"""

from __future__ import annotations

import difflib
import enum
import json
import math
import struct
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ..structure.errors import BadParameter
from ..xtypes.defaults import zero_value
from ..xtypes.model import (
    BOOLEAN,
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

__all__ = ["Elements", "Form", "Text", "form_of", "value_of"]

Form = Any
"""What ``json.loads`` gives; from the command line also :class:`Text` and :class:`Elements`."""

_DISCRIMINATOR = "discriminator"
_MOST_SHOWN = 12


@dataclass(frozen=True, slots=True)
class Text:
    """A value as somebody typed it: what it means, the member's type says."""

    text: str


class Elements(dict[int, Form]):
    """Some elements of a sequence or array, by their index."""


# --- from a sample -------------------------------------------------------------------------------------------


def form_of(type_: IdlType, value: Any) -> Form:
    """What JSON has for a value of a type."""
    match type_:
        case StructType():
            return {
                member.name_in_idl: None
                if (inner := getattr(value, member.name)) is None
                else form_of(member.type, inner)
                for member in type_.members
            }
        case UnionType():
            return _union_form(type_, value)
        case BitsetType():
            return {field.name: getattr(value, field.name) for field in type_.fields}
        case EnumType():
            return _enum_form(type_, value)
        case BitmaskType():
            return _flags_text(value)
        case MapType():
            return {_key_text(form_of(type_.key, key)): form_of(type_.value, item) for key, item in value.items()}
        case SequenceType() | ArrayType():
            return _elements_form(type_, value)
        case Primitive(code="f" | "d" as code):
            return _float_form(float(value), code)
        case _:
            return value


def _float_form(value: float, code: str) -> Form:
    """Of a float32 the shortest number that it stands for: 0.1, and not all of 0.10000000149011612."""
    if not math.isfinite(value):
        return str(value)
    if code == "f":
        octets = struct.pack("f", value)
        shorter = (float(f"{value:.{digits}g}") for digits in (6, 7, 8))
        return next((short for short in shorter if struct.pack("f", short) == octets), value)
    return value


def _union_form(type_: UnionType, value: Any) -> Form:
    discriminator = value._idl_discriminator
    found = {_DISCRIMINATOR: form_of(type_.discriminator.type, discriminator)}
    case = type_.case_of(discriminator)
    if case is not None:
        found[_union_key(case)] = form_of(case.type, value._idl_value)
    return found


def _union_key(case: Member) -> str:
    """The member's name; one that is called as the discriminator is, by the name that it has in Python."""
    return case.name if case.name_in_idl == _DISCRIMINATOR else case.name_in_idl


def _enum_form(type_: EnumType, value: Any) -> Form:
    return value.name if isinstance(value, enum.IntEnum) else int(value)


def _flags_text(value: Any) -> str | int:
    flags: type[enum.IntFlag] = type(value)
    known = [flag for flag in flags if flag in value]
    rest = int(value) & ~sum(int(flag) for flag in known)
    return int(value) if rest or not known else "|".join(str(flag.name) for flag in known)


def _key_text(form: Form) -> str:
    return form if isinstance(form, str) else json.dumps(form)


def _elements_form(type_: SequenceType | ArrayType, value: Any) -> Form:
    depth = len(type_.dimensions) if isinstance(type_, ArrayType) else 1
    return _row_form(type_.element, value, depth)


def _row_form(element: IdlType, value: Any, depth: int) -> Form:
    if depth > 1:
        return [_row_form(element, row, depth - 1) for row in value]
    if isinstance(element, Primitive):
        if element.is_octet:
            return bytes(value).hex()
        if not element.is_number and element != BOOLEAN:
            return "".join(value)
    return [form_of(element, item) for item in value]


# --- to a sample ---------------------------------------------------------------------------------------------


def value_of(type_: IdlType, form: Form, path: str = "") -> Any:
    """The value that a form says.  What it does not say has its default.

    Raises BadParameter, with the member's path, for what cannot be one; ranges and bounds, writing checks.
    """
    if isinstance(form, Text):
        form = _typed(type_, form.text, path)
    match type_:
        case StructType():
            return _struct_value(type_, form, path)
        case UnionType():
            return _union_value(type_, form, path)
        case BitsetType():
            return _bitset_value(type_, form, path)
        case EnumType():
            return _enum_value(type_, form, path)
        case BitmaskType():
            return _flags_value(type_, form, path)
        case MapType():
            return _map_value(type_, form, path)
        case SequenceType():
            return _row_value(type_.element, form, path, ())
        case ArrayType():
            return _row_value(type_.element, form, path, type_.dimensions)
        case String():
            return _checked(str, form, path, type_)
        case Primitive():
            return _primitive_value(type_, form, path)


def _typed(type_: IdlType, text: str, path: str) -> Form:
    """What somebody typed for a member of this type: texts need no quotes, all else is JSON."""
    if isinstance(type_, (EnumType, BitmaskType)) or _is_text(type_):
        return _unquoted(text)
    if isinstance(type_, Primitive):
        return {"true": True, "false": False}.get(text.lower(), text) if type_ == BOOLEAN else text
    try:
        return json.loads(text)
    except ValueError:
        if _is_octets(type_):
            return text
        raise _refusal(path, f"{_shown(text)} is no JSON, as {_kind(type_)} needs it") from None


def _unquoted(text: str) -> str:
    if len(text) >= 2 and text[0] == text[-1] == '"':
        try:
            return str(json.loads(text))
        except ValueError:
            pass
    return text


def _is_text(type_: IdlType) -> bool:
    if isinstance(type_, (SequenceType, ArrayType)):
        return _is_text(type_.element) and isinstance(type_.element, Primitive)
    return isinstance(type_, String) or (isinstance(type_, Primitive) and type_.name in ("char", "wchar"))


def _is_octets(type_: IdlType) -> bool:
    return (
        isinstance(type_, (SequenceType, ArrayType)) and isinstance(type_.element, Primitive) and type_.element.is_octet
    )


def _struct_value(type_: StructType, form: Form, path: str) -> Any:
    given = dict(_object(form, path, type_.type_name))
    value = zero_value(type_)
    for member in type_.members:
        key = next((name for name in (member.name_in_idl, member.name) if name in given), None)
        if key is None:
            continue
        inner, said = _joined(path, member.name), given.pop(key)
        is_absent = said is None or (isinstance(said, Text) and said.text == "null" and not _is_text(member.type))
        if is_absent and not member.is_optional:
            raise _refusal(inner, "null is for optional members")
        setattr(value, member.name, None if is_absent else value_of(member.type, said, inner))
    if given:
        raise _unknown(path, next(iter(given)), [member.name_in_idl for member in type_.members])
    return value


def _union_value(type_: UnionType, form: Form, path: str) -> Any:
    given = dict(_object(form, path, type_.type_name))
    said: dict[str, Any] = {}
    switch = type_.discriminator
    if _DISCRIMINATOR in given:
        inner = _joined(path, _DISCRIMINATOR)
        said[switch.name] = value_of(switch.type, given.pop(_DISCRIMINATOR), inner)
    for case in type_.cases:
        key = next((name for name in (_union_key(case), case.name) if name in given), None)
        if key is not None:
            said[case.name] = value_of(case.type, given.pop(key), _joined(path, case.name))
    if given:
        raise _unknown(path, next(iter(given)), [_DISCRIMINATOR, *map(_union_key, type_.cases)])
    try:
        return type_.python_class(**said)
    except (BadParameter, TypeError) as error:
        raise _refusal(path, str(error)) from None


def _bitset_value(type_: BitsetType, form: Form, path: str) -> Any:
    value = type_.python_class()
    names = {field.name: field.type for field in type_.fields}
    for name, said in _object(form, path, type_.type_name).items():
        if name not in names:
            raise _unknown(path, name, list(names))
        setattr(value, name, value_of(names[name], said, _joined(path, name)))
    return value


def _enum_value(type_: EnumType, form: Form, path: str) -> Any:
    literals = type_.python_class
    if isinstance(form, str):
        name = form.rpartition("::")[2].rpartition(".")[2]
        for literal in literals:
            if name in (literal.name, literal.name.rstrip("_")):
                return literal
    try:
        return literals(_integer(form))
    except ValueError:
        raise _unknown(path, str(form), list(literals.__members__), f"literal of {type_.type_name}") from None


def _flags_value(type_: BitmaskType, form: Form, path: str) -> Any:
    flags = type_.python_class
    number = 0
    for part in form.split("|") if isinstance(form, str) else [form]:
        name = part.strip() if isinstance(part, str) else part
        if isinstance(name, str) and name in flags.__members__:
            number |= flags[name]
            continue
        try:
            number |= _integer(name)
        except ValueError:
            raise _unknown(path, str(name), list(flags.__members__), f"flag of {type_.type_name}") from None
    return flags(number) if number >= 0 else number


def _row_value(element: IdlType, form: Form, path: str, dimensions: tuple[int, ...]) -> Any:
    """A sequence, or where there are dimensions an array, of which the outermost is this row's."""
    if isinstance(form, Text):
        form = _typed(ArrayType(element, dimensions), form.text, path)
    elif isinstance(form, Elements):
        form = _filled(element, form, path, dimensions)
    inner = dimensions[1:]
    if not inner and isinstance(element, Primitive) and isinstance(form, str):
        if element.is_octet:
            return _octets(form, path)
        if element.name in ("char", "wchar"):
            return form
    if not isinstance(form, list):
        raise _refusal(path, f"a list is wanted, not {_shown(form)}")
    values = [
        _row_value(element, item, f"{path}[{index}]", inner) if inner else value_of(element, item, f"{path}[{index}]")
        for index, item in enumerate(form)
    ]
    if dimensions and len(values) != dimensions[0]:
        raise _refusal(path, f"{len(values)} elements where the array has {dimensions[0]}")
    return values


def _filled(element: IdlType, given: Elements, path: str, dimensions: tuple[int, ...]) -> list[Form]:
    """All elements where only some are said; the others are their defaults."""
    count = dimensions[0] if dimensions else max(given) + 1
    if max(given) >= count:
        raise _refusal(f"{path}[{max(given)}]", f"the array has {count} elements")
    row = ArrayType(element, dimensions[1:]) if dimensions[1:] else element
    default = form_of(row, zero_value(row))
    return [given.get(index, default) for index in range(count)]


def _octets(text: str, path: str) -> bytes:
    try:
        return bytes.fromhex(text.removeprefix("0x"))
    except ValueError:
        raise _refusal(path, f"{_shown(text)} is not hexadecimal, as octets are") from None


def _map_value(type_: MapType, form: Form, path: str) -> Any:
    if isinstance(form, Elements):
        form = {str(key): item for key, item in form.items()}
    return {
        value_of(type_.key, Text(key), f"{path}, key {_shown(key)}"): value_of(type_.value, item, f"{path}[{key}]")
        for key, item in _object(form, path, "a map").items()
    }


def _primitive_value(type_: Primitive, form: Form, path: str) -> Any:
    if type_ == BOOLEAN:
        if form in (True, False, "0", "1"):
            return bool(int(form))
        raise _refusal(path, f"{_shown(form)} is no boolean: true or false")
    if type_.name in ("char", "wchar"):
        return _checked(str, form, path, type_)
    try:
        if type_.code in "fd":
            return float(form)
        return _integer(form)
    except (TypeError, ValueError):
        raise _refusal(path, f"{_shown(form)} is no {type_}") from None


def _integer(form: Form) -> int:
    """A whole number, also one said as ``0x1f``.  ValueError for anything else."""
    if isinstance(form, str):
        return int(form, 0)
    if isinstance(form, bool) or not isinstance(form, int):
        raise ValueError
    return form


def _object(form: Form, path: str, what: str) -> Mapping[str, Form]:
    if not isinstance(form, dict) or isinstance(form, Elements):
        raise _refusal(path, f"{what} is an object, as in {{...}}, not {_shown(form)}")
    return form


def _checked(kind: type[str], form: Form, path: str, type_: IdlType) -> Any:
    if not isinstance(form, kind):
        raise _refusal(path, f"{_shown(form)} is no {type_}")
    return form


def _unknown(path: str, name: str, known: list[str], what: str = "member") -> BadParameter:
    close = difflib.get_close_matches(name, known[:1000], n=1)
    hint = f" (is {close[0]} meant?)" if close else ""
    there = ", ".join(known[:_MOST_SHOWN]) + (", ..." if len(known) > _MOST_SHOWN else "")
    return _refusal(path, f"there is no {what} {_shown(name)}{hint}; there are {there or 'none'}")


def _joined(path: str, name: str) -> str:
    return f"{path}.{name}" if path else name


def _kind(type_: IdlType) -> str:
    return type_.type_name if isinstance(type_, (StructType, UnionType, BitsetType)) else str(type_)


def _refusal(path: str, reason: str) -> BadParameter:
    return BadParameter(f"{path}: {reason}" if path else reason)


def _shown(form: Form) -> str:
    text = form.text if isinstance(form, Text) else repr(form)
    return text if len(text) <= 60 else f"{text[:57]}..."
