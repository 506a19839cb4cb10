"""Tokens: how many there are for what, and which of a peer's are refused."""

from __future__ import annotations

from collections.abc import Sequence

import pytest

from ddsi.spi import Refused
from ddsi_security.cryptographic.key_material import NO_KEY_MATERIAL, TOKEN_CLASS_ID, KeyMaterial
from ddsi_security.cryptographic.transformation import TransformationKind
from ddsi_security.tokens import CryptoToken
from tests.security.cryptographic.keys import (
    SECRET,
    Kind,
    Match,
    Participant,
    endpoint_attributes,
    match,
    material,
    pair,
    volatile_match,
)

NONE_TOKEN = NO_KEY_MATERIAL.to_token()
GCM = material().to_token()
GMAC = material(TransformationKind.AES256_GMAC).to_token()
GCM_FOR_US = material(for_receiver=True).to_token()
SHORT_KEY = material(TransformationKind.AES128_GCM).to_token()
MALFORMED = CryptoToken(TOKEN_CLASS_ID, (), (("dds.cryp.keymat", bytes(23)),))

Tokens = Sequence[CryptoToken]


def kinds(tokens: Tokens) -> list[str]:
    return [KeyMaterial.from_token(token).kind.name for token in tokens]


def writers_tokens(publisher: Participant, found: Match) -> Tokens:
    return publisher.plugin.create_local_datawriter_crypto_tokens(found.writer, found.remote_reader)


def readers_tokens(subscriber: Participant, found: Match) -> Tokens:
    return subscriber.plugin.create_local_datareader_crypto_tokens(found.reader, found.remote_writer)


@pytest.mark.parametrize(
    ("metadata", "data", "of_writer", "of_reader"),
    [
        (Kind.NONE, Kind.NONE, [], []),
        (Kind.SIGN, Kind.NONE, ["AES256_GMAC"], ["AES256_GMAC"]),
        (Kind.NONE, Kind.ENCRYPT, ["AES256_GCM"], ["NONE"]),
        (Kind.SIGN, Kind.ENCRYPT, ["AES256_GMAC", "AES256_GCM"], ["AES256_GMAC"]),
        (Kind.ENCRYPT, Kind.ENCRYPT, ["AES256_GCM", "AES256_GCM"], ["AES256_GCM"]),
        (Kind.ENCRYPT_WITH_ORIGIN, Kind.SIGN, ["AES256_GCM", "AES256_GMAC"], ["AES256_GCM"]),
    ],
)
def test_each_protection_has_its_token(metadata: Kind, data: Kind, of_writer: list[str], of_reader: list[str]) -> None:
    alice, bob = pair()
    found = match(alice, bob, endpoint_attributes(metadata, data))
    assert kinds(writers_tokens(alice, found)) == of_writer
    assert kinds(readers_tokens(bob, found)) == of_reader


@pytest.mark.parametrize(
    ("rtps", "kind"), [(Kind.NONE, "NONE"), (Kind.SIGN, "AES256_GMAC"), (Kind.ENCRYPT, "AES256_GCM")]
)
def test_a_participant_always_has_one_token(rtps: Kind, kind: str) -> None:
    alice, bob = pair(rtps)
    tokens = alice.plugin.create_local_participant_crypto_tokens(alice.handle, alice.remote(bob))
    assert kinds(tokens) == [kind]


def test_the_two_keys_of_a_writer_are_different_ones() -> None:
    alice, bob = pair()
    tokens = writers_tokens(alice, match(alice, bob, endpoint_attributes(Kind.ENCRYPT, Kind.ENCRYPT)))
    first, second = (KeyMaterial.from_token(token) for token in tokens)
    assert first.sender_key_id != second.sender_key_id
    assert first.master_sender_key != second.master_sender_key


def test_receivers_are_told_the_same_but_for_the_key_that_is_theirs_alone() -> None:
    alice, bob = pair()
    attributes = endpoint_attributes(Kind.ENCRYPT_WITH_ORIGIN, Kind.ENCRYPT)
    one = match(alice, bob, attributes)
    other = match(alice, bob, attributes, writer=one.writer)
    (first, payload), (second, same_payload) = (
        [KeyMaterial.from_token(token) for token in writers_tokens(alice, found)] for found in (one, other)
    )
    assert first.receiver_specific_key_id != second.receiver_specific_key_id
    assert first.master_receiver_specific_key != second.master_receiver_specific_key
    assert first.for_receiver(bytes(4), bytearray()) == second.for_receiver(bytes(4), bytearray())
    assert payload == same_payload
    assert not payload.master_receiver_specific_key


def test_a_relay_is_not_told_the_key_of_the_payload() -> None:
    alice, bob = pair()
    found = match(alice, bob, endpoint_attributes(Kind.SIGN, Kind.ENCRYPT))
    relay = alice.plugin.register_matched_remote_datareader(found.writer, alice.remote(bob), SECRET, relay_only=True)
    assert kinds(alice.plugin.create_local_datawriter_crypto_tokens(found.writer, relay)) == ["AES256_GMAC"]


