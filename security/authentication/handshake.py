"""The handshake itself: three messages, and the checks on each.  DDS-Security 1.1 §8.3.2.9, §9.3.2.5, §9.3.4.

    initiator                                replier
    RequestSent     ---- Request ---->
                    <---- Reply ------       ReplySent        certificate of the initiator believed
    Authenticated   ---- Final ------>       Authenticated    signature of the initiator verified

A Request proves nothing: anybody can send the certificate of another with a key agreement of his own.  Each signature
covers the values of both sides, so the initiator knows the other with the Reply, the replier with the Final.

Each of the three states is a handle by itself, and a message that fits makes the next one and leaves the old one as it
was.  So what is refused changes nothing.  Every step has two halves: the first looks at what costs nothing, draws
entropy, and returns the second as a job, which verifies, signs and computes, and sees only values that do not change.
Both raise NotTrusted over a message that is not right, and nothing else.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from ..handles import HandshakeHandle
from ..tokens import HandshakeMessageToken
from .algorithms import ECDH_P256, NameForm, key_agreement_named
from .handshake_tokens import (
    CHALLENGE_OCTETS,
    AgreedValues,
    Credentials,
    challenge,
    final_token,
    reply_token,
    request_token,
    require_if_present,
    required,
)
from .identities import RemoteIdentityHandle
from .key_agreement import EphemeralKey, draw_private_key, is_der
from .not_trusted import NotTrusted
from .peer import Peer
from .signatures import verify

__all__ = ["Authenticated", "Handshake", "ReplySent", "RequestSent", "answer_request", "begin"]


class Handshake(HandshakeHandle):
    """Between one local and one remote participant.

    ``received`` is the message that brought it here and ``sent`` what we answered: the same message again gets the same
    answer.
    """

    __slots__ = ("received", "remote", "sent")

    def __init__(
        self,
        remote: RemoteIdentityHandle,
        received: HandshakeMessageToken | None,
        sent: HandshakeMessageToken | None,
    ) -> None:
        self.remote: Final = remote
        self.received: Final = received
        self.sent: Final = sent

    def wipe(self) -> None:
        """Forget what is secret in it."""


class RequestSent(Handshake):
    """We began, and wait for the Reply."""

    __slots__ = ("_key", "challenge1", "hash_c1")

    def __init__(
        self, remote: RemoteIdentityHandle, request: HandshakeMessageToken, hash_c1: bytes, key: EphemeralKey
    ) -> None:
        super().__init__(remote, None, request)
        self.challenge1: Final = required(request, "challenge1")
        self.hash_c1: Final = hash_c1
        self._key: Final = key

    def on_reply(self, reply: HandshakeMessageToken, now: int) -> Callable[[], Authenticated]:
        """Judge the peer's Reply, and answer it with our Final."""
        key, remote, signer = self._key, self.remote, self.remote.local.key
        expected = remote.expected(now)
        theirs, signature = Credentials.of(reply), required(reply, "signature")
        values = AgreedValues(
            hash_c1=self.hash_c1,
            challenge1=self.challenge1,
            dh1=key.public,
            hash_c2=theirs.hash(),
            challenge2=challenge(reply, "challenge2", expected.challenge),
            dh2=required(reply, "dh2"),
        )
        required(reply, "challenge1")
        values.require_in(reply)
        if key_agreement_named(theirs.c_kagree_algo) is not key.agreement:
            raise NotTrusted(f"it chose {theirs.c_kagree_algo[:64]!r}, and {key.agreement.name} was proposed")

        def job() -> Authenticated:
            peer = expected.peer(theirs)
            verify(peer.certificate.public_key, signature, values.reply_content())
            secret = key.shared_secret(values.dh2)
            final = final_token(values, signer.sign(values.final_content()))
            return Authenticated(remote, reply, final, peer, values, secret)

        return job

    def wipe(self) -> None:
        self._key.wipe()


