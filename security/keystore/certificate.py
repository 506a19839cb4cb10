"""Certificates read from PEM, and the few facts of them that keystores need.  RFC 5280."""

from __future__ import annotations

from cryptography import x509
from cryptography.exceptions import InvalidSignature, UnsupportedAlgorithm
from cryptography.hazmat.primitives import serialization
from cryptography.x509.oid import ExtendedKeyUsageOID

from ddsi.structure.errors import ConfigurationError

from .validity import Validity

__all__ = ["certificate_pem", "certificate_validity", "is_authority", "is_issued_by", "parse_certificate"]


def parse_certificate(pem: bytes, where: str) -> x509.Certificate:
    """The first certificate of a PEM file.  Raises ConfigurationError naming ``where``."""
    try:
        certificate = x509.load_pem_x509_certificate(pem)
        # The library reads these when they are asked for, and complains only then.
        _ = certificate.subject, certificate.issuer, certificate.public_key(), certificate.extensions
        _ = certificate_validity(certificate)
    except (ValueError, UnsupportedAlgorithm) as error:
        raise ConfigurationError(
            f"{where} cannot be read as a certificate: it must be PEM, beginning with -----BEGIN CERTIFICATE-----"
        ) from error
    return certificate


def certificate_pem(certificate: x509.Certificate) -> bytes:
    return certificate.public_bytes(serialization.Encoding.PEM)


def certificate_validity(certificate: x509.Certificate) -> Validity:
    return Validity(certificate.not_valid_before_utc, certificate.not_valid_after_utc)


def is_authority(certificate: x509.Certificate) -> bool:
    """Does it say of itself that it may issue others (basicConstraints)?"""
    try:
        return certificate.extensions.get_extension_for_class(x509.BasicConstraints).value.ca
    except (x509.ExtensionNotFound, ValueError):
        return False


def may_sign_documents(certificate: x509.Certificate) -> bool:
    """Does it not say that its key is for something else than S/MIME (keyUsage, extendedKeyUsage)?"""
    try:
        extensions = certificate.extensions
    except ValueError:
        return True
    for extension in extensions:
        match extension.value:
            case x509.KeyUsage() as usage if not (usage.digital_signature or usage.content_commitment):
                return False
            case x509.ExtendedKeyUsage() as usages if ExtendedKeyUsageOID.EMAIL_PROTECTION not in usages:
                return False
            case _:
                continue
    return True


def is_issued_by(certificate: x509.Certificate, authority: x509.Certificate) -> bool:
    """By name and by signature.  One level, which is all that vendors agree on."""
    try:
        certificate.verify_directly_issued_by(authority)
    except (ValueError, TypeError, InvalidSignature, UnsupportedAlgorithm):
        return False
    return True
