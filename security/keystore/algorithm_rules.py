"""Rules on algorithms: which keys and signatures of certificates can be forged, and which not every vendor takes.

DDS-Security 1.1 §9.3.1 knows RSA of 2048 bits and EC P-256, both with SHA-256.  Vendors take more, but not the same:
Cyclone DDS 0.10 looks at the keys of the identity CA and of identities, Fast DDS 2.9 at how these certificates and the
permissions CA's are signed.  Each was tried in both roles with certificates by openssl: ``docs/keystore.md``.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Final

from cryptography import x509
from cryptography.exceptions import UnsupportedAlgorithm
from cryptography.hazmat.primitives.asymmetric import ec, rsa
from cryptography.x509.oid import PublicKeyAlgorithmOID, SignatureAlgorithmOID

from .finding import Finding, Rule, Severity
from .key_pair import algorithm_text

__all__ = ["RULES", "check_identity_ca_key", "check_identity_key", "check_permissions_ca_key", "check_signature"]

WEAK_ALGORITHM: Final = Rule("weak-algorithm", Severity.ERROR, "a key or a signature that can be forged")
UNSUPPORTED_KEY: Final = Rule("unsupported-key", Severity.ERROR, "a key of a kind that DDS Security does not know")
P384_KEY: Final = Rule("p384-key", Severity.WARNING, "EC P-384, which came with DDS Security 1.2")
RSA_KEY: Final = Rule("rsa-key", Severity.WARNING, "an RSA key that Cyclone DDS refuses")
SIGNATURE: Final = Rule("certificate-signature", Severity.WARNING, "a certificate's signature that Fast DDS refuses")
RULES: Final = (WEAK_ALGORITHM, UNSUPPORTED_KEY, P384_KEY, RSA_KEY, SIGNATURE)

_LEAST_RSA_BITS: Final = 2048
_MOST_RSA_BITS: Final = 4096
_LEAST_EC_BITS: Final = 256
_WEAK_DIGESTS: Final = ("md5", "sha1")
_OF_ALL_VENDORS: Final = (SignatureAlgorithmOID.ECDSA_WITH_SHA256, SignatureAlgorithmOID.RSA_WITH_SHA256)
_MAKE_IT_ANEW: Final = "make it anew with EC P-256, which every vendor takes, or RSA of 2048 bits"


def check_identity_key(path: Path, certificate: x509.Certificate) -> Iterator[Finding]:
    """The subjectPublicKeyInfo of an identity's certificate."""
    yield from _check_key(path, certificate, "the identity's certificate", ", and Fast DDS 2.9 refuses its handshakes")


def check_identity_ca_key(path: Path, certificate: x509.Certificate) -> Iterator[Finding]:
    """The subjectPublicKeyInfo of the identity CA's certificate."""
    yield from _check_key(path, certificate, "the identity CA's certificate", "")


def check_permissions_ca_key(path: Path, certificate: x509.Certificate) -> Iterator[Finding]:
    """The subjectPublicKeyInfo of the permissions CA's certificate: any that S/MIME knows will do for every vendor."""
    key, what = certificate.public_key(), "the permissions CA's certificate"
    if not isinstance(key, rsa.RSAPublicKey | ec.EllipticCurvePublicKey):
        yield _unsupported(path, what, algorithm_text(key))
    elif key.key_size < (_LEAST_RSA_BITS if isinstance(key, rsa.RSAPublicKey) else _LEAST_EC_BITS):
        yield _weak(path, what, algorithm_text(key))


def check_signature(path: Path, certificate: x509.Certificate, what: str) -> Iterator[Finding]:
    """The signatureAlgorithm of any certificate, an authority's own too.

    Fast DDS looks at those of the certificates that it is configured with, and takes any of a peer's.
    """
    identifier = certificate.signature_algorithm_oid
    if identifier in _OF_ALL_VENDORS:
        return
    digest = _digest_name(certificate)
    if digest in _WEAK_DIGESTS:
        text = f"{what} is signed with {digest.upper()}, which can be forged"
        yield WEAK_ALGORITHM.at(path, text, remedy="issue it anew with SHA-256: ddsi keystore ca or identity")
        return
    scheme = "RSASSA-PSS with " if identifier == SignatureAlgorithmOID.RSASSA_PSS else ""
    signed = f"{scheme}{digest.upper()}" if digest else identifier.dotted_string
    yield SIGNATURE.at(
        path,
        f"the signatureAlgorithm of {what} is {signed}: Fast DDS 2.9 does not start with it, as it takes SHA-256 "
        "alone, with ECDSA or PKCS #1 v1.5",
        remedy="issue it anew where Fast DDS takes part: ddsi keystore ca or identity, or openssl with -sha256",
    )


def _check_key(path: Path, certificate: x509.Certificate, what: str, of_p384: str) -> Iterator[Finding]:
    key = certificate.public_key()
    kind = algorithm_text(key)
    if isinstance(key, rsa.RSAPublicKey):
        if key.key_size < _LEAST_RSA_BITS:
            yield _weak(path, what, kind)
        elif key.key_size > _MOST_RSA_BITS:
            yield _unsupported(path, what, kind)
        elif certificate.public_key_algorithm_oid == PublicKeyAlgorithmOID.RSASSA_PSS:
            yield _refused_by_cyclone(path, what, f"{kind} for RSASSA-PSS alone")
        elif key.key_size != _LEAST_RSA_BITS:
            yield _refused_by_cyclone(path, what, kind)
    elif kind == "EC P-384":
        text = f"{what} has a key of EC P-384: Cyclone DDS 0.10, which knows DDS Security 1.1, refuses it{of_p384}"
        yield P384_KEY.at(path, text, remedy="use EC P-256 where they take part")
    elif kind != "EC P-256":
        yield _unsupported(path, what, kind)


def _weak(path: Path, what: str, kind: str) -> Finding:
    return WEAK_ALGORITHM.at(path, f"{what} has a key of {kind}, which can be broken", remedy=_MAKE_IT_ANEW)


def _unsupported(path: Path, what: str, kind: str) -> Finding:
    text = f"{what} has a key of {kind}; DDS Security knows RSA 2048 and EC P-256"
    return UNSUPPORTED_KEY.at(path, text, remedy=_MAKE_IT_ANEW)


def _refused_by_cyclone(path: Path, what: str, kind: str) -> Finding:
    text = f"{what} has a key of {kind}: Cyclone DDS 0.10 takes plain RSA of 2048 bits and EC P-256 alone"
    return RSA_KEY.at(path, text, remedy="make it anew with EC P-256 or RSA of 2048 bits where Cyclone DDS takes part")


def _digest_name(certificate: x509.Certificate) -> str:
    try:
        algorithm = certificate.signature_hash_algorithm
    except UnsupportedAlgorithm:
        return ""
    return algorithm.name if algorithm else ""
