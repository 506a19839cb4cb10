"""What validation leaves behind: the permissions of a local and of a remote participant, as handles.

DDS-Security 1.1 §8.4.2.9.1 (validate_local_permissions), §8.4.2.9.2 (validate_remote_permissions), §9.4.1.  Reading
documents takes milliseconds, so both are functions of their arguments alone, which may run in any thread.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Final

from cryptography import x509

from ddsi.spi import Refused
from ddsi.structure.errors import ConfigurationError, MalformedMessage

from ..handles import PermissionsHandle
from ..properties import GOVERNANCE, PERMISSIONS, PERMISSIONS_CA
from ..resources import read_resource, resource_name
from ..tokens import AuthenticatedPeerCredentialToken, PermissionsToken
from .document_error import DocumentError, shown, titled
from .governance import DomainRule, Governance
from .permissions import Grant, Permissions
from .smime import verify
from .subject_name import SubjectName

__all__ = [
    "PERMISSIONS_CLASS_ID",
    "LocalPermissions",
    "RemotePermissions",
    "load_local_permissions",
    "read_remote_permissions",
]

PERMISSIONS_CLASS_ID: Final = "DDS:Access:Permissions:1.0"
"""What we announce: 1.2's class id is refused by peers that know 1.1 only."""

_CLASS_ID = re.compile(r"(?P<name>.*?)(?::(?P<major>\d{1,4})(?:\.\d{1,4})?(?:\+[^:]*)?)?", re.ASCII | re.DOTALL)


class LocalPermissions(PermissionsHandle):
    """Of our own participant: the governance of its domain, its grant, and the document that peers are sent."""

    __slots__ = ("authority", "document", "domain_rule", "domain_tag", "grant")

    def __init__(
        self, domain_rule: DomainRule, domain_tag: str, grant: Grant, document: bytes, authority: x509.Certificate
    ) -> None:
        self.domain_rule = domain_rule
        self.domain_tag = domain_tag
        self.grant = grant
        self.document = document
        self.authority = authority

    def __repr__(self) -> str:
        return f"<LocalPermissions {self.grant}>"


class RemotePermissions(PermissionsHandle):
    """Of an authenticated peer.  ``grant`` is Refused where it has none, yet the domain's governance asks for none."""

    __slots__ = ("grant", "local")

    def __init__(self, local: LocalPermissions, grant: Grant | Refused) -> None:
        self.local = local
        self.grant = grant

    def __repr__(self) -> str:
        return f"<RemotePermissions {self.grant}>"


# --- local ---------------------------------------------------------------------------------------------------


def load_local_permissions(
    properties: Mapping[str, str], subject: str, *, domain_id: int, domain_tag: str, now: int
) -> LocalPermissions:
    """Read the three documents that ``properties`` name.  ``subject``: of our certificate; ``now``: ns since 1970.

    Raises ConfigurationError (DocumentError, where it is in a document).
    """
    missing = [name for name in (PERMISSIONS_CA, GOVERNANCE, PERMISSIONS) if not properties.get(name)]
    if missing:
        # Cyclone DDS, where all three are empty, goes on with a governance of its own making; we guess nothing.
        lacking = " and ".join(f"the property {name}" for name in missing)
        raise ConfigurationError(f"access control lacks {lacking}: set each to file:/path/to/it")
    authority = _certificate(properties[PERMISSIONS_CA])
    governance_uri, permissions_uri = properties[GOVERNANCE], properties[PERMISSIONS]
    name = _document_name("governance", governance_uri)
    signed = verify(read_resource(GOVERNANCE, governance_uri), authority, name=name)
    governance = Governance.parse(signed.xml, name=name, first_line=signed.first_line)
    name = _document_name("permissions", permissions_uri)
    document = read_resource(PERMISSIONS, permissions_uri)
    signed = verify(document, authority, name=name)
    permissions = Permissions.parse(signed.xml, name=name, first_line=signed.first_line)
    try:
        grant = permissions.grant_for(SubjectName.parse(subject), now)
    except MalformedMessage as error:
        raise ConfigurationError(f"the subject name of the identity certificate cannot be read: {error}") from error
    if isinstance(grant, Refused):
        raise ConfigurationError(grant.reason)
    return LocalPermissions(_domain_rule(governance, domain_id, domain_tag), domain_tag, grant, document, authority)


