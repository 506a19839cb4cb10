"""The message header: its octets, and what is no RTPS message."""

from __future__ import annotations

import pytest

from ddsi.messages.header import HEADER_LENGTH, Header
from ddsi.structure.errors import MalformedMessage
from ddsi.structure.guid import GuidPrefix

OCTETS = bytes.fromhex(
    "52545053"  # "RTPS"
    "0204 0110"  # version 2.4, vendor
    "0110 0102030405060708090a"  # guidPrefix
)
HEADER = Header((2, 4), b"\x01\x10", GuidPrefix(bytes.fromhex("01100102030405060708090a")))


def test_header_reads_and_writes_as_these_octets() -> None:
    assert len(OCTETS) == HEADER_LENGTH
    assert HEADER.encode() == OCTETS
    assert Header.decode(OCTETS) == HEADER
    assert Header.decode(memoryview(OCTETS + b"more")) == HEADER


@pytest.mark.parametrize("length", range(HEADER_LENGTH))
def test_datagram_with_less_than_a_header_is_malformed(length: int) -> None:
    with pytest.raises(MalformedMessage):
        Header.decode(OCTETS[:length])


def test_higher_minor_version_is_understood() -> None:
    assert Header.decode(OCTETS[:5] + b"\x63" + OCTETS[6:]).protocol_version == (2, 99)


@pytest.mark.parametrize(
    "octets", [b"RTPX" + OCTETS[4:], OCTETS[:4] + b"\x01" + OCTETS[5:], OCTETS[:4] + b"\x03" + OCTETS[5:]]
)
def test_other_protocol_or_major_version_is_malformed(octets: bytes) -> None:
    with pytest.raises(MalformedMessage):
        Header.decode(octets)
