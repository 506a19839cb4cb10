"""A governance or permissions document in a file, signed or not.  DDS-Security 1.1 §9.4.1.

For people's eyes a document is also read where its signature is missing or wrong, and then said to be so: nobody is let
in by that.  Participants go through :mod:`ddsi_security.access_control`, which reads nothing unsigned.
"""

from __future__ import annotations

import re
from enum import StrEnum
from typing import Final

from ..access_control.governance import Governance
from ..access_control.permissions import Permissions
from ..access_control.smime import SignedXml

__all__ = ["DocumentKind", "document_kind", "is_signed", "parse_document", "unverified"]

_ROOTS: Final = re.compile(rb"<(domain_access_rules|permissions)[\s>/]")
_BEGIN: Final = re.compile(rb"<\?xml\s|<dds[\s>]")
_END: Final = b"</dds>"


class DocumentKind(StrEnum):
    GOVERNANCE = "governance"
    PERMISSIONS = "permissions"


def document_kind(octets: bytes) -> DocumentKind | None:
    """By the element below ``<dds>``; None for octets that are no such document, or hide it (S/MIME that is opaque)."""
    root = _ROOTS.search(octets)
    if root is None:
        return None
    return DocumentKind.PERMISSIONS if root[1] == b"permissions" else DocumentKind.GOVERNANCE


def is_signed(octets: bytes) -> bool:
    """Is it S/MIME of some kind, rather than the XML itself?"""
    return not octets.lstrip(b"\xef\xbb\xbf \t\r\n").startswith(b"<")


def unverified(octets: bytes) -> SignedXml | None:
    """The XML in a file, whoever signed it; None where none can be seen."""
    begin = _BEGIN.search(octets)
    end = octets.rfind(_END)
    if begin is None or end < begin.start():
        return None
    return SignedXml(octets[begin.start() : end + len(_END)], octets.count(b"\n", 0, begin.start()) + 1)


def parse_document(kind: DocumentKind, xml: bytes, name: str, first_line: int = 1) -> Governance | Permissions:
    """Raises DocumentError with line and remedy for what the schema, or the meaning of an element, rules out."""
    reader = Governance if kind is DocumentKind.GOVERNANCE else Permissions
    return reader.parse(xml, name=name, first_line=first_line)
