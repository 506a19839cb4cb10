"""ContentFilterInfo_t as octets, both ways and in both byte orders.  RTPS 2.5 §9.6.4.2."""

from __future__ import annotations

import pytest

from ddsi.messages.content_filter_info import MAX_FILTERS, decode_content_filter_info, encode_content_filter_info
from ddsi.structure.errors import MalformedMessage

ONE, TWO, THREE = bytes(range(16)), b"\xff" * 16, b"\x11" * 16

CASES = [
    ({}, "00000000 00000000", "00000000 00000000"),
    ({ONE: True}, f"01000000 00000080 01000000 {ONE.hex()}", f"00000001 80000000 00000001 {ONE.hex()}"),
    (
        {ONE: False, TWO: True, THREE: True},
        f"01000000 00000060 03000000 {ONE.hex()} {TWO.hex()} {THREE.hex()}",
        f"00000001 60000000 00000003 {ONE.hex()} {TWO.hex()} {THREE.hex()}",
    ),
]


@pytest.mark.parametrize(("verdicts", "little", "big"), CASES)
def test_results_are_bits_from_the_highest_down_and_signatures_are_not_swapped(
    verdicts: dict[bytes, bool], little: str, big: str
) -> None:
    for octets, little_endian in ((bytes.fromhex(little), True), (bytes.fromhex(big), False)):
        assert encode_content_filter_info(verdicts, little_endian=little_endian) == octets
        assert decode_content_filter_info(octets, little_endian=little_endian) == verdicts


def test_the_thirty_third_result_is_in_the_second_word() -> None:
    verdicts = {number.to_bytes(16, "big"): number % 3 == 0 for number in range(40)}
    octets = encode_content_filter_info(verdicts)
    assert octets[:4] == b"\2\0\0\0"
    assert decode_content_filter_info(octets, little_endian=True) == verdicts


def test_a_signature_without_a_result_says_nothing() -> None:
    assert decode_content_filter_info(bytes(4) + b"\1\0\0\0" + ONE, little_endian=True) == {}


@pytest.mark.parametrize("cut", range(28))
def test_what_is_cut_short_is_malformed(cut: int) -> None:
    with pytest.raises(MalformedMessage):
        decode_content_filter_info(encode_content_filter_info({ONE: True})[:cut], little_endian=True)


def test_more_filters_than_one_sample_may_tell_of_are_malformed() -> None:
    many = {number.to_bytes(16, "big"): True for number in range(MAX_FILTERS + 1)}
    with pytest.raises(MalformedMessage):
        decode_content_filter_info(encode_content_filter_info(many), little_endian=True)
