"""The words with which a Python class says its IDL type; applications see this module as ``ddsi.idl``.

    @idl.struct(typename="ShapeType")
    class ShapeType:
        color: Annotated[str, idl.key, idl.bound(128)]
        x: idl.int32
        points: idl.sequence[idl.float64] = ()

OMG IDL 4.2 §7.4 and DDS-XTypes 1.3 §7.3.  To a type checker ``idl.int32`` is ``int``, ``idl.float64`` is ``float``
and ``idl.sequence[T]`` is ``Sequence[T]``, which for octets ``bytes`` fulfils as well.

``load`` and ``loads`` make such classes from IDL text, ``to_idl`` makes IDL text from them.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import Field, field
from enum import IntEnum, IntFlag
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeAlias, TypeVar, dataclass_transform, overload

from ..structure.errors import BadParameter
from ..structure.qos_policies import DataRepresentationId
from . import model
from .annotations import (
    Array,
    Bits,
    Bound,
    CaseLabels,
    ElementOf,
    Flag,
    HashId,
    MemberId,
    MemberName,
    TypedefName,
    Unit,
)
from .bitsets import define_bitset
from .definition import define_struct
from .enumerations import describe_bitmask, describe_enum
from .idl_compiler import IdlError, IdlWarning
from .model import Extensibility, Limits, TryConstruct
from .resolution import named_type
from .unions import define_union, selected_member

if TYPE_CHECKING:
    from .idl_compiler.loading import Namespace

__all__ = [
    "APPENDABLE",
    "FINAL",
    "MUTABLE",
    "XCDR1",
    "XCDR2",
    "Extensibility",
    "IdlError",
    "IdlWarning",
    "array",
    "array_of",
    "bitmask",
    "bits",
    "bitset",
    "boolean",
    "bound",
    "case",
    "char",
    "enum",
    "external",
    "float32",
    "float64",
    "hashid",
    "id",
    "int8",
    "int16",
    "int32",
    "int64",
    "key",
    "load",
    "loads",
    "map",
    "must_understand",
    "name",
    "non_serialized",
    "octet",
    "optional",
    "range",
    "selected_member",
    "sequence",
    "sequence_of",
    "struct",
    "switch",
    "to_idl",
    "try_construct",
    "typedef",
    "uint8",
    "uint16",
    "uint32",
    "uint64",
    "union",
    "unit",
    "wchar",
    "wstring",
]

_T = TypeVar("_T")
_K = TypeVar("_K")
_C = TypeVar("_C")
_E = TypeVar("_E", bound=IntEnum)
_F = TypeVar("_F", bound=IntFlag)

FINAL = Extensibility.FINAL
APPENDABLE = Extensibility.APPENDABLE
MUTABLE = Extensibility.MUTABLE

XCDR1 = DataRepresentationId.XCDR1
XCDR2 = DataRepresentationId.XCDR2

boolean: TypeAlias = Annotated[bool, model.BOOLEAN]
octet: TypeAlias = Annotated[int, model.OCTET]
char: TypeAlias = Annotated[str, model.CHAR]
wchar: TypeAlias = Annotated[str, model.WCHAR]
int8: TypeAlias = Annotated[int, model.INT8]
int16: TypeAlias = Annotated[int, model.INT16]
int32: TypeAlias = Annotated[int, model.INT32]
int64: TypeAlias = Annotated[int, model.INT64]
uint8: TypeAlias = Annotated[int, model.UINT8]
uint16: TypeAlias = Annotated[int, model.UINT16]
uint32: TypeAlias = Annotated[int, model.UINT32]
uint64: TypeAlias = Annotated[int, model.UINT64]
float32: TypeAlias = Annotated[float, model.FLOAT32]
float64: TypeAlias = Annotated[float, model.FLOAT64]

sequence: TypeAlias = Sequence[_T]
"""``idl.sequence[T]``, for any T.  Takes lists, tuples and, for numbers, any buffer.  Comes back as ``bytes`` for
octet and uint8, ``array.array`` for other numbers, ``str`` for characters, a list for the rest."""

map: TypeAlias = dict[_K, _T]
"""``idl.map[K, V]``, a dict.  Keys are numbers, strings, characters, booleans, enums; ``idl.bound`` limits entries."""

wstring: TypeAlias = Annotated[str, model.String(wide=True)]
"""A string that travels as UTF-16; ``idl.bound`` counts its units.  Vendors disagree on its length on the wire (here:
in octets, as in Cyclone DDS and OpenDDS); ``str`` is the interoperable choice."""

key = Flag("key")
"""The member is part of the key (IDL ``@key``)."""

optional = Flag("optional")
"""The member may be None and then does not travel (IDL ``@optional``); the same as ``T | None``."""

must_understand = Flag("must_understand")
"""A receiver that does not know the member rejects the sample (IDL ``@must_understand``)."""

external = Flag("external")
"""IDL ``@external``: it changes neither the Python value nor the encoding."""

non_serialized = Flag("non_serialized")
"""The member does not travel (IDL ``@non_serialized``); a received sample has its default."""

hashid = HashId()
"""The member id is the hash of the member's name, or of a given one: ``idl.hashid("name")``."""


