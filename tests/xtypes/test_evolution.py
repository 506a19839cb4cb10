"""Samples of a type that has grown, or has not grown yet: appendable at its end, mutable anywhere."""

from __future__ import annotations

import enum
import struct
from typing import Annotated

import pytest

from ddsi.structure.errors import MalformedSample
from ddsi.structure.qos_policies import DataRepresentationId
from ddsi.xtypes import deserialize, idl, serialize, type_support

XCDR1, XCDR2 = DataRepresentationId.XCDR1, DataRepresentationId.XCDR2
BOTH = pytest.mark.parametrize("representation", [XCDR1, XCDR2])


class Level(enum.IntEnum):
    MIDDLE = 5
    HIGH = 6


@idl.struct(extensibility=idl.FINAL)
class Point:
    x: idl.int32
    y: idl.int32 = 9


@idl.struct(typename="A")
class Short:
    id: Annotated[idl.int32, idl.key]
    flag: idl.octet


@idl.struct(typename="A")
class Long:
    id: Annotated[idl.int32, idl.key]
    flag: idl.octet
    after: idl.octet
    text: str
    level: Level
    numbers: idl.sequence[idl.float64]
    three: Annotated[idl.sequence[idl.int16], idl.array(3)]
    names: Annotated[idl.sequence[idl.sequence[str]], idl.array(1, 2)]
    point: Point
    maybe: idl.int32 | None
    given: idl.int32 = 77


LONG = Long(3, 1, 2, "text", Level.HIGH, [1.5], [1, 2, 3], [["a", "b"]], Point(1, 2), 4, 5)


@BOTH
def test_an_appendable_sample_may_be_shorter_than_its_readers_type(representation: DataRepresentationId) -> None:
    octets = type_support(Short).serializer(representation)(Short(3, 1))
    expected = Long(3, 1, 0, "", Level.MIDDLE, [], [0, 0, 0], [["", ""]], Point(0, 9), None, 77)
    assert deserialize(Long, octets) == expected
    assert type_support(Long).key_from_payload(octets) == type_support(Long).key(expected)


@BOTH
def test_an_appendable_sample_may_be_longer_than_its_readers_type(representation: DataRepresentationId) -> None:
    assert deserialize(Short, type_support(Long).serializer(representation)(LONG)) == Short(3, 1)


def test_padding_that_the_header_counts_is_no_member() -> None:
    """XCDR1, 5 octets and 3 of padding: with the count the octet behind is not there; as zero it would be anyway."""
    octets = bytes.fromhex("00010003 03000000 01 ffffff")
    assert deserialize(Long, octets).after == 0
    assert deserialize(Long, bytes.fromhex("00010000 03000000 01")).after == 0
    assert deserialize(Long, bytes.fromhex("00010000 03000000 01 02")).after == 2


def test_padding_that_nobody_counts_is_taken_for_the_end() -> None:
    """Where the member would begin behind the padding, there is nothing."""

    @idl.struct
    class Longer:
        id: idl.int32
        flag: idl.octet
        count: idl.int32

    assert deserialize(Longer, bytes.fromhex("00010000 03000000 01 000000")) == Longer(3, 1, 0)


def test_a_nested_appendable_type_evolves_in_xcdr2() -> None:
    @idl.struct
    class HoldsShort:
        inner: Short
        many: idl.sequence[Short]
        tail: idl.int32

    @idl.struct
    class HoldsLong:
        inner: Long
        many: idl.sequence[Long]
        tail: idl.int32

    assert type_support(HoldsShort).representations == (XCDR2, XCDR1)
    longer = deserialize(HoldsLong, serialize(HoldsShort(Short(1, 2), [Short(3, 4), Short(5, 6)], 7)))
    assert (longer.inner.id, longer.inner.given, longer.tail) == (1, 77, 7)
    assert [item.id for item in longer.many] == [3, 5]
    shorter = deserialize(HoldsShort, serialize(HoldsLong(LONG, [LONG, LONG], 7)))
    assert shorter == HoldsShort(Short(3, 1), [Short(3, 1)] * 2, 7)


def test_a_final_type_does_not_grow() -> None:
    @idl.struct(extensibility=idl.FINAL)
    class Shorter:
        x: idl.int32

    for representation in (XCDR1, XCDR2):
        with pytest.raises(MalformedSample, match=r"Point: y: 4 octets are needed, 0 are left \(octet 8\)"):
            deserialize(Point, serialize(Shorter(1), representation=representation))
        with pytest.raises(MalformedSample, match=r"Shorter: 4 octets too many \(octet 8\)"):
            deserialize(Shorter, serialize(Point(1), representation=representation))


# --- mutable -----------------------------------------------------------------------------------------------


@idl.struct(typename="M", extensibility=idl.MUTABLE)
class Old:
    id: Annotated[idl.int32, idl.id(1), idl.key]
    name: Annotated[str, idl.id(2)] = "unnamed"


@idl.struct(typename="M", extensibility=idl.MUTABLE)
class New:
    extra: Annotated[idl.sequence[idl.float64], idl.id(5)]
    more: Annotated[Long, idl.id(6)]
    level: Annotated[Level, idl.id(9)]
    name: Annotated[str, idl.id(2)]
    id: Annotated[idl.int32, idl.id(1), idl.key]


