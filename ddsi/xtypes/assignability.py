"""May a reader of one type take the samples of a writer of another?  And if not: which member, and why.

DDS-XTypes 1.3 §7.2.4 (assignability) and §7.6.3.4 (TypeConsistencyEnforcement), over TypeObjects, minimal or complete.
Pure functions; the answer is a value.

The specification asks of elements and members that they be *strongly* assignable: assignable, and of a type whose end
can be found without knowing it.  Final types have no such end, but here they are assignable only if they agree member
by member, and so in every octet; what is assignable is then strongly so, and there is one relation instead of two.
Vendors set flags differently (keys to be understood or not, enums final or without extensibility), and so hash equal
types differently; therefore equality of hashes is enough, but never necessary, unless the reader forbids coercion.
"""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum

from ..structure.dataclass import dataclass
from ..structure.qos_policies import TypeConsistency
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
    UnknownIdentifier,
)
from .type_object.kinds import MemberFlag, TypeFlag, TypeKind
from .type_object.objects import (
    AliasObject,
    ArrayObject,
    BitmaskObject,
    BitsetObject,
    CaseObject,
    EnumObject,
    MapObject,
    MemberObject,
    SequenceObject,
    StructObject,
    TypeBody,
    TypeObject,
    UnionObject,
)

__all__ = ["MissingType", "TypeMismatch", "type_mismatch"]

MAX_DEPTH = 64
"""How deep types may nest, aliases and bases included."""

MOST_COMPARISONS = 100_000
"""Of members, in one comparison of two types: an own type with a peer's cannot reach it unless the peer means harm."""

_EXTENSIBILITY = TypeFlag.FINAL | TypeFlag.APPENDABLE | TypeFlag.MUTABLE


@dataclass(frozen=True, slots=True)
class TypeMismatch:
    """``path`` is the member, as in ``pose.points[].x``; empty for the types as a whole."""

    path: str
    reason: str

    def __str__(self) -> str:
        return f"{self.path}: {self.reason}" if self.path else self.reason


class _Keys(Enum):
    """What keys mean to a type, by where it stands (§7.2.4.4.8: KeyHolder and KeyErased)."""

    OWN = "it is a topic type: its members that are marked are key"
    MEMBER = "it is the type of such a member, all of which must arrive: bounds count whatever the policy ignores"
    NONE = "it is the type of another member, and what is marked in it is no key"


@dataclass(frozen=True, slots=True)
class MissingType:
    """It cannot be said: the TypeObject of this identifier is not known, and must be asked for."""

    identifier: TypeIdentifier


def type_mismatch(
    reader: TypeIdentifier,
    writer: TypeIdentifier,
    objects: Mapping[HashedIdentifier, TypeObject],
    consistency: TypeConsistency | None = None,
    *,
    ignores_extensibility: bool = False,
) -> TypeMismatch | MissingType | None:
    """None if the reader's type can be assigned from the writer's; else why not.

    ``objects`` holds the TypeObjects of both, ``consistency`` is the reader's policy (default: the specification's).
    Both identifiers are minimal ones, or both complete.

    ``ignores_extensibility``: what is final in one and appendable in the other is compared as if both were final; that
    is no rule of the specification, but such types are written alike in XCDR1.
    """
    consistency = consistency or TypeConsistency()
    if reader == writer and not isinstance(reader, UnknownIdentifier):
        return None
    if consistency.kind == TypeConsistency.DISALLOW_TYPE_COERCION:
        return TypeMismatch("", f"the reader takes no type but its own: {reader!r}, not {writer!r}")
    try:
        _Comparison(objects, consistency, ignores_extensibility=ignores_extensibility).compare(
            reader, writer, "", _Keys.OWN
        )
    except _MismatchFound as found:
        return found.mismatch
    except _TypeMissing as missing:
        return MissingType(missing.identifier)
    return None


class _MismatchFound(Exception):
    def __init__(self, path: str, reason: str) -> None:
        super().__init__(reason)
        self.mismatch = TypeMismatch(path, reason)


class _TypeMissing(Exception):
    def __init__(self, identifier: TypeIdentifier) -> None:
        super().__init__(repr(identifier))
        self.identifier = identifier


