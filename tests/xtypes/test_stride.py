"""Sequences and arrays of structs of fixed size: read and written in one sweep, and the octets are the same."""

from __future__ import annotations

from typing import Annotated, Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ddsi.structure.errors import BadParameter, MalformedSample
from ddsi.structure.qos_policies import DataRepresentationId
from ddsi.xtypes import idl, serialize, type_support
from ddsi.xtypes.careful_reader import read_carefully
from ddsi.xtypes.definition import struct_type
from ddsi.xtypes.layout import ALIGNED, Encoding, Residue, encapsulations
from ddsi.xtypes.read_source import generate_reader
from ddsi.xtypes.stride import stride

from .random_types import SCALARS, Bits, Fields, Kind, Point, Small, Tiny

XCDR1, XCDR2 = DataRepresentationId.XCDR1, DataRepresentationId.XCDR2
FORMS = [
    Encoding(representation, little_endian) for representation in (XCDR1, XCDR2) for little_endian in (True, False)
]

FIXED = [
    *SCALARS,
    Kind(Small, st.sampled_from(Small)),
    Kind(Tiny, st.sampled_from(Tiny)),
    Kind(Bits, st.integers(0, 0xFFFF).map(Bits)),
    Kind(Fields, st.builds(Fields, st.integers(0, 7), st.integers(-4, 3), st.booleans())),
    Kind(Point, st.builds(Point, st.floats(allow_nan=False), st.integers(-9, 9), st.integers(0, 255))),
    Kind(Annotated[idl.sequence[idl.int16], idl.array(3)], st.lists(st.integers(-9, 9), min_size=3, max_size=3)),
    Kind(Annotated[idl.sequence[idl.octet], idl.array(130)], st.binary(min_size=130, max_size=130)),
]


def struct_of(kinds: list[Kind], extensibility: idl.Extensibility) -> Kind:
    annotations = {f"m{number}": kind.annotation for number, kind in enumerate(kinds)}
    class_: Any = idl.struct(extensibility=extensibility)(type("Fixed", (), {"__annotations__": annotations}))
    return Kind(class_, st.builds(class_, *[kind.values for kind in kinds]))


@idl.struct(extensibility=idl.FINAL)
class Tag:
    name: str
    number: idl.int16


@idl.struct
class Tail:
    """In XCDR2 its length is counted from where it begins, behind whatever was before it."""

    tags: idl.sequence[Tag]


@st.composite
def samples(draw: st.DrawFn) -> Any:
    """Something of any length, then a sequence or an array of structs of fixed size, then something that is aligned."""
    element = draw(
        st.builds(
            struct_of,
            st.lists(st.sampled_from(FIXED), min_size=1, max_size=5),
            st.sampled_from(list(idl.Extensibility)),
        )
    )
    count = draw(st.integers(0, 4))
    elements: Any = idl.sequence[element.annotation]  # type: ignore[name-defined]
    if count and draw(st.booleans()):
        elements = Annotated[elements, idl.array(count)]
    before = draw(st.sampled_from([str, idl.int8, idl.int32, idl.float64]))
    annotations: dict[str, Any] = {"before": before, "elements": elements, "behind": idl.float64, "tail": Tail}
    if draw(st.booleans()):
        del annotations["before"]
    extensibility = draw(st.sampled_from(list(idl.Extensibility)))
    class_: Any = idl.struct(extensibility=extensibility)(type("Holder", (), {"__annotations__": annotations}))
    members: dict[str, Any] = {
        "elements": draw(st.lists(element.values, min_size=count, max_size=count)),
        "behind": 1.5,
    }
    members["tail"] = Tail([Tag("a", 1)] * draw(st.integers(0, 2)))
    if "before" in annotations:
        members["before"] = "x" * draw(st.integers(0, 8)) if before is str else 1
    return class_(**members)


@settings(max_examples=150)
@given(samples())
def test_the_careful_reader_agrees(sample: Any) -> None:
    """The straight readers must not fail, as their caller would then read again carefully and hide it."""
    support = type_support(sample.__class__)
    for encoding in FORMS:
        octets = support.serializer(encoding.representation, encoding.little_endian)(sample)
        assert read_carefully(support.struct, octets) == sample
        assert encapsulations(support.extensibility)[octets[:2]] == encoding
        assert generate_reader(support.struct, encoding)[0](octets) == sample
        assert generate_reader(support.struct, encoding, view=True)[0](memoryview(octets)) == sample


@settings(max_examples=60)
@given(samples(), st.data())
def test_what_is_cut_off_or_changed_is_refused_or_read_alike(sample: Any, data: st.DataObject) -> None:
    support = type_support(sample.__class__)
    for encoding in FORMS:
        octets = bytearray(support.serializer(encoding.representation, encoding.little_endian)(sample))
        index = data.draw(st.integers(4, len(octets)))
        changed = bytes(octets[:index] + data.draw(st.sampled_from([b"", b"\xff", b"\0\0\0\1"])) + octets[index + 1 :])
        try:
            read = generate_reader(support.struct, encoding)[0](changed)
        except Exception:
            read = None
        if read is not None:
            assert repr(read_carefully(support.struct, changed)) == repr(read)  # equal, NaN included


@idl.struct(extensibility=idl.FINAL)
class Position:
    x: idl.float64
    y: idl.float64


@idl.struct(extensibility=idl.FINAL)
class Marked:
    at: Position
    mark: idl.int8


@idl.struct(extensibility=idl.FINAL)
class Numbered:
    number: idl.int32
    at: Position


@idl.struct
class Route:
    name: str
    positions: idl.sequence[Position]


def test_where_elements_lie() -> None:
    encoding = Encoding(XCDR1, little_endian=True)
    found = stride(struct_type(Marked), Residue(4, 0), encoding)
    assert found is not None
    assert (found.alignment, found.size, found.gap, found.octets) == (8, 17, 7, 24)
    found = stride(struct_type(Marked), Residue(4, 0), Encoding(XCDR2, little_endian=True))
    assert found is not None
    assert (found.alignment, found.size, found.gap) == (4, 17, 3)
    assert stride(struct_type(Numbered), Residue(4, 0), encoding) is None  # 20 or 24 octets, as it falls
    found = stride(struct_type(Numbered), ALIGNED, encoding)
    assert found is not None
    assert found.octets == 24


def test_the_loops_neither_align_nor_look_for_their_place() -> None:
    support = type_support(Route)
    octets = support.serializer(XCDR1)(Route("a", [Position(1, 2)]))
    support.deserialize(octets)
    assert "        parts.append(pack_2(v1.x, v1.y))\n    return" in support.source
    assert 'iter_unpack_0 = Struct("<dd").iter_unpack' in support.source


def test_a_value_that_does_not_fit_is_named() -> None:
    with pytest.raises(BadParameter, match=r"positions\[2\]\.y: 'here' is no number"):
        serialize(Route("a", [Position(1, 2), Position(3, 4), Position(5, "here")]))  # type: ignore[arg-type]
    with pytest.raises(BadParameter, match=r"positions\[1\]: None is no Position"):
        serialize(Route("a", [Position(1, 2), None]))  # type: ignore[list-item]


@pytest.mark.parametrize("count", [3, 1000, 0xFFFF_FFFF])
def test_a_count_beyond_what_is_there_is_malformed(count: int) -> None:
    support = type_support(Route)
    octets = bytearray(support.serializer(XCDR1)(Route("", [Position(1, 2), Position(3, 4)])))
    octets[12:16] = count.to_bytes(4, "little")
    with pytest.raises(MalformedSample, match=r"positions"):
        support.deserialize(bytes(octets))
