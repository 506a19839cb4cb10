"""From TypeObjects to Python classes: those that ``@idl.struct`` and its siblings would make of the same type.

DDS-XTypes 1.3 §7.3.4 (TypeObjects) and §7.6.4 (types that are known at run time only).  Each type becomes an annotated
class and goes through the decorators, so that codecs, keys, checks, ``repr`` and equality are those of every other
type.  Types that need each other name those that are not there yet by a string, as one would in source.

A minimal TypeObject has no names: its types, members and literals are called after their hashes, ids and values.
"""

from __future__ import annotations

import enum
import math
from collections.abc import Callable, Mapping, Sequence
from typing import Annotated, Any

from ..structure.dataclass import dataclass
from ..structure.errors import BadParameter
from . import idl
from .annotations import Array, Bits, Bound, CaseLabels, HashId, MemberId, MemberName, TypedefName, Unit, autoid_hash
from .bitsets import define_bitset
from .definition import define_struct
from .dynamic_graph import TypeGraph, plain, shown_name
from .dynamic_names import class_name, literal_name, member_name
from .enumerations import describe_bitmask, describe_enum
from .model import Extensibility, Limits, StructType, TryConstruct, UnionType
from .resolution import named_type
from .topic_type import refuse_impossible
from .type_object.builder import BuiltTypes
from .type_object.identifiers import (
    ArrayIdentifier,
    ComponentIdentifier,
    HashedIdentifier,
    HashIdentifier,
    MapIdentifier,
    PrimitiveIdentifier,
    SequenceIdentifier,
    StringIdentifier,
    TypeIdentifier,
)
from .type_object.kinds import MemberFlag, TypeFlag, TypeKind
from .type_object.objects import (
    AliasObject,
    BitmaskObject,
    BitsetObject,
    CaseObject,
    EnumObject,
    MemberObject,
    StructObject,
    UnionObject,
)
from .unions import define_union

__all__ = ["make_class"]

MODULE = "ddsi_dynamic"
"""The ``__module__`` of the classes.  There is none of this name: they can be neither imported nor pickled."""

_INT_ENUM: Any = enum.IntEnum  # called with literals, these make classes, which no checker knows how to say
_INT_FLAG: Any = enum.IntFlag
_ANNOTATED: Any = Annotated  # markers in any number are not for checkers either

_PRIMITIVES: dict[int, Any] = {
    TypeKind.BOOLEAN: idl.boolean,
    TypeKind.BYTE: idl.octet,
    TypeKind.CHAR8: idl.char,
    TypeKind.CHAR16: idl.wchar,
    TypeKind.INT8: idl.int8,
    TypeKind.INT16: idl.int16,
    TypeKind.INT32: idl.int32,
    TypeKind.INT64: idl.int64,
    TypeKind.UINT8: idl.uint8,
    TypeKind.UINT16: idl.uint16,
    TypeKind.UINT32: idl.uint32,
    TypeKind.UINT64: idl.uint64,
    TypeKind.FLOAT32: idl.float32,
    TypeKind.FLOAT64: idl.float64,
}

_MARKS = (
    (MemberFlag.KEY, idl.key),
    (MemberFlag.OPTIONAL, idl.optional),
    (MemberFlag.MUST_UNDERSTAND, idl.must_understand),
    (MemberFlag.EXTERNAL, idl.external),
)

_BOTH = MemberFlag.TRY_CONSTRUCT_1 | MemberFlag.TRY_CONSTRUCT_2

_TRY_CONSTRUCT = {MemberFlag.TRY_CONSTRUCT_2: TryConstruct.USE_DEFAULT, _BOTH: TryConstruct.TRIM}

_NO_NUMBERS = (TypeKind.BOOLEAN, TypeKind.CHAR8, TypeKind.CHAR16)

_EXTENSIBILITIES = {
    TypeFlag.FINAL: Extensibility.FINAL,
    TypeFlag.APPENDABLE: Extensibility.APPENDABLE,
    TypeFlag.MUTABLE: Extensibility.MUTABLE,
    TypeFlag(0): Extensibility.APPENDABLE,  # nothing said: the default of IDL 4.2
}


def make_class(types: BuiltTypes, type_name: str | None) -> type[Any]:
    """The class of the type; ``type_name`` replaces the name that it has in its TypeObject.

    Raises BadParameter, naming type and member, for TypeObjects that are no type.
    """
    return _Classes(types, type_name).make()


@dataclass(frozen=True, slots=True)
class _Names:
    """Where the decorators look for the classes that annotations name."""

    f_locals: Mapping[str, Any]