_Shape = (
    PrimitiveIdentifier
    | StringIdentifier
    | SequenceIdentifier
    | ArrayIdentifier
    | MapIdentifier
    | StructObject
    | UnionObject
    | EnumObject
    | BitmaskObject
    | BitsetObject
)
"""A type behind its aliases."""


class _Comparison:
    """In all methods ``one`` is of the reader and ``two`` of the writer (the specification's T1 and T2)."""

    def __init__(
        self,
        objects: Mapping[HashedIdentifier, TypeObject],
        consistency: TypeConsistency,
        *,
        ignores_extensibility: bool,
    ) -> None:
        self._objects = objects
        self._consistency = consistency
        self._ignored = TypeFlag.FINAL | TypeFlag.APPENDABLE if ignores_extensibility else TypeFlag(0)
        self._compared: set[tuple[TypeIdentifier, TypeIdentifier, _Keys]] = set()
        self._comparisons = 0
        self._depth = 0

    def compare(self, one: TypeIdentifier, two: TypeIdentifier, path: str, keys: _Keys) -> None:
        pair = (one, two, keys)
        if pair in self._compared:  # also while it is being compared: recursive types assume that they will fit
            return
        self._compared.add(pair)
        if self._depth == MAX_DEPTH:
            raise _MismatchFound(path, f"the types nest deeper than {MAX_DEPTH}")
        self._count(1, path)
        self._depth += 1
        if one != two or isinstance(one, UnknownIdentifier):
            self._compare_shapes(self._shape(one, path), self._shape(two, path), path, keys)
        self._depth -= 1

    def _compare_shapes(self, one: _Shape, two: _Shape, path: str, keys: _Keys) -> None:
        is_key = keys is _Keys.MEMBER
        keeps_string_bounds = is_key or not self._consistency.ignore_string_bounds
        keeps_bounds = is_key or not self._consistency.ignore_sequence_bounds
        match one, two:
            case StructObject(), StructObject():
                _Structs(self, one, two, path, keys).compare()
            case UnionObject(), UnionObject():
                _Unions(self, one, two, path, keys).compare()
            case EnumObject(), EnumObject():
                self._compare_enums(one, two, path, is_key=is_key)
            case StringIdentifier(), StringIdentifier() if one.wide == two.wide:
                if keeps_string_bounds:
                    _compare_bounds(one.bound, two.bound, path)
            case SequenceIdentifier(), SequenceIdentifier():
                if keeps_bounds:
                    _compare_bounds(one.bound, two.bound, path)
                self.compare(one.element, two.element, path + "[]", keys)
            case ArrayIdentifier(), ArrayIdentifier():
                if one.bounds != two.bounds:
                    raise _MismatchFound(
                        path, f"arrays of {_product(one.bounds)} and of {_product(two.bounds)} elements"
                    )
                self.compare(one.element, two.element, path + "[]", keys)
            case MapIdentifier(), MapIdentifier():
                if keeps_bounds:
                    _compare_bounds(one.bound, two.bound, path)
                self.compare(one.key, two.key, path + "[key]", keys)
                self.compare(one.element, two.element, path + "[]", keys)
            case BitmaskObject(), BitmaskObject():
                if one.bit_bound != two.bit_bound:
                    raise _MismatchFound(path, f"bitmasks of {one.bit_bound} and of {two.bit_bound} bits")
            case BitsetObject(), BitsetObject() if _bits(one) == _bits(two):
                pass
            case _ if _number_kind(one) is not None and _number_kind(one) == _number_kind(two):
                pass
            case _:
                raise _MismatchFound(path, f"{_shown(one)} in the reader's type, {_shown(two)} in the writer's")

    def _count(self, members: int, path: str) -> None:
        self._comparisons += members
        if self._comparisons > MOST_COMPARISONS:
            raise _MismatchFound(path, f"the types have more than {MOST_COMPARISONS} members to be compared")

    # --- what identifiers stand for ----------------------------------------------------------------------

    def _shape(self, identifier: TypeIdentifier, path: str) -> _Shape:
        for _ in range(MAX_DEPTH):
            match identifier:
                case HashIdentifier() | ComponentIdentifier():
                    body = self.body(identifier)
                case UnknownIdentifier(discriminator=discriminator):
                    raise _MismatchFound(path, f"a type of an unknown kind ({discriminator:#x})")
                case _:
                    return identifier
            match body:
                case AliasObject(related=related):
                    identifier = related
                case SequenceObject(element=element, bound=bound):
                    return SequenceIdentifier(element, bound)
                case ArrayObject(element=element, bounds=bounds):
                    return ArrayIdentifier(element, bounds)
                case MapObject(key=key, element=element, bound=bound):
                    return MapIdentifier(key, element, bound)
                case _:
                    return body
        raise _MismatchFound(path, "its aliases have no end")

    def body(self, identifier: HashedIdentifier) -> TypeBody:
        found = self._objects.get(identifier)
        if found is None:
            raise _TypeMissing(identifier)
        return found.body

    def members(self, struct: StructObject, path: str) -> list[MemberObject]:
        """All members, those of the bases first."""
        parts = [struct.members]
        while struct.base is not None:
            base = self._shape(struct.base, path)
            if not isinstance(base, StructObject) or len(parts) == MAX_DEPTH:
                raise _MismatchFound(path, "its base is no struct, or there is no end of bases")
            struct = base
            parts.append(struct.members)
        self._count(sum(map(len, parts)), path)
        return [member for part in reversed(parts) for member in part]

    def compare_member(
        self, one: MemberObject | CaseObject, two: MemberObject | CaseObject, path: str, *, is_key: bool = False
    ) -> None:
        name = one.name if one.name.text else two.name  # one's own types have names in minimal TypeObjects too
        self.compare(one.type, two.type, f"{path}.{name}".strip("."), _Keys.MEMBER if is_key else _Keys.NONE)

    def compare_extensibility(self, one: TypeFlag, two: TypeFlag, path: str) -> None:
        if (one ^ two) & _EXTENSIBILITY & ~self._ignored:
            raise _MismatchFound(path, f"{_extensibility(one)} for the reader, {_extensibility(two)} for the writer")

    def _compare_enums(self, one: EnumObject, two: EnumObject, path: str, *, is_key: bool) -> None:
        """Fast DDS tells no extensibility of enums, which then is not compared; Dust DDS no literals."""
        if one.flags & _EXTENSIBILITY and two.flags & _EXTENSIBILITY:
            self.compare_extensibility(one.flags, two.flags, path)
        _compare_literals(one, two, path)
        if is_key and one.literals:
            known = {literal.value for literal in one.literals}
            for literal in two.literals:
                if literal.value not in known:
                    raise _MismatchFound(path, f"it is key, and the reader does not know the literal {literal.name}")

    @property
    def ignores_names(self) -> bool:
        return self._consistency.ignore_member_names

    @property
    def prevents_widening(self) -> bool:
        return self._consistency.prevent_type_widening


