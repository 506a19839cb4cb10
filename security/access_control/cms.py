"""CMS SignedData: was this content signed by exactly this certificate?  RFC 5652 §5, as DDS-Security 1.1 §9.4.1.1 asks.

The trusted signer is the permissions CA's certificate itself.  There is no chain: certificates inside the message are
not even read, because whoever made the message chose them - to trust them is what CVE-2023-24010, -24011 and -24012
were about.  The signer must name our certificate, by issuer and serial number or by its subject key identifier, and
the signature must verify with our certificate's key.

Not here: encryption, counter-signatures, signing time, revocation, and the validity of the CA's certificate (neither
the specification nor other vendors look at it here).
"""

from __future__ import annotations

import hashlib
import hmac

from cryptography import x509
from cryptography.exceptions import InvalidSignature, UnsupportedAlgorithm
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import ec, padding, rsa

from ddsi.structure.dataclass import dataclass
from ddsi.structure.errors import MalformedMessage

from .der import DerReader, Tag, object_identifier

__all__ = ["NotSignedBy", "verify_signed_data"]

_DATA = "1.2.840.113549.1.7.1"
_SIGNED_DATA = "1.2.840.113549.1.7.2"
_CONTENT_TYPE = "1.2.840.113549.1.9.3"
_MESSAGE_DIGEST = "1.2.840.113549.1.9.4"

# SHA-256 or better (§9.4.1.1); what is not here, MD5 and SHA-1 above all, is refused.
_DIGESTS: dict[str, hashes.SHA256 | hashes.SHA384 | hashes.SHA512] = {
    "2.16.840.1.101.3.4.2.1": hashes.SHA256(),
    "2.16.840.1.101.3.4.2.2": hashes.SHA384(),
    "2.16.840.1.101.3.4.2.3": hashes.SHA512(),
}
_RSA = "1.2.840.113549.1.1.1"
_RSA_PSS = "1.2.840.113549.1.1.10"
_MGF1 = "1.2.840.113549.1.1.8"
_EC = "1.2.840.10045.2.1"
# Signature algorithms that name their digest, which must be the signer's.
_RSA_WITH = {"1.2.840.113549.1.1.11": "sha256", "1.2.840.113549.1.1.12": "sha384", "1.2.840.113549.1.1.13": "sha512"}
_ECDSA_WITH = {"1.2.840.10045.4.3.2": "sha256", "1.2.840.10045.4.3.3": "sha384", "1.2.840.10045.4.3.4": "sha512"}
_LEAST_RSA_BITS = 2048
_LEAST_EC_BITS = 256
_MOST_SALT = 512
_MOST_ATTRIBUTES = 64


class NotSignedBy(Exception):
    """The octets are SignedData, but no acceptable signature of the certificate over the content."""


@dataclass(frozen=True, slots=True)
class _SignerInfo:
    """RFC 5652 §5.3, less what is not looked at.  Of algorithms: identifier, and parameters in DER or nothing."""

    names_certificate: bool
    digest_algorithm: str
    signed_attributes: memoryview | None  # with their tag, [0] IMPLICIT
    signature_algorithm: tuple[str, memoryview]
    signature: bytes


def verify_signed_data(octets: bytes, content: bytes | None, certificate: x509.Certificate) -> bytes:
    """The content that ``certificate`` signed: ``content``, or where that is None, what the SignedData encloses.

    ``octets`` is a ContentInfo in DER.  Raises MalformedMessage for what is not, and NotSignedBy.
    """
    enclosed, signer = _parse(octets, certificate)
    if (content is None) == (enclosed is None):
        raise NotSignedBy("it must have its content either beside the signature or inside it")
    signed = content if content is not None else enclosed
    assert signed is not None
    if not signer.names_certificate:
        raise NotSignedBy("it is signed by another certificate than the permissions CA's, be it one that the CA issued")
    digest = _DIGESTS.get(signer.digest_algorithm)
    if digest is None:
        raise NotSignedBy(f"its digest algorithm, {signer.digest_algorithm}, is not SHA-256, SHA-384 or SHA-512")
    covered = signed
    if signer.signed_attributes is not None:
        _check_attributes(signer.signed_attributes, hashlib.new(digest.name, signed).digest())
        # The signature covers them as a SET OF, not as the [0] that they are sent as (RFC 5652 §5.4).
        covered = bytes([Tag.SET]) + signer.signed_attributes[1:]
    _check_signature(signer, digest, covered, certificate)
    return signed


# --- parsing -------------------------------------------------------------------------------------------------


