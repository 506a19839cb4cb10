"""Builders for the tests: keys with known octets, and participants that have exchanged all their tokens."""

from __future__ import annotations

import random
from dataclasses import dataclass
from enum import Enum

from ddsi.spi import Parts, Refused
from ddsi.structure.qos_policies import Properties
from ddsi_security.attributes import EndpointSecurityAttributes, ParticipantSecurityAttributes
from ddsi_security.cryptographic import AesGcmGmac
from ddsi_security.cryptographic.crypto_handles import (
    LocalParticipant,
    LocalReader,
    LocalWriter,
    RemoteParticipant,
    RemoteReader,
    RemoteWriter,
)
from ddsi_security.cryptographic.key_material import KeyMaterial
from ddsi_security.cryptographic.received_keys import KeyRing
from ddsi_security.cryptographic.session_keys import ReceiverKey, SendingKey
from ddsi_security.cryptographic.transformation import TransformationKind
from ddsi_security.handles import IdentityHandle, PermissionsHandle, SharedSecretHandle
from ddsi_security.properties import BUILTIN_ENDPOINT_NAME
from tests.security.cryptographic import vectors

VOLATILE_WRITER = {BUILTIN_ENDPOINT_NAME: "BuiltinParticipantVolatileMessageSecureWriter"}
VOLATILE_READER = {BUILTIN_ENDPOINT_NAME: "BuiltinParticipantVolatileMessageSecureReader"}


class Kind(Enum):
    """The ProtectionKind of a governance document: protected, encrypted, origin authenticated."""

    NONE = (False, False, False)
    SIGN = (True, False, False)
    ENCRYPT = (True, True, False)
    SIGN_WITH_ORIGIN = (True, False, True)
    ENCRYPT_WITH_ORIGIN = (True, True, True)


PROTECTED = [kind for kind in Kind if kind is not Kind.NONE]


def octets_of(parts: Parts | Refused) -> bytes:
    """What an encoder returned, as it goes over the wire."""
    assert not isinstance(parts, Refused), parts
    return b"".join(parts)


def endpoint_attributes(metadata: Kind, data: Kind = Kind.NONE) -> EndpointSecurityAttributes:
    is_protected, encrypted, origin = metadata.value
    payload_protected, payload_encrypted, _ = data.value
    return EndpointSecurityAttributes(
        is_submessage_protected=is_protected,
        is_payload_protected=payload_protected,
        plugin_endpoint_attributes=encrypted << 0 | payload_encrypted << 1 | origin << 2,
    )


def participant_attributes(rtps: Kind) -> ParticipantSecurityAttributes:
    is_protected, encrypted, origin = rtps.value
    return ParticipantSecurityAttributes(
        is_rtps_protected=is_protected, plugin_participant_attributes=encrypted << 0 | origin << 3
    )


# --- keys of the vectors -------------------------------------------------------------------------------------------


def material(kind: TransformationKind = TransformationKind.AES256_GCM, *, for_receiver: bool = False) -> KeyMaterial:
    length = kind.key_length
    found = KeyMaterial(
        kind, bytearray(vectors.SALT[:length]), vectors.SENDER_KEY_ID, bytearray(vectors.SENDER_KEY[:length])
    )
    if not for_receiver:
        return found
    return found.for_receiver(vectors.RECEIVER_KEY_ID, bytearray(vectors.RECEIVER_KEY[:length]))


def entropy_of(session_id: bytes, suffix: bytes) -> Entropy:
    """What makes a new key begin with this session, and give out this suffix first."""
    return Entropy((int.from_bytes(suffix, "big") - 1).to_bytes(8, "big"), session_id)


class Entropy:
    def __init__(self, *draws: bytes) -> None:
        self._draws = list(draws)

    def __call__(self, count: int) -> bytes:
        drawn = self._draws.pop(0)
        assert len(drawn) == count
        return drawn


def sending_key(of: KeyMaterial | None = None) -> SendingKey:
    """A key whose first header is that of the vectors."""
    return SendingKey(of or material(), entropy_of(vectors.SESSION_ID, vectors.SUFFIX))