def bound(limit: int) -> Bound:
    """The most octets (UTF-8, without NUL) of a string, or elements of a sequence."""
    return Bound(limit)


def array(*dimensions: int) -> Array:
    """A fixed number of elements: ``Annotated[idl.sequence[idl.int32], idl.array(5)]``.

    With several dimensions, rows of rows: ``Annotated[idl.sequence[idl.sequence[idl.int32]], idl.array(2, 3)]``.  As
    many levels of ``sequence`` as there are dimensions are the array's own; what is left is the element.
    """
    return Array(dimensions)


def id(number: int) -> MemberId:
    """The member id, 0 to 0x0fffffff (IDL ``@id``)."""
    return MemberId(number)


def range(min: float | None = None, max: float | None = None) -> Limits:
    """The lowest and the highest value of a number, or of each element (IDL ``@range``, ``@min``, ``@max``).

    What is beyond them is refused when it is written.  What others send is not judged by them.
    """
    for limit in (min, max):
        if isinstance(limit, bool) or not isinstance(limit, int | float | None) or (limit or 0.0) - (limit or 0.0) != 0:
            raise BadParameter(f"idl.range takes finite numbers, not {limit!r}")
    if min is None and max is None:
        raise BadParameter("idl.range takes the lowest value, the highest, or both, as in idl.range(0, 10)")
    if min is not None and max is not None and min > max:
        raise BadParameter(f"idl.range({min}, {max}): nothing lies between them")
    return Limits(min, max)


def unit(name: str) -> Unit:
    """What a number counts (IDL ``@unit``): it is told to others with the complete type, and changes nothing here."""
    return Unit(name)


def try_construct(behavior: Literal["discard", "use_default", "trim"]) -> TryConstruct:
    """What becomes of a received value that does not fit: too long for its bound, or no literal of its enum.

    ``discard``, the default: the sample is malformed.  ``use_default``: the member has its default.  ``trim``: a
    string, sequence or map is cut to its bound.  (IDL ``@try_construct``, DDS-XTypes 1.3 §7.2.4.3.)
    """
    try:
        return TryConstruct(behavior)
    except ValueError:
        raise BadParameter(f'idl.try_construct takes "discard", "use_default" or "trim", not {behavior!r}') from None


def name(idl_name: str) -> MemberName:
    """The member's name in IDL, where Python keeps the word for itself: ``from_: Annotated[str, idl.name("from")]``."""
    return MemberName(idl_name)


def typedef(idl_name: str) -> TypedefName:
    """An IDL alias by name: ``Length: TypeAlias = Annotated[idl.float64, idl.typedef("module::Length")]``.

    It changes neither value nor encoding.  Other programs are told of it, and hash it into the type's identity.
    """
    return TypedefName(idl_name)


def bits(width: int, *, at: int | None = None) -> Bits:
    """A field of an ``idl.bitset``: how many bits, and the lowest of them (default: behind the field before)."""
    return Bits(width, at)


switch: Any = CaseLabels()
"""Marks the discriminator of a union: ``discriminator: idl.int32 = idl.switch``."""


def case(*labels: Any, default: bool = False) -> Any:
    """Marks a member of a union: ``a: idl.int32 = idl.case(1, 2)``, or ``idl.case(default=True)``.

    ``labels`` are the discriminators that select it; ``default``: those that no other case has.
    """
    if not labels and not default:
        raise BadParameter("idl.case takes the labels that select the member, or default=True")
    return CaseLabels(labels, default)


