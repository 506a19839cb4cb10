"""Identities as people configure them: what is accepted, and what is said about what is not."""

from __future__ import annotations

import base64
import datetime
import subprocess
from collections.abc import Callable
from contextlib import nullcontext
from pathlib import Path

import pytest
from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import dsa, ec, ed25519, rsa

from ddsi.structure.errors import ConfigurationError
from ddsi_security.authentication.algorithms import EC_P256, EC_P384, RSA_2048
from ddsi_security.authentication.certificate import Certificate, pem_blocks
from ddsi_security.authentication.identity_material import IdentityMaterial, read_identity_material
from ddsi_security.authentication.not_trusted import NotTrusted
from ddsi_security.authentication.private_key import read_private_key
from ddsi_security.authentication.signatures import verify

from .material import (
    DAY_S,
    KEYSTORE_RSA,
    NOW_S,
    SECOND,
    Issued,
    at,
    authority,
    ec_key,
    identity,
    issue,
    key_pem,
    properties,
    rsa_key,
)

NOW = NOW_S * SECOND
ALICE = identity("alice")
CA_USAGE = {
    **dict.fromkeys(("content_commitment", "key_encipherment", "data_encipherment", "key_agreement"), False),
    **dict.fromkeys(("encipher_only", "decipher_only", "crl_sign"), False),
}


def read(settings: dict[str, str]) -> IdentityMaterial:
    return read_identity_material(settings, NOW)


def refusal(settings: dict[str, str]) -> str:
    with pytest.raises(ConfigurationError) as caught:
        read(settings)
    return str(caught.value)


def key_usage(*, sign: bool = False, certify: bool = False) -> x509.KeyUsage:
    return x509.KeyUsage(digital_signature=sign, key_cert_sign=certify, **CA_USAGE)


# --- what is accepted -----------------------------------------------------------------------------------------


@pytest.mark.parametrize(("kind", "algorithm"), [("EC", EC_P256), ("RSA", RSA_2048), ("EC-384", EC_P384)])
@pytest.mark.parametrize("ca", ["EC", "RSA"])
def test_identities_and_authorities_of_each_kind(kind: str, algorithm: object, ca: str) -> None:
    signer = authority(ca)
    material = read(properties(identity("alice", kind, signer), signer))
    assert material.certificate.algorithm is algorithm
    assert material.authority.algorithm is (RSA_2048 if ca == "RSA" else EC_P256)
    assert material.certificate.subject == "CN=alice,O=Peers"


def test_an_rsa_key_of_3072_bits_is_called_and_signs_as_one_of_2048() -> None:
    key = rsa.generate_private_key(65537, 3072)
    ca = issue("CN=ca", key)
    material = read(properties(issue("CN=alice", key, ca), ca))
    assert material.certificate.algorithm is material.authority.algorithm is RSA_2048
    verify(material.certificate.public_key, material.key.sign(b"content"), b"content")


def test_files_with_text_and_several_authorities(tmp_path: Path) -> None:
    other = authority(name="CN=other_ca")
    (tmp_path / "ca.pem").write_text(f"Subject: whatever\n\n{other.pem}\nand\n{authority().pem}")
    (tmp_path / "cert.pem").write_text(f"Certificate:\n    Data: ...\n{ALICE.pem}")
    (tmp_path / "key.pem").write_bytes(
        ALICE.key.private_bytes(
            serialization.Encoding.PEM,
            serialization.PrivateFormat.TraditionalOpenSSL,
            serialization.NoEncryption(),
        )
    )
    material = read(
        {
            "dds.sec.auth.identity_ca": f"file:{tmp_path}/ca.pem",
            "dds.sec.auth.identity_certificate": f"file://{tmp_path}/cert.pem",
            "dds.sec.auth.private_key": f"file:{tmp_path}/key.pem",
        }
    )
    assert [each.subject for each in material.anchors.authorities] == ["CN=other_ca", "CN=identity_ca,O=Tests"]
    assert material.authority.subject == "CN=identity_ca,O=Tests"
    assert material.certificate.pem == ALICE.pem.encode(), "nothing of the text around it goes to peers"