# --- structs -------------------------------------------------------------------------------------------------


class _Structs:
    """DDS-XTypes 1.3 §7.2.4.4.8, table "structure types"."""

    def __init__(self, comparison: _Comparison, one: StructObject, two: StructObject, path: str, keys: _Keys) -> None:
        self._comparison = comparison
        self._path = path
        self._has_keys = keys is not _Keys.NONE
        comparison.compare_extensibility(one.flags, two.flags, path)
        self._is_final = TypeFlag.FINAL in one.flags | two.flags
        self._is_mutable = TypeFlag.MUTABLE in one.flags
        self._ones = comparison.members(one, path)
        self._twos = comparison.members(two, path)

    def compare(self) -> None:
        pairs = self._by_id() if self._is_mutable else self._by_position()
        self._compare_names(pairs)
        self._compare_presence(pairs)
        for one, two in pairs:
            self._compare_keys(one, two)
            self._comparison.compare_member(one, two, self._path, is_key=self._is_key(one))
        if not pairs and (self._ones or self._twos):
            raise self._mismatch("the types have no member in common")

    def _by_id(self) -> list[tuple[MemberObject, MemberObject]]:
        of_writer = {member.id: member for member in self._twos}
        return [(one, of_writer[one.id]) for one in self._ones if one.id in of_writer]

    def _by_position(self) -> list[tuple[MemberObject, MemberObject]]:
        if self._is_final and len(self._ones) != len(self._twos):
            raise self._mismatch(f"final types of {len(self._ones)} and of {len(self._twos)} members")
        pairs = list(zip(self._ones, self._twos, strict=False))
        for one, two in pairs:
            if one.id != two.id:
                raise self._mismatch(f"its member id is {one.id:#x} for the reader, {two.id:#x} for the writer", one)
            if (one.flags ^ two.flags) & MemberFlag.OPTIONAL:
                raise self._mismatch("it is optional in one of the types only", one)
        return pairs

    def _compare_names(self, pairs: list[tuple[MemberObject, MemberObject]]) -> None:
        """Members that correspond have one name, and a name is not that of others."""
        if self._comparison.ignores_names:
            return
        for one, two in pairs:
            if one.name.hash != two.name.hash:
                raise self._mismatch(f"the writer names it {two.name}", one)
        of_writer = {member.name.hash: member for member in self._twos}
        for one in self._ones:
            two = of_writer.get(one.name.hash, one)
            if one.id != two.id:
                raise self._mismatch(f"its member id is {one.id:#x} for the reader, {two.id:#x} for the writer", one)

    def _compare_presence(self, pairs: list[tuple[MemberObject, MemberObject]]) -> None:
        common = {one.id for one, _ in pairs}
        for members, other in (self._ones, "writer"), (self._twos, "reader"):
            for member in members:
                if member.id in common:
                    continue
                if self._is_key(member):
                    raise self._mismatch(f"it is part of the key, and the {other}'s type lacks it", member)
                if member.flags & (MemberFlag.MUST_UNDERSTAND | MemberFlag.OPTIONAL) == MemberFlag.MUST_UNDERSTAND:
                    raise self._mismatch(f"it must be understood, and the {other}'s type lacks it", member)
                is_widening = other == "writer" and MemberFlag.OPTIONAL not in member.flags
                if is_widening and self._comparison.prevents_widening:
                    raise self._mismatch("the writer's type lacks it, and the reader prevents widening", member)

    def _is_key(self, member: MemberObject) -> bool:
        return self._has_keys and MemberFlag.KEY in member.flags

    def _compare_keys(self, one: MemberObject, two: MemberObject) -> None:
        if self._is_key(one) != self._is_key(two):
            whose = "reader" if self._is_key(one) else "writer"
            raise self._mismatch(f"it is part of the key in the {whose}'s type only", one)

    def _mismatch(self, reason: str, member: MemberObject | None = None) -> _MismatchFound:
        parts = [self._path] if self._path else []
        return _MismatchFound(".".join([*parts, str(member.name)] if member is not None else parts), reason)


