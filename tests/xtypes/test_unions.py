"""Unions, bitsets, maps and wide strings as Python sees them; their octets are in the vectors and random types."""

from __future__ import annotations

import enum
from typing import Annotated, Any

import pytest

from ddsi.structure.errors import BadParameter, MalformedSample
from ddsi.structure.qos_policies import DataRepresentationId
from ddsi.xtypes import deserialize, idl, key_hash, serialize
from ddsi.xtypes.definition import struct_type
from ddsi.xtypes.keys import canonical_key_type
from ddsi.xtypes.topic_type import complete

XCDR1, XCDR2 = DataRepresentationId.XCDR1, DataRepresentationId.XCDR2


class Color(enum.IntEnum):
    RED = 0
    GREEN = 1
    BLUE = 2


@idl.union
class Shade:
    color: Color = idl.switch
    grey: idl.uint8 = idl.case(Color.RED, Color.GREEN)
    names: idl.sequence[str] = idl.case(default=True)


@idl.union(extensibility=idl.FINAL)
class Maybe:
    there: Annotated[idl.boolean, idl.key] = idl.switch
    value: idl.int16 = idl.case(True)


@idl.bitset()
class Low:
    a: Annotated[idl.uint8, idl.bits(3)]
    b: Annotated[idl.boolean, idl.bits(1)]


@idl.bitset(typename="m::Bits")
class High(Low):
    c: Annotated[idl.int16, idl.bits(9, at=10)]


@idl.struct(extensibility=idl.FINAL)
class Everything:
    shade: Shade
    bits: High
    counts: idl.map[str, idl.int32]
    names: Annotated[idl.map[idl.int16, str], idl.bound(2)]
    wide: Annotated[idl.wstring, idl.bound(3)]
    maybe: Annotated[Maybe, idl.key]
    cached: Annotated[idl.int32, idl.non_serialized] = 7


SAMPLE = Everything(Shade(names=["x"]), High(5, True, -1), {"a": 1}, {-1: ""}, "h\u00e9", Maybe(value=3))


def test_a_member_selects_its_discriminator() -> None:
    assert Shade(grey=1).color is Color.RED
    assert Shade(names=[]).color is Color.BLUE
    assert Shade(color=Color.GREEN, grey=1).color is Color.GREEN
    assert idl.selected_member(Shade(names=[])) == "names"
    assert idl.selected_member(Maybe(there=False)) is None


def test_a_member_by_position_is_refused_with_what_to_write() -> None:
    make: Any = Shade
    with pytest.raises(TypeError, match=r"Shade takes its one member by name, as Shade\(grey=\.\.\.\)"):
        make(5)


def test_without_a_member_there_are_the_defaults() -> None:
    assert Shade() == Shade(grey=0)
    assert Shade(color=Color.BLUE) == Shade(names=[])
    assert Maybe() == Maybe(there=False)


def test_setting_a_member_selects_it_and_reading_another_fails() -> None:
    shade = Shade(grey=1)
    shade.names = ["a"]
    assert (shade.color, shade.names) == (Color.BLUE, ["a"])
    with pytest.raises(AttributeError, match=r"Shade\.grey: the discriminator selects names"):
        _ = shade.grey


def test_a_discriminator_changes_within_its_case_only() -> None:
    shade = Shade(grey=1)
    shade.color = Color.GREEN
    assert shade == Shade(color=Color.GREEN, grey=1) != Shade(grey=1)
    with pytest.raises(BadParameter, match="would select another member"):
        shade.color = Color.BLUE


def test_a_union_says_what_it_holds() -> None:
    assert repr(Shade(grey=1)) == "Shade(color=<Color.RED: 0>, grey=1)"
    assert repr(Maybe(value=1)) == "Maybe(value=1)"
    assert repr(Maybe()) == "Maybe(there=False)"


def test_a_union_has_slots_and_takes_its_members_only() -> None:
    with pytest.raises(AttributeError):
        Shade().other = 1  # type: ignore[attr-defined]
    with pytest.raises(TypeError, match="Shade has no member other; it has grey, names"):
        Shade(other=1)  # type: ignore[call-arg]
    with pytest.raises(TypeError, match="one member at a time"):
        Shade(grey=1, names=[])
    with pytest.raises(BadParameter, match=r"does not select grey"):
        Shade(color=Color.BLUE, grey=1)
    with pytest.raises(BadParameter, match=r"Shade\.color: 9 is no literal"):
        Shade(color=9)  # type: ignore[arg-type]


UNFIT_UNIONS = {
    "no switch": ({"a": idl.int32}, {"a": idl.case(1)}, "has one member that is idl.switch"),
    "no type": ({"d": idl.int32}, {"d": idl.switch, "a": idl.case(1)}, r"U\.a: it has no type"),
    "no case": ({"d": idl.int32, "a": idl.int32}, {"d": idl.switch}, r"U\.a: it says neither"),
    "float": ({"d": idl.float32}, {"d": idl.switch}, r"U\.d: float32 cannot be a discriminator"),
    "label": ({"d": idl.int8, "a": str}, {"d": idl.switch, "a": idl.case(200)}, r"U\.a: the label 200 is no int8"),
    "twice": (
        {"d": idl.int8, "a": str, "b": str},
        {"d": idl.switch, "a": idl.case(2), "b": idl.case(1, 2)},
        r"U\.b: the label 2 is also that of a",
    ),
    "two defaults": (
        {"d": idl.int8, "a": str, "b": str},
        {"d": idl.switch, "a": idl.case(default=True), "b": idl.case(default=True)},
        "one default case at most",
    ),
    "key": (
        {"d": idl.int8, "a": Annotated[str, idl.key]},
        {"d": idl.switch, "a": idl.case(2)},
        r"U\.a: idl\.key does not fit a case",
    ),
}