def sequence_of(element: Any) -> ElementOf:
    """The element of a sequence whose Python type does not tell it.

    ``Annotated[npt.NDArray[np.float64], idl.sequence_of(idl.float64)]``: values come back as numpy arrays;
    ``Annotated[bytes, idl.sequence_of(idl.uint8)]``: as bytes.
    """
    return ElementOf(element)


def array_of(element: Any, *dimensions: int) -> _ArrayOf:
    """As :func:`sequence_of`, for an array: ``Annotated[npt.NDArray[np.float64], idl.array_of(idl.float64, 3, 4)]``."""
    return (ElementOf(element), Array(dimensions))


_ArrayOf: TypeAlias = tuple[ElementOf, Array]


@overload
def struct(python_class: type[_C], /) -> type[_C]: ...
@overload
def struct(
    *,
    typename: str | None = None,
    extensibility: Extensibility = Extensibility.APPENDABLE,
    autoid: Literal["sequential", "hash"] = "sequential",
    nested: bool = False,
    representations: tuple[DataRepresentationId, ...] = (),
) -> Callable[[type[_C]], type[_C]]: ...
@dataclass_transform(field_specifiers=(field, Field))
def struct(
    python_class: type[Any] | None = None,
    /,
    *,
    typename: str | None = None,
    extensibility: Extensibility = Extensibility.APPENDABLE,
    autoid: Literal["sequential", "hash"] = "sequential",
    nested: bool = False,
    representations: tuple[DataRepresentationId, ...] = (),
) -> Any:
    """Make a class an IDL struct: a dataclass with slots whose annotations say the IDL types.

    ``typename`` is the name on the wire (``module::Name``; default: the class's name); ``extensibility`` is
    ``idl.FINAL``, ``idl.APPENDABLE`` (the default, as in IDL 4.2) or ``idl.MUTABLE``; ``autoid`` tells how members
    without ``idl.id`` get their ids; ``nested`` says that it is no topic type itself (IDL ``@nested``; other programs
    are told, nothing else changes); ``representations`` are those that topics may use, the preferred one first, as in
    ``(idl.XCDR2,)`` (IDL ``@data_representation``; default: both).  A base class that is a struct is the IDL base.

    Raises BadParameter, naming member and reason, for a class that cannot be a type; where an annotation names
    what is not yet defined, at first use.
    """
    frame = sys._getframe(1)  # where local classes are found, which the module does not know

    def decorate(undecorated: type[Any]) -> type[Any]:
        return define_struct(
            undecorated,
            type_name=typename,
            extensibility=extensibility,
            autoid=autoid,
            is_nested=nested,
            frame=frame,
            representations=representations,
        )

    return decorate if python_class is None else decorate(python_class)


@overload
def union(python_class: type[_C], /) -> type[_C]: ...
@overload
def union(
    *,
    typename: str | None = None,
    extensibility: Extensibility = Extensibility.APPENDABLE,
    autoid: Literal["sequential", "hash"] = "sequential",
    nested: bool = False,
) -> Callable[[type[_C]], type[_C]]: ...
@dataclass_transform(kw_only_default=True)
def union(
    python_class: type[Any] | None = None,
    /,
    *,
    typename: str | None = None,
    extensibility: Extensibility = Extensibility.APPENDABLE,
    autoid: Literal["sequential", "hash"] = "sequential",
    nested: bool = False,
) -> Any:
    """Make a class an IDL union: one member at a time, chosen by a discriminator.

        @idl.union
        class Measurement:
            kind: idl.int32 = idl.switch
            count: idl.int32 = idl.case(1, 2)
            text: str = idl.case(default=True)

    ``Measurement(count=5)`` has the first label as discriminator, ``Measurement(kind=2, count=5)`` the one given.
    Reading the other member raises AttributeError; setting a member selects it.  Options are those of
    :func:`struct`.  Raises BadParameter as that does.
    """
    frame = sys._getframe(1)

    def decorate(undecorated: type[Any]) -> type[Any]:
        return define_union(
            undecorated,
            type_name=typename,
            extensibility=extensibility,
            autoid=autoid,
            is_nested=nested,
            frame=frame,
        )

    return decorate if python_class is None else decorate(python_class)


