"""What ``idl.range``, ``unit`` and ``try_construct`` refuse, keep and tell, and a type's choice of representations."""

from __future__ import annotations

import enum
import re
from dataclasses import field
from typing import Annotated, Any

import numpy as np
import numpy.typing as npt
import pytest

import ddsi
from ddsi.structure.errors import BadParameter, MalformedSample
from ddsi.structure.qos_policies import DataRepresentationId
from ddsi.xtypes import deserialize, idl, serialize, type_support
from ddsi.xtypes.definition import struct_type
from ddsi.xtypes.model import Limits, TryConstruct

XCDR1, XCDR2 = DataRepresentationId.XCDR1, DataRepresentationId.XCDR2
BOTH = pytest.mark.parametrize("representation", [XCDR1, XCDR2])

# --- range -------------------------------------------------------------------------------------------------


@idl.struct(extensibility=idl.MUTABLE)
class Ranged:
    speed: Annotated[idl.float32, idl.range(-1, 1.5)] = 0.0
    count: Annotated[idl.uint8, idl.range(max=9)] = 0
    level: Annotated[idl.int16, idl.range(min=-3)] = 0
    maybe: Annotated[idl.int32 | None, idl.range(5, 6)] = None
    numbers: Annotated[idl.sequence[idl.int32], idl.range(0, 10)] = ()
    octets: Annotated[bytes, idl.range(max=99)] = b""
    grid: Annotated[idl.sequence[idl.sequence[idl.int8]], idl.array(2, 2), idl.range(0, 3)] = ((0, 0), (0, 0))
    reals: Annotated[npt.NDArray[np.float64], idl.sequence_of(idl.float64), idl.range(0, 1)] = field(
        default_factory=lambda: np.zeros(0)
    )


@idl.union
class Measured:
    kind: idl.int8 = idl.switch
    angle: Annotated[idl.float64, idl.range(0, 360)] = idl.case(1)


@idl.struct
class Holder:
    measured: Measured
    all: idl.sequence[Measured]


@BOTH
@pytest.mark.parametrize(
    ("member", "value", "reason"),
    [
        ("speed", 2, "speed: 2 is beyond its range (-1 to 1.5)"),
        ("speed", float("nan"), "speed: nan is beyond its range (-1 to 1.5)"),
        ("count", 10, "count: 10 is beyond its range (9 at most)"),
        ("level", -4, "level: -4 is beyond its range (-3 or more)"),
        ("maybe", 7, "maybe: 7 is beyond its range (5 to 6)"),
        ("numbers", [0, 10, 11], "numbers[2]: 11 is beyond its range (0 to 10)"),
        ("octets", b"\0\x64", "octets[1]: 100 is beyond its range (99 at most)"),
        ("grid", [[0, 1], [2, 4]], "grid[1][1]: 4 is beyond its range (0 to 3)"),
        ("grid", np.array([[0, 1], [9, 2]], "i1"), "grid[1][0]: 9 is beyond its range (0 to 3)"),
        ("reals", np.array([0.5, 1.5]), "reals[1]: 1.5 is beyond its range (0 to 1)"),
        ("speed", "fast", "speed: 'fast' is no number"),
    ],
)
def test_what_is_beyond_its_range_is_not_sent(
    member: str, value: Any, reason: str, representation: DataRepresentationId
) -> None:
    sample = Ranged(**{member: value})
    with pytest.raises(BadParameter, match=re.escape(reason)):
        serialize(sample, representation=representation)


@BOTH
def test_what_is_within_its_range_is_sent(representation: DataRepresentationId) -> None:
    sample = Ranged(1.5, 9, -3, 6, [0, 10], b"\x63", [[0, 1], [2, 3]], np.array([0, 0.5, 1]))
    assert deserialize(Ranged, serialize(sample, representation=representation)) == sample
    held = Holder(Measured(angle=360), [Measured(angle=0)])
    assert deserialize(Holder, serialize(held, representation=representation)) == held
    with pytest.raises(BadParameter, match=r"all\[0\]\.angle: 361 is beyond its range"):
        serialize(Holder(Measured(angle=360), [Measured(angle=361)]), representation=representation)


def test_what_others_send_is_not_judged_by_its_range() -> None:
    @idl.struct(extensibility=idl.FINAL)
    class Free:
        count: idl.uint8

    @idl.struct(extensibility=idl.FINAL)
    class Bound:
        count: Annotated[idl.uint8, idl.range(max=9)]

    assert deserialize(Bound, serialize(Free(200))).count == 200


def test_a_default_beyond_its_range_is_refused_when_defined() -> None:
    with pytest.raises(BadParameter, match=r"Wrong: the default of x: 7 is beyond its range \(0 to 5\)"):

        @idl.struct
        class Wrong:
            x: Annotated[idl.int32, idl.range(0, 5)] = 7


