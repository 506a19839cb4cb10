"""Whether two IDL types are the same, whatever Python classes stand for them."""

from __future__ import annotations

from typing import Any

from ddsi.xtypes.model import (
    ArrayType,
    BitmaskType,
    BitsetType,
    EnumType,
    IdlType,
    MapType,
    Member,
    SequenceType,
    StructType,
    UnionType,
)


def difference(one: IdlType | None, other: IdlType | None, *, typedefs: bool = True) -> str:
    """Where two types differ first; empty where they do not.  ``typedefs``: those by which they were said count too."""
    return _Comparison(with_typedefs=typedefs).types(one, other)


class _Comparison:
    def __init__(self, *, with_typedefs: bool) -> None:
        self._with_typedefs = with_typedefs
        self._begun: set[tuple[int, int]] = set()

    def types(self, one: IdlType | None, other: IdlType | None) -> str:
        if type(one) is not type(other):
            return f"{one} and {other}"
        match one, other:
            case (SequenceType(), SequenceType()) | (ArrayType(), ArrayType()):
                size = "bound" if isinstance(one, SequenceType) else "dimensions"
                return self._values(one, other, size) or self.types(one.element, other.element)  # type: ignore[union-attr]
            case MapType(), MapType():
                return (
                    self._values(one, other, "bound")
                    or self.types(one.key, other.key)
                    or self.types(one.value, other.value)
                )
            case EnumType(), EnumType():
                literals = [{literal.name: literal.value for literal in type_.python_class} for type_ in (one, other)]
                names = [type_.default.name for type_ in (one, other)]
                values = self._values(one, other, "type_name", "bit_bound", "extensibility")
                return values or _unlike(*literals) or _unlike(*names)
            case BitmaskType(), BitmaskType():
                flags = [{flag.name: flag.value for flag in type_.python_class} for type_ in (one, other)]
                return self._values(one, other, "type_name", "bit_bound", "extensibility") or _unlike(*flags)
            case BitsetType(), BitsetType():
                return self._values(one, other, "type_name", "fields") or self.types(one.base, other.base)
            case (StructType(), StructType()) | (UnionType(), UnionType()):
                return self._composites(one, other)
            case _:
                return _unlike(one, other)

    def _composites(self, one: Any, other: Any) -> str:
        if (id(one), id(other)) in self._begun:
            return ""
        self._begun.add((id(one), id(other)))
        found = self._values(one, other, "type_name", "extensibility", "is_nested")
        if isinstance(one, StructType):
            found = found or self.types(one.base, other.base)
        if isinstance(one, UnionType):  # IDL has no name for the discriminator
            mine, theirs = one.discriminator, other.discriminator
            found = found or self._values(mine, theirs, "is_key") or self.types(mine.type, theirs.type)
        members = [
            getattr(composite, "declared" if isinstance(one, StructType) else "cases") for composite in (one, other)
        ]
        found = found or _unlike(*(len(side) for side in members))
        for mine, theirs in zip(*members, strict=False):
            found = found or self._members(mine, theirs)
        return found and f"{one.type_name}: {found}"

    def _members(self, one: Member, other: Member) -> str:
        flags = ("name_in_idl", "id", "is_key", "is_optional", "must_understand", "is_external", "is_serialized")
        found = self._values(one, other, *flags, *(("labels", "is_default") if hasattr(one, "labels") else ()))
        defaults = [None if member.default is None else member.default() for member in (one, other)]
        if self._with_typedefs:
            found = found or self._values(one, other, "typedefs")
        found = found or _unlike(*defaults) or self.types(one.type, other.type)
        return found and f"{one.name}: {found}"

    def _values(self, one: Any, other: Any, *attributes: str) -> str:
        for attribute in attributes:
            unlike = _unlike(getattr(one, attribute), getattr(other, attribute))
            if unlike:
                return f"{attribute}: {unlike}"
        return ""


def _unlike(one: Any, other: Any) -> str:
    return "" if one == other else f"{one!r} and {other!r}"
