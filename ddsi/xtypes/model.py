"""The type model: what an IDL type is, free of how Python spells it and of how CDR encodes it.

DDS-XTypes 1.3 §7.2.2 (the type system).  A topic type is a :class:`StructType` whose members have types built
from primitives, strings, enums, bitmasks, bitsets, sequences, arrays, maps, unions and other structs.  Nodes are
values, except structs and unions, which are identities: their members are found when they are first asked for, so
that types may name themselves and each other.  Aliases are transparent: only a member remembers by which it was said.
"""

from __future__ import annotations

import enum
from collections.abc import Callable, Iterator, Mapping
from typing import Any, ClassVar

from ..structure.dataclass import dataclass
from ..structure.qos_policies import DataRepresentationId

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
    "Bitfield",
    "BitmaskType",
    "BitsetType",
    "Case",
    "Composite",
    "EnumType",
    "Extensibility",
    "IdlType",
    "Limits",
    "MapType",
    "Member",
    "Primitive",
    "SequenceType",
    "String",
    "StructType",
    "TryConstruct",
    "Typedefs",
    "UnionType",
    "nested_structs",
    "reachable_structs",
]


class Extensibility(enum.Enum):
    """How a type may grow (DDS-XTypes 1.3 §7.2.3): not at all, at its end, or anywhere."""

    FINAL = "final"
    APPENDABLE = "appendable"
    MUTABLE = "mutable"


class TryConstruct(enum.Enum):
    """What becomes of a received value that its member cannot hold (DDS-XTypes 1.3 §7.2.4.3): a string, sequence or map
    that exceeds the bound, a number that is no literal of the enum."""

    DISCARD = "discard"
    """What holds the value is discarded with it, in the end the sample."""
    USE_DEFAULT = "use_default"
    """The member has its default."""
    TRIM = "trim"
    """The first of it, as much as the bound allows; what has no bound is discarded."""


@dataclass(frozen=True, slots=True)
class Limits:
    """The lowest and the highest number that a member may be; None where there is none (IDL ``@range``)."""

    minimum: float | None = None
    maximum: float | None = None

    def allow(self, number: Any) -> bool:
        """False for NaN, too."""
        return (self.minimum is None or number >= self.minimum) and (self.maximum is None or number <= self.maximum)

    def __str__(self) -> str:
        if self.maximum is None:
            return f"{self.minimum} or more"
        return f"{self.maximum} at most" if self.minimum is None else f"{self.minimum} to {self.maximum}"


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
    """``string`` or ``string<bound>``: UTF-8; the bound counts octets without the terminating NUL.

    ``wide``: ``wstring``, in UTF-16 without NUL; the bound counts its units of two octets.
    """

    bound: int | None = None
    wide: bool = False

    def __str__(self) -> str:
        name = "wstring" if self.wide else "string"
        return name if self.bound is None else f"{name}<{self.bound}>"


@dataclass(frozen=True, slots=True)
class EnumType:
    """An IDL enum; ``python_class`` is the ``IntEnum``.  Signed; 1, 2 or 4 octets by ``bit_bound``."""

    python_class: type[enum.IntEnum]
    type_name: str
    bit_bound: int
    default: enum.IntEnum
    extensibility: Extensibility = Extensibility.FINAL
    """Whether literals may be added; the encoding is the same.  Final where nothing is said, as in Cyclone DDS."""

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
    extensibility: Extensibility = Extensibility.FINAL

    @property
    def size(self) -> int:
        return 1 if self.bit_bound <= 8 else 2 if self.bit_bound <= 16 else 4 if self.bit_bound <= 32 else 8

    @property
    def code(self) -> str:
        return {1: "B", 2: "H", 4: "I", 8: "Q"}[self.size]

    def __str__(self) -> str:
        return self.type_name


@dataclass(frozen=True, slots=True)
class Bitfield:
    """Some bits of a bitset: ``width`` of them from ``position`` (0 is the lowest) up."""

    name: str
    position: int
    width: int
    type: Primitive
    """What the value is to IDL: a boolean, or an integer, whose sign decides how the bits are read."""


