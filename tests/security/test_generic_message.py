"""Tokens and generic messages, octet by octet, in both directions."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ddsi.serialization import Reader, Writer
from ddsi.structure.errors import MalformedMessage
from ddsi.structure.guid import GUID_UNKNOWN, Guid
from ddsi_security.generic_message import (
    PARTICIPANT_CRYPTO_TOKENS,
    GenericMessage,
    MessageIdentity,
    peek_route,
    read_generic_message,
    write_generic_message,
)
from ddsi_security.tokens import NIL, DataHolder, read_data_holder, serialize_binary_properties, write_data_holder

# A key message of a volatile writer, little-endian: one token with 88 octets of key material.
SOURCE = Guid(bytes.fromhex("e13ceaad96794d274c45dd50ff0202c3"))
DESTINATION = Guid(bytes.fromhex("80112233445566778899aabb000001c1"))
KEY_MATERIAL = bytes.fromhex(
    "00000004"  # transformation_kind
    "00000020000102030405060708090a0b0c0d0e0f101112131415161718191a1b1c1d1e1f"  # master_salt
    "0a0b0c0d"  # sender_key_id
    "00000020202122232425262728292a2b2c2d2e2f303132333435363738393a3b3c3d3e3f"  # master_sender_key
    "0000000000000000"  # no receiver-specific key
)
MESSAGE = GenericMessage(
    message_identity=MessageIdentity(SOURCE, 1),
    destination_participant_guid=DESTINATION,
    message_class_id=PARTICIPANT_CRYPTO_TOKENS,
    message_data=(DataHolder("DDS:Crypto:AES_GCM_GMAC", (), (("dds.cryp.keymat", KEY_MATERIAL),)),),
)
OCTETS = bytes.fromhex(
    "00010000e13ceaad96794d274c45dd50ff0202c301000000000000000000000000000000000000000000000000000000"
    "0000000080112233445566778899aabb000001c100000000000000000000000000000000000000000000000000000000"
    "00000000220000006464732e7365632e7061727469636970616e745f63727970746f5f746f6b656e7300000001000000"
    "180000004444533a43727970746f3a4145535f47434d5f474d4143000000000001000000100000006464732e63727970"
    "2e6b65796d617400580000000000000400000020000102030405060708090a0b0c0d0e0f101112131415161718191a1b"
    "1c1d1e1f0a0b0c0d00000020202122232425262728292a2b2c2d2e2f303132333435363738393a3b3c3d3e3f00000000"
    "00000000"
)

IDENTITY_TOKEN = DataHolder(
    "DDS:Auth:PKI-DH:1.0", (("dds.cert.sn", "CN=alice"), ("dds.cert.algo", "EC-prime256v1")), ()
)
IDENTITY_TOKEN_OCTETS = bytes.fromhex(
    "140000004444533a417574683a504b492d44483a312e3000020000000c0000006464732e636572742e736e00"
    "09000000434e3d616c696365000000000e0000006464732e636572742e616c676f0000000e00000045432d7072696d65"
    "323536763100000000000000"
)


def test_a_key_message_has_the_octets_of_the_specification() -> None:
    assert write_generic_message(MESSAGE) == OCTETS
    assert read_generic_message(OCTETS) == MESSAGE


def test_an_identity_token_has_the_octets_of_the_specification() -> None:
    writer = Writer(little_endian=True)
    write_data_holder(writer, IDENTITY_TOKEN)
    assert writer.getvalue() == IDENTITY_TOKEN_OCTETS
    assert read_data_holder(Reader(IDENTITY_TOKEN_OCTETS, little_endian=True)) == IDENTITY_TOKEN


def test_nil_takes_sixteen_octets() -> None:
    writer = Writer(little_endian=True)
    write_data_holder(writer, NIL)
    assert writer.getvalue() == bytes.fromhex("01000000 00000000 00000000 00000000")


def test_a_token_of_version_1_0_ends_behind_its_properties() -> None:
    assert read_data_holder(Reader(IDENTITY_TOKEN_OCTETS[:-4], little_endian=True)) == IDENTITY_TOKEN


def test_signed_properties_are_padded_before_each_element_and_not_behind_the_last() -> None:
    properties = [("c.id", b"CERT-A"), ("c.perm", b"PERM-A\0")]
    assert serialize_binary_properties(properties) == bytes.fromhex(
        "00000002"
        "00000005 632e696400 000000"  # c.id, padding
        "00000006 434552542d41 0000"  # its value, padding
        "00000007 632e7065726d00 00"
        "00000007 5045524d2d4100"
    )


def test_the_route_is_read_without_the_rest() -> None:
    assert peek_route(OCTETS) == (SOURCE, DESTINATION)
    assert peek_route(OCTETS[:68]) == (SOURCE, DESTINATION)
    with pytest.raises(MalformedMessage):
        peek_route(OCTETS[:67])


# Between 176 and 179 its last token ends behind the properties, as those of version 1.0 do, with padding.
@pytest.mark.parametrize("end", [*range(176), *range(180, len(OCTETS))])
def test_a_message_that_is_cut_off_is_malformed(end: int) -> None:
    with pytest.raises(MalformedMessage):
        read_generic_message(OCTETS[:end])


@pytest.mark.parametrize(
    ("offset", "octets", "why"),
    [
        (0, "00030000", "a parameter list is no generic message"),
        (100, "ffffffff", "a class id longer than the message"),
        (140, "09000000", "more tokens than any message has"),
        (172, "ffffff7f", "more properties than any token has"),
        (176, "41000000", "more binary properties than any token has"),
    ],
)
def test_lengths_and_counts_are_bounded(offset: int, octets: str, why: str) -> None:
    changed = bytearray(OCTETS)
    changed[offset : offset + 4] = bytes.fromhex(octets)
    with pytest.raises(MalformedMessage):
        read_generic_message(changed)


TEXTS = st.text(st.characters(codec="utf-8", exclude_characters="\0"), max_size=20)
HOLDERS = st.builds(
    DataHolder,
    TEXTS,
    st.lists(st.tuples(TEXTS, TEXTS), max_size=4).map(tuple),
    st.lists(st.tuples(TEXTS, st.binary(max_size=40)), max_size=4).map(tuple),
)


@given(st.lists(HOLDERS, max_size=3).map(tuple), st.booleans())
def test_every_token_survives_both_byte_orders(holders: tuple[DataHolder, ...], little_endian: bool) -> None:
    for holder in holders:
        writer = Writer(little_endian=little_endian)
        write_data_holder(writer, holder)
        assert read_data_holder(Reader(writer.getvalue(), little_endian=little_endian)) == holder


@given(st.binary(max_size=200), st.binary(min_size=4, max_size=4), st.integers(0, len(OCTETS) - 4))
def test_whatever_comes_is_read_or_malformed(tail: bytes, change: bytes, offset: int) -> None:
    changed = bytearray(OCTETS + tail)
    changed[offset : offset + 4] = change
    try:
        message = read_generic_message(changed)
    except MalformedMessage:
        return
    assert len(message.message_data) <= 8


def test_endpoints_that_do_not_matter_are_unknown() -> None:
    assert MESSAGE.destination_endpoint_guid == MESSAGE.source_endpoint_guid == GUID_UNKNOWN
