"""The handshakes of Cyclone DDS and Fast DDS in the captures, judged by the plugin in the place of either side.

It has the certificates and keys of both, but not their ephemeral keys; what these led to stands in the JSON files and
is given to it.  So everything is checked but the key agreement itself, of which only the public halves are.
"""

from __future__ import annotations

import random

import pytest

from ddsi.structure.guid import Guid
from ddsi_security.authentication import PkiDhAuthentication
from ddsi_security.authentication.algorithms import key_agreement_named
from ddsi_security.authentication.handshake import ReplySent, RequestSent
from ddsi_security.authentication.handshake_tokens import AgreedValues, Credentials
from ddsi_security.authentication.identities import LocalIdentityHandle, RemoteIdentityHandle
from ddsi_security.authentication.identity_material import read_identity_material
from ddsi_security.authentication.key_agreement import EphemeralKey
from ddsi_security.authentication.participant_data import ParticipantData
from ddsi_security.authentication.peer import Peer
from ddsi_security.plugins import HandshakeStep, RemoteIdentity, ValidationResult
from ddsi_security.tokens import DataHolder
from tests.captures.capture import HERE

from .captured_handshakes import CapturedHandshake, captured_handshakes
from .material import SECOND, done, message, refusal, settle

CAPTURED_AT = 1_795_348_800 * SECOND  # noon of the day on which they were captured
IDENTITY_TOKEN = DataHolder("DDS:Auth:PKI-DH:1.0")
HANDSHAKES = list(captured_handshakes())
ALL = pytest.mark.parametrize("captured", HANDSHAKES, ids=str)


class KnownKey(EphemeralKey):
    """An ephemeral key of which only the public half is known, and what it led to."""

    __slots__ = ("_known",)

    def __init__(self, agreement: str, public: bytes, shared_secret: bytes) -> None:
        known = key_agreement_named(agreement.encode())
        assert known is not None
        super().__init__(known, 1)
        self.public = public  # type: ignore[misc]
        self._known = shared_secret

    def shared_secret(self, peer_public: bytes) -> bytes:
        super().shared_secret(peer_public)  # which says whether it is a public key at all
        return self._known


class Judge:
    """The plugin, as one of the two that are in the capture."""

    def __init__(self, captured: CapturedHandshake, me: Guid, peer: Guid) -> None:
        self.captured = captured
        self.plugin = PkiDhAuthentication({}, entropy=random.Random(1).randbytes, wall_clock=lambda: CAPTURED_AT)
        keystore, name = HERE / captured.keystore, captured.names[me]
        material = read_identity_material(
            {
                "dds.sec.auth.identity_ca": f"file:{keystore / 'identity_ca.pem'}",
                "dds.sec.auth.identity_certificate": f"file:{keystore / name}.pem",
                "dds.sec.auth.private_key": f"file:{keystore / name}.key",
            },
            CAPTURED_AT,
        )
        self.local = LocalIdentityHandle(me, material, IDENTITY_TOKEN)
        found = self.plugin.validate_remote_identity(
            captured.auth_requests[peer], self.local, self._announced_by(peer), peer
        )
        assert isinstance(found, RemoteIdentity)
        assert isinstance(found.handle, RemoteIdentityHandle)
        self.remote = found.handle

    def _announced_by(self, peer: Guid) -> DataHolder:
        """Fast DDS writes four properties into its identity token, Cyclone DDS none (they are in c.pdata, too)."""
        token = self.captured.request if peer == self.captured.initiator else self.captured.reply
        announced = ParticipantData.read(Credentials.of(token).c_pdata)
        assert announced.guid == peer
        assert announced.identity_token is not None
        return announced.identity_token


def values_of(captured: CapturedHandshake) -> AgreedValues:
    def octets(token: DataHolder, name: str) -> bytes:
        value = token.binary_property(name)
        assert value is not None
        return value

    return AgreedValues(
        hash_c1=Credentials.of(captured.request).hash(),
        challenge1=octets(captured.request, "challenge1"),
        dh1=octets(captured.request, "dh1"),
        hash_c2=Credentials.of(captured.reply).hash(),
        challenge2=octets(captured.reply, "challenge2"),
        dh2=octets(captured.reply, "dh2"),
    )


def as_initiator(captured: CapturedHandshake) -> tuple[Judge, RequestSent]:
    judge, values = Judge(captured, captured.initiator, captured.replier), values_of(captured)
    key = KnownKey(captured.facts["key_agreement"], values.dh1, bytes.fromhex(captured.facts["shared_secret"]))
    return judge, RequestSent(judge.remote, captured.request, values.hash_c1, key)


