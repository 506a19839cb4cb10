"""The handshakes of a capture, verified step by step from the specification with no code of ours.

DDS-Security 1.1 §9.3.2.5, §9.3.4.  Asserts where a check fails: each of these handshakes is known to be good.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cryptography import x509
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import ec, padding, rsa

from tests.security.captured.straight import Message, binary_properties

Token = Mapping[str, bytes]
PROPERTIES = "c.id", "c.perm", "c.pdata", "c.dsign_algo", "c.kagree_algo"
PARTICIPANT_GUID = b"\x00\x50\x00\x10"
"""Parameter id and length, big endian."""


@dataclass(frozen=True)
class Handshake:
    """The three tokens of two participants, who are known by their Guid prefixes."""

    initiator: bytes
    replier: bytes
    request: Token
    reply: Token
    final: Token

    @property
    def hash_c1(self) -> bytes:
        return hashlib.sha256(_described(self.request)).digest()

    @property
    def hash_c2(self) -> bytes:
        return hashlib.sha256(_described(self.reply)).digest()

    @property
    def signed_by_replier(self) -> bytes:
        return self._signed("hash_c2", "challenge2", "dh2", "challenge1", "dh1", "hash_c1")

    @property
    def signed_by_initiator(self) -> bytes:
        return self._signed("hash_c1", "challenge1", "dh1", "challenge2", "dh2", "hash_c2")

    def _signed(self, *names: str) -> bytes:
        """Both signatures cover the same six values, which need not be in the message that is signed."""
        values = {"hash_c1": self.hash_c1, "hash_c2": self.hash_c2}
        values |= {name: self.request[name] for name in ("challenge1", "dh1")}
        values |= {name: self.reply[name] for name in ("challenge2", "dh2")}
        return binary_properties([(name, values[name]) for name in names])


def handshakes(messages: Sequence[Message]) -> list[Handshake]:
    """Those that were completed.  A message that is repeated says the same again."""
    tokens: dict[tuple[bytes, bytes, str], Token] = {}
    for message in messages:
        if message.class_id != "dds.sec.auth":
            continue
        ((class_id, token),) = message.tokens
        step = message.source_guid[:12], message.destination_participant[:12], class_id.removeprefix(_CLASS)
        assert tokens.setdefault(step, token) == token
    return [
        Handshake(initiator, replier, request, tokens[replier, initiator, "Reply"], tokens[initiator, replier, "Final"])
        for (initiator, replier, step), request in tokens.items()
        if step == "Req"
    ]


_CLASS = "DDS:Auth:PKI-DH:1.0+"


def verify(handshake: Handshake, kx: Mapping[str, Any], keystore: Path, identities: Mapping[bytes, str]) -> None:
    """``kx`` and ``identities`` (names in the keystore by prefix) are from the capture's JSON."""
    request, reply, final = handshake.request, handshake.reply, handshake.final
    assert handshake.initiator < handshake.replier
    for token in (request, reply, final):
        assert token.get("hash_c1", handshake.hash_c1) == handshake.hash_c1
        assert token.get("hash_c2", handshake.hash_c2) == handshake.hash_c2
        assert token.get("dh1", request["dh1"]) == request["dh1"]
        assert token.get("dh2", reply["dh2"]) == reply["dh2"]
        assert token["challenge1"].hex() == kx["challenge1"]
        assert token.get("challenge2", reply["challenge2"]).hex() == kx["challenge2"]
    assert reply["c.kagree_algo"].rstrip(b"\0").decode() == kx["key_agreement"]
    assert request["c.kagree_algo"].rstrip(b"\0") == reply["c.kagree_algo"].rstrip(b"\0")
    assert hashlib.sha256(bytes.fromhex(kx["dh_secret"])).hexdigest() == kx["shared_secret"]
    for prefix, token in ((handshake.initiator, request), (handshake.replier, reply)):
        _verify_credentials(token, prefix, keystore, identities[prefix])
    verify_signature(reply, reply["signature"], handshake.signed_by_replier)
    verify_signature(request, final["signature"], handshake.signed_by_initiator)


def _described(token: Token) -> bytes:
    return binary_properties([(name, token[name]) for name in PROPERTIES])


def _verify_credentials(token: Token, prefix: bytes, keystore: Path, name: str) -> None:
    """The certificate is that of the keystore, its authority's, and the Guid is made from it (§9.3.3)."""
    certificate = x509.load_pem_x509_certificate(token["c.id"])
    assert certificate == x509.load_pem_x509_certificate((keystore / f"{name}.pem").read_bytes())
    certificate.verify_directly_issued_by(
        x509.load_pem_x509_certificate((keystore / "identity_ca.pem").read_bytes()),
    )
    assert token["c.perm"].rstrip(b"\0") == (keystore / f"{name}.permissions.p7s").read_bytes()
    subject_hash = int.from_bytes(hashlib.sha256(certificate.subject.public_bytes()).digest()[:6], "big")
    assert prefix[:6] == (1 << 47 | subject_hash >> 1).to_bytes(6, "big")
    assert PARTICIPANT_GUID + prefix + b"\0\0\1\xc1" in token["c.pdata"]


def verify_signature(credentials: Token, signature: bytes, content: bytes) -> None:
    """By the key and the algorithm of who sent ``credentials``.  Raises InvalidSignature."""
    public_key = x509.load_pem_x509_certificate(credentials["c.id"]).public_key()
    algorithm = credentials["c.dsign_algo"].rstrip(b"\0")
    if isinstance(public_key, ec.EllipticCurvePublicKey):
        assert algorithm == b"ECDSA-SHA256"
        public_key.verify(signature, content, ec.ECDSA(hashes.SHA256()))
    else:
        assert isinstance(public_key, rsa.RSAPublicKey)
        assert algorithm == b"RSASSA-PSS-SHA256"
        pss = padding.PSS(padding.MGF1(hashes.SHA256()), padding.PSS.AUTO)
        public_key.verify(signature, content, pss, hashes.SHA256())
