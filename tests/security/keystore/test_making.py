"""``ddsi keystore ca``, ``identity``, ``governance``, ``permissions``: the parts, one by one, as openssl takes them."""

from __future__ import annotations

from pathlib import Path

import pytest
from cryptography import x509

from ddsi_security.keystore.horizon import Horizon
from ddsi_security.keystore.linter import check_keystore

from .keystores import NOW, Shell, Workshop, openssl


@pytest.fixture
def parts(shell: Shell, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Shell:
    """In a folder with an authority, ca.pem and ca.key."""
    monkeypatch.chdir(tmp_path)
    shell.make("ca", "ca.pem", "ca.key", "--subject", "/O=Example/CN=The CA")
    return shell


def test_parts_made_one_by_one_are_a_keystore(parts: Shell, tmp_path: Path) -> None:
    ca = ("--ca", "ca.pem", "--ca-key", "ca.key")
    parts.make("identity", "cert.pem", "key.pem", "--subject", "CN=alice,O=Example", *ca, "--days", "100")
    parts.make("governance", "governance.p7s", *ca, "--domain", "0-9")
    said = parts.make(
        "permissions", "permissions.p7s", *ca, "--certificate", "cert.pem", "--domain", "3", "--topic", "A"
    )
    assert said == "permissions, signed: permissions.xml, permissions.p7s\n"
    found = check_keystore(tmp_path, Horizon.of_days(NOW, 30))
    assert [finding.rule.id for finding in found] == ["shared-ca"]
    openssl("verify", "-no_check_time", "-CAfile", "ca.pem", "cert.pem")
    openssl("smime", "-verify", "-text", "-no_check_time", "-in", "permissions.p7s", "-CAfile", "ca.pem")
    assert {(tmp_path / key).stat().st_mode & 0o777 for key in ("ca.key", "key.pem")} == {0o600}


def test_a_grant_ends_with_the_certificate(parts: Shell, tmp_path: Path) -> None:
    ca = ("--ca", "ca.pem", "--ca-key", "ca.key")
    parts.make("identity", "cert.pem", "key.pem", "--subject", "/CN=alice", *ca, "--days", "10")
    parts.make(
        "permissions", "p.p7s", *ca, "--certificate", "cert.pem", "--subject", "/O=Example/CN=bob", "--days", "20"
    )
    text = (tmp_path / "p.xml").read_text()
    assert "<subject_name>CN=alice</subject_name>" in text
    assert "<not_after>2026-07-11T12:00:00</not_after>" in text
    assert "<subject_name>CN=bob,O=Example</subject_name>" in text
    assert "<not_after>2026-07-21T12:00:00</not_after>" in text


def test_nothing_outlives_its_authority(shell: Shell, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    shell.make("ca", "ca.pem", "ca.key", "--subject", "/CN=CA", "--days", "5")
    shell.make("identity", "c.pem", "c.key", "--subject", "/CN=a", "--ca", "ca.pem", "--ca-key", "ca.key")
    authority, identity = (x509.load_pem_x509_certificate(Path(name).read_bytes()) for name in ("ca.pem", "c.pem"))
    assert identity.not_valid_after_utc == authority.not_valid_after_utc


def test_a_document_that_somebody_wrote_is_signed_as_it_is(parts: Shell, tmp_path: Path) -> None:
    text = Workshop(tmp_path).governance.replace("SIGN", "NONE")
    (tmp_path / "mine.xml").write_text(text)
    parts.make("governance", "governance.p7s", "--xml", "mine.xml", "--ca", "ca.pem", "--ca-key", "ca.key")
    signed = openssl("smime", "-verify", "-text", "-no_check_time", "-in", "governance.p7s", "-CAfile", "ca.pem")
    assert signed.split() == text.split()
    assert not (tmp_path / "governance.xml").exists()


def test_keys_may_have_a_password(parts: Shell, tmp_path: Path) -> None:
    (tmp_path / "password").write_text("open sesame\nsecond line\n")
    (tmp_path / "wrong").write_text("open barley\n")
    parts.make("ca", "safe.pem", "safe.key", "--subject", "/CN=CA", "--password-file", "password")
    assert "ENCRYPTED" in (tmp_path / "safe.key").read_text()
    ca = ("--ca", "safe.pem", "--ca-key", "safe.key")
    parts.make("governance", "g.p7s", *ca, "--password-file", "password")
    said = parts.refused("governance", "h.p7s", *ca)
    assert "safe.key is protected by a password: give it with --password-file" in said
    said = parts.refused("governance", "h.p7s", *ca, "--password-file", "wrong")
    assert "the password is wrong" in said
    assert "barley" not in said
    parts.make("governance", "h.p7s", "--ca", "ca.pem", "--ca-key", "ca.key", "--password-file", "password")


CA = ("--ca", "ca.pem", "--ca-key", "ca.key")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (
            ["ca", "ca.pem", "new.key", "--subject", "/CN=x"],
            "ca.pem would be overwritten: choose another place, or say",
        ),
        (["governance", "g.p7s"], "which permissions CA? Say --keystore DIR, or both --ca FILE and --ca-key FILE"),
        (["governance", "g.p7s", "--ca", "ca.pem"], "or both --ca FILE and --ca-key FILE"),
        (["governance", "g.p7s", "--ca", "no.pem", "--ca-key", "ca.key"], "no.pem cannot be read: No such file"),
        (
            ["governance", "g.p7s", "--ca", "ca.key", "--ca-key", "ca.key"],
            "cannot be read as a certificate: it must be",
        ),
        (["governance", "g.p7s", "--ca", "ca.pem", "--ca-key", "ca.pem"], "cannot be read as a private key"),
        (["governance", "g.p7s", "--ca", "ca.pem", "--ca-key", "b.key"], "the key does not fit the certificate"),
        (["governance", "g.xml", *CA], "let it end in .p7s"),
        (["governance", "g.p7s", *CA, "--xml", "bad.xml"], "bad.xml, line 1: "),
        (["governance", "g.p7s", *CA, "--xml", "ca.pem"], "ca.pem, line 1: it is not XML"),
        (["governance", "g.p7s", *CA, "--xml", "bad.xml", "--rtps", "NONE"], "leave out the other options, or edit it"),
        (["permissions", "p.p7s", *CA], "whose permissions? Say --certificate FILE or --subject NAME"),
        (["permissions", "p.p7s", *CA, "--xml", "governance.xml"], "it is a governance document, not permissions"),
        (["permissions", "p.p7s", *CA, "--subject", "/CN=a", "--topic", "a\0b"], "it is not XML"),
        (["governance", "g.p7s", *CA, "--keystore", "."], "which permissions CA?"),
        (["governance", "g.p7s", "--keystore", "nowhere"], "nowhere holds no permissions CA with its key"),
    ],
)
def test_what_cannot_be_made_is_refused_in_one_sentence_and_nothing_is_written(
    parts: Shell, tmp_path: Path, words: list[str], said: str
) -> None:
    parts.make("ca", "b.pem", "b.key", "--subject", "/CN=another")
    (tmp_path / "bad.xml").write_text("<dds/>")
    parts.make("governance", "governance.p7s", *CA)
    before = sorted(tmp_path.iterdir())
    refusal = parts.refused(*words)
    assert said in refusal
    assert "PRIVATE KEY" not in refusal
    assert sorted(tmp_path.iterdir()) == before
