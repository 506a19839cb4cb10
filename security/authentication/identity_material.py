"""IdentityMaterial: what the properties point to, read and checked to belong together.  DDS-Security 1.1 §9.3.1.

Everything that can be wrong with a configuration is said here, in a ConfigurationError that names the property, what it
points to (never the content of a ``data:`` URI), the line where there is one, and what to do.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import field
from pathlib import Path
from typing import Final

from cryptography import x509

from ddsi.structure.dataclass import dataclass
from ddsi.structure.errors import ConfigurationError

from ..properties import IDENTITY_CA, IDENTITY_CERTIFICATE, IDENTITY_CRL, PASSWORD, PRIVATE_KEY, TRUSTED_CA_DIR
from ..resources import read_resource, resource_name
from .certificate import PARSE_ERRORS, Certificate, pem_blocks
from .not_trusted import NotTrusted
from .pkcs11_token import TokenKey, read_certificate
from .pkcs11_uri import Pkcs11Uri
from .private_key import read_private_key
from .signatures import PrivateKey, verify
from .trust_anchors import RevocationList, TrustAnchors

__all__ = ["IdentityMaterial", "read_identity_material"]

_CERTIFICATE, _CRL = "CERTIFICATE", "X509 CRL"
_MAX_FILES: Final = 4096
"""In a directory of trusted CAs; each certificate is asked for each peer."""
_PROBE: Final = b"does this private key belong to that certificate?"


@dataclass(frozen=True, slots=True)
class IdentityMaterial:
    """``authority`` issued our certificate; ``anchors`` are whom we believe about others."""

    certificate: Certificate
    key: PrivateKey = field(repr=False)
    anchors: TrustAnchors
    authority: Certificate


def read_identity_material(properties: Mapping[str, str], now: int) -> IdentityMaterial:
    """``properties`` by their OMG names; ``now`` in nanoseconds since 1970.  Raises ConfigurationError."""
    authorities = tuple(_certificates(IDENTITY_CA, properties))
    certificate = _certificates(IDENTITY_CERTIFICATE, properties)[0]
    revocation_lists = _revocation_lists(properties, authorities)
    # Ours must come from our own CA, whomever else we believe.
    with _explained(IDENTITY_CERTIFICATE, properties):
        authority = TrustAnchors(authorities, revocation_lists).verify(certificate, now)
    trusted = _trusted_directory(properties, authorities) or authorities
    key = _private_key(properties, certificate)
    return IdentityMaterial(certificate, key, TrustAnchors(trusted, revocation_lists), authority)


# --- certificates ---------------------------------------------------------------------------------------------


def _certificates(name: str, properties: Mapping[str, str]) -> list[Certificate]:
    uri = _required(name, properties)
    if uri.startswith("pkcs11:"):
        der = read_certificate(name, Pkcs11Uri.parse(name, uri, password=properties.get(PASSWORD)))
        with _explained(name, properties):
            return [Certificate.from_der(der)]
    return _certificates_in(name, resource_name(uri), read_resource(name, uri))


def _certificates_in(name: str, where: str, text: bytes) -> list[Certificate]:
    blocks = pem_blocks(text, _CERTIFICATE)
    if not blocks:
        raise ConfigurationError(
            f"property {name}: there is no certificate in {where}: "
            "it must be PEM, which begins with -----BEGIN CERTIFICATE-----"
        )
    certificates = []
    for line, block in blocks:
        try:
            certificates.append(Certificate.from_pem(block))
        except NotTrusted as error:
            raise ConfigurationError(f"property {name}: {where}, line {line}: {error}") from error
    return certificates


def _trusted_directory(properties: Mapping[str, str], own: tuple[Certificate, ...]) -> tuple[Certificate, ...]:
    """The CAs whose participants we believe, all in one directory; empty if none is configured."""
    given = properties.get(TRUSTED_CA_DIR, "")
    if not given:
        return ()
    path = resource_name(given) if given.startswith("file:") else given
    if properties.get(IDENTITY_CRL):
        raise ConfigurationError(
            f"properties {TRUSTED_CA_DIR} and {IDENTITY_CRL} exclude each other: a revocation list is one CA's"
        )
    trusted: list[Certificate] = []
    for file in _files(path):
        text = read_resource(TRUSTED_CA_DIR, f"file:{file}")
        if pem_blocks(text, _CERTIFICATE):
            trusted += _certificates_in(TRUSTED_CA_DIR, str(file), text)
    if not any(authority in trusted for authority in own):
        raise ConfigurationError(
            f"property {TRUSTED_CA_DIR}: our own identity CA is not in {path}: "
            f"copy {resource_name(properties[IDENTITY_CA])} there"
        )
    return tuple(trusted)


def _files(path: str) -> list[Path]:
    try:
        # In order, so that nothing depends on how the file system lists them.
        files = sorted(file for file in Path(path).iterdir() if file.is_file() and file.stat().st_size)
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else "it is not a path"
        raise ConfigurationError(f"property {TRUSTED_CA_DIR}: cannot read the directory {path}: {reason}") from error
    if len(files) > _MAX_FILES:
        raise ConfigurationError(f"property {TRUSTED_CA_DIR}: {path} holds more than {_MAX_FILES} files")
    return files


def _revocation_lists(
    properties: Mapping[str, str], authorities: tuple[Certificate, ...]
) -> tuple[RevocationList, ...]:
    uri = properties.get(IDENTITY_CRL, "")
    if not uri:
        return ()
    where = resource_name(uri)
    blocks = pem_blocks(read_resource(IDENTITY_CRL, uri), _CRL)
    if not blocks:
        raise ConfigurationError(
            f"property {IDENTITY_CRL}: there is no certificate revocation list in {where}: "
            "it must be PEM, which begins with -----BEGIN X509 CRL-----"
        )
    lists = []
    for line, block in blocks:
        try:
            lists.append(RevocationList.read(x509.load_pem_x509_crl(block), authorities))
        except (NotTrusted, *PARSE_ERRORS) as error:
            reason = str(error) if isinstance(error, NotTrusted) else "it cannot be read"
            raise ConfigurationError(f"property {IDENTITY_CRL}: {where}, line {line}: {reason}") from error
    return tuple(lists)


# --- the key --------------------------------------------------------------------------------------------------


def _private_key(properties: Mapping[str, str], certificate: Certificate) -> PrivateKey:
    uri = _required(PRIVATE_KEY, properties)
    password = properties.get(PASSWORD)
    key: PrivateKey
    if uri.startswith("pkcs11:"):
        parsed = Pkcs11Uri.parse(PRIVATE_KEY, uri, password=password)
        key = TokenKey(PRIVATE_KEY, parsed, certificate.algorithm)
    else:
        pem = read_resource(PRIVATE_KEY, uri)
        with _explained(PRIVATE_KEY, properties):
            key = read_private_key(pem, password)
    try:
        # The one proof that serves keys in memory and in tokens alike.
        verify(certificate.public_key, key.sign(_PROBE), _PROBE)
    except NotTrusted as error:
        key.close()
        raise ConfigurationError(
            f"the private key {PRIVATE_KEY} {_shown(uri)} does not belong to the certificate {IDENTITY_CERTIFICATE} "
            f"{_shown(properties[IDENTITY_CERTIFICATE])} of {certificate.subject}: give the key that the certificate "
            f"was requested with ({error})"
        ) from error
    return key


# --- texts ----------------------------------------------------------------------------------------------------


def _required(name: str, properties: Mapping[str, str]) -> str:
    uri = properties.get(name)
    if not uri:
        raise ConfigurationError(
            f"property {name} is missing: a secured participant needs {IDENTITY_CA}, {IDENTITY_CERTIFICATE} and "
            f"{PRIVATE_KEY}, each as file:/path/to/it"
        )
    return uri


@contextmanager
def _explained(name: str, properties: Mapping[str, str]) -> Iterator[None]:
    try:
        yield
    except NotTrusted as error:
        raise ConfigurationError(f"property {name}: {resource_name(properties[name])}: {error}") from error


def _shown(uri: str) -> str:
    """The value of a property, if it is the name of a file; others may hold a secret."""
    return uri if uri.startswith("file:") else resource_name(uri)
