"""Targets of cryptography: key material, what is protected, and what an insider may put under a good protection."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cache

from cryptography.hazmat.primitives.ciphers.aead import AESGCM

from ddsi.messages.receiver import MessageReceiver
from ddsi.serialization import Octets
from ddsi.spi import Outcome
from ddsi.structure.errors import MalformedMessage
from ddsi.structure.guid import EntityId, Guid
from ddsi_security.crypto_transform_plugin import SecureSubmessage
from ddsi_security.cryptographic.key_material import KeyMaterial
from ddsi_security.tokens import DataHolder
from tests.captures.capture import load
from tests.fuzz.target import Target, verdict
from tests.security.captured.role import Role, played
from tests.security.captured.straight import (
    ENCRYPTING,
    SEC_BODY,
    SEC_POSTFIX,
    SEC_PREFIX,
    SRTPS_POSTFIX,
    SRTPS_PREFIX,
    Material,
    read_material,
    session_key,
    session_receiver_key,
)
from tests.security.captured.whole import decoded

__all__ = ["ENVELOPE_TARGETS", "receiver", "sealed", "sender_material"]

NAMES = ("sec-alloa-cyclone-cyclone", "sec-all-cyclone-fastdds", "sec-allsign-fastdds-cyclone")
"""The receivers: the first octet of an input says which of these captures, and so which protection it is to meet."""
SESSION_ID, SUFFIX = b"fuzz", bytes(8)


@cache
def receiver(number: int) -> Role:
    """The subscriber of a capture, with all keys that it had."""
    name = NAMES[number % len(NAMES)]
    subscribers = {Guid(bytes.fromhex(peer["guid"])) for peer in load(name).facts["subscribers"]}
    return next(role for role in played(name) if role.guid in subscribers)


def chosen(octets: bytes) -> tuple[Role, bytes]:
    return receiver(octets[0] if octets else 0), octets[1:]


# --- keys -----------------------------------------------------------------------------------------------------------


def key_material(octets: bytes) -> str:
    """What is read is written again, but for the octets of NONE, which mean nothing."""
    found = verdict(lambda: KeyMaterial.decode(octets), MalformedMessage)
    if found == "accepted" and KeyMaterial.decode(octets).kind:
        assert KeyMaterial.decode(octets).encode() == octets
    return found


def key_materials() -> Iterator[bytes]:
    yield from sorted({bytes.fromhex(token.keymat) for name in NAMES for token in decoded(name).tokens})[::20]
    yield bytes(24)


def crypto_tokens(octets: bytes) -> str:
    """One octet for the receiver, one for how many tokens and for what; the rest is the key material in them."""
    role, rest = chosen(octets)
    how, keymat = (rest[0] if rest else 0), rest[1:]
    tokens = [DataHolder("DDS:Crypto:AES_GCM_GMAC", (), (("dds.cryp.keymat", keymat),))] * (how & 3)
    # Of the role's own state nothing may change, or the next input would meet another receiver.
    role = Role(role.capture, role.guid)
    remote = next(iter(role.remotes))
    plugin, entity = role.plugin, EntityId(b"\0\0\1\2")

    def judge() -> object:
        match how >> 2 & 3:
            case 0:
                return plugin.set_remote_participant_crypto_tokens(role.local, role.remotes[remote], tokens)
            case 1:
                writer = role.remote_writer(entity, Guid.of(remote, entity))
                return plugin.set_remote_datawriter_crypto_tokens(role.local_readers[entity], writer, tokens)
            case _:
                reader = role.remote_reader(entity, Guid.of(remote, entity))
                return plugin.set_remote_datareader_crypto_tokens(role.local_writers[entity], reader, tokens)

    return verdict(judge)


def crypto_token_seeds() -> Iterator[bytes]:
    for token in decoded(NAMES[0]).tokens[::10]:
        what = {"participant": 0, "datawriter": 1, "datareader": 2}[token.kind]
        yield bytes([0, 1 | what << 2]) + bytes.fromhex(token.keymat)


# --- from outside: whoever has no key -------------------------------------------------------------------------------


def secured_message(octets: bytes) -> str:
    role, message = chosen(octets)
    remote = next(iter(role.remotes.values()))
    return verdict(lambda: role.plugin.decode_rtps_message(message, role.local, remote))


def secured_submessage(octets: bytes) -> str:
    role, encoded = chosen(octets)
    return verdict(lambda: open_submessage(role, encoded))


def open_submessage(role: Role, encoded: bytes) -> Octets | Outcome:
    """As the service does it: first whose it is, then what it is."""
    found = role.plugin.preprocess_secure_submsg(encoded, role.local, next(iter(role.remotes.values())))
    if not isinstance(found, SecureSubmessage):
        return found
    reader, writer = found.datareader, found.datawriter
    assert reader is not None
    assert writer is not None
    if found.category.name == "DATAREADER_SUBMESSAGE":
        return role.plugin.decode_datareader_submessage(encoded, writer, reader)
    return role.plugin.decode_datawriter_submessage(encoded, reader, writer)


def secured_payload(octets: bytes) -> str:
    role, encoded = chosen(octets)
    (reader_id, _), writer = next(
        (pair, handle) for pair, handle in role.remote_writers.items() if not pair[0].is_builtin
    )
    reader = role.local_readers[reader_id]
    return verdict(lambda: role.plugin.decode_serialized_payload(encoded, b"", reader, writer))


def captured_envelopes(*kinds: str) -> Callable[[], Iterator[bytes]]:
    def seeds() -> Iterator[bytes]:
        for number in range(len(NAMES)):
            found = [opened for entries in receiver(number).opened.values() for opened in entries]
            for kind in kinds:
                of_kind = [bytes(opened.encoded) for opened in found if opened.kind == kind]
                yield from (bytes([number]) + octets for octets in sorted(of_kind, key=len)[:3])

    return seeds


# --- from inside: whoever has the keys ------------------------------------------------------------------------------


@cache
def sender_material(number: int, kind: str) -> Material:
    """A key that the receiver knows, of its peer's participant or of one of the peer's writers."""
    role = receiver(number)
    keymats = [token.keymat for token in role.tokens if token.kind == kind and token.keymat[8:] != "0" * 40]
    return read_material(bytes.fromhex(keymats[-1 if kind == "participant" else 0]))


def sealed(plain: bytes, material: Material, prefix: int, postfix: int) -> bytes:
    """As the specification has it, whatever ``plain`` is; one receiver's MAC where the key has a receiver's key."""
    header = material.kind.to_bytes(4, "big") + material.key_id + SESSION_ID + SUFFIX
    aead, nonce = AESGCM(session_key(material, SESSION_ID)), SESSION_ID + SUFFIX
    if material.kind in ENCRYPTING:
        both = aead.encrypt(nonce, plain, None)
        body, mac = len(plain).to_bytes(4, "big") + both[:-16], both[-16:]
        inside = _submessage(SEC_BODY, body + bytes(-len(body) % 4))
    else:
        inside, mac = plain, aead.encrypt(nonce, b"", plain)
    footer = mac + bytes(4)
    if material.receiver_key:
        own = AESGCM(session_receiver_key(material, SESSION_ID)).encrypt(nonce, b"", mac)
        footer = mac + b"\0\0\0\1" + material.receiver_key_id + own
    return _submessage(prefix, header) + inside + _submessage(postfix, footer)


def _submessage(kind: int, body: bytes) -> bytes:
    return bytes([kind, 1]) + len(body).to_bytes(2, "little") + body


def sealed_message(octets: bytes) -> str:
    """What is under the protection of a message; what comes out of it is read on, as the engine would."""
    role, plain = chosen(octets)
    (prefix, remote), *_ = role.remotes.items()
    number = octets[0] % len(NAMES) if octets else 0
    material = sender_material(number, "participant")
    message = b"RTPS\2\1\1\x10" + prefix + sealed(plain, material, SRTPS_PREFIX, SRTPS_POSTFIX)

    def judge() -> object:
        opened = role.plugin.decode_rtps_message(message, role.local, remote)
        return opened if isinstance(opened, Outcome) else list(MessageReceiver(opened))

    return verdict(judge, MalformedMessage)


def sealed_submessage(octets: bytes) -> str:
    role, plain = chosen(octets)
    number = octets[0] % len(NAMES) if octets else 0
    encoded = sealed(plain, sender_material(number, "datawriter"), SEC_PREFIX, SEC_POSTFIX)

    def judge() -> object:
        opened = open_submessage(role, encoded)
        if isinstance(opened, Outcome):
            return opened
        return list(MessageReceiver(b"RTPS\2\1\1\x10" + bytes(12) + opened))

    return verdict(judge, MalformedMessage)


def plain_messages() -> Iterator[bytes]:
    """INFO_SRC, which the envelope puts before what was in the message, and the rest."""
    for number in range(len(NAMES)):
        found = [opened for entries in receiver(number).opened.values() for opened in entries]
        messages = sorted((bytes(opened.plain) for opened in found if opened.kind == "rtps_messages"), key=len)
        for message in messages[:3]:
            yield bytes([number]) + _submessage(0x0C, bytes(4) + message[4:20]) + message[20:]


def plain_submessages() -> Iterator[bytes]:
    for number in range(len(NAMES)):
        found = [opened for entries in receiver(number).opened.values() for opened in entries]
        kept = sorted((bytes(opened.plain) for opened in found if opened.kind == "datawriter_submessages"), key=len)
        yield from (bytes([number]) + octets for octets in kept[:3])


SUBMESSAGES = ("datawriter_submessages", "datareader_submessages", "volatile_submessages")
ENVELOPE_TARGETS = {
    "key_material": Target(key_material, key_materials, 256),
    "crypto_tokens": Target(crypto_tokens, crypto_token_seeds, 256),
    "secured_message": Target(secured_message, captured_envelopes("rtps_messages"), 1024),
    "secured_submessage": Target(secured_submessage, captured_envelopes(*SUBMESSAGES), 1024),
    "secured_payload": Target(secured_payload, captured_envelopes("payloads"), 512),
    "sealed_message": Target(sealed_message, plain_messages, 1024, enormous=60_000),
    "sealed_submessage": Target(sealed_submessage, plain_submessages, 1024, enormous=60_000),
}