def test_the_authority_may_itself_be_an_intermediate_one() -> None:
    intermediate = issue(
        "CN=intermediate",
        ec_key("intermediate"),
        authority(),
        extensions=[
            (x509.BasicConstraints(ca=True, path_length=0), True),
            (key_usage(certify=True), True),
        ],
    )
    owner = identity("alice", "EC", intermediate)
    assert read(properties(owner, intermediate)).authority.subject == "CN=intermediate"
    reason = refusal(properties(owner, authority()))
    assert "issued by CN=intermediate, which is none of the identity CAs (CN=identity_ca,O=Tests)" in reason
    assert "further intermediate CAs are not supported" in reason


def test_an_authority_of_version_1_says_nothing_of_itself_and_is_believed() -> None:
    plain = issue("CN=plain", ec_key("plain"))
    assert read(properties(identity("alice", "EC", plain), plain))


def test_two_authorities_of_one_name_are_told_apart_by_their_keys() -> None:
    first, second = (issue("CN=twin", ec_key(f"twin {number}")) for number in (1, 2))
    settings = properties(identity("alice", "EC", second), first)
    assert "names CN=twin as its issuer, whose signature it does not bear" in refusal(settings)
    settings["dds.sec.auth.identity_ca"] = f"data:,{first.pem}{second.pem}"
    assert read(settings).authority.parsed == second.certificate


@pytest.mark.parametrize("kind", ["EC", "RSA"])
@pytest.mark.parametrize("given", ["passphrase", "base64"])
@pytest.mark.parametrize("form", [serialization.PrivateFormat.PKCS8, serialization.PrivateFormat.TraditionalOpenSSL])
def test_encrypted_keys(kind: str, given: str, form: serialization.PrivateFormat) -> None:
    owner = identity("alice", kind)
    pem = owner.key.private_bytes(
        serialization.Encoding.PEM,
        form,
        serialization.BestAvailableEncryption(b"open sesame"),
    )
    password = "open sesame" if given == "passphrase" else base64.b64encode(b"open sesame").decode()
    settings = properties(owner) | {"dds.sec.auth.private_key": f"data:,{pem.decode()}"}
    assert read({**settings, "dds.sec.auth.password": password})
    assert "it is encrypted: give its passphrase in dds.sec.auth.password" in refusal(settings)
    wrong = refusal({**settings, "dds.sec.auth.password": "open barley"})
    assert "does not decrypt it" in wrong
    assert "barley" not in wrong


def test_a_password_for_a_key_that_needs_none_is_no_mistake() -> None:
    assert read(properties(ALICE, password="unused"))


# --- what is refused, and what is said ------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["identity_ca", "identity_certificate", "private_key"])
def test_what_is_missing_is_named(name: str) -> None:
    settings = properties(ALICE)
    del settings[f"dds.sec.auth.{name}"]
    assert f"property dds.sec.auth.{name} is missing" in refusal(settings)
    settings[f"dds.sec.auth.{name}"] = "file:/no/such/file.pem"
    reason = refusal(settings)
    assert f"dds.sec.auth.{name}" in reason
    assert "/no/such/file.pem" in reason


def test_a_key_that_belongs_to_another_certificate(tmp_path: Path) -> None:
    (tmp_path / "key.pem").write_bytes(key_pem(ec_key("somebody else")))
    (tmp_path / "cert.pem").write_text(ALICE.pem)
    settings = properties(ALICE) | {
        "dds.sec.auth.private_key": f"file:{tmp_path}/key.pem",
        "dds.sec.auth.identity_certificate": f"file:{tmp_path}/cert.pem",
    }
    reason = refusal(settings)
    assert (
        f"the private key dds.sec.auth.private_key file:{tmp_path}/key.pem does not belong to the certificate" in reason
    )
    assert f"dds.sec.auth.identity_certificate file:{tmp_path}/cert.pem" in reason
    settings["dds.sec.auth.private_key"] = f"data:,{key_pem(rsa_key('bob')).decode()}"
    reason = refusal(settings)
    assert "the data: URI does not belong to the certificate" in reason
    assert "PRIVATE KEY" not in reason


