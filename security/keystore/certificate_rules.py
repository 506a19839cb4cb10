"""Rules on certificates and keys, but for their algorithms.  DDS-Security 1.1 §9.3.1, §9.3.2.1; what vendors accept."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from cryptography import x509

from .algorithm_rules import check_identity_ca_key, check_identity_key, check_permissions_ca_key, check_signature
from .certificate import certificate_validity, is_authority, is_issued_by, may_sign_documents
from .distinguished_name import rfc2253_text
from .finding import Finding, Rule, Severity
from .horizon import Horizon
from .key_pair import PrivateKey

__all__ = [
    "CERTIFICATE_UNREADABLE",
    "KEY_UNREADABLE",
    "RULES",
    "check_authority",
    "check_document_signer",
    "check_identity",
    "check_identity_issuer",
    "check_key",
    "check_shared_authority",
]

CERTIFICATE_UNREADABLE: Final = Rule("certificate-unreadable", Severity.ERROR, "no certificate in PEM can be read")
KEY_UNREADABLE: Final = Rule("key-unreadable", Severity.ERROR, "no private key in PEM can be read")
KEY_HAS_PASSWORD: Final = Rule("key-has-password", Severity.NOTE, "a password protects the key, so it was not tried")
KEY_MISMATCH: Final = Rule("key-mismatch", Severity.ERROR, "the private key is not that of the certificate")
EXPIRED: Final = Rule("certificate-expired", Severity.ERROR, "a certificate is not valid any more")
NOT_YET_VALID: Final = Rule("certificate-not-yet-valid", Severity.ERROR, "a certificate is not valid yet")
EXPIRES_SOON: Final = Rule("certificate-expires-soon", Severity.WARNING, "a certificate ends within --soon days")
WRONG_CA: Final = Rule("identity-wrong-ca", Severity.ERROR, "the identity CA did not issue the identity's certificate")
NOT_AUTHORITY: Final = Rule("ca-not-authority", Severity.WARNING, "a CA's certificate does not say that it is one")
INTERMEDIATE: Final = Rule("ca-intermediate", Severity.WARNING, "another authority issued the identity CA")
MAY_NOT_SIGN: Final = Rule("ca-may-not-sign", Severity.WARNING, "the permissions CA's key is not for documents")
IDENTITY_IS_AUTHORITY: Final = Rule("identity-is-ca", Severity.WARNING, "an identity may issue further identities")
SHARED_AUTHORITY: Final = Rule("shared-ca", Severity.NOTE, "one authority issues identities and signs permissions")
SUBJECT_REPEATS: Final = Rule("subject-repeats", Severity.WARNING, "a subject with two values of one kind")
RULES: Final = (
    *(CERTIFICATE_UNREADABLE, KEY_UNREADABLE, KEY_HAS_PASSWORD, KEY_MISMATCH, EXPIRED, NOT_YET_VALID, EXPIRES_SOON),
    *(WRONG_CA, NOT_AUTHORITY, INTERMEDIATE, MAY_NOT_SIGN, IDENTITY_IS_AUTHORITY, SHARED_AUTHORITY, SUBJECT_REPEATS),
)

Certified = tuple[Path, x509.Certificate]
"""A certificate, and the file it is in."""


def check_identity(identity: Certified, authority: Certified | None, horizon: Horizon) -> Iterator[Finding]:
    """A certificate by which a participant is known."""
    path, certificate = identity
    yield from _check_certificate(identity, "the identity's certificate", horizon)
    yield from check_identity_key(path, certificate)
    if authority and not is_issued_by(certificate, authority[1]):
        issuer, ca = rfc2253_text(certificate.issuer), rfc2253_text(authority[1].subject)
        text = f"it was issued by {issuer}, and the identity CA in {authority[0]} is {ca}"
        if issuer == ca:
            text = f"the identity CA in {authority[0]} has the name of its issuer, {ca}, but another key"
        yield WRONG_CA.at(
            path,
            text,
            remedy="bring the certificate of the CA that issued it, or issue it anew: ddsi keystore identity",
        )
    if is_authority(certificate):
        yield IDENTITY_IS_AUTHORITY.at(
            path,
            "basicConstraints says CA:TRUE, so whoever has its key may make identities below it",
            remedy="issue a certificate with CA:FALSE: ddsi keystore identity",
        )
    yield from _check_subject(path, certificate.subject)


def check_authority(authority: Certified, what: str, horizon: Horizon) -> Iterator[Finding]:
    """A certificate that is trusted: the identity CA's or the permissions CA's, as ``what`` says."""
    path, certificate = authority
    yield from _check_certificate(authority, f"the {what}'s certificate", horizon)
    if not is_authority(certificate):
        yield NOT_AUTHORITY.at(
            path,
            f"the {what}'s certificate has no basicConstraints with CA:TRUE, which some verify",
            remedy="make it with ddsi keystore ca, or openssl req -x509 -addext basicConstraints=critical,CA:TRUE",
        )


def check_identity_issuer(authority: Certified) -> Iterator[Finding]:
    """The certificate of the identity CA, beyond what is asked of every authority."""
    path, certificate = authority
    yield from check_identity_ca_key(path, certificate)
    if certificate.issuer != certificate.subject:
        yield INTERMEDIATE.at(
            path,
            f"the identity CA was itself issued by {rfc2253_text(certificate.issuer)}: Cyclone DDS 0.10 and Fast DDS "
            "2.9 refuse one that is not self-signed",
            remedy="make a self-signed one for this domain where they take part: ddsi keystore ca",
        )


def check_document_signer(authority: Certified) -> Iterator[Finding]:
    """The certificate of the permissions CA, beyond what is asked of every authority."""
    path, certificate = authority
    yield from check_permissions_ca_key(path, certificate)
    if not may_sign_documents(certificate):
        yield MAY_NOT_SIGN.at(
            path,
            "keyUsage lacks digitalSignature, or extendedKeyUsage emailProtection: Cyclone DDS and Fast DDS, which "
            "verify S/MIME by OpenSSL, then refuse all documents",
            remedy="make it anew and sign the documents again: ddsi keystore ca, permissions and governance",
        )


def check_shared_authority(identity_ca: Certified, permissions_ca: Certified) -> Iterator[Finding]:
    """ROS 2's tools make it so."""
    if identity_ca[1].public_key() == permissions_ca[1].public_key():
        yield SHARED_AUTHORITY.at(
            permissions_ca[0],
            "identity CA and permissions CA have the same key; stacks from before the fixes of CVE-2023-24010 to "
            "-24012 then let every identity sign permissions for itself",
            remedy="use a second authority for documents, or make sure that all participants are up to date",
        )


