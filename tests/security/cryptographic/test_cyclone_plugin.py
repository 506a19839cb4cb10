"""Our plugin and the one of Cyclone DDS in one process: each takes the other's tokens and opens what it protected."""

from __future__ import annotations

import pytest

from ddsi_security.handles import IdentityHandle, PermissionsHandle, SharedSecretHandle
from tests.security.cryptographic import vectors
from tests.security.cryptographic.cyclone_plugin import PATHS, CyclonePlugin
from tests.security.cryptographic.keys import (
    PROTECTED,
    SECRET,
    VOLATILE_READER,
    VOLATILE_WRITER,
    Kind,
    Participant,
    endpoint_attributes,
    octets_of,
    participant_attributes,
)

pytestmark = [
    pytest.mark.peers,
    pytest.mark.skipif(not PATHS, reason="the cryptographic plugin of Cyclone DDS is not installed"),
]

PAYLOAD = {Kind.SIGN_WITH_ORIGIN: Kind.SIGN, Kind.ENCRYPT_WITH_ORIGIN: Kind.ENCRYPT}


class Meeting:
    """Alice is ours, bob is Cyclone's; they share a secret and have each other's participant tokens."""

    def __init__(self, kind: Kind) -> None:
        self.alice = Participant(1, kind)
        self.cyclone = CyclonePlugin(PATHS[0])
        attributes = participant_attributes(kind)
        self.bob = self.cyclone.register_local_participant(
            is_protected=attributes.is_rtps_protected, mask=attributes.plugin_participant_attributes
        )
        assert self.bob, self.cyclone.reason
        secret = SharedSecretHandle(vectors.CHALLENGE1, vectors.CHALLENGE2, vectors.SHARED_SECRET, is_replier=False)
        self.our_bob = self.alice.plugin.register_matched_remote_participant(
            self.alice.handle, IdentityHandle(), PermissionsHandle(), secret
        )
        self.their_alice = self.cyclone.register_matched_remote_participant(
            self.bob, vectors.CHALLENGE1, vectors.CHALLENGE2, vectors.SHARED_SECRET
        )
        assert self.their_alice, self.cyclone.reason
        plugin = self.alice.plugin
        ours = plugin.create_local_participant_crypto_tokens(self.alice.handle, self.our_bob)
        assert self.cyclone.set_tokens("participant", self.bob, self.their_alice, ours), self.cyclone.reason
        theirs = self.cyclone.create_tokens("participant", self.bob, self.their_alice)
        assert plugin.set_remote_participant_crypto_tokens(self.alice.handle, self.our_bob, theirs) is None


@pytest.mark.parametrize("kind", [Kind.NONE, *PROTECTED])
def test_tokens_of_participants_are_taken(kind: Kind) -> None:
    Meeting(kind)


@pytest.mark.parametrize("kind", PROTECTED)
def test_messages_both_ways(kind: Kind) -> None:
    met = Meeting(kind)
    plugin, cyclone = met.alice.plugin, met.cyclone
    buffer = octets_of(plugin.encode_rtps_message((vectors.MESSAGE,), met.alice.handle, [met.our_bob]))
    found = cyclone.decode_message(buffer, met.bob, met.their_alice)
    assert found == vectors.MESSAGE_HEADER + vectors.INFO_SOURCE + vectors.HEARTBEAT, cyclone.reason
    altered = bytearray(buffer)
    altered[60] ^= 1
    assert cyclone.decode_message(bytes(altered), met.bob, met.their_alice) is None
    theirs = cyclone.encode_message(vectors.MESSAGE, met.bob, [met.their_alice])
    assert theirs is not None, cyclone.reason
    assert plugin.decode_rtps_message(theirs, met.alice.handle, met.our_bob) == vectors.MESSAGE


