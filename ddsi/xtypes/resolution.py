"""From a Python annotation to an IDL type.

``Annotated[idl.sequence[idl.int32], idl.bound(8), idl.key]`` becomes ``SequenceType(INT32, 8)`` and a key flag.  What
cannot be an IDL type is refused with the reason; the caller puts the member's name before it.  A name that is not
defined yet raises ``NameError``, so that the caller may try again later.
"""

from __future__ import annotations

import collections.abc
import enum
import sys
import types
import typing
from collections.abc import Mapping
from dataclasses import field
from typing import Annotated, Any, Protocol

from ..structure.dataclass import dataclass
from ..structure.errors import BadParameter
from . import model
from .annotations import Array, Bits, Bound, ElementOf, Flag, HashId, MemberId, MemberName, TypedefName, Unit
from .enumerations import bitmask_type, enum_type
from .model import (
    ArrayType,
    BitmaskType,
    BitsetType,
    EnumType,
    IdlType,
    Limits,
    MapType,
    Primitive,
    SequenceType,
    String,
    StructType,
    TryConstruct,
    Typedefs,
    UnionType,
)

__all__ = ["Resolved", "Resolver", "Scope", "named_type"]

STRUCT_ATTRIBUTE = "__idl_struct__"
"""Where a class decorated with ``idl.struct``, ``idl.union`` or ``idl.bitset`` keeps the type that it is."""

_NUMPY_NUMBERS = {
    primitive.name: primitive
    for primitive in (
        *(model.INT8, model.INT16, model.INT32, model.INT64, model.FLOAT32, model.FLOAT64),
        *(model.UINT8, model.UINT16, model.UINT32, model.UINT64),
    )
}

_MAPS = (dict, collections.abc.Mapping, collections.abc.MutableMapping)

_SEQUENCES = (list, collections.abc.Sequence, collections.abc.MutableSequence)

_MARKERS = ("key", "optional", "must_understand", "external", "non_serialized")
"""Those that stand alone in ``Annotated``, and are easily put between quotes."""


class Scope(Protocol):
    """Where local names are looked up: the frame around a class, or what stands for one where there is no source."""

    @property
    def f_locals(self) -> Mapping[str, Any]: ...


@dataclass(slots=True)
class Resolved:
    """The type that an annotation says, and the markers found on the way."""

    type: IdlType
    flags: set[str] = field(default_factory=set)
    member_id: MemberId | HashId | None = None
    idl_name: str = ""
    bits: Bits | None = None
    typedefs: Typedefs | None = None
    try_construct: TryConstruct = TryConstruct.DISCARD
    limits: Limits | None = None
    unit: str | None = None

    @property
    def hash_name(self) -> str | None:
        """What ``idl.hashid`` was given; empty where it stood alone, None where it was not there."""
        return self.member_id.name if isinstance(self.member_id, HashId) else None


