"""Looks at all files of a keystore and says what is wrong with them: ``ddsi keystore check``.

Each file is judged alone, then those of each identity together.  What several identities share is judged once.
"""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path
from typing import Final

from ddsi.structure.errors import ConfigurationError

from . import (
    agreement_rules,
    algorithm_rules,
    certificate_rules,
    document_rules,
    file_rules,
    governance_rules,
    permissions_rules,
)
from .agreement_rules import check_documents, check_subject
from .certificate import parse_certificate
from .certificate_rules import (
    CERTIFICATE_UNREADABLE,
    KEY_UNREADABLE,
    Certified,
    check_authority,
    check_document_signer,
    check_identity,
    check_identity_issuer,
    check_key,
    check_shared_authority,
)
from .document import DocumentKind
from .document_rules import INVALID as DOCUMENT_INVALID
from .document_rules import LoadedDocument, check_document
from .file_rules import check_key_mode, check_writable, missing
from .file_set import read_file
from .finding import Finding, Rule
from .governance_rules import check_governance
from .horizon import Horizon
from .key_pair import parse_private_key
from .permissions_rules import check_permissions
from .survey import Enclave, find_enclaves, key_files

__all__ = ["RULES", "check_keystore"]

RULES: Final[dict[str, Rule]] = {
    rule.id: rule
    for module in (
        file_rules,
        certificate_rules,
        algorithm_rules,
        document_rules,
        governance_rules,
        permissions_rules,
        agreement_rules,
    )
    for rule in module.RULES
}
"""Every rule by its id, in the order in which they are looked at."""


def check_keystore(root: Path, horizon: Horizon) -> list[Finding]:
    """What is wrong with the identities in ``root``, and with the keys beside them.

    Raises ConfigurationError if there is no keystore.
    """
    linter = _Linter(horizon)
    for enclave in find_enclaves(root):
        linter.check_enclave(enclave)
    for path in key_files(root):
        linter.check_key_file(path)
    return linter.findings


class _Linter:
    def __init__(self, horizon: Horizon) -> None:
        self._horizon = horizon
        self._seen: set[object] = set()
        self.findings: list[Finding] = []

    def check_enclave(self, enclave: Enclave) -> None:
        """The six files, then what they are to each other."""
        identity_ca = self._authority(enclave.identity_ca, "identity CA")
        if identity_ca:
            self._add(check_identity_issuer(identity_ca))
        permissions_ca = self._authority(enclave.permissions_ca, "permissions CA")
        if permissions_ca:
            self._add(check_document_signer(permissions_ca))
        identity = self._certificate(enclave.certificate, "the identity's certificate", _make_identity(enclave))
        if identity:
            self._add(check_identity(identity, identity_ca, self._horizon))
        if identity_ca and permissions_ca:
            self._add(check_shared_authority(identity_ca, permissions_ca))
        self._key(enclave, identity)
        governance = self._document(enclave.governance, DocumentKind.GOVERNANCE, permissions_ca, identity_ca, identity)
        permissions = self._document(
            enclave.permissions, DocumentKind.PERMISSIONS, permissions_ca, identity_ca, identity
        )
        if governance:
            self._add(check_governance(governance))
        if permissions:
            self._add(check_permissions(permissions, self._horizon))
        if identity and permissions:
            self._add(check_subject(identity, permissions))
        if governance and permissions:
            self._add(check_documents(governance, permissions))

    def check_key_file(self, path: Path) -> None:
        self._add(check_key_mode(path))

    def _add(self, findings: Iterable[Finding]) -> None:
        for finding in findings:
            key = (finding.rule.id, os.path.realpath(finding.path), finding.line, finding.text)
            if key not in self._seen:
                self._seen.add(key)
                self.findings.append(finding)

    def _authority(self, path: Path, what: str) -> Certified | None:
        authority = self._certificate(path, f"the {what}'s certificate", f"copy the {what}'s certificate there")
        if authority:
            self._add(check_authority(authority, what, self._horizon))
        return authority

    def _certificate(self, path: Path, what: str, remedy: str) -> Certified | None:
        path = _pointed_to(path)
        if not path.is_file():
            self._add([missing(path, what, remedy)])
            return None
        self._add(check_writable(path))
        try:
            return path, parse_certificate(read_file(path), str(path))
        except ConfigurationError as error:
            self._add([CERTIFICATE_UNREADABLE.at(path, f"{what}: {error}", remedy=remedy)])
            return None

    def _key(self, enclave: Enclave, identity: Certified | None) -> None:
        path = _pointed_to(enclave.private_key)
        if not path.is_file():
            self._add([missing(path, "the identity's private key", _make_identity(enclave))])
            return
        self._add(check_key_mode(path))
        try:
            octets = read_file(path)
            key = None if b"ENCRYPTED" in octets else parse_private_key(octets, str(path))
        except ConfigurationError as error:
            self._add([KEY_UNREADABLE.at(path, str(error), remedy=_make_identity(enclave))])
            return
        self._add(check_key(path, key, identity[1] if identity else None))

    def _document(
        self, path: Path, kind: DocumentKind, signer: Certified | None, *others: Certified | None
    ) -> LoadedDocument | None:
        path = _pointed_to(path)
        if not path.is_file():
            source = path.with_suffix(".xml")
            sign = f"ddsi keystore {kind} {path} --keystore DIR" + (f" --xml {source}" if source.is_file() else "")
            self._add([missing(path, f"the signed {kind} document", sign)])
            return None
        self._add(check_writable(path))
        authorities = [other for other in others if other and (not signer or other[1] != signer[1])]
        try:
            document, findings = check_document(path, kind, signer, authorities)
        except ConfigurationError as error:
            document, findings = None, [DOCUMENT_INVALID.at(path, str(error), remedy="put a readable document there")]
        self._add(findings)
        return document


def _make_identity(enclave: Enclave) -> str:
    return f"ddsi keystore identity {enclave.certificate} {enclave.private_key} --subject NAME --keystore DIR"


def _pointed_to(path: Path) -> Path:
    """What a link, as in the layout of ROS 2, leads to, by a path that begins as the user's own."""
    for _ in range(8):
        if not path.is_symlink():
            break
        target = Path(os.path.normpath(path.parent / os.readlink(path)))
        if target.exists() and not target.samefile(path):
            break
        path = target
    return path