def test_the_line_of_a_damaged_certificate_is_named(tmp_path: Path) -> None:
    damaged = ALICE.pem.splitlines()
    damaged[3] = damaged[3][::-1]
    (tmp_path / "ca.pem").write_text("\n".join(["# two", *authority().pem.splitlines(), "", *damaged]))
    line = 1 + 1 + len(authority().pem.splitlines()) + 1
    reason = refusal(properties(ALICE) | {"dds.sec.auth.identity_ca": f"file:{tmp_path}/ca.pem"})
    assert f"property dds.sec.auth.identity_ca: {tmp_path}/ca.pem, line {line}: it is no X.509 certificate" in reason


def test_a_certificate_that_is_something_else() -> None:
    for name in ("identity_ca", "identity_certificate"):
        settings = properties(ALICE) | {f"dds.sec.auth.{name}": f"data:,{ALICE.key_pem}"}
        reason = refusal(settings)
        assert f"property dds.sec.auth.{name}: there is no certificate in the data: URI" in reason
        assert "PRIVATE" not in reason
    assert "no private key in PEM" in refusal(properties(ALICE) | {"dds.sec.auth.private_key": f"data:,{ALICE.pem}"})


@pytest.mark.parametrize(
    ("make", "name"),
    [
        (lambda: rsa.generate_private_key(65537, 1024), "RSA 1024"),
        (lambda: ec_key("x", ec.SECP521R1()), "EC secp521r1"),
        (lambda: ec_key("x", ec.SECP256K1()), "EC secp256k1"),
        (ed25519.Ed25519PrivateKey.generate, "Ed25519"),
    ],
)
def test_other_keys_are_refused_by_their_name(make: Callable[[], ec.EllipticCurvePrivateKey], name: str) -> None:
    key = make()
    owner = issue("CN=alice", ec_key("placeholder"))
    builder = (
        x509.CertificateBuilder()
        .subject_name(owner.certificate.subject)
        .issuer_name(authority().certificate.subject)
        .public_key(key.public_key())
        .serial_number(1)
        .not_valid_before(at(NOW_S - 1))
        .not_valid_after(at(NOW_S + 1))
    )
    certificate = builder.sign(authority().key, hashes.SHA256())
    with pytest.raises(NotTrusted, match=f"its key is {name}, and only RSA of 2048 to 4096 bits"):
        Certificate.from_pem(certificate.public_bytes(serialization.Encoding.PEM))
    with pytest.raises(NotTrusted, match=f"its key is {name}"):
        read_private_key(
            key.private_bytes(
                serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, serialization.NoEncryption()
            ),
            None,
        )


@pytest.mark.parametrize(
    ("owner", "reason"),
    [
        (lambda: identity_with(not_after=NOW_S - 1), "expired at 2027-01-15T08:00:00Z"),
        (lambda: identity_with(not_before=NOW_S + 1), "is valid only from 2027-01-15T08:00:01Z on"),
        (lambda: identity_with(extensions=[(key_usage(certify=True), True)]), "does not allow digital signatures"),
        (
            lambda: identity_with(
                extensions=[(x509.UnrecognizedExtension(x509.ObjectIdentifier("1.2.3"), b"x"), True)]
            ),
            "extension 1.2.3 is critical and not supported",
        ),
    ],
)
def test_certificates_that_do_not_serve(owner: Callable[[], Issued], reason: str) -> None:
    said = refusal(properties(owner()))
    assert reason in said
    assert "dds.sec.auth.identity_certificate" in said


