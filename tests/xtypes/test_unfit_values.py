"""Anything at all put where a value belongs: refused by the member's path, or read back the same from every form."""

from __future__ import annotations

import datetime
import decimal
import enum
from array import array
from collections.abc import Iterator
from typing import Annotated, Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ddsi.structure.errors import BadParameter
from ddsi.structure.qos_policies import DataRepresentationId
from ddsi.xtypes import deserialize, idl, serialize, type_support
from ddsi.xtypes.model import ArrayType, IdlType, MapType, SequenceType, StructType, UnionType

from .random_types import Bits, Fields, Small, samples

FORMS = [(version, order) for version in ("XCDR1", "XCDR2") for order in ("little", "big")]


@idl.struct
class Point:
    x: idl.int32
    y: idl.float32


@idl.union
class Choice:
    kind: idl.int8 = idl.switch
    number: idl.int32 = idl.case(1)
    text: str = idl.case(2)


@idl.struct
class Members:
    boolean: idl.boolean
    octet: idl.octet
    char: idl.char
    wchar: idl.wchar
    int8: idl.int8
    uint64: idl.uint64
    float32: idl.float32
    float64: idl.float64
    text: str
    short: Annotated[str, idl.bound(3)]
    wide: idl.wstring
    small: Small
    bits: Bits
    fields: Fields
    point: Point
    choice: Choice
    maybe: Point | None
    octets: idl.sequence[idl.octet]
    few: Annotated[idl.sequence[idl.octet], idl.bound(2)]
    numbers: idl.sequence[idl.int32]
    reals: idl.sequence[idl.float64]
    booleans: idl.sequence[idl.boolean]
    chars: idl.sequence[idl.char]
    wchars: idl.sequence[idl.wchar]
    smalls: idl.sequence[Small]
    masks: idl.sequence[Bits]
    bitsets: idl.sequence[Fields]
    texts: Annotated[idl.sequence[str], idl.bound(2)]
    points: idl.sequence[Point]
    choices: idl.sequence[Choice]
    blobs: idl.sequence[idl.sequence[idl.octet]]
    counts: idl.map[str, idl.int8]
    places: Annotated[idl.map[Small, Point], idl.bound(2)]
    grid: Annotated[idl.sequence[idl.sequence[idl.int16]], idl.array(2, 2)]
    four: Annotated[bytes, idl.array(4)]
    names: Annotated[idl.sequence[str], idl.array(2)]
    flags: Annotated[idl.sequence[idl.boolean], idl.array(2)]
    table: Annotated[idl.sequence[idl.sequence[Small]], idl.array(2, 2)]
    corners: Annotated[idl.sequence[Point], idl.array(2)]
    matrix: Annotated[npt.NDArray[np.float32], idl.array_of(idl.float32, 2, 2)]
    mask: Annotated[npt.NDArray[np.bool_], idl.sequence_of(idl.boolean)]


class Foreign(enum.IntEnum):
    ONE = 1


class Hostile:
    """Every question that may be asked of a value fails."""

    def _fail(self, *_: Any) -> Any:
        raise RuntimeError("no")

    __len__ = __getitem__ = __iter__ = __index__ = __float__ = __repr__ = __bool__ = _fail


VALUES: list[Any] = [
    *(None, 0, 1, -1, 2**70, 1.5, float("nan"), float("inf"), 1e300, True, "", "a", "abc", "\ud800", "\0", "x" * 10),
    *("\u00e9" * 2, "\U0001f600", b"", b"a", b"abc", bytearray(b"ab"), memoryview(b"ab")),
    *([], [1], [1, 2], [True, False], [None], ["a"], [b"a"], [[1, 2], [3, 4]], [[0, 1], [1]], (), (1, 2), [300, 1]),
    *([2**40], [0.5, 1e300], [1, "a"], {}, {1: 2}, {"a": 1}, {"a": 300}, {1: Point(1, 2)}, {1, 2}, frozenset()),
    *(object(), int, str, Point, Small.ONE, [Small.ONE], Foreign.ONE, Bits(3), Bits.LOW | Bits.HIGH),
    *(Point(1, 2.0), Point("1", 2.0), [Point(1, 2.0), Point(1, 2.0)], [Point(1, 1e300)]),  # type: ignore[arg-type]
    *(Choice(number=1), Choice(text="x"), [Choice(number=1)], Choice(number=2**40), Choice(text=5)),  # type: ignore[arg-type]
    *(Fields(1, 2, True), Fields(9, 0, False), [Fields(1, 1, True)], decimal.Decimal("1.5"), 1j),
    *(datetime.datetime(2020, 1, 1), range(2), array("d", [1, 2]), array("b", [-1, 2]), array("Q", [2**63, 1])),
    *(np.array([1, 2]), np.array([1.5, 2.5]), np.array([[1, 2], [3, 4]]), np.array(3), np.array([3]), np.zeros(0)),
    *(np.array(["a", "b"]), np.array([1 + 2j]), np.array([None, 1], dtype=object), np.array([True, False])),
    *(np.bool_(True), np.float32(2.5), np.int8(3), np.array([2, 1], ">i8"), np.arange(6)[::2], np.zeros((2, 0))),
    *(np.array([1, 2], "datetime64[s]"), memoryview(bytes(range(4))).cast("B", (2, 2)), Hostile(), [Hostile()]),
]