@overload
@dataclass_transform()
def bitset(python_class: type[_C], /) -> type[_C]: ...
@overload
@dataclass_transform()
def bitset(*, typename: str | None = None) -> Callable[[type[_C]], type[_C]]: ...
@dataclass_transform()
def bitset(python_class: type[Any] | None = None, /, *, typename: str | None = None) -> Any:
    """Make a class an IDL bitset: fields of some bits each, ``Annotated[idl.uint8, idl.bits(3)]``, all 0 by default.

    A base class that is a bitset is the IDL base.  Raises BadParameter naming the field.
    """
    frame = sys._getframe(1)

    def decorate(undecorated: type[Any]) -> type[Any]:
        return define_bitset(undecorated, type_name=typename, frame=frame)

    return decorate if python_class is None else decorate(python_class)


@overload
def enum(python_class: type[_E], /) -> type[_E]: ...
@overload
def enum(
    *,
    typename: str | None = None,
    bit_bound: int = 32,
    default: str | None = None,
    extensibility: Extensibility = FINAL,
) -> Callable[[type[_E]], type[_E]]: ...
def enum(
    python_class: type[Any] | None = None,
    /,
    *,
    typename: str | None = None,
    bit_bound: int = 32,
    default: str | None = None,
    extensibility: Extensibility = FINAL,
) -> Any:
    """Say more of an ``IntEnum`` than its literals: the type name, ``@bit_bound`` (1 to 32), ``@default_literal``.

    ``extensibility``: ``idl.APPENDABLE`` where literals may be added later, so that programs with fewer of them still
    match (DDS-XTypes 1.3 §7.2.3).  Without this decorator any ``enum.IntEnum`` is a final IDL enum of 32 bits whose
    first literal is the default.
    """

    def decorate(enumeration: type[_E]) -> type[_E]:
        describe_enum(
            enumeration, type_name=typename, bit_bound=bit_bound, default=default, extensibility=extensibility
        )
        return enumeration

    return decorate if python_class is None else decorate(python_class)


@overload
def bitmask(python_class: type[_F], /) -> type[_F]: ...
@overload
def bitmask(
    *, typename: str | None = None, bit_bound: int = 32, extensibility: Extensibility = FINAL
) -> Callable[[type[_F]], type[_F]]: ...
def bitmask(
    python_class: type[Any] | None = None,
    /,
    *,
    typename: str | None = None,
    bit_bound: int = 32,
    extensibility: Extensibility = FINAL,
) -> Any:
    """Say more of an ``IntFlag`` than its flags: the type name, ``@bit_bound`` (1 to 64), and that it is appendable.

    Without this decorator any ``enum.IntFlag`` is a final IDL bitmask of 32 bits.
    """

    def decorate(flags: type[_F]) -> type[_F]:
        describe_bitmask(flags, type_name=typename, bit_bound=bit_bound, extensibility=extensibility)
        return flags

    return decorate if python_class is None else decorate(python_class)


def load(
    path: str | Path,
    *,
    include: Sequence[str | Path] = (),
    defines: Mapping[str, str] | None = None,
    default_extensibility: Extensibility = Extensibility.APPENDABLE,
) -> Namespace:
    """The types of an IDL file (OMG IDL 4.2), ready for use: ``load("shapes.idl").geometry.Point(1, 2)``.

    The result has an attribute for each type and constant, and for each module one that has its own.  ``include``
    are the folders where ``#include`` looks, behind the file's own; ``defines`` macros that are there from the start;
    ``default_extensibility`` holds where the text says none (other compilers: final, for instance, in Cyclone DDS's).
    What was left out, such as unknown annotations, is told in its ``idl_warnings``.

    Raises IdlError, with file, line, column and what was expected; OSError if the file cannot be read; BadParameter.
    """
    from .idl_compiler.loading import load_file

    return load_file(path, include=include, defines=defines or {}, default_extensibility=default_extensibility)


def loads(
    text: str,
    *,
    include: Sequence[str | Path] = (),
    defines: Mapping[str, str] | None = None,
    default_extensibility: Extensibility = Extensibility.APPENDABLE,
) -> Namespace:
    """The types in IDL text; everything else as in :func:`load`."""
    from .idl_compiler.loading import load_text

    return load_text(text, include=include, defines=defines or {}, default_extensibility=default_extensibility)


def to_idl(python_class: type[Any]) -> str:
    """The IDL of a class that is an IDL type, and of all types that it needs; ``loads`` gives the same types again.

    Raises BadParameter for a class that is none, or whose names IDL does not allow.
    """
    from .idl_compiler.idl_text import idl_text

    return idl_text(named_type(python_class))
