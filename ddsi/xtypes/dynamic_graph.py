"""TypeObjects that a stranger sent, seen as a whole before a class is made of any: are they a type, and is it bounded?

DDS-XTypes 1.3 §7.2.2 (what types are made of).  Everything that follows (classes, codecs, default values) costs as the
type does: in the number of members, in how deep types nest, and in how often they multiply, as a struct of two structs
of two structs does.  All of that is bounded here, in time linear in the TypeObjects.  What one class by itself shows to
be wrong (an id given twice, a key that is optional) is left to the decorators that make classes.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from ..structure.errors import BadParameter
from .components import strongly_connected
from .recursion import DEEPEST_COLLECTION
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
from .type_object.kinds import MemberFlag, TypeKind
from .type_object.objects import (
    AliasObject,
    ArrayObject,
    BitmaskObject,
    BitsetObject,
    CaseObject,
    EnumObject,
    MapObject,
    SequenceObject,
    StructObject,
    TypeBody,
    TypeObject,
    UnionObject,
)
from .type_object.references import references

__all__ = ["TypeGraph", "plain", "shown_name"]

MOST_TYPES = 512
MOST_MEMBERS = 16_384
"""Of all types together, inherited ones counted again; literals, flags and bit fields too."""
MOST_MEMBERS_OF_ONE = 2048
DEEPEST_TYPE = 64
"""Types that need one another in a row, aliases and bases included."""
MOST_FLAT_MEMBERS = 65_536
"""Members of a sample, those of its structs included, where each array counts as one element."""
MOST_VALUES = 1 << 24
"""Values of a sample that has all its defaults: arrays have all their elements then."""

_KEY_KINDS = (EnumObject, BitmaskObject)
_NO_KINDS = (TypeKind.NONE, TypeKind.FLOAT128)


class TypeGraph:
    """The types that a type needs, found possible.  Raises BadParameter where they are not, naming type and reason.

    ``components``: identifiers in the order in which types can be defined; those that need each other are together.
    """

    def __init__(self, types: BuiltTypes) -> None:
        self._objects: Mapping[HashedIdentifier, TypeObject] = types.objects
        self._flat: dict[HashedIdentifier, tuple[int, int]] = {}
        self._in_progress: set[HashedIdentifier] = set()
        order, self.components = strongly_connected(types.root, self._needed)
        if len(order) > MOST_TYPES:
            raise BadParameter(f"a type that needs {len(order)} types cannot be used; {MOST_TYPES} are possible")
        self._bound_depth()
        for identifier in order:
            self._check_members(identifier)
        self._bound_members(order)
        for identifier in order:
            members, values = self._flattened(identifier)
            if members > MOST_FLAT_MEMBERS or values > MOST_VALUES:
                raise self._refusal(
                    identifier, f"a sample would have {_rounded(members)} members and {_rounded(values)} values"
                )

    def body(self, identifier: HashedIdentifier) -> TypeBody:
        """What the identifier stands for."""
        found = self._objects.get(identifier)
        if found is None:
            raise BadParameter(f"the TypeObject of {identifier!r} is missing")
        return found.body

    def unaliased(self, identifier: TypeIdentifier) -> TypeIdentifier:
        """What a chain of aliases stands for."""
        for _ in range(DEEPEST_TYPE):
            if not isinstance(identifier, HashedIdentifier):
                return identifier
            body = self.body(identifier)
            if not isinstance(body, AliasObject):
                return plain(identifier, body)
            identifier = body.related
        raise BadParameter(f"aliases follow one another without end, or through more than {DEEPEST_TYPE}")

    def _refusal(self, identifier: HashedIdentifier, reason: str) -> BadParameter:
        return BadParameter(f"the type {shown_name(identifier, self.body(identifier))} cannot be used: {reason}")

    # --- number and depth --------------------------------------------------------------------------------

    def _needed(self, identifier: HashedIdentifier) -> list[HashedIdentifier]:
        self.body(identifier)
        return list(dict.fromkeys(references(self._objects[identifier])))

    def _bound_depth(self) -> None:
        level: dict[HashedIdentifier, int] = {}
        for component in self.components:  # what it needs comes before it
            inside = set(component)
            needed = {one for identifier in component for one in self._needed(identifier)} - inside
            depth = len(component) + max((level[one] for one in needed), default=0)
            if depth > DEEPEST_TYPE:
                raise self._refusal(component[0], f"types nest deeper than {DEEPEST_TYPE}")
            level |= dict.fromkeys(component, depth)

    def _bound_members(self, order: list[HashedIdentifier]) -> None:
        total = 0
        for identifier in order:
            count = self._member_count(identifier, set())
            total += count
            is_composite = isinstance(self.body(identifier), (StructObject, UnionObject))
            if is_composite and count > MOST_MEMBERS_OF_ONE:
                raise self._refusal(identifier, f"it has {count} members; {MOST_MEMBERS_OF_ONE} are possible")
        if total > MOST_MEMBERS:
            raise self._refusal(order[0], f"its types have {total} members together; {MOST_MEMBERS} are possible")

    def _member_count(self, identifier: HashedIdentifier, derived: set[HashedIdentifier]) -> int:
        """Those of the bases included."""
        match self.body(identifier):
            case StructObject(base=None, members=members):
                return len(members)
            case StructObject(members=members) as body:
                base = self._base(identifier, body)
                if base in derived:
                    raise self._refusal(identifier, "it is its own base")
                return len(members) + self._member_count(base, {*derived, identifier, base})
            case UnionObject(cases=cases):
                return len(cases)
            case EnumObject(literals=literals):
                return len(literals)
            case BitmaskObject(bitflags=bitflags):
                return len(bitflags)
            case BitsetObject(fields=fields):
                return len(fields)
            case _:
                return 0

    def base_of(self, identifier: HashedIdentifier) -> HashedIdentifier | None:
        """The base of a struct that has one; aliases are looked through."""
        body = self.body(identifier)
        return self._base(identifier, body) if isinstance(body, StructObject) and body.base is not None else None

    def _base(self, identifier: HashedIdentifier, body: StructObject) -> HashedIdentifier:
        assert body.base is not None
        base = self.unaliased(body.base)
        if not isinstance(base, HashedIdentifier) or not isinstance(self.body(base), StructObject):
            raise self._refusal(identifier, "its base is no struct")
        return base

    # --- what members are --------------------------------------------------------------------------------

    def _check_members(self, identifier: HashedIdentifier) -> None:
        body = self.body(identifier)
        names: set[str] = set()
        for name, type_ in _members(body):
            if name in names and name:
                raise self._refusal(identifier, f"it has two members {name}")
            names.add(name)
            reason = self._why_impossible(type_)
            if reason:
                raise self._refusal(identifier, f"{name or 'a member'}: {reason}" if name else reason)
        self.base_of(identifier)

    def _why_impossible(self, type_: TypeIdentifier) -> str:
        """Follows collections and aliases to a type with a name, or one that says itself."""
        collections = 0
        while True:
            type_ = self.unaliased(type_)
            match type_:
                case PrimitiveIdentifier(kind=kind) if kind in _NO_KINDS:
                    return "long double is not supported" if kind == TypeKind.FLOAT128 else "it has no type"
                case SequenceIdentifier(element=element):
                    pass
                case ArrayIdentifier(element=element, bounds=bounds):
                    if not bounds or 0 in bounds:
                        return "an array without elements"
                case MapIdentifier(key=key, element=element):
                    if not self._is_key(key):
                        return "the key of a map is a number, a string, a character, a boolean or an enum"
                case PrimitiveIdentifier() | StringIdentifier() | HashIdentifier() | ComponentIdentifier():
                    return ""
                case _:
                    return "its type is of a kind that this release does not know"
            type_ = element
            collections += 1
            if collections > DEEPEST_COLLECTION:
                return f"sequences, arrays and maps nest deeper than {DEEPEST_COLLECTION}"

    def _is_key(self, type_: TypeIdentifier) -> bool:
        type_ = self.unaliased(type_)
        if isinstance(type_, PrimitiveIdentifier):
            return type_.kind not in _NO_KINDS
        if isinstance(type_, HashedIdentifier):
            return isinstance(self.body(type_), _KEY_KINDS)
        return isinstance(type_, StringIdentifier)

    # --- how much a sample is ----------------------------------------------------------------------------

    def _flattened(self, identifier: HashedIdentifier) -> tuple[int, int]:
        """Members and values of a sample with all its defaults."""
        known = self._flat.get(identifier)
        if known is not None:
            return known
        if identifier in self._in_progress:
            raise self._refusal(identifier, "it would contain itself without end")
        self._in_progress.add(identifier)
        members, values = 1, 1
        for part in self._by_value(identifier):
            count, type_ = self._without_arrays(part)
            inner = self._flattened(type_) if isinstance(type_, HashedIdentifier) else (1, 1)
            members += inner[0]
            values += count * inner[1]
        self._in_progress.remove(identifier)
        self._flat[identifier] = members, values
        return members, values

    def _without_arrays(self, type_: TypeIdentifier) -> tuple[int, TypeIdentifier]:
        """How often the innermost element of an array is there, and what it is."""
        count, type_ = 1, self.unaliased(type_)
        while isinstance(type_, ArrayIdentifier):
            count *= math.prod(type_.bounds)
            type_ = self.unaliased(type_.element)
        return count, type_

    def _by_value(self, identifier: HashedIdentifier) -> list[TypeIdentifier]:
        """What every sample contains; of a union the member that is there by default."""
        match self.body(identifier):
            case StructObject(members=members):
                base = self.base_of(identifier)
                parts = [member.type for member in members if MemberFlag.OPTIONAL not in member.flags]
                return parts if base is None else [base, *parts]
            case UnionObject() as union:
                case = self._default_case(union)
                return [] if case is None else [case.type]
            case _:
                return []

    def _default_case(self, union: UnionObject) -> CaseObject | None:
        switch = self.unaliased(union.discriminator)
        first = 0
        if isinstance(switch, HashedIdentifier):
            body = self.body(switch)
            if isinstance(body, EnumObject) and body.literals:
                marked = [literal for literal in body.literals if MemberFlag.DEFAULT in literal.flags]
                first = (marked or body.literals)[0].value
        chosen = next((case for case in union.cases if first in case.labels), None)
        return chosen or next((case for case in union.cases if MemberFlag.DEFAULT in case.flags), None)


def plain(identifier: HashedIdentifier, body: TypeBody) -> TypeIdentifier:
    """The identifier that says a collection itself, for one that has a TypeObject; else the identifier as it is."""
    match body:
        case SequenceObject(element=element, bound=bound):
            return SequenceIdentifier(element, bound)
        case ArrayObject(element=element, bounds=bounds):
            return ArrayIdentifier(element, bounds)
        case MapObject(key=key, element=element, bound=bound):
            return MapIdentifier(key, element, bound)
        case _:
            return identifier


def shown_name(identifier: HashedIdentifier, body: TypeBody) -> str:
    """The type's name, or where there is none its hash."""
    name = "" if isinstance(body, (SequenceObject, ArrayObject, MapObject)) else body.type_name
    return name or repr(identifier)


def _members(body: TypeBody) -> list[tuple[str, TypeIdentifier]]:
    """Name and type of all that has both; names are empty in minimal TypeObjects."""
    match body:
        case StructObject(members=members):
            return [(member.name.text, member.type) for member in members]
        case UnionObject(cases=cases, discriminator=discriminator):
            return [("", discriminator), *((case.name.text, case.type) for case in cases)]
        case AliasObject(related=related):
            return [("", related)]
        case SequenceObject(element=element) | ArrayObject(element=element) | MapObject(element=element):
            return [("", element)]
        case _:
            return []


def _rounded(number: int) -> str:
    return str(number) if number < 10**9 else "more than a thousand million"
