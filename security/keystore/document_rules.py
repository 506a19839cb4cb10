"""Rules on signed documents, whatever they say: who signed them, and can they be read?  DDS-Security 1.1 §9.4.1.1."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from cryptography import x509

from ..access_control.cms import NotSignedBy
from ..access_control.document_error import DocumentError, UntrustedDocument
from ..access_control.governance import Governance
from ..access_control.permissions import Permissions
from ..access_control.smime import SignedXml, verify
from ..access_control.xml_document import Node
from ..access_control.xml_document import parse_document as parse_nodes
from .certificate_rules import Certified
from .document import DocumentKind, is_signed, parse_document, unverified
from .file_set import read_file
from .finding import Finding, Rule, Severity

__all__ = ["INVALID", "RULES", "LoadedDocument", "check_document"]

UNSIGNED: Final = Rule("document-unsigned", Severity.ERROR, "a document without a signature")
ALTERED: Final = Rule("document-altered", Severity.ERROR, "a document was changed after it was signed")
WRONG_SIGNER: Final = Rule("document-wrong-signer", Severity.ERROR, "not the permissions CA signed a document")
INVALID: Final = Rule("document-invalid", Severity.ERROR, "a document that cannot be read, or contradicts itself")
NO_TEXT_HEADER: Final = Rule("document-no-text-header", Severity.WARNING, "a document was signed without -text")
SOURCE_DIFFERS: Final = Rule("source-differs", Severity.WARNING, "the XML beside a signed document says something else")
RULES: Final = (UNSIGNED, ALTERED, WRONG_SIGNER, INVALID, NO_TEXT_HEADER, SOURCE_DIFFERS)

_TEXT_HEADER: Final = b"content-type: text/plain"


@dataclass(frozen=True, slots=True)
class LoadedDocument:
    """What a document says, as values and as its elements; signed by whomever."""

    path: Path
    model: Governance | Permissions = field(repr=False)
    root: Node = field(repr=False)


def check_document(
    path: Path, kind: DocumentKind, signer: Certified | None, others: list[Certified]
) -> tuple[LoadedDocument | None, list[Finding]]:
    """The document, if it can be read at all.  ``others``: authorities that may have signed it by mistake.

    Raises ConfigurationError if the file cannot be read.
    """
    octets = read_file(path)
    signed = unverified(octets)
    findings: list[Finding] = []
    if signer and is_signed(octets):
        try:
            signed = verify(octets, signer[1], name=str(path))
        except UntrustedDocument as error:
            findings.append(_untrusted(path, kind, octets, error, signer, others))
    elif not is_signed(octets):
        remedy = f"rename it to {path.with_suffix('.xml').name}, and then {_sign_it(path, kind)}"
        findings.append(UNSIGNED.at(path, "nobody signed it, so participants refuse it", remedy=remedy))
    if signed is None:
        return None, findings
    findings += [*_check_text_header(path, kind, octets), *_check_source(path, kind, signed)]
    try:
        model = parse_document(kind, signed.xml, str(path), signed.first_line)
        root = parse_nodes(signed.xml, name=str(path), first_line=signed.first_line)
    except DocumentError as error:
        return None, [*findings, _invalid(path, error)]
    return LoadedDocument(path, model, root), findings


def _untrusted(
    path: Path, kind: DocumentKind, octets: bytes, error: UntrustedDocument, signer: Certified, others: list[Certified]
) -> Finding:
    by = next((other for other in others if _is_signed_by(octets, other[1])), None)
    if by:
        text = f"the permissions CA in {signer[0]} did not sign it, but the authority in {by[0]} did"
        return WRONG_SIGNER.at(path, text, remedy=f"sign it with the permissions CA: {_sign_it(path, kind)}")
    if not isinstance(error.__cause__, NotSignedBy):
        return INVALID.at(path, error.reason, line=error.line, remedy=error.remedy or _sign_it(path, kind))
    if "altered" in error.reason:
        text = f"its signature does not fit what it says: {error.reason}"
        return ALTERED.at(path, text, remedy=f"if you made the change, sign it again: {_sign_it(path, kind)}")
    text = f"it is not signed as participants want it: {error.reason}"
    return WRONG_SIGNER.at(path, text, remedy=f"sign it with the permissions CA: {_sign_it(path, kind)}")


def _is_signed_by(octets: bytes, certificate: x509.Certificate) -> bool:
    try:
        verify(octets, certificate, name="")
    except UntrustedDocument:
        return False
    return True


def _invalid(path: Path, error: DocumentError) -> Finding:
    where = f"{error.rule}: " if error.rule else ""
    return INVALID.at(
        path, f"{where}{error.reason}", line=error.line, remedy=error.remedy or "correct it and sign it again"
    )


def _check_text_header(path: Path, kind: DocumentKind, octets: bytes) -> Iterator[Finding]:
    """Cyclone DDS and Fast DDS verify with PKCS7_TEXT, which fails without."""
    if is_signed(octets) and b"multipart/signed" in octets[:1000].lower():
        before_xml = octets[: octets.find(b"<")].lower()
        if _TEXT_HEADER not in before_xml:
            yield NO_TEXT_HEADER.at(
                path,
                "what is signed does not begin with Content-Type: text/plain: Cyclone DDS and Fast DDS refuse it",
                remedy=f"sign it with openssl smime -sign -text, or {_sign_it(path, kind)}",
            )


def _check_source(path: Path, kind: DocumentKind, signed: SignedXml) -> Iterator[Finding]:
    """Somebody edited the XML, and participants go on reading what was signed before."""
    source = path.with_suffix(".xml")
    if source != path and source.is_file() and read_file(source).split() != signed.xml.split():
        yield SOURCE_DIFFERS.at(
            source, f"it is not what {path.name} says, so its changes have no effect", remedy=_sign_it(path, kind)
        )


def _sign_it(path: Path, kind: DocumentKind) -> str:
    signed, source = path.with_suffix(".p7s"), path.with_suffix(".xml")
    return f"ddsi keystore {kind} {signed} --xml {source} --keystore DIR --force"
