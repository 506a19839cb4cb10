"""Random types and what may become of them: each version reads the other's samples, and finds the same key in them.

Generated readers predict the octets of their own version.  Whatever else comes, they must leave to the careful reader,
or read as that does: here the two are compared on octets that are right, but not as predicted.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any

from hypothesis import given, settings
from hypothesis import strategies as st

from ddsi.structure.qos_policies import DataRepresentationId
from ddsi.xtypes import idl, type_support
from ddsi.xtypes.careful_reader import read_carefully
from ddsi.xtypes.definition import struct_type
from ddsi.xtypes.equality import same
from ddsi.xtypes.model import ArrayType, IdlType, MapType, Member, Primitive, SequenceType, String, StructType

from .random_types import LEAVES, samples

XCDR1, XCDR2 = DataRepresentationId.XCDR1, DataRepresentationId.XCDR2


class Evolution:
    """Draws another version of a struct and of what is inside it; ``appendable``: those may grow and shrink too."""

    def __init__(self, data: st.DataObject, *, appendable: bool) -> None:
        self._data = data
        self._appendable = appendable

    def struct(self, type_: StructType, *, is_top: bool = True) -> StructType:
        members = [(member.name, self._member(member)) for member in type_.members]
        mutable = type_.extensibility is idl.MUTABLE
        if mutable or (type_.extensibility is idl.APPENDABLE and (self._appendable or is_top)):
            fewer = self._fewer(type_, members)
            new = [(f"new{number}", self._new(number)) for number in range(self._draw(0, 2))]
            # What is appended must not stand where another version has something else.
            members = fewer + new if mutable or len(fewer) == len(members) else fewer
        if mutable:
            members = self._data.draw(st.permutations(members))
        class_: Any = type("Evolved", (), {"__annotations__": dict(members)})
        return struct_type(idl.struct(extensibility=type_.extensibility)(class_))

    def _draw(self, lowest: int, highest: int) -> int:
        return self._data.draw(st.integers(lowest, highest))

    def _fewer(self, type_: StructType, members: list[tuple[str, Any]]) -> list[tuple[str, Any]]:
        """Without the last, as far as they are no keys."""
        for _ in range(self._draw(0, 2)):
            if len(members) > 1 and not type_.members[len(members) - 1].is_key:
                members = members[:-1]
        return members

    def _new(self, number: int) -> Any:
        leaf = self._data.draw(st.sampled_from(LEAVES))
        return Annotated[leaf.annotation | None, idl.id(5000 + number)]

    def _member(self, member: Member) -> Any:
        annotation = annotation_of(member.type) if member.is_key else self._type(member.type)
        annotation = annotation | None if member.is_optional else annotation
        return Annotated[annotation, idl.id(member.id), *([idl.key] if member.is_key else [])]

    def _type(self, type_: IdlType) -> Any:
        return annotation_of(type_, lambda struct: self.struct(struct, is_top=False).python_class)


def annotation_of(type_: IdlType, class_of: Callable[[StructType], Any] = lambda struct: struct.python_class) -> Any:
    """The same type again, but for the structs in it."""
    match type_:
        case Primitive() | String():
            return Annotated[Any, type_]
        case StructType():
            return class_of(type_)
        case SequenceType(element=element, bound=bound):
            annotation: Any = idl.sequence[annotation_of(element, class_of)]  # type: ignore[misc]
            return annotation if bound is None else Annotated[annotation, idl.bound(bound)]
        case ArrayType(element=element, dimensions=dimensions):
            annotation = annotation_of(element, class_of)
            for _ in dimensions:
                return Annotated[annotation, idl.array(*dimensions)]
        case MapType(key=key, value=value, bound=bound):
            annotation = idl.map[annotation_of(key), annotation_of(value, class_of)]  # type: ignore[misc]
            return annotation if bound is None else Annotated[annotation, idl.bound(bound)]
        case _:
            return type_.python_class


def versions(type_: StructType, data: st.DataObject, *, appendable: bool) -> StructType:
    return Evolution(data, appendable=appendable).struct(type_)


@settings(max_examples=60, report_multiple_bugs=False)
@given(samples(keyed=True), st.data())
def test_another_version_reads_what_it_knows(sample: Any, data: st.DataObject) -> None:
    support = type_support(sample.__class__)
    for representation in (XCDR2, XCDR1):
        # In XCDR1 nothing delimits an appendable type inside another, and it must stay as it is.
        other = versions(support.struct, data, appendable=representation is XCDR2)
        reader = type_support(other.python_class)
        for little_endian in (True, False):
            octets = support.serializer(representation, little_endian)(sample)
            read = reader.deserialize(octets)
            assert read == read_carefully(other, octets)
            for member in support.struct.members:
                if any(known.name == member.name and known.type == member.type for known in other.members):
                    assert same(getattr(read, member.name), getattr(sample, member.name))
            assert reader.key_from_payload(octets) == support.key(sample)
