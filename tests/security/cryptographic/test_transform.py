"""What goes in comes out, for those it is meant for and for nobody else."""

from __future__ import annotations

import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ddsi.spi import NOT_FOR_US, NoKeys, Octets, Outcome, Overhead, Refused, Rejected
from ddsi_security.crypto_key_plugins import CryptoKeyExchange, CryptoKeyFactory
from ddsi_security.crypto_transform_plugin import CryptoTransform, SecureSubmessageCategory
from ddsi_security.cryptographic.aes_gcm import LARGE
from ddsi_security.properties import KEY_SIZE, MAX_BLOCKS_PER_SESSION
from tests.security.cryptographic import vectors
from tests.security.cryptographic.keys import (
    PROTECTED,
    Kind,
    Match,
    Participant,
    endpoint_attributes,
    introduce,
    match,
    octets_of,
    pair,
    volatile_match,
)

SIZES = [4, 8, 64, 1024, LARGE - 4, LARGE, LARGE + 4, 65_000]
PAYLOAD_KINDS = [Kind.SIGN, Kind.ENCRYPT]


def some(length: int) -> bytes:
    return random.Random(length).randbytes(length)


def submessage(length: int) -> bytes:
    """A DATA of so many octets, its header included; of 4 octets, a PAD."""
    if length == 4:
        return b"\x01\x01\0\0"  # which may be empty: to others, a length of 0 means "to the end"
    return b"\x15\x05" + (length - 4).to_bytes(2, "little") + some(length - 4)


def message(*submessages: bytes) -> bytes:
    return vectors.MESSAGE_HEADER + b"".join(submessages)


def sealed_payload(alice: Participant, found: Match, plain: Octets) -> bytes:
    return octets_of(alice.plugin.encode_serialized_payload(bytearray(), plain, found.writer))


def sealed_submessage(alice: Participant, found: Match, plain: Octets, *others: Match) -> bytes:
    readers = [one.remote_reader for one in (found, *others)]
    return octets_of(alice.plugin.encode_datawriter_submessage((plain,), found.writer, readers))


def sealed_answer(bob: Participant, found: Match, plain: Octets) -> bytes:
    return octets_of(bob.plugin.encode_datareader_submessage((plain,), found.reader, [found.remote_writer]))


def sealed_message(alice: Participant, plain: Octets, *receivers: Participant) -> bytes:
    remotes = [alice.remote(receiver) for receiver in receivers]
    return octets_of(alice.plugin.encode_rtps_message((plain,), alice.handle, remotes))


def opened_payload(bob: Participant, found: Match, octets: Octets) -> Octets | Outcome:
    return bob.plugin.decode_serialized_payload(octets, b"", found.reader, found.remote_writer)


def opened_submessage(bob: Participant, found: Match, octets: Octets) -> Octets | Outcome:
    return bob.plugin.decode_datawriter_submessage(octets, found.reader, found.remote_writer)


def opened_answer(alice: Participant, found: Match, octets: Octets) -> Octets | Outcome:
    return alice.plugin.decode_datareader_submessage(octets, found.writer, found.remote_reader)


def opened_message(bob: Participant, octets: Octets, sender: Participant) -> Octets | Outcome:
    return bob.plugin.decode_rtps_message(octets, bob.handle, bob.remote(sender))


def opened_by_id(bob: Participant, octets: Octets, sender: Participant) -> Octets | Outcome:
    """As a service does that knows the sending participant alone."""
    found = bob.plugin.preprocess_secure_submsg(octets, bob.handle, bob.remote(sender))
    if isinstance(found, Outcome):
        return found
    assert found.datawriter is not None
    assert found.datareader is not None
    if found.category is SecureSubmessageCategory.DATAREADER_SUBMESSAGE:
        return bob.plugin.decode_datareader_submessage(octets, found.datawriter, found.datareader)
    return bob.plugin.decode_datawriter_submessage(octets, found.datareader, found.datawriter)


# --- round trips -----------------------------------------------------------------------------------------------------


