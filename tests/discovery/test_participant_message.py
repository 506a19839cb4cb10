"""ParticipantMessageData: its octets in both byte orders, and what is not one."""

from __future__ import annotations

import contextlib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ddsi.discovery.participant_message import (
    AUTOMATIC_LIVELINESS_UPDATE,
    MANUAL_LIVELINESS_UPDATE,
    ParticipantMessageData,
)
from ddsi.structure.errors import MalformedMessage
from ddsi.structure.guid import GuidPrefix

PREFIX = GuidPrefix(bytes(range(1, 13)))
# data, little-endian octets, big-endian octets
MESSAGES = [
    (
        ParticipantMessageData(PREFIX, AUTOMATIC_LIVELINESS_UPDATE),
        "00010000 0102030405060708090a0b0c 00000001 00000000",
        "00000000 0102030405060708090a0b0c 00000001 00000000",
    ),
    (
        ParticipantMessageData(PREFIX, MANUAL_LIVELINESS_UPDATE, b"\x00"),
        "00010000 0102030405060708090a0b0c 00000002 01000000 00000000",
        "00000000 0102030405060708090a0b0c 00000002 00000001 00000000",
    ),
    (
        ParticipantMessageData(PREFIX, b"\x80\x00\x00\x00", b"abcd"),
        "00010000 0102030405060708090a0b0c 80000000 04000000 61626364",
        "00000000 0102030405060708090a0b0c 80000000 00000004 61626364",
    ),
]


@pytest.mark.parametrize(("data", "little", "big"), MESSAGES)
def test_message_reads_and_writes_as_these_octets(data: ParticipantMessageData, little: str, big: str) -> None:
    assert data.encode() == bytes.fromhex(little)
    assert ParticipantMessageData.decode(bytes.fromhex(little)) == data
    assert ParticipantMessageData.decode(bytes.fromhex(big)) == data
    assert data.key == bytes.fromhex(little)[4:20]


@pytest.mark.parametrize(("data", "little", "big"), MESSAGES)
def test_message_that_is_cut_short_is_malformed(data: ParticipantMessageData, little: str, big: str) -> None:
    for octets in (bytes.fromhex(little), bytes.fromhex(big)):
        for length in range(24 + len(data.data)):
            with pytest.raises(MalformedMessage):
                ParticipantMessageData.decode(octets[:length])


@pytest.mark.parametrize(
    ("octets", "data"),
    [
        ("00030000 c7bf8262d0e5b0d348fe97bb 00000001 00000000 00000000", b""),
        ("00020000 c7bf8262d0e5b0d348fe97bb 00000001 00000001 61000000", b"a"),
    ],
)
def test_what_fast_dds_calls_a_parameter_list_is_read_as_what_it_is(octets: str, data: bytes) -> None:
    """The first is what Fast DDS 2.9.1 sends; the second its mirror."""
    read = ParticipantMessageData.decode(bytes.fromhex(octets))
    prefix = GuidPrefix(bytes.fromhex("c7bf8262d0e5b0d348fe97bb"))
    assert read == ParticipantMessageData(prefix, AUTOMATIC_LIVELINESS_UPDATE, data)


@pytest.mark.parametrize("identifier", ["0004", "0007", "0009", "000b", "00ff"])
def test_other_encodings_are_malformed(identifier: str) -> None:
    octets = bytes.fromhex(identifier) + MESSAGES[0][0].encode()[2:]
    with pytest.raises(MalformedMessage):
        ParticipantMessageData.decode(octets)


@given(st.binary(max_size=40))
def test_any_octets_are_a_message_or_malformed(octets: bytes) -> None:
    with contextlib.suppress(MalformedMessage):
        ParticipantMessageData.decode(octets)
