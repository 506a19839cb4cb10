"""``ddsi keystore enclave`` and ``check`` on keystores that openssl commands or ROS 2's tools made."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from ddsi_security.keystore.certificate import certificate_pem, certificate_validity, parse_certificate
from ddsi_security.keystore.horizon import Horizon
from ddsi_security.keystore.key_pair import private_key_pem
from ddsi_security.keystore.linter import check_keystore
from ddsi_security.keystore.survey import find_enclaves

from .keystores import ALICE, NOW, Shell, Workshop, openssl


def openssl_keystore(folder: Path, algorithm: str = "ec") -> Path:
    """As its manual pages and tutorials make one: all in a folder, with names that somebody liked."""
    folder.mkdir()
    options = {"ec": ("EC", "-pkeyopt", "ec_paramgen_curve:P-256"), "rsa": ("RSA", "-pkeyopt", "rsa_keygen_bits:2048")}

    def key(name: str) -> Path:
        openssl("genpkey", "-algorithm", *options[algorithm], "-out", folder / name)
        return folder / name

    def authority(name: str) -> None:
        openssl(
            *("req", "-x509", "-new", "-key", key(f"{name}.key"), "-out", folder / f"{name}.pem", "-days", 3650),
            *("-sha256", "-subj", f"/O=Peers/CN={name}", "-addext", "basicConstraints=critical,CA:TRUE"),
        )

    authority("identity_ca")
    authority("permissions_ca")
    for name in ("alice", "bob"):
        openssl("req", "-new", "-key", key(f"{name}.key"), "-out", folder / "csr", "-subj", f"/O=Peers/CN={name}")
        ca = ("-CA", folder / "identity_ca.pem", "-CAkey", folder / "identity_ca.key", "-CAcreateserial")
        openssl("x509", "-req", "-in", folder / "csr", *ca, "-out", folder / f"{name}.pem", "-days", 3650, "-sha256")
        subject = openssl("x509", "-in", folder / f"{name}.pem", "-noout", "-subject", "-nameopt", "RFC2253")
        workshop = Workshop(folder)
        workshop.replace("permissions", (ALICE, subject.strip().removeprefix("subject=")))
        workshop.replace("permissions", ("<not_after>2029", "<not_after>2099"))
        (folder / f"{name}.permissions.xml").write_text(workshop.permissions)
        (folder / "governance.xml").write_text(workshop.governance)
    for document in ("alice.permissions", "bob.permissions", "governance"):
        signer = ("-signer", folder / "permissions_ca.pem", "-inkey", folder / "permissions_ca.key")
        files = ("-in", folder / f"{document}.xml", "-out", folder / f"{document}.p7s")
        openssl("smime", "-sign", "-text", *files, *signer)
    return folder


def horizon_of(folder: Path) -> Horizon:
    """openssl certifies from this moment on, whatever the test thinks the time is."""
    begin = certificate_validity(parse_certificate((folder / "bob.pem").read_bytes(), "")).not_before
    return Horizon.of_days(int(begin.timestamp()) * 1_000_000_000, 30)


@pytest.mark.parametrize("algorithm", ["ec", pytest.param("rsa", marks=pytest.mark.slow)])
def test_a_keystore_of_openssl_commands_has_nothing_to_find(tmp_path: Path, algorithm: str) -> None:
    folder = openssl_keystore(tmp_path / "ks", algorithm)
    assert [str(finding) for finding in check_keystore(folder, horizon_of(folder))] == []
    alice, bob = find_enclaves(folder)
    assert (alice.name, alice.certificate, alice.private_key, alice.permissions) == (
        "alice", folder / "alice.pem", folder / "alice.key", folder / "alice.permissions.p7s",
    )  # fmt: skip
    assert (bob.identity_ca, bob.permissions_ca, bob.governance) == (
        folder / "identity_ca.pem", folder / "permissions_ca.pem", folder / "governance.p7s",
    )  # fmt: skip


def test_a_key_is_known_by_what_it_is_not_by_its_name(tmp_path: Path) -> None:
    """A name says whose it should be only where no key fits."""
    folder = openssl_keystore(tmp_path / "ks")
    (folder / "alice.key").rename(folder / "secret")
    assert [str(finding) for finding in check_keystore(folder, horizon_of(folder))] == []
    shutil.copy(folder / "identity_ca.key", folder / "alice_key.pem")
    (folder / "secret").unlink()
    (finding,) = check_keystore(folder, horizon_of(folder))
    assert (finding.rule.id, finding.path.name) == ("key-mismatch", "alice_key.pem")


def test_an_identity_is_added_to_a_keystore_of_openssl(shell: Shell, tmp_path: Path) -> None:
    folder = openssl_keystore(tmp_path / "ks")
    shell.now = horizon_of(folder).now
    shell.make("enclave", folder, "dora", "--subject", "/O=Peers/CN={name}", "--domain", "7", "--topic", "Square")
    dora = folder / "enclaves/dora"
    assert check_keystore(dora, horizon_of(folder)) == []
    assert (dora / "governance.p7s").samefile(folder / "governance.p7s")
    openssl("verify", "-no_check_time", "-CAfile", dora / "identity_ca.cert.pem", dora / "cert.pem")
    signer = dora / "permissions_ca.cert.pem"
    text = openssl("smime", "-verify", "-text", "-no_check_time", "-in", dora / "permissions.p7s", "-CAfile", signer)
    assert "<subject_name>CN=dora,O=Peers</subject_name>" in text


def ros_keystore(folder: Path) -> Path:
    """As ROS 2's tools make one: a single authority under several names, modes as the umask has it."""
    workshop = Workshop(folder)
    enclave = folder / "enclaves/talker_listener/talker"
    for path in (enclave, folder / "public", folder / "private"):
        path.mkdir(parents=True)
    ca = workshop.identity_ca
    (folder / "public/ca.cert.pem").write_bytes(certificate_pem(ca.certificate))
    (folder / "private/ca.key.pem").write_bytes(private_key_pem(ca.private_key))
    for name in ("identity_ca", "permissions_ca"):
        (folder / f"public/{name}.cert.pem").symlink_to("ca.cert.pem")
        (folder / f"private/{name}.key.pem").symlink_to("ca.key.pem")
        (enclave / f"{name}.cert.pem").symlink_to(f"../../../public/{name}.cert.pem")
    (folder / "enclaves/governance.xml").write_text(workshop.governance)
    (folder / "enclaves/governance.p7s").write_bytes(ca.sign_document(workshop.governance.encode()))
    (enclave / "governance.p7s").symlink_to("../../governance.p7s")
    identity = workshop.make_identity("/CN=/talker_listener/talker")
    workshop.replace("permissions", (ALICE, "CN=/talker_listener/talker"))
    (enclave / "cert.pem").write_bytes(certificate_pem(identity.certificate))
    (enclave / "key.pem").write_bytes(private_key_pem(identity.private_key))
    (enclave / "permissions.xml").write_text(workshop.permissions)
    (enclave / "permissions.p7s").write_bytes(ca.sign_document(workshop.permissions.encode()))
    return folder