@pytest.mark.parametrize(
    ("rtps", "tokens", "accepted"),
    [
        (Kind.NONE, [NONE_TOKEN], True),
        (Kind.NONE, [], True),
        (Kind.NONE, [GMAC], True),  # so does Fast DDS
        (Kind.ENCRYPT, [GCM], True),
        (Kind.ENCRYPT, [SHORT_KEY], True),
        (Kind.ENCRYPT, [GCM_FOR_US], True),
        (Kind.ENCRYPT_WITH_ORIGIN, [GCM_FOR_US], True),
        (Kind.ENCRYPT_WITH_ORIGIN, [GCM], False),
        (Kind.ENCRYPT, [GMAC], False),
        (Kind.SIGN, [GCM], False),
        (Kind.ENCRYPT, [NONE_TOKEN], False),
        (Kind.ENCRYPT, [], False),
        (Kind.ENCRYPT, [GCM, GCM], False),
        (Kind.NONE, [MALFORMED], False),
        (Kind.NONE, [CryptoToken()], False),
    ],
)
def test_which_tokens_of_a_participant_are_taken(rtps: Kind, tokens: Tokens, accepted: bool) -> None:
    alice, bob = pair(rtps)
    before = alice.remote(bob).ring.current
    refused = alice.plugin.set_remote_participant_crypto_tokens(alice.handle, alice.remote(bob), tokens)
    assert (refused is None) is accepted
    if not accepted:
        assert isinstance(refused, Refused)
        assert alice.remote(bob).ring.current is before, "what is refused changes nothing"


@pytest.mark.parametrize(
    ("metadata", "data", "tokens", "accepted"),
    [
        (Kind.ENCRYPT, Kind.NONE, [GCM], True),
        (Kind.NONE, Kind.ENCRYPT, [GCM], True),
        (Kind.ENCRYPT, Kind.ENCRYPT, [GCM], True),  # one key for both: so does Fast DDS
        (Kind.SIGN, Kind.ENCRYPT, [GMAC, GCM], True),
        (Kind.SIGN, Kind.ENCRYPT, [GCM, GMAC], False),
        (Kind.SIGN, Kind.ENCRYPT, [GMAC], False),
        (Kind.NONE, Kind.NONE, [], True),
        (Kind.NONE, Kind.NONE, [GCM, GCM], True),
        (Kind.NONE, Kind.ENCRYPT, [], False),
        (Kind.ENCRYPT, Kind.NONE, [NONE_TOKEN], False),
        (Kind.ENCRYPT_WITH_ORIGIN, Kind.ENCRYPT, [GCM_FOR_US, GCM], True),
        (Kind.ENCRYPT_WITH_ORIGIN, Kind.ENCRYPT, [GCM, GCM_FOR_US], False),
        (Kind.ENCRYPT, Kind.ENCRYPT, [GCM, GCM, GCM], False),
        (Kind.ENCRYPT, Kind.ENCRYPT, [GCM, MALFORMED], False),
    ],
)
def test_which_tokens_of_a_writer_are_taken(metadata: Kind, data: Kind, tokens: Tokens, accepted: bool) -> None:
    alice, bob = pair()
    found = match(alice, bob, endpoint_attributes(metadata, data))
    before = found.remote_writer.ring.current, found.remote_writer.payload_ring.current
    refused = bob.plugin.set_remote_datawriter_crypto_tokens(found.reader, found.remote_writer, tokens)
    assert (refused is None) is accepted
    if not accepted:
        assert (found.remote_writer.ring.current, found.remote_writer.payload_ring.current) == before


@pytest.mark.parametrize(
    ("metadata", "data", "tokens", "accepted"),
    [
        (Kind.NONE, Kind.ENCRYPT, [NONE_TOKEN], True),
        (Kind.NONE, Kind.ENCRYPT, [], True),
        (Kind.NONE, Kind.ENCRYPT, [GMAC], True),  # so does Fast DDS
        (Kind.SIGN, Kind.NONE, [GMAC], True),
        (Kind.SIGN, Kind.NONE, [GMAC, GMAC], True),
        (Kind.SIGN, Kind.NONE, [GCM], False),
        (Kind.SIGN, Kind.NONE, [], False),
        (Kind.SIGN_WITH_ORIGIN, Kind.NONE, [GMAC], False),
        (Kind.NONE, Kind.ENCRYPT, [MALFORMED], False),
    ],
)
def test_which_tokens_of_a_reader_are_taken(metadata: Kind, data: Kind, tokens: Tokens, accepted: bool) -> None:
    alice, bob = pair()
    found = match(alice, bob, endpoint_attributes(metadata, data))
    before = found.remote_reader.ring.current
    refused = alice.plugin.set_remote_datareader_crypto_tokens(found.writer, found.remote_reader, tokens)
    assert (refused is None) is accepted
    if not accepted:
        assert found.remote_reader.ring.current is before


def test_volatile_endpoints_exchange_no_tokens() -> None:
    alice, bob = pair()
    found = volatile_match(alice, bob)
    assert list(writers_tokens(alice, found)) == list(readers_tokens(bob, found)) == []
    into, out = bob.plugin, alice.plugin
    assert into.set_remote_datawriter_crypto_tokens(found.reader, found.remote_writer, [GCM]) is not None
    assert out.set_remote_datareader_crypto_tokens(found.writer, found.remote_reader, [GCM]) is not None


def test_new_tokens_forget_the_ids_of_keys_that_are_gone() -> None:
    """A peer that sends new keys again and again does not fill the index."""
    alice, bob = pair()
    found = match(alice, bob, endpoint_attributes(Kind.ENCRYPT))
    for number in range(1, 50):
        new = material()
        new.sender_key_id = number.to_bytes(4, "big")
        refused = bob.plugin.set_remote_datawriter_crypto_tokens(found.reader, found.remote_writer, [new.to_token()])
        assert refused is None
    assert len(bob.remote(alice).senders) == 2


def test_returning_tokens_is_no_error() -> None:
    Participant(1).plugin.return_crypto_tokens([GCM])
