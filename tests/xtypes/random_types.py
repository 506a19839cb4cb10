"""Hypothesis strategies for IDL types and values of them."""

from __future__ import annotations

import enum
from dataclasses import dataclass
from typing import Annotated, Any

from hypothesis import strategies as st

from ddsi.xtypes import idl


@dataclass(frozen=True)
class Kind:
    """An annotation and what its values are drawn from; ``key`` if a key member may be of it."""

    annotation: Any
    values: st.SearchStrategy[Any]
    key: bool = True


class Small(enum.IntEnum):
    ZERO = 0
    ONE = 1
    MANY = 100


@idl.enum(bit_bound=8, default="B")
class Tiny(enum.IntEnum):
    A = -1
    B = 0
    C = 5


@idl.bitmask(bit_bound=16)
class Bits(enum.IntFlag):
    LOW = 1
    HIGH = 1 << 15


@idl.bitset()
class Fields:
    low: Annotated[idl.uint8, idl.bits(3)]
    signed: Annotated[idl.int8, idl.bits(3, at=5)]
    flag: Annotated[idl.boolean, idl.bits(1)]


@idl.struct(extensibility=idl.FINAL)
class Point:
    x: idl.float64
    id: Annotated[idl.int16, idl.key]
    tag: idl.octet


def _integers(bits: int, *, signed: bool) -> st.SearchStrategy[int]:
    return st.integers(-(2 ** (bits - 1)), 2 ** (bits - 1) - 1) if signed else st.integers(0, 2**bits - 1)


NUMBERS = [
    Kind(idl.int8, _integers(8, signed=True)),
    Kind(idl.int16, _integers(16, signed=True)),
    Kind(idl.int32, _integers(32, signed=True)),
    Kind(idl.int64, _integers(64, signed=True)),
    Kind(idl.uint8, _integers(8, signed=False)),
    Kind(idl.octet, _integers(8, signed=False)),
    Kind(idl.uint16, _integers(16, signed=False)),
    Kind(idl.uint32, _integers(32, signed=False)),
    Kind(idl.uint64, _integers(64, signed=False)),
    Kind(idl.float32, st.floats(width=32, allow_nan=False)),
    Kind(idl.float64, st.floats(allow_nan=False)),
]

SCALARS = [
    *NUMBERS,
    Kind(idl.boolean, st.booleans()),
    Kind(idl.char, st.characters(max_codepoint=255)),
    Kind(idl.wchar, st.characters(max_codepoint=0xFFFF)),
]

_TEXT = st.text(st.characters(exclude_characters="\0", exclude_categories=["Cs"]), max_size=6)

_WIDE_TEXT = st.text(st.characters(exclude_characters="\0"), max_size=6)

LEAVES = [
    *SCALARS,
    Kind(str, _TEXT),
    Kind(Annotated[str, idl.bound(24)], _TEXT),
    Kind(Small, st.sampled_from(Small)),
    Kind(Tiny, st.sampled_from(Tiny)),
    Kind(Bits, st.integers(0, 0xFFFF).map(Bits)),
    Kind(Fields, st.builds(Fields, st.integers(0, 7), st.integers(-4, 3), st.booleans())),
    Kind(idl.wstring, _WIDE_TEXT),
    Kind(Annotated[idl.wstring, idl.bound(12)], _WIDE_TEXT),
    Kind(Point, st.builds(Point, st.floats(allow_nan=False), _integers(16, signed=True), st.integers(0, 255))),
]


def kinds(depth: int) -> st.SearchStrategy[Kind]:
    """A leaf; while there is depth also sequences, arrays and structs of kinds."""
    leaves = st.sampled_from(LEAVES)
    if depth == 0:
        return leaves
    inner = kinds(depth - 1)
    collections = inner.map(_sequence) | st.builds(_array, inner, st.integers(1, 3)) | inner.map(_map)
    return leaves | collections | structs(depth - 1) | unions(depth - 1)


def _map(value: Kind) -> Kind:
    annotation = Annotated[idl.map[idl.int16, value.annotation], idl.bound(4)]  # type: ignore[name-defined]
    return Kind(annotation, st.dictionaries(_integers(16, signed=True), value.values, max_size=4), key=False)


def _sequence(element: Kind) -> Kind:
    annotation = Annotated[idl.sequence[element.annotation], idl.bound(4)]  # type: ignore[name-defined]
    return Kind(annotation, st.lists(element.values, max_size=4), key=False)


def _array(element: Kind, count: int) -> Kind:
    # idl.array takes the levels of sequence that it finds for its own: one more keeps the element whole.
    values = st.lists(element.values, min_size=count, max_size=count)
    annotation = Annotated[idl.sequence[element.annotation], idl.array(count)]  # type: ignore[name-defined]
    return Kind(annotation, values, key=element.key)


@st.composite
def structs(draw: st.DrawFn, depth: int, *, keyed: bool = False) -> Kind:
    """A new struct with one to five members, of any extensibility; ``keyed``: some members are key."""
    members = draw(st.lists(kinds(depth), min_size=1, max_size=5))
    annotations: dict[str, Any] = {}
    values: list[st.SearchStrategy[Any]] = []
    for number, kind in enumerate(members):
        annotation, value = kind.annotation, kind.values
        if keyed and kind.key and draw(st.booleans()):
            annotation = Annotated[annotation, idl.key, idl.id(1000 - 10 * number)]
        elif draw(st.integers(0, 3)) == 0:
            annotation, value = Annotated[annotation, idl.optional], st.none() | value
        annotations[f"m{number}"] = annotation
        values.append(value)
    extensibility = draw(st.sampled_from(list(idl.Extensibility)))
    class_: type[Any] = idl.struct(extensibility=extensibility)(type("Random", (), {"__annotations__": annotations}))
    return Kind(class_, st.builds(class_, *values), key=False)


@st.composite
def unions(draw: st.DrawFn, depth: int) -> Kind:
    """A new union by an integer or an enum with one to four cases, the last perhaps the default one."""
    discriminator = draw(st.sampled_from((idl.int8, idl.uint64, idl.char, Small)))
    labels: Any = "abcdefg" if discriminator is idl.char else (0, 1, 100, 3, 4, 5, 6)
    cases = draw(st.lists(kinds(depth), min_size=1, max_size=3))
    annotations: dict[str, Any] = {"kind": discriminator}
    namespace: dict[str, Any] = {"kind": idl.switch, "__annotations__": annotations}
    for number, case in enumerate(cases):
        annotations[f"m{number}"] = case.annotation
        is_last = number == len(cases) - 1
        default = is_last and (discriminator is not Small or number < 2) and draw(st.booleans())
        namespace[f"m{number}"] = idl.case(*[] if default else [labels[number]], default=default)
    extensibility = draw(st.sampled_from(list(idl.Extensibility)))
    class_: type[Any] = idl.union(extensibility=extensibility)(type("RandomUnion", (), namespace))
    values = [st.builds(class_, **{f"m{number}": case.values}) for number, case in enumerate(cases)]
    return Kind(class_, st.one_of(values), key=False)


@st.composite
def samples(draw: st.DrawFn, *, keyed: bool = False) -> Any:
    """A sample of a random type."""
    return draw(draw(structs(2, keyed=keyed)).values)
