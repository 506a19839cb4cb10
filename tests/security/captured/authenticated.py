"""Participants of a capture who believe each other, by our authentication plugin and what they really sent.

The plugin would draw a Diffie-Hellman key of its own, and could not use what a real peer answered to another.  So it is
put into the state in which the captured participant was: the values are the capture's, every check on the next message
is the plugin's.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from random import Random
from typing import Any

from ddsi.discovery.parameters import decode_participant
from ddsi.serialization import ParameterId, Reader
from ddsi.spi import Refused
from ddsi.structure.builtin_entity_ids import SPDP_WRITER
from ddsi.structure.discovered import DiscoveredParticipantData
from ddsi.structure.guid import EntityId, Guid, GuidPrefix
from ddsi_security.authentication import PkiDhAuthentication
from ddsi_security.authentication.algorithms import KeyAgreement, key_agreement_named
from ddsi_security.authentication.handshake import Handshake, ReplySent, RequestSent
from ddsi_security.authentication.handshake_tokens import AgreedValues, Credentials
from ddsi_security.authentication.identities import RemoteIdentityHandle
from ddsi_security.authentication.key_agreement import EphemeralKey
from ddsi_security.authentication_plugin import HandshakeStep, ValidationResult
from ddsi_security.handles import IdentityHandle, Pending
from ddsi_security.properties import (
    GOVERNANCE,
    IDENTITY_CA,
    IDENTITY_CERTIFICATE,
    PERMISSIONS,
    PERMISSIONS_CA,
    PRIVATE_KEY,
)
from ddsi_security.tokens import NIL, DataHolder, read_data_holder
from tests.captures.capture import HERE, Capture, load
from tests.security.captured import handshakes as h
from tests.security.captured.whole import decoded

NOON = 1_795_392_000 * 10**9
"""Of the day after the captures were made, when everybody's certificate was valid."""


def properties_of(capture: Capture, identity: str) -> dict[str, str]:
    """The configuration of a participant of the capture."""
    keystore = HERE / capture.facts["keystore"]
    files = {
        IDENTITY_CA: "identity_ca.pem",
        IDENTITY_CERTIFICATE: f"{identity}.pem",
        PRIVATE_KEY: f"{identity}.key",
        PERMISSIONS_CA: "permissions_ca.pem",
        GOVERNANCE: capture.facts["governance"]["document"],
        PERMISSIONS: f"{identity}.permissions.p7s",
    }
    return {name: f"file:{keystore / file}" for name, file in files.items()}


@dataclass(frozen=True)
class Believer:
    """One side of a handshake at its end: ``peer`` is what ``local`` believes."""

    capture: Capture
    plugin: PkiDhAuthentication
    local: IdentityHandle
    peer: IdentityHandle
    peer_data: DiscoveredParticipantData
    handshake: Handshake
    properties: dict[str, str]
    peer_name: str
    kx: dict[str, Any]


class KnownKey(EphemeralKey):
    """A key of which is known only what came of it: our public key, and the secret with one peer."""

    __slots__ = ("_secret",)

    def __init__(self, agreement: KeyAgreement, public: bytes, secret: bytes) -> None:
        super().__init__(agreement, 5)
        self.public = public  # type: ignore[misc]
        self._secret = secret

    def shared_secret(self, peer_public: bytes) -> bytes:
        return self._secret


def believers(name: str) -> Iterator[Believer]:
    """Both sides of each handshake in the capture."""
    capture = load(name)
    agreed = {(kx["initiator_guid"][:24], kx["replier_guid"][:24]): kx for kx in capture.facts["kx"]}
    for handshake in h.handshakes(decoded(name).messages):
        kx = agreed[handshake.initiator.hex(), handshake.replier.hex()]
        yield _believer(capture, handshake, kx, is_initiator=True)
        yield _believer(capture, handshake, kx, is_initiator=False)


def announced_participants(name: str) -> dict[GuidPrefix, DiscoveredParticipantData]:
    """Who said what of itself in the clear, last."""
    whole = decoded(name)
    vendors = {peer["guid"][:24]: bytes.fromhex(peer["vendor_id"]) for peer in whole.capture.facts["guids"]}
    return {
        GuidPrefix(source): decode_participant(
            payload, source_prefix=GuidPrefix(source), vendor_id=vendors[source.hex()], protocol_version=(2, 1)
        )
        for writer_id, source, payload in whole.announcements
        if writer_id == SPDP_WRITER
    }


def token_of(data: DiscoveredParticipantData, pid: ParameterId) -> DataHolder:
    return read_data_holder(Reader(dict(data.security_parameters)[pid], little_endian=True))


