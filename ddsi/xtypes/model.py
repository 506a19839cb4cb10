"""The type model: what an IDL type is, free of how Python spells it and of how CDR encodes it.

DDS-XTypes 1.3 §7.2.2 (the type system).  A topic type is a :class:`StructType` whose members have types built
from primitives, strings, enums, bitmasks, sequences, arrays and other structs.  Nodes are values, except the
struct, which is an identity: its members are found when they are first asked for, so that types may name
themselves and each other.  Not here (yet): unions, maps, wide strings, aliases.
"""

from __future__ import annotations

import enum
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, ClassVar

__all__ = [
    "BOOLEAN",
    "CHAR",
    "FLOAT32",
    "FLOAT64",
    "INT8",
    "INT16",
    "INT32",
    "INT64",
    "OCTET",
    "UINT8",
    "UINT16",
    "UINT32",
    "UINT64",
    "WCHAR",
    "ArrayType",
    "BitmaskType",
    "EnumType",
    "Extensibility",
    "IdlType",
    "Member",
    "Primitive",
    "SequenceType",
    "String",
    "StructType",
    "nested_structs",
    "reachable_structs",
]


class Extensibility(enum.Enum):
    """How a type may grow (DDS-XTypes 1.3 §7.2.3): not at all, at its end, or anywhere."""

    FINAL = "final"
    APPENDABLE = "appendable"
    MUTABLE = "mutable"


@dataclass(frozen=True, slots=True)
class Primitive:
    """A type of one fixed-size item.  ``code`` is its letter in :mod:`struct`, ``size`` its octets on the wire."""

    name: str
    code: str
    size: int
    zero: Any

    @property
    def is_number(self) -> bool:
        """True for what numeric buffers may hold: integers and floats, but neither booleans nor characters."""
        return self.name not in ("boolean", "char", "wchar")

    @property
    def is_octet(self) -> bool:
        """True for ``octet`` and ``uint8``: a sequence or array of it is ``bytes`` in Python."""
        return self.code == "B" and self.is_number

    def __str__(self) -> str:
        return self.name


BOOLEAN = Primitive("boolean", "B", 1, False)
OCTET = Primitive("octet", "B", 1, 0)
CHAR = Primitive("char", "B", 1, "\0")
WCHAR = Primitive("wchar", "H", 2, "\0")
INT8 = Primitive("int8", "b", 1, 0)
INT16 = Primitive("int16", "h", 2, 0)
INT32 = Primitive("int32", "i", 4, 0)
INT64 = Primitive("int64", "q", 8, 0)
UINT8 = Primitive("uint8", "B", 1, 0)
UINT16 = Primitive("uint16", "H", 2, 0)
UINT32 = Primitive("uint32", "I", 4, 0)
UINT64 = Primitive("uint64", "Q", 8, 0)
FLOAT32 = Primitive("float32", "f", 4, 0.0)
FLOAT64 = Primitive("float64", "d", 8, 0.0)


@dataclass(frozen=True, slots=True)
class String:
    """``string`` or ``string<bound>``: UTF-8; the bound counts octets without the terminating NUL."""

    bound: int | None = None

    def __str__(self) -> str:
        return "string" if self.bound is None else f"string<{self.bound}>"


@dataclass(frozen=True, slots=True)
class EnumType:
    """An IDL enum; ``python_class`` is the ``IntEnum``.  Signed; 1, 2 or 4 octets by ``bit_bound``."""

    python_class: type[enum.IntEnum]
    type_name: str
    bit_bound: int
    default: enum.IntEnum

    @property
    def size(self) -> int:
        return 1 if self.bit_bound <= 8 else 2 if self.bit_bound <= 16 else 4

    @property
    def code(self) -> str:
        return {1: "b", 2: "h", 4: "i"}[self.size]

    def __str__(self) -> str:
        return self.type_name