@pytest.mark.parametrize(
    ("annotation", "reason"),
    [
        (
            lambda: Annotated[str, idl.range(0, 1)],
            "idl.range fits numbers, and sequences and arrays of them, not string",
        ),
        (lambda: Annotated[bool, idl.range(0, 1)], "not boolean"),
        (lambda: list[Annotated[idl.int8, idl.range(0, 1)]], "idl.range belongs to the member, not to the elements"),
        (lambda: list[Annotated[str, idl.try_construct("trim")]], "idl.try_construct belongs to the member"),
        (idl.range, "takes the lowest value, the highest, or both"),
        (lambda: idl.range(3, 2), "nothing lies between"),
        (lambda: idl.range(float("nan")), "takes finite numbers, not nan"),
        (lambda: idl.range(True), "takes finite numbers, not True"),
        (lambda: idl.range("a"), "takes finite numbers, not 'a'"),  # type: ignore[arg-type]
        (lambda: idl.unit(5), "idl.unit takes a text, not 5"),  # type: ignore[arg-type]
        (lambda: idl.try_construct("cut"), 'takes "discard", "use_default" or "trim"'),  # type: ignore[arg-type]
        (lambda: Annotated[idl.int8, idl.range], "idl.range needs its argument"),
    ],
)
def test_annotations_that_cannot_be_are_refused(annotation: Any, reason: str) -> None:
    with pytest.raises(BadParameter, match=re.escape(reason)):
        idl.struct(type("Wrong", (), {"__annotations__": {"x": annotation()}}))


# --- try_construct -----------------------------------------------------------------------------------------


class Color(enum.IntEnum):
    RED = 0
    GREEN = 1


class Wider(enum.IntEnum):
    RED = 0
    GREEN = 1
    BLUE = 2


@idl.struct(typename="Inner")
class Inner:
    color: Color
    short: Annotated[str, idl.bound(4)]


@idl.struct(typename="Inner")
class WideInner:
    color: Wider
    short: str


@idl.struct(typename="T")
class Wide:
    text: str
    wide: idl.wstring
    numbers: idl.sequence[idl.int32]
    counts: idl.map[str, idl.int8]
    color: Wider
    inner: WideInner
    colors: idl.sequence[Wider]
    maybe: Wider | None
    last: idl.int32


@idl.struct(typename="T")
class Narrow:
    text: Annotated[str, idl.bound(3), idl.try_construct("trim")]
    wide: Annotated[idl.wstring, idl.bound(3), idl.try_construct("trim")]
    numbers: Annotated[idl.sequence[idl.int32], idl.bound(2), idl.try_construct("trim")]
    counts: Annotated[idl.map[str, idl.int8], idl.bound(1), idl.try_construct("trim")]
    color: Annotated[Color, idl.try_construct("use_default")] = Color.GREEN
    inner: Annotated[Inner, idl.try_construct("use_default")] = field(default_factory=lambda: Inner(Color.GREEN, "def"))
    colors: Annotated[idl.sequence[Color], idl.try_construct("use_default")] = field(default_factory=list)
    maybe: Annotated[Color | None, idl.try_construct("use_default")] = None
    last: idl.int32 = 0


@BOTH
@pytest.mark.parametrize("byteorder", ["little", "big"])
def test_what_does_not_fit_is_trimmed_or_becomes_the_default(
    representation: DataRepresentationId, byteorder: Any
) -> None:
    wide = Wide(
        "a\u20acb", "\U0001f600\U0001f600", [1, 2, 3], {"a": 1, "b": 2}, Wider.BLUE, WideInner(Wider.RED, "too long"),
        [Wider.RED, Wider.BLUE], Wider.BLUE, 7,
    )  # fmt: skip
    narrow = deserialize(Narrow, serialize(wide, representation=representation, byteorder=byteorder))
    assert narrow == Narrow("a", "\U0001f600", [1, 2], {"a": 1}, Color.GREEN, Inner(Color.GREEN, "def"), [], None, 7)


@BOTH
def test_what_fits_is_kept(representation: DataRepresentationId) -> None:
    wide = Wide("abc", "abc", [1, 2], {"a": 1}, Wider.RED, WideInner(Wider.RED, "four"), [Wider.GREEN], Wider.RED, 7)
    narrow = deserialize(Narrow, serialize(wide, representation=representation))
    assert narrow == Narrow(
        "abc", "abc", [1, 2], {"a": 1}, Color.RED, Inner(Color.RED, "four"), [Color.GREEN], Color.RED, 7
    )


