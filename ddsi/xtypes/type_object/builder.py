"""From the type model to TypeObjects and their identifiers (DDS-XTypes 1.3 §7.3.4.6-7.3.4.9).

A type's hash covers the identifiers of those it needs, so these come first.  Types that need each other (recursive
ones) have no first among them: they are a strongly connected component, hashed together under provisional identifiers.
The choices that the specification leaves open are Cyclone DDS's: every typedef has a TypeObject of its own, keys are
not marked as to be understood, a union's discriminator is.
"""

from __future__ import annotations

from collections.abc import Iterator

from ...structure.dataclass import dataclass
from ...structure.errors import BadParameter
from ..components import strongly_connected
from ..idl_compiler.python_identifiers import literal_name_in_idl
from ..model import (
    ArrayType,
    BitmaskType,
    BitsetType,
    Case,
    Composite,
    EnumType,
    Extensibility,
    IdlType,
    Limits,
    MapType,
    Member,
    Primitive,
    SequenceType,
    String,
    StructType,
    TryConstruct,
    Typedefs,
    UnionType,
)
from .encoding import encode_type_object, hash_of_objects, hashed
from .identifiers import (
    HASH_LENGTH,
    ArrayIdentifier,
    ComponentIdentifier,
    HashedIdentifier,
    MapIdentifier,
    PrimitiveIdentifier,
    SequenceIdentifier,
    StringIdentifier,
    TypeIdentifier,
)
from .kinds import COMPLETE, MINIMAL, MemberFlag, TypeFlag, TypeKind
from .objects import (
    AliasObject,
    BitfieldObject,
    BitflagObject,
    BitmaskObject,
    BitsetObject,
    CaseObject,
    EnumObject,
    LiteralObject,
    MemberObject,
    StructObject,
    TypeBody,
    TypeObject,
    UnionObject,
    named,
)

__all__ = ["BuiltTypes", "build"]


@dataclass(frozen=True, slots=True)
class Alias:
    """A typedef: the name of a type, which may be said by further typedefs itself."""

    type_name: str
    type: IdlType
    typedefs: Typedefs | None


NamedType = StructType | UnionType | EnumType | BitmaskType | BitsetType | Alias
"""What has a TypeObject."""


@dataclass(frozen=True, slots=True)
class BuiltTypes:
    """All TypeObjects of one kind that a type needs, by identifier: its own first, then each that is met from there."""

    root: HashedIdentifier
    objects: dict[HashedIdentifier, TypeObject]
    octets: dict[HashedIdentifier, bytes]


def build(composite: Composite, *, is_complete: bool) -> BuiltTypes:
    """The TypeObjects of a struct or union and of all that it needs.

    BadParameter where an annotation names what is not defined.
    """
    try:
        return _Builder(is_complete).build(composite)
    except NameError as error:
        raise BadParameter(f"{composite.type_name}: an annotation cannot be resolved: {error}") from error