def as_replier(captured: CapturedHandshake) -> tuple[Judge, ReplySent]:
    judge = Judge(captured, captured.replier, captured.initiator)
    peer = judge.remote.expected(CAPTURED_AT).peer(Credentials.of(captured.request))
    assert isinstance(peer, Peer)
    secret = bytes.fromhex(captured.facts["shared_secret"])
    return judge, ReplySent(judge.remote, captured.request, captured.reply, peer, values_of(captured), secret)


def flipped(token: DataHolder, name: str, at: int) -> DataHolder:
    """With one bit of one property turned over."""

    def change(octets: bytes) -> bytes:
        return octets[:at] + bytes([octets[at] ^ 1]) + octets[at + 1 :]

    properties = tuple((key, change(value) if key == name else value) for key, value in token.binary_properties)
    return DataHolder(token.class_id, token.properties, properties)


def test_every_handshake_of_the_captures_is_here() -> None:
    assert len(HANDSHAKES) == 27
    kinds = {(each.facts["key_agreement"], each.keystore) for each in HANDSHAKES}
    assert kinds == {
        ("ECDH+prime256v1-CEUM", "keystore"),
        ("ECDH+prime256v1-CEUM", "keystore_rsa"),
        ("DH+MODP-2048-256", "keystore"),
    }


@ALL
def test_the_reply_is_believed_by_the_initiator(captured: CapturedHandshake) -> None:
    judge, handshake = as_initiator(captured)
    step = done(judge.plugin.process_handshake(captured.reply, handshake))
    assert step.result is ValidationResult.OK_FINAL_MESSAGE
    secret = judge.plugin.get_shared_secret(step.handle)
    assert secret.challenge1.hex() == captured.facts["challenge1"]
    assert secret.challenge2.hex() == captured.facts["challenge2"]
    assert secret.shared_secret.hex() == captured.facts["shared_secret"]
    assert not secret.is_replier
    credential = judge.plugin.get_authenticated_peer_credential_token(step.handle)
    name = captured.names[captured.replier]
    permissions = (HERE / captured.keystore / f"{name}.permissions.p7s").read_bytes()
    assert credential.binary_property("c.perm") == permissions
    assert judge.plugin.get_subject_name(judge.remote) == f"CN={name},O=Peers"


@ALL
def test_the_final_is_believed_by_the_replier(captured: CapturedHandshake) -> None:
    judge, handshake = as_replier(captured)
    step = done(judge.plugin.process_handshake(captured.final, handshake))
    assert step.result is ValidationResult.OK
    secret = judge.plugin.get_shared_secret(step.handle)
    assert secret.shared_secret.hex() == captured.facts["shared_secret"]
    assert secret.is_replier


@ALL
def test_the_request_is_answered_in_the_form_of_who_sent_it(captured: CapturedHandshake) -> None:
    judge = Judge(captured, captured.replier, captured.initiator)
    result = judge.plugin.begin_handshake_reply(captured.request, judge.remote, judge.local, b"")
    reply = message(done(result))
    asked = captured.request.binary_property("c.kagree_algo")
    assert reply.binary_property("c.kagree_algo") == asked
    dsign = captured.request.binary_property("c.dsign_algo")
    assert reply.binary_property("c.dsign_algo") == dsign, "both have keys of one kind"
    assert len(reply.binary_property("dh2") or b"") == (256 if asked == b"DH+MODP-2048-256" else 65)


@pytest.mark.parametrize("captured", [HANDSHAKES[0], HANDSHAKES[-3]], ids=str)
def test_a_flipped_octet_is_noticed(captured: CapturedHandshake) -> None:
    """In each property, at its beginning, in its middle and at its end; PEM text and c.perm too."""
    initiator, waiting_initiator = as_initiator(captured)
    replier, waiting_replier = as_replier(captured)
    for token, plugin, handshake in (
        (captured.reply, initiator.plugin, waiting_initiator),
        (captured.final, replier.plugin, waiting_replier),
    ):
        for name, octets in token.binary_properties:
            for at in {0, len(octets) // 2, len(octets) - 1}:
                assert refusal(plugin.process_handshake(flipped(token, name, at), handshake)), (name, at)
        assert isinstance(settle(plugin.process_handshake(token, handshake)), HandshakeStep)