def fit_sample() -> Members:
    zero = type_support(Members).deserialize(b"\0\x09\0\0" + bytes(4))
    assert isinstance(zero, Members)
    return zero


def read_back(member: str, value: Any, version: str, order: Any) -> str:
    """What the member is after a round trip, or why it was refused."""
    sample = fit_sample()
    setattr(sample, member, value)
    octets, refusal = written(sample, version, order)
    if octets is None:
        path = refusal.partition(":")[0]
        assert path == member or path.startswith((f"{member}.", f"{member}[", f"{member}, key ")), refusal
        return "refused"
    return repr(getattr(deserialize(Members, octets), member))


def written(sample: Any, version: str, order: Any) -> tuple[bytes | None, str]:
    """The octets of a sample, or None and why it was refused."""
    try:
        return serialize(sample, representation=DataRepresentationId[version], byteorder=order), ""
    except BadParameter as error:
        return None, str(error)


@pytest.mark.parametrize("member", [member.name for member in type_support(Members).struct.members])
def test_any_value_is_refused_by_its_path_or_the_same_in_every_form(member: str) -> None:
    for value in VALUES:
        # Twice: a specialising interpreter may take another way when the same line sees another type.
        results = {read_back(member, value, version, order) for version, order in FORMS * 2}
        assert len(results) == 1, (value, results)


@pytest.mark.parametrize(
    ("member", "value"),
    [
        ("octets", np.int8(3)),  # bytes(3) would be three zeros
        ("booleans", np.array(3)),
        ("numbers", np.array(3)),
        ("mask", np.bool_(True)),
        ("masks", Bits.LOW | Bits.HIGH),  # one bitmask, though Python iterates over its flags
        ("smalls", iter([Small.ONE])),
        ("smalls", {Small.ONE: 1}),
        ("texts", {"a": "b"}),
        ("blobs", np.array([1, 2])),
        ("text", str),
    ],
)
def test_what_only_looks_like_a_sequence_is_refused(member: str, value: Any) -> None:
    assert read_back(member, value, "XCDR1", "little") == "refused"


Place = tuple[str, Any, Any]
"""A path, the object that holds what is there, and the attribute or index under which it does."""


def places(type_: IdlType, value: Any, path: str) -> Iterator[Place]:
    """Every value inside a sample that can be set to another."""
    match type_:
        case StructType():
            for member in type_.members:
                inner = f"{path}.{member.name}".lstrip(".")
                yield inner, value, member.name
                held = getattr(value, member.name)
                if held is not None:
                    yield from places(member.type, held, inner)
        case UnionType():
            case = type_.case_of(value._idl_discriminator)
            if case is not None:
                yield f"{path}.{case.name}", value, case.name
                yield from places(case.type, getattr(value, case.name), f"{path}.{case.name}")
        case SequenceType() | ArrayType() if isinstance(value, list):
            for index, item in enumerate(value):
                yield f"{path}[{index}]", value, index
                yield from places(type_.element, item, f"{path}[{index}]")
        case MapType():
            for key, item in value.items():
                yield f"{path}[{key!r}]", value, key
                yield from places(type_.value, item, f"{path}[{key!r}]")


@settings(max_examples=60)
@given(samples(), st.data())
def test_whatever_is_unfit_is_named_by_its_path_wherever_it_lies(sample: Any, data: st.DataObject) -> None:
    support = type_support(sample.__class__)
    path, holder, name = data.draw(st.sampled_from(list(places(support.struct, sample, ""))))
    unfit = data.draw(st.sampled_from([object(), 2**70, 1j, "\0\ud800" * 9]))
    if isinstance(name, str) and not isinstance(holder, dict):
        setattr(holder, name, unfit)
    else:
        holder[name] = unfit
    for version, order in FORMS:
        octets, refusal = written(sample, version, order)
        if octets is None:
            assert refusal.startswith((f"{path}: ", f"{path}[")), refusal
        else:  # what a float takes, or a string of characters
            assert support.deserialize(octets) == sample or unfit == 2**70