def _document_name(kind: str, uri: str) -> str:
    return resource_name(uri) if uri.startswith("file:") else f"{kind} in {resource_name(uri)}"


def _certificate(uri: str) -> x509.Certificate:
    try:
        certificates = x509.load_pem_x509_certificates(read_resource(PERMISSIONS_CA, uri))
    except ValueError as error:
        raise ConfigurationError(
            f"property {PERMISSIONS_CA}: {resource_name(uri)} is no certificate in PEM: {error}"
        ) from error
    if len(certificates) != 1:
        # Which of several signed, the documents must not choose.
        raise ConfigurationError(
            f"property {PERMISSIONS_CA}: {resource_name(uri)} has {len(certificates)} certificates; keep the one that "
            "signs the documents"
        )
    return certificates[0]


def _domain_rule(governance: Governance, domain_id: int, domain_tag: str) -> DomainRule:
    rule = governance.domain_rule(domain_id, domain_tag)
    if rule is None:
        tag = f" with the tag {domain_tag!r}" if domain_tag else ""
        others = "; ".join(f"line {rule.line}: {rule.domains}" for rule in governance.domain_rules[:5])
        where = titled("governance", governance.name)
        reason = f"{where} has no domain_rule for domain {domain_id}{tag}, only for {others}"
        raise ConfigurationError(f"{reason}. Add the domain to a rule, or take another")
    if rule.unsupported:
        raise rule.unsupported[0]
    return rule


# --- remote --------------------------------------------------------------------------------------------------


def read_remote_permissions(
    local: LocalPermissions,
    subject: str,
    permissions_token: PermissionsToken,
    credential: AuthenticatedPeerCredentialToken,
    *,
    now: int,
) -> RemotePermissions | Refused:
    """The permissions document that an authenticated peer sent, by our permissions CA; never raises.

    ``subject``: of the certificate with which it authenticated.  Without join access control the specification
    tolerates that there are none; then only what governance leaves open to all is open to the peer.
    """
    grant = _remote_grant(local, subject, permissions_token, credential, now)
    if isinstance(grant, Refused) and local.domain_rule.enable_join_access_control:
        return grant
    return RemotePermissions(local, grant)


def _remote_grant(
    local: LocalPermissions,
    subject: str,
    permissions_token: PermissionsToken,
    credential: AuthenticatedPeerCredentialToken,
    now: int,
) -> Grant | Refused:
    if (problem := _class_problem(permissions_token)) is not None:
        return problem
    name = f"permissions of {shown(subject)}, as received"
    document = credential.binary_property("c.perm") or (credential.property("c.perm") or "").encode()
    if not document.strip(b"\0 \t\r\n"):
        return Refused(f"{name}: there are none")
    try:
        signed = verify(document, local.authority, name=name)
        permissions = Permissions.parse(signed.xml, name=name, first_line=signed.first_line)
        return permissions.grant_for(SubjectName.parse(subject), now)
    except DocumentError as error:
        return Refused(str(error))
    except MalformedMessage as error:
        return Refused(f"the subject name of the peer's certificate cannot be read: {error}")


def _class_problem(token: PermissionsToken) -> Refused | None:
    """The token's plugin and major version must be ours (§9.4.2.1); no version is 1.0, and case does not count."""
    ours, theirs = _CLASS_ID.fullmatch(PERMISSIONS_CLASS_ID), _CLASS_ID.fullmatch(token.class_id)
    assert ours is not None
    assert theirs is not None
    if not token.class_id:
        return Refused("the peer announces no permissions token: it has no access control plugin")
    if theirs["name"].lower() == ours["name"].lower() and int(theirs["major"] or 1) == int(ours["major"]):
        return None
    return Refused(f"the peer's access control plugin is {shown(token.class_id)}, ours is {PERMISSIONS_CLASS_ID}")