@pytest.mark.parametrize("kind", PROTECTED)
def test_our_writer_and_their_reader(kind: Kind) -> None:
    met = Meeting(kind)
    plugin, cyclone = met.alice.plugin, met.cyclone
    attributes = endpoint_attributes(kind, PAYLOAD.get(kind, kind))
    writer = plugin.register_local_datawriter(met.alice.handle, {}, attributes)
    our_reader = plugin.register_matched_remote_datareader(writer, met.our_bob, SECRET, relay_only=False)
    mask = attributes.plugin_endpoint_attributes
    reader = cyclone.register_local("datareader", met.bob, flags=(True, True), mask=mask)
    their_writer = cyclone.register_matched_remote("datawriter", reader, met.their_alice)
    ours = plugin.create_local_datawriter_crypto_tokens(writer, our_reader)
    assert cyclone.set_tokens("datawriter", reader, their_writer, ours), cyclone.reason
    theirs = cyclone.create_tokens("datareader", reader, their_writer)
    assert plugin.set_remote_datareader_crypto_tokens(writer, our_reader, theirs) is None

    payload = octets_of(plugin.encode_serialized_payload(bytearray(), vectors.PAYLOAD, writer))
    assert cyclone.decode_payload(payload, reader, their_writer) == vectors.PAYLOAD, cyclone.reason
    submessage = octets_of(plugin.encode_datawriter_submessage((vectors.HEARTBEAT,), writer, [our_reader]))
    assert cyclone.decode_submessage(submessage, reader, their_writer) == vectors.HEARTBEAT, cyclone.reason


@pytest.mark.parametrize("kind", PROTECTED)
def test_their_writer_and_our_reader(kind: Kind) -> None:
    met = Meeting(kind)
    plugin, cyclone = met.alice.plugin, met.cyclone
    attributes = endpoint_attributes(kind, PAYLOAD.get(kind, kind))
    mask = attributes.plugin_endpoint_attributes
    writer = cyclone.register_local("datawriter", met.bob, flags=(True, True), mask=mask)
    their_reader = cyclone.register_matched_remote("datareader", writer, met.their_alice)
    reader = plugin.register_local_datareader(met.alice.handle, {}, attributes)
    our_writer = plugin.register_matched_remote_datawriter(reader, met.our_bob, SECRET)
    theirs = cyclone.create_tokens("datawriter", writer, their_reader)
    assert len(theirs) == 2
    assert plugin.set_remote_datawriter_crypto_tokens(reader, our_writer, theirs) is None
    ours = plugin.create_local_datareader_crypto_tokens(reader, our_writer)
    assert cyclone.set_tokens("datareader", writer, their_reader, ours), cyclone.reason

    payload = cyclone.encode_payload(vectors.PAYLOAD, writer)
    assert payload is not None, cyclone.reason
    assert plugin.decode_serialized_payload(payload, b"", reader, our_writer) == vectors.PAYLOAD
    submessage = cyclone.encode_submessage(vectors.HEARTBEAT, writer, [their_reader])
    assert submessage is not None, cyclone.reason
    assert plugin.decode_datawriter_submessage(submessage, reader, our_writer) == vectors.HEARTBEAT
    answer = octets_of(plugin.encode_datareader_submessage((vectors.HEARTBEAT,), reader, [our_writer]))
    assert cyclone.decode_answer(answer, writer, their_reader) == vectors.HEARTBEAT, cyclone.reason


def test_volatile_submessages_both_ways() -> None:
    met = Meeting(Kind.NONE)
    plugin, cyclone = met.alice.plugin, met.cyclone
    attributes = endpoint_attributes(Kind.ENCRYPT)
    our_local = plugin.register_local_datawriter(met.alice.handle, VOLATILE_WRITER, attributes)
    our_remote = plugin.register_matched_remote_datareader(our_local, met.our_bob, SECRET, relay_only=False)
    name = str(VOLATILE_READER["dds.sec.builtin_endpoint_name"])
    reader = cyclone.register_local("datareader", met.bob, flags=(True, False), mask=1, name=name)
    their_writer = cyclone.register_matched_remote("datawriter", reader, met.their_alice)
    buffer = octets_of(plugin.encode_datawriter_submessage((vectors.VOLATILE_HEARTBEAT,), our_local, [our_remote]))
    found = cyclone.decode_submessage(buffer, reader, their_writer)
    assert found == vectors.VOLATILE_HEARTBEAT, cyclone.reason

    our_reader = plugin.register_local_datareader(met.alice.handle, VOLATILE_READER, attributes)
    our_writer = plugin.register_matched_remote_datawriter(our_reader, met.our_bob, SECRET)
    name = str(VOLATILE_WRITER["dds.sec.builtin_endpoint_name"])
    writer = cyclone.register_local("datawriter", met.bob, flags=(True, False), mask=1, name=name)
    their_reader = cyclone.register_matched_remote("datareader", writer, met.their_alice)
    theirs = cyclone.encode_submessage(vectors.VOLATILE_HEARTBEAT, writer, [their_reader])
    assert theirs is not None, cyclone.reason
    assert plugin.decode_datawriter_submessage(theirs, our_reader, our_writer) == vectors.VOLATILE_HEARTBEAT
