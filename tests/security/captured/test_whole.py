"""What the captures hold, by a decoder that shares nothing with ours: the expectations of all other tests here."""

from __future__ import annotations

from dataclasses import replace

import pytest
from cryptography.exceptions import InvalidSignature

from ddsi_security.tokens import serialize_binary_properties
from tests.captures.capture import HERE, SECURED, load
from tests.security.captured.handshakes import PROPERTIES, handshakes, verify, verify_signature
from tests.security.captured.straight import KIND_NAMES, Tampered, binary_properties, kx_material, read_material
from tests.security.captured.whole import Token, decode, decoded, shared_secrets

NOT_OF_DECODING = {"rtps_datagrams", "not_rtps_datagrams", "undecoded"}
"""Counts of what passed by, and of what was not decoded, which here raises."""


@pytest.mark.parametrize("name", SECURED)
def test_all_is_decoded_and_counted(name: str) -> None:
    expected = {key: count for key, count in load(name).facts["counts"].items() if key not in NOT_OF_DECODING}
    assert decoded(name).all_counts == expected


@pytest.mark.parametrize("name", SECURED)
def test_tokens_are_those_that_the_stacks_traced(name: str) -> None:
    facts = load(name).facts
    expected = {
        Token(item["kind"], item["owner_guid"], item["receiver_guid"], item["token_index"], item["hex"])
        for item in facts["keymat"]
    }
    assert set(decoded(name).tokens) == expected
    for item in facts["keymat"]:
        material = read_material(bytes.fromhex(item["hex"]))
        assert KIND_NAMES[material.kind] == item["transformation_kind"]
        assert material.key_id.hex() == item["sender_key_id"]
        assert material.receiver_key_id.hex() == item["receiver_specific_key_id"]


@pytest.mark.parametrize("name", SECURED)
def test_samples_are_those_that_were_written_and_received(name: str) -> None:
    facts = load(name).facts
    written = [line for peer in facts["peers"] for line in peer.get("wrote", ())]
    assert decoded(name).samples == written
    for subscriber in facts["subscribers"]:
        assert set(subscriber["samples"]) <= set(written)
        assert subscriber["samples"]


@pytest.mark.parametrize("name", SECURED)
def test_handshakes_are_good_and_lead_to_the_keys(name: str) -> None:
    facts = load(name).facts
    identities = {bytes.fromhex(peer["guid"])[:12]: peer["identity"] for peer in facts["peers"]}
    agreed = {(kx["initiator_guid"][:24], kx["replier_guid"][:24]): kx for kx in facts["kx"]}
    found = handshakes(decoded(name).messages)
    assert {(handshake.initiator.hex(), handshake.replier.hex()) for handshake in found} == set(agreed)
    for handshake in found:
        kx = agreed[handshake.initiator.hex(), handshake.replier.hex()]
        verify(handshake, kx, HERE / facts["keystore"], identities)
    for (_, secrets), kx in zip(shared_secrets(load(name)), facts["kx"], strict=True):
        material = kx_material(*secrets)
        assert (material.salt.hex(), material.key.hex()) == (kx["master_salt"], kx["master_sender_key"])


def test_all_together() -> None:
    """No capture is forgotten, and none is empty."""
    assert sum(len(handshakes(decoded(name).messages)) for name in SECURED) == 27
    assert sum(len(decoded(name).tokens) for name in SECURED) == 445
    assert sum(decoded(name).counts["receiver_macs"] for name in SECURED) == 428


@pytest.mark.parametrize("name", ["sec-rsa-all-cyclone-cyclone", "sec-all-fastdds-fastdds"])
def test_a_signature_covers_every_value(name: str) -> None:
    (handshake,) = handshakes(decoded(name).messages)
    content = handshake.signed_by_replier
    for position in range(0, len(content), 7):
        changed = bytearray(content)
        changed[position] ^= 1
        with pytest.raises(InvalidSignature):
            verify_signature(handshake.reply, handshake.reply["signature"], bytes(changed))


@pytest.mark.parametrize("name", SECURED)
def test_our_serialisation_of_what_is_hashed_and_signed(name: str) -> None:
    for handshake in handshakes(decoded(name).messages):
        for token in (handshake.request, handshake.reply):
            described = [(item, token[item]) for item in PROPERTIES]
            assert serialize_binary_properties(described) == binary_properties(described)


@pytest.mark.parametrize("name", ["sec-alloa-three-cyclone", "sec-signenc-cyclone-fastdds"])
def test_a_changed_secret_opens_nothing(name: str) -> None:
    capture = load(name)
    secrets = [{**kx, "shared_secret": bytes(32).hex()} for kx in capture.facts["kx"]]
    with pytest.raises(Tampered):
        decode(replace(capture, facts={**capture.facts, "kx": secrets}))
