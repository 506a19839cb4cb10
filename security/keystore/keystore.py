"""A keystore in the layout of ROS 2: two authorities, and an enclave folder for each identity.

    public/   identity_ca.cert.pem  permissions_ca.cert.pem
    private/  identity_ca.key.pem   permissions_ca.key.pem       what nobody needs at run time
    enclaves/ governance.xml  governance.p7s
      alice/  cert.pem  key.pem  permissions.xml  permissions.p7s
              identity_ca.cert.pem  permissions_ca.cert.pem  governance.p7s      links to the above

A participant gets an enclave folder.  ROS 2's tools use one authority for both purposes; here there are two, as whoever
may issue identities should not also say what they may do.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Self

from cryptography import x509

from ddsi.structure.errors import BadParameter, ConfigurationError

from .authority import Authority
from .certificate import certificate_pem, certificate_validity
from .distinguished_name import parse_name
from .documents import GovernanceDraft, GrantDraft, Rights, permissions_xml
from .file_set import FileSet
from .identity import Identity
from .key_pair import Algorithm, private_key_pem
from .validity import Validity

__all__ = ["ENCLAVES", "IdentityTerms", "Keystore", "create_keystore"]

ENCLAVES: Final = "enclaves"
_PUBLIC: Final = "public"
_PRIVATE: Final = "private"
_ENCLAVE_PART: Final = re.compile(r"[A-Za-z0-9_@-][A-Za-z0-9_.@ -]*")


@dataclass(frozen=True, slots=True)
class IdentityTerms:
    """How identities are made.  ``subject`` is a pattern: ``{name}`` in it stands for the identity's name."""

    validity: Validity
    algorithm: Algorithm = Algorithm.EC
    subject: str = "/CN={name}"

    def create(self, authority: Authority, name: str) -> Identity:
        """One that the authority issues.  Raises BadParameter for a subject that is no name."""
        return Identity.create(
            authority, parse_name(self.subject.replace("{name}", name)), self.algorithm, self.validity
        )


@dataclass(frozen=True, slots=True)
class Keystore:
    """Where everything lies.  :meth:`at` gives the layout above; another may be put together from its paths."""

    root: Path
    identity_ca_certificate: Path
    identity_ca_key: Path
    permissions_ca_certificate: Path
    permissions_ca_key: Path
    governance: Path

    @classmethod
    def at(cls, root: Path) -> Self:
        """The layout of ROS 2 below ``root``, whether it is there or not."""
        return cls(
            root=root,
            identity_ca_certificate=root / _PUBLIC / "identity_ca.cert.pem",
            identity_ca_key=root / _PRIVATE / "identity_ca.key.pem",
            permissions_ca_certificate=root / _PUBLIC / "permissions_ca.cert.pem",
            permissions_ca_key=root / _PRIVATE / "permissions_ca.key.pem",
            governance=root / ENCLAVES / "governance.p7s",
        )

    def enclave(self, name: str) -> Path:
        """The folder of an identity: ``alice``, or in the way of ROS 2 ``/robot/arm``.  Raises BadParameter."""
        parts = name.strip("/").split("/")
        if not all(_ENCLAVE_PART.fullmatch(part) for part in parts):
            raise BadParameter(
                f"{name!r} cannot be the name of an enclave: letters, digits and _ - . @, with / between"
            )
        return self.root.joinpath(ENCLAVES, *parts)

    def add_enclave(
        self,
        files: FileSet,
        name: str,
        *,
        identity_ca: Authority,
        permissions_ca: Authority,
        terms: IdentityTerms,
        rights: Rights,
    ) -> Path:
        """Put an identity and its permissions among the files to be written; returns its folder."""
        folder = self.enclave(name)
        identity = terms.create(identity_ca, name)
        validity = certificate_validity(identity.certificate)
        grant = GrantDraft(name=name, subject_name=identity.subject_name, validity=validity, rights=rights)
        xml = permissions_xml([grant])
        files.add_private_folder(folder)
        files.add(folder / "cert.pem", certificate_pem(identity.certificate))
        files.add(folder / "key.pem", private_key_pem(identity.private_key), private=True)
        files.add(folder / "permissions.xml", xml)
        files.add(folder / "permissions.p7s", permissions_ca.sign_document(xml))
        files.add_link(folder / "identity_ca.cert.pem", self.identity_ca_certificate)
        files.add_link(folder / "permissions_ca.cert.pem", self.permissions_ca_certificate)
        files.add_link(folder / "governance.p7s", self.governance)
        return folder


def create_keystore(
    root: Path,
    identities: Sequence[str],
    *,
    terms: IdentityTerms,
    governance: GovernanceDraft | None = None,
    rights: Rights | None = None,
    force: bool = False,
) -> list[Path]:
    """Everything that a domain needs; returns the enclave folders, in the order of the identities.

    Raises BadParameter for names that cannot be, ConfigurationError if something would be overwritten, OSError.
    """
    if len(set(identities)) < len(identities):
        raise BadParameter("an identity is named twice; each gets a key of its own")
    if len(identities) > 1 and "{name}" not in terms.subject:
        raise BadParameter(f"all identities would be {terms.subject}: put {{name}} where the names differ")
    keystore = Keystore.at(root)
    if keystore.identity_ca_certificate.exists() and not force:
        raise ConfigurationError(
            f"{root} holds a keystore: add to it with `ddsi keystore enclave`, or say --force to make everything anew"
        )
    identity_ca = Authority.create(_authority_name(terms, "Identity CA"), terms.algorithm, terms.validity)
    permissions_ca = Authority.create(_authority_name(terms, "Permissions CA"), terms.algorithm, terms.validity)
    files = FileSet()
    files.add_private_folder(keystore.identity_ca_key.parent)
    files.add(keystore.identity_ca_certificate, certificate_pem(identity_ca.certificate))
    files.add(keystore.identity_ca_key, private_key_pem(identity_ca.private_key), private=True)
    files.add(keystore.permissions_ca_certificate, certificate_pem(permissions_ca.certificate))
    files.add(keystore.permissions_ca_key, private_key_pem(permissions_ca.private_key), private=True)
    xml = (governance or GovernanceDraft()).xml()
    files.add(keystore.governance.with_suffix(".xml"), xml)
    files.add(keystore.governance, permissions_ca.sign_document(xml))
    folders = [
        keystore.add_enclave(
            files, name, identity_ca=identity_ca, permissions_ca=permissions_ca, terms=terms, rights=rights or Rights()
        )
        for name in identities
    ]
    files.write(force=force)
    return folders


def _authority_name(terms: IdentityTerms, name: str) -> x509.Name:
    """The subject's pattern names the authorities too, so that all bear the same organisation."""
    return parse_name(terms.subject.replace("{name}", name))
