"""The cursors: one table of values and octets, read and written in both byte orders; and what they refuse."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ddsi.serialization import Reader, Writer
from ddsi.structure.errors import MalformedMessage
from ddsi.structure.guid import EntityId, Guid, GuidPrefix
from ddsi.structure.locator import Locator
from ddsi.structure.sequence_number import MAX_SEQUENCE_NUMBER, SEQUENCE_NUMBER_UNKNOWN, NumberSet

PREFIX = GuidPrefix(bytes(range(1, 13)))
GUID = Guid.of(PREFIX, b"\x00\x00\x01\xc1")

# element, value, little-endian octets, big-endian octets
ELEMENTS: list[tuple[str, Any, str, str]] = [
    ("u8", 0xA5, "a5", "a5"),
    ("boolean", False, "00", "00"),
    ("boolean", True, "01", "01"),
    ("u16", 0x0102, "0201", "0102"),
    ("i16", -2, "feff", "fffe"),
    ("u32", 0x01020304, "04030201", "01020304"),
    ("i32", -2, "feffffff", "fffffffe"),
    ("u64", 0x0102030405060708, "0807060504030201", "0102030405060708"),
    ("sequence_number", 1, "00000000 01000000", "00000000 00000001"),
    ("sequence_number", 0x1_0000_0002, "01000000 02000000", "00000001 00000002"),
    ("sequence_number", MAX_SEQUENCE_NUMBER, "ffffff7f ffffffff", "7fffffff ffffffff"),
    ("sequence_number", SEQUENCE_NUMBER_UNKNOWN, "ffffffff 00000000", "ffffffff 00000000"),
    # Base 12, members 13 and 15: bit i is bit 31-i of the word.
    (
        "sequence_number_set",
        NumberSet.of(12, [13, 15]),
        "00000000 0c000000 04000000 00000050",
        "00000000 0000000c 00000004 50000000",
    ),
    ("sequence_number_set", NumberSet(1), "00000000 01000000 00000000", "00000000 00000001 00000000"),
    # 33 bits: the second word holds one.
    (
        "sequence_number_set",
        NumberSet.of(1, [1, 33]),
        "00000000 01000000 21000000 00000080 00000080",
        "00000000 00000001 00000021 80000000 80000000",
    ),
    ("fragment_number_set", NumberSet.of(2, [2, 3]), "02000000 02000000 000000c0", "00000002 00000002 c0000000"),
    ("ticks", 0, "00000000 00000000", "00000000 00000000"),
    ("ticks", 0x5F00000080000000, "0000005f 00000080", "5f000000 80000000"),
    ("ticks", 0xFFFFFFFF_FFFFFFFF, "ffffffff ffffffff", "ffffffff ffffffff"),
    ("duration", 0.0, "00000000 00000000", "00000000 00000000"),
    ("duration", 1.5, "01000000 00000080", "00000001 80000000"),
    ("duration", 0.1, "00000000 9a999919", "00000000 1999999a"),
    ("duration", math.inf, "ffffff7f ffffffff", "7fffffff ffffffff"),
    (
        "locator",
        Locator.udp_v4("127.0.0.1", 7410),
        "01000000 f21c0000 00000000 00000000 00000000 7f000001",
        "00000001 00001cf2 00000000 00000000 00000000 7f000001",
    ),
    ("locator", Locator(-1, 0, bytes(16)), "ffffffff 00000000" + "00" * 16, "ffffffff 00000000" + "00" * 16),
    ("guid", GUID, "0102030405060708090a0b0c 000001c1", "0102030405060708090a0b0c 000001c1"),
    ("guid_prefix", PREFIX, "0102030405060708090a0b0c", "0102030405060708090a0b0c"),
    ("entity_id", EntityId(b"\x00\x00\x03\xc2"), "000003c2", "000003c2"),
    ("string", "Square", "07000000 53717561726500", "00000007 53717561726500"),
    ("string", "", "01000000 00", "00000001 00"),
    ("string", "Größe", "08000000 4772c3b6c39f6500", "00000008 4772c3b6c39f6500"),
    ("octet_sequence", b"\x01\x02\x03", "03000000 010203", "00000003 010203"),
    ("octet_sequence", b"", "00000000", "00000000"),
]
ORDERS = [pytest.param(True, id="little"), pytest.param(False, id="big")]


@pytest.mark.parametrize("little_endian", ORDERS)
@pytest.mark.parametrize(("element", "value", "little", "big"), ELEMENTS)
def test_element_reads_and_writes_as_these_octets(
    element: str, value: object, little: str, big: str, *, little_endian: bool
) -> None:
    octets = bytes.fromhex(little if little_endian else big)
    reader = Reader(octets, little_endian=little_endian)
    assert getattr(reader, element)() == value
    assert reader.remaining == 0
    writer = Writer(little_endian=little_endian)
    getattr(writer, element)(value)
    assert writer.getvalue() == octets


@pytest.mark.parametrize("little_endian", ORDERS)
@pytest.mark.parametrize(("element", "value", "little", "big"), ELEMENTS)
def test_element_that_is_cut_short_is_malformed(
    element: str, value: object, little: str, big: str, *, little_endian: bool
) -> None:
    octets = bytes.fromhex(little if little_endian else big)
    for length in range(len(octets)):
        with pytest.raises(MalformedMessage):
            getattr(Reader(octets[:length], little_endian=little_endian), element)()
        # The same when the octets are there, but beyond the end that the reader was given.
        with pytest.raises(MalformedMessage):
            getattr(Reader(octets, little_endian=little_endian, end=length), element)()


REFUSED: list[tuple[str, str]] = [
    ("boolean", "02"),
    ("string", "03000000 414243"),  # no NUL
    ("string", "03000000 ff4100"),  # not UTF-8
    ("string", "ffffffff 414200"),  # longer than what is there
    ("octet_sequence", "04000000 010203"),
    ("sequence_number_set", "00000000 01000000 01010000" + "00" * 36),  # 257 bits
    ("fragment_number_set", "01000000 ffffffff" + "00" * 36),
]


@pytest.mark.parametrize(("element", "octets"), REFUSED)
def test_value_that_no_sender_may_write_is_malformed(element: str, octets: str) -> None:
    with pytest.raises(MalformedMessage):
        getattr(Reader(bytes.fromhex(octets), little_endian=True), element)()


def test_negative_duration_is_malformed_in_both_orders() -> None:
    for little_endian, octets in ((True, "ffffffff00000000"), (False, "ffffffff00000000")):
        with pytest.raises(MalformedMessage, match="-1 seconds"):
            Reader(bytes.fromhex(octets), little_endian=little_endian).duration()


def test_infinite_duration_is_known_by_its_seconds() -> None:
    """OpenDDS fills the fraction with 7fffffff."""
    assert Reader(bytes.fromhex("ffffff7fffffff7f"), little_endian=True).duration() == math.inf


def test_string_of_length_zero_is_empty() -> None:
    assert Reader(bytes(4), little_endian=True).string() == ""


def test_bits_beyond_num_bits_are_ignored() -> None:
    octets = bytes.fromhex("00000000 0c000000 02000000 ffffffff")
    assert Reader(octets, little_endian=True).sequence_number_set() == NumberSet(12, 2, 0b11)


def test_full_set_of_256_bits() -> None:
    numbers = NumberSet.of(5, range(5, 261))
    writer = Writer(little_endian=True)
    writer.sequence_number_set(numbers)
    assert writer.getvalue() == bytes.fromhex("00000000 05000000 00010000") + b"\xff" * 32
    assert Reader(writer.getvalue(), little_endian=True).sequence_number_set() == numbers


def test_alignment_counts_from_start_and_position_from_the_octets() -> None:
    octets = b"\xee" * 3 + b"\x01\xee\xee\xee" + b"\x02\x00\x00\x00"
    reader = Reader(octets, little_endian=True, start=3)
    assert reader.u8() == 1
    reader.align(4)
    assert reader.position == 7
    reader.align(4)
    assert (reader.u32(), reader.position, reader.remaining) == (2, 11, 0)


def test_writer_pads_strings_and_sequences_to_four() -> None:
    writer = Writer(little_endian=True)
    writer.string("a")
    writer.octet_sequence(b"\x07")
    writer.align(4)
    writer.skip(1)
    assert writer.getvalue() == bytes.fromhex("02000000 6100 0000 01000000 07000000 00")


def test_octets_are_views_not_copies() -> None:
    datagram = bytearray(b"abcdef")
    view = Reader(datagram, little_endian=True, start=2).octets(3)
    datagram[2] = ord("X")
    assert bytes(view) == b"Xde"


@pytest.mark.parametrize(("start", "end"), [(-1, 2), (3, 2), (0, 5), (5, None)])
def test_bounds_outside_of_the_octets_are_malformed(start: int, end: int | None) -> None:
    with pytest.raises(MalformedMessage):
        Reader(bytes(4), little_endian=True, start=start, end=end)


@pytest.mark.parametrize("move", [lambda reader: reader.skip(-1), lambda reader: reader.octets(-4)])
def test_cursor_never_moves_backwards(move: Callable[[Reader], object]) -> None:
    reader = Reader(bytes(8), little_endian=True, start=4)
    with pytest.raises(MalformedMessage):
        move(reader)


def test_sequence_length_is_bounded() -> None:
    assert Reader(bytes.fromhex("05000000"), little_endian=True).sequence_length(most=5) == 5
    with pytest.raises(MalformedMessage, match="6 elements"):
        Reader(bytes.fromhex("06000000"), little_endian=True).sequence_length(most=5)


def test_error_says_where() -> None:
    reader = Reader(bytes(6), little_endian=True)
    reader.u32()
    with pytest.raises(MalformedMessage) as caught:
        reader.u32()
    assert caught.value.offset == 4


METHODS = sorted({element for element, *_ in ELEMENTS})


@given(st.binary(max_size=80), st.booleans(), st.lists(st.sampled_from(METHODS), max_size=12))
def test_any_octets_read_or_are_malformed(octets: bytes, little_endian: bool, elements: list[str]) -> None:
    reader = Reader(octets, little_endian=little_endian)
    try:
        for element in elements:
            getattr(reader, element)()
    except MalformedMessage:
        pass
    assert 0 <= reader.position <= len(octets)


@given(
    st.integers(1, MAX_SEQUENCE_NUMBER - 256),
    st.lists(st.integers(0, 255), max_size=40),
    st.booleans(),
)
def test_number_sets_round_trip(base: int, bits: list[int], little_endian: bool) -> None:
    numbers = NumberSet.of(base, sorted({base + bit for bit in bits}))
    writer = Writer(little_endian=little_endian)
    writer.sequence_number_set(numbers)
    assert Reader(writer.getvalue(), little_endian=little_endian).sequence_number_set() == numbers


@given(st.text(), st.booleans())
def test_strings_round_trip(text: str, little_endian: bool) -> None:
    writer = Writer(little_endian=little_endian)
    writer.u8(1)
    writer.string(text)
    reader = Reader(writer.getvalue(), little_endian=little_endian)
    reader.u8()
    assert reader.string() == text


@given(st.floats(0, 2**31 - 2), st.booleans())
def test_durations_round_trip_to_the_nanosecond(seconds: float, little_endian: bool) -> None:
    writer = Writer(little_endian=little_endian)
    writer.duration(seconds)
    assert Reader(writer.getvalue(), little_endian=little_endian).duration() == pytest.approx(seconds, abs=1e-9)