class _Agreed(Handshake):
    """Both sides' values are known, and so is the secret."""

    __slots__ = ("_secret", "peer", "values")

    def __init__(
        self,
        remote: RemoteIdentityHandle,
        received: HandshakeMessageToken,
        sent: HandshakeMessageToken | None,
        peer: Peer,
        values: AgreedValues,
        secret: bytes,
    ) -> None:
        super().__init__(remote, received, sent)
        self.peer: Final = peer
        self.values: Final = values
        self._secret = bytearray(secret)

    @property
    def secret(self) -> bytes:
        """32 octets; none once it was wiped."""
        return bytes(self._secret)

    def wipe(self) -> None:
        self._secret[:] = bytes(len(self._secret))
        self._secret.clear()


class ReplySent(_Agreed):
    """We answered, and wait for the Final.  That the peer is who its certificate says is not proven yet."""

    __slots__ = ()

    def on_final(self, final: HandshakeMessageToken) -> Callable[[], Authenticated]:
        """Judge the peer's Final, which needs no answer."""
        signature, secret = required(final, "signature"), self.secret
        if not secret:
            raise NotTrusted("the handshake was returned meanwhile")
        required(final, "challenge1")
        required(final, "challenge2")
        self.values.require_in(final)

        def job() -> Authenticated:
            verify(self.peer.certificate.public_key, signature, self.values.final_content())
            return Authenticated(self.remote, final, None, self.peer, self.values, secret)

        return job


class Authenticated(_Agreed):
    """The peer is who its certificate says."""

    __slots__ = ()


def begin(remote: RemoteIdentityHandle, participant_data: bytes, entropy: Callable[[int], bytes]) -> RequestSent:
    """We are the initiator.  Always with ECDH: Cyclone DDS and others write MODP keys in two ways that do not mix."""
    local, form = remote.local, NameForm.for_vendor(remote.vendor_id)
    credentials = Credentials(
        c_id=local.pem,
        c_perm=local.credential,
        c_pdata=participant_data,
        c_dsign_algo=form.write(local.certificate.algorithm),
        c_kagree_algo=form.write(ECDH_P256),
    )
    key = EphemeralKey(ECDH_P256, draw_private_key(ECDH_P256, entropy))
    challenge1 = remote.our_challenge or entropy(CHALLENGE_OCTETS)
    return RequestSent(
        remote, request_token(credentials, dh1=key.public, challenge1=challenge1), credentials.hash(), key
    )


def answer_request(
    remote: RemoteIdentityHandle,
    request: HandshakeMessageToken,
    participant_data: bytes,
    entropy: Callable[[int], bytes],
    now: int,
) -> Callable[[], ReplySent]:
    """We are the replier: judge the peer's Request, and answer it with our Reply."""
    local, expected, theirs = remote.local, remote.expected(now), Credentials.of(request)
    dh1, hash_c1 = required(request, "dh1"), theirs.hash()
    challenge1 = challenge(request, "challenge1", expected.challenge)
    require_if_present(request, "hash_c1", hash_c1)
    agreement = key_agreement_named(theirs.c_kagree_algo)
    if agreement is None:
        raise NotTrusted(f"its key agreement {theirs.c_kagree_algo[:64]!r} is not supported")
    ours = Credentials(
        c_id=local.pem,
        c_perm=local.credential,
        c_pdata=participant_data,
        c_dsign_algo=NameForm.of(theirs.c_dsign_algo).write(local.certificate.algorithm),
        c_kagree_algo=theirs.c_kagree_algo,
    )
    challenge2 = remote.our_challenge or entropy(CHALLENGE_OCTETS)
    private_key, signer = draw_private_key(agreement, entropy), local.key

    def job() -> ReplySent:
        peer = expected.peer(theirs)
        key = EphemeralKey(agreement, private_key, der=is_der(dh1))
        # Before anything is signed: a public key that is none is refused here.
        secret = key.shared_secret(dh1)
        values = AgreedValues(
            hash_c1=hash_c1, challenge1=challenge1, dh1=dh1, hash_c2=ours.hash(), challenge2=challenge2, dh2=key.public
        )
        reply = reply_token(ours, values, signer.sign(values.reply_content()))
        return ReplySent(remote, request, reply, peer, values, secret)

    return job