def receiver_key() -> ReceiverKey:
    return ReceiverKey(vectors.RECEIVER_KEY_ID, bytearray(vectors.RECEIVER_KEY))


def ring(*materials: KeyMaterial) -> KeyRing:
    found = KeyRing(lambda: 0)
    for one in materials:
        found.replace(one)
    return found


# --- participants --------------------------------------------------------------------------------------------------


@dataclass(slots=True)
class Match:
    """A writer on one side, a reader on the other, and either side's handle of the other."""

    writer: LocalWriter
    remote_reader: RemoteReader
    reader: LocalReader
    remote_writer: RemoteWriter


class Participant:
    """One plugin with its participant.  ``remote(other)``: its handle of another one."""

    def __init__(self, seed: int, rtps: Kind = Kind.NONE, properties: Properties | None = None) -> None:
        self.now = 0
        self.plugin = AesGcmGmac(properties or {}, entropy=random.Random(seed).randbytes, wall_clock=lambda: self.now)
        self.handle: LocalParticipant = self.plugin.register_local_participant(
            IdentityHandle(), PermissionsHandle(), properties or {}, participant_attributes(rtps)
        )
        self._remotes: dict[int, RemoteParticipant] = {}

    def remote(self, other: Participant) -> RemoteParticipant:
        return self._remotes[id(other)]

    def authenticated(self, other: Participant, *, is_replier: bool) -> RemoteParticipant:
        secret = SharedSecretHandle(
            vectors.CHALLENGE1, vectors.CHALLENGE2, vectors.SHARED_SECRET, is_replier=is_replier
        )
        remote = self._remotes[id(other)] = self.plugin.register_matched_remote_participant(
            self.handle, IdentityHandle(), PermissionsHandle(), secret
        )
        return remote

    def take_tokens(self, other: Participant) -> None:
        tokens = other.plugin.create_local_participant_crypto_tokens(other.handle, other.remote(self))
        refused = self.plugin.set_remote_participant_crypto_tokens(self.handle, self.remote(other), tokens)
        assert refused is None


SECRET = SharedSecretHandle(vectors.CHALLENGE1, vectors.CHALLENGE2, vectors.SHARED_SECRET, is_replier=False)


def introduce(initiator: Participant, replier: Participant) -> None:
    """The handshake is over; each has the other's participant token."""
    initiator.authenticated(replier, is_replier=False)
    replier.authenticated(initiator, is_replier=True)
    initiator.take_tokens(replier)
    replier.take_tokens(initiator)


def pair(rtps: Kind = Kind.NONE) -> tuple[Participant, Participant]:
    alice, bob = Participant(1, rtps), Participant(2, rtps)
    introduce(alice, bob)
    return alice, bob


def match(
    publisher: Participant,
    subscriber: Participant,
    attributes: EndpointSecurityAttributes,
    *,
    writer: LocalWriter | None = None,
    writer_properties: Properties | None = None,
    reader_properties: Properties | None = None,
) -> Match:
    """A writer (or this one of the publisher's) and a new reader, with each other's tokens."""
    out, into = publisher.plugin, subscriber.plugin
    if writer is None:
        writer = out.register_local_datawriter(publisher.handle, writer_properties or {}, attributes)
    reader = into.register_local_datareader(subscriber.handle, reader_properties or {}, attributes)
    remote_reader = out.register_matched_remote_datareader(
        writer, publisher.remote(subscriber), SECRET, relay_only=False
    )
    remote_writer = into.register_matched_remote_datawriter(reader, subscriber.remote(publisher), SECRET)
    tokens = out.create_local_datawriter_crypto_tokens(writer, remote_reader)
    assert into.set_remote_datawriter_crypto_tokens(reader, remote_writer, tokens) is None
    tokens = into.create_local_datareader_crypto_tokens(reader, remote_writer)
    assert out.set_remote_datareader_crypto_tokens(writer, remote_reader, tokens) is None
    return Match(writer, remote_reader, reader, remote_writer)


def volatile_match(publisher: Participant, subscriber: Participant) -> Match:
    return match(
        publisher,
        subscriber,
        endpoint_attributes(Kind.ENCRYPT),
        writer_properties=VOLATILE_WRITER,
        reader_properties=VOLATILE_READER,
    )
