"""Say which member of a sample does not fit its type, and why.

Generated serialisers are fast because they let :mod:`struct` and Python itself refuse unfit values.  What those say
("required argument is not an integer") names no member, so on any exception this walk looks for the culprit, at
leisure.  It reports the first in declaration order as ``BadParameter("pose.position.x: ...")``.
"""

from __future__ import annotations

import contextlib
import math
import operator
import struct
from typing import Any

from ..structure.errors import BadParameter
from .buffers import flatten, octets
from .model import (
    BOOLEAN,
    ArrayType,
    BitmaskType,
    BitsetType,
    EnumType,
    IdlType,
    Limits,
    MapType,
    Member,
    Primitive,
    SequenceType,
    String,
    StructType,
    UnionType,
)

__all__ = ["check_sample", "check_value"]


def check_sample(type_: StructType, sample: Any) -> None:
    """Raise BadParameter for the first member that cannot be written; return if all is well."""
    if not isinstance(sample, type_.python_class):
        raise BadParameter(f"{type_.type_name}: a {type(sample).__name__} was given for a {_name(type_)}")
    for member in type_.members:
        check_value(member, _attribute(sample, member, ""), member.name)


def check_value(member: Member, value: Any, path: str, *, depth: int = 0) -> None:
    """Raise BadParameter, beginning with ``path``, unless ``value`` fits the member."""
    if value is None and member.is_optional:
        return
    try:
        _check(member.type, value, path, depth)
        if member.limits is not None:
            _check_limits(member.type, member.limits, value, path)
    except (BadParameter, NameError):
        raise
    except Exception as error:  # from a method of the value's own, or numpy's word on the truth of an array
        raise BadParameter(f"{path}: {_shown(value)} is no {member.type} ({type(error).__name__}: {error})") from error


def _check(type_: IdlType, value: Any, path: str, depth: int) -> None:
    match type_:
        case Primitive():
            _check_primitive(type_, value, path)
        case String():
            _check_string(type_, value, path)
        case EnumType():
            _check_enum(type_, value, path)
        case BitmaskType():
            _check_integer(type_.code, type_.size, value, path, f"flags of {type_.type_name}")
        case BitsetType():
            _check_bitset(type_, value, path)
        case MapType():
            _check_map(type_, value, path, depth)
        case UnionType():
            _check_union(type_, value, path, depth)
        case SequenceType():
            _check_sequence(type_, value, path, depth)
        case ArrayType():
            _check_array(type_, value, path, depth)
        case StructType():
            _check_struct(type_, value, path, depth)


def _check_limits(type_: IdlType, limits: Limits, value: Any, path: str) -> None:
    items = [("", value)]
    if isinstance(type_, (SequenceType, ArrayType)):
        flat = flatten(value, type_.dimensions) if isinstance(type_, ArrayType) else value
        flat = flat.tolist() if hasattr(flat, "tolist") else flat
        items = [(type_.place(index), item) for index, item in enumerate(flat)]
    for place, item in items:
        if not limits.allow(item):
            raise BadParameter(f"{path}{place}: {_shown(item)} is beyond its range ({limits})")


def _check_primitive(type_: Primitive, value: Any, path: str) -> None:
    if type_ == BOOLEAN:
        if value not in (True, False):
            raise BadParameter(f"{path}: {_shown(value)} is no boolean")
    elif type_.name in ("char", "wchar"):
        limit = 256**type_.size
        if not isinstance(value, str) or len(value) != 1 or ord(value) >= limit:
            raise BadParameter(f"{path}: {_shown(value)} is no {type_}: one character up to {chr(limit - 1)!r}")
    elif type_.code in "fd":
        try:
            struct.pack(f"<{type_.code}", value)
        except OverflowError:
            raise BadParameter(f"{path}: {_shown(value)} is too large for a {type_}") from None
        except (struct.error, TypeError):
            raise BadParameter(f"{path}: {_shown(value)} is no number, as {type_} needs") from None
    else:
        _check_integer(type_.code, type_.size, value, path, str(type_))


def _check_integer(code: str, size: int, value: Any, path: str, name: str) -> None:
    try:
        number = operator.index(value)
    except (TypeError, BadParameter):
        raise BadParameter(f"{path}: {_shown(value)} is no integer, as {name} needs") from None
    bits = 8 * size
    lowest, highest = (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1) if code.islower() else (0, 2**bits - 1)
    if not lowest <= number <= highest:
        raise BadParameter(f"{path}: {number} does not fit {name} ({lowest} to {highest})")


def _check_string(type_: String, value: Any, path: str) -> None:
    if not isinstance(value, str):
        raise BadParameter(f"{path}: {_shown(value)} is no string")
    if type_.wide:
        _check_wide_string(type_, value, path)
        return
    try:
        encoded = value.encode()
    except UnicodeEncodeError as error:
        raise BadParameter(f"{path}: {_shown(value)} has no UTF-8 form ({error.reason})") from None
    if 0 in encoded:
        raise _holds_nul(path, value)
    if type_.bound is not None and len(encoded) > type_.bound:
        raise BadParameter(f"{path}: a string of {len(encoded)} octets exceeds its bound of {type_.bound}")


def _holds_nul(path: str, value: str) -> BadParameter:
    """Others read a string up to its first NUL.  One may have been received: it is not sent on."""
    return BadParameter(
        f"{path}: {_shown(value)} contains a NUL, which ends a string for others; cut it there "
        "(text.partition('\\0')[0]), or make the member an idl.sequence[idl.uint8]"
    )


def _check_wide_string(type_: String, value: str, path: str) -> None:
    if "\0" in value:
        raise _holds_nul(path, value)
    units = len(value.encode("utf-16-le", "surrogatepass")) // 2
    if type_.bound is not None and units > type_.bound:
        raise BadParameter(f"{path}: a wide string of {units} characters exceeds its bound of {type_.bound}")