def test_it_is_all_three_plugins() -> None:
    """Which mypy checks here."""
    plugin = Participant(1).plugin
    factory: CryptoKeyFactory = plugin
    exchange: CryptoKeyExchange = plugin
    transform: CryptoTransform = plugin
    assert {id(factory), id(exchange), id(transform)} == {id(plugin)}


@pytest.mark.parametrize("of", [bytes, bytearray, memoryview])
@pytest.mark.parametrize("size", [*SIZES, 1 << 20])
@pytest.mark.parametrize("kind", PAYLOAD_KINDS)
def test_payloads(kind: Kind, size: int, of: type) -> None:
    alice, bob = pair()
    found = match(alice, bob, endpoint_attributes(Kind.NONE, kind))
    plain = some(size)
    octets = sealed_payload(alice, found, of(plain))
    assert opened_payload(bob, found, of(octets)) == plain
    assert (plain in octets) is (kind is Kind.SIGN)


@given(st.integers(1, 5000), st.sampled_from(PAYLOAD_KINDS))
def test_payloads_are_padded_to_a_multiple_of_4(size: int, kind: Kind) -> None:
    """Of a fragment, what is behind the sample's end is cut off later."""
    alice, bob = pair()
    found = match(alice, bob, endpoint_attributes(Kind.NONE, kind))
    octets = sealed_payload(alice, found, some(size))
    assert len(octets) % 4 == 0
    assert opened_payload(bob, found, octets) == some(size) + bytes(-size % 4)


@pytest.mark.parametrize("of", [bytes, bytearray, memoryview])
@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("kind", PROTECTED)
def test_submessages(kind: Kind, size: int, of: type) -> None:
    alice, bob = pair()
    found = match(alice, bob, endpoint_attributes(kind))
    plain = submessage(size)
    octets = sealed_submessage(alice, found, of(plain))
    assert opened_submessage(bob, found, of(octets)) == plain
    assert opened_by_id(bob, of(octets), alice) == plain
    answer = sealed_answer(bob, found, of(plain))
    assert opened_answer(alice, found, of(answer)) == plain
    assert opened_by_id(alice, of(answer), bob) == plain


@pytest.mark.parametrize("of", [bytes, bytearray, memoryview])
@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("kind", PROTECTED)
def test_messages(kind: Kind, size: int, of: type) -> None:
    alice, bob = pair(kind)
    plain = message(vectors.HEARTBEAT, submessage(size))
    assert opened_message(bob, of(sealed_message(alice, of(plain), bob)), alice) == plain


@settings(max_examples=30)
@given(st.lists(st.integers(1, 300), max_size=20), st.sampled_from(PROTECTED), st.sampled_from(["128", "256"]))
def test_everything_within_everything(sizes: list[int], kind: Kind, key_size: str) -> None:
    """Payload in submessage in message, with keys of either size and sessions that end all the time."""
    properties = {KEY_SIZE: key_size, MAX_BLOCKS_PER_SESSION: "7"}
    alice, bob = Participant(1, kind, properties), Participant(2, kind, properties)
    introduce(alice, bob)
    found = match(alice, bob, endpoint_attributes(kind, kind))
    plains = [bytes(4 * size) for size in sizes]
    submessages = []
    for plain in plains:
        payload = sealed_payload(alice, found, plain)
        data = b"\x15\x05" + len(payload).to_bytes(2, "little") + payload
        submessages.append(sealed_submessage(alice, found, data))
    opened = opened_message(bob, sealed_message(alice, message(*submessages), bob), alice)
    assert opened == message(*submessages)
    for plain, protected in zip(plains, submessages, strict=True):
        data_again = opened_submessage(bob, found, protected)
        assert not isinstance(data_again, Outcome)
        assert opened_payload(bob, found, data_again[4:]) == plain


def test_a_message_without_submessages_survives() -> None:
    alice, bob = pair(Kind.ENCRYPT)
    assert opened_message(bob, sealed_message(alice, message(), bob), alice) == message()


