"""What IDL text declares, once names are looked up and constants computed: the compiler's own form of types.

Between the syntax tree and Python source.  Other than in ``model.py``, typedefs and constants are there, and each
declaration knows where it stands in the text.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from ...structure.qos_policies import DataRepresentationId
from ..model import Extensibility, Limits, Primitive, String, TryConstruct
from .source_text import IdlWarning, Place

__all__ = [
    "Alias",
    "ArrayOf",
    "Bitflag",
    "BitmaskDeclaration",
    "BitsetDeclaration",
    "BitsetField",
    "Compilation",
    "Constant",
    "ConstantValue",
    "Declaration",
    "EnumDeclaration",
    "Enumerator",
    "MapOf",
    "MemberDeclaration",
    "Module",
    "SequenceOf",
    "SkippedDeclaration",
    "StructDeclaration",
    "TypeReference",
    "UnionDeclaration",
    "collections_inside",
    "levels_of",
    "unaliased",
]


@dataclass(eq=False, slots=True)
class Declaration:
    """Anything with a name.  ``path`` ends with the name itself."""

    path: tuple[str, ...]
    place: Place
    comment: str = ""

    @property
    def name(self) -> str:
        return self.path[-1]

    @property
    def scoped_name(self) -> str:
        return "::".join(self.path)


@dataclass(eq=False, slots=True)
class Module(Declaration):
    """A module, or the file's own scope (with an empty path): all its openings together."""

    members: dict[str, Declaration] = field(default_factory=dict)
    parent: Module | None = None
    folded: dict[str, str] = field(default_factory=dict)
    """Names in small letters, since no two may differ in case only."""


@dataclass(eq=False, slots=True)
class Enumerator(Declaration):
    """A literal of an enum; its path is that of the scope around the enum, where IDL puts it."""

    value: int = 0
    enum: EnumDeclaration = field(kw_only=True)


@dataclass(frozen=True, slots=True)
class Bitflag:
    """A flag of a bitmask, as the label of a case."""

    name: str
    bitmask: BitmaskDeclaration


ConstantValue = int | float | bool | str | Enumerator | Bitflag


@dataclass(frozen=True, slots=True)
class SequenceOf:
    element: TypeReference
    bound: int | None = None


@dataclass(frozen=True, slots=True)
class ArrayOf:
    element: TypeReference
    dimensions: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class MapOf:
    key: TypeReference
    value: TypeReference
    bound: int | None = None


@dataclass(eq=False, slots=True)
class Constant(Declaration):
    type: TypeReference = field(kw_only=True)
    value: ConstantValue = field(kw_only=True)


@dataclass(eq=False, slots=True)
class Alias(Declaration):
    """A typedef."""

    type: TypeReference = field(kw_only=True)
    collections: int = 0
    """What :func:`collections_inside` finds; kept, so that a chain of typedefs is not walked again and again."""
    levels: int = 0
    """What :func:`levels_of` finds."""
    links: int = 1
    """How many typedefs there are from this one to the type behind them."""

    def __post_init__(self) -> None:
        self.links = 1 + (self.type.links if isinstance(self.type, Alias) else 0)
        self.collections = collections_inside(self.type)
        self.levels = levels_of(self.type)


@dataclass(eq=False, slots=True)
class EnumDeclaration(Declaration):
    literals: list[Enumerator] = field(default_factory=list)
    bit_bound: int = 32
    default: Enumerator | None = None
    extensibility: Extensibility = Extensibility.FINAL


@dataclass(eq=False, slots=True)
class BitmaskDeclaration(Declaration):
    """``flags`` maps names to positions."""

    flags: dict[str, int] = field(default_factory=dict)
    bit_bound: int = 32
    extensibility: Extensibility = Extensibility.FINAL


@dataclass(frozen=True, slots=True)
class BitsetField:
    name: str
    position: int
    width: int
    type: Primitive
    comment: str = ""


