"""Structs and unions in the analysis: members, their ids, keys and defaults, cases, inheritance.

OMG IDL 4.2 §7.4.1.4.4.4, DDS-XTypes 1.3 §7.2.2.4.4 and §7.3.1.2.1 (member ids).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeVar

from .. import model
from ..annotations import LARGEST_MEMBER_ID, autoid_hash
from ..model import Extensibility, Limits, Primitive, String
from ..recursion import DEEPEST_COLLECTION
from .annotations import Annotations
from .constants import evaluate, fitted, unsigned_bits
from .declarations import (
    Alias,
    ArrayOf,
    Bitflag,
    BitmaskDeclaration,
    BitsetDeclaration,
    ConstantValue,
    Declaration,
    EnumDeclaration,
    Enumerator,
    MapOf,
    MemberDeclaration,
    Module,
    SequenceOf,
    SkippedDeclaration,
    StructDeclaration,
    TypeReference,
    UnionDeclaration,
    collections_inside,
    levels_of,
    unaliased,
)
from .scopes import declare, look_up
from .source_text import IdlError, IdlWarning, Place
from .syntax import (
    BasicSpec,
    CaseNode,
    Definition,
    Expression,
    ForwardNode,
    KeylistNode,
    MapSpec,
    MemberNode,
    Name,
    NameSpec,
    SequenceSpec,
    StringSpec,
    StructNode,
    TypeSpec,
    UnionNode,
)

__all__ = ["CompositeAnalysis"]

_PRIMITIVES = {
    primitive.name: primitive
    for primitive in (
        *(model.BOOLEAN, model.OCTET, model.CHAR, model.WCHAR, model.FLOAT32, model.FLOAT64),
        *(model.INT8, model.INT16, model.INT32, model.INT64),
        *(model.UINT8, model.UINT16, model.UINT32, model.UINT64),
    )
}

_TYPES = (Alias, EnumDeclaration, BitmaskDeclaration, BitsetDeclaration, StructDeclaration, UnionDeclaration)

_Composite = TypeVar("_Composite", StructDeclaration, UnionDeclaration)

MOST_ELEMENTS = (1 << 32) - 1
MOST_DIMENSIONS = 16
DEEPEST_TYPE = 100
"""Structs and unions inside one another."""
MOST_BASES = 100
MOST_INHERITED = 200_000
"""Members that structs of one file inherit, or that keylists look through, all together."""


class CompositeAnalysis:
    """The half of the analysis that knows members; it walks with one scope that is open."""

    def __init__(self, root: Module, default_extensibility: Extensibility, warnings: list[IdlWarning]) -> None:
        self.scope = root
        self.warnings = warnings
        self.declarations: list[Declaration] = []
        self.keylists: list[tuple[Module, KeylistNode]] = []
        self.incomplete_uses: list[tuple[Place, StructDeclaration | UnionDeclaration]] = []
        self.is_hashed = False
        self.is_nested = False
        self._inherited = 0
        self._default_extensibility = default_extensibility

    # --- names and types ---------------------------------------------------------------------------------

    def path(self, name: str) -> tuple[str, ...]:
        return (*self.scope.path, name)

    def lookup(self, name: Name) -> Declaration:
        return look_up(name, self.scope)

    def add(self, declaration: Declaration) -> None:
        declare(self.scope, declaration)
        self.declarations.append(declaration)

    def type_of(self, spec: TypeSpec) -> TypeReference:
        match spec:
            case BasicSpec(name=name):
                return _PRIMITIVES[name]
            case StringSpec(is_wide=is_wide, bound=bound):
                return String(None if bound is None else self.bound(bound, "the bound of a string"), is_wide)
            case SequenceSpec(element=element, bound=bound):
                limit = None if bound is None else self.bound(bound, "the bound of a sequence")
                return SequenceOf(self.type_of(element), limit)
            case MapSpec(key=key, value=value, bound=bound):
                limit = None if bound is None else self.bound(bound, "the bound of a map")
                return MapOf(self._map_key(key), self.type_of(value), limit)
            case NameSpec(name=name):
                return self._named_type(name)

    def _map_key(self, spec: TypeSpec) -> TypeReference:
        type_ = self.type_of(spec)
        if not isinstance(unaliased(type_), (Primitive, String, EnumDeclaration, BitmaskDeclaration)):
            raise IdlError(spec.place, "a map's key is a number, string, character, boolean or enum")
        return type_

    def _named_type(self, name: Name) -> TypeReference:
        found = look_up(name, self.scope)
        if isinstance(found, SkippedDeclaration):
            raise IdlError(name.place, f"{name} is of the kind {found.kind}, which is no data type")
        if not isinstance(found, _TYPES):
            kind = "module" if isinstance(found, Module) else "constant"
            raise IdlError(name.place, f"expected a type; {name} is a {kind}")
        if isinstance(found, (StructDeclaration, UnionDeclaration)) and not found.is_defined:
            self.incomplete_uses.append((name.place, found))
        return found

    def bound(self, expression: Expression, what: str, highest: int = MOST_ELEMENTS) -> int:
        """A positive integer."""
        value = evaluate(expression, self.lookup)
        if isinstance(value, bool) or not isinstance(value, int) or not 1 <= value <= highest:
            shown = value.name if isinstance(value, (Enumerator, Bitflag)) else str(value)[:40]
            raise IdlError(expression.place, f"{what} is a number from 1 to {highest}, not {shown}")
        return value

    def dimensions(self, expressions: Sequence[Expression]) -> tuple[int, ...]:
        if len(expressions) > MOST_DIMENSIONS:
            raise IdlError(expressions[MOST_DIMENSIONS].place, f"an array has {MOST_DIMENSIONS} dimensions at most")
        found: list[int] = []
        count = 1
        for expression in expressions:
            found.append(self.bound(expression, "the dimension of an array"))
            count *= found[-1]
            if count > MOST_ELEMENTS:
                raise IdlError(expression.place, f"the array has {count} elements; {MOST_ELEMENTS} are possible")
        return tuple(found)

    # --- structs -----------------------------------------------------------------------------------------

    def forward(self, node: ForwardNode) -> None:
        if node.annotations:
            raise IdlError(node.annotations[0].place, "an annotation stands before the definition, not before this")
        wanted = StructDeclaration if node.kind == "struct" else UnionDeclaration
        known = self.scope.members.get(node.name)
        if not isinstance(known, wanted):
            declare(self.scope, wanted(self.path(node.name), node.place))

    def struct(self, node: StructNode) -> None:
        struct = self._opened(node, StructDeclaration)
        annotations = self._composite_annotations(node, struct)
        if node.base is not None:
            struct.base = self._base_struct(node.base)
            struct.levels = struct.base.levels
            if struct.base.extensibility is not struct.extensibility:  # §7.2.2.4.5: both are of one kind
                kinds = f"{struct.extensibility.value}, and its base {struct.base.extensibility.value}"
                self.warnings.append(IdlWarning(node.place, f"{node.name} is {kinds}: other compilers refuse that"))
        annotations.warn_of_the_rest()
        inherited = self._all_members(struct, node.place)
        taken = {member.name.lower(): member for member in inherited}
        ids = {member.id: member for member in inherited}
        next_id = inherited[-1].id + 1 if inherited else 0
        for member_node in node.members:
            member = self._member(member_node, struct, next_id)
            _refuse_taken(member, taken, ids)
            if member.is_key and struct.base is not None and any(other.is_key for other in inherited):
                raise IdlError(member.place, f"the base {struct.base.scoped_name} has the key; nothing adds to it")
            struct.members.append(member)
            next_id = member.id + 1
            struct.levels = self._checked_levels(struct, member)
        struct.is_defined = True
        self.declarations.append(struct)

    def _all_members(self, struct: StructDeclaration, place: Place) -> list[MemberDeclaration]:
        """Those of the bases first.  In a file that makes many of few by inheritance, the sum is bounded."""
        found = struct.all_members()
        self._inherited += len(found)
        if self._inherited > MOST_INHERITED:
            raise IdlError(place, f"all structs together inherit more than {MOST_INHERITED} members")
        return found

    def _checked_levels(self, composite: StructDeclaration | UnionDeclaration, member: MemberDeclaration) -> int:
        """The levels of a composite with one more member."""
        if collections_inside(member.type) > DEEPEST_COLLECTION:
            raise IdlError(member.place, f"sequences, arrays and maps nest deeper than {DEEPEST_COLLECTION}")
        levels = max(composite.levels, 1 + levels_of(member.type))
        if levels > DEEPEST_TYPE:
            raise IdlError(member.place, f"types nest deeper than {DEEPEST_TYPE}")
        return levels

    def _opened(self, node: Definition, kind: type[_Composite]) -> _Composite:
        known = self.scope.members.get(node.name)
        if isinstance(known, kind) and not known.is_defined:
            known.place, known.comment = node.place, node.comment
            return known
        declaration = kind(self.path(node.name), node.place, node.comment)
        declare(self.scope, declaration)
        return declaration

    def _composite_annotations(self, node: Definition, composite: StructDeclaration | UnionDeclaration) -> Annotations:
        annotations = Annotations(node.annotations, self.lookup, self.warnings)
        composite.extensibility = annotations.extensibility(self._default_extensibility)
        composite.is_hashed = annotations.is_hashed(default=self.is_hashed)
        is_topic = annotations.find("topic") is not None
        composite.is_nested = annotations.flag("nested", default=self.is_nested and not is_topic)
        composite.representations = annotations.representations()
        return annotations

    def _base_struct(self, name: Name) -> StructDeclaration:
        found = look_up(name, self.scope)
        base = unaliased(found) if isinstance(found, Alias) else found
        if not isinstance(base, StructDeclaration):
            raise IdlError(name.place, f"expected a struct as base; {name} is none")
        if not base.is_defined:
            raise IdlError(name.place, f"the base {name} is not defined yet")
        depth, ancestor = 0, base.base
        while ancestor is not None:
            depth, ancestor = depth + 1, ancestor.base
        if depth >= MOST_BASES:
            raise IdlError(name.place, f"structs inherit through more than {MOST_BASES} others")
        return base

    def _member(self, node: MemberNode, struct: StructDeclaration, next_id: int) -> MemberDeclaration:
        annotations = Annotations(node.annotations, self.lookup, self.warnings)
        member = self._plain_member(node, annotations, is_hashed=struct.is_hashed, next_id=next_id)
        member.is_key = annotations.flag("key") or annotations.flag("Key")
        member.is_optional = annotations.flag("optional")
        member.is_serialized = not annotations.flag("non_serialized")
        member.default = self._default(annotations, member.type)
        annotations.warn_of_the_rest()
        if member.is_key and member.is_optional:
            raise IdlError(member.place, f"{member.name} is key, and so cannot be optional")
        if member.is_key and not member.is_serialized:
            raise IdlError(member.place, f"{member.name} is key, and so must be serialized")
        if not member.is_optional:
            _refuse_incomplete(member)
        return member

    def _plain_member(
        self, node: MemberNode, annotations: Annotations, *, is_hashed: bool, next_id: int
    ) -> MemberDeclaration:
        type_ = self.type_of(node.type)
        if node.declarator.dimensions:
            type_ = ArrayOf(type_, self.dimensions(node.declarator.dimensions))
        name, place = node.declarator.name, node.declarator.place
        given, hash_name = annotations.member_id(), annotations.hash_name()
        if given is not None:
            id_ = given
        elif hash_name is not None or is_hashed:
            id_ = autoid_hash(hash_name or name)
        else:
            id_ = next_id
        if id_ > LARGEST_MEMBER_ID:
            raise IdlError(place, f"{name} has the member id {id_:#x}, and {LARGEST_MEMBER_ID:#x} is the largest")
        return MemberDeclaration(
            name,
            type_,
            place,
            id_,
            node.comment,
            is_id_explicit=given is not None,
            hash_name=hash_name,
            is_external=annotations.flag("external"),
            must_understand=annotations.flag("must_understand"),
            try_construct=annotations.try_construct(),
            limits=self._limits(annotations, type_),
            unit=annotations.unit(),
        )

    def _limits(self, annotations: Annotations, type_: TypeReference) -> Limits | None:
        limits, element = annotations.limits(), unaliased(type_)
        while isinstance(element, (SequenceOf, ArrayOf)):
            element = unaliased(element.element)
        if limits is not None and not (isinstance(element, Primitive) and element.is_number):
            place = next(found.place for name in ("range", "min", "max") if (found := annotations.find(name)))
            self.warnings.append(IdlWarning(place, "a range for this type is ignored"))
            return None
        return limits

    def _default(self, annotations: Annotations, type_: TypeReference) -> ConstantValue | None:
        found = annotations.value("default")
        if found is None:
            return None
        value, expression = found
        bare = unaliased(type_)
        if not isinstance(bare, (Primitive, String, EnumDeclaration)):
            self.warnings.append(IdlWarning(expression.place, "a default for this type is ignored"))
            return None
        return fitted(value, bare, expression.place)

    # --- unions ------------------------------------------------------------------------------------------

    def union(self, node: UnionNode) -> None:
        union = self._opened(node, UnionDeclaration)
        self._composite_annotations(node, union).warn_of_the_rest()
        union.discriminator = self.type_of(node.discriminator)
        bare = unaliased(union.discriminator)
        is_integral = isinstance(bare, Primitive) and bare.code not in "fd"
        if not is_integral and not isinstance(bare, (EnumDeclaration, BitmaskDeclaration)):  # Fast DDS has the latter
            raise IdlError(node.discriminator.place, "a discriminator is an integer, character, boolean or enum")
        annotations = Annotations(node.discriminator_annotations, self.lookup, self.warnings)
        union.is_discriminator_key = annotations.flag("key")
        annotations.warn_of_the_rest()
        taken: dict[str, MemberDeclaration] = {}
        ids: dict[int, MemberDeclaration] = {}
        labels: dict[ConstantValue, str] = {}
        for case in node.cases:
            next_id = union.members[-1].id + 1 if union.members else 1
            member = self._case(case, union, bare, labels, next_id)
            _refuse_taken(member, taken, ids)
            union.members.append(member)
            union.levels = self._checked_levels(union, member)
        if not union.members:
            raise IdlError(node.place, f"{node.name} has no case; a union has one at least")
        default = next((member for member in union.members if member.is_default_case), None)
        values = len(bare.literals) if isinstance(bare, EnumDeclaration) else 2 if bare == model.BOOLEAN else 0
        if default is not None and not default.labels and values and len(labels) == values:
            raise IdlError(
                default.place,
                f"{default.name} is never chosen, as each value of the discriminator has a case of its own",
            )
        union.is_defined = True
        self.declarations.append(union)

    def _case(
        self,
        node: CaseNode,
        union: UnionDeclaration,
        discriminator: TypeReference,
        labels: dict[ConstantValue, str],
        next_id: int,
    ) -> MemberDeclaration:
        annotations = Annotations(node.member.annotations, self.lookup, self.warnings)
        member = self._plain_member(node.member, annotations, is_hashed=union.is_hashed, next_id=next_id)
        annotations.find("default")
        for unfit in ("key", "optional"):
            if annotations.flag(unfit):
                raise IdlError(member.place, f"{member.name} is a case of a union, and cannot be @{unfit}")
        annotations.warn_of_the_rest()
        for expression in node.labels:
            label = fitted(self._label(expression, discriminator), discriminator, expression.place)
            if label in labels:
                raise IdlError(expression.place, f"the label is also that of {labels[label]}")
            labels[label] = member.name
            member.labels.append(label)
        if node.is_default:
            earlier = next((other.name for other in union.members if other.is_default_case), None)
            if earlier is not None:
                raise IdlError(member.place, f"the default case is {earlier} already")
        member.is_default_case = node.is_default
        return member

    def _label(self, expression: Expression, discriminator: TypeReference) -> ConstantValue:
        """A literal of an enum in another module may be named alone, as some compilers take it; a flag is."""
        if isinstance(expression, Name) and isinstance(discriminator, EnumDeclaration) and len(expression.parts) == 1:
            for literal in discriminator.literals:
                if literal.name == expression.parts[0]:
                    return literal
        if isinstance(expression, Name) and isinstance(discriminator, BitmaskDeclaration):
            if expression.parts[-1] in discriminator.flags:
                return Bitflag(expression.parts[-1], discriminator)
            raise IdlError(expression.place, f"{discriminator.scoped_name} has no flag {expression}")
        return evaluate(expression, self.lookup, bits=unsigned_bits(discriminator))

    # --- keylists ----------------------------------------------------------------------------------------

    def keylist(self, scope: Module, node: KeylistNode) -> None:
        """Mark the members as key; of ``a.b`` both, the outer and the one inside it."""
        is_absolute = node.name.startswith("::")
        name = Name(tuple(node.name.removeprefix("::").split("::")), is_absolute, node.place)
        found = look_up(name, scope)
        for path in node.members:
            owner: object = unaliased(found) if isinstance(found, Alias) else found
            for step in path.split("."):
                if not isinstance(owner, StructDeclaration):
                    raise IdlError(node.place, f"#pragma keylist: expected a struct; {name} with {path} is none")
                members = self._all_members(owner, node.place)
                member = next((member for member in members if member.name == step), None)
                if member is None:
                    raise IdlError(node.place, f"#pragma keylist: {owner.scoped_name} has no member {step}")
                member.is_key = True
                owner = unaliased(member.type)


def _refuse_taken(
    member: MemberDeclaration, taken: dict[str, MemberDeclaration], ids: dict[int, MemberDeclaration]
) -> None:
    """Enter the member among those taken, or say which one has its name or id."""
    earlier = taken.setdefault(member.name.lower(), member)
    if earlier is not member:
        case = "" if earlier.name == member.name else ", which differs only in case,"
        raise IdlError(member.place, f"{member.name} is there twice; {earlier.name}{case} stands at {earlier.place}")
    earlier = ids.setdefault(member.id, member)
    if earlier is not member:
        raise IdlError(member.place, f"{member.name} has the member id {member.id:#x}, and so has {earlier.name}")


def _refuse_incomplete(member: MemberDeclaration) -> None:
    """A struct that would hold itself, or what is only declared yet, by value."""
    type_ = unaliased(member.type)
    while isinstance(type_, ArrayOf):
        type_ = unaliased(type_.element)
    if isinstance(type_, StructDeclaration) and not type_.is_defined:
        raise IdlError(
            member.place,
            f"{type_.scoped_name} is not complete here; put it in a sequence, make it optional, or define it before",
        )