class _Builder:
    def __init__(self, is_complete: bool) -> None:
        self._is_complete = is_complete
        self._kind = COMPLETE if is_complete else MINIMAL
        self._identifiers: dict[NamedType, HashedIdentifier] = {}
        self._objects: dict[NamedType, TypeObject] = {}
        self._octets: dict[NamedType, bytes] = {}

    def build(self, root: Composite) -> BuiltTypes:
        top: NamedType = root
        order, components = strongly_connected(top, _needed)
        for component in components:
            if len(component) > 1 or component[0] in _needed(component[0]):
                self._add_component(sorted(component, key=lambda type_: type_.type_name))
            else:
                self._add(component[0])
        return BuiltTypes(
            self._identifiers[root],
            {self._identifiers[type_]: self._objects[type_] for type_ in order},
            {self._identifiers[type_]: self._octets[type_] for type_ in order},
        )

    def _add(self, type_: NamedType) -> None:
        self._objects[type_] = self._object(type_)
        self._identifiers[type_], self._octets[type_] = hashed(self._objects[type_])

    def _add_component(self, component: list[NamedType]) -> None:
        """Types that need each other, in the order of their names."""
        digest = bytes(HASH_LENGTH)
        for _ in range(2):  # first with provisional identifiers, to find the hash; then with that
            for index, type_ in enumerate(component, 1):
                self._identifiers[type_] = ComponentIdentifier(self._kind, digest, len(component), index)
            objects = [self._object(type_) for type_ in component]
            digest = hash_of_objects(objects)
        for type_, type_object in zip(component, objects, strict=True):
            self._objects[type_], self._octets[type_] = type_object, encode_type_object(type_object)

    # --- identifiers -------------------------------------------------------------------------------------

    def _identifier(self, type_: IdlType, typedefs: Typedefs | None) -> TypeIdentifier:
        if typedefs is not None and typedefs.names:
            return self._identifiers[_alias(type_, typedefs)]
        match type_:
            case Primitive(name=name):
                return PrimitiveIdentifier(_PRIMITIVES[name])
            case String(bound=bound, wide=wide):
                return StringIdentifier(bound or 0, wide)
            case SequenceType(element=element, bound=bound):
                return SequenceIdentifier(self._identifier(element, _part(typedefs, 0)), bound or 0)
            case MapType(key=key, value=value, bound=bound):
                parts = self._identifier(key, _part(typedefs, 0)), self._identifier(value, _part(typedefs, 1))
                return MapIdentifier(*parts, bound or 0)
            case ArrayType():
                element, dimensions = _rows(type_, typedefs)
                return ArrayIdentifier(self._identifier(element, _part(typedefs, 0)), dimensions)
            case _:
                return self._identifiers[type_]

    # --- objects -----------------------------------------------------------------------------------------

    def _object(self, type_: NamedType) -> TypeObject:
        return TypeObject(self._is_complete, self._body(type_))

    def _body(self, type_: NamedType) -> TypeBody:
        name = type_.type_name
        match type_:
            case StructType(base=base):
                inherited = None if base is None else self._identifiers[base]
                return StructObject(_type_flags(type_), inherited, tuple(map(self._member, _own_members(type_))), name)
            case UnionType(discriminator=switch):
                flags = _member_flags(switch) | MemberFlag.MUST_UNDERSTAND
                discriminator = self._identifier(switch.type, switch.typedefs)
                return UnionObject(_type_flags(type_), flags, discriminator, tuple(map(self._case, type_.cases)), name)
            case Alias():
                return AliasObject(self._identifier(type_.type, type_.typedefs), name)
            case EnumType():
                return _enum(type_)
            case BitmaskType():
                bits = {flag.value.bit_length() - 1: literal_name_in_idl(str(flag.name)) for flag in type_.python_class}
                bitflags = tuple(BitflagObject(position, named(bits[position])) for position in sorted(bits))
                return BitmaskObject(_EXTENSIBILITIES[type_.extensibility], type_.bit_bound, bitflags, name)
            case BitsetType():
                return BitsetObject(
                    tuple(
                        BitfieldObject(field.position, field.width, _PRIMITIVES[field.type.name], named(field.name))
                        for field in type_.fields
                    ),
                    name,
                )

    def _member(self, member: Member) -> MemberObject:
        type_ = self._identifier(member.type, member.typedefs)
        return MemberObject(member.id, _member_flags(member), type_, named(member.name_in_idl), *_annotations(member))

    def _case(self, case: Case) -> CaseObject:
        type_ = self._identifier(case.type, case.typedefs)
        flags = _member_flags(case) | (MemberFlag.DEFAULT if case.is_default else MemberFlag(0))
        labels = tuple(_int32(ord(label) if isinstance(label, str) else int(label)) for label in case.labels)
        return CaseObject(case.id, flags, type_, labels, named(case.name_in_idl), *_annotations(case))


# --- what a type needs ---------------------------------------------------------------------------------------


def _needed(type_: NamedType) -> list[NamedType]:
    """The types that a TypeObject names directly, in order."""
    match type_:
        case StructType(base=base):
            bases: list[NamedType] = [] if base is None else [base]
            return bases + [found for member in _own_members(type_) for found in _named(member.type, member.typedefs)]
        case UnionType():
            return [found for member in type_.members for found in _named(member.type, member.typedefs)]
        case Alias():
            return list(_named(type_.type, type_.typedefs))
        case _:
            return []


def _named(type_: IdlType, typedefs: Typedefs | None) -> Iterator[NamedType]:
    """What a type as a member says it names: an alias, or the type itself, or that of its elements."""
    if typedefs is not None and typedefs.names:
        yield _alias(type_, typedefs)
        return
    match type_:
        case SequenceType(element=element):
            yield from _named(element, _part(typedefs, 0))
        case ArrayType():
            yield from _named(_rows(type_, typedefs)[0], _part(typedefs, 0))
        case MapType(key=key, value=value):
            yield from _named(key, _part(typedefs, 0))
            yield from _named(value, _part(typedefs, 1))
        case StructType() | UnionType() | EnumType() | BitmaskType() | BitsetType():
            yield type_
        case _:
            pass