@idl.struct(typename="M", extensibility=idl.MUTABLE)
class Strict:
    id: Annotated[idl.int32, idl.id(1), idl.key]
    needed: Annotated[idl.int32, idl.id(7), idl.must_understand]


@BOTH
@pytest.mark.parametrize("little_endian", [True, False])
def test_mutable_members_come_in_any_order_and_number(
    representation: DataRepresentationId, little_endian: bool
) -> None:
    new = New([1.5, 2.5], LONG, Level.HIGH, "name", 3)
    octets = type_support(New).serializer(representation, little_endian)(new)
    assert deserialize(Old, octets) == Old(3, "name")
    assert type_support(Old).key_from_payload(octets) == struct.pack(">i", 3)
    octets = type_support(Old).serializer(representation, little_endian)(Old(3, "name"))
    read = deserialize(New, octets)
    assert (read.id, read.name, read.level, list(read.extra), read.more.given) == (3, "name", Level.MIDDLE, [], 77)


@BOTH
def test_a_missing_member_has_its_default_unless_it_is_key(representation: DataRepresentationId) -> None:
    octets = serialize(Strict(3, 4), representation=representation)
    without_must_understand = octets.replace(b"\7\0\0\x40", b"\7\0\0\0").replace(b"\7\0\0\xa0", b"\7\0\0\x20")
    assert without_must_understand != octets
    assert deserialize(Old, without_must_understand) == Old(3, "unnamed")
    with pytest.raises(MalformedSample, match="member id 0x7 is unknown here, and must be understood"):
        deserialize(Old, octets)
    keyless = octets.replace(b"\1\0\0\0\4\0\0\0\3", b"\3\0\0\0\4\0\0\0\3").replace(b"\1\0\0\x20", b"\3\0\0\x20")
    with pytest.raises(MalformedSample, match="the key member id is missing"):
        deserialize(Strict, keyless)


@BOTH
def test_a_member_given_twice_is_malformed(representation: DataRepresentationId) -> None:
    @idl.struct(extensibility=idl.MUTABLE)
    class Twice:
        one: Annotated[idl.int32, idl.id(1)]
        other: Annotated[idl.int32, idl.id(2)]

    octets = serialize(Twice(7, 8), representation=representation)
    doubled = octets.replace(b"\2\0\0\0\4\0\0\0\x08", b"\1\0\0\0\4\0\0\0\x08").replace(b"\2\0\0\x20", b"\1\0\0\x20")
    with pytest.raises(MalformedSample, match="member one is there twice"):
        deserialize(Twice, doubled)


SHORT_HEADERS = bytes.fromhex(
    "00030000"
    "0200 0800 02000000 6e000000"  # name "n", short header
    "033f 0400 ffffffff"  # PID_IGNORE
    "0100 0400 03000000"  # id
    "023f 0000"  # PID_LIST_END without its must-understand flag
)


def test_xcdr1_short_headers_are_read() -> None:
    assert deserialize(Old, SHORT_HEADERS) == Old(3, "n")
    assert deserialize(Old, SHORT_HEADERS.replace(b"\1\0\4\0", b"\1\x40\4\0")) == Old(3, "n")


def test_xcdr1_a_list_without_end_is_malformed() -> None:
    with pytest.raises(MalformedSample, match="4 octets are needed"):
        deserialize(Old, SHORT_HEADERS[:-4])


@pytest.mark.parametrize(
    "members",
    [
        "01000020 03000000 02000050 02000000 6e00",  # what this program writes: length codes 2 and 5
        "02000040 06000000 02000000 6e000000 01000040 04000000 03000000",  # length code 4 for all
        "010000a0 03000000 020000d0 02000000 6e00",  # must understand, as some write for keys
        "09000070 01000000 ffffffffffffffff 01000020 03000000 02000050 02000000 6e00",  # unknown, length code 7
        "09000060 02000000 ffffffffffffffff 01000020 03000000 02000050 02000000 6e00",  # 6
        "09000000 ff000000 01000020 03000000 02000050 02000000 6e00",  # 0
        "09000030 ffffffffffffffff 01000020 03000000 02000050 02000000 6e00",  # 3
    ],
)
def test_xcdr2_every_length_code_is_read(members: str) -> None:
    body = bytes.fromhex(members)
    octets = bytes.fromhex("000b0000") + struct.pack("<I", len(body)) + body
    assert deserialize(Old, octets) == Old(3, "n")


def test_optional_members_with_the_short_header_of_xcdr1() -> None:
    """Fast CDR writes the short form; absent is a length of 0."""

    @idl.struct(extensibility=idl.FINAL)
    class Maybe:
        a: idl.octet
        b: idl.float64 | None
        c: idl.float64 | None
        d: idl.int32

    octets = bytes.fromhex("00010000 01000000 0100 0800 000000000000f83f 0200 0000 05000000")
    assert deserialize(Maybe, octets) == Maybe(1, 1.5, None, 5)
    wrong = octets.replace(bytes.fromhex("02000000"), bytes.fromhex("03000000"))
    with pytest.raises(MalformedSample, match="Maybe: c: the header of member id 3 where 2 is due"):
        deserialize(Maybe, wrong)
