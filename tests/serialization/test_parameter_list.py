"""Parameter lists: octets both ways, and the rules for what a receiver does not know."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ddsi.serialization import MustUnderstandUnknown, ParameterId, ParameterList, parameter_name
from ddsi.serialization.parameter_list import MAX_PARAMETERS
from ddsi.structure.errors import MalformedMessage

# parameters, little-endian octets, big-endian octets
LISTS: list[tuple[list[tuple[int, bytes]], str, str]] = [
    ([], "01000000", "00010000"),
    ([(ParameterId.STATUS_INFO, b"\0\0\0\3")], "7100 0400 00000003 01000000", "0071 0004 00000003 00010000"),
    (
        [(ParameterId.KEY_HASH, bytes(range(16))), (0x8001, b"")],
        "7000 1000 000102030405060708090a0b0c0d0e0f 0180 0000 01000000",
        "0070 0010 000102030405060708090a0b0c0d0e0f 8001 0000 00010000",
    ),
    (
        [(ParameterId.UNICAST_LOCATOR, b"aaaa"), (ParameterId.UNICAST_LOCATOR, b"bbbb")],
        "2f00 0400 61616161 2f00 0400 62626262 01000000",
        "002f 0004 61616161 002f 0004 62626262 00010000",
    ),
]
ORDERS = [pytest.param(True, id="little"), pytest.param(False, id="big")]


def decode(octets: str, *, little_endian: bool = True) -> ParameterList:
    decoded, consumed = ParameterList.decode(bytes.fromhex(octets), little_endian=little_endian)
    assert consumed == len(bytes.fromhex(octets))
    return decoded


@pytest.mark.parametrize("little_endian", ORDERS)
@pytest.mark.parametrize(("parameters", "little", "big"), LISTS)
def test_list_reads_and_writes_as_these_octets(
    parameters: list[tuple[int, bytes]], little: str, big: str, *, little_endian: bool
) -> None:
    octets = little if little_endian else big
    made = ParameterList(parameters, little_endian=little_endian)
    assert made.encode() == bytes.fromhex(octets)
    assert decode(octets, little_endian=little_endian) == made


@pytest.mark.parametrize("little_endian", ORDERS)
@pytest.mark.parametrize(("parameters", "little", "big"), LISTS)
def test_list_without_its_end_is_malformed(
    parameters: list[tuple[int, bytes]], little: str, big: str, *, little_endian: bool
) -> None:
    octets = bytes.fromhex(little if little_endian else big)
    for length in range(len(octets)):
        with pytest.raises(MalformedMessage):
            ParameterList.decode(octets[:length], little_endian=little_endian)


def test_list_inside_of_other_octets() -> None:
    """The count of octets taken leads to what stands behind the sentinel, whose length means nothing."""
    octets = bytes.fromhex("ffff 7100 0400 00000002 0100 1234 eeeeeeee")
    decoded, consumed = ParameterList.decode(octets, little_endian=True, start=2)
    assert [tuple(parameter) for parameter in decoded] == [(ParameterId.STATUS_INFO, b"\0\0\0\2")]
    assert octets[2 + consumed :] == b"\xee" * 4


def test_values_are_views_not_copies() -> None:
    octets = bytearray.fromhex("7100 0400 00000002 01000000")
    decoded, _ = ParameterList.decode(octets, little_endian=True)
    octets[7] = 3
    assert decoded.get(ParameterId.STATUS_INFO) == b"\0\0\0\3"


def test_pad_is_skipped() -> None:
    assert decode("0000 0400 deadbeef 7100 0400 00000001 01000000") == decode("7100 0400 00000001 01000000")


def test_odd_length_is_rounded_up_and_the_value_keeps_its_own() -> None:
    decoded = decode("1600 0200 0110 0000 7100 0400 00000001 01000000")
    assert decoded.get(ParameterId.VENDORID) == b"\x01\x10"
    assert decoded.get(ParameterId.STATUS_INFO) == b"\0\0\0\1"
    assert decoded.encode().hex() == "1600040001100000" + "7100040000000001" + "01000000"


def test_get_gives_the_first_and_get_all_gives_all() -> None:
    made = ParameterList([(5, b"1111"), (7, b"2222"), (5, b"3333")])
    assert made.get(5) == b"1111"
    assert made.get_all(5) == [b"1111", b"3333"]
    assert (made.get(6), made.get_all(6)) == (None, [])
    assert len(made) == 3


@pytest.mark.parametrize("pid", [0x3333, 0x8005, 0xB001])
def test_unknown_parameters_do_no_harm(pid: int) -> None:
    made = ParameterList([(pid, b"????"), (ParameterId.STATUS_INFO, b"\0\0\0\1")])
    decoded, _ = ParameterList.decode(made.encode(), little_endian=True, understood={ParameterId.STATUS_INFO})
    assert decoded.get(ParameterId.STATUS_INFO) == b"\0\0\0\1"


@pytest.mark.parametrize("pid", [0x4005, 0x7FFF, 0xC001])
def test_unknown_parameter_that_must_be_understood_spoils_the_list(pid: int) -> None:
    """Also a vendor's own, and also one that but for the bit would be known."""
    octets = ParameterList([(pid, b"????")]).encode()
    with pytest.raises(MustUnderstandUnknown) as caught:
        ParameterList.decode(octets, little_endian=True, understood=set(ParameterId))
    assert caught.value.pid == pid
    # Without a set the reader of the list decides, as with the inline QoS of one sample among others.
    decoded, _ = ParameterList.decode(octets, little_endian=True)
    with pytest.raises(MustUnderstandUnknown):
        decoded.require_understood()