@pytest.mark.parametrize(("octet", "name"), [(b"\x05", "SHA-1"), (b"\x04", "MD5")])
def test_certificates_that_broken_hashes_hold_together(octet: bytes, name: str) -> None:
    """The names of the algorithms differ in their last octet; the signature is not looked at any more."""
    rsa_with = bytes.fromhex("2a864886f70d0101")
    der = Certificate.from_pem(identity("alice", "EC", authority("RSA")).pem.encode()).der
    assert der.count(rsa_with + b"\x0b") == 2
    with pytest.raises(NotTrusted, match=f"signed with {name}, which is broken"):
        Certificate.from_der(der.replace(rsa_with + b"\x0b", rsa_with + octet))


@pytest.mark.parametrize(("digest", "is_broken"), [("sha1", True), ("sha256", False)])
def test_a_broken_hash_is_found_in_the_parameters_of_pss(digest: str, is_broken: bool) -> None:
    """There the algorithm's name does not tell it.  The library makes no such certificate any more, openssl does."""
    command = [
        "openssl",
        "req",
        "-x509",
        "-new",
        "-key",
        str(KEYSTORE_RSA / "carol.key"),
        f"-{digest}",
        "-subj",
        "/CN=ca",
    ]
    pem = subprocess.run([*command, "-sigopt", "rsa_padding_mode:pss"], check=True, capture_output=True).stdout
    with pytest.raises(NotTrusted, match="signed with SHA-1, which is broken") if is_broken else nullcontext():
        assert Certificate.from_pem(pem).algorithm is RSA_2048


def identity_with(**changes: object) -> Issued:
    return issue("CN=alice", ec_key("alice"), authority(), **changes)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"not_after": NOW_S - 1}, "the certificate of CN=ca expired"),
        ({"extensions": [(x509.BasicConstraints(ca=False, path_length=None), True)]}, "not one of an authority"),
        ({"extensions": [(key_usage(sign=True), True)]}, "not one of an authority"),
    ],
)
def test_authorities_that_do_not_serve(changes: dict[str, object], reason: str) -> None:
    ca = issue("CN=ca", ec_key("ca"), **changes)  # type: ignore[arg-type]
    assert reason in refusal(properties(identity("alice", "EC", ca), ca))


def test_the_last_second_of_a_validity_is_part_of_it() -> None:
    owner = identity_with(not_after=NOW_S)
    assert read(properties(owner))
    with pytest.raises(ConfigurationError, match="expired"):
        read_identity_material(properties(owner), NOW + SECOND)


# --- revocation -----------------------------------------------------------------------------------------------


def crl(ca: Issued, *serials: int, next_update: int = NOW_S + DAY_S, critical: bool = False) -> str:
    builder = (
        x509.CertificateRevocationListBuilder()
        .issuer_name(ca.certificate.subject)
        .last_update(at(NOW_S - DAY_S))
        .next_update(at(next_update))
    )
    for serial in serials:
        revoked = x509.RevokedCertificateBuilder().serial_number(serial).revocation_date(at(NOW_S - 5))
        builder = builder.add_revoked_certificate(revoked.build())
    if critical:
        builder = builder.add_extension(x509.DeltaCRLIndicator(1), critical=True)
    assert not isinstance(ca.key, dsa.DSAPrivateKey)
    return builder.sign(ca.key, hashes.SHA256()).public_bytes(serialization.Encoding.PEM).decode()


def test_revoked_serials_are_refused_and_others_are_not() -> None:
    serial = ALICE.certificate.serial_number
    assert read(properties(ALICE, crl=f"data:,{crl(authority(), serial + 1)}"))
    reason = refusal(properties(ALICE, crl=f"data:,{crl(authority(), 7, serial)}"))
    assert "the certificate of CN=alice,O=Peers is revoked by CN=identity_ca,O=Tests" in reason


