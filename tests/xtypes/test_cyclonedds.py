"""Random samples beside cyclonedds-python in the same process: the same octets, and each reads the other's."""

from __future__ import annotations

from typing import Annotated, Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ddsi.structure.qos_policies import DataRepresentationId
from ddsi.xtypes import deserialize, idl, serialize

from ..peers import peer_module

peers = peer_module("tests.xtypes.cyclone_types", "cyclonedds-python is not installed")

pytestmark = pytest.mark.peers


@idl.struct(typename="ShapeType")
class Shape:
    color: Annotated[str, idl.key, idl.bound(128)]
    x: idl.int32
    y: idl.int32
    shapesize: idl.int32
    additional_payload_size: idl.sequence[idl.uint8] = b""


@idl.struct(typename="Point", extensibility=idl.FINAL)
class Point:
    id: idl.octet
    x: idl.float64
    y: idl.float32


@idl.struct(typename="Message", extensibility=idl.MUTABLE)
class Message:
    id: Annotated[idl.int64, idl.key]
    path: idl.sequence[Point]
    names: idl.sequence[str]
    values: idl.sequence[idl.float64]
    corners: Annotated[idl.sequence[Point], idl.array(2)]
    note: str | None


COMPILED: Any = idl.loads("""
    @final struct Point { octet id; double x; float y; };
    @appendable union Choice switch (short) {
      case 1: long long number;
      case 2: case -3: sequence<string> texts;
      default: Point point;
    };
    @appendable struct Choices { octet before; Choice choice; sequence<Choice> more; double after; };
""")

INT32 = st.integers(-(2**31), 2**31 - 1)
TEXT = st.text(st.characters(exclude_characters="\0", exclude_categories=["Cs"]), max_size=32)
FLOAT32 = st.floats(width=32, allow_nan=False)
POINTS = st.builds(Point, st.integers(0, 255), st.floats(allow_nan=False), FLOAT32)

SHAPES = st.builds(Shape, TEXT, INT32, INT32, INT32, st.binary(max_size=9))
MESSAGES = st.builds(
    Message,
    st.integers(-(2**63), 2**63 - 1),
    st.lists(POINTS, max_size=3),
    st.lists(TEXT, max_size=3),
    st.lists(st.floats(allow_nan=False), max_size=3),
    st.lists(POINTS, min_size=2, max_size=2),
    st.none() | TEXT,
)

FORMS = [(version, byteorder) for version in ("XCDR1", "XCDR2") for byteorder in ("little", "big")]


@pytest.mark.parametrize(("version", "byteorder"), FORMS)
@settings(max_examples=100)
@given(sample=SHAPES)
def test_shapes_are_the_same_octets(version: str, byteorder: Any, sample: Shape) -> None:
    peer = peers.PeerShape(sample.color, sample.x, sample.y, sample.shapesize, list(sample.additional_payload_size))
    agree(sample, peer, version, byteorder)


@pytest.mark.parametrize(("version", "byteorder"), FORMS)
@settings(max_examples=60)
@given(sample=MESSAGES)
def test_mutable_messages_are_the_same_octets(version: str, byteorder: Any, sample: Message) -> None:
    peer = peers.PeerMessage(
        sample.id,
        [peer_point(point) for point in sample.path],
        list(sample.names),
        list(sample.values),
        [peer_point(point) for point in sample.corners],
        sample.note,
    )
    agree(sample, peer, version, byteorder)


INT64 = st.integers(-(2**63), 2**63 - 1)
COMPILED_POINTS = st.builds(COMPILED.Point, st.integers(0, 255), st.floats(allow_nan=False), FLOAT32)
CHOICES = (
    st.builds(COMPILED.Choice, number=INT64)
    | st.builds(COMPILED.Choice, discriminator=st.sampled_from((2, -3)), texts=st.lists(TEXT, max_size=3))
    | st.builds(COMPILED.Choice, discriminator=st.integers(3, 2**15 - 1), point=COMPILED_POINTS)
)
SAMPLES_OF_CHOICES = st.builds(
    COMPILED.Choices, st.integers(0, 255), CHOICES, st.lists(CHOICES, max_size=3), st.floats(allow_nan=False)
)


@pytest.mark.parametrize("byteorder", ["little", "big"])
@settings(max_examples=60)
@given(sample=SAMPLES_OF_CHOICES)
def test_unions_compiled_from_idl_are_the_same_octets(byteorder: Any, sample: Any) -> None:
    peer = peers.PeerChoices(
        sample.before, peer_choice(sample.choice), [peer_choice(choice) for choice in sample.more], sample.after
    )
    agree(sample, peer, "XCDR2", byteorder)


def peer_choice(choice: Any) -> Any:
    selected = idl.selected_member(choice)
    value = getattr(choice, selected or "")
    value = peer_point(value) if selected == "point" else value
    return peers.PeerChoice(discriminator=choice.discriminator, value=value)


def peer_point(point: Any) -> Any:
    return peers.PeerPoint(point.id, point.x, point.y)


def agree(sample: Any, peer: Any, version: str, byteorder: Any) -> None:
    """The binding adds no padding behind the object, as ``serialize`` does not."""
    octets = serialize(sample, representation=DataRepresentationId[version], byteorder=byteorder)
    endianness = peers.Endianness.Little if byteorder == "little" else peers.Endianness.Big
    theirs = bytes(peer.__idl__.serialize(peer, use_version_2=version == "XCDR2", endianness=endianness))
    assert octets == theirs
    assert deserialize(type(sample), theirs) == sample
    assert peer.__idl__.deserialize(octets) == peer
