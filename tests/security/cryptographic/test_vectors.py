"""The vectors, byte for byte, in both directions."""

from __future__ import annotations

import pytest

from ddsi_security.cryptographic import opening, payload, sealing, session_keys
from ddsi_security.cryptographic.key_material import KeyMaterial, exchange_key_material
from ddsi_security.cryptographic.rooms import Rooms
from ddsi_security.cryptographic.transformation import Protection, TransformationKind
from ddsi_security.handles import SharedSecretHandle
from tests.security.cryptographic import vectors
from tests.security.cryptographic.keys import entropy_of, material, octets_of, receiver_key, ring, sending_key

GCM, GMAC, GCM128 = TransformationKind.AES256_GCM, TransformationKind.AES256_GMAC, TransformationKind.AES128_GCM

MATERIALS = [
    (material(GCM, for_receiver=True), vectors.MATERIAL_256_WITH_RECEIVER),
    (material(GCM), vectors.MATERIAL_256),
    (material(GCM128), vectors.MATERIAL_128),
]
PAYLOADS = [
    (GCM, vectors.PAYLOAD_ENCRYPTED_256),
    (GMAC, vectors.PAYLOAD_SIGNED_256),
    (GCM128, vectors.PAYLOAD_ENCRYPTED_128),
]
# Kind, whether there is a receiver-specific MAC, plain octets, protected ones.
SUBMESSAGES = [
    (GCM, True, vectors.HEARTBEAT, vectors.HEARTBEAT_ENCRYPTED_FOR_ONE),
    (GMAC, True, vectors.HEARTBEAT, vectors.HEARTBEAT_SIGNED_FOR_ONE),
    (GCM, False, vectors.HEARTBEAT, vectors.HEARTBEAT_ENCRYPTED),
]
MESSAGES = [
    (GCM, True, vectors.MESSAGE, vectors.MESSAGE_ENCRYPTED_FOR_ONE),
    (GMAC, False, vectors.MESSAGE, vectors.MESSAGE_SIGNED),
]


def exchange_material() -> KeyMaterial:
    secret = SharedSecretHandle(vectors.CHALLENGE1, vectors.CHALLENGE2, vectors.SHARED_SECRET, is_replier=False)
    return exchange_key_material(secret)


def test_the_pairwise_key_comes_of_secret_and_challenges() -> None:
    found = exchange_material()
    assert found.kind is GCM
    assert found.sender_key_id == bytes(4)
    assert found.master_salt == vectors.EXCHANGE_SALT
    assert found.master_sender_key == vectors.EXCHANGE_KEY
    assert session_keys.session_key(found, vectors.SESSION_ID) == vectors.EXCHANGE_SESSION_KEY


def test_session_keys_come_of_master_key_salt_and_session_id() -> None:
    for kind, key, receivers_key in [
        (GCM, vectors.SESSION_KEY_256, vectors.RECEIVER_SESSION_KEY_256),
        (GCM128, vectors.SESSION_KEY_128, vectors.RECEIVER_SESSION_KEY_128),
    ]:
        master = bytearray(vectors.RECEIVER_KEY[: kind.key_length])
        assert session_keys.session_key(material(kind), vectors.SESSION_ID) == key
        assert session_keys.session_receiver_key(master, material(kind), vectors.SESSION_ID) == receivers_key


@pytest.mark.parametrize(("found", "octets"), MATERIALS)
def test_key_material(found: KeyMaterial, octets: bytes) -> None:
    assert found.encode() == octets
    assert KeyMaterial.decode(octets) == found
    assert KeyMaterial.from_token(found.to_token()) == found


@pytest.mark.parametrize(("kind", "protected"), PAYLOADS)
def test_payload(kind: TransformationKind, protected: bytes) -> None:
    buffer = octets_of(payload.encode_payload(vectors.PAYLOAD, sending_key(material(kind)), Rooms()))
    assert buffer == protected
    assert payload.decode_payload(protected, ring(material(kind)), Protection(kind.encrypts)) == vectors.PAYLOAD


@pytest.mark.parametrize(("kind", "for_receiver", "plain", "protected"), SUBMESSAGES)
def test_submessage(kind: TransformationKind, for_receiver: bool, plain: bytes, protected: bytes) -> None:
    receivers = [receiver_key()] if for_receiver else []
    buffer = octets_of(sealing.seal_submessage((plain,), sending_key(material(kind)), receivers))
    assert buffer == protected
    keys = ring(material(kind, for_receiver=for_receiver))
    assert opening.open_submessage(protected, keys, Protection(kind.encrypts, for_receiver)) == plain


@pytest.mark.parametrize(("kind", "for_receiver", "plain", "protected"), MESSAGES)
def test_message(kind: TransformationKind, for_receiver: bool, plain: bytes, protected: bytes) -> None:
    assert vectors.INFO_SOURCE[8:] == vectors.MESSAGE_HEADER[4:]
    receivers = [receiver_key()] if for_receiver else []
    buffer = octets_of(sealing.seal_message((plain,), sending_key(material(kind)), receivers))
    assert buffer == protected
    keys = ring(material(kind, for_receiver=for_receiver))
    assert opening.open_message(protected, keys, Protection(kind.encrypts, for_receiver)) == plain


def test_volatile_submessage() -> None:
    key = session_keys.SendingKey(exchange_material(), entropy_of(vectors.SESSION_ID, vectors.SUFFIX))
    buffer = octets_of(sealing.seal_submessage((vectors.VOLATILE_HEARTBEAT,), key, []))
    assert buffer == vectors.VOLATILE_HEARTBEAT_ENCRYPTED
    opened = opening.open_submessage(buffer, ring(exchange_material()), Protection(encrypted=True))
    assert opened == vectors.VOLATILE_HEARTBEAT