@pytest.mark.parametrize(
    ("make", "reason"),
    [
        (lambda: crl(issue("CN=identity_ca,O=Tests", ec_key("impostor"))), "signed by none of the identity CAs"),
        (lambda: crl(authority(name="CN=other")), "signed by none of the identity CAs"),
        (lambda: crl(authority(), next_update=NOW_S), "out of date since 2027-01-15T08:00:00Z"),
        (lambda: crl(authority(), critical=True), "is critical and not supported"),
        (lambda: "nothing", "there is no certificate revocation list in the data: URI"),
        (lambda: "-----BEGIN X509 CRL-----\nAAAA\n-----END X509 CRL-----", "line 1: it cannot be read"),
    ],
)
def test_revocation_lists_that_do_not_serve(make: Callable[[], str], reason: str) -> None:
    assert reason in refusal(properties(ALICE, crl=f"data:,{make()}"))


def test_with_revocation_lists_each_authority_needs_one() -> None:
    other = authority(name="CN=other")
    settings = properties(identity("alice", "EC", other), other, crl=f"data:,{crl(authority())}")
    settings["dds.sec.auth.identity_ca"] += authority().pem
    assert "there is no certificate revocation list of CN=other" in refusal(settings)


def test_an_empty_revocation_list_property_means_none() -> None:
    assert read(properties(ALICE, crl=""))


# --- a directory of trusted authorities -----------------------------------------------------------------------


def test_a_directory_says_whom_else_to_believe(tmp_path: Path) -> None:
    other = authority(name="CN=other")
    (tmp_path / "a.pem").write_text(other.pem)
    (tmp_path / "README").write_text("no certificate")
    (tmp_path / "empty").touch()
    reason = refusal(properties(ALICE, trusted_ca_dir=str(tmp_path)))
    assert f"our own identity CA is not in {tmp_path}" in reason
    (tmp_path / "b.pem").write_text(authority().pem)
    for directory in (str(tmp_path), f"file:{tmp_path}", f"file://{tmp_path}"):
        material = read(properties(ALICE, trusted_ca_dir=directory))
        assert [each.subject for each in material.anchors.authorities] == ["CN=other", "CN=identity_ca,O=Tests"]
        stranger = Certificate.from_pem(identity("bob", "EC", other).pem.encode())
        assert material.anchors.verify(stranger, NOW).subject == "CN=other"


def test_a_directory_that_does_not_serve(tmp_path: Path) -> None:
    assert "cannot read the directory" in refusal(properties(ALICE, trusted_ca_dir=f"{tmp_path}/missing"))
    reason = refusal(properties(ALICE, trusted_ca_dir=str(tmp_path), crl=f"data:,{crl(authority())}"))
    assert "exclude each other" in reason
    (tmp_path / "ca.pem").write_text("-----BEGIN CERTIFICATE-----\nAAAA\n-----END CERTIFICATE-----")
    reason = refusal(properties(ALICE, trusted_ca_dir=str(tmp_path)))
    assert f"{tmp_path}/ca.pem, line 1: it is no X.509 certificate" in reason


def test_our_own_certificate_must_come_from_our_own_authority(tmp_path: Path) -> None:
    other = authority(name="CN=other")
    (tmp_path / "a.pem").write_text(other.pem + authority().pem)
    settings = properties(identity("alice", "EC", other), authority(), trusted_ca_dir=str(tmp_path))
    assert "issued by CN=other, which is none of the identity CAs" in refusal(settings)


def test_blocks_are_found_with_their_lines() -> None:
    text = b"a\n-----BEGIN X-----\nb\n-----END X-----\n\n-----BEGIN Y-----\n-----END Y-----\n-----BEGIN X-----"
    assert [line for line, _ in pem_blocks(text, "X")] == [2]
    assert [line for line, _ in pem_blocks(text, "Y")] == [6]
    assert [line for line, _ in pem_blocks(text.replace(b"Y", b"X"), "X")] == [2, 6]


def test_times_are_compared_in_utc() -> None:
    certificate = Certificate.from_pem(ALICE.pem.encode())
    expected = datetime.datetime.fromtimestamp(NOW_S + DAY_S, datetime.UTC)
    assert certificate.parsed.not_valid_after_utc == expected
    assert certificate.valid_until == (NOW_S + DAY_S + 1) * SECOND
