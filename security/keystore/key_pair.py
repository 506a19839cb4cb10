"""Private keys: made, read and written.  DDS-Security 1.1 §9.3.1 (RSA-2048, EC P-256), 1.2 §9.3.1 (EC P-384)."""

from __future__ import annotations

from enum import StrEnum
from typing import TypeAlias

from cryptography.exceptions import UnsupportedAlgorithm
from cryptography.hazmat.primitives import serialization
from cryptography.hazmat.primitives.asymmetric import ec, rsa
from cryptography.hazmat.primitives.asymmetric.types import PublicKeyTypes

from ddsi.structure.errors import ConfigurationError

__all__ = ["Algorithm", "PrivateKey", "algorithm_text", "generate_key", "parse_private_key", "private_key_pem"]

PrivateKey: TypeAlias = rsa.RSAPrivateKey | ec.EllipticCurvePrivateKey


class Algorithm(StrEnum):
    """What a key is made for.  EC is P-256, which every vendor takes; P-384 came with DDS-Security 1.2."""

    EC = "EC"
    RSA = "RSA"
    EC_P384 = "EC-P384"


def generate_key(algorithm: Algorithm) -> PrivateKey:
    """A new key, by the cryptographic library's own entropy."""
    match algorithm:
        case Algorithm.RSA:
            return rsa.generate_private_key(public_exponent=65537, key_size=2048)
        case Algorithm.EC_P384:
            return ec.generate_private_key(ec.SECP384R1())
        case _:
            return ec.generate_private_key(ec.SECP256R1())


def private_key_pem(key: PrivateKey, password: bytes | None = None) -> bytes:
    """PKCS#8 in PEM, which every vendor reads; encrypted where there is a password."""
    encryption = serialization.BestAvailableEncryption(password) if password else serialization.NoEncryption()
    return key.private_bytes(serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, encryption)


def parse_private_key(pem: bytes, where: str, password: bytes | None = None) -> PrivateKey:
    """A key in PEM, PKCS#8 or traditional.  Raises ConfigurationError, which never shows the key or the password."""
    try:
        key = serialization.load_pem_private_key(pem, password)
    except TypeError as error:
        if password is None:
            raise ConfigurationError(f"{where} is protected by a password: give it with --password-file") from error
        key = parse_private_key(pem, where)  # a password for a key that needs none does no harm
    except (ValueError, UnsupportedAlgorithm) as error:
        hint = "the password is wrong, or it is damaged" if password else "is it a private key in PEM?"
        raise ConfigurationError(f"{where} cannot be read as a private key: {hint}") from error
    if not isinstance(key, rsa.RSAPrivateKey | ec.EllipticCurvePrivateKey):
        raise ConfigurationError(f"{where} is neither an RSA nor an EC key: DDS Security knows no others")
    return key


def algorithm_text(key: PublicKeyTypes) -> str:
    """``EC P-256``, ``RSA 2048``; of other kinds, the library's name."""
    if isinstance(key, rsa.RSAPublicKey):
        return f"RSA {key.key_size}"
    if isinstance(key, ec.EllipticCurvePublicKey):
        return {"secp256r1": "EC P-256", "secp384r1": "EC P-384"}.get(key.curve.name, f"EC {key.curve.name}")
    return type(key).__name__.removeprefix("_").removesuffix("PublicKey")