class _Classes:
    def __init__(self, types: BuiltTypes, type_name: str | None) -> None:
        self._graph = TypeGraph(types)
        self._root = self._graph.unaliased(types.root)
        self._type_name = type_name
        self._classes: dict[HashedIdentifier, type[Any]] = {}
        self._keys: dict[HashedIdentifier, str] = {}
        self._names: dict[str, Any] = {}
        self._scope = _Names(self._names)
        self._bases: set[HashedIdentifier | None] = set()

    def make(self) -> type[Any]:
        graph = self._graph
        identifiers = [one for component in graph.components for one in component]
        self._bases = {graph.base_of(identifier) for identifier in identifiers}
        for number, identifier in enumerate(identifiers):
            self._keys[identifier] = f"__type_{number}"  # no class is called so
        for identifier in identifiers:
            self._define(identifier)
        for identifier, python_class in self._classes.items():
            self._complete(identifier, python_class)
        found = self._classes.get(self._root) if isinstance(self._root, HashedIdentifier) else None
        if found is None:
            raise BadParameter("what the identifier stands for is an alias or a collection, and no type of its own")
        return found

    def _define(self, identifier: HashedIdentifier) -> None:
        """Make the class, unless it is there already; that of its base before it."""
        if identifier in self._classes:
            return
        base = self._graph.base_of(identifier)
        if base is not None:
            self._define(base)
        python_class = self._blaming(identifier, lambda: self._class_of(identifier))
        if python_class is not None:
            self._classes[identifier] = self._names[self._keys[identifier]] = python_class

    def _complete(self, identifier: HashedIdentifier, python_class: type[Any]) -> None:
        """Let the decorators look at what was not there yet when the class was made."""
        type_ = named_type(python_class)
        if isinstance(type_, (StructType, UnionType)):
            composite = type_
            self._blaming(identifier, lambda: refuse_impossible(composite))

    def _blaming(self, identifier: HashedIdentifier, act: Callable[[], Any]) -> Any:
        """What ``act`` returns; what it refuses is told with the type's name."""
        try:
            return act()
        except ValueError as error:  # BadParameter, and what enum raises for names that it keeps
            name = shown_name(identifier, self._graph.body(identifier))
            raise BadParameter(f"the type {name} cannot be used: {error}") from error

    def _class_of(self, identifier: HashedIdentifier) -> type[Any] | None:
        match self._graph.body(identifier):
            case StructObject() as struct:
                return self._struct(identifier, struct)
            case UnionObject() as union:
                return self._union(identifier, union)
            case EnumObject() as enum_:
                return self._enum(identifier, enum_)
            case BitmaskObject() as bitmask:
                return self._bitmask(identifier, bitmask)
            case BitsetObject() as bitset:
                return self._bitset(identifier, bitset)
            case _:
                return None  # aliases and collections are said where they are used

    # --- structs and unions ------------------------------------------------------------------------------

    def _struct(self, identifier: HashedIdentifier, struct: StructObject) -> type[Any]:
        base = self._graph.base_of(identifier)
        bases = () if base is None else (self._classes[base],)
        inherited = bases[0].__match_args__ if bases else ()  # names of the members
        taken = set[str](inherited)
        annotations: dict[str, Any] = {}
        for member in struct.members:
            name = member_name(member.name.text, f"member_{member.id}", taken)
            taken.add(name)
            annotations[name] = self._member(member, name)
        defaults: dict[str, None] = {}
        if identifier not in self._bases:  # in one with heirs, members without default would follow
            for name, member in zip(reversed(annotations), reversed(struct.members), strict=True):
                if MemberFlag.OPTIONAL not in member.flags:
                    break
                defaults[name] = None
        type_name = self._type_name_of(identifier, struct.type_name)
        return define_struct(
            self._bare_class(type_name, annotations, defaults, bases),
            type_name=type_name,
            extensibility=_extensibility(struct.flags),
            autoid=_autoid(struct.flags),
            is_nested=TypeFlag.NESTED in struct.flags,
            frame=self._scope,
        )

    def _union(self, identifier: HashedIdentifier, union: UnionObject) -> type[Any]:
        is_key = MemberFlag.KEY in union.discriminator_flags
        switch = self._said(union.discriminator)
        annotations: dict[str, Any] = {"discriminator": Annotated[switch, idl.key] if is_key else switch}
        labels: dict[str, Any] = {"discriminator": idl.switch}
        for case in union.cases:
            name = member_name(case.name.text, f"member_{case.id}", annotations)
            annotations[name] = self._member(case, name)
            labels[name] = CaseLabels(
                tuple(self._label(union.discriminator, label) for label in case.labels),
                is_default=MemberFlag.DEFAULT in case.flags,
            )
            if not case.labels and not labels[name].is_default:
                raise BadParameter(f"{name} has no label")
        type_name = self._type_name_of(identifier, union.type_name)
        return define_union(
            self._bare_class(type_name, annotations, labels, ()),
            type_name=type_name,
            extensibility=_extensibility(union.flags),
            autoid=_autoid(union.flags),
            is_nested=TypeFlag.NESTED in union.flags,
            frame=self._scope,
        )

    def _member(self, member: MemberObject | CaseObject, name: str) -> Any:
        """The annotation of a member.  It always says the id, so that a name that is changed does not change it."""
        markers: list[Any] = [mark for flag, mark in _MARKS if flag in member.flags]
        hash_name = member.hash_name
        is_hashed = hash_name is not None and autoid_hash(hash_name or member.name.text) == member.id
        markers.append(HashId(hash_name or "") if is_hashed else MemberId(member.id))
        markers.append(_TRY_CONSTRUCT.get(member.flags & _BOTH, TryConstruct.DISCARD))
        if member.unit is not None:
            markers.append(Unit(member.unit))
        if member.limits is not None and self._has_numbers(member.type):
            markers += _sensible(member.limits)
        if member.name.text not in ("", name):
            markers.append(MemberName(member.name.text))
        return _annotated(self._said(member.type), *markers)

    def _has_numbers(self, type_: TypeIdentifier) -> bool:
        """Whether limits mean something: of a number, or of the numbers in a sequence or array."""
        type_ = self._graph.unaliased(type_)
        if isinstance(type_, SequenceIdentifier):
            type_ = self._graph.unaliased(type_.element)
        else:
            while isinstance(type_, ArrayIdentifier):
                type_ = self._graph.unaliased(type_.element)
        return isinstance(type_, PrimitiveIdentifier) and type_.kind not in _NO_NUMBERS

    def _label(self, discriminator: TypeIdentifier, label: int) -> Any:
        """The value of the discriminator's type for a label, which a TypeObject has as an int32."""
        type_ = self._graph.unaliased(discriminator)
        match type_:
            case PrimitiveIdentifier(kind=TypeKind.BOOLEAN):
                if label not in (0, 1):
                    raise BadParameter(f"the label {label} is no boolean")
                return bool(label)
            case PrimitiveIdentifier(kind=TypeKind.CHAR8 | TypeKind.CHAR16):
                if not 0 <= label <= 0xFFFF:
                    raise BadParameter(f"the label {label} is no character")
                return chr(label)
            case PrimitiveIdentifier(kind=TypeKind.UINT32):
                return label & 0xFFFFFFFF
            case _:
                return label

    # --- enums, bitmasks, bitsets ------------------------------------------------------------------------

    def _enum(self, identifier: HashedIdentifier, described: EnumObject) -> type[Any] | None:
        """None for one without literals, which Dust DDS announces: it is said as the integer that it travels as."""
        if not described.literals:
            return None
        values: dict[str, int] = {}
        default = None
        for literal in described.literals:
            name = literal_name(literal.name.text, _of_number("VALUE", literal.value), values)
            if literal.value in values.values():
                raise BadParameter(f"two literals have the value {literal.value}")
            values[name] = literal.value
            if MemberFlag.DEFAULT in literal.flags and default is None:
                default = name
        type_name = self._type_name_of(identifier, described.type_name)
        python_class: type[enum.IntEnum] = _INT_ENUM(class_name(type_name, "Enum"), values, module=MODULE)
        describe_enum(
            python_class,
            type_name=type_name,
            bit_bound=described.bit_bound,
            default=default,
            extensibility=_enumerated_extensibility(described.flags),
        )
        return python_class

    def _bitmask(self, identifier: HashedIdentifier, described: BitmaskObject) -> type[Any] | None:
        """None for one without flags: it is said as the integer that it travels as."""
        if not described.bitflags:
            return None
        values: dict[str, int] = {}
        for flag in described.bitflags:
            if flag.position >= 64:
                raise BadParameter(f"a flag is at bit {flag.position}; a bitmask has 64")
            name = literal_name(flag.name.text, f"BIT_{flag.position}", values)
            if 1 << flag.position in values.values():
                raise BadParameter(f"two flags are at bit {flag.position}")
            values[name] = 1 << flag.position
        type_name = self._type_name_of(identifier, described.type_name)
        python_class: type[enum.IntFlag] = _INT_FLAG(class_name(type_name, "Bitmask"), values, module=MODULE)
        describe_bitmask(
            python_class,
            type_name=type_name,
            bit_bound=described.bit_bound,
            extensibility=_enumerated_extensibility(described.flags),
        )
        return python_class

    def _bitset(self, identifier: HashedIdentifier, described: BitsetObject) -> type[Any]:
        annotations: dict[str, Any] = {}
        for field in described.fields:
            if field.holder not in _PRIMITIVES:
                raise BadParameter(f"a bit field is of the kind {field.holder.name}")
            name = member_name(field.name.text, f"bits_{field.position}", annotations)
            annotations[name] = _annotated(_PRIMITIVES[field.holder], Bits(field.width, field.position))
        type_name = self._type_name_of(identifier, described.type_name)
        return define_bitset(self._bare_class(type_name, annotations, {}, ()), type_name=type_name, frame=self._scope)

    # --- types as members say them -----------------------------------------------------------------------

    def _said(self, type_: TypeIdentifier) -> Any:
        """The annotation of a type.  The graph has bounded how deep collections and aliases nest."""
        match type_:
            case PrimitiveIdentifier(kind=kind):
                return _PRIMITIVES[kind]
            case StringIdentifier(bound=bound, wide=wide):
                return _bounded(idl.wstring if wide else str, bound)
            case SequenceIdentifier(element=element, bound=bound):
                return _bounded(Sequence[self._said(element)], bound)  # type: ignore[misc]
            case MapIdentifier(key=key, element=element, bound=bound):
                return _bounded(dict[self._said(key), self._said(element)], bound)  # type: ignore[misc]
            case ArrayIdentifier(element=element, bounds=bounds):
                rows = self._said(element)
                for _ in bounds:
                    rows = Sequence[rows]  # type: ignore[valid-type]
                return _annotated(rows, Array(bounds))
            case HashIdentifier() | ComponentIdentifier():
                return self._said_by_name(type_)
            case _:
                raise BadParameter("a type of a kind that this release does not know")

    def _said_by_name(self, identifier: HashedIdentifier) -> Any:
        match self._graph.body(identifier):
            case AliasObject(related=related, type_name=name):
                said = self._said(related)
                return _annotated(said, TypedefName(name)) if name else said
            case EnumObject(literals=(), bit_bound=bit_bound):
                return idl.int8 if bit_bound <= 8 else idl.int16 if bit_bound <= 16 else idl.int32
            case BitmaskObject(bitflags=(), bit_bound=bit_bound):
                sizes = ((8, idl.uint8), (16, idl.uint16), (32, idl.uint32), (64, idl.uint64))
                return next((said for bits, said in sizes if bit_bound <= bits), idl.uint64)
            case body:
                collection = plain(identifier, body)
                if collection is not identifier:
                    return self._said(collection)
                return self._classes.get(identifier, self._keys[identifier])

    # --- names -------------------------------------------------------------------------------------------

    def _type_name_of(self, identifier: HashedIdentifier, name: str) -> str:
        if identifier == self._root and self._type_name is not None:
            return self._type_name
        if name:
            return name
        index = f"_{identifier.index}" if isinstance(identifier, ComponentIdentifier) else ""
        return f"Type_{identifier.hash.hex()[:8]}{index}"

    def _bare_class(
        self, type_name: str, annotations: dict[str, Any], attributes: Mapping[str, Any], bases: tuple[type[Any], ...]
    ) -> type[Any]:
        namespace = {"__module__": MODULE, "__annotations__": annotations, **attributes}
        return type(class_name(type_name, "Type"), bases, namespace)


