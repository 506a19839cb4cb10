"""The syntax tree: what a file says, before names are looked up (OMG IDL 4.2 §7.4).

Nodes carry the place of their first token, and the comment before them.  Nothing here has a meaning yet.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from .source_text import Place

__all__ = [
    "Annotation",
    "BasicSpec",
    "Binary",
    "BitfieldNode",
    "BitmaskNode",
    "BitsetNode",
    "CaseNode",
    "ConstNode",
    "Declarator",
    "Definition",
    "EnumNode",
    "EnumeratorNode",
    "Expression",
    "ForwardNode",
    "KeylistNode",
    "Literal",
    "MapSpec",
    "MemberNode",
    "ModuleNode",
    "Name",
    "NameSpec",
    "SequenceSpec",
    "SkippedNode",
    "StringSpec",
    "StructNode",
    "TypeSpec",
    "TypedefNode",
    "Unary",
    "UnionNode",
]


@dataclass(frozen=True, slots=True)
class Name:
    """A scoped name; ``is_absolute`` where it begins with ``::``."""

    parts: tuple[str, ...]
    is_absolute: bool
    place: Place

    def __str__(self) -> str:
        return ("::" if self.is_absolute else "") + "::".join(self.parts)


# --- expressions -------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Literal:
    """A number, boolean, character or string; a wide one is ``str`` too."""

    value: int | float | bool | str
    place: Place
    is_character: bool = False


@dataclass(frozen=True, slots=True)
class Unary:
    sign: str
    operand: Expression
    place: Place


@dataclass(frozen=True, slots=True)
class Binary:
    sign: str
    left: Expression
    right: Expression
    place: Place
    """That of the operator."""


Expression = Literal | Name | Unary | Binary


# --- annotations -------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Annotation:
    """``@name``, ``@name(value)`` or ``@name(parameter=value, ...)``; a lone value has the parameter ``value``."""

    name: str
    arguments: dict[str, Expression]
    place: Place


# --- types ---------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class BasicSpec:
    """``long``, ``uint8``, ``wchar``: the name as in the type model (int32, uint8, wchar)."""

    name: str
    place: Place


@dataclass(frozen=True, slots=True)
class StringSpec:
    is_wide: bool
    bound: Expression | None
    place: Place


@dataclass(frozen=True, slots=True)
class SequenceSpec:
    element: TypeSpec
    bound: Expression | None
    place: Place


@dataclass(frozen=True, slots=True)
class MapSpec:
    key: TypeSpec
    value: TypeSpec
    bound: Expression | None
    place: Place


@dataclass(frozen=True, slots=True)
class NameSpec:
    name: Name

    @property
    def place(self) -> Place:
        return self.name.place


TypeSpec = BasicSpec | StringSpec | SequenceSpec | MapSpec | NameSpec


@dataclass(frozen=True, slots=True)
class Declarator:
    """A name, and the dimensions if it is an array."""

    name: str
    place: Place
    dimensions: tuple[Expression, ...] = ()


# --- definitions ---------------------------------------------------------------------------------------------


@dataclass(slots=True, kw_only=True)
class Definition:
    """What all definitions have."""

    name: str
    place: Place
    comment: str = ""
    annotations: list[Annotation] = field(default_factory=list)


@dataclass(slots=True, kw_only=True)
class ModuleNode(Definition):
    definitions: list[Definition]


@dataclass(slots=True, kw_only=True)
class ConstNode(Definition):
    type: TypeSpec
    value: Expression


@dataclass(slots=True, kw_only=True)
class TypedefNode(Definition):
    type: TypeSpec
    dimensions: tuple[Expression, ...]


@dataclass(slots=True, kw_only=True)
class MemberNode:
    """One declarator of a member; ``@key long a, b;`` makes two."""

    type: TypeSpec
    declarator: Declarator
    annotations: list[Annotation]
    comment: str


@dataclass(slots=True, kw_only=True)
class StructNode(Definition):
    base: Name | None
    members: list[MemberNode]


@dataclass(slots=True, kw_only=True)
class CaseNode:
    labels: list[Expression]
    is_default: bool
    member: MemberNode


@dataclass(slots=True, kw_only=True)
class UnionNode(Definition):
    discriminator: TypeSpec
    discriminator_annotations: list[Annotation]
    cases: list[CaseNode]


@dataclass(slots=True, kw_only=True)
class EnumeratorNode:
    """A literal of an enum, or a flag of a bitmask."""

    name: str
    place: Place
    annotations: list[Annotation]
    comment: str
    value: Expression | None = None
    """``RED = 3``, which is no IDL 4.2 but common."""


@dataclass(slots=True, kw_only=True)
class EnumNode(Definition):
    literals: list[EnumeratorNode]


@dataclass(slots=True, kw_only=True)
class BitmaskNode(Definition):
    flags: list[EnumeratorNode]


@dataclass(slots=True, kw_only=True)
class BitfieldNode:
    """``bitfield<width, type> name``; without a name the bits are only passed over."""

    width: Expression
    type: TypeSpec | None
    name: str
    place: Place
    annotations: list[Annotation]
    comment: str


@dataclass(slots=True, kw_only=True)
class BitsetNode(Definition):
    base: Name | None
    fields: list[BitfieldNode]


@dataclass(slots=True, kw_only=True)
class ForwardNode(Definition):
    """``struct A;`` or ``union A;``."""

    kind: str


@dataclass(slots=True, kw_only=True)
class SkippedNode(Definition):
    """An interface or the like: no data type, so nothing is made of it."""

    kind: str


@dataclass(slots=True, kw_only=True)
class KeylistNode(Definition):
    """``#pragma keylist TYPE member...``: keys as they were said before ``@key``."""

    members: list[str]