def test_ciphertext_is_never_the_same_twice() -> None:
    alice, bob = pair(Kind.ENCRYPT)
    found = match(alice, bob, endpoint_attributes(Kind.ENCRYPT, Kind.ENCRYPT))
    assert sealed_payload(alice, found, bytes(64)) != sealed_payload(alice, found, bytes(64))
    assert sealed_submessage(alice, found, vectors.HEARTBEAT) != sealed_submessage(alice, found, vectors.HEARTBEAT)
    assert sealed_message(alice, vectors.MESSAGE, bob) != sealed_message(alice, vectors.MESSAGE, bob)


# --- overhead --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", PROTECTED)
@pytest.mark.parametrize("receivers", [1, 2, 5])
def test_overhead_is_what_is_added_at_most(kind: Kind, receivers: int) -> None:
    alice = Participant(1, kind)
    others = [Participant(seed, kind) for seed in range(2, 2 + receivers)]
    for other in others:
        introduce(alice, other)
    attributes = endpoint_attributes(kind, kind)
    first = match(alice, others[0], attributes)
    rest = [match(alice, other, attributes, writer=first.writer) for other in others[1:]]
    of_writer = alice.plugin.overhead(first.writer, receivers)
    of_reader = others[0].plugin.overhead(first.reader, receivers)
    of_participant = alice.plugin.overhead(alice.handle, receivers)
    assert of_reader == Overhead(submessage=of_writer.submessage)
    payload = max(len(sealed_payload(alice, first, bytes(size))) - size for size in range(1, 9))
    # What is signed is a multiple of 4 already.
    sizes = range(4, 12) if kind.value[1] else (4, 8)
    whole = max(len(sealed_submessage(alice, first, submessage(size), *rest)) - size for size in sizes)
    assert of_writer == Overhead(payload=payload, submessage=whole)
    head = len(vectors.MESSAGE_HEADER)
    whole = max(len(sealed_message(alice, message(submessage(size)), *others)) - size - head for size in sizes)
    assert of_participant == Overhead(message=whole)


def test_what_is_not_protected_has_no_overhead() -> None:
    alice, bob = pair()
    found = match(alice, bob, endpoint_attributes(Kind.NONE))
    for sender in (alice.handle, found.writer, found.reader):
        assert alice.plugin.overhead(sender, 3) == Overhead()


# --- receivers -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", [Kind.SIGN_WITH_ORIGIN, Kind.ENCRYPT_WITH_ORIGIN])
def test_each_receiver_verifies_its_own_mac(kind: Kind) -> None:
    alice, bob, carol = (Participant(seed, kind) for seed in (1, 2, 3))
    introduce(alice, bob)
    introduce(alice, carol)
    attributes = endpoint_attributes(kind)
    to_bob = match(alice, bob, attributes)
    to_carol = match(alice, carol, attributes, writer=to_bob.writer)
    both = sealed_submessage(alice, to_bob, vectors.HEARTBEAT, to_carol)
    assert opened_submessage(bob, to_bob, both) == opened_submessage(carol, to_carol, both) == vectors.HEARTBEAT
    one = sealed_submessage(alice, to_bob, vectors.HEARTBEAT)
    assert opened_submessage(carol, to_carol, one) is NOT_FOR_US
    both = sealed_message(alice, vectors.MESSAGE, bob, carol)
    assert opened_message(bob, both, alice) == opened_message(carol, both, alice) == vectors.MESSAGE
    assert opened_message(carol, sealed_message(alice, vectors.MESSAGE, bob), alice) is NOT_FOR_US


def test_a_fellow_receiver_cannot_pass_for_the_sender() -> None:
    """Carol knows the writer's key, and so its common MAC; not the one between the writer and bob."""
    alice, bob, carol = (Participant(seed) for seed in (1, 2, 3))
    introduce(alice, bob)
    introduce(alice, carol)
    attributes = endpoint_attributes(Kind.ENCRYPT_WITH_ORIGIN)
    to_bob = match(alice, bob, attributes)
    to_carol = match(alice, carol, attributes, writer=to_bob.writer)
    genuine = sealed_submessage(alice, to_bob, vectors.HEARTBEAT, to_carol)
    macs_at = len(genuine) - 40
    bobs_id, carols_mac = genuine[macs_at : macs_at + 4], genuine[macs_at + 24 :]
    forged = genuine[:macs_at] + bobs_id + carols_mac + genuine[macs_at + 20 :]
    assert isinstance(opened_submessage(bob, to_bob, forged), Rejected)
    assert opened_submessage(carol, to_carol, forged) == vectors.HEARTBEAT