@pytest.mark.parametrize("name", UNFIT_UNIONS)
def test_unions_that_cannot_be_are_refused(name: str) -> None:
    annotations, namespace, reason = UNFIT_UNIONS[name]
    with pytest.raises(BadParameter, match=reason):
        idl.union(type("U", (), {**namespace, "__annotations__": annotations}))


@pytest.mark.parametrize("representation", [XCDR1, XCDR2])
def test_all_of_it_travels_but_what_is_not_serialized(representation: DataRepresentationId) -> None:
    octets = serialize(SAMPLE, representation=representation)
    received = deserialize(Everything, octets)
    assert received == SAMPLE
    assert received.cached == 7
    SAMPLE.cached = 8
    assert serialize(SAMPLE, representation=representation) == octets
    SAMPLE.cached = 7


def test_octets_of_maps_wide_strings_and_bitsets() -> None:
    """A map has a delimiter unless keys and values are primitive; a wide string counts octets; bits fill upwards."""

    @idl.struct(extensibility=idl.FINAL)
    class Some:
        bits: High
        primitive: idl.map[idl.int16, idl.int32]
        named: idl.map[str, idl.octet]
        wide: idl.wstring

    octets = serialize(Some(High(5, True, -1), {1: 2}, {"a": 3}, "hi"), representation=XCDR2)
    assert octets.hex(" ", 4) == (
        "00070000 0dfc0700 01000000 01000000 02000000 0b000000 01000000 02000000 61000300 04000000 68006900"
    )


UNFIT_VALUES: dict[str, tuple[dict[str, Any], str]] = {
    "union's member": ({"shade": Shade(grey=300)}, r"shade\.grey: 300 does not fit uint8"),
    "union": ({"shade": 3}, "shade: 3 is no Shade"),
    "bits": ({"bits": High(8, False, 0)}, r"bits\.a: 8 does not fit 3 bits \(0 to 7\)"),
    "map value": ({"counts": {"a": "b"}}, r"counts\['a'\]: 'b' is no integer"),
    "map key": ({"counts": {1: 1}}, r"counts, key 1: 1 is no string"),
    "map": ({"counts": [1]}, r"counts: \[1\] is no dict of string to int32"),
    "map bound": ({"names": {1: "", 2: "", 3: ""}}, "names: 3 entries exceed the bound of 2"),
    "wide bound": ({"wide": "long"}, "wide: a wide string of 4 characters exceeds its bound of 3"),
}


@pytest.mark.parametrize("name", UNFIT_VALUES)
def test_unfit_values_are_refused_by_path(name: str) -> None:
    changed, reason = UNFIT_VALUES[name]
    members = ("shade", "bits", "counts", "names", "wide", "maybe")
    sample = Everything(**{member: getattr(SAMPLE, member) for member in members} | changed)
    with pytest.raises(BadParameter, match=reason):
        serialize(sample)


def test_a_discriminator_that_is_key_is_the_unions_key() -> None:
    canonical = canonical_key_type(complete(struct_type(Everything)))
    assert canonical is not None
    assert key_hash(SAMPLE, XCDR2).hex() == "01" + 15 * "00"


def test_malformed_unions_maps_and_wide_strings_are_refused() -> None:
    @idl.struct(extensibility=idl.FINAL)
    class Some:
        color: Shade

    octets = serialize(Some(Shade(grey=1)), representation=XCDR2)
    with pytest.raises(MalformedSample, match=r"color\.color: 9 is no literal of Color"):
        deserialize(Some, octets[:8] + b"\x09" + octets[9:])

    @idl.struct(extensibility=idl.FINAL)
    class Counts:
        counts: idl.map[idl.int16, idl.int16]

    twice = serialize(Counts({1: 2, 3: 4}), representation=XCDR2)
    with pytest.raises(MalformedSample, match=r"counts\[1\]: the key 1 is there twice"):
        deserialize(Counts, twice[:12] + b"\x01" + twice[13:])
    with pytest.raises(MalformedSample, match="4294967295 entries of map<int16, int16> where 8 octets are left"):
        deserialize(Counts, twice[:4] + b"\xff\xff\xff\xff" + twice[8:])


def test_a_union_that_holds_itself_by_default_has_no_end() -> None:
    annotations = {"d": idl.int32, "again": "Endless"}
    namespace = {"d": idl.switch, "again": idl.case(default=True), "__annotations__": annotations}
    with pytest.raises(BadParameter, match=r"Endless\.again: Endless would contain itself without end"):
        idl.union(type("Endless", (), namespace))
