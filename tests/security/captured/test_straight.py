"""The straight decoder decodes what others computed, and notices each octet that was changed on the way."""

from __future__ import annotations

import pytest

from tests.security.captured.straight import (
    AES128_GCM,
    AES256_GCM,
    AES256_GMAC,
    SEC_BODY,
    Footer,
    Header,
    Material,
    Tampered,
    check_receiver_mac,
    open_block,
    open_payload,
    read_material,
    session_key,
    session_receiver_key,
    submessages,
)
from tests.security.cryptographic import vectors as v

LONG = Material(AES256_GCM, v.SALT, v.SENDER_KEY_ID, v.SENDER_KEY, v.RECEIVER_KEY_ID, v.RECEIVER_KEY)
SHORT = Material(AES128_GCM, v.SALT[:16], v.SENDER_KEY_ID, v.SENDER_KEY[:16], v.RECEIVER_KEY_ID, v.RECEIVER_KEY[:16])
SIGNING = Material(AES256_GMAC, v.SALT, v.SENDER_KEY_ID, v.SENDER_KEY, v.RECEIVER_KEY_ID, v.RECEIVER_KEY)
KX = Material(AES256_GCM, v.EXCHANGE_SALT, bytes(4), v.EXCHANGE_KEY)

PAYLOADS = [
    (v.PAYLOAD_ENCRYPTED_256, LONG),
    (v.PAYLOAD_SIGNED_256, SIGNING),
    (v.PAYLOAD_ENCRYPTED_128, SHORT),
]
ENVELOPES = [
    (v.HEARTBEAT_ENCRYPTED_FOR_ONE, LONG, v.HEARTBEAT),
    (v.HEARTBEAT_SIGNED_FOR_ONE, SIGNING, v.HEARTBEAT),
    (v.HEARTBEAT_ENCRYPTED, LONG, v.HEARTBEAT),
    (v.MESSAGE_ENCRYPTED_FOR_ONE[20:], LONG, v.INFO_SOURCE + v.HEARTBEAT),
    (v.MESSAGE_SIGNED[20:], SIGNING, v.INFO_SOURCE + v.HEARTBEAT),
    (v.VOLATILE_HEARTBEAT_ENCRYPTED, KX, v.VOLATILE_HEARTBEAT),
]


def open_envelope(octets: bytes, material: Material) -> bytes:
    prefix, *inside, postfix = submessages(octets)
    header, footer = Header.read(prefix.body), Footer.read(postfix.body)
    is_body = inside[0].kind == SEC_BODY
    body = inside[0].body if is_body else b"".join(item.octets for item in inside)
    plain = open_block(header, body, footer, material)
    for key_id, mac in footer.receivers:
        assert key_id == material.receiver_key_id
        check_receiver_mac(header, footer, mac, material)
    return plain


def test_session_keys_are_the_first_octets_of_a_hash() -> None:
    assert session_key(LONG, v.SESSION_ID) == v.SESSION_KEY_256
    assert session_key(SHORT, v.SESSION_ID) == v.SESSION_KEY_128
    assert session_receiver_key(LONG, v.SESSION_ID) == v.RECEIVER_SESSION_KEY_256
    assert session_receiver_key(SHORT, v.SESSION_ID) == v.RECEIVER_SESSION_KEY_128
    assert session_key(KX, v.SESSION_ID) == v.EXCHANGE_SESSION_KEY


def test_key_material_of_each_size() -> None:
    assert read_material(v.MATERIAL_256_WITH_RECEIVER) == LONG
    assert read_material(v.MATERIAL_256) == Material(AES256_GCM, v.SALT, v.SENDER_KEY_ID, v.SENDER_KEY)
    assert read_material(v.MATERIAL_128) == Material(AES128_GCM, v.SALT[:16], v.SENDER_KEY_ID, v.SENDER_KEY[:16])


@pytest.mark.parametrize(("octets", "material"), PAYLOADS)
def test_payloads(octets: bytes, material: Material) -> None:
    assert open_payload(octets, material) == v.PAYLOAD
    # The kind, key id and the lengths are compared or used; a change of these is no matter of the MAC.
    for position in [*range(8, 20), *range(24, len(octets) - 4)]:
        changed = bytearray(octets)
        changed[position] ^= 1
        with pytest.raises(Tampered):
            open_payload(bytes(changed), material)


@pytest.mark.parametrize(("octets", "material", "plain"), ENVELOPES)
def test_envelopes(octets: bytes, material: Material, plain: bytes) -> None:
    assert open_envelope(octets, material) == plain
    prefix, *_, postfix = submessages(octets)
    mac = len(octets) - len(postfix.body)
    count = int.from_bytes(postfix.body[16:20], "big")
    for position in [*range(12, len(prefix.octets)), *range(mac, mac + 16), *range(mac + 24, mac + 24 + 16 * count)]:
        changed = bytearray(octets)
        changed[position] ^= 1
        with pytest.raises(Tampered):
            open_envelope(bytes(changed), material)
