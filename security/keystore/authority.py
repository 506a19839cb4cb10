"""A certificate authority: issues identities (identity CA) or signs documents (permissions CA).

DDS-Security 1.1 §9.3.1.1 (Identity CA), §9.4.1.1 (Permissions CA).  One level: what it issues is no authority.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Self

from cryptography import x509
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import ec, rsa
from cryptography.x509.oid import ExtensionOID

from ddsi.structure.errors import ConfigurationError

from ..access_control.smime import sign_document
from .certificate import certificate_validity, parse_certificate
from .distinguished_name import rfc2253_text
from .key_pair import Algorithm, PrivateKey, generate_key, parse_private_key
from .validity import Validity

__all__ = ["Authority"]


@dataclass(frozen=True, slots=True)
class Authority:
    """Its certificate and the key that makes it one."""

    certificate: x509.Certificate
    private_key: PrivateKey = field(repr=False)

    @classmethod
    def create(cls, subject: x509.Name, algorithm: Algorithm, validity: Validity) -> Self:
        """A new one, signed by itself: basicConstraints critical and of one level, as RFC 5280 §4.2.1.9 asks."""
        key = generate_key(algorithm)
        usage = _key_usage(issues_certificates=True)
        certificate = (
            _builder(subject, subject, key.public_key(), validity)
            .add_extension(x509.BasicConstraints(ca=True, path_length=0), critical=True)
            .add_extension(usage, critical=True)
            .sign(key, _digest(key))
        )
        return cls(certificate, key)

    @classmethod
    def parse(cls, certificate_pem: bytes, key_pem: bytes, *, where: str, password: bytes | None = None) -> Self:
        """From PEM.  Raises ConfigurationError where the key is not the certificate's; ``where`` names the files."""
        certificate = parse_certificate(certificate_pem, where)
        key = parse_private_key(key_pem, where, password)
        if certificate.public_key() != key.public_key():
            raise ConfigurationError(
                f"{where}: the key does not fit the certificate; name the two that were made together"
            )
        return cls(certificate, key)

    def issue(
        self, subject: x509.Name, public_key: rsa.RSAPublicKey | ec.EllipticCurvePublicKey, validity: Validity
    ) -> x509.Certificate:
        """The certificate of an identity.  It ends with the authority's own at the latest."""
        return (
            _builder(
                subject, self.certificate.subject, public_key, validity.within(certificate_validity(self.certificate))
            )
            .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
            .add_extension(_key_usage(issues_certificates=False), critical=True)
            .add_extension(self._key_identifier(), critical=False)
            .sign(self.private_key, _digest(self.private_key))
        )

    def sign_document(self, xml: bytes) -> bytes:
        """The document as S/MIME with a detached signature and the text header that Cyclone and Fast DDS insist on."""
        return sign_document(xml, self.certificate, self.private_key)

    def __repr__(self) -> str:
        return f"<Authority {rfc2253_text(self.certificate.subject)}>"

    def _key_identifier(self) -> x509.AuthorityKeyIdentifier:
        try:
            extension = self.certificate.extensions.get_extension_for_oid(ExtensionOID.SUBJECT_KEY_IDENTIFIER)
        except x509.ExtensionNotFound:
            return x509.AuthorityKeyIdentifier.from_issuer_public_key(self.private_key.public_key())
        assert isinstance(extension.value, x509.SubjectKeyIdentifier)
        return x509.AuthorityKeyIdentifier.from_issuer_subject_key_identifier(extension.value)


def _builder(
    subject: x509.Name,
    issuer: x509.Name,
    public_key: rsa.RSAPublicKey | ec.EllipticCurvePublicKey,
    validity: Validity,
) -> x509.CertificateBuilder:
    return (
        x509.CertificateBuilder()
        .subject_name(subject)
        .issuer_name(issuer)
        .public_key(public_key)
        .serial_number(x509.random_serial_number())
        .not_valid_before(validity.not_before)
        .not_valid_after(validity.not_after)
        .add_extension(x509.SubjectKeyIdentifier.from_public_key(public_key), critical=False)
    )


def _key_usage(*, issues_certificates: bool) -> x509.KeyUsage:
    """Handshakes and documents are signed with digitalSignature; an authority issues certificates and lists too."""
    return x509.KeyUsage(
        digital_signature=True,
        content_commitment=False,
        key_encipherment=False,
        data_encipherment=False,
        key_agreement=False,
        key_cert_sign=issues_certificates,
        crl_sign=issues_certificates,
        encipher_only=False,
        decipher_only=False,
    )


def _digest(key: PrivateKey) -> hashes.SHA256 | hashes.SHA384:
    """SHA-256; with P-384 SHA-384, which has as many bits as the curve."""
    is_p384 = isinstance(key, ec.EllipticCurvePrivateKey) and key.curve.key_size > 256
    return hashes.SHA384() if is_p384 else hashes.SHA256()