@dataclass(frozen=True, slots=True)
class Resolver:
    """Resolves the annotations of one class; ``names`` are looked at before the module's globals."""

    module_names: dict[str, Any]
    names: Mapping[str, Any]

    def resolve(self, annotation: Any) -> Resolved:
        annotation = self._evaluate(annotation)
        origin = typing.get_origin(annotation)
        if origin is Annotated:
            base, *markers = typing.get_args(annotation)
            return self._annotated(base, markers)
        if origin in (typing.Union, types.UnionType):
            return self._optional(typing.get_args(annotation))
        if isinstance(annotation, str):
            raise BadParameter(f"{annotation!r} is no type")
        if origin in (*_SEQUENCES, *_MAPS) and not typing.get_args(annotation):  # typing.List and its like, bare
            raise BadParameter(_why_not(annotation, origin))
        if origin in _SEQUENCES:
            element = self._element(typing.get_args(annotation)[0], "sequence")
            return Resolved(SequenceType(element.type), typedefs=_of_parts(element.typedefs))
        if origin in _MAPS:
            key, value = (self._element(part, "map") for part in typing.get_args(annotation))
            return Resolved(
                MapType(_checked_key(key.type), value.type), typedefs=_of_parts(key.typedefs, value.typedefs)
            )
        return Resolved(self._plain(annotation))

    def _evaluate(self, annotation: Any) -> Any:
        """Strings (PEP 563, quoted names), forward references (PEP 649) and ``type`` aliases (PEP 695)."""
        for _ in range(16):  # an alias of an alias; nobody nests more
            if isinstance(annotation, str):
                annotation = eval(annotation, self.module_names, dict(self.names))
            elif isinstance(annotation, typing.ForwardRef):
                annotation = self._forward(annotation)
            elif type(annotation).__name__ == "TypeAliasType":
                annotation = annotation.__value__
            elif type(typing.get_origin(annotation)).__name__ == "TypeAliasType":  # as numpy's NDArray[...] is
                annotation = typing.get_origin(annotation).__value__[typing.get_args(annotation)]
            elif isinstance(annotation, typing.NewType):
                annotation = annotation.__supertype__
            else:
                break
        return annotation

    def _forward(self, reference: typing.ForwardRef) -> Any:
        if sys.version_info >= (3, 14):
            return reference.evaluate(globals=self.module_names, locals=dict(self.names))
        return reference.__forward_arg__

    # --- markers ---------------------------------------------------------------------------------------

    def _annotated(self, base: Any, markers: list[Any]) -> Resolved:
        markers = [inner for marker in markers for inner in (marker if isinstance(marker, tuple) else (marker,))]
        given = [marker for marker in markers if isinstance(marker, (Primitive, String, ElementOf))]
        if not given:
            resolved = self.resolve(base)
        elif isinstance(given[0], (Primitive, String)):
            resolved = Resolved(given[0])
        else:
            element = self.resolve(given[0].annotation)
            type_ = SequenceType(element.type, numpy=_is_numpy(self._evaluate(base), element.type))
            resolved = Resolved(type_, typedefs=_of_parts(element.typedefs))
        for marker in markers:
            if isinstance(marker, str) and marker in _MARKERS:  # other texts are for other readers (PEP 593)
                raise BadParameter(f"{marker!r} is a text, which says nothing here; idl.{marker} is meant")
            self._mark(resolved, marker)
        return resolved

    def _mark(self, resolved: Resolved, marker: Any) -> None:
        match marker:
            case Bound():
                resolved.type = _bounded(resolved.type, marker.limit)
            case Array():
                resolved.type, resolved.typedefs = _array(resolved, marker.dimensions)
            case Flag():
                resolved.flags.add(marker.name)
            case MemberId() | HashId():
                resolved.member_id = marker
            case MemberName(name=name):
                resolved.idl_name = name
            case TypedefName(name=name):
                inner = resolved.typedefs or Typedefs()
                resolved.typedefs = Typedefs((*inner.names, name), inner.parts, inner.rows)
            case Bits():
                resolved.bits = marker
            case Unit(name=name):
                resolved.unit = name
            case TryConstruct():
                resolved.try_construct = marker
            case Limits():
                _refuse_limits_of(resolved.type)
                resolved.limits = marker
            case types.FunctionType() if marker.__module__.endswith(".xtypes.idl"):
                raise BadParameter(f"idl.{marker.__name__} needs its argument, as in idl.{marker.__name__}(8)")
            case _:
                pass  # other libraries' metadata (PEP 593), and what is resolved already

    def _optional(self, alternatives: tuple[Any, ...]) -> Resolved:
        present = [alternative for alternative in alternatives if alternative is not type(None)]
        if len(present) != 1 or len(present) == len(alternatives):
            raise BadParameter("a choice of types is an IDL union: a class decorated with @idl.union")
        resolved = self.resolve(present[0])
        resolved.flags.add("optional")
        return resolved

    # --- plain types -----------------------------------------------------------------------------------

    def _plain(self, annotation: Any) -> IdlType:
        origin = typing.get_origin(annotation)
        if _is_ndarray(origin or annotation):
            return _numpy_sequence(annotation)
        if annotation is str:
            return String()
        if annotation is bool:
            return model.BOOLEAN
        if annotation is float:
            return model.FLOAT64
        if annotation in (bytes, bytearray):
            return SequenceType(model.OCTET)
        if isinstance(annotation, type):
            return _class_type(annotation)
        raise BadParameter(_why_not(annotation, origin))

    def _element(self, element: Any, collection: str) -> Resolved:
        resolved = self.resolve(element)
        unfit = resolved.flags | {
            word
            for word, is_said in (
                ("id", resolved.member_id is not None),
                ("range", resolved.limits is not None),
                ("try_construct", resolved.try_construct is not TryConstruct.DISCARD),
                ("unit", resolved.unit is not None),
            )
            if is_said
        }
        if unfit:
            raise BadParameter(f"idl.{min(unfit)} belongs to the member, not to the elements of its {collection}")
        return resolved


def _checked_key(type_: IdlType) -> IdlType:
    """What may be a key of a map: hashable in Python, and compared by value."""
    if isinstance(type_, (SequenceType, ArrayType, MapType, StructType, UnionType, BitsetType)):
        raise BadParameter(f"a map's key is a number, a string, a character, a boolean or an enum, not {type_}")
    return type_


def named_type(python_class: Any) -> EnumType | BitmaskType | BitsetType | StructType | UnionType:
    """The IDL type that a class is.  BadParameter where it is none."""
    found = _class_type(python_class) if isinstance(python_class, type) else None
    if not isinstance(found, (EnumType, BitmaskType, BitsetType, StructType, UnionType)):
        raise BadParameter(f"{python_class!r} is no IDL type; it is a class decorated with @idl.struct or its siblings")
    return found


def _refuse_limits_of(type_: IdlType) -> None:
    element = type_.element if isinstance(type_, (SequenceType, ArrayType)) else type_
    if not isinstance(element, Primitive) or not element.is_number:
        raise BadParameter(f"idl.range fits numbers, and sequences and arrays of them, not {type_}")