def test_macs_that_nobody_expects_are_ignored() -> None:
    alice, bob = pair()
    strict = match(alice, bob, endpoint_attributes(Kind.ENCRYPT_WITH_ORIGIN))
    tokens = alice.plugin.create_local_datawriter_crypto_tokens(strict.writer, strict.remote_reader)
    lax = match(alice, bob, endpoint_attributes(Kind.ENCRYPT))
    assert bob.plugin.set_remote_datawriter_crypto_tokens(lax.reader, lax.remote_writer, tokens) is None
    octets = sealed_submessage(alice, strict, vectors.HEARTBEAT)
    assert opened_submessage(bob, lax, octets[:-16] + bytes(16)) == vectors.HEARTBEAT


def test_without_receivers_nobody_can_verify_the_origin() -> None:
    alice, bob = pair()
    found = match(alice, bob, endpoint_attributes(Kind.SIGN_WITH_ORIGIN))
    assert isinstance(alice.plugin.encode_datawriter_submessage((vectors.HEARTBEAT,), found.writer, []), Refused)


# --- whose it is -----------------------------------------------------------------------------------------------------


def test_the_key_id_tells_writer_from_reader() -> None:
    alice, bob = pair()
    found = match(alice, bob, endpoint_attributes(Kind.SIGN))
    of_writer = bob.plugin.preprocess_secure_submsg(
        sealed_submessage(alice, found, vectors.HEARTBEAT), bob.handle, bob.remote(alice)
    )
    of_reader = alice.plugin.preprocess_secure_submsg(
        sealed_answer(bob, found, vectors.HEARTBEAT), alice.handle, alice.remote(bob)
    )
    assert not isinstance(of_writer, Outcome)
    assert not isinstance(of_reader, Outcome)
    assert of_writer.category is SecureSubmessageCategory.DATAWRITER_SUBMESSAGE
    assert (of_writer.datawriter, of_writer.datareader) == (found.remote_writer, found.reader)
    assert of_reader.category is SecureSubmessageCategory.DATAREADER_SUBMESSAGE
    assert (of_reader.datawriter, of_reader.datareader) == (found.writer, found.remote_reader)


@pytest.mark.parametrize("kind", [Kind.SIGN_WITH_ORIGIN, Kind.ENCRYPT_WITH_ORIGIN])
def test_of_several_local_readers_the_one_addressed_is_found(kind: Kind) -> None:
    alice, bob = pair()
    attributes = endpoint_attributes(kind)
    first = match(alice, bob, attributes)
    others = [match(alice, bob, attributes, writer=first.writer) for _ in range(3)]
    for to in (first, *others):
        octets = sealed_submessage(alice, to, vectors.HEARTBEAT)  # the writer is that of all
        found = bob.plugin.preprocess_secure_submsg(octets, bob.handle, bob.remote(alice))
        assert not isinstance(found, Outcome)
        assert found.datareader is to.reader
        assert opened_by_id(bob, octets, alice) == vectors.HEARTBEAT
        cut = bob.plugin.preprocess_secure_submsg(octets[:-1], bob.handle, bob.remote(alice))
        assert isinstance(cut, Rejected)
    for_all = sealed_submessage(alice, first, vectors.HEARTBEAT, *others)
    assert opened_by_id(bob, for_all, alice) == vectors.HEARTBEAT


