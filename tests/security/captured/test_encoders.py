"""What our plugin encodes, the straight decoder decodes, with nothing but the tokens and the shared secret."""

from __future__ import annotations

from random import Random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ddsi.structure.guid import EntityId
from ddsi_security.cryptographic import AesGcmGmac
from ddsi_security.handles import IdentityHandle, ParticipantCryptoHandle, PermissionsHandle, SharedSecretHandle
from ddsi_security.properties import BUILTIN_ENDPOINT_NAME, KEY_SIZE
from ddsi_security.tokens import CryptoToken
from tests.security.captured.role import NOW, endpoint_attributes, participant_attributes
from tests.security.captured.straight import (
    SEC_BODY,
    SEC_POSTFIX,
    SEC_PREFIX,
    SRTPS_POSTFIX,
    SRTPS_PREFIX,
    Footer,
    Header,
    Material,
    check_receiver_mac,
    key_length,
    kx_material,
    open_block,
    open_payload,
    read_material,
    submessages,
)
from tests.security.cryptographic import vectors as v
from tests.security.cryptographic.keys import octets_of

KINDS = ["SIGN", "ENCRYPT", "SIGN_WITH_ORIGIN_AUTHENTICATION", "ENCRYPT_WITH_ORIGIN_AUTHENTICATION"]
BITS = ["128", "256"]
WRITER_ID, READER_ID = EntityId(b"\0\0\1\2"), EntityId(b"\0\0\1\7")
HEARTBEAT = v.HEARTBEAT
ACKNACK = bytes.fromhex("060118000000010700000102000000000100000000000000" + "01000000")
SECRET = SharedSecretHandle(v.CHALLENGE1, v.CHALLENGE2, bytes(range(32)), is_replier=False)


class Sender:
    """A participant, two that it sends to, and one protection kind for everything."""

    def __init__(self, kind: str, bits: str, seed: int = 0) -> None:
        self.plugin = AesGcmGmac({}, entropy=Random(f"{kind}{bits}{seed}").randbytes, wall_clock=lambda: NOW)
        data = kind.partition("_")[0]
        governance = {"rtps": kind, "discovery": kind, "liveliness": kind, "metadata": kind, "data": data}
        properties = {KEY_SIZE: bits}
        self.local = self.plugin.register_local_participant(
            IdentityHandle(), PermissionsHandle(), properties, participant_attributes(governance)
        )
        self.remotes: list[ParticipantCryptoHandle] = [
            self.plugin.register_matched_remote_participant(self.local, IdentityHandle(), PermissionsHandle(), SECRET)
            for _ in range(2)
        ]
        attributes = endpoint_attributes(governance, WRITER_ID)
        self.writer = self.plugin.register_local_datawriter(self.local, properties, attributes)
        self.reader = self.plugin.register_local_datareader(self.local, properties, attributes)
        self.remote_readers = [
            self.plugin.register_matched_remote_datareader(self.writer, remote, SECRET, relay_only=False)
            for remote in self.remotes
        ]
        self.remote_writers = [
            self.plugin.register_matched_remote_datawriter(self.reader, remote, SECRET) for remote in self.remotes
        ]


def material_of(token: CryptoToken) -> Material:
    keymat = token.binary_property("dds.cryp.keymat")
    assert keymat is not None
    return read_material(keymat)


def opened(encoded: bytes, materials: list[Material], marks: tuple[int, int], kind: str) -> bytes:
    """What all receivers read; each of them checks its own MAC, if any are due."""
    prefix, *inside, postfix = submessages(encoded)
    assert (prefix.kind, postfix.kind) == marks
    assert all(len(item.octets) % 4 == 0 for item in (prefix, *inside, postfix))
    header, footer = Header.read(prefix.body), Footer.read(postfix.body)
    is_encrypted = kind.startswith("ENCRYPT")
    assert (inside[0].kind == SEC_BODY) == is_encrypted
    body = inside[0].body if is_encrypted else b"".join(item.octets for item in inside)
    macs = dict(footer.receivers)
    assert len(macs) == (len(materials) if "ORIGIN" in kind else 0)
    for material in materials:
        if macs:
            check_receiver_mac(header, footer, macs[material.receiver_key_id], material)
    (plain,) = {open_block(header, body, footer, material) for material in materials}
    return plain