def _annotated(type_: Any, *markers: Any) -> Any:
    return _ANNOTATED[(type_, *markers)]


def _bounded(type_: Any, bound: int) -> Any:
    return _annotated(type_, Bound(bound)) if bound else type_


def _extensibility(flags: TypeFlag) -> Extensibility:
    found = _EXTENSIBILITIES.get(flags & (TypeFlag.FINAL | TypeFlag.APPENDABLE | TypeFlag.MUTABLE))
    if found is None:
        raise BadParameter("it is of two kinds of extensibility at once")
    return found


def _enumerated_extensibility(flags: TypeFlag) -> Extensibility:
    """That of an enum or a bitmask, of which vendors also say nothing, or that it is mutable."""
    is_open = flags & (TypeFlag.APPENDABLE | TypeFlag.MUTABLE)
    return Extensibility.APPENDABLE if is_open else Extensibility.FINAL


def _sensible(limits: Limits) -> list[Limits]:
    """Nothing where a stranger's limits are no numbers, or would allow none."""
    given = [limit for limit in (limits.minimum, limits.maximum) if limit is not None]
    return [limits] if all(map(math.isfinite, given)) and given == sorted(given) else []


def _autoid(flags: TypeFlag) -> str:
    return "hash" if TypeFlag.AUTOID_HASH in flags else "sequential"


def _of_number(word: str, number: int) -> str:
    return f"{word}_{number}" if number >= 0 else f"{word}_MINUS_{-number}"
