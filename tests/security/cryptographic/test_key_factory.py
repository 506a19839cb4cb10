"""Keys of entities: which are made, of which kind and size, and that nothing is left of them."""

from __future__ import annotations

import pytest

from ddsi.structure.errors import ConfigurationError
from ddsi.structure.qos_policies import BinaryProperty, Properties, Property
from ddsi_security.cryptographic.session_keys import SendingKey
from ddsi_security.cryptographic.transformation import Protection, TransformationKind
from ddsi_security.properties import KEY_SIZE, MAX_BLOCKS_PER_SESSION
from tests.security.cryptographic.keys import (
    PROTECTED,
    SECRET,
    VOLATILE_READER,
    VOLATILE_WRITER,
    Kind,
    Participant,
    endpoint_attributes,
    match,
    pair,
    volatile_match,
)


def kind_of(key: SendingKey | None) -> str:
    return "NONE" if key is None else key.material.kind.name


@pytest.mark.parametrize("bits", [128, 256])
@pytest.mark.parametrize(("encrypted", "transformation"), [(False, "GMAC"), (True, "GCM")])
def test_protection_and_size_make_the_kind(encrypted: bool, transformation: str, bits: int) -> None:
    found = Protection(encrypted).kind(bits)
    assert (found.name, found.key_length, found.encrypts) == (f"AES{bits}_{transformation}", bits // 8, encrypted)


@pytest.mark.parametrize(
    ("rtps", "kind"),
    [
        (Kind.NONE, "NONE"),
        (Kind.SIGN, "AES256_GMAC"),
        (Kind.ENCRYPT, "AES256_GCM"),
        (Kind.SIGN_WITH_ORIGIN, "AES256_GMAC"),
        (Kind.ENCRYPT_WITH_ORIGIN, "AES256_GCM"),
    ],
)
def test_a_participant_has_the_key_of_its_messages(rtps: Kind, kind: str) -> None:
    alice, bob = pair(rtps)
    assert kind_of(alice.handle.key) == kind
    assert (alice.remote(bob).receiver_key is not None) is rtps.value[2]


@pytest.mark.parametrize("metadata", list(Kind))
@pytest.mark.parametrize("data", [Kind.NONE, Kind.SIGN, Kind.ENCRYPT])
def test_a_writer_has_a_key_for_each_protection_and_a_reader_one(metadata: Kind, data: Kind) -> None:
    names = {Kind.NONE: "NONE", Kind.SIGN: "AES256_GMAC", Kind.ENCRYPT: "AES256_GCM"}
    metadata_name = "NONE" if metadata is Kind.NONE else "AES256_GCM" if metadata.value[1] else "AES256_GMAC"
    alice, bob = pair()
    found = match(alice, bob, endpoint_attributes(metadata, data))
    assert kind_of(found.writer.submessage_key) == kind_of(found.reader.submessage_key) == metadata_name
    assert kind_of(found.writer.payload_key) == names[data]
    assert (found.remote_reader.receiver_key is not None) is metadata.value[2]
    assert (found.remote_writer.receiver_key is not None) is metadata.value[2]


@pytest.mark.parametrize(
    ("participant", "endpoint", "expected"),
    [
        ({}, {}, ("AES256_GCM", "AES256_GCM")),
        ({KEY_SIZE: "128"}, {}, ("AES128_GCM", "AES128_GCM")),
        ({KEY_SIZE: "128"}, {KEY_SIZE: "256"}, ("AES128_GCM", "AES256_GCM")),
        ({}, {KEY_SIZE: Property("128")}, ("AES256_GCM", "AES128_GCM")),
    ],
)
def test_the_participants_key_size_is_the_endpoints_default(
    participant: Properties, endpoint: Properties, expected: tuple[str, str]
) -> None:
    alice = Participant(1, Kind.ENCRYPT, participant)
    writer = alice.plugin.register_local_datawriter(
        alice.handle, endpoint, endpoint_attributes(Kind.ENCRYPT, Kind.ENCRYPT)
    )
    assert (kind_of(alice.handle.key), kind_of(writer.submessage_key)) == expected
    assert kind_of(writer.payload_key) == expected[1]


@pytest.mark.parametrize("name", [KEY_SIZE, MAX_BLOCKS_PER_SESSION])
@pytest.mark.parametrize("text", ["", "0", "-1", "192", "256 ", "٢٥٦", "9" * 19, "1" * 5000, "many"])
def test_wrong_properties_are_named_with_their_remedy(name: str, text: str) -> None:
    if (name, text) == (MAX_BLOCKS_PER_SESSION, "192"):
        text = "1.5"
    with pytest.raises(ConfigurationError, match=name) as error:
        Participant(1, properties={name: text})
    assert "set it to" in str(error.value)


def test_properties_that_nobody_knows_are_refused() -> None:
    alice = Participant(1)
    with pytest.raises(ConfigurationError, match="did you mean"):
        alice.plugin.register_local_datawriter(
            alice.handle, {"dds.sec.crypto.keysizes": "128"}, endpoint_attributes(Kind.SIGN)
        )
    with pytest.raises(ConfigurationError, match="text"):
        alice.plugin.register_local_datareader(
            alice.handle, {KEY_SIZE: BinaryProperty(b"128")}, endpoint_attributes(Kind.SIGN)
        )


def test_max_blocks_ends_sessions_of_everything() -> None:
    alice = Participant(1, Kind.SIGN, {MAX_BLOCKS_PER_SESSION: "1"})
    key = alice.handle.key
    assert key is not None
    first, second = key.next_header(0), key.next_header(0)
    assert first is not None
    assert second is not None
    assert first[8:12] != second[8:12]


def test_key_ids_are_unique_and_never_zero() -> None:
    handle = Participant(1).handle
    handle._last_key_id = 0xFFFFFFFE
    assert [handle.new_key_id() for _ in range(3)] == [b"\xff\xff\xff\xff", b"\0\0\0\1", b"\0\0\0\2"]
    handle._last_key_id = 0
    assert handle.new_key_id() == b"\0\0\0\1"


def test_volatile_endpoints_have_no_keys_of_their_own() -> None:
    alice, bob = pair()
    found = volatile_match(alice, bob)
    assert found.writer.submessage_key is found.writer.payload_key is found.reader.submessage_key is None
    assert found.remote_reader.ring is alice.remote(bob).exchange_ring
    assert found.remote_writer.ring is bob.remote(alice).exchange_ring


def test_only_the_volatile_names_mean_the_pairwise_key() -> None:
    alice = Participant(1)
    attributes = endpoint_attributes(Kind.SIGN)
    writer = alice.plugin.register_local_datawriter(alice.handle, VOLATILE_READER, attributes)
    reader = alice.plugin.register_local_datareader(alice.handle, VOLATILE_WRITER, attributes)
    assert not writer.is_volatile
    assert not reader.is_volatile
    assert kind_of(writer.submessage_key) == kind_of(reader.submessage_key) == "AES256_GMAC"


# --- unregistering ---------------------------------------------------------------------------------------------------


def test_a_remote_endpoint_leaves_nothing_behind() -> None:
    alice, bob = pair(Kind.ENCRYPT_WITH_ORIGIN)
    found = match(alice, bob, endpoint_attributes(Kind.ENCRYPT_WITH_ORIGIN, Kind.ENCRYPT))
    received = [found.remote_writer.ring.current, found.remote_writer.payload_ring.current]
    remote = bob.remote(alice)
    assert remote.senders
    bob.plugin.unregister_datawriter(found.remote_writer)
    assert not remote.senders
    assert not remote.endpoints
    assert not found.reader.matched
    assert found.remote_writer.ring.current is None
    assert not any(any(key.material.master_sender_key) for key in received if key is not None)
    assert found.reader.submessage_key is not None, "its own keys are for others, too"
    assert found.remote_writer.receiver_key is None
    alice.plugin.unregister_datareader(found.remote_reader)
    assert found.remote_reader.receiver_key is None
    assert not found.writer.matched
    assert not alice.remote(bob).senders


def test_a_local_endpoint_takes_its_matches_along() -> None:
    alice, bob = pair()
    found = match(alice, bob, endpoint_attributes(Kind.ENCRYPT, Kind.ENCRYPT))
    keys = [found.writer.submessage_key, found.writer.payload_key]
    alice.plugin.unregister_datawriter(found.writer)
    bob.plugin.unregister_datareader(found.reader)
    assert not alice.handle.endpoints
    assert not alice.remote(bob).endpoints
    assert not bob.handle.endpoints
    assert not bob.remote(alice).senders
    assert all(key is not None and key.next_header(16) is None for key in keys)
    assert found.writer.submessage_key is found.writer.payload_key is found.reader.submessage_key is None


def test_a_remote_participant_takes_its_endpoints_along() -> None:
    alice, bob = pair(Kind.SIGN)
    user, volatile = match(alice, bob, endpoint_attributes(Kind.SIGN)), volatile_match(alice, bob)
    remote = alice.remote(bob)
    exchange_key = remote.exchange_key
    alice.plugin.unregister_participant(remote)
    assert not alice.handle.remotes
    assert not user.writer.matched
    assert not volatile.writer.matched
    assert remote.volatile_reader is None
    assert remote.exchange_key is None
    assert remote.ring.current is remote.exchange_ring.current is None
    assert exchange_key is not None
    assert not any(exchange_key.material.master_sender_key)
    assert user.writer.submessage_key is not None


def test_a_local_participant_takes_everything_along() -> None:
    alice, bob = pair(Kind.SIGN)
    found = match(alice, bob, endpoint_attributes(Kind.SIGN, Kind.SIGN))
    remote = alice.remote(bob)
    alice.plugin.unregister_participant(alice.handle)
    assert not alice.handle.remotes
    assert not alice.handle.endpoints
    assert alice.handle.key is remote.exchange_key is found.writer.submessage_key is found.writer.payload_key is None


def test_unregistering_a_volatile_endpoint_leaves_the_pairwise_key() -> None:
    alice, bob = pair()
    found = volatile_match(alice, bob)
    remote = bob.remote(alice)
    bob.plugin.unregister_datawriter(found.remote_writer)
    assert remote.volatile_writer is None
    assert remote.exchange_ring.current is not None
    again = bob.plugin.register_matched_remote_datawriter(found.reader, remote, SECRET)
    assert remote.volatile_writer is again


# --- reprs -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", PROTECTED)
def test_no_repr_shows_a_key(kind: Kind) -> None:
    alice, bob = pair(kind)
    found = match(alice, bob, endpoint_attributes(kind, kind))
    handles = [alice.handle, alice.remote(bob), found.writer, found.remote_reader, found.reader, found.remote_writer]
    key = found.writer.submessage_key
    assert key is not None
    assert key.material.sender_key_id.hex() in repr(found.writer)
    assert key.material.sender_key_id.hex() in repr(found.remote_writer)
    for handle in handles:
        assert len(repr(handle)) < 120
        assert "bytearray" not in repr(handle)
        assert TransformationKind.AES256_GCM.name in repr(handle) or "GMAC" in repr(handle)
