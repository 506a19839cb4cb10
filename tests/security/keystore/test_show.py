"""``ddsi keystore show``: what files hold, never what is secret in them."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from .keystores import ALICE, Shell, Workshop, openssl


def shown(shell: Shell, *paths: Path) -> list[dict[str, object]]:
    assert shell.run("keystore", "show", *paths, "--json") == 0, shell.err
    portraits: list[dict[str, object]] = json.loads(shell.out)
    return portraits


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return Workshop(tmp_path / "alice").write()


def test_a_certificate_as_openssl_shows_it(shell: Shell, folder: Path) -> None:
    (portrait,) = shown(shell, folder / "cert.pem")
    said = openssl("x509", "-in", folder / "cert.pem", "-noout", "-serial", "-fingerprint", "-sha256")
    assert f"serial={int(str(portrait['serial_number']), 16):040X}\n" in said
    assert str(portrait["sha256"]).upper() in said.replace(":", "")
    assert portrait["subject"] == ALICE
    assert portrait["issued_by"] == "identity_ca.cert.pem"
    assert (portrait["not_before"], portrait["not_after"]) == ("2026-06-30T12:00:00Z", "2029-03-27T12:00:00Z")
    assert (portrait["algorithm"], portrait["signed_with"], portrait["authority"]) == ("EC P-256", "SHA256", False)


def test_who_starts_a_handshake_can_be_read_from_two_certificates(shell: Shell, tmp_path: Path) -> None:
    """What Cyclone DDS and Fast DDS announce for these two subjects (DDS-Security 1.1 §9.3.3)."""
    workshop = Workshop(tmp_path / "ks")
    begins = []
    for name in ("alice", "bob"):
        workshop.identity = workshop.make_identity(f"/O=Peers/CN={name}")
        begins.append(shown(shell, workshop.write() / "cert.pem")[0]["guid_begins"])
    assert begins == ["8504d3a1f5c5", "c7bf8262d0e5"]


def test_a_key_tells_only_what_its_public_half_says(shell: Shell, folder: Path) -> None:
    (portrait,) = shown(shell, folder / "key.pem")
    assert portrait == {
        "file": str(folder / "key.pem"),
        "kind": "private key",
        "algorithm": "EC P-256",
        "password": False,
        "fits": ["cert.pem"],
        "mode": "0600",
    }
    secret = "".join((folder / "key.pem").read_text().splitlines()[1:-1])
    assert secret[:20] not in shell.out


def test_documents_with_who_signed_them_and_where_each_rule_stands(shell: Shell, folder: Path) -> None:
    governance, permissions = shown(shell, folder / "governance.p7s", folder / "permissions.p7s")
    assert governance["signature"] == permissions["signature"] == "by permissions_ca.cert.pem"
    (rule,) = _list(governance, "domain_rules")
    assert rule["domains"] == "0 to 230"
    assert rule["rtps_protection_kind"] == "SIGN"
    assert "<domain_rule>" in (folder / "governance.p7s").read_text().splitlines()[_int(rule, "line") - 1]
    (grant,) = _list(permissions, "grants")
    assert (grant["subject"], grant["default"]) == (ALICE, "deny")
    (allow,) = _list(grant, "rules")
    publish, subscribe = _list(allow, "criteria")
    assert (publish["action"], publish["topics"]) == ("publish", ["Square", "Circle"])
    assert "<subscribe>" in (folder / "permissions.p7s").read_text().splitlines()[_int(subscribe, "line") - 1]


def _list(value: dict[str, object], name: str) -> list[dict[str, object]]:
    found = value[name]
    assert isinstance(found, list)
    return found


def _int(value: dict[str, object], name: str) -> int:
    found = value[name]
    assert isinstance(found, int)
    return found


def test_an_unsigned_or_foreign_document_is_shown_and_said_to_be_so(shell: Shell, tmp_path: Path) -> None:
    workshop = Workshop(tmp_path / "alice")
    folder = workshop.write()
    workshop.file("governance.p7s", workshop.authority("Stranger").sign_document(workshop.governance.encode()))
    workshop.file("other.xml", workshop.governance.encode())
    foreign, unsigned = shown(shell, folder / "governance.p7s", folder / "other.xml")
    assert foreign["signature"] == "not by an authority beside it"
    assert unsigned["signature"] == "none"
    assert len(_list(foreign, "domain_rules")) == len(_list(unsigned, "domain_rules")) == 1


def test_a_folder_shows_all_that_it_holds(shell: Shell, folder: Path) -> None:
    kinds = {Path(str(one["file"])).name: one["kind"] for one in shown(shell, folder)}
    assert kinds == {
        "cert.pem": "certificate",
        "governance.p7s": "governance",
        "identity_ca.cert.pem": "certificate",
        "key.pem": "private key",
        "permissions.p7s": "permissions",
        "permissions_ca.cert.pem": "certificate",
    }


def test_the_text_for_people(shell: Shell, folder: Path) -> None:
    said = shell.make("show", folder / "cert.pem", folder / "permissions.p7s")
    first, second = said.split("\n\n")
    assert first.startswith(f"{folder}/cert.pem: certificate\n  subject        {ALICE}\n")
    assert "  authority      no\n" in first
    assert "\n        topics      Square, Circle\n" in second
    assert "\n        data tags   -\n" in second


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"hello", "is no certificate, private key, governance or permissions document"),
        (b"<dds><permissions><grant/></permissions></dds>", "line 1"),
        (b"Content-Type: multipart/signed\n\n<permissions> <dds", "hides its text in its signature"),
        (bytes(1 << 20) + b"x", "has more than 1048576 octets"),
    ],
)
def test_what_it_cannot_show_is_a_sentence(shell: Shell, tmp_path: Path, content: bytes, said: str) -> None:
    (tmp_path / "file").write_bytes(content)
    assert said in shell.refused("show", tmp_path / "file")


def test_a_folder_of_other_things_is_a_sentence(shell: Shell, tmp_path: Path) -> None:
    assert "holds no certificate, key or document" in shell.refused("show", tmp_path)
