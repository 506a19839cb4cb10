"""What ``ddsi keystore create``, ``ca``, ``identity``, ``governance``, ``permissions`` and ``enclave`` do."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Literal

from cryptography import x509

from ddsi.structure.errors import BadParameter, ConfigurationError

from .authority import Authority
from .certificate import certificate_pem, certificate_validity, parse_certificate
from .distinguished_name import common_name, parse_name, rfc2253_text
from .document import DocumentKind, parse_document
from .documents import GovernanceDraft, GrantDraft, Rights, permissions_xml
from .file_set import FileSet, read_file
from .key_pair import Algorithm, private_key_pem
from .keystore import IdentityTerms, Keystore, create_keystore
from .options import governance_draft, rights
from .survey import find_authority, find_keystore
from .validity import Validity

__all__ = ["create", "make_authority", "make_enclave", "make_governance", "make_identity", "make_permissions"]


def create(arguments: argparse.Namespace) -> int:
    folders = create_keystore(
        arguments.folder,
        arguments.identities,
        terms=_terms(arguments),
        governance=governance_draft(arguments),
        rights=rights(arguments),
        force=arguments.force,
    )
    keystore = Keystore.at(arguments.folder)
    print(f"authorities   {keystore.identity_ca_certificate.parent}, their keys in {keystore.identity_ca_key.parent}")
    print(f"governance    {keystore.governance}")
    for folder in folders:
        print(f"identity      {folder}")
    print(f"Next: ddsi keystore check {arguments.folder}; in a program, ddsi.secure({str(folders[0])!r}).")
    print(f"Participants need only their identity's folder: keep {keystore.identity_ca_key.parent} away from them.")
    return 0


def make_authority(arguments: argparse.Namespace) -> int:
    validity = Validity.of_days(arguments.wall_clock(), arguments.days)
    authority = Authority.create(parse_name(arguments.subject), Algorithm(arguments.algorithm), validity)
    files = FileSet()
    files.add(arguments.certificate, certificate_pem(authority.certificate))
    files.add(arguments.key, private_key_pem(authority.private_key, _password(arguments)), private=True)
    return _write(files, arguments, f"authority {rfc2253_text(authority.certificate.subject)}")


def make_identity(arguments: argparse.Namespace) -> int:
    authority = _authority(arguments, "identity")
    identity = _terms(arguments).create(authority, "")
    files = FileSet()
    files.add(arguments.certificate, certificate_pem(identity.certificate))
    files.add(arguments.key, private_key_pem(identity.private_key), private=True)
    return _write(files, arguments, f"identity {identity.subject_name}")


def make_governance(arguments: argparse.Namespace) -> int:
    draft = governance_draft(arguments)
    if arguments.xml and draft != GovernanceDraft():
        raise BadParameter(f"{arguments.xml} says all that governance says: leave out the other options, or edit it")
    return _sign(arguments, DocumentKind.GOVERNANCE, draft.xml())


def make_permissions(arguments: argparse.Namespace) -> int:
    named = bool(arguments.certificates or arguments.subjects)
    if arguments.xml and (named or rights(arguments) != Rights()):
        raise BadParameter(f"{arguments.xml} says all that permissions say: leave out the other options, or edit it")
    if not arguments.xml and not named:
        raise BadParameter("whose permissions? Say --certificate FILE or --subject NAME, or sign a document with --xml")
    xml = b"" if arguments.xml else permissions_xml(_grants(arguments))
    return _sign(arguments, DocumentKind.PERMISSIONS, xml)


def make_enclave(arguments: argparse.Namespace) -> int:
    keystore = find_keystore(arguments.folder)
    password = _password(arguments)
    files = FileSet()
    folder = keystore.add_enclave(
        files,
        arguments.name,
        identity_ca=_read_authority(keystore.identity_ca_certificate, keystore.identity_ca_key, password),
        permissions_ca=_read_authority(keystore.permissions_ca_certificate, keystore.permissions_ca_key, password),
        terms=_terms(arguments),
        rights=rights(arguments),
    )
    return _write(files, arguments, f"identity {arguments.name} in {folder}")


# --- what they share ------------------------------------------------------------------------------------------


def _write(files: FileSet, arguments: argparse.Namespace, what: str) -> int:
    files.write(force=arguments.force)
    print(f"{what}: {', '.join(str(path) for path in files.paths)}")
    return 0


def _terms(arguments: argparse.Namespace) -> IdentityTerms:
    validity = Validity.of_days(arguments.wall_clock(), arguments.days)
    return IdentityTerms(validity, Algorithm(arguments.algorithm), arguments.subject)


def _grants(arguments: argparse.Namespace) -> list[GrantDraft]:
    """One for each certificate, no longer than it is valid itself, and for each name."""
    validity = Validity.of_days(arguments.wall_clock(), arguments.days)
    named: list[tuple[x509.Name, Validity]] = [(parse_name(subject), validity) for subject in arguments.subjects]
    for path in arguments.certificates:
        certificate = parse_certificate(read_file(path), str(path))
        named.append((certificate.subject, validity.within(certificate_validity(certificate))))
    return [
        GrantDraft(name=common_name(name), subject_name=rfc2253_text(name), validity=valid, rights=rights(arguments))
        for name, valid in named
    ]


def _sign(arguments: argparse.Namespace, kind: DocumentKind, xml: bytes) -> int:
    """The document in ``--xml``, or the one given, which is then kept beside the signed one."""
    files = FileSet()
    source = arguments.xml or arguments.signed.with_suffix(".xml")
    if arguments.xml:
        xml = read_file(arguments.xml)
    elif source == arguments.signed:
        raise BadParameter(f"{source} is to be the name of the signed document: let it end in .p7s")
    else:
        files.add(source, xml)
    parse_document(kind, xml, str(source))  # nobody shall sign what cannot be read
    files.add(arguments.signed, _authority(arguments, "permissions").sign_document(xml))
    return _write(files, arguments, f"{kind}, signed")


def _authority(arguments: argparse.Namespace, role: Literal["identity", "permissions"]) -> Authority:
    """The one that the options name."""
    if arguments.keystore and not (arguments.ca or arguments.ca_key):
        paths = find_authority(arguments.keystore, role)
    elif arguments.ca and arguments.ca_key and not arguments.keystore:
        paths = arguments.ca, arguments.ca_key
    else:
        raise BadParameter(f"which {role} CA? Say --keystore DIR, or both --ca FILE and --ca-key FILE")
    return _read_authority(*paths, _password(arguments))


def _read_authority(certificate: Path, key: Path, password: bytes | None) -> Authority:
    return Authority.parse(read_file(certificate), read_file(key), where=f"{certificate}, {key}", password=password)


def _password(arguments: argparse.Namespace) -> bytes | None:
    if not arguments.password_file:
        return None
    first, *_ = read_file(arguments.password_file).splitlines() or [b""]
    if not first:
        raise ConfigurationError(f"{arguments.password_file} holds no password: it is to be the first line")
    return first