def _parse(octets: bytes, certificate: x509.Certificate) -> tuple[bytes | None, _SignerInfo]:
    outer = DerReader(octets, "CMS")
    content_info = outer.enter(Tag.SEQUENCE, "ContentInfo")
    outer.end()
    if object_identifier(content_info.next(Tag.OBJECT_IDENTIFIER).content) != _SIGNED_DATA:
        raise MalformedMessage("it holds no SignedData", element="ContentInfo")
    explicit = content_info.enter(Tag.CONTEXT_0, "ContentInfo")
    content_info.end()
    signed_data = explicit.enter(Tag.SEQUENCE, "SignedData")
    explicit.end()
    signed_data.next(Tag.INTEGER)
    signed_data.next(Tag.SET)  # the digest algorithms, to help those who read in one pass
    enclosed = _enclosed_content(signed_data.enter(Tag.SEQUENCE, "EncapsulatedContentInfo"))
    signed_data.optional(Tag.CONTEXT_0)  # certificates: not trusted, not read
    signed_data.optional(Tag.CONTEXT_1)  # revocation lists: likewise
    signers = signed_data.enter(Tag.SET, "SignerInfos")
    signed_data.end()
    if signers.at_end:
        raise NotSignedBy("nobody signed it")
    signer = _signer_info(signers.enter(Tag.SEQUENCE, "SignerInfo"), certificate)
    if not signers.at_end:
        raise NotSignedBy("more than one signed it; the permissions CA must be the only one")
    return enclosed, signer


def _enclosed_content(info: DerReader) -> bytes | None:
    if object_identifier(info.next(Tag.OBJECT_IDENTIFIER).content) != _DATA:
        raise MalformedMessage("its content is not data", element="EncapsulatedContentInfo")
    if info.at_end:
        return None
    explicit = info.enter(Tag.CONTEXT_0, "EncapsulatedContentInfo")
    info.end()
    content = bytes(explicit.next(Tag.OCTET_STRING).content)
    explicit.end()
    return content


def _signer_info(info: DerReader, certificate: x509.Certificate) -> _SignerInfo:
    info.next(Tag.INTEGER)
    if (key_identifier := info.optional(Tag.CONTEXT_0_PRIMITIVE)) is not None:
        names_certificate = bytes(key_identifier.content) == _subject_key_identifier(certificate)
    else:
        issuer_and_serial = info.enter(Tag.SEQUENCE, "IssuerAndSerialNumber")
        named = (
            bytes(issuer_and_serial.next(Tag.SEQUENCE).encoding),
            bytes(issuer_and_serial.next(Tag.INTEGER).content),
        )
        issuer_and_serial.end()
        names_certificate = named == _issuer_and_serial(certificate)
    digest_algorithm, _ = _algorithm(info)
    attributes = info.optional(Tag.CONTEXT_0)
    signature_algorithm = _algorithm(info)
    signature = bytes(info.next(Tag.OCTET_STRING).content)
    info.optional(Tag.CONTEXT_1)  # unsigned attributes: anybody's
    info.end()
    signed_attributes = None if attributes is None else attributes.encoding
    return _SignerInfo(names_certificate, digest_algorithm, signed_attributes, signature_algorithm, signature)


def _algorithm(reader: DerReader) -> tuple[str, memoryview]:
    """AlgorithmIdentifier: which, and its parameters in DER; empty for none or NULL (RFC 5280 §4.1.1.2)."""
    algorithm = reader.enter(Tag.SEQUENCE, "AlgorithmIdentifier")
    identifier = object_identifier(algorithm.next(Tag.OBJECT_IDENTIFIER).content)
    parameters = memoryview(b"")
    if not algorithm.at_end:
        found = algorithm.next()
        parameters = memoryview(b"") if found.tag == Tag.NULL else found.encoding
    algorithm.end()
    return identifier, parameters


def _subject_key_identifier(certificate: x509.Certificate) -> bytes | None:
    try:
        return certificate.extensions.get_extension_for_class(x509.SubjectKeyIdentifier).value.digest
    except (x509.ExtensionNotFound, ValueError):
        return None


def _issuer_and_serial(certificate: x509.Certificate) -> tuple[bytes, bytes]:
    """As they stand in the certificate: octets are compared, so that no second encoding of a name is the same name."""
    body = DerReader(certificate.tbs_certificate_bytes, "certificate").enter(Tag.SEQUENCE, "TBSCertificate")
    body.optional(Tag.CONTEXT_0)  # version
    serial = bytes(body.next(Tag.INTEGER).content)
    body.next(Tag.SEQUENCE)  # signature algorithm
    return bytes(body.next(Tag.SEQUENCE).encoding), serial


# --- verifying -----------------------------------------------------------------------------------------------


