"""Signed documents: S/MIME around governance and permissions.  DDS-Security 1.1 §9.4.1.1; RFC 8551, RFC 1847.

    verify(document: bytes, certificate: x509.Certificate, *, name: str) -> SignedXml(xml: bytes, first_line: int)
    sign_document(xml: bytes, certificate: x509.Certificate, private_key) -> bytes

Read are ``multipart/signed`` messages, as ``openssl smime -sign -text`` writes them and the specification wants, and
``application/pkcs7-mime`` ones, in which the document is inside the signature (``-nodetach``).  What others wrote is
taken with LF or CRLF, with trailing NULs and white space, and without the inner ``Content-Type: text/plain`` (``-text``
forgotten).  Nothing but the octets that the signature covers is ever returned.

Not here: XML (``xml_document.py``), and the rest of MIME: no nested parts, no transfer encoding of the document.
"""

from __future__ import annotations

import binascii
import re
from dataclasses import field

from cryptography import x509
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import ec, rsa
from cryptography.hazmat.primitives.serialization import Encoding, pkcs7

from ddsi.structure.dataclass import dataclass
from ddsi.structure.errors import MalformedMessage

from .cms import NotSignedBy, verify_signed_data
from .document_error import UntrustedDocument, shown

__all__ = ["MOST_OCTETS", "SignedXml", "sign_document", "verify"]

MOST_OCTETS = 1 << 20
"""A document of more octets is refused unread; real ones have some kilobytes."""

_SIGN_IT = "sign it with `openssl smime -sign -text -in X.xml -out X.p7s -signer CA.pem -inkey CA.key`"
_DETACHED = "multipart/signed"
_SIGNATURE = ("application/pkcs7-signature", "application/x-pkcs7-signature")
_OPAQUE = ("application/pkcs7-mime", "application/x-pkcs7-mime")
_NOT_ENCODED = ("", "7bit", "8bit", "binary")
_LONGEST_HEADER = 1000  # octets of a header field with its continuations; RFC 5322 §2.1.1 has 998 a line
_MOST_HEADERS = 50


@dataclass(frozen=True, slots=True)
class SignedXml:
    """What was signed, without its MIME header.  ``first_line``: of the file, from 1, on which ``xml`` begins.

    Where the document is inside the signature it has no lines in the file, and ``first_line`` is 1.
    """

    xml: bytes = field(repr=False)
    first_line: int


def verify(document: bytes, certificate: x509.Certificate, *, name: str) -> SignedXml:
    """The XML in ``document``, signed by ``certificate`` itself: the permissions CA's, not one below it.

    ``name`` is what errors call the document.  Raises UntrustedDocument, and nothing else.
    """
    try:
        if len(document) > MOST_OCTETS:
            raise MalformedMessage(f"it has {len(document)} octets; at most {MOST_OCTETS} are read")
        return _verify(document.rstrip(b"\0 \t\r\n"), certificate)
    except NotSignedBy as error:
        raise UntrustedDocument(name, str(error), remedy="sign it with the permissions CA's own key") from error
    except MalformedMessage as error:
        raise UntrustedDocument(name, f"it is no signed document: {error}", remedy=_SIGN_IT) from error


def sign_document(
    xml: bytes, certificate: x509.Certificate, private_key: rsa.RSAPrivateKey | ec.EllipticCurvePrivateKey
) -> bytes:
    """``xml`` as an S/MIME message signed by ``certificate``, detached, text/plain: what every vendor reads.

    The key must be the certificate's; RSA signs by PKCS#1 v1.5, either with SHA-256.  Lines end in CRLF.
    """
    if private_key.public_key() != certificate.public_key():
        raise ValueError("the private key is not that of the certificate")
    builder = pkcs7.PKCS7SignatureBuilder().set_data(xml).add_signer(certificate, private_key, hashes.SHA256())
    return builder.sign(Encoding.SMIME, [pkcs7.PKCS7Options.DetachedSignature, pkcs7.PKCS7Options.Text])


def _verify(document: bytes, certificate: x509.Certificate) -> SignedXml:
    if document.lstrip().startswith(b"<"):
        raise MalformedMessage("it is XML without a signature")
    headers, begin = _read_headers(document, 0)
    content_type, parameters = _content_type(headers)
    if content_type in _OPAQUE:
        content = verify_signed_data(_from_base64(document[begin:]), None, certificate)
        return SignedXml(_strip_text_header(content)[0], 1)
    if content_type != _DETACHED:
        expected = f"Content-Type: {_DETACHED} is expected"
        raise MalformedMessage(f"{expected}, {content_type} is there" if content_type else expected)
    part, part_begin, signature = _split(document, begin, parameters.get("boundary", ""))
    signature_headers, signature_begin = _read_headers(signature, 0)
    signature_type, _ = _content_type(signature_headers)
    if signature_type not in _SIGNATURE:
        raise MalformedMessage(f"its second part is {signature_type or 'of no type'}, not {_SIGNATURE[0]}")
    content = verify_signed_data(_from_base64(signature[signature_begin:]), _canonical(part), certificate)
    xml, lines_before = _strip_text_header(content)
    return SignedXml(xml, document.count(b"\n", 0, part_begin) + lines_before + 1)