def test_known_parameter_that_must_be_understood_is_fine() -> None:
    made = ParameterList([(ParameterId.DOMAIN_TAG, b"\1\0\0\0\0\0\0\0")])
    made.require_understood()
    with pytest.raises(MustUnderstandUnknown):
        made.require_understood({ParameterId.USER_DATA})


def test_number_of_parameters_is_bounded() -> None:
    full = ParameterList([(0x8001, b"")] * MAX_PARAMETERS)
    assert len(ParameterList.decode(full.encode(), little_endian=True)[0]) == MAX_PARAMETERS
    full.add(0x8001, b"")
    with pytest.raises(MalformedMessage, match="1024 parameters"):
        ParameterList.decode(full.encode(), little_endian=True)


def test_value_that_does_not_fit_its_length_field_is_refused() -> None:
    assert len(ParameterList([(ParameterId.USER_DATA, bytes(0xFFFC))]).encode()) == 0xFFFC + 8
    with pytest.raises(ValueError, match="USER_DATA has 65533 octets"):
        ParameterList([(ParameterId.USER_DATA, bytes(0xFFFD))]).encode()


def test_names_tell_the_story() -> None:
    made = ParameterList([(ParameterId.STATUS_INFO, b"\0\0\0\3"), (0x8005, b"\1")])
    assert repr(made) == "<ParameterList little-endian STATUS_INFO=00000003, 8005=01>"
    assert (parameter_name(0x5A), parameter_name(0x4005)) == ("ENDPOINT_GUID", "4005")


@given(st.binary(max_size=120), st.booleans(), st.integers(0, 8))
def test_any_octets_are_a_list_or_malformed(octets: bytes, little_endian: bool, start: int) -> None:
    try:
        decoded, consumed = ParameterList.decode(octets, little_endian=little_endian, start=start)
    except MalformedMessage:
        return
    assert start + consumed <= len(octets)
    again, _ = ParameterList.decode(decoded.encode(), little_endian=little_endian)
    assert [parameter.pid for parameter in again] == [parameter.pid for parameter in decoded]


pids = st.integers(2, 0xFFFF)
values = st.integers(0, 6).flatmap(lambda words: st.binary(min_size=4 * words, max_size=4 * words))


@given(st.lists(st.tuples(pids, values), max_size=10), st.booleans())
def test_lists_round_trip(parameters: list[tuple[int, bytes]], little_endian: bool) -> None:
    made = ParameterList(parameters, little_endian=little_endian)
    assert ParameterList.decode(made.encode(), little_endian=little_endian)[0] == made