def check_key(path: Path, key: PrivateKey | None, certificate: x509.Certificate | None) -> Iterator[Finding]:
    """An identity's private key; None: a password protects it."""
    if key is None:
        yield KEY_HAS_PASSWORD.at(
            path,
            "a password protects the key, so that it could not be compared with the certificate",
            remedy="give participants the property dds.sec.auth.password",
        )
    elif certificate and key.public_key() != certificate.public_key():
        yield KEY_MISMATCH.at(
            path,
            f"it is not the key of the certificate of {rfc2253_text(certificate.subject)}",
            remedy="bring the key that was made with the certificate, or make both anew: ddsi keystore identity",
        )


def _check_certificate(one: Certified, what: str, horizon: Horizon) -> Iterator[Finding]:
    path, certificate = one
    validity = certificate_validity(certificate)
    not_before, not_after = (int(end.timestamp()) * 1_000_000_000 for end in (validity.not_before, validity.not_after))
    renew = "issue it anew: ddsi keystore identity, or ca"
    if horizon.now > not_after:
        yield EXPIRED.at(path, f"{what} expired at {validity.not_after:%Y-%m-%d %H:%M:%SZ}", remedy=renew)
    elif horizon.soon > not_after:
        text = f"{what} expires at {validity.not_after:%Y-%m-%d %H:%M:%SZ}, in {horizon.days_until(not_after)} days"
        yield EXPIRES_SOON.at(path, text, remedy=renew)
    if horizon.now < not_before:
        yield NOT_YET_VALID.at(
            path,
            f"{what} is not valid before {validity.not_before:%Y-%m-%d %H:%M:%SZ}",
            remedy="set this machine's clock, or issue it anew",
        )
    yield from check_signature(path, certificate, what)


def _check_subject(path: Path, subject: x509.Name) -> Iterator[Finding]:
    repeated = [kind for kind, count in Counter(attribute.oid for attribute in subject).items() if count > 1]
    if repeated:
        yield SUBJECT_REPEATS.at(
            path,
            f"its subject {rfc2253_text(subject)} has several values of one kind, and Cyclone DDS refuses it",
            remedy="issue it for a name with one value of each kind, such as CN=alice,O=Example",
        )
