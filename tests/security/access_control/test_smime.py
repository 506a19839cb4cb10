"""S/MIME: what openssl and other vendors signed is accepted, from the permissions CA itself and from nobody else."""

from __future__ import annotations

import base64
import re
import shutil
import subprocess
from collections.abc import Callable
from functools import cache
from pathlib import Path

import pytest
from cryptography import x509
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import rsa
from cryptography.hazmat.primitives.serialization import Encoding, NoEncryption, PrivateFormat, pkcs7
from hypothesis import given
from hypothesis import strategies as st

from ddsi_security.access_control.der import DerReader
from ddsi_security.access_control.document_error import DocumentError, UntrustedDocument
from ddsi_security.access_control.smime import MOST_OCTETS, sign_document, verify
from tests.security.access_control.documents import PrivateKey, authority, certificate, new_key, permissions_xml

CAPTURES = Path(__file__).parents[2] / "captures"
XML = permissions_xml()
CANONICAL = XML.strip().replace(b"\n", b"\r\n")

needs_openssl = pytest.mark.skipif(shutil.which("openssl") is None, reason="openssl is not installed")


@cache
def signed(kind: str = "ec") -> bytes:
    return sign_document(XML, *authority(kind))


def openssl(*arguments: str, folder: Path, octets: bytes = XML, signer: str = "ec") -> bytes:
    """What ``openssl ARGUMENTS`` makes of ``octets``; ca.pem and ca.key, of the signer, are in its folder."""
    ca, key = authority(signer)
    (folder / "ca.pem").write_bytes(ca.public_bytes(Encoding.PEM))
    (folder / "ca.key").write_bytes(key.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption()))
    done = subprocess.run(
        ["openssl", *arguments], input=octets, capture_output=True, cwd=folder, timeout=20, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


# --- accepted ------------------------------------------------------------------------------------------------


SIGN = ("-sign", "-text", "-signer", "ca.pem", "-inkey", "ca.key")
OPENSSL_SIGNS = {
    "smime": ("smime", *SIGN),
    "cms": ("cms", *SIGN),
    "CRLF": ("smime", *SIGN, "-crlfeol"),
    "no signed attributes": ("smime", *SIGN, "-noattr"),
    "no certificates": ("smime", *SIGN, "-nocerts"),
    "SHA-384": ("smime", *SIGN, "-md", "sha384"),
    "SHA-512": ("cms", *SIGN, "-md", "sha512"),
    "by key identifier": ("cms", *SIGN, "-keyid"),
    "-text forgotten": ("smime", *(word for word in SIGN if word != "-text")),
}
OPAQUE = {"smime -nodetach": ("smime", *SIGN, "-nodetach"), "cms -nodetach": ("cms", *SIGN, "-nodetach")}


@needs_openssl
@pytest.mark.parametrize("kind", ["ec", "ec384", "rsa"])
@pytest.mark.parametrize("arguments", OPENSSL_SIGNS.values(), ids=OPENSSL_SIGNS)
def test_what_openssl_signed_is_verified(tmp_path: Path, kind: str, arguments: tuple[str, ...]) -> None:
    document = openssl(*arguments, folder=tmp_path, signer=kind)
    found = verify(document, authority(kind)[0], name="p.p7s")
    assert found.xml == CANONICAL
    assert document.splitlines()[found.first_line - 1].startswith(b"<?xml")


@needs_openssl
@pytest.mark.parametrize("salt", ["32", "0", "max"])
def test_rsa_pss_is_verified_with_any_salt(tmp_path: Path, salt: str) -> None:
    pss = ("-keyopt", "rsa_padding_mode:pss", "-keyopt", f"rsa_pss_saltlen:{salt}")
    document = openssl("cms", *SIGN, *pss, folder=tmp_path, signer="rsa")
    assert verify(document, authority("rsa")[0], name="p.p7s").xml == CANONICAL


@needs_openssl
@pytest.mark.parametrize("arguments", OPAQUE.values(), ids=OPAQUE)
def test_a_document_inside_its_signature_is_verified(tmp_path: Path, arguments: tuple[str, ...]) -> None:
    """It has no lines in the file, so it begins on the first."""
    found = verify(openssl(*arguments, folder=tmp_path), authority()[0], name="p.p7s")
    assert (found.xml, found.first_line) == (CANONICAL, 1)


@needs_openssl
@pytest.mark.parametrize("kind", ["ec", "rsa"])
@pytest.mark.parametrize("command", ["smime", "cms"])
def test_what_we_sign_is_verified_by_openssl(tmp_path: Path, kind: str, command: str) -> None:
    arguments = (command, "-verify", "-text", "-CAfile", "ca.pem")
    assert openssl(*arguments, folder=tmp_path, octets=signed(kind), signer=kind).rstrip() == CANONICAL


@pytest.mark.parametrize("kind", ["ec", "rsa"])
def test_what_we_sign_we_verify(kind: str) -> None:
    assert verify(signed(kind), authority(kind)[0], name="p.p7s").xml == CANONICAL


@pytest.mark.parametrize(
    "change",
    [
        lambda document: document.replace(b"\r\n", b"\n"),
        lambda document: document + b"\0",
        lambda document: document + b"\r\n \t\n\0\0",
        lambda document: document.replace(b"\r\n--==", b"\n--=="),
        lambda document: re.sub(rb'boundary="(.*?)"', rb"BOUNDARY=\1", document),
        lambda document: document.replace(
            b"Content-Type: multipart/signed; ", b"content-type:  Multipart/Signed;\r\n\t"
        ),
        lambda document: document.replace(b"x-pkcs7-signature", b"pkcs7-signature"),
        lambda document: document.replace(b"This is an S/MIME signed message\r\n", b""),
    ],
    ids=["LF", "NUL", "white space", "mixed", "unquoted", "folded", "without x-", "no preamble"],
)
def test_the_form_of_the_message_may_vary(change: Callable[[bytes], bytes]) -> None:
    document = change(signed())
    assert document != signed()
    assert verify(document, authority()[0], name="p.p7s").xml == CANONICAL


@pytest.mark.parametrize("folder", ["keystore", "keystore_rsa"])
def test_documents_of_the_captures_are_verified(folder: str) -> None:
    """Made by openssl with EC and with RSA, and accepted by Cyclone DDS and Fast DDS."""
    ca = x509.load_pem_x509_certificate((CAPTURES / folder / "permissions_ca.pem").read_bytes())
    documents = sorted((CAPTURES / folder).glob("*.p7s"))
    assert len(documents) >= 4
    for path in documents:
        found = verify(path.read_bytes(), ca, name=path.name)
        assert found.xml.replace(b"\r\n", b"\n") == path.with_suffix(".xml").read_bytes().strip()
        assert path.read_bytes().splitlines()[found.first_line - 1].startswith(b"<?xml")


# --- refused -------------------------------------------------------------------------------------------------


def refusal(document: bytes, ca: x509.Certificate | None = None) -> str:
    with pytest.raises(UntrustedDocument) as caught:
        verify(document, ca or authority()[0], name="p.p7s")
    assert str(caught.value).startswith("p.p7s: ")
    assert isinstance(caught.value, DocumentError)
    return caught.value.reason


def test_a_signer_below_the_permissions_ca_is_refused() -> None:
    """CVE-2023-24010 to -24012: an identity that the CA issued is not the CA, though a chain leads to it."""
    key = new_key("ec")
    issued = certificate("mallory", key, authority())
    assert "another certificate" in refusal(sign_document(XML, issued, key))


def test_a_stranger_with_the_name_and_number_of_the_ca_is_refused() -> None:
    ca, key = authority()[0], new_key("ec")
    double = certificate("permissions_ca", key, serial_number=ca.serial_number)
    assert "not the permissions CA's" in refusal(sign_document(XML, double, key))


def test_the_certificate_in_the_message_is_not_what_counts() -> None:
    """The same name and number, another key: only what the caller trusts verifies."""
    ca, _ = authority()
    key = new_key("ec")
    double = certificate("permissions_ca", key, serial_number=ca.serial_number)
    assert verify(sign_document(XML, double, key), double, name="p.p7s").xml == CANONICAL
    assert "not the permissions CA's" in refusal(signed(), double)


def test_altered_content_is_refused() -> None:
    assert "altered" in refusal(signed().replace(b"alice", b"malix"))


@needs_openssl
def test_altered_content_without_signed_attributes_is_refused(tmp_path: Path) -> None:
    document = openssl(*OPENSSL_SIGNS["no signed attributes"], folder=tmp_path)
    assert "altered" in refusal(document.replace(b"alice", b"malix"))


def test_two_signers_are_refused() -> None:
    ca, key = authority()
    other = new_key("ec")
    builder = pkcs7.PKCS7SignatureBuilder().set_data(XML)
    builder = builder.add_signer(ca, key, hashes.SHA256())
    builder = builder.add_signer(certificate("other", other), other, hashes.SHA256())
    document = builder.sign(Encoding.SMIME, [pkcs7.PKCS7Options.DetachedSignature, pkcs7.PKCS7Options.Text])
    assert "more than one" in refusal(document)


@needs_openssl
@pytest.mark.parametrize("digest", ["sha1", "md5", "sha224"])
def test_weak_digests_are_refused(tmp_path: Path, digest: str) -> None:
    document = openssl("smime", *SIGN, "-md", digest, folder=tmp_path, signer="rsa")
    assert "is not SHA-256" in refusal(document, authority("rsa")[0])


@pytest.mark.parametrize(("kind", "bits"), [("rsa1024", 1024), ("ec224", 224)])
def test_a_short_key_is_refused(kind: str, bits: int) -> None:
    ca, key = authority(kind)
    assert f"key has {bits} bits" in refusal(sign_document(XML, ca, key), ca)


def test_a_key_of_another_kind_is_refused() -> None:
    """RSA certificate with the issuer and number of the EC one: the algorithm does not fit its key."""
    rsa_key = authority("rsa")[1]
    double = certificate("permissions_ca", rsa_key, serial_number=authority()[0].serial_number)
    assert "does not fit" in refusal(signed(), double)


@needs_openssl
def test_pss_with_sha_1_inside_is_refused(tmp_path: Path) -> None:
    """The mask function of RSASSA-PSS has a digest of its own."""
    pss = ("-keyopt", "rsa_padding_mode:pss", "-keyopt", "rsa_mgf1_md:sha1")
    document = openssl("cms", *SIGN, *pss, folder=tmp_path, signer="rsa")
    assert "RSASSA-PSS" in refusal(document, authority("rsa")[0])


def test_signed_attributes_cannot_be_left_out() -> None:
    """Without them the signature is over something else: nobody can take them away."""
    der = cms_of(signed())
    attributes = der.rindex(bytes.fromhex("06092a864886f70d010903"))  # the content type is the first of them
    start = der.rindex(b"\xa0\x81", 0, attributes)
    assert "altered" in refusal(with_cms(signed(), without(der, start)))


def cms_of(document: bytes) -> bytes:
    return base64.b64decode(document.split(b"\r\n\r\n")[-2])


def with_cms(document: bytes, der: bytes) -> bytes:
    old = document.split(b"\r\n\r\n")[-2]
    return document.replace(old, base64.encodebytes(der).strip())


def without(der: bytes, start: int, base: int = 0) -> bytes:
    """``der``, which begins at ``base``, without the element that begins at ``start``; lengths are corrected."""
    reader, rebuilt, position = DerReader(der, "test"), b"", base
    while not reader.at_end:
        element = reader.next()
        content = bytes(element.content)
        if element.tag & 0x20:  # constructed
            content = without(content, start, position + len(element.encoding) - len(content))
        if position != start:
            count = (len(content).bit_length() + 7) // 8
            length = [len(content)] if len(content) < 0x80 else [0x80 | count, *len(content).to_bytes(count, "big")]
            rebuilt += bytes([element.tag, *length]) + content
        position += len(element.encoding)
    return rebuilt


NO_DOCUMENT = {
    "nothing": (b"", "Content-Type: multipart/signed is expected|without an end"),
    "XML alone": (XML, "XML without a signature"),
    "a PEM": (authority()[0].public_bytes(Encoding.PEM), "without an end|is no header"),
    "text": (b"Content-Type: text/plain\n\nhello\n", "text/plain is there"),
    "no boundary": (b"Content-Type: multipart/signed\n\n--B\n", "no boundary"),
    "a boundary without end": (
        b'Content-Type: multipart/signed; boundary="' + b"x" * 5000 + b'"\n\n',
        "without an end",
    ),
    "one part": (b"Content-Type: multipart/signed; boundary=B\n\n--B\nx\n--B--\n", "two parts"),
    "three parts": (b"Content-Type: multipart/signed; boundary=B\n\n--B\nx\n--B\ny\n--B\nz\n--B--\n", "two parts"),
    "no end": (signed().rpartition(b"--=")[0], "two parts"),
    "two types": (b"Content-Type: multipart/signed\nContent-Type: text/plain\n\nhello\n", "one too many"),
    "too large": (b"Content-Type: " + b"x" * MOST_OCTETS, "at most"),
    "another second part": (signed().replace(b"x-pkcs7-signature; name", b"text; name"), "second part"),
    "no base64": (signed().replace(b"MII", b"!!!"), "base64"),
    "a signature of nothing": (with_cms(signed(), b"\x30\x00"), "ContentInfo"),
    "a length beyond the end": (with_cms(signed(), b"\x30\x84\xff\xff\xff\xff\x00"), "announced"),
}


@pytest.mark.parametrize(("document", "reason"), NO_DOCUMENT.values(), ids=NO_DOCUMENT)
def test_what_is_no_signed_document_is_refused(document: bytes, reason: str) -> None:
    assert re.search(reason, refusal(document))


@pytest.mark.parametrize(
    ("header", "reason"),
    [
        (b"Content-Type: text/html", "text/html, not text/plain"),
        (b"Content-Type: text/plain\r\nContent-Transfer-Encoding: base64", "encoded as 'base64'"),
        (b"X: y", "of no type, not text/plain"),
    ],
)
def test_the_signed_part_must_be_plain_text(header: bytes, reason: str) -> None:
    """Signed by the CA as it is, so that only the header is to blame."""
    ca, key = authority()
    builder = pkcs7.PKCS7SignatureBuilder().set_data(header + b"\r\n\r\n" + CANONICAL)
    document = builder.add_signer(ca, key, hashes.SHA256()).sign(
        Encoding.SMIME, [pkcs7.PKCS7Options.DetachedSignature, pkcs7.PKCS7Options.Binary]
    )
    assert reason in refusal(document)


@pytest.mark.parametrize("kind", ["ec", "rsa"])
def test_no_flipped_octet_goes_unnoticed(kind: str) -> None:
    """In the document: its octets are signed.  In the signature: what passes says the same of the same document."""
    document, ca = signed(kind).replace(b"\r\n", b"\n"), authority(kind)[0]
    begin = document.index(b"<?xml")
    end = document.index(b"</dds>") + 6
    for position in range(begin, end, 7):
        altered = bytearray(document)
        altered[position] ^= 0x04
        assert refusal(bytes(altered), ca)


@given(st.data())
def test_hostile_messages_raise_one_error_alone(data: st.DataObject) -> None:
    """Octets are flipped, cut and doubled, in the message and inside the DER; the document never comes out altered."""
    document = signed()
    inside = data.draw(st.booleans(), label="inside the DER")
    octets = bytearray(cms_of(document) if inside else document)
    for _ in range(data.draw(st.integers(1, 4), label="changes")):
        position = data.draw(st.integers(0, len(octets) - 1), label="at")
        match data.draw(st.sampled_from(["flip", "cut", "grow", "end"]), label="what"):
            case "flip":
                octets[position] ^= 1 << data.draw(st.integers(0, 7), label="bit")
            case "cut":
                del octets[position : position + data.draw(st.integers(1, 9), label="count")]
            case "grow":
                octets[position:position] = data.draw(st.binary(min_size=1, max_size=9), label="octets")
            case "end":
                del octets[position + 1 :]
        octets = octets or bytearray(b"\0")
    hostile = with_cms(document, bytes(octets)) if inside else bytes(octets)
    try:
        found = verify(hostile, authority()[0], name="p.p7s")
    except UntrustedDocument:
        return
    assert found.xml == CANONICAL


@given(st.binary(max_size=200), st.integers(0, 2))
def test_any_octets_raise_one_error_alone(octets: bytes, prefix: int) -> None:
    before = (b"", b"Content-Type: multipart/signed; boundary=B\n\n--B\n", b"Content-Type: application/pkcs7-mime\n\n")
    with pytest.raises(UntrustedDocument):
        verify(before[prefix] + octets, authority()[0], name="p.p7s")


def test_signing_needs_the_key_of_the_certificate() -> None:
    with pytest.raises(ValueError, match="not that of the certificate"):
        sign_document(XML, authority()[0], new_key("ec"))


def test_no_repr_shows_a_document() -> None:
    assert "alice" not in repr(verify(signed(), authority()[0], name="p.p7s"))


def test_private_keys_of_the_tests_are_of_both_kinds() -> None:
    keys: list[PrivateKey] = [authority("ec")[1], authority("rsa")[1]]
    assert [isinstance(key, rsa.RSAPrivateKey) for key in keys] == [False, True]