def test_a_key_id_means_something_with_its_participant_alone() -> None:
    alice, bob, carol = (Participant(1), Participant(2), Participant(1))  # alice and carol have the same ids
    introduce(alice, bob)
    introduce(carol, bob)
    found, other = (match(one, bob, endpoint_attributes(Kind.ENCRYPT)) for one in (alice, carol))
    assert found.writer.submessage_key is not None
    assert other.writer.submessage_key is not None
    key_id = found.writer.submessage_key.material.sender_key_id
    assert key_id == other.writer.submessage_key.material.sender_key_id
    bob.plugin.unregister_datawriter(other.remote_writer)
    octets = sealed_submessage(alice, found, vectors.HEARTBEAT)
    assert opened_by_id(bob, octets, alice) == vectors.HEARTBEAT
    assert opened_by_id(bob, octets, carol) == NoKeys(key_id)


def test_what_comes_before_its_tokens_has_no_keys() -> None:
    alice, bob = pair(Kind.SIGN)
    found = match(alice, bob, endpoint_attributes(Kind.SIGN, Kind.SIGN))
    for rings in (found.remote_writer.ring, found.remote_writer.payload_ring, bob.remote(alice).ring):
        rings.wipe()
    submessage, payload = sealed_submessage(alice, found, vectors.HEARTBEAT), sealed_payload(alice, found, bytes(8))
    assert opened_submessage(bob, found, submessage) == NoKeys(submessage[8:12])
    assert opened_payload(bob, found, payload) == NoKeys(payload[4:8])
    protected = sealed_message(alice, vectors.MESSAGE, bob)
    assert opened_message(bob, protected, alice) == NoKeys(protected[28:32])
    bob.plugin.unregister_datawriter(found.remote_writer)
    assert opened_by_id(bob, submessage, alice) == NoKeys(submessage[8:12])


def test_keys_that_nobody_asked_for_open_all_the_same() -> None:
    """Fast DDS sends such keys, of kind AES256_GMAC, where messages are not protected."""
    alice, bob = Participant(1, Kind.SIGN), Participant(2)
    alice.authenticated(bob, is_replier=False)
    bob.authenticated(alice, is_replier=True)
    bob.take_tokens(alice)
    assert opened_message(bob, sealed_message(alice, vectors.MESSAGE, bob), alice) == vectors.MESSAGE


@pytest.mark.parametrize(("sent", "due"), [(Kind.SIGN, Kind.ENCRYPT), (Kind.ENCRYPT, Kind.SIGN)])
def test_another_protection_than_is_due_is_rejected(sent: Kind, due: Kind) -> None:
    """Even where the key is genuine: a peer that signs only shall not be taken for one that encrypts."""
    alice, bob = pair()
    found, expected = (match(alice, bob, endpoint_attributes(kind, kind)) for kind in (sent, due))
    expected.remote_writer.ring = found.remote_writer.ring
    expected.remote_writer.payload_ring = found.remote_writer.payload_ring
    for outcome in (
        opened_submessage(bob, expected, sealed_submessage(alice, found, vectors.HEARTBEAT)),
        opened_payload(bob, expected, sealed_payload(alice, found, bytes(8))),
    ):
        assert isinstance(outcome, Rejected)
        assert "is to be" in outcome.reason


# --- volatile --------------------------------------------------------------------------------------------------------


def both_ways() -> tuple[Participant, Participant, Match, Match]:
    alice, bob = pair()
    return alice, bob, volatile_match(alice, bob), volatile_match(bob, alice)


def test_volatile_submessages_go_both_ways_and_back() -> None:
    alice, bob, out, back = both_ways()
    for sender, receiver, found in ((alice, bob, out), (bob, alice, back)):
        octets = sealed_submessage(sender, found, vectors.VOLATILE_HEARTBEAT)
        assert octets[4:12] == b"\0\0\0\4" + bytes(4)
        assert opened_by_id(receiver, octets, sender) == vectors.VOLATILE_HEARTBEAT
        answer = sealed_answer(receiver, found, vectors.VOLATILE_HEARTBEAT)
        assert opened_by_id(sender, answer, receiver) == vectors.VOLATILE_HEARTBEAT


