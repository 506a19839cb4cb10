"""Reads the private key of an identity from PEM.  DDS-Security 1.1 §9.3.1.

PKCS#8 and the traditional forms, encrypted or not.  ``dds.sec.auth.password`` is the base64 of what decrypts the key by
the specification, and the passphrase itself in every stack: the passphrase is tried first, then what it decodes to.
"""

from __future__ import annotations

import base64
import binascii

from cryptography.exceptions import UnsupportedAlgorithm
from cryptography.hazmat.primitives import serialization
from cryptography.hazmat.primitives.asymmetric import ec, rsa
from cryptography.hazmat.primitives.asymmetric.types import PrivateKeyTypes

from .not_trusted import NotTrusted
from .signatures import SoftwareKey, algorithm_of_key

__all__ = ["read_private_key"]


def read_private_key(pem: bytes, password: str | None) -> SoftwareKey:
    """Raises NotTrusted, which says what to do, and shows nothing of key or password."""
    key = _load(pem, password)
    if not isinstance(key, rsa.RSAPrivateKey | ec.EllipticCurvePrivateKey):
        algorithm_of_key(key.public_key())  # says what it is
        raise NotTrusted("it is no key that signs")
    return SoftwareKey(key)


def _load(pem: bytes, password: str | None) -> PrivateKeyTypes:
    try:
        return serialization.load_pem_private_key(pem, None)
    except TypeError as error:  # it is encrypted
        if not password:
            raise NotTrusted("it is encrypted: give its passphrase in dds.sec.auth.password") from error
    except (ValueError, UnsupportedAlgorithm) as error:
        raise NotTrusted("it is no private key in PEM that can be read (PKCS#8, or -----BEGIN EC/RSA-----)") from error
    for passphrase in _passphrases(password):
        try:
            return serialization.load_pem_private_key(pem, passphrase)
        except (ValueError, UnsupportedAlgorithm):
            continue
    raise NotTrusted("the passphrase in dds.sec.auth.password does not decrypt it, neither as it is nor as base64")


def _passphrases(password: str) -> list[bytes]:
    passphrases = [password.encode()]
    try:
        passphrases.append(base64.b64decode(password, validate=True))
    except (binascii.Error, ValueError):
        return passphrases
    return [passphrase for passphrase in passphrases if passphrase]