def _bounded(type_: IdlType, limit: int) -> IdlType:
    match type_:
        case String(bound=None):
            return String(limit, type_.wide)
        case MapType(bound=None):
            return MapType(type_.key, type_.value, limit)
        case SequenceType(bound=None):
            return SequenceType(type_.element, limit, type_.numpy)
        case ArrayType():
            raise BadParameter("idl.bound stands before idl.array, or on the element")
        case String() | SequenceType() | MapType():
            raise BadParameter("idl.bound is given twice")
        case _:
            raise BadParameter(f"idl.bound fits strings, sequences and maps, not {type_}")


def _array(resolved: Resolved, dimensions: tuple[int, ...]) -> tuple[ArrayType, Typedefs | None]:
    type_, typedefs = resolved.type, resolved.typedefs
    numpy = isinstance(type_, SequenceType) and type_.numpy
    for _ in dimensions:
        if isinstance(type_, SequenceType) and type_.bound is None:
            type_, typedefs = type_.element, typedefs.parts[0] if typedefs and typedefs.parts else None
    if not isinstance(type_, ArrayType):
        return ArrayType(type_, dimensions, numpy), _of_parts(typedefs)
    joined = ArrayType(type_.element, (*dimensions, *type_.dimensions), numpy or type_.numpy)
    if typedefs is not None and typedefs.names:
        return joined, Typedefs(parts=(typedefs,), rows=len(dimensions))
    if typedefs is not None and typedefs.rows:
        return joined, Typedefs(parts=typedefs.parts, rows=len(dimensions) + typedefs.rows)
    return joined, typedefs


def _of_parts(*parts: Typedefs | None) -> Typedefs | None:
    """Those of a collection, from those of its element, or key and value."""
    return Typedefs(parts=parts) if any(parts) else None


def _class_type(annotation: type[Any]) -> IdlType:
    described = annotation.__dict__.get(STRUCT_ATTRIBUTE)
    if isinstance(described, (StructType, UnionType, BitsetType)):
        return described
    if issubclass(annotation, enum.IntFlag):
        return bitmask_type(annotation)
    if issubclass(annotation, enum.IntEnum):
        return enum_type(annotation)
    raise BadParameter(_why_not(annotation, None))


def _why_not(annotation: Any, origin: Any) -> str:
    shown = getattr(annotation, "__name__", None) or repr(annotation)
    if annotation is int:
        return "int does not say its width; use idl.int32 or another of idl's integers"
    if annotation is Any:
        return "Any says no type"
    if isinstance(annotation, typing.TypeVar):
        return f"{shown} is a type variable, as of a bare idl.sequence; say of what: idl.sequence[...]"
    if annotation in _MAPS or origin in _MAPS:
        return f"{shown} does not say of what; use idl.map[key, value]"
    if annotation in _SEQUENCES or origin in _SEQUENCES:
        return f"{shown} does not say of what; use idl.sequence[...]"
    if tuple in (annotation, origin):
        return "a tuple is no IDL type; use idl.sequence[...], with idl.array(n) for a fixed number of elements"
    if isinstance(
        annotation, Flag | Bound | Array | MemberId | HashId | MemberName | TypedefName | Bits | Unit | Limits
    ):
        return f"{annotation!r} stands inside Annotated[type, ...], behind a type"
    if isinstance(annotation, type) and issubclass(annotation, enum.Enum):
        return f"{shown} is an Enum; IDL enums are enum.IntEnum, bitmasks enum.IntFlag"
    if isinstance(annotation, type) and annotation.__module__ != "builtins":
        return f"class {shown} is no IDL type; decorate it with @idl.struct"
    return f"{shown} is no IDL type"


# --- numpy, without importing it ---------------------------------------------------------------------------


def _is_ndarray(annotation: Any) -> bool:
    return getattr(annotation, "__name__", "") == "ndarray" and getattr(annotation, "__module__", "") == "numpy"


def _is_numpy(annotation: Any, element: IdlType) -> bool:
    if not _is_ndarray(typing.get_origin(annotation) or annotation):
        return False
    if not isinstance(element, Primitive) or not (element.is_number or element == model.BOOLEAN):
        raise BadParameter(f"a numpy array of {element} is not possible; numbers and booleans are")
    return True


def _numpy_sequence(annotation: Any) -> SequenceType:
    """``npt.NDArray[np.float64]`` says its element itself."""
    arguments = typing.get_args(annotation)
    scalar = typing.get_args(arguments[1])[0] if len(arguments) == 2 and typing.get_args(arguments[1]) else None
    element = _NUMPY_NUMBERS.get(getattr(scalar, "__name__", ""))
    if element is None:
        raise BadParameter("this numpy array does not say its element; add idl.sequence_of(idl.float64) or the like")
    return SequenceType(element, numpy=True)
