"""FieldPath: a member of a type, wherever it lies within, and the function that finds it in a sample.

DDS 1.4 Annex B.2.1 (FIELDNAME): names with dots between them; ``[n]`` is the n-th element of an array or sequence,
from 0.  Enumerated values and characters compare as what they are, structs and collections not at all.  Names are
those of the IDL.  What a sample lacks (an optional member, an element behind the last, the unselected member of a
union) is None.
"""

from __future__ import annotations

import difflib
import enum
from collections.abc import Callable, Iterable
from operator import attrgetter
from typing import Any, NoReturn

from ...structure.dataclass import dataclass
from ..model import (
    BOOLEAN,
    CHAR,
    FLOAT32,
    WCHAR,
    ArrayType,
    BitmaskType,
    BitsetType,
    Case,
    EnumType,
    IdlType,
    Member,
    Primitive,
    SequenceType,
    String,
    StructType,
    UnionType,
)
from .syntax import Field, InvalidExpression

__all__ = ["FieldPath", "ValueKind", "find_member", "nearest"]

Step = Callable[[Any], Any]


class ValueKind(enum.Enum):
    """What a value may be compared with: its like.  Truth values are numbers, 0 and 1."""

    NUMBER = "a number"
    TEXT = "a text"
    CHARACTER = "a character"
    ENUMERATOR = "an enumerator"


@dataclass(frozen=True, slots=True)
class FieldPath:
    """``get(sample)`` is the value, None where the sample lacks it.

    ``is_key``: it is surely part of the key (of what lies within a key member that may depend on the type of that).
    ``is_certain``: every sample has it.
    """

    field: Field
    type: IdlType
    kind: ValueKind
    get: Step
    is_key: bool
    is_certain: bool

    @property
    def is_float32(self) -> bool:
        return self.type == FLOAT32

    @classmethod
    def find(cls, struct: StructType, field: Field, text: str = "") -> FieldPath:
        """The member of ``struct`` that ``field`` names.  Raises InvalidExpression, with the nearest name."""
        search = _Search(field, text)
        type_ = search.walk(struct)
        kind = _kind_of(type_)
        if kind is None:
            search.refuse(f"{field} is {_described(type_)}; {_remedy(field, type_)}")
        return cls(field, type_, kind, search.getter(), search.is_key, search.is_certain)


def find_member(struct: StructType, field: Field, text: str = "") -> tuple[IdlType, Step]:
    """The type of the member that ``field`` names, whatever it is, and how to get it.  Raises InvalidExpression."""
    search = _Search(field, text)
    return search.walk(struct), search.getter()


