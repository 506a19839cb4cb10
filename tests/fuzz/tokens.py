"""Targets of authentication: tokens, generic messages, and each step of a handshake with a stranger."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cache

from cryptography.hazmat.primitives.serialization import Encoding

from ddsi.messages.receiver import MessageReceiver
from ddsi.messages.submessages import Data
from ddsi.serialization import Reader, Writer
from ddsi.spi import Refused
from ddsi.structure.builtin_entity_ids import PARTICIPANT_STATELESS_MESSAGE_WRITER
from ddsi.structure.errors import MalformedMessage
from ddsi_security.authentication.algorithms import DH_MODP_2048_256, ECDH_P256, KeyAgreement
from ddsi_security.authentication.certificate import Certificate
from ddsi_security.authentication.key_agreement import EphemeralKey
from ddsi_security.authentication.not_trusted import NotTrusted
from ddsi_security.authentication.participant_data import ParticipantData
from ddsi_security.authentication.trust_anchors import TrustAnchors
from ddsi_security.authentication_plugin import HandshakeStep
from ddsi_security.generic_message import peek_route, read_generic_message
from ddsi_security.handles import HandshakeHandle, Pending
from ddsi_security.tokens import NIL, DataHolder, read_data_holder, write_data_holder
from tests.captures.capture import SECURED, load
from tests.fuzz.identities import owner, settings_of
from tests.fuzz.target import Target, verdict
from tests.security.authentication.material import (
    NOW_S,
    SECOND,
    Pair,
    Side,
    done,
    foreign_request,
    message,
    participant_data,
    settle,
)

__all__ = ["TOKEN_TARGETS", "known_pair", "octets_of", "read"]

LITTLE_ENDIAN, BIG_ENDIAN = b"\1", b"\0"


def octets_of(token: DataHolder, *, little_endian: bool = True) -> bytes:
    """A token as the targets take it: the byte order, then the DataHolder."""
    writer = Writer(little_endian=little_endian)
    write_data_holder(writer, token)
    return (LITTLE_ENDIAN if little_endian else BIG_ENDIAN) + writer.getvalue()


def read(octets: bytes) -> DataHolder:
    return read_data_holder(Reader(octets[1:], little_endian=octets[:1] != BIG_ENDIAN))


def data_holder(octets: bytes) -> str:
    return verdict(lambda: read(octets), MalformedMessage)


def generic_message(octets: bytes) -> str:
    """What is peeked at is what is read."""
    found = verdict(lambda: read_generic_message(octets), MalformedMessage)
    if found == "accepted":
        whole = read_generic_message(octets)
        assert peek_route(octets) == (whole.message_identity.source_guid, whole.destination_participant_guid)
    return found


def generic_messages() -> Iterator[bytes]:
    """The first of each capture that came in one piece."""
    for name in SECURED:
        for datagram in load(name).datagrams:
            submessages = [submessage for submessage, _ in MessageReceiver(datagram)]
            payloads = [
                bytes(submessage.serialized_payload)
                for submessage in submessages
                if isinstance(submessage, Data) and submessage.writer_id == PARTICIPANT_STATELESS_MESSAGE_WRITER
            ]
            if payloads:
                yield payloads[0]
                break


# --- the handshake --------------------------------------------------------------------------------------------------


@cache
def known_pair() -> Pair:
    """Two participants in the middle of a handshake; always the same."""
    return new_pair()


def new_pair() -> Pair:
    alice, bob = (
        Side(owner(name), seed=seed, settings=settings_of(name)) for seed, name in enumerate(("alice", "bob"), 1)
    )
    return Pair(alice, bob)


def judged(
    octets: bytes, judge: Callable[[DataHolder], HandshakeStep | Refused | Pending[HandshakeStep | Refused]]
) -> str:
    return verdict(lambda: settle(judge(read(octets))), MalformedMessage)


def identity_token(octets: bytes) -> str:
    """Who a stranger says it is, in SPDP."""
    plugin, local, guid = known_pair().replier.plugin, known_pair().replier.identity, known_pair().initiator.guid
    return verdict(lambda: plugin.validate_remote_identity(NIL, local, read(octets), guid), MalformedMessage)


def auth_request(octets: bytes) -> str:
    """Its first message, before anything else is known."""
    both = new_pair()
    plugin, local, guid = both.replier.plugin, both.replier.identity, both.initiator.guid
    token = both.initiator.plugin.get_identity_token(both.initiator.identity)
    return verdict(lambda: plugin.validate_remote_identity(read(octets), local, token, guid), MalformedMessage)


def handshake_request(octets: bytes) -> str:
    return judged(octets, known_pair().reply)


@cache
def waiting() -> tuple[DataHolder, HandshakeHandle, DataHolder, HandshakeHandle, DataHolder]:
    """Request, the initiator that waits for the Reply, the Reply, the replier that waits for the Final, the Final."""
    both = known_pair()
    requested = both.request()
    replied = done(both.reply(message(requested)))
    finished = done(both.initiator.plugin.process_handshake(message(replied), requested.handle))
    return message(requested), requested.handle, message(replied), replied.handle, message(finished)


def handshake_reply(octets: bytes) -> str:
    plugin = known_pair().initiator.plugin
    return judged(octets, lambda token: plugin.process_handshake(token, waiting()[1]))


def handshake_final(octets: bytes) -> str:
    plugin = known_pair().replier.plugin
    return judged(octets, lambda token: plugin.process_handshake(token, waiting()[3]))


def requests() -> Iterator[bytes]:
    """Ours, and as others write it."""
    yield octets_of(waiting()[0])
    yield octets_of(waiting()[0], little_endian=False)
    for agreement in (ECDH_P256, DH_MODP_2048_256):
        sent = foreign_request(known_pair(), agreement).sent
        assert sent is not None
        yield octets_of(sent)


# --- what is in the messages: behind signatures that a fuzzer cannot make --------------------------------------------


def certificate(octets: bytes) -> str:
    """PEM, or what it decodes to: judged as if it had come with a handshake."""

    def judge() -> object:
        read_it = Certificate.from_pem if octets.startswith(b"-") else Certificate.from_der
        anchors = TrustAnchors((Certificate.from_pem(owner("identity_ca").pem.encode()),))
        return anchors.verify(read_it(octets), NOW_S * SECOND)

    return verdict(judge, NotTrusted)


def certificates() -> Iterator[bytes]:
    for name in ("alice", "bob"):
        yield owner(name).certificate.public_bytes(Encoding.PEM)
        yield owner(name).certificate.public_bytes(Encoding.DER)


def public_key(octets: bytes) -> str:
    """``dh1`` or ``dh2``, for the key agreement that the first octet tells."""
    agreements: list[KeyAgreement] = [ECDH_P256, DH_MODP_2048_256]
    agreement = agreements[octets[0] % 2] if octets else ECDH_P256
    return verdict(lambda: EphemeralKey(agreement, 12345).shared_secret(octets[1:]), NotTrusted)


def public_keys() -> Iterator[bytes]:
    yield b"\0" + EphemeralKey(ECDH_P256, 99).public
    yield b"\1" + EphemeralKey(DH_MODP_2048_256, 99).public
    yield b"\1" + EphemeralKey(DH_MODP_2048_256, 99, der=True).public


def pdata(octets: bytes) -> str:
    """``c.pdata``: SPDP data, of which the Guid matters."""
    return verdict(lambda: ParticipantData.read(octets), NotTrusted)


def pdatas() -> Iterator[bytes]:
    guid = known_pair().initiator.guid
    yield participant_data(guid)
    yield b"\0\2\0\0" + participant_data(guid)
    little = b"\x50\0\x10\0" + guid + b"\x01\0\0\0"
    yield b"\0\3\0\0" + little


def identity_tokens() -> Iterator[bytes]:
    token = known_pair().initiator.plugin.get_identity_token(known_pair().initiator.identity)
    yield octets_of(token)
    yield octets_of(DataHolder("DDS:Auth:PKI-DH:1.2", (("dds.cert.sn", "CN=alice"),)))
    yield octets_of(DataHolder("DDS:Auth:PKI-DH:1.0"))


TOKEN_TARGETS = {
    "data_holder": Target(data_holder, lambda: [*identity_tokens(), *requests()]),
    "generic_message": Target(generic_message, generic_messages),
    "identity_token": Target(identity_token, identity_tokens, 1024),
    "auth_request": Target(
        auth_request,
        lambda: [octets_of(DataHolder("DDS:Auth:PKI-DH:1.0+AuthReq", (), (("future_challenge", bytes(32)),)))],
        512,
    ),
    "handshake_request": Target(handshake_request, requests),
    "handshake_reply": Target(handshake_reply, lambda: [octets_of(waiting()[2])]),
    "handshake_final": Target(handshake_final, lambda: [octets_of(waiting()[4])], 2048),
    "certificate": Target(certificate, certificates, 2048),
    "public_key": Target(public_key, public_keys, 512),
    "pdata": Target(pdata, pdatas, 1024),
}