def test_a_keystore_of_ros_2_is_read_and_its_open_keys_are_found(tmp_path: Path) -> None:
    folder = ros_keystore(tmp_path / "ks")
    for path in folder.rglob("*key.pem"):
        path.chmod(0o644)
    found = {(finding.rule.id, finding.path) for finding in check_keystore(folder, Horizon.of_days(NOW, 30))}
    assert found == {
        ("shared-ca", folder / "public/ca.cert.pem"),
        ("key-exposed", folder / "enclaves/talker_listener/talker/key.pem"),
        ("key-exposed", folder / "private/ca.key.pem"),
    }
    for path in folder.rglob("*key.pem"):
        path.chmod(0o600)
    found = {(finding.rule.id, finding.path) for finding in check_keystore(folder, Horizon.of_days(NOW, 30))}
    assert found == {("shared-ca", folder / "public/ca.cert.pem")}


def test_an_identity_is_added_to_a_keystore_of_ros_2(shell: Shell, tmp_path: Path) -> None:
    folder = ros_keystore(tmp_path / "ks")
    for path in folder.rglob("*key.pem"):
        path.chmod(0o600)
    shell.make("enclave", folder, "/talker_listener/listener")
    assert [enclave.name for enclave in find_enclaves(folder)] == ["talker_listener/listener", "talker_listener/talker"]
    assert {finding.rule.id for finding in check_keystore(folder, Horizon.of_days(NOW, 30))} == {"shared-ca"}
    said = shell.refused("enclave", folder, "/talker_listener/listener")
    assert "would be overwritten" in said


def test_documents_of_a_keystore_are_made_anew_with_its_own_authority(shell: Shell, tmp_path: Path) -> None:
    alice = shell.create(tmp_path)
    governance = tmp_path / "enclaves/governance.p7s"
    shell.make("governance", governance, "--keystore", tmp_path, "--rtps", "NONE", "--force")
    assert b"<rtps_protection_kind>NONE<" in (alice / "governance.p7s").read_bytes()
    assert check_keystore(tmp_path, Horizon.of_days(NOW, 30)) == []


def test_what_a_keystore_lacks_is_named(shell: Shell, tmp_path: Path) -> None:
    assert f"{tmp_path} holds no identity CA with its key" in shell.refused("enclave", tmp_path, "alice")
    shell.make("ca", tmp_path / "ca.pem", tmp_path / "ca.key", "--subject", "/CN=CA")
    said = shell.refused("enclave", tmp_path, "alice")
    signed = tmp_path / "enclaves/governance.p7s"
    assert f"make it with `ddsi keystore governance {signed} --keystore {tmp_path}`" in said
    shell.make("governance", signed, "--keystore", tmp_path)
    shell.make("enclave", tmp_path, "alice")
    assert {finding.rule.id for finding in check_keystore(tmp_path, Horizon.of_days(NOW, 30))} == {"shared-ca"}


def test_an_authority_for_one_purpose_does_not_stand_in_for_the_other(shell: Shell, tmp_path: Path) -> None:
    """Where whoever issues identities does not have the key of whoever signs permissions, and the other way round."""
    shell.make("create", tmp_path, "--identity", "alice")
    (tmp_path / "private/identity_ca.key.pem").unlink()
    assert "holds no identity CA with its key" in shell.refused("enclave", tmp_path, "bob")
    shell.make("governance", tmp_path / "g.p7s", "--keystore", tmp_path)
    (tmp_path / "private/permissions_ca.key.pem").unlink()
    assert "holds no permissions CA with its key" in shell.refused(
        "governance", tmp_path / "h.p7s", "--keystore", tmp_path
    )