def test_either_decoder_opens_volatile_submessages() -> None:
    alice, bob, out, _ = both_ways()
    octets = sealed_submessage(alice, out, vectors.VOLATILE_HEARTBEAT)
    found = bob.plugin.preprocess_secure_submsg(octets, bob.handle, bob.remote(alice))
    assert not isinstance(found, Outcome)
    assert found.category is SecureSubmessageCategory.INFO_SUBMESSAGE
    assert found.datawriter is not None
    assert found.datareader is not None
    one = bob.plugin.decode_datawriter_submessage(octets, found.datareader, found.datawriter)
    other = bob.plugin.decode_datareader_submessage(octets, found.datawriter, found.datareader)
    assert one == other == vectors.VOLATILE_HEARTBEAT


@settings(max_examples=20)
@given(st.integers(0, 2**32), st.sampled_from(["1", "5", str(2**32)]))
def test_nothing_under_a_pairwise_key_shares_a_nonce(seed: int, max_blocks: str) -> None:
    """Writer and reader of both sides encrypt with it: four senders, each side with one counter."""
    properties = {MAX_BLOCKS_PER_SESSION: max_blocks}
    alice, bob = Participant(seed, properties=properties), Participant(seed, properties=properties)
    introduce(alice, bob)
    out, back = volatile_match(alice, bob), volatile_match(bob, alice)
    nonces = []
    for _ in range(10):
        for sender, receiver, found in ((alice, bob, out), (bob, alice, back)):
            nonces.append(sealed_submessage(sender, found, vectors.VOLATILE_HEARTBEAT)[12:24])
            nonces.append(sealed_answer(receiver, found, vectors.VOLATILE_HEARTBEAT)[12:24])
    assert len(set(nonces)) == len(nonces) == 40


def test_the_replier_is_told_by_the_highest_bit() -> None:
    alice, bob, out, back = both_ways()
    assert sealed_submessage(alice, out, vectors.VOLATILE_HEARTBEAT)[16] < 0x80
    assert sealed_submessage(bob, back, vectors.VOLATILE_HEARTBEAT)[16] >= 0x80
    assert sealed_answer(alice, back, vectors.VOLATILE_HEARTBEAT)[16] < 0x80
    assert sealed_answer(bob, out, vectors.VOLATILE_HEARTBEAT)[16] >= 0x80


def test_each_pair_has_its_own_key() -> None:
    alice, bob, out, _ = both_ways()
    octets = sealed_submessage(alice, out, vectors.VOLATILE_HEARTBEAT)
    key = bob.remote(alice).exchange_ring.current
    assert key is not None
    assert key.material.master_sender_key == vectors.EXCHANGE_KEY
    key.material.master_sender_key[0] ^= 1
    assert isinstance(opened_by_id(bob, octets, alice), Rejected)


def test_a_volatile_submessage_is_for_one() -> None:
    alice, _, out, _ = both_ways()
    for readers in ([], [out.remote_reader] * 2):
        refused = alice.plugin.encode_datawriter_submessage((vectors.VOLATILE_HEARTBEAT,), out.writer, readers)
        assert isinstance(refused, Refused)


def test_key_id_0_means_nothing_before_the_volatile_endpoints_are_known() -> None:
    alice, bob, out, _ = both_ways()
    octets = sealed_submessage(alice, out, vectors.VOLATILE_HEARTBEAT)
    bob.plugin.unregister_datawriter(out.remote_writer)
    assert opened_by_id(bob, octets, alice) == NoKeys(bytes(4))


# --- refusals --------------------------------------------------------------------------------------------------------


def test_without_keys_nothing_is_encoded() -> None:
    alice, bob = pair()
    found = match(alice, bob, endpoint_attributes(Kind.NONE))
    volatile = volatile_match(alice, bob)
    plugin = alice.plugin
    bob_handle = alice.remote(bob)
    plugin.unregister_participant(bob_handle)
    refusals = [
        plugin.encode_serialized_payload(bytearray(), bytes(8), found.writer),
        plugin.encode_datawriter_submessage((vectors.HEARTBEAT,), found.writer, [found.remote_reader]),
        plugin.encode_datawriter_submessage((vectors.HEARTBEAT,), volatile.writer, [volatile.remote_reader]),
        plugin.encode_datareader_submessage((vectors.HEARTBEAT,), found.reader, [found.remote_writer]),
        plugin.encode_rtps_message((vectors.MESSAGE,), alice.handle, [bob_handle]),
    ]
    assert all(isinstance(refused, Refused) for refused in refusals)


