"""Samples as JSON and back, and what somebody types for one."""

from __future__ import annotations

import json
import struct
from typing import Any

import pytest
from hypothesis import given, settings

from ddsi import idl
from ddsi.cli.typed_values import typed_form
from ddsi.cli.value_forms import form_of, value_of
from ddsi.structure.errors import BadParameter
from ddsi.xtypes import serialize
from ddsi.xtypes.model import FLOAT32
from ddsi.xtypes.resolution import named_type
from tests.xtypes.random_types import samples

IDL = """
enum Colour { RED, GREEN, None };
bitmask Flags { low, high };
bitset Fields { bitfield<3, uint8> a; bitfield<5, int8> b; };
struct Point { double x; double y; };
union Choice switch (Colour) { case RED: long number; case GREEN: string text; };
struct Sample {
  string name; char letter; boolean on; long long big; sequence<Point> points; long grid[2][3];
  sequence<octet> raw; map<string, long> tags; map<long, Point> places; Colour colour; Flags flags; Fields fields;
  Choice choice; @optional Point origin; sequence<string> words; long class; sequence<boolean> bits;
};
"""
TYPES: Any = idl.loads(IDL)
SAMPLE = named_type(TYPES.Sample)


def typed(*words: str) -> Any:
    return value_of(SAMPLE, typed_form(words))


@settings(max_examples=60)
@given(samples())
def test_what_is_printed_is_what_is_taken(sample: Any) -> None:
    type_ = named_type(type(sample))
    form = json.loads(json.dumps(form_of(type_, sample)))
    found = value_of(type_, form)
    assert serialize(found) == serialize(sample)


def test_everything_that_can_be_typed() -> None:
    sample = typed(
        "name=some text", "letter=x", "on=true", "big=-0x10", "points[1].y=2.5", "grid[1][2]=7", "raw=0x00ff",
        "tags[home]=3", "places[-4].x=1", "colour=None", "flags=low|high", "fields.b=-3", "choice.text=a=b",
        "origin.x=nan", "words=[\"a\",\"b\"]", "class=5", "bits=[true,false]",
    )  # fmt: skip
    assert json.dumps(form_of(SAMPLE, sample)) == json.dumps(
        {
            "name": "some text", "letter": "x", "on": True, "big": -16,
            "points": [{"x": 0.0, "y": 0.0}, {"x": 0.0, "y": 2.5}], "grid": [[0, 0, 0], [0, 0, 7]], "raw": "00ff",
            "tags": {"home": 3}, "places": {"-4": {"x": 1.0, "y": 0.0}}, "colour": "None_", "flags": "low|high",
            "fields": {"a": 0, "b": -3}, "choice": {"discriminator": "GREEN", "text": "a=b"},
            "origin": {"x": "nan", "y": 0.0}, "words": ["a", "b"], "class": 5, "bits": [True, False],
        }
    )  # fmt: skip


@pytest.mark.parametrize("text", ["0.1", "16777216.0", "-3.4028235e+38", "1.4013e-45", "0.33333334", "nan", "-inf"])
def test_a_float_is_as_short_as_it_can_be(text: str) -> None:
    held = struct.unpack("f", struct.pack("f", float(text)))[0]
    assert str(form_of(FLOAT32, held)) == text
    assert struct.pack("f", value_of(FLOAT32, form_of(FLOAT32, held))) == struct.pack("f", held)


def test_what_is_not_said_has_its_default() -> None:
    assert typed() == typed("name=", "origin=null", "points=[]")


def test_json_and_fields_together() -> None:
    sample = typed('{"points": [{"x": 1}], "choice": {"number": 4}}', "points[0].y=2", 'name="null"')
    assert sample.points == [TYPES.Point(1.0, 2.0)]
    assert (sample.choice.number, sample.name) == (4, "null")


def test_a_union_by_its_discriminator_alone() -> None:
    assert typed("choice.discriminator=GREEN").choice == TYPES.Choice(text="")
    assert typed('{"choice": {"discriminator": "None"}}').choice.discriminator == TYPES.Colour.None_


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        (["nam=x"], "there is no member 'nam' (is name meant?); there are name, letter,"),
        (["points[0].z=1"], "points[0]: there is no member 'z'; there are x, y"),
        (["points[0].x=far"], "points[0].x: 'far' is no float64"),
        (["big=1.5"], "big: '1.5' is no int64"),
        (["on=yes"], "on: 'yes' is no boolean: true or false"),
        (["colour=BLUE"], "colour: there is no literal of Colour 'BLUE'; there are RED, GREEN, None_"),
        (["flags=low|middle"], "flags: there is no flag of Flags 'middle'; there are low, high"),
        (["raw=xyz"], "raw: 'xyz' is not hexadecimal, as octets are"),
        (["grid[2][0]=1"], "grid[2]: the array has 2 elements"),
        (["grid[0]=[1]"], "grid[0]: 1 elements where the array has 3"),
        (["points=5"], "points: a list is wanted, not 5"),
        (["points=[5"], "points: '[5' is no JSON, as sequence<Point> needs it"),
        (["name=a", "name=b"], "name: it is given twice"),
        (["points=[]", "points[0].x=1"], "points[0].x: a part of it is given as a whole already"),
        (["choice.number=1", "choice.text=a"], "choice: Choice holds one member at a time, not number and text"),
        (["choice.other=1"], "choice: there is no member 'other'"),
        (["fields.c=1"], "fields: there is no member 'c'; there are a, b"),
        (["class=null"], "class_: null is for optional members"),
        (['{"name": null}'], "name: null is for optional members"),
        (['{"name": 5}'], "name: 5 is no string"),
        (['{"origin": []}'], "origin: Point is an object, as in {...}, not []"),
        (["name"], "'name' is neither field=value nor a JSON object"),
        (["{name: 1}"], "this is no JSON: Expecting property name"),
        (["points[99999].x=1"], "points[99999].x: an index is at most 65535"),
        (["points[0]x=1"], "'points[0]x' is no path of members"),
        (["[0]=1"], "'[0]' is no path of members"),
        (["=1"], "a member's name is wanted before the ="),
    ],
)
def test_what_cannot_be_meant_is_refused_with_the_members_path(words: list[str], reason: str) -> None:
    with pytest.raises(BadParameter) as caught:
        typed(*words)
    assert str(caught.value).startswith(reason)
