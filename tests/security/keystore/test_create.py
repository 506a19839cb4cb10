"""``ddsi keystore create``: a working set in one command, which openssl accepts and others cannot read."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from cryptography import x509

from .keystores import Shell, openssl

ENCLAVE = {
    "identity_ca.cert.pem",
    "cert.pem",
    "key.pem",
    "permissions_ca.cert.pem",
    "governance.p7s",
    "permissions.p7s",
    "permissions.xml",
}


def mode(path: Path) -> int:
    return path.stat().st_mode & 0o777


def test_an_enclave_has_the_files_that_ros_2_and_ddsi_secure_look_for(shell: Shell, tmp_path: Path) -> None:
    shell.make("create", tmp_path / "ks", "--identity", "alice", "--identity", "/robot/arm")
    for folder in (tmp_path / "ks/enclaves/alice", tmp_path / "ks/enclaves/robot/arm"):
        assert {path.name for path in folder.iterdir()} == ENCLAVE
        assert all(path.read_bytes() for path in folder.iterdir())
    for name in ("identity_ca", "permissions_ca"):  # what ROS 2's tools call a valid keystore
        assert (tmp_path / f"ks/public/{name}.cert.pem").is_file()
        assert (tmp_path / f"ks/private/{name}.key.pem").is_file()
    assert (tmp_path / "ks/enclaves/governance.p7s").is_file()


def test_links_are_relative_so_that_a_keystore_may_move(shell: Shell, tmp_path: Path) -> None:
    shell.create(tmp_path / "ks")
    (tmp_path / "ks").rename(tmp_path / "elsewhere")
    folder = tmp_path / "elsewhere/enclaves/alice"
    links = {path.name for path in folder.iterdir() if path.is_symlink()}
    assert links == {"identity_ca.cert.pem", "permissions_ca.cert.pem", "governance.p7s"}
    assert all((folder / name).read_bytes() for name in links)


@pytest.mark.parametrize("algorithm", ["EC", "EC-P384", "RSA"])
def test_openssl_accepts_certificates_and_documents(shell: Shell, tmp_path: Path, algorithm: str) -> None:
    folder = shell.create(tmp_path, "--algorithm", algorithm)
    time = ("-no_check_time",)
    openssl("verify", *time, "-x509_strict", "-CAfile", folder / "identity_ca.cert.pem", folder / "cert.pem")
    for name in ("governance", "permissions"):
        ca = folder / "permissions_ca.cert.pem"
        text = openssl("smime", "-verify", *time, "-text", "-in", folder / f"{name}.p7s", "-CAfile", ca)
        source = folder / "permissions.xml" if name == "permissions" else tmp_path / "enclaves/governance.xml"
        assert text.replace("\r\n", "\n").strip() == source.read_text().strip()
    assert openssl("pkey", "-in", folder / "key.pem", "-pubout") == openssl(
        "x509", "-in", folder / "cert.pem", "-noout", "-pubkey"
    )


def test_authorities_are_authorities_of_one_level_and_identities_are_none(shell: Shell, tmp_path: Path) -> None:
    folder = shell.create(tmp_path)
    for name, ca in (("identity_ca.cert.pem", True), ("permissions_ca.cert.pem", True), ("cert.pem", False)):
        certificate = x509.load_pem_x509_certificate((folder / name).read_bytes())
        constraints = certificate.extensions.get_extension_for_class(x509.BasicConstraints)
        usage = certificate.extensions.get_extension_for_class(x509.KeyUsage)
        assert constraints.critical
        assert usage.critical
        assert (constraints.value.ca, constraints.value.path_length) == (ca, 0 if ca else None)
        assert (usage.value.key_cert_sign, usage.value.digital_signature) == (ca, True)
        assert certificate.serial_number.bit_length() > 64
    cas = [(folder / f"{name}_ca.cert.pem").read_bytes() for name in ("identity", "permissions")]
    assert cas[0] != cas[1], "whoever issues identities should not say what they may do"


def test_keys_are_for_their_owner_only_whatever_the_umask(
    shell: Shell, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import os

    before = os.umask(0)
    try:
        folder = shell.create(tmp_path / "ks")
    finally:
        os.umask(before)
    keys = list((tmp_path / "ks").rglob("*key.pem"))
    assert len(keys) == 3
    assert {mode(key) for key in keys} == {0o600}
    assert mode(folder) == mode(tmp_path / "ks/private") == 0o700
    assert mode(folder / "cert.pem") == 0o644


def test_a_key_is_never_readable_by_others_while_it_is_written(
    shell: Shell, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Created so, not changed later."""
    import os

    modes: dict[str, int] = {}
    really_open = os.open

    def watching(path: Path, flags: int, mode: int = 0o777) -> int:
        modes[Path(path).name] = mode
        assert flags & os.O_EXCL
        return really_open(path, flags, mode)

    monkeypatch.setattr(os, "open", watching)
    monkeypatch.setattr(os, "chmod", lambda *_: pytest.fail("too late"))
    shell.create(tmp_path)
    assert modes[".key.pem.new"] == modes[".identity_ca.key.pem.new"] == 0o600