@pytest.mark.parametrize("bits", BITS)
@pytest.mark.parametrize("kind", KINDS)
def test_messages(kind: str, bits: str) -> None:
    sender = Sender(kind, bits)
    tokens = [sender.plugin.create_local_participant_crypto_tokens(sender.local, remote) for remote in sender.remotes]
    materials = [material_of(token) for (token,) in tokens]
    assert {key_length(material.kind) * 8 for material in materials} == {int(bits)}
    message = v.MESSAGE_HEADER + HEARTBEAT * 3
    encoded = octets_of(sender.plugin.encode_rtps_message((message,), sender.local, sender.remotes))
    assert encoded[:20] == message[:20]
    plain = opened(bytes(encoded[20:]), materials, (SRTPS_PREFIX, SRTPS_POSTFIX), kind)
    assert plain == v.INFO_SOURCE + message[20:]


@pytest.mark.parametrize("bits", BITS)
@pytest.mark.parametrize("kind", KINDS)
def test_submessages_of_writers_and_readers(kind: str, bits: str) -> None:
    sender = Sender(kind, bits)
    plugin = sender.plugin
    of_writer = [plugin.create_local_datawriter_crypto_tokens(sender.writer, to)[0] for to in sender.remote_readers]
    of_reader = [plugin.create_local_datareader_crypto_tokens(sender.reader, to)[0] for to in sender.remote_writers]
    encoded = octets_of(plugin.encode_datawriter_submessage((HEARTBEAT,), sender.writer, sender.remote_readers))
    materials = [material_of(token) for token in of_writer]
    assert opened(encoded, materials, (SEC_PREFIX, SEC_POSTFIX), kind) == HEARTBEAT
    encoded = octets_of(plugin.encode_datareader_submessage((ACKNACK,), sender.reader, sender.remote_writers))
    materials = [material_of(token) for token in of_reader]
    assert opened(encoded, materials, (SEC_PREFIX, SEC_POSTFIX), kind) == ACKNACK


@pytest.mark.parametrize("bits", BITS)
@pytest.mark.parametrize("kind", KINDS[:2])
@settings(max_examples=30)
@given(plain=st.binary(min_size=4, max_size=200))
def test_payloads(kind: str, bits: str, plain: bytes) -> None:
    """Padded to a multiple of 4, which the encapsulation header could have asked for as well."""
    sender = Sender(kind, bits)
    *_, token = sender.plugin.create_local_datawriter_crypto_tokens(sender.writer, sender.remote_readers[0])
    encoded = octets_of(sender.plugin.encode_serialized_payload(bytearray(), plain, sender.writer))
    assert open_payload(encoded, material_of(token)) == plain + bytes(-len(plain) % 4)


def test_large_payloads() -> None:
    """These go another way inside."""
    sender = Sender("ENCRYPT", "256")
    *_, token = sender.plugin.create_local_datawriter_crypto_tokens(sender.writer, sender.remote_readers[0])
    for length in (16_380, 16_384, 16_388, 65_536):
        plain = Random(length).randbytes(length)
        encoded = octets_of(sender.plugin.encode_serialized_payload(bytearray(), plain, sender.writer))
        assert open_payload(encoded, material_of(token)) == plain


def test_the_volatile_topic() -> None:
    """Under the pairwise key, by the writer and by the reader, with one counter for both."""
    sender = Sender("ENCRYPT", "256")
    plugin, (remote, _) = sender.plugin, sender.remotes
    name = "BuiltinParticipantVolatileMessageSecure"
    nothing = endpoint_attributes({"metadata": "NONE", "data": "NONE"}, WRITER_ID)
    writer = plugin.register_local_datawriter(sender.local, {BUILTIN_ENDPOINT_NAME: f"{name}Writer"}, nothing)
    reader = plugin.register_local_datareader(sender.local, {BUILTIN_ENDPOINT_NAME: f"{name}Reader"}, nothing)
    remote_reader = plugin.register_matched_remote_datareader(writer, remote, SECRET, relay_only=False)
    remote_writer = plugin.register_matched_remote_datawriter(reader, remote, SECRET)
    material = kx_material(v.CHALLENGE1, v.CHALLENGE2, bytes(range(32)))
    nonces = set()
    for _ in range(20):
        encoded = octets_of(plugin.encode_datawriter_submessage((HEARTBEAT,), writer, [remote_reader]))
        assert opened(encoded, [material], (SEC_PREFIX, SEC_POSTFIX), "ENCRYPT") == HEARTBEAT
        nonces.add(Header.read(bytes(encoded[4:])).iv)
        encoded = octets_of(plugin.encode_datareader_submessage((ACKNACK,), reader, [remote_writer]))
        assert opened(encoded, [material], (SEC_PREFIX, SEC_POSTFIX), "ENCRYPT") == ACKNACK
        nonces.add(Header.read(bytes(encoded[4:])).iv)
    assert len(nonces) == 40
