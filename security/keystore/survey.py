"""What a folder holds, judged by what its files are rather than by their names.

Keystores made by plain openssl commands name their files as somebody liked; those of ROS 2's tools and ours have names
that count.  So the names of ROS 2 go first, and content decides the rest: a key belongs to the certificate whose public
key it has, an authority is one that says so or signed itself, a document is known by its root.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path
from typing import Final, Literal

from cryptography import x509
from cryptography.hazmat.primitives.asymmetric.types import PublicKeyTypes

from ddsi.structure.errors import ConfigurationError

from .certificate import is_authority, is_issued_by, parse_certificate
from .document import DocumentKind, document_kind
from .file_set import read_file
from .key_pair import PrivateKey, parse_private_key
from .keystore import ENCLAVES, Keystore

__all__ = ["Enclave", "Survey", "find_authority", "find_enclaves", "find_keystore", "key_files", "survey"]

_MOST_FILES: Final = 5000
_STANDARD_CAS: Final = ("identity_ca.cert.pem", "permissions_ca.cert.pem")
"""With such a name an authority is for one purpose, and does not stand in where the other is missing."""
_PUBLIC, _PRIVATE = "public", "private"
_PEM_CERTIFICATE: Final = re.compile(rb"-----BEGIN (X509 |TRUSTED )?CERTIFICATE-----")
_PEM_KEY: Final = re.compile(rb"-----BEGIN ([A-Z0-9]+ )*PRIVATE KEY-----")


@dataclass(slots=True)
class Survey:
    """The files of one folder or several by what they are, in the order of their names."""

    certificates: dict[Path, x509.Certificate] = field(default_factory=dict)
    keys: dict[Path, PrivateKey | None] = field(default_factory=dict)
    """None: one that a password protects, or that cannot be read."""
    signed: dict[Path, DocumentKind] = field(default_factory=dict)
    unsigned: dict[Path, DocumentKind] = field(default_factory=dict)

    def authorities(self) -> dict[Path, x509.Certificate]:
        return {path: one for path, one in self.certificates.items() if is_authority(one) or one.issuer == one.subject}

    def identities(self) -> dict[Path, x509.Certificate]:
        authorities = self.authorities()
        return {path: one for path, one in self.certificates.items() if path not in authorities}

    def key_of(self, public_key: PublicKeyTypes) -> Path | None:
        return next((path for path, key in self.keys.items() if key and key.public_key() == public_key), None)


@dataclass(frozen=True, slots=True)
class Enclave:
    """The six files of an identity.  One that is not there has the path where it is looked for."""

    name: str
    folder: Path
    identity_ca: Path
    certificate: Path
    private_key: Path
    permissions_ca: Path
    governance: Path
    permissions: Path


def survey(*folders: Path) -> Survey:
    """What the folders hold, without those below them.  Raises ConfigurationError if there are too many files."""
    found = Survey()
    paths = [path for folder in folders if folder.is_dir() for path in sorted(folder.iterdir())]
    if len(paths) > _MOST_FILES:
        raise ConfigurationError(f"{folders[0]} holds more than {_MOST_FILES} files: name the folder of a keystore")
    for path in paths:
        if path.is_file():
            _classify(path, found)
    return found


def _classify(path: Path, found: Survey) -> None:
    try:
        octets = read_file(path)
    except ConfigurationError:
        return  # whoever needs it by its name will say so
    if _PEM_CERTIFICATE.search(octets):
        try:
            found.certificates[path] = parse_certificate(octets, str(path))
        except ConfigurationError:
            return
    if _PEM_KEY.search(octets):
        try:
            found.keys[path] = parse_private_key(octets, str(path))
        except ConfigurationError:
            found.keys[path] = None
    elif kind := document_kind(octets):
        (found.unsigned if octets.lstrip().startswith(b"<") else found.signed)[path] = kind


# --- keystores -----------------------------------------------------------------------------------------------


def find_authority(root: Path, role: Literal["identity", "permissions"]) -> tuple[Path, Path]:
    """Certificate and key of an authority in ``root``.  Raises ConfigurationError if one of them is not there."""
    keystore = Keystore.at(root)
    standard = {
        "identity": (keystore.identity_ca_certificate, keystore.identity_ca_key),
        "permissions": (keystore.permissions_ca_certificate, keystore.permissions_ca_key),
    }
    if all(path.is_file() for path in standard[role]):
        return standard[role]
    found = survey(root, root / _PUBLIC, root / _PRIVATE)
    pairs = [(path, key) for path, one in found.authorities().items() if (key := found.key_of(one.public_key()))]
    # One that is named for the other purpose is not for this.
    mine, other = ("ident", "perm") if role == "identity" else ("perm", "ident")
    candidates = [pair for pair in pairs if other not in pair[0].name.lower() or mine in pair[0].name.lower()]
    if not candidates:
        raise ConfigurationError(
            f"{root} holds no {role} CA with its key: make a keystore with `ddsi keystore create`, or name the folder "
            "that has both"
        )
    return next((pair for pair in candidates if mine in pair[0].name.lower()), candidates[0])


def find_keystore(root: Path) -> Keystore:
    """The authorities and the governance document in ``root``.  Raises ConfigurationError naming what is not there."""
    identity_ca, permissions_ca = find_authority(root, "identity"), find_authority(root, "permissions")
    governance = _governance(survey(root / ENCLAVES, root))
    if governance is None:
        signed = Keystore.at(root).governance
        raise ConfigurationError(
            f"{root} holds no signed governance document: make it with `ddsi keystore governance {signed} "
            f"--keystore {root}`"
        )
    return Keystore(root, *identity_ca, *permissions_ca, governance)


def find_enclaves(root: Path) -> list[Enclave]:
    """The identities of a keystore, or the one of a folder.  Raises ConfigurationError if there is none."""
    if not root.is_dir():
        raise ConfigurationError(f"{root} is not a folder: name a keystore, or the folder of an identity in it")
    enclaves = list(_ros_enclaves(root)) or list(_enclaves_by_content(root))
    if not enclaves:
        raise ConfigurationError(f"{root} holds no identity: make one with `ddsi keystore create` or `enclave`")
    return enclaves


def key_files(root: Path) -> list[Path]:
    """Private keys in ``root`` and where keystores have those of their authorities."""
    return list(survey(root, root / _PUBLIC, root / _PRIVATE).keys)


def _ros_enclaves(root: Path) -> Iterator[Enclave]:
    """Folders below ``enclaves`` with the names of ROS 2, or such a folder itself."""
    below = root / ENCLAVES
    folders = sorted(islice(filter(Path.is_dir, below.rglob("*")), _MOST_FILES)) if below.is_dir() else [root]
    for folder in folders:
        if (folder / "cert.pem").exists() or (folder / "key.pem").exists():
            name = folder.relative_to(below).as_posix() if folder != root else folder.resolve().name
            yield _enclave(name, folder, folder / "cert.pem", survey(folder))


def _enclaves_by_content(root: Path) -> Iterator[Enclave]:
    found = survey(root, root / _PUBLIC, root / _PRIVATE)
    for path in found.identities():
        yield _enclave(path.name.partition(".")[0], path.parent, path, found)


def _enclave(name: str, folder: Path, certificate: Path, found: Survey) -> Enclave:
    """By the names of ROS 2, else by content, else where ROS 2 would have it."""
    identity = found.certificates.get(certificate)
    authorities = [path for path in found.authorities() if path != certificate and path.name not in _STANDARD_CAS]
    issuers = [path for path in authorities if identity and is_issued_by(identity, found.certificates[path])]
    identity_ca = next(iter(issuers), None) or _named(authorities, "ident") or next(iter(authorities), None)
    permissions_ca = _named(authorities, "perm") or identity_ca
    key = found.key_of(identity.public_key()) if identity else None
    mine = [path for path, kind in found.signed.items() if kind is DocumentKind.PERMISSIONS]
    permissions = _of(mine, name) or (mine[0] if len(mine) == 1 else None)

    def choose(standard: str, by_content: Path | None) -> Path:
        return folder / standard if (folder / standard).exists() or by_content is None else by_content

    return Enclave(
        name=name,
        folder=folder,
        identity_ca=choose("identity_ca.cert.pem", identity_ca),
        certificate=certificate,
        private_key=choose("key.pem", key or _of(list(found.keys), name)),
        permissions_ca=choose("permissions_ca.cert.pem", permissions_ca),
        governance=choose("governance.p7s", _governance(found)),
        permissions=choose("permissions.p7s", permissions),
    )


def _governance(found: Survey) -> Path | None:
    """One called governance goes before others, such as those kept for trying."""
    governance = [path for path, kind in found.signed.items() if kind is DocumentKind.GOVERNANCE]
    return next((path for path in governance if path.stem == "governance"), next(iter(governance), None))


def _of(paths: list[Path], name: str) -> Path | None:
    """The file of an identity: ``alice.key``, ``alice_key.pem``, ``alice.permissions.p7s``."""
    return next((path for path in paths if re.match(rf"{re.escape(name)}[._-]", path.name)), None)


def _named(paths: list[Path], part: str) -> Path | None:
    return next((path for path in paths if part.lower() in path.name.lower()), None)