def _check_attributes(encoding: memoryview, digest: bytes) -> None:
    """The signed attributes must have the content's type and its digest, each once (RFC 5652 §5.4, §11)."""
    attributes = DerReader(encoding, "SignerInfo").enter(Tag.CONTEXT_0, "SignedAttributes")
    values: dict[str, memoryview] = {}
    for _ in range(_MOST_ATTRIBUTES):
        if attributes.at_end:
            break
        attribute = attributes.enter(Tag.SEQUENCE, "Attribute")
        identifier = object_identifier(attribute.next(Tag.OBJECT_IDENTIFIER).content)
        if identifier in values:
            raise MalformedMessage(f"{identifier} twice", element="SignedAttributes")
        values[identifier] = attribute.next(Tag.SET).content
        attribute.end()
    attributes.end()
    if _CONTENT_TYPE not in values or _MESSAGE_DIGEST not in values:
        raise NotSignedBy("its signed attributes lack the content type or the message digest")
    content_type = DerReader(values[_CONTENT_TYPE], "ContentType")
    if object_identifier(content_type.next(Tag.OBJECT_IDENTIFIER).content) != _DATA:
        raise NotSignedBy("its signed attributes are about another type of content")
    content_type.end()
    message_digest = DerReader(values[_MESSAGE_DIGEST], "MessageDigest")
    if not hmac.compare_digest(bytes(message_digest.next(Tag.OCTET_STRING).content), digest):
        raise NotSignedBy("it was altered after it was signed, as its digest is another one")
    message_digest.end()


def _check_signature(
    signer: _SignerInfo, digest: hashes.HashAlgorithm, covered: bytes, certificate: x509.Certificate
) -> None:
    algorithm, parameters = signer.signature_algorithm
    named_digest = (_RSA_WITH | _ECDSA_WITH).get(algorithm, digest.name)
    if named_digest != digest.name:
        raise NotSignedBy(f"its signature is over {named_digest}, its digest is {digest.name}")
    try:
        key = certificate.public_key()
        if isinstance(key, rsa.RSAPublicKey) and (algorithm in (_RSA, _RSA_PSS) or algorithm in _RSA_WITH):
            _check_key_size(key.key_size, _LEAST_RSA_BITS)
            scheme = _pss(parameters, digest) if algorithm == _RSA_PSS else padding.PKCS1v15()
            key.verify(signer.signature, covered, scheme, digest)
        elif isinstance(key, ec.EllipticCurvePublicKey) and (algorithm == _EC or algorithm in _ECDSA_WITH):
            _check_key_size(key.key_size, _LEAST_EC_BITS)
            key.verify(signer.signature, covered, ec.ECDSA(digest))
        else:
            raise NotSignedBy(f"its signature algorithm, {algorithm}, does not fit the permissions CA's key")
    except InvalidSignature as error:
        raise NotSignedBy("the signature is not the permissions CA's, or it was altered after it was signed") from error
    except (UnsupportedAlgorithm, ValueError) as error:
        raise NotSignedBy(f"its signature cannot be verified: {error}") from error


def _check_key_size(bits: int, least: int) -> None:
    if bits < least:
        raise NotSignedBy(f"the permissions CA's key has {bits} bits; {least} are needed")


def _pss(parameters: memoryview, digest: hashes.HashAlgorithm) -> padding.PSS:
    """RSASSA-PSS-params (RFC 4055 §3.1): the digest must be the signer's, and the mask's too; any salt length."""
    outer = DerReader(parameters, "RSASSA-PSS")
    fields = outer.enter(Tag.SEQUENCE, "RSASSA-PSS")
    outer.end()
    salt_length = 20
    digests: list[str] = []
    if (found := fields.optional(Tag.CONTEXT_0)) is not None:
        digests.append(_algorithm(DerReader(found.content, "RSASSA-PSS"))[0])
    if (found := fields.optional(Tag.CONTEXT_1)) is not None:
        generator, of_mask = _algorithm(DerReader(found.content, "RSASSA-PSS"))
        if generator == _MGF1:
            mask = DerReader(of_mask, "MGF1").enter(Tag.SEQUENCE, "MGF1")
            digests.append(object_identifier(mask.next(Tag.OBJECT_IDENTIFIER).content))
    if (found := fields.optional(Tag.CONTEXT_2)) is not None:
        salt_length = int.from_bytes(DerReader(found.content, "RSASSA-PSS").next(Tag.INTEGER).content[:4], "big")
    fields.optional(Tag.CONTEXT_3)
    fields.end()
    # What is left out is SHA-1, the default of 1998.
    if [getattr(_DIGESTS.get(found), "name", "") for found in digests] != [digest.name, digest.name]:
        raise NotSignedBy("its RSASSA-PSS parameters are of another digest than its own")
    if salt_length > _MOST_SALT:
        raise NotSignedBy(f"its RSASSA-PSS salt of {salt_length} octets is too long")
    return padding.PSS(padding.MGF1(digest), salt_length)