@dataclass(frozen=True, slots=True)
class BitsetType:
    """An IDL bitset: bit fields in one unsigned integer of 1, 2, 4 or 8 octets, the smallest that holds all."""

    python_class: type[Any]
    type_name: str
    fields: tuple[Bitfield, ...]
    base: BitsetType | None = None

    @property
    def bits(self) -> int:
        """How many bits there are, up to the highest that a field has."""
        return max(field.position + field.width for field in self.fields)

    @property
    def size(self) -> int:
        return next(size for size in (1, 2, 4, 8) if self.bits <= 8 * size)

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

    def place(self, index: int) -> str:
        """How a path names an element."""
        return f"[{index}]"

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

    def place(self, index: int) -> str:
        """How a path names the element at an index that counts through all rows: ``[1][2]``."""
        place = ""
        for dimension in reversed(self.dimensions):
            index, column = divmod(index, dimension)
            place = f"[{column}]{place}"
        return place

    def __str__(self) -> str:
        return str(self.element) + "".join(f"[{dimension}]" for dimension in self.dimensions)


@dataclass(frozen=True, slots=True)
class MapType:
    """``map<key, value>`` or ``map<key, value, bound>``: a dict in Python."""

    key: IdlType
    value: IdlType
    bound: int | None = None

    def __str__(self) -> str:
        bound = "" if self.bound is None else f", {self.bound}"
        return f"map<{self.key}, {self.value}{bound}>"


@dataclass(frozen=True, slots=True)
class Typedefs:
    """The aliases by which a member's type was said; a TypeObject tells of them, nothing else does.

    ``names`` are those of the type itself, innermost first; ``parts`` those of its element, or its key and value.
    ``rows``: how many dimensions an array had before those of its element, an aliased array, were joined to it.
    """

    names: tuple[str, ...] = ()
    parts: tuple[Typedefs | None, ...] = ()
    rows: int = 0


@dataclass(frozen=True, slots=True)
class Member:
    """A member of a struct or union.  ``default`` makes the value that it has when a sample leaves it out.

    ``name`` is that of the Python attribute; ``idl_name``, empty where both are the same, that of the IDL member.
    """

    name: str
    id: int
    type: IdlType
    is_key: bool = False
    is_optional: bool = False
    must_understand: bool = False
    default: Callable[[], Any] | None = None
    idl_name: str = ""
    is_external: bool = False
    is_serialized: bool = True
    typedefs: Typedefs | None = None
    hash_name: str | None = None
    """What ``@hashid`` was given; empty where it stood alone, None where it was not there."""
    try_construct: TryConstruct = TryConstruct.DISCARD
    limits: Limits | None = None
    unit: str | None = None

    @property
    def name_in_idl(self) -> str:
        """The member's name as other programs know it."""
        return self.idl_name or self.name


@dataclass(frozen=True, slots=True)
class Case(Member):
    """A member of a union: there when the discriminator is one of ``labels``, or none of any case (``is_default``)."""

    labels: tuple[Any, ...] = ()
    is_default: bool = False


class StructType:
    """A struct: the identity of a topic type, of a nested type, or of a projection of one (see ``keys.py``).

    ``representations``: those that topics of this type may use, the preferred one first; empty where it does not say.

    ``members`` holds the base's members first.  ``omitted`` are the members of the Python class which this type does
    not have on the wire: those not serialized, and in projections those left out.
    """

    __slots__ = (
        "_declared",
        "_members",
        "_resolve",
        "base",
        "extensibility",
        "has_hashed_ids",
        "is_nested",
        "omitted",
        "python_class",
        "representations",
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
        is_nested: bool = False,
        has_hashed_ids: bool = False,
        representations: tuple[DataRepresentationId, ...] = (),
    ) -> None:
        self.python_class = python_class
        self.type_name = type_name
        self.extensibility = extensibility
        self.is_nested = is_nested
        self.has_hashed_ids = has_hashed_ids
        self.representations = representations
        self.base = base
        self.omitted = omitted
        self._resolve = resolve
        self._members: tuple[Member, ...] | None = None
        self._declared: tuple[Member, ...] | None = None
        self.zero_cost: int | None = None  # what ``defaults.zero_cost`` found
        self.static_sizes: dict[Any, int | None] = {}  # what ``layout.static_size`` found

    @property
    def members(self) -> tuple[Member, ...]:
        """All members in declaration order; ``NameError`` while an annotation names what is not yet defined."""
        if self._members is None:
            found = self._resolve()
            self._members = tuple(member for member in found if member.is_serialized)
            if len(self._members) < len(found):
                self.omitted += tuple(member for member in found if not member.is_serialized)
                self._declared = found
        return self._members

    @property
    def declared(self) -> tuple[Member, ...]:
        """All members that the Python class has, base first, those included that do not travel."""
        if self._declared is None:
            members = self.members
            self._declared = self._declared or (*members, *self.omitted)
        return self._declared

    def __str__(self) -> str:
        return self.type_name

    def __repr__(self) -> str:
        return f"<StructType {self.type_name} {self.extensibility.value}>"