def _alias(type_: IdlType, typedefs: Typedefs) -> Alias:
    """The outermost of the typedefs."""
    inner = Typedefs(typedefs.names[:-1], typedefs.parts, typedefs.rows)
    return Alias(typedefs.names[-1], type_, None if inner == Typedefs() else inner)


def _part(typedefs: Typedefs | None, index: int) -> Typedefs | None:
    return typedefs.parts[index] if typedefs is not None and typedefs.parts else None


def _rows(array: ArrayType, typedefs: Typedefs | None) -> tuple[IdlType, tuple[int, ...]]:
    """The element, and the dimensions before it.  An array of an aliased array is two arrays."""
    if typedefs is None or not typedefs.rows:
        return array.element, array.dimensions
    return ArrayType(array.element, array.dimensions[typedefs.rows :]), array.dimensions[: typedefs.rows]


def _own_members(struct: StructType) -> tuple[Member, ...]:
    return struct.members[len(struct.base.members) if struct.base is not None else 0 :]


# --- details -------------------------------------------------------------------------------------------------

_PRIMITIVES = {
    "boolean": TypeKind.BOOLEAN,
    "octet": TypeKind.BYTE,
    "char": TypeKind.CHAR8,
    "wchar": TypeKind.CHAR16,
    "int8": TypeKind.INT8,
    "int16": TypeKind.INT16,
    "int32": TypeKind.INT32,
    "int64": TypeKind.INT64,
    "uint8": TypeKind.UINT8,
    "uint16": TypeKind.UINT16,
    "uint32": TypeKind.UINT32,
    "uint64": TypeKind.UINT64,
    "float32": TypeKind.FLOAT32,
    "float64": TypeKind.FLOAT64,
}

_EXTENSIBILITIES = {
    Extensibility.FINAL: TypeFlag.FINAL,
    Extensibility.APPENDABLE: TypeFlag.APPENDABLE,
    Extensibility.MUTABLE: TypeFlag.MUTABLE,
}


def _type_flags(composite: Composite) -> TypeFlag:
    """Extensibility, nested and hashed ids; Cyclone DDS and others keep the latter two in minimal TypeObjects too."""
    flags = _EXTENSIBILITIES[composite.extensibility]
    if composite.is_nested:
        flags |= TypeFlag.NESTED
    if composite.has_hashed_ids:
        flags |= TypeFlag.AUTOID_HASH
    return flags


_TRY_CONSTRUCT = {
    TryConstruct.DISCARD: MemberFlag.TRY_CONSTRUCT_1,
    TryConstruct.USE_DEFAULT: MemberFlag.TRY_CONSTRUCT_2,
    TryConstruct.TRIM: MemberFlag.TRY_CONSTRUCT_1 | MemberFlag.TRY_CONSTRUCT_2,
}


def _annotations(member: Member) -> tuple[str | None, str | None, Limits | None]:
    return member.hash_name, member.unit, member.limits


def _member_flags(member: Member) -> MemberFlag:
    flags = _TRY_CONSTRUCT[member.try_construct]
    for is_set, flag in (
        (member.is_external, MemberFlag.EXTERNAL),
        (member.is_optional, MemberFlag.OPTIONAL),
        (member.must_understand, MemberFlag.MUST_UNDERSTAND),
        (member.is_key, MemberFlag.KEY),
    ):
        if is_set:
            flags |= flag
    return flags


def _int32(label: int) -> int:
    """A label as a TypeObject has it, which knows none of more than 32 bits and none without a sign."""
    return (label + (1 << 31)) % (1 << 32) - (1 << 31)


def _enum(enum: EnumType) -> EnumObject:
    literals = tuple(
        LiteralObject(
            literal.value,
            MemberFlag.DEFAULT if literal is enum.default else MemberFlag(0),
            named(literal_name_in_idl(literal.name)),
        )
        for literal in sorted(enum.python_class)
    )
    return EnumObject(_EXTENSIBILITIES[enum.extensibility], enum.bit_bound, literals, enum.type_name)