@dataclass(frozen=True, slots=True)
class BitmaskType:
    """An IDL bitmask; ``python_class`` is the ``IntFlag``.  Unsigned; 1, 2, 4 or 8 octets by ``bit_bound``."""

    python_class: type[enum.IntFlag]
    type_name: str
    bit_bound: int

    @property
    def size(self) -> int:
        return 1 if self.bit_bound <= 8 else 2 if self.bit_bound <= 16 else 4 if self.bit_bound <= 32 else 8

    @property
    def code(self) -> str:
        return {1: "B", 2: "H", 4: "I", 8: "Q"}[self.size]

    def __str__(self) -> str:
        return self.type_name


@dataclass(frozen=True, slots=True)
class SequenceType:
    """``sequence<element>`` or ``sequence<element, bound>``; ``numpy`` when the values come back as numpy arrays."""

    element: IdlType
    bound: int | None = None
    numpy: bool = False

    def __str__(self) -> str:
        return f"sequence<{self.element}>" if self.bound is None else f"sequence<{self.element}, {self.bound}>"


@dataclass(frozen=True, slots=True)
class ArrayType:
    """``element[d1][d2]...``, row-major; ``numpy`` when the values come back as numpy arrays."""

    element: IdlType
    dimensions: tuple[int, ...]
    numpy: bool = False

    @property
    def count(self) -> int:
        """How many elements in all dimensions together."""
        count = 1
        for dimension in self.dimensions:
            count *= dimension
        return count

    def __str__(self) -> str:
        return str(self.element) + "".join(f"[{dimension}]" for dimension in self.dimensions)


@dataclass(frozen=True, slots=True)
class Member:
    """A member of a struct.  ``default`` makes the value that it has when a sample leaves it out."""

    name: str
    id: int
    type: IdlType
    is_key: bool = False
    is_optional: bool = False
    must_understand: bool = False
    default: Callable[[], Any] | None = None


class StructType:
    """A struct: the identity of a topic type, of a nested type, or of a projection of one (see ``keys.py``).

    ``members`` holds the base's members first.  ``omitted`` is empty but for projections: the members of the
    Python class which this type does not have on the wire.
    """

    __slots__ = (
        "_members",
        "_resolve",
        "base",
        "extensibility",
        "omitted",
        "python_class",
        "static_sizes",
        "type_name",
        "zero_cost",
    )

    MAX_DEPTH: ClassVar[int] = 64
    """How deep values of a recursive type may nest, written or read."""

    def __init__(
        self,
        python_class: type[Any],
        type_name: str,
        extensibility: Extensibility,
        resolve: Callable[[], tuple[Member, ...]],
        *,
        base: StructType | None = None,
        omitted: tuple[Member, ...] = (),
    ) -> None:
        self.python_class = python_class
        self.type_name = type_name
        self.extensibility = extensibility
        self.base = base
        self.omitted = omitted
        self._resolve = resolve
        self._members: tuple[Member, ...] | None = None
        self.zero_cost: int | None = None  # what ``defaults.zero_cost`` found
        self.static_sizes: dict[Any, int | None] = {}  # what ``layout.static_size`` found

    @property
    def members(self) -> tuple[Member, ...]:
        """All members in declaration order; ``NameError`` while an annotation names what is not yet defined."""
        if self._members is None:
            self._members = self._resolve()
        return self._members

    def __str__(self) -> str:
        return self.type_name

    def __repr__(self) -> str:
        return f"<StructType {self.type_name} {self.extensibility.value}>"


IdlType = Primitive | String | EnumType | BitmaskType | SequenceType | ArrayType | StructType
"""Any type that a member may have."""


def nested_structs(type_: IdlType) -> Iterator[StructType]:
    """The struct that a type is, or that its elements are; nothing for the others."""
    while isinstance(type_, (SequenceType, ArrayType)):
        type_ = type_.element
    if isinstance(type_, StructType):
        yield type_


def reachable_structs(struct: StructType) -> Iterator[StructType]:
    """``struct`` and every struct inside it, each once, outermost first."""
    seen: set[int] = set()
    pending = [struct]
    while pending:
        candidate = pending.pop(0)
        if id(candidate) not in seen:
            seen.add(id(candidate))
            yield candidate
            pending += [nested for member in candidate.members for nested in nested_structs(member.type)]