def _believer(capture: Capture, handshake: h.Handshake, kx: dict[str, Any], *, is_initiator: bool) -> Believer:
    names = {peer["guid"][:24]: peer["identity"] for peer in capture.facts["peers"]}
    ours, theirs = handshake.initiator, handshake.replier
    if not is_initiator:
        ours, theirs = theirs, ours
    properties = properties_of(capture, names[ours.hex()])
    plugin = PkiDhAuthentication(properties, entropy=Random(1).randbytes, wall_clock=lambda: NOON)
    local = plugin.validate_local_identity(1, properties, Guid(bytes(12) + EntityId.PARTICIPANT))
    assert local.adjusted_participant_guid[:6] == ours[:6], "the certificate decides"
    data = announced_participants(capture.name)[GuidPrefix(theirs)]
    remote = plugin.validate_remote_identity(
        _auth_request(capture.name, theirs, ours),
        local.handle,
        token_of(data, ParameterId.IDENTITY_TOKEN),
        data.guid,
        remote_vendor_id=data.vendor_id,
    )
    assert not isinstance(remote, Refused), remote
    assert (remote.result == ValidationResult.PENDING_HANDSHAKE_REQUEST) == is_initiator
    assert isinstance(remote.handle, RemoteIdentityHandle)
    judge = judge_reply if is_initiator else judge_request_and_final
    step = judge(plugin, remote.handle, handshake, kx)
    assert isinstance(step, HandshakeStep), step
    assert step.result == (ValidationResult.OK_FINAL_MESSAGE if is_initiator else ValidationResult.OK)
    assert isinstance(step.handle, Handshake)
    return Believer(
        capture, plugin, local.handle, remote.handle, data, step.handle, properties, names[theirs.hex()], kx
    )


def judge_reply(
    plugin: PkiDhAuthentication, remote: RemoteIdentityHandle, handshake: h.Handshake, kx: dict[str, Any]
) -> HandshakeStep | Refused:
    """As if our Request had been the captured one."""
    return finished(plugin.process_handshake(_token("Reply", handshake.reply), request_sent(remote, handshake, kx)))


def request_sent(remote: RemoteIdentityHandle, handshake: h.Handshake, kx: dict[str, Any]) -> RequestSent:
    agreement = key_agreement_named(handshake.request["c.kagree_algo"])
    assert agreement is not None
    key = KnownKey(agreement, handshake.request["dh1"], bytes.fromhex(kx["shared_secret"]))
    return RequestSent(remote, _token("Req", handshake.request), handshake.hash_c1, key)


def judge_request_and_final(
    plugin: PkiDhAuthentication, remote: RemoteIdentityHandle, handshake: h.Handshake, kx: dict[str, Any]
) -> HandshakeStep | Refused:
    """The captured Request, answered by us; then the captured Final, as if our Reply had been the captured one."""
    request = _token("Req", handshake.request)
    step = finished(plugin.begin_handshake_reply(request, remote, remote.local, b"participant data"))
    if isinstance(step, Refused):
        return step
    answered = step.handle
    assert isinstance(answered, ReplySent)
    values = AgreedValues(
        hash_c1=Credentials.of(request).hash(),
        challenge1=handshake.request["challenge1"],
        dh1=handshake.request["dh1"],
        hash_c2=Credentials.of(_token("Reply", handshake.reply)).hash(),
        challenge2=handshake.reply["challenge2"],
        dh2=handshake.reply["dh2"],
    )
    secret = bytes.fromhex(kx["shared_secret"])
    captured = ReplySent(remote, request, _token("Reply", handshake.reply), answered.peer, values, secret)
    return finished(plugin.process_handshake(_token("Final", handshake.final), captured))


def finished(step: HandshakeStep | Refused | Pending[HandshakeStep | Refused]) -> HandshakeStep | Refused:
    return step.job() if isinstance(step, Pending) else step


def _token(step: str, properties: h.Token) -> DataHolder:
    return DataHolder(f"DDS:Auth:PKI-DH:1.0+{step}", (), tuple(properties.items()))


def _auth_request(name: str, source: bytes, destination: bytes) -> DataHolder:
    """The last one that was sent from the one to the other; NIL if none was."""
    token = NIL
    for message in decoded(name).messages:
        route = message.source_guid[:12], message.destination_participant[:12]
        if message.class_id == "dds.sec.auth_request" and route == (source, destination):
            token = DataHolder(message.tokens[0][0], (), tuple(message.tokens[0][1].items()))
    return token
