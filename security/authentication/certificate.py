"""Certificate: an X.509 certificate, read once and for all, and what of it the handshake needs.

RFC 5280; DDS-Security 1.1 §9.3.1.2 (identity certificates: RSA or EC P-256; 1.2 adds P-384).  Those of peers are
hostile: reading one raises NotTrusted and nothing else.  Whether it is to be believed, ``trust_anchors`` decides.
"""

from __future__ import annotations

from dataclasses import field
from datetime import datetime, timedelta
from typing import Final

from cryptography import x509
from cryptography.exceptions import UnsupportedAlgorithm
from cryptography.hazmat.primitives import serialization
from cryptography.hazmat.primitives.asymmetric import ec, rsa
from cryptography.x509.oid import ExtensionOID, ObjectIdentifier

from ddsi.structure.dataclass import dataclass

from .algorithms import SignatureAlgorithm
from .der import read_element
from .not_trusted import NotTrusted
from .signatures import PublicKey, algorithm_of_key

__all__ = ["MAX_CERTIFICATE_OCTETS", "PARSE_ERRORS", "Certificate", "pem_blocks", "text_of_time"]

MAX_CERTIFICATE_OCTETS: Final = 1 << 16
"""In PEM; real ones have one or two kilobytes."""

# What the library raises over octets that it cannot read; its warnings, where a program made errors of them.
PARSE_ERRORS: Final = (
    *(ValueError, TypeError, OverflowError, Warning),
    *(UnsupportedAlgorithm, x509.InvalidVersion, x509.DuplicateExtension, x509.UnsupportedGeneralNameType),
)

# What we look at, and what says nothing to the purpose.  Any other extension that is critical forbids the use.
_EXTENSIONS: Final = {
    ExtensionOID.BASIC_CONSTRAINTS,
    ExtensionOID.KEY_USAGE,
    ExtensionOID.EXTENDED_KEY_USAGE,
    ExtensionOID.SUBJECT_ALTERNATIVE_NAME,
    ExtensionOID.SUBJECT_KEY_IDENTIFIER,
    ExtensionOID.AUTHORITY_KEY_IDENTIFIER,
    ExtensionOID.CRL_DISTRIBUTION_POINTS,
    ExtensionOID.CERTIFICATE_POLICIES,
}
# Collisions in these are made at will, so what they sign may be another's.
_BROKEN: Final = {"md5": "MD5", "sha1": "SHA-1"}
_NANOSECONDS: Final = 1_000_000_000


