"""The encapsulation header: every identifier, its padding bits, and what is refused."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ddsi.serialization import Encapsulation, decode_encapsulation, encode_encapsulation
from ddsi.structure.errors import MalformedMessage

# identifier, octets, little endian?, XCDR version
HEADERS = [
    (Encapsulation.CDR_BE, "00000000", False, 1),
    (Encapsulation.CDR_LE, "00010000", True, 1),
    (Encapsulation.PL_CDR_BE, "00020000", False, 1),
    (Encapsulation.PL_CDR_LE, "00030000", True, 1),
    (Encapsulation.CDR2_BE, "00060000", False, 2),
    (Encapsulation.CDR2_LE, "00070000", True, 2),
    (Encapsulation.D_CDR2_BE, "00080000", False, 2),
    (Encapsulation.D_CDR2_LE, "00090000", True, 2),
    (Encapsulation.PL_CDR2_BE, "000a0000", False, 2),
    (Encapsulation.PL_CDR2_LE, "000b0000", True, 2),
]


@pytest.mark.parametrize(("encapsulation", "octets", "little_endian", "version"), HEADERS)
def test_header_reads_and_writes_as_these_octets(
    encapsulation: Encapsulation, octets: str, *, little_endian: bool, version: int
) -> None:
    assert encode_encapsulation(encapsulation) == bytes.fromhex(octets)
    header = decode_encapsulation(bytes.fromhex(octets))
    assert (header.encapsulation, header.options, header.padding) == (encapsulation, 0, 0)
    assert (encapsulation.little_endian, encapsulation.xcdr_version) == (little_endian, version)


def test_table_has_every_identifier() -> None:
    assert [row[0] for row in HEADERS] == list(Encapsulation)


@pytest.mark.parametrize("padding", range(4))
def test_padding_is_the_low_two_bits_of_the_options(padding: int) -> None:
    octets = encode_encapsulation(Encapsulation.CDR2_LE, padding=padding)
    assert octets == bytes((0, 7, 0, padding))
    assert decode_encapsulation(octets).padding == padding
    # Higher bits have no meaning yet, and are no reason to refuse a sample.
    assert decode_encapsulation(bytes((0, 7, 0x80, 0xFC | padding))).padding == padding


@pytest.mark.parametrize("padding", [-1, 4])
def test_padding_beyond_three_is_refused(padding: int) -> None:
    with pytest.raises(ValueError, match="0 to 3"):
        encode_encapsulation(Encapsulation.CDR_LE, padding=padding)


@pytest.mark.parametrize("octets", ["", "00", "0001", "000100", "00040000", "00050000", "000c0000", "01010000"])
def test_short_or_unknown_header_is_malformed(octets: str) -> None:
    with pytest.raises(MalformedMessage):
        decode_encapsulation(bytes.fromhex(octets))


@given(st.binary(max_size=8))
def test_any_octets_are_a_header_or_malformed(octets: bytes) -> None:
    try:
        header = decode_encapsulation(octets)
    except MalformedMessage:
        return
    assert encode_encapsulation(header.encapsulation)[:2] == octets[:2]