class _Search:
    """Follows a path, step by step."""

    def __init__(self, field: Field, text: str) -> None:
        self._field = field
        self._text = text
        self._names: list[str] = []
        self._steps: list[Step] = []
        self.is_key = False
        self.is_certain = True

    def refuse(self, reason: str) -> NoReturn:
        raise InvalidExpression(reason, text=self._text, column=self._field.column)

    def walk(self, struct: StructType) -> IdlType:
        type_: IdlType = struct
        for number, step in enumerate(self._field.path):
            so_far = Field(self._field.path[:number])
            type_ = (
                self._into_element(type_, step, so_far) if isinstance(step, int) else self._into(type_, step, so_far)
            )
        return type_

    def getter(self) -> Step:
        """From a sample to the value: one call where every sample has it."""
        steps = self._steps
        if self.is_certain:
            return attrgetter(".".join(self._names))

        def get(sample: Any) -> Any:
            value = sample
            for step in steps:
                value = step(value)
                if value is None:
                    return None
            return value

        return get

    def _into(self, type_: IdlType, name: str, so_far: Field) -> IdlType:
        if isinstance(type_, BitsetType):
            for bits in type_.fields:
                if bits.name == name:
                    self._add(name)
                    return bits.type
            self._unknown(name, type_, (bits.name for bits in type_.fields))
        if not isinstance(type_, (StructType, UnionType)):
            self.refuse(f"{so_far} is {_described(type_)}, which has no member {name!r}")
        member = next((member for member in type_.members if member.name_in_idl == name), None)
        if member is None:
            self._unknown(name, type_, (member.name_in_idl for member in type_.members))
        self.is_key = member.is_key and len(self._field.path) == 1
        if isinstance(type_, UnionType):
            self._into_union(type_, member)
        else:
            self._add(member.name)
            self.is_certain = self.is_certain and not member.is_optional
        return member.type

    def _into_union(self, union: UnionType, member: Member) -> None:
        self.is_certain = False
        if not isinstance(member, Case):
            self._steps.append(attrgetter("_idl_discriminator"))
            return

        def selected(value: Any) -> Any:
            return value._idl_value if union.case_of(value._idl_discriminator) is member else None

        self._steps.append(selected)

    def _into_element(self, type_: IdlType, index: int, so_far: Field) -> IdlType:
        if isinstance(type_, ArrayType):
            first, *others = type_.dimensions
            if index >= first:
                self.refuse(f"{so_far} has {first} elements, [0] to [{first - 1}]")
            element: IdlType = ArrayType(type_.element, tuple(others), type_.numpy) if others else type_.element
        elif isinstance(type_, SequenceType):
            if type_.bound is not None and index >= type_.bound:
                self.refuse(f"{so_far} has {type_.bound} elements at most")
            element = type_.element
        else:
            self.refuse(f"{so_far} is {_described(type_)}, which has no elements")
        self.is_certain = False
        self._steps.append(lambda values: values[index] if index < len(values) else None)
        if type_.numpy and not isinstance(element, ArrayType):
            self._steps.append(_plain_number)  # numpy's own refuse to be compared with larger ones
        return element

    def _add(self, attribute: str) -> None:
        self._names.append(attribute)
        self._steps.append(attrgetter(attribute))

    def _unknown(self, name: str, type_: IdlType, known: Iterable[str]) -> NoReturn:
        names = list(known)
        self.refuse(f"{type_} has no member {name!r}; {nearest(name, names)}")


def _plain_number(value: Any) -> Any:
    return value.item()


def nearest(name: str, known: list[str]) -> str:
    """What was probably meant, or else what there is, for the end of an error's sentence."""
    by_case = {candidate.lower(): candidate for candidate in known}
    close = [by_case[name.lower()]] if name.lower() in by_case else difflib.get_close_matches(name[:128], known, n=1)
    if close:
        return f"did you mean {close[0]!r}?"
    shown = ", ".join(known[:12]) + (", ..." if len(known) > 12 else "")
    return f"there are {shown}" if known else "there are none"


def _kind_of(type_: IdlType) -> ValueKind | None:
    match type_:
        case Primitive():
            return ValueKind.CHARACTER if type_ in (CHAR, WCHAR) else ValueKind.NUMBER
        case String():
            return ValueKind.TEXT
        case EnumType():
            return ValueKind.ENUMERATOR
        case BitmaskType():
            return ValueKind.NUMBER
        case _:
            return None


def _described(type_: IdlType) -> str:
    match type_:
        case StructType():
            return f"a struct, {type_}"
        case UnionType():
            return f"a union, {type_}"
        case Primitive():
            return "a boolean" if type_ == BOOLEAN else f"of type {type_}"
        case _:
            return f"of type {type_}"


def _remedy(field: Field, type_: IdlType) -> str:
    match type_:
        case StructType() | UnionType() if type_.members:
            return f"name a member of it, as {field}.{type_.members[0].name_in_idl}"
        case BitsetType():
            return f"name a field of it, as {field}.{type_.fields[0].name}"
        case ArrayType() | SequenceType():
            return f"name an element of it, as {field}[0]"
        case _:
            return "such values are not compared"