class UnionType:
    """A union: a discriminator and at most one member, which the discriminator selects (DDS-XTypes 1.3 §7.2.2.4.4.5).

    In Python its object holds ``_idl_discriminator`` and ``_idl_value`` (see ``unions.py``).
    """

    __slots__ = (
        "_chosen",
        "_found",
        "_resolve",
        "_selection",
        "extensibility",
        "has_hashed_ids",
        "is_nested",
        "python_class",
        "type_name",
    )

    def __init__(
        self,
        python_class: type[Any],
        type_name: str,
        extensibility: Extensibility,
        resolve: Callable[[], tuple[Member, tuple[Case, ...]]],
        *,
        is_nested: bool = False,
        has_hashed_ids: bool = False,
    ) -> None:
        self.python_class = python_class
        self.type_name = type_name
        self.extensibility = extensibility
        self.is_nested = is_nested
        self.has_hashed_ids = has_hashed_ids
        self._resolve = resolve
        self._found: tuple[Member, tuple[Case, ...]] | None = None
        self._selection: dict[Any, int] | None = None
        self._chosen: tuple[dict[Any, Case], Case | None] | None = None

    @property
    def discriminator(self) -> Member:
        return self._resolved()[0]

    @property
    def cases(self) -> tuple[Case, ...]:
        return self._resolved()[1]

    @property
    def members(self) -> tuple[Member, ...]:
        """The discriminator and all cases."""
        return (self.discriminator, *self.cases)

    @property
    def selection(self) -> Mapping[Any, int]:
        """The index in ``cases`` that each label selects."""
        if self._selection is None:
            self._selection = {label: index for index, case in enumerate(self.cases) for label in case.labels}
        return self._selection

    @property
    def default_index(self) -> int:
        """The index in ``cases`` for a discriminator that is no label; -1 if then there is no member."""
        return next((index for index, case in enumerate(self.cases) if case.is_default), -1)

    def case_of(self, discriminator: Any) -> Case | None:
        """The member that a discriminator selects."""
        if self._chosen is None:
            default = self.cases[self.default_index] if self.default_index >= 0 else None
            self._chosen = {label: self.cases[index] for label, index in self.selection.items()}, default
        cases, default = self._chosen
        return cases.get(discriminator, default)

    def _resolved(self) -> tuple[Member, tuple[Case, ...]]:
        if self._found is None:
            self._found = self._resolve()
        return self._found

    def __str__(self) -> str:
        return self.type_name

    def __repr__(self) -> str:
        return f"<UnionType {self.type_name} {self.extensibility.value}>"


Composite = StructType | UnionType

IdlType = (
    Primitive
    | String
    | EnumType
    | BitmaskType
    | BitsetType
    | SequenceType
    | ArrayType
    | MapType
    | StructType
    | UnionType
)
"""Any type that a member may have."""


def nested_structs(type_: IdlType) -> Iterator[Composite]:
    """The struct or union that a type is, or that its elements are; nothing for the others."""
    while isinstance(type_, (SequenceType, ArrayType)):
        type_ = type_.element
    if isinstance(type_, MapType):
        yield from nested_structs(type_.key)
        yield from nested_structs(type_.value)
    elif isinstance(type_, (StructType, UnionType)):
        yield type_


def reachable_structs(struct: Composite) -> Iterator[Composite]:
    """``struct`` and every struct or union inside it, each once, outermost first."""
    seen: set[int] = set()
    pending: list[Composite] = [struct]
    while pending:
        candidate = pending.pop(0)
        if id(candidate) not in seen:
            seen.add(id(candidate))
            yield candidate
            pending += [nested for member in candidate.members for nested in nested_structs(member.type)]