# --- unions --------------------------------------------------------------------------------------------------


class _Unions:
    """DDS-XTypes 1.3 §7.2.4.4.7, table "union types".  Cases correspond by label: vendors number them differently."""

    def __init__(self, comparison: _Comparison, one: UnionObject, two: UnionObject, path: str, keys: _Keys) -> None:
        self._comparison = comparison
        self._has_keys = keys is not _Keys.NONE
        self._one, self._two, self._path = one, two, path
        comparison.compare_extensibility(one.flags, two.flags, path)
        self._is_final = TypeFlag.FINAL in one.flags | two.flags

    def compare(self) -> None:
        one, two, path = self._one, self._two, self._path
        if self._has_keys and (one.discriminator_flags ^ two.discriminator_flags) & MemberFlag.KEY:
            raise _MismatchFound(path, "the discriminator is a key in one of the types only")
        keys = _Keys.MEMBER if self._has_keys and MemberFlag.KEY in one.discriminator_flags else _Keys.NONE
        self._comparison.compare(one.discriminator, two.discriminator, f"{path}.discriminator".strip("."), keys)
        ones, default_one = _cases(one)
        twos, default_two = _cases(two)
        if (self._is_final or self._comparison.prevents_widening) and ones.keys() != twos.keys():
            apart = sorted(ones.keys() ^ twos.keys())
            raise _MismatchFound(path, f"the label {apart[0]} is in one of the types only")
        for label in {**ones, **twos}:  # in order
            if label in ones and label in twos:
                self._compare_names(ones[label], twos[label])
            mine, theirs = ones.get(label, default_one), twos.get(label, default_two)
            if mine is not None and theirs is not None:
                self._comparison.compare_member(mine, theirs, path)
        if default_one is not None and default_two is not None:
            self._comparison.compare_member(default_one, default_two, path)
        elif not ones.keys() & twos.keys():
            raise _MismatchFound(path, "the unions have no label in common")

    def _compare_names(self, one: CaseObject, two: CaseObject) -> None:
        if not self._comparison.ignores_names and one.name.hash != two.name.hash:
            raise _MismatchFound(f"{self._path}.{one.name}".strip("."), f"the writer names it {two.name}")