def _canonical(part: bytes) -> bytes:
    """Every line end as CRLF, which is what is signed (RFC 8551 §3.1.1); a line loses all CRs at its end."""
    return b"\r\n".join(line.rstrip(b"\r") for line in part.split(b"\n"))


def _strip_text_header(content: bytes) -> tuple[bytes, int]:
    """The document after the MIME header that is signed with it, and the number of lines that are left out."""
    begin = 0
    if not content.lstrip().startswith(b"<"):
        headers, begin = _read_headers(content, 0)
        content_type, _ = _content_type(headers)
        if content_type != "text/plain":
            raise MalformedMessage(f"what is signed is {content_type or 'of no type'}, not text/plain")
        if headers.get("content-transfer-encoding", "").lower() not in _NOT_ENCODED:
            raise MalformedMessage(f"what is signed is encoded as {shown(headers['content-transfer-encoding'])}")
    xml = content[begin:].lstrip()
    return xml.rstrip(b"\0 \t\r\n"), content.count(b"\n", 0, len(content) - len(xml))


# --- MIME ----------------------------------------------------------------------------------------------------


def _split(document: bytes, begin: int, boundary: str) -> tuple[bytes, int, bytes]:
    """The signed part, where it begins, and the part with the signature (RFC 2046 §5.1.1).

    A line end before a boundary belongs to the boundary.
    """
    if not 1 <= len(boundary) <= 70 or not boundary.isascii():
        raise MalformedMessage("its Content-Type has no boundary of 1 to 70 characters")
    line = re.compile(rb"^--" + re.escape(boundary.encode("ascii")) + rb"(--)?[ \t]*\r*(?:\n|\Z)", re.MULTILINE)
    found = [match for match, _ in zip(line.finditer(document, begin), range(4), strict=False)]
    if [match.group(1) for match in found] != [None, None, b"--"]:
        raise MalformedMessage("it must have two parts, the document and its signature, between its boundaries")
    first, second, last = found
    return document[first.end() : second.start() - 1], first.end(), document[second.end() : last.start()]


def _read_headers(octets: bytes, begin: int) -> tuple[dict[str, str], int]:
    """Header fields from ``begin`` to the first empty line, names in lower case, and where the body begins."""
    headers: dict[str, str] = {}
    name = ""
    for _ in range(_MOST_HEADERS):
        end = octets.find(b"\n", begin, begin + _LONGEST_HEADER)
        if end < 0:
            raise MalformedMessage("a header without an end", offset=begin)
        line = octets[begin:end].rstrip(b"\r").decode("latin-1")
        begin = end + 1
        if not line.strip():
            return headers, begin
        if line[0] in " \t" and name:
            headers[name] = f"{headers[name]} {line.strip()}"
        else:
            name, colon, value = line.partition(":")
            name = name.strip().lower()
            if not colon or not name.isascii() or name in headers:
                raise MalformedMessage(f"{shown(line)} is no header, or one too many", offset=begin)
            headers[name] = value.strip()
        if len(headers[name]) > _LONGEST_HEADER:
            raise MalformedMessage("a header that is too long", offset=begin)
    raise MalformedMessage(f"more than {_MOST_HEADERS} lines of headers", offset=begin)


_PARAMETER = re.compile(
    r'\s*([!#$%&*+.^_`|~0-9A-Za-z\'-]{1,70})\s*=\s*(?:"([^"\\]{0,200})"|([^\s;"]{1,200}))\s*(?:;|\Z)'
)


def _content_type(headers: dict[str, str]) -> tuple[str, dict[str, str]]:
    """Content-Type in lower case and its parameters (RFC 2045 §5.1); "" where there is none."""
    kind, _, rest = headers.get("content-type", "").partition(";")
    parameters: dict[str, str] = {}
    position = 0
    while rest[position:].strip():
        match = _PARAMETER.match(rest, position)
        if match is None or match.group(1).lower() in parameters:
            raise MalformedMessage(f"Content-Type: {shown(headers['content-type'])} cannot be read")
        parameters[match.group(1).lower()] = match.group(2) if match.group(2) is not None else match.group(3)
        position = match.end()
    return kind.strip().lower(), parameters


def _from_base64(body: bytes) -> bytes:
    try:
        return binascii.a2b_base64(b"".join(body.split()), strict_mode=True)
    except binascii.Error as error:
        raise MalformedMessage(f"its signature is not base64: {error}") from error