def test_a_map_with_keys_that_are_no_literals_becomes_the_default() -> None:
    @idl.struct(extensibility=idl.FINAL)
    class Sent:
        by_color: idl.map[idl.int32, idl.int8]

    @idl.struct(extensibility=idl.FINAL)
    class Received:
        by_color: Annotated[idl.map[Color, idl.int8], idl.try_construct("use_default")]

    octets = serialize(Sent({7: 1, 8: 2, 1: 3}), representation=XCDR1)
    assert deserialize(Received, octets).by_color == {}


def test_octets_out_of_order_are_malformed_all_the_same() -> None:
    """USE_DEFAULT forgives values, not octets: a string that is no UTF-8, or ends behind the sample."""

    @idl.struct(extensibility=idl.FINAL)
    class Forgiving:
        text: Annotated[str, idl.bound(3), idl.try_construct("use_default")]

    assert deserialize(Forgiving, bytes.fromhex("00010000 05000000 6161616100")).text == ""
    for octets in ("02000000 ff00", "05000000 6161"):
        with pytest.raises(MalformedSample, match="text: "):
            deserialize(Forgiving, bytes.fromhex("00010000" + octets))


def test_without_it_the_sample_is_malformed() -> None:
    @idl.struct(typename="T")
    class Strict:
        text: Annotated[str, idl.bound(3), idl.try_construct("discard")]

    with pytest.raises(MalformedSample, match="text: a string of 4 octets exceeds its bound of 3"):
        deserialize(Strict, bytes.fromhex("00010000 05000000 6161616100"))


# --- representations ---------------------------------------------------------------------------------------


def test_a_type_may_choose_its_representations() -> None:
    @idl.struct(extensibility=idl.FINAL, representations=(idl.XCDR2,))
    class Modern:
        x: idl.float64

    assert type_support(Modern).representations == (XCDR2,)
    assert serialize(Modern(1))[:2] == b"\0\7"
    for wrong in ("XCDR2", (DataRepresentationId.XML,), [idl.XCDR2]):
        with pytest.raises(BadParameter, match=r"Modern: representations are a tuple of idl\.XCDR1 and idl\.XCDR2"):
            idl.struct(representations=wrong)(type("Modern", (), {}))  # type: ignore[arg-type]


# --- from and to IDL ---------------------------------------------------------------------------------------

TEXT = """\
@final @data_representation(XCDR2 | XCDR1)
struct Sensor {
    @range(min=-40, max=125.5) @unit("\\u00b0C") float temperature;
    @min(1) unsigned long count;
    @max(7) @try_construct(USE_DEFAULT) octet levels[3];
    @try_construct(TRIM) string<8> name;
    @verbatim(language="c++", placement=BEFORE_DECLARATION, text="//") long free;
};
"""


def test_annotations_in_idl_text_are_those_in_python() -> None:
    types: Any = ddsi.idl.loads(TEXT)
    temperature, count, levels, name, free = struct_type(types.Sensor).members
    assert (temperature.limits, temperature.unit) == (Limits(-40, 125.5), "\u00b0C")
    assert (count.limits, count.unit, count.try_construct) == (Limits(1), None, TryConstruct.DISCARD)
    assert (levels.limits, levels.try_construct) == (Limits(maximum=7), TryConstruct.USE_DEFAULT)
    assert (name.try_construct, free.limits) == (TryConstruct.TRIM, None)
    assert type_support(types.Sensor).representations == (XCDR2, XCDR1)
    assert types.idl_warnings == ()
    again: Any = ddsi.idl.loads(ddsi.idl.to_idl(types.Sensor))
    assert struct_type(again.Sensor).members == struct_type(types.Sensor).members
    assert type_support(again.Sensor).representations == (XCDR2, XCDR1)


@pytest.mark.parametrize(
    ("member", "reason"),
    [
        ("@range(min=3, max=2) long x;", "nothing lies between 3 and 2"),
        ('@min("a") long x;', "@min takes numbers"),
        ("@unit(3) long x;", "@unit takes a string"),
        ("@try_construct(CUT) long x;", "@try_construct takes DISCARD or USE_DEFAULT or TRIM"),
    ],
)
def test_wrong_annotations_in_idl_text_are_errors(member: str, reason: str) -> None:
    with pytest.raises(ddsi.idl.IdlError, match=re.escape(reason)):
        ddsi.idl.loads(f"struct T {{ {member} }};")


def test_a_wrong_representation_in_idl_text_is_an_error() -> None:
    with pytest.raises(ddsi.idl.IdlError, match="@data_representation takes XCDR1, XCDR2 or XML"):
        ddsi.idl.loads("@data_representation(CDR) struct T { long x; };")


def test_a_range_of_what_is_no_number_is_left_out_with_a_warning() -> None:
    types: Any = ddsi.idl.loads("struct T { @min(3) string x; };")
    assert struct_type(types.T).members[0].limits is None
    assert "a range for this type is ignored" in str(types.idl_warnings[0])