@dataclass(frozen=True, slots=True)
class Certificate:
    """``subject`` is RFC 4514 text, ``subject_der`` the octets of the Name.  Equal if its octets are.

    Valid from ``valid_from`` to ``valid_until`` (exclusive), in nanoseconds since 1970.
    """

    subject: str
    issuer: str
    subject_der: bytes = field(repr=False)
    algorithm: SignatureAlgorithm
    valid_from: int
    valid_until: int
    der: bytes = field(repr=False)
    parsed: x509.Certificate = field(repr=False, compare=False)
    public_key: PublicKey = field(repr=False, compare=False)

    @classmethod
    def from_pem(cls, pem: bytes) -> Certificate:
        """The first certificate of a PEM text; what stands around it is ignored.  Untrusted; raises NotTrusted."""
        if len(pem) > MAX_CERTIFICATE_OCTETS:
            raise NotTrusted(f"the certificate is larger than {MAX_CERTIFICATE_OCTETS} octets")
        try:
            return cls._of(x509.load_pem_x509_certificate(pem.rstrip(b"\0")))
        except PARSE_ERRORS as error:
            raise NotTrusted("it is no X.509 certificate in PEM that can be read") from error

    @classmethod
    def from_der(cls, der: bytes) -> Certificate:
        """As hardware tokens keep them."""
        try:
            return cls._of(x509.load_der_x509_certificate(der))
        except PARSE_ERRORS as error:
            raise NotTrusted("it is no X.509 certificate in DER that can be read") from error

    @classmethod
    def _of(cls, certificate: x509.Certificate) -> Certificate:
        key = certificate.public_key()
        algorithm = algorithm_of_key(key)
        assert isinstance(key, rsa.RSAPublicKey | ec.EllipticCurvePublicKey)  # it let no other pass
        digest = certificate.signature_hash_algorithm
        if digest is not None and digest.name in _BROKEN:
            raise NotTrusted(f"it was signed with {_BROKEN[digest.name]}, which is broken")
        for extension in certificate.extensions:
            if extension.critical and extension.oid not in _EXTENSIONS:
                raise NotTrusted(f"its extension {extension.oid.dotted_string} is critical and not supported")
        return cls(
            subject=certificate.subject.rfc4514_string(),
            issuer=certificate.issuer.rfc4514_string(),
            subject_der=_subject_der(certificate.tbs_certificate_bytes),
            algorithm=algorithm,
            valid_from=_nanoseconds(certificate.not_valid_before_utc),
            # The last second is part of the validity (RFC 5280 §4.1.2.5).
            valid_until=_nanoseconds(certificate.not_valid_after_utc) + _NANOSECONDS,
            der=certificate.public_bytes(serialization.Encoding.DER),
            parsed=certificate,
            public_key=key,
        )

    @property
    def pem(self) -> bytes:
        """Without what a file may hold beside the certificate, and without a NUL."""
        return self.parsed.public_bytes(serialization.Encoding.PEM)

    def require_valid_at(self, now: int) -> None:
        """Raises NotTrusted before and after the validity; ``now`` in nanoseconds since 1970."""
        if now < self.valid_from:
            raise NotTrusted(f"the certificate of {self.subject} is valid only from {text_of_time(self.valid_from)} on")
        if now >= self.valid_until:
            raise NotTrusted(f"the certificate of {self.subject} expired at {text_of_time(self.valid_until)}")

    def require_may_issue(self) -> None:
        """Raises NotTrusted if the certificate says that it is none of an authority.

        It need not say that it is: the trust anchor is who was configured as such, and CAs of version 1 say nothing.
        """
        constraints, usage = self._constraints(), self._key_usage()
        if (constraints and not constraints.ca) or (usage and not usage.key_cert_sign):
            raise NotTrusted(f"the certificate of {self.subject} is not one of an authority that issues certificates")

    def require_may_sign(self) -> None:
        """Raises NotTrusted if the authority allowed the key for other things only."""
        usage = self._key_usage()
        if usage and not usage.digital_signature:
            raise NotTrusted(f"the certificate of {self.subject} does not allow digital signatures (its key usage)")

    def _constraints(self) -> x509.BasicConstraints | None:
        value = self._extension(ExtensionOID.BASIC_CONSTRAINTS)
        return value if isinstance(value, x509.BasicConstraints) else None

    def _key_usage(self) -> x509.KeyUsage | None:
        value = self._extension(ExtensionOID.KEY_USAGE)
        return value if isinstance(value, x509.KeyUsage) else None

    def _extension(self, oid: ObjectIdentifier) -> x509.ExtensionType | None:
        return next((extension.value for extension in self.parsed.extensions if extension.oid == oid), None)


def pem_blocks(text: bytes, label: str) -> list[tuple[int, bytes]]:
    """The PEM blocks with this label, each with the line on which it begins, from 1.  Takes linear time."""
    begin, end = f"-----BEGIN {label}-----".encode(), f"-----END {label}-----".encode()
    blocks: list[tuple[int, bytes]] = []
    position, line = 0, 1
    while (start := text.find(begin, position)) >= 0 and (stop := text.find(end, start)) >= 0:
        line += text.count(b"\n", position, start)
        position = stop + len(end)
        blocks.append((line, text[start:position]))
        line += text.count(b"\n", start, position)
    return blocks


def text_of_time(nanoseconds: int) -> str:
    # Counted from 1970, as not every system's fromtimestamp() takes what lies before.
    return (datetime(1970, 1, 1) + timedelta(seconds=nanoseconds // _NANOSECONDS)).isoformat() + "Z"


def _nanoseconds(time: datetime) -> int:
    return int(time.timestamp()) * _NANOSECONDS


def _subject_der(tbs_certificate: bytes) -> bytes:
    """TBSCertificate ::= SEQUENCE { [0] version OPTIONAL, serialNumber, signature, issuer, validity, subject, ... }"""
    position = read_element(tbs_certificate, 0).start
    if read_element(tbs_certificate, position).tag == 0xA0:
        position = read_element(tbs_certificate, position).end
    for _ in ("serialNumber", "signature", "issuer", "validity"):
        position = read_element(tbs_certificate, position).end
    return tbs_certificate[position : read_element(tbs_certificate, position).end]