def _check_bitset(type_: BitsetType, value: Any, path: str) -> None:
    if not isinstance(value, type_.python_class):
        raise BadParameter(f"{path}: {_shown(value)} is no {type_.python_class.__name__}")
    try:
        operator.index(value)
    except BadParameter as error:
        raise BadParameter(f"{path}.{error}") from None


def _check_map(type_: MapType, value: Any, path: str, depth: int) -> None:
    if not hasattr(value, "items") or not hasattr(value, "__len__"):
        raise BadParameter(f"{path}: {_shown(value)} is no dict of {type_.key} to {type_.value}")
    if type_.bound is not None and len(value) > type_.bound:
        raise BadParameter(f"{path}: {len(value)} entries exceed the bound of {type_.bound}")
    for key, item in value.items():
        _check(type_.key, key, f"{path}, key {_shown(key)}", depth)
        _check(type_.value, item, f"{path}[{_shown(key)}]", depth)


def _check_union(type_: UnionType, value: Any, path: str, depth: int) -> None:
    if not isinstance(value, type_.python_class):
        raise BadParameter(f"{path}: {_shown(value)} is no {type_.python_class.__name__}")
    if depth >= StructType.MAX_DEPTH:
        raise BadParameter(f"{path}: types are nested deeper than {StructType.MAX_DEPTH}")
    _check(type_.discriminator.type, value._idl_discriminator, f"{path}.{type_.discriminator.name}", depth)
    case = type_.case_of(value._idl_discriminator)
    if case is not None:
        check_value(case, value._idl_value, f"{path}.{case.name}", depth=depth + 1)


def _check_enum(type_: EnumType, value: Any, path: str) -> None:
    try:
        type_.python_class(value)
    except ValueError:
        names = ", ".join(literal.name for literal in list(type_.python_class)[:8])
        raise BadParameter(f"{path}: {_shown(value)} is no literal of {type_.type_name} ({names})") from None


def _check_sequence(type_: SequenceType, value: Any, path: str, depth: int) -> None:
    count = _count(type_, value, path)
    if type_.bound is not None and count > type_.bound:
        raise BadParameter(f"{path}: {count} elements exceed the bound of {type_.bound}")
    _check_elements(type_, value, path, depth)


def _check_array(type_: ArrayType, value: Any, path: str, depth: int) -> None:
    _count(type_, value, path)
    flat: Any = None
    with contextlib.suppress(TypeError, ValueError):
        flat = flatten(value, type_.dimensions)
    if flat is None or _number_of_elements(flat) != type_.count:
        raise BadParameter(f"{path}: {_shape(value)} elements where the array has {_times(type_.dimensions)}")
    _check_elements(type_, flat, path, depth)


def _count(type_: SequenceType | ArrayType, value: Any, path: str) -> int:
    characters = isinstance(type_.element, Primitive) and type_.element.name in ("char", "wchar")
    if not hasattr(value, "__len__") or not hasattr(value, "__getitem__") or isinstance(value, dict):
        raise BadParameter(f"{path}: {_shown(value)} is no sequence of {type_.element}")
    if isinstance(value, str) and not characters:
        raise BadParameter(f"{path}: {_shown(value)} is a string, not a sequence of {type_.element}")
    octets_expected = isinstance(type_.element, Primitive) and type_.element.is_octet
    return _number_of_elements(value) if octets_expected else len(value)


def _check_elements(type_: SequenceType | ArrayType, value: Any, path: str, depth: int) -> None:
    element = type_.element
    if isinstance(element, Primitive) and element.is_octet:
        try:
            octets(value)
            return
        except (TypeError, ValueError):
            pass  # say which element below
    if isinstance(element, Primitive) and element.is_number and _is_buffer(value):
        view = memoryview(value)
        if not view.c_contiguous or view.format not in "bBhHiIlLqQfd":
            raise BadParameter(f"{path}: a buffer of format {view.format!r} does not hold {element}")
    for index, item in enumerate(value.tolist() if hasattr(value, "tolist") else value):
        _check(element, item, f"{path}{type_.place(index)}", depth)


def _check_struct(type_: StructType, value: Any, path: str, depth: int) -> None:
    if not isinstance(value, type_.python_class):
        raise BadParameter(f"{path}: {_shown(value)} is no {_name(type_)}")
    if depth >= StructType.MAX_DEPTH:
        raise BadParameter(f"{path}: structs are nested deeper than {StructType.MAX_DEPTH}")
    for member in type_.members:
        inner = f"{path}.{member.name}"
        check_value(member, _attribute(value, member, path), inner, depth=depth + 1)


def _attribute(value: Any, member: Member, path: str) -> Any:
    try:
        return getattr(value, member.name)
    except AttributeError:
        raise BadParameter(f"{path}{'.' if path else ''}{member.name}: it was never set") from None


def _is_buffer(value: Any) -> bool:
    try:
        memoryview(value)
    except (TypeError, ValueError):
        return False
    return True


def _number_of_elements(value: Any) -> int:
    if not _is_buffer(value):
        return len(value)
    view = memoryview(value)
    return view.nbytes // view.itemsize


def _shape(value: Any) -> str:
    shape = getattr(value, "shape", None)
    return _times(shape) if shape else str(len(value))


def _times(dimensions: tuple[int, ...]) -> str:
    return "x".join(map(str, dimensions)) if math.prod(dimensions) else "0"


def _name(type_: StructType) -> str:
    return type_.python_class.__name__


def _shown(value: Any) -> str:
    try:
        text = repr(value)
    except Exception:
        text = f"a {type(value).__name__}"
    return text if len(text) <= 80 else f"{text[:76]}..."