@dataclass(eq=False, slots=True)
class BitsetDeclaration(Declaration):
    fields: list[BitsetField] = field(default_factory=list)
    base: BitsetDeclaration | None = None

    @property
    def end(self) -> int:
        """The bit behind the last that is named or passed over."""
        return max((field.position + field.width for field in self.fields), default=self.base.end if self.base else 0)


@dataclass(eq=False, slots=True)
class MemberDeclaration:
    """A member of a struct or a union.  ``id`` is its final number; ``is_id_explicit``: the text gives it."""

    name: str
    type: TypeReference
    place: Place
    id: int
    comment: str = ""
    is_id_explicit: bool = False
    hash_name: str | None = None
    """The name whose hash is the id, by ``@hashid``; empty for the member's own."""
    is_key: bool = False
    is_optional: bool = False
    is_external: bool = False
    is_serialized: bool = True
    must_understand: bool = False
    try_construct: TryConstruct = TryConstruct.DISCARD
    limits: Limits | None = None
    unit: str | None = None
    default: ConstantValue | None = None
    labels: list[ConstantValue] = field(default_factory=list)
    is_default_case: bool = False


@dataclass(eq=False, slots=True)
class _Composite(Declaration):
    is_defined: bool = False
    """False between a forward declaration and the definition."""
    extensibility: Extensibility = Extensibility.APPENDABLE
    is_hashed: bool = False
    is_nested: bool = False
    representations: tuple[DataRepresentationId, ...] = ()
    members: list[MemberDeclaration] = field(default_factory=list)
    levels: int = 1
    """How deep structs and unions nest in it, itself included."""


@dataclass(eq=False, slots=True)
class StructDeclaration(_Composite):
    base: StructDeclaration | None = None

    def all_members(self) -> list[MemberDeclaration]:
        """Those of the bases first."""
        return [*(self.base.all_members() if self.base is not None else ()), *self.members]


@dataclass(eq=False, slots=True)
class UnionDeclaration(_Composite):
    discriminator: TypeReference | None = None
    is_discriminator_key: bool = False


@dataclass(eq=False, slots=True)
class SkippedDeclaration(Declaration):
    """An interface or the like, kept so that its use can be refused by name."""

    kind: str = ""


TypeReference = (
    Primitive
    | String
    | SequenceOf
    | ArrayOf
    | MapOf
    | Alias
    | EnumDeclaration
    | BitmaskDeclaration
    | BitsetDeclaration
    | StructDeclaration
    | UnionDeclaration
)


@dataclass(frozen=True, slots=True)
class Compilation:
    """The result for one file and all that it includes."""

    root: Module
    declarations: list[Declaration]
    """In the order of their definition: what a declaration needs comes before it, but for recursion."""
    warnings: list[IdlWarning]


def collections_inside(type_: TypeReference) -> int:
    """How deep sequences, arrays and maps nest, up to the structs that they hold."""
    match type_:
        case SequenceOf(element=element) | ArrayOf(element=element):
            return 1 + collections_inside(element)
        case MapOf(key=key, value=value):
            return 1 + max(collections_inside(key), collections_inside(value))
        case Alias(collections=collections):
            return collections
        case _:
            return 0


def levels_of(type_: TypeReference) -> int:
    """How deep structs and unions nest in a type.  What is not complete yet, so that it recurs, counts as one."""
    match type_:
        case SequenceOf(element=element) | ArrayOf(element=element):
            return levels_of(element)
        case MapOf(key=key, value=value):
            return max(levels_of(key), levels_of(value))
        case Alias(levels=levels) | StructDeclaration(levels=levels) | UnionDeclaration(levels=levels):
            return levels
        case _:
            return 0


def unaliased(type_: TypeReference) -> TypeReference:
    """What a chain of typedefs stands for."""
    while isinstance(type_, Alias):
        type_ = type_.type
    return type_