def _cases(union: UnionObject) -> tuple[dict[int, CaseObject], CaseObject | None]:
    labels = {label: case for case in union.cases for label in case.labels}
    return labels, next((case for case in union.cases if MemberFlag.DEFAULT in case.flags), None)


# --- the others ----------------------------------------------------------------------------------------------


def _extensibility(flags: TypeFlag) -> str:
    if TypeFlag.MUTABLE in flags:
        return "mutable"
    return "final" if TypeFlag.FINAL in flags else "appendable" if TypeFlag.APPENDABLE in flags else "unspecified"


def _compare_literals(one: EnumObject, two: EnumObject, path: str) -> None:
    """§7.2.4.4.6."""
    if _octets(one.bit_bound) != _octets(two.bit_bound):  # the encoding depends on it
        raise _MismatchFound(path, f"enums of {one.bit_bound} and of {two.bit_bound} bits")
    ones = {literal.value: literal.name for literal in one.literals}
    twos = {literal.value: literal.name for literal in two.literals}
    for value in ones.keys() & twos.keys():
        if ones[value].hash != twos[value].hash:
            raise _MismatchFound(
                path, f"the literal {value} is {ones[value]} for the reader, {twos[value]} for the writer"
            )
    values_by_name = {name.hash: value for value, name in twos.items()}
    for value, name in ones.items():
        if values_by_name.get(name.hash, value) != value:
            raise _MismatchFound(path, f"the literal {name} has other values in the two types")
    if (one.flags | two.flags) & TypeFlag.FINAL and ones.keys() != twos.keys():
        raise _MismatchFound(path, "a final enum has other literals in the two types")


def _compare_bounds(one: int, two: int, path: str) -> None:
    """The reader must have room for all that the writer may send; 0 is no bound."""
    if one and not 0 < two <= one:
        raise _MismatchFound(path, f"the reader takes {one} at most, the writer may send {two or 'any number'}")


def _octets(bit_bound: int) -> int:
    return 1 if bit_bound <= 8 else 2 if bit_bound <= 16 else 4 if bit_bound <= 32 else 8


_UNSIGNED = {1: TypeKind.UINT8, 2: TypeKind.UINT16, 4: TypeKind.UINT32, 8: TypeKind.UINT64}


def _number_kind(shape: _Shape) -> TypeKind | None:
    """What primitive types and bitmasks have in common: a bitmask fits the unsigned integer that it travels as.

    To Cyclone DDS 0.10 a uint8 is a byte, so these are one.
    """
    match shape:
        case PrimitiveIdentifier(kind=TypeKind.BYTE):
            return TypeKind.UINT8
        case PrimitiveIdentifier(kind=kind):
            return kind
        case BitmaskObject(bit_bound=bit_bound):
            return _UNSIGNED[_octets(bit_bound)]
        case _:
            return None


def _bits(bitset: BitsetObject) -> list[tuple[int, int]]:
    return [(field.position, field.width) for field in bitset.fields]


def _product(bounds: tuple[int, ...]) -> str:
    return " x ".join(map(str, bounds))


def _shown(shape: _Shape) -> str:
    match shape:
        case PrimitiveIdentifier(kind=kind):
            return kind.name.lower()
        case StringIdentifier(wide=wide):
            return "wstring" if wide else "string"
        case SequenceIdentifier():
            return "a sequence"
        case ArrayIdentifier():
            return "an array"
        case MapIdentifier():
            return "a map"
        case StructObject():
            kind_name = "a struct"
        case UnionObject():
            kind_name = "a union"
        case EnumObject():
            kind_name = "an enum"
        case BitmaskObject():
            kind_name = f"a bitmask of {shape.bit_bound} bits"
        case BitsetObject():
            kind_name = "a bitset"
    return f"{kind_name} {shape.type_name}".rstrip()