def test_nothing_is_overwritten_unless_it_is_asked_for(shell: Shell, tmp_path: Path) -> None:
    folder = shell.create(tmp_path)
    before = {path: path.read_bytes() for path in tmp_path.rglob("*.p*")}
    said = shell.refused("create", tmp_path, "--identity", "bob")
    assert "ddsi keystore enclave" in said
    assert "--force" in said
    assert {path: path.read_bytes() for path in tmp_path.rglob("*.p*")} == before
    shell.make("create", tmp_path, "--identity", "alice", "--force")
    assert (folder / "key.pem").read_bytes() != before[folder / "key.pem"]
    assert mode(folder / "key.pem") == 0o600


def test_one_file_in_the_way_stops_all_before_anything_is_written(shell: Shell, tmp_path: Path) -> None:
    (tmp_path / "enclaves").mkdir()
    (tmp_path / "enclaves/governance.xml").write_text("mine")
    said = shell.refused("create", tmp_path, "--identity", "alice")
    assert "enclaves/governance.xml would be overwritten" in said
    assert [path.name for path in tmp_path.rglob("*")] == ["enclaves", "governance.xml"]


def test_a_grant_names_its_subject_as_openssl_prints_it(shell: Shell, tmp_path: Path) -> None:
    folder = shell.create(tmp_path, "--subject", "/C=DE/O=Example/OU=Robots/emailAddress=a@b.c/CN={name}")
    printed = openssl("x509", "-in", folder / "cert.pem", "-noout", "-subject", "-nameopt", "RFC2253")
    (named,) = re.findall("<subject_name>(.*)</subject_name>", (folder / "permissions.xml").read_text())
    assert f"subject={named}\n" == printed
    assert named == "CN=alice,emailAddress=a@b.c,OU=Robots,O=Example,C=DE"


def test_validity_is_what_was_asked_for(shell: Shell, tmp_path: Path) -> None:
    folder = shell.create(tmp_path, "--days", 30)
    certificate = x509.load_pem_x509_certificate((folder / "cert.pem").read_bytes())
    assert certificate.not_valid_before_utc.isoformat() == "2026-06-30T12:00:00+00:00", "a day of slack"
    assert certificate.not_valid_after_utc.isoformat() == "2026-07-31T12:00:00+00:00"
    assert "<not_after>2026-07-31T12:00:00</not_after>" in (folder / "permissions.xml").read_text()


def test_domains_kinds_and_rights_come_from_options(shell: Shell, tmp_path: Path) -> None:
    folder = shell.create(
        tmp_path,
        *("--domain", "0,5-9", "--preset", "sign", "--data", "ENCRYPT", "--no-join-control", "--no-read-control"),
        *("--publish", "Square", "--subscribe", "A & B", "--relay", "R*", "--topic", "Both", "--partition", "p?"),
    )
    governance = re.sub(r"\s", "", (tmp_path / "enclaves/governance.xml").read_text())
    assert "<domains><id>0</id><id_range><min>5</min><max>9</max></id_range></domains>" in governance
    assert "<rtps_protection_kind>SIGN<" in governance
    assert "<data_protection_kind>ENCRYPT<" in governance
    assert "<enable_join_access_control>false<" in governance
    assert "<enable_read_access_control>false<" in governance
    assert "<enable_write_access_control>true<" in governance
    permissions = re.sub(r"\s", "", (folder / "permissions.xml").read_text())
    partitions = "<partitions><partition>p?</partition></partitions>"
    assert f"<publish><topics><topic>Both</topic><topic>Square</topic></topics>{partitions}</publish>" in permissions
    assert f"<subscribe><topics><topic>Both</topic><topic>A&amp;B</topic></topics>{partitions}" in permissions
    assert f"<relay><topics><topic>R*</topic></topics>{partitions}</relay>" in permissions
    assert "<id_range><min>5</min><max>9</max></id_range>" in permissions


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--identity", "a", "--identity", "a"], "named twice"),
        (["--identity", "a", "--identity", "b", "--subject", "/CN=x"], "put {name} where the names differ"),
        (["--identity", "../a"], "'../a' cannot be the name of an enclave"),
        (["--identity", ""], "cannot be the name of an enclave"),
        (["--identity", "a", "--subject", "alice"], "write /O=Example/CN=alice, or CN=alice,O=Example"),
        (["--identity", "a", "--subject", "/C=Germany/CN={name}"], "is not the name of a subject"),
        (["--identity", "a", "--days", "0"], "a number from 1 to 36500"),
        (["--identity", "a", "--days", "x"], "a number of days is wanted, not 'x'"),
        (["--identity", "a", "--domain", "233"], "a domain is a number from 0 to 232"),
        (["--identity", "a", "--domain", "5-3"], "the lower first"),
        (["--identity", "a", "--domain", "x"], "domains are numbers and ranges such as 0,5-9, not 'x'"),
        (["--identity", "a", "--allow-unauthenticated"], "choose rtps protection NONE, or do not allow them"),
        (["--identity", "a", "--data", "SIGN_WITH_ORIGIN_AUTHENTICATION"], "invalid choice"),
        ([], "--identity"),
    ],
)
def test_what_cannot_be_is_refused_in_one_sentence_and_nothing_is_written(
    shell: Shell, tmp_path: Path, words: list[str], said: str
) -> None:
    assert said in shell.refused("create", tmp_path / "ks", *words)
    assert not (tmp_path / "ks").exists()
