"""A topic type as a whole: complete at first use, finite, and sent in one representation rather than another."""

from __future__ import annotations

from ..structure.errors import BadParameter
from ..structure.qos_policies import DataRepresentationId
from .defaults import default_value
from .model import (
    ArrayType,
    Composite,
    Extensibility,
    IdlType,
    MapType,
    Member,
    SequenceType,
    StructType,
    UnionType,
    reachable_structs,
)
from .recursion import DEEPEST_COLLECTION, is_recursive

__all__ = ["complete", "default_representations", "refuse_impossible"]

XCDR1, XCDR2 = DataRepresentationId.XCDR1, DataRepresentationId.XCDR2


def complete(struct: StructType) -> StructType:
    """The struct with all its members found, and checked for what one class alone cannot show.

    Raises BadParameter where an annotation names what is not defined, or the type would be endless.
    """
    try:
        for inner in reachable_structs(struct):
            refuse_impossible(inner)
    except NameError as error:
        raise BadParameter(f"{struct.type_name}: an annotation cannot be resolved: {error}") from error
    return struct


def refuse_impossible(composite: Composite) -> None:
    """Raise BadParameter, naming the member, where what the members are makes the type impossible.

    ``NameError`` while that cannot be known, as one of them is not complete itself.
    """
    _refuse_endless(composite)
    for member in composite.members:
        _refuse_unfit_elements(composite, member)


def _refuse_endless(struct: Composite) -> None:
    """A struct that holds itself by value has no finite sample."""
    pending: list[Composite] = [struct]
    seen: set[int] = set()
    while pending:
        candidate = pending.pop()
        for member in _by_value(candidate):
            type_: IdlType = member.type
            while isinstance(type_, ArrayType):
                type_ = type_.element
            if not isinstance(type_, (StructType, UnionType)):
                continue
            if type_ is struct:
                raise BadParameter(
                    f"{candidate.python_class.__name__}.{member.name}: {struct.type_name} would contain itself without"
                    " end; put it in a sequence, or make it optional"
                )
            if id(type_) not in seen:
                seen.add(id(type_))
                pending.append(type_)


def _refuse_unfit_elements(composite: Composite, member: Member) -> None:
    """Nesting is bounded by what Python can compile.  And a sequence of empty structs would have any number of elements
    in no octets, and reading it no bound in time."""
    type_: IdlType = member.type
    depth = 0
    while isinstance(type_, (SequenceType, ArrayType, MapType)):
        depth += 1
        if depth > DEEPEST_COLLECTION:
            raise BadParameter(
                f"{composite.python_class.__name__}.{member.name}: sequences, arrays and maps nest deeper than"
                f" {DEEPEST_COLLECTION}; put a struct between them"
            )
        element = type_.value if isinstance(type_, MapType) else type_.element
        if not isinstance(type_, MapType) and not _has_octets(element):
            raise BadParameter(
                f"{composite.python_class.__name__}.{member.name}: its elements are of {element}, which has no members"
            )
        type_ = element


def _has_octets(type_: IdlType) -> bool:
    """Whether every value has an octet at least."""
    match type_:
        case StructType():
            framed = type_.extensibility is Extensibility.MUTABLE
            return framed or any(member.is_optional or _has_octets(member.type) for member in type_.members)
        case ArrayType():
            return _has_octets(type_.element)
        case _:
            return True


def _by_value(composite: Composite) -> list[Member]:
    """The members that every sample has; of a union the one that is there by default."""
    if isinstance(composite, StructType):
        return [member for member in composite.members if not member.is_optional]
    case = composite.case_of(default_value(composite.discriminator))
    return [] if case is None else [case]


def default_representations(struct: StructType) -> tuple[DataRepresentationId, ...]:
    """What the type can be sent in; a writer's default first.

    XCDR1 reaches every vendor, but cannot delimit an appendable type inside another, and its forms of optional and
    mutable differ between vendors: there XCDR2 comes first.  What the type says itself (IDL ``@data_representation``)
    has the last word.
    """
    if struct.representations:
        return struct.representations
    structs = list(reachable_structs(struct))
    prefers_xcdr2 = is_recursive(struct) or any(
        inner.extensibility is Extensibility.MUTABLE
        or any(member.is_optional for member in inner.members)
        or (inner.extensibility is Extensibility.APPENDABLE and inner is not struct)
        for inner in structs
    )
    return (XCDR2, XCDR1) if prefers_xcdr2 else (XCDR1, XCDR2)
