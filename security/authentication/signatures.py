"""Signatures: which keys are accepted, how a handshake is signed, and how a signature is verified.

DDS-Security 1.1 §9.3.2.5.2, table 51: ECDSA with SHA-256, or RSASSA-PSS with SHA-256 and MGF1 of SHA-256; 1.2 adds
ECDSA over P-384 with SHA-384.  Fast DDS signs with a PSS salt of 32 octets, Cyclone DDS and OpenDDS with the longest
possible; each verifies any, and so do we.

The specification names RSA of 2048 bits alone.  Authorities often have longer keys, and Fast DDS takes those under the
same names, so we do; Cyclone DDS refuses them.
"""

from __future__ import annotations

from typing import Final, Protocol

from cryptography.exceptions import InvalidSignature, UnsupportedAlgorithm
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import ec, padding, rsa

from .algorithms import EC_P256, EC_P384, RSA_2048, SignatureAlgorithm
from .not_trusted import NotTrusted

__all__ = ["PSS_SALT_OCTETS", "PrivateKey", "PublicKey", "SoftwareKey", "algorithm_of_key", "hash_of", "verify"]

PublicKey = rsa.RSAPublicKey | ec.EllipticCurvePublicKey

PSS_SALT_OCTETS: Final = 32
_LEAST_RSA_BITS: Final = 2048
_MOST_RSA_BITS: Final = 4096
"""Longer ones cost more than a stranger may ask for."""
_CURVES: Final = {"secp256r1": EC_P256, "secp384r1": EC_P384}
_SIGNING_PSS: Final = padding.PSS(padding.MGF1(hashes.SHA256()), PSS_SALT_OCTETS)
_ANY_PSS: Final = padding.PSS(padding.MGF1(hashes.SHA256()), padding.PSS.AUTO)


class PrivateKey(Protocol):
    """What signs for an identity: a key in memory, or one that never leaves its hardware token."""

    @property
    def algorithm(self) -> SignatureAlgorithm: ...

    def sign(self, content: bytes) -> bytes:
        """The signature as it goes to the peer: DER for ECDSA.  May take long, and be called in a worker thread."""
        ...

    def close(self) -> None:
        """Forget the key."""
        ...


class SoftwareKey:
    """A private key in memory."""

    __slots__ = ("_key", "algorithm")

    def __init__(self, key: rsa.RSAPrivateKey | ec.EllipticCurvePrivateKey) -> None:
        self.algorithm: Final = algorithm_of_key(key.public_key())
        self._key: rsa.RSAPrivateKey | ec.EllipticCurvePrivateKey | None = key

    def sign(self, content: bytes) -> bytes:
        match self._key:
            case None:
                raise NotTrusted("our identity was returned meanwhile")
            case rsa.RSAPrivateKey() as key:
                return key.sign(content, _SIGNING_PSS, hashes.SHA256())
            case key:
                return _sign_deterministically(key, content, hash_of(self.algorithm))

    def close(self) -> None:
        self._key = None

    def __repr__(self) -> str:
        return f"<SoftwareKey {self.algorithm.key}>"


def algorithm_of_key(key: object) -> SignatureAlgorithm:
    """Raises NotTrusted, naming what the key is, for all but RSA of 2048 to 4096 bits, EC P-256 and EC P-384."""
    match key:
        case rsa.RSAPublicKey() if _LEAST_RSA_BITS <= key.key_size <= _MOST_RSA_BITS:
            return RSA_2048
        case ec.EllipticCurvePublicKey() if key.curve.name in _CURVES:
            return _CURVES[key.curve.name]
        case rsa.RSAPublicKey():
            found = f"RSA {key.key_size}"
        case ec.EllipticCurvePublicKey():
            found = f"EC {key.curve.name}"
        case _:
            found = type(key).__name__.removesuffix("PublicKey") or "unknown"
    raise NotTrusted(f"its key is {found}, and only RSA of 2048 to 4096 bits, EC P-256 and EC P-384 are supported")


def verify(key: PublicKey, signature: bytes, content: bytes) -> None:
    """Raises NotTrusted unless the key's owner signed the content.  The signature is untrusted."""
    algorithm = algorithm_of_key(key)
    try:
        if isinstance(key, rsa.RSAPublicKey):
            key.verify(signature, content, _ANY_PSS, hashes.SHA256())
        else:
            key.verify(signature, content, ec.ECDSA(hash_of(algorithm)))
    except (InvalidSignature, ValueError) as error:
        raise NotTrusted("the signature is not that of the certificate's owner") from error


def hash_of(algorithm: SignatureAlgorithm) -> hashes.SHA256 | hashes.SHA384:
    return hashes.SHA384() if algorithm is EC_P384 else hashes.SHA256()


def _sign_deterministically(
    key: ec.EllipticCurvePrivateKey, content: bytes, algorithm: hashes.SHA256 | hashes.SHA384
) -> bytes:
    """With the nonce of RFC 6979, so that a seed replays and no weak entropy can betray the key.

    OpenSSL has it from 3.2 on; with an older one the nonce is random.
    """
    try:
        return key.sign(content, ec.ECDSA(algorithm, deterministic_signing=True))
    except UnsupportedAlgorithm:
        return key.sign(content, ec.ECDSA(algorithm))
