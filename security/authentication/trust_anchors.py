"""TrustAnchors: the identity CAs and their revocation lists, and whether they vouch for a certificate.

DDS-Security 1.1 §9.3.1, §9.3.2.1.  One level: an anchor itself issued the certificate.  The anchor may in turn be an
intermediate CA of somebody; its key is trusted because it was configured, so nothing above it is looked at.  A
certificate that reaches an anchor only through further CAs is refused, as Cyclone DDS and OpenDDS do.
"""

from __future__ import annotations

from dataclasses import field

from cryptography import x509
from cryptography.exceptions import InvalidSignature

from ddsi.structure.dataclass import dataclass

from .certificate import PARSE_ERRORS, Certificate, text_of_time
from .not_trusted import NotTrusted

__all__ = ["RevocationList", "TrustAnchors"]


@dataclass(frozen=True, slots=True)
class RevocationList:
    """What one authority took back (RFC 5280 §5), its signature verified.  ``valid_until``: ns since 1970, or None."""

    issuer: Certificate
    valid_until: int | None
    crl: x509.CertificateRevocationList = field(repr=False)

    @classmethod
    def read(cls, crl: x509.CertificateRevocationList, authorities: tuple[Certificate, ...]) -> RevocationList:
        """Raises NotTrusted unless one of the authorities signed the list, and it is one that we understand."""
        try:
            issuers = [authority for authority in authorities if authority.parsed.subject == crl.issuer]
            issuer = next((issuer for issuer in issuers if crl.is_signature_valid(issuer.public_key)), None)
            critical = [extension.oid.dotted_string for extension in crl.extensions if extension.critical]
            next_update = crl.next_update_utc
        except PARSE_ERRORS as error:
            raise NotTrusted("it is no certificate revocation list that can be read") from error
        if issuer is None:
            raise NotTrusted("the certificate revocation list is signed by none of the identity CAs")
        if critical:
            raise NotTrusted(f"the list's extension {critical[0]} is critical and not supported (delta, partial lists)")
        return cls(issuer, int(next_update.timestamp()) * 1_000_000_000 if next_update else None, crl)

    def require_not_revoked(self, certificate: Certificate) -> None:
        try:
            entry = self.crl.get_revoked_certificate_by_serial_number(certificate.parsed.serial_number)
        except PARSE_ERRORS as error:
            raise NotTrusted("the certificate revocation list cannot be read") from error
        if entry is not None:
            raise NotTrusted(f"the certificate of {certificate.subject} is revoked by {self.issuer.subject}")

    def require_valid_at(self, now: int) -> None:
        if self.valid_until is not None and now >= self.valid_until:
            raise NotTrusted(
                f"the certificate revocation list of {self.issuer.subject} is out of date since "
                f"{text_of_time(self.valid_until)}"
            )


@dataclass(frozen=True, slots=True)
class TrustAnchors:
    """``revocation_lists``: empty when none are configured; else each authority that vouches must have one."""

    authorities: tuple[Certificate, ...]
    revocation_lists: tuple[RevocationList, ...] = ()

    def verify(self, certificate: Certificate, now: int) -> Certificate:
        """The authority that vouches for the certificate at ``now``, in nanoseconds since 1970.

        Raises NotTrusted, which says why not.  Takes a tenth of a millisecond or more; touches nothing shared.
        """
        certificate.require_valid_at(now)
        certificate.require_may_sign()
        authority = self._issuer_of(certificate)
        authority.require_valid_at(now)
        authority.require_may_issue()
        if self.revocation_lists:
            self._require_not_revoked(certificate, authority, now)
        return authority

    def _issuer_of(self, certificate: Certificate) -> Certificate:
        named = False
        for authority in self.authorities:
            try:
                certificate.parsed.verify_directly_issued_by(authority.parsed)
            except InvalidSignature:
                named = True
            except PARSE_ERRORS:
                continue  # the names differ
            else:
                return authority
        if named:
            raise NotTrusted(
                f"the certificate of {certificate.subject} names {certificate.issuer} as its issuer, whose signature "
                "it does not bear: it comes from another authority of the same name, or was altered"
            )
        raise NotTrusted(
            f"the certificate of {certificate.subject} was issued by {certificate.issuer}, which is none of the "
            f"identity CAs ({'; '.join(authority.subject for authority in self.authorities)}); certificates that need "
            "further intermediate CAs are not supported: the identity CA must be the issuer itself"
        )

    def _require_not_revoked(self, certificate: Certificate, authority: Certificate, now: int) -> None:
        lists = [revoked for revoked in self.revocation_lists if revoked.issuer == authority]
        if not lists:
            raise NotTrusted(f"there is no certificate revocation list of {authority.subject}, though some are given")
        for revoked in lists:
            revoked.require_not_revoked(certificate)
            revoked.require_valid_at(now)