@pytest.mark.parametrize("kind", PROTECTED)
def test_a_key_that_is_used_up_encodes_nothing(kind: Kind) -> None:
    alice, bob = pair(kind)
    found = match(alice, bob, endpoint_attributes(kind, kind))
    for key in (found.writer.submessage_key, found.writer.payload_key, alice.handle.key):
        assert key is not None
        key.wipe()
    plugin = alice.plugin
    refusals = [
        plugin.encode_serialized_payload(bytearray(), bytes(8), found.writer),
        plugin.encode_datawriter_submessage((vectors.HEARTBEAT,), found.writer, [found.remote_reader]),
        plugin.encode_rtps_message((vectors.MESSAGE,), alice.handle, [alice.remote(bob)]),
    ]
    assert all(isinstance(refused, Refused) and "used up" in refused.reason for refused in refusals)


@pytest.mark.parametrize("kind", PROTECTED)
def test_there_is_a_short_way_of_sealing_where_all_receivers_get_the_same(kind: Kind) -> None:
    alice, bob = pair(kind)
    found = match(alice, bob, endpoint_attributes(kind, kind))
    plugin, others = alice.plugin, [alice.remote(bob)]
    writer, reader, readers, writers = found.writer, found.reader, [found.remote_reader], [found.remote_writer]
    beat = (vectors.HEARTBEAT,)
    for short, general, plain in (
        (plugin.submessage_sealer(writer, readers), plugin.encode_datawriter_submessage(beat, writer, readers), beat),
        (plugin.submessage_sealer(reader, writers), plugin.encode_datareader_submessage(beat, reader, writers), beat),
        (
            plugin.message_sealer(alice.handle, others),
            plugin.encode_rtps_message((vectors.MESSAGE,), alice.handle, others),
            (vectors.MESSAGE,),
        ),
    ):
        if kind in (Kind.SIGN, Kind.ENCRYPT):
            assert short is not None
            assert len(octets_of(short(plain))) == len(octets_of(general))
        else:
            assert short is None


@pytest.mark.parametrize("kind", PAYLOAD_KINDS)
def test_there_is_a_short_way_of_sealing_payloads_where_they_are_protected(kind: Kind) -> None:
    alice, bob = pair(kind)
    found, clear = match(alice, bob, endpoint_attributes(kind, kind)), match(alice, bob, endpoint_attributes(kind))
    assert alice.plugin.payload_sealer(clear.writer) is None
    seal = alice.plugin.payload_sealer(found.writer)
    assert seal is not None
    encoded = seal(bytes(8))
    assert not isinstance(encoded, Refused)
    assert bob.plugin.decode_serialized_payload(encoded, b"", found.reader, found.remote_writer) == bytes(8)


def test_the_volatile_endpoints_are_sealed_for_each_receiver_by_itself() -> None:
    alice, bob = pair(Kind.ENCRYPT)
    volatile = volatile_match(alice, bob)
    assert alice.plugin.submessage_sealer(volatile.writer, [volatile.remote_reader]) is None


def test_what_does_not_fit_its_envelope_is_refused() -> None:
    alice, bob = pair(Kind.ENCRYPT_WITH_ORIGIN)
    found = match(alice, bob, endpoint_attributes(Kind.ENCRYPT_WITH_ORIGIN))
    signs = match(alice, bob, endpoint_attributes(Kind.SIGN))
    encode, one = alice.plugin.encode_datawriter_submessage, [found.remote_reader]
    assert octets_of(encode((submessage(0xFFF8),), found.writer, one))
    refusals = [
        encode((bytes(0xFFF9),), found.writer, one),
        encode((vectors.HEARTBEAT,), found.writer, one * 3276),
        encode((bytes(33),), signs.writer, [signs.remote_reader]),
        alice.plugin.encode_rtps_message((message(bytes(0xFFF0)),), alice.handle, [alice.remote(bob)]),
    ]
    assert all(isinstance(refused, Refused) for refused in refusals)
