"""Where submessages begin and end: lengths of 0, lengths that lie, padding at the end."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ddsi.messages.raw_submessage import RawSubmessage, iterate_submessages, submessage_name
from ddsi.structure.errors import MalformedMessage


def walk(octets: str) -> list[tuple[int, int, bytes, int]]:
    found = iterate_submessages(bytes.fromhex(octets), start=0)
    return [(raw.kind, raw.flags, bytes(raw.body), raw.offset) for raw in found]


def test_length_has_the_byte_order_of_its_own_flags() -> None:
    assert walk("80 01 0400 61626364  80 00 0004 65666768") == [(0x80, 1, b"abcd", 0), (0x80, 0, b"efgh", 8)]


def test_raw_submessage_knows_its_octets_in_the_message() -> None:
    octets = bytes(20) + bytes.fromhex("80 01 0400 61626364  81 00 0000 65666768")
    first, second = iterate_submessages(octets)
    assert octets[first.offset : first.end] == bytes.fromhex("80 01 0400 61626364")
    assert (first.little_endian, second.little_endian) == (True, False)
    assert second.end == len(octets)


@pytest.mark.parametrize("kind", ["00", "06", "07", "15", "16", "30", "31", "80"])
def test_length_zero_reaches_to_the_end(kind: str) -> None:
    assert walk(f"{kind} 01 0000 6162636465666768") == [(int(kind, 16), 1, b"abcdefgh", 0)]


def test_empty_pad_and_info_ts_are_empty() -> None:
    """RTPS 2.5 §9.4.5.1.3: only these two may have no body, so that for them 0 means 0."""
    assert walk("01 01 0000  09 03 0000  80 01 0400 61626364") == [
        (0x01, 1, b"", 0),
        (0x09, 3, b"", 4),
        (0x80, 1, b"abcd", 8),
    ]


def test_last_submessage_may_have_any_length() -> None:
    assert walk("80 01 0300 616263") == [(0x80, 1, b"abc", 0)]
    assert walk("80 01 0300 616263 00") == [(0x80, 1, b"abc", 0)]


def test_length_that_leaves_the_next_unaligned_is_malformed() -> None:
    with pytest.raises(MalformedMessage, match="unaligned"):
        walk("80 01 0300 616263  80 01 0400 61626364")


def test_what_came_before_a_malformed_submessage_is_given_out() -> None:
    found = iterate_submessages(bytes.fromhex("01 01 0000  07 01 1c00 0000"), start=0)
    assert next(found) == RawSubmessage(0x01, 1, memoryview(b""), 0)
    with pytest.raises(MalformedMessage) as caught:
        next(found)
    assert (caught.value.element, caught.value.offset) == ("HEARTBEAT", 4)


@pytest.mark.parametrize("octets", ["", "80", "8001", "800104"])
def test_less_than_a_header_at_the_end_is_padding(octets: str) -> None:
    assert walk(octets) == []


def test_names() -> None:
    assert (submessage_name(0x15), submessage_name(0x80)) == ("DATA", "submessage 80")


@given(st.binary(max_size=200), st.integers(0, 20))
def test_any_octets_divide_into_submessages_or_are_malformed(octets: bytes, start: int) -> None:
    position = start
    try:
        for raw in iterate_submessages(octets, start=start):
            assert raw.offset == position
            assert raw.end <= len(octets)
            assert octets[raw.offset + 4 : raw.end] == raw.body
            position = raw.end
    except MalformedMessage:
        pass
