"""Authentication: whole handshakes between two of our plugins in one process, and the bare operations in one of them.

Role ``handshake``: Request, Reply and Final with all checks on both sides.  Role ``bare``: what of it no implementation
gets around - two public keys made, two secrets derived, two signatures made and verified, two certificates verified.
"""

from __future__ import annotations

import datetime
import os
import time
from collections.abc import Callable

from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec, padding, rsa

from benchmarks.sides.protocol import play
from ddsi.structure.guid import Guid
from ddsi_security.authentication import PkiDhAuthentication
from ddsi_security.plugins import HandshakeStep, Pending, RemoteIdentity
from ddsi_security.tokens import NIL

Key = rsa.RSAPrivateKey | ec.EllipticCurvePrivateKey

_CONTENT = b"x" * 364  # as much as a handshake's signatures cover
_PSS = padding.PSS(padding.MGF1(hashes.SHA256()), 32)


def _key(kind: str) -> Key:
    return rsa.generate_private_key(65537, 2048) if kind == "rsa" else ec.generate_private_key(ec.SECP256R1())


def _certificate(name: str, key: Key, issuer: str, issuer_key: Key) -> x509.Certificate:
    now = datetime.datetime.now(datetime.UTC)
    return (
        x509.CertificateBuilder()
        .subject_name(x509.Name.from_rfc4514_string(f"CN={name}"))
        .issuer_name(x509.Name.from_rfc4514_string(f"CN={issuer}"))
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - datetime.timedelta(days=1))
        .not_valid_after(now + datetime.timedelta(days=1))
        .sign(issuer_key, hashes.SHA256())
    )


def _pem(certificate: x509.Certificate) -> str:
    return certificate.public_bytes(serialization.Encoding.PEM).decode()


# --- ours -------------------------------------------------------------------------------------------------


class _Participant:
    """One side; ``number`` tells it from others of the same certificate."""

    def __init__(self, number: int, authority: x509.Certificate, certificate: x509.Certificate, key: Key) -> None:
        private = key.private_bytes(
            serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, serialization.NoEncryption()
        )
        properties = {
            "dds.sec.auth.identity_ca": f"data:,{_pem(authority)}",
            "dds.sec.auth.identity_certificate": f"data:,{_pem(certificate)}",
            "dds.sec.auth.private_key": f"data:,{private.decode()}",
        }
        self.plugin = PkiDhAuthentication(properties, entropy=os.urandom, wall_clock=time.time_ns)
        candidate = Guid(number.to_bytes(12, "big") + b"\x00\x00\x01\xc1")
        local = self.plugin.validate_local_identity(0, properties, candidate)
        self.handle, self.guid = local.handle, local.adjusted_participant_guid
        self.data = b"\x00\x50\x00\x10" + self.guid + b"\x00\x01\x00\x00"


def _handshake(initiator: _Participant, replier: _Participant) -> None:
    theirs, ours = _meet(initiator, replier), _meet(replier, initiator)
    requested = initiator.plugin.begin_handshake_request(initiator.handle, theirs.handle, initiator.data)
    assert requested.message is not None
    replied = _settled(
        replier.plugin.begin_handshake_reply(requested.message, ours.handle, replier.handle, replier.data)
    )
    assert replied.message is not None
    finished = _settled(initiator.plugin.process_handshake(replied.message, requested.handle))
    assert finished.message is not None
    ended = _settled(replier.plugin.process_handshake(finished.message, replied.handle))
    secrets = initiator.plugin.get_shared_secret(finished.handle), replier.plugin.get_shared_secret(ended.handle)
    assert secrets[0].shared_secret == secrets[1].shared_secret
    initiator.plugin.return_identity_handle(theirs.handle)
    replier.plugin.return_identity_handle(ours.handle)


def _meet(one: _Participant, other: _Participant) -> RemoteIdentity:
    token = other.plugin.get_identity_token(other.handle)
    found = one.plugin.validate_remote_identity(NIL, one.handle, token, other.guid)
    assert isinstance(found, RemoteIdentity)
    return found


def _settled(result: object) -> HandshakeStep:
    step = result.job() if isinstance(result, Pending) else result
    assert isinstance(step, HandshakeStep), step
    return step


def handshake(kind: str, count: int) -> dict[str, float]:
    authority_key, key = _key(kind), _key(kind)
    authority = _certificate("ca", authority_key, "ca", authority_key)
    certificate = _certificate("robot", key, "ca", authority_key)
    sides = [_Participant(number, authority, certificate, key) for number in (1, 2)]
    initiator, replier = sorted(sides, key=lambda side: side.guid)
    return _rate(lambda: _handshake(initiator, replier), count)


# --- the floor --------------------------------------------------------------------------------------------


def bare(kind: str, count: int) -> dict[str, float]:
    key = _key(kind)
    authority = _certificate("ca", key, "ca", key)
    certificate = _certificate("robot", key, "ca", key)

    def operations() -> None:
        ephemeral = [ec.generate_private_key(ec.SECP256R1()) for _ in range(2)]
        for own, other in (ephemeral, ephemeral[::-1]):
            own.exchange(ec.ECDH(), other.public_key())
            certificate.verify_directly_issued_by(authority)
            if isinstance(key, rsa.RSAPrivateKey):
                key.public_key().verify(key.sign(_CONTENT, _PSS, hashes.SHA256()), _CONTENT, _PSS, hashes.SHA256())
            else:
                ecdsa = ec.ECDSA(hashes.SHA256())
                key.public_key().verify(key.sign(_CONTENT, ecdsa), _CONTENT, ecdsa)

    return _rate(operations, count)


def _rate(operation: Callable[[], None], count: int) -> dict[str, float]:
    operation()
    start = time.perf_counter()
    for _ in range(count):
        operation()
    return {"per_second": count / (time.perf_counter() - start)}


if __name__ == "__main__":
    play({"handshake": handshake, "bare": bare})
