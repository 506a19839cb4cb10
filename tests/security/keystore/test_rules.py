"""The rules of ``ddsi keystore check``: each finds what it is for and nothing else, and says where and what to do."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from ddsi_security.keystore.algorithm_rules import (
    check_identity_ca_key,
    check_identity_key,
    check_permissions_ca_key,
    check_signature,
)
from ddsi_security.keystore.authority import Authority
from ddsi_security.keystore.certificate import parse_certificate
from ddsi_security.keystore.finding import Finding
from ddsi_security.keystore.horizon import Horizon
from ddsi_security.keystore.key_pair import Algorithm
from ddsi_security.keystore.linter import RULES, check_keystore

from .keystores import ALICE, NOW, Workshop, openssl
from .spoils import PERMISSIONS_CA, SPOILS, Spoil, add_rule, certificate, section


def check(folder: Path, *, soon_days: int = 30) -> list[Finding]:
    return check_keystore(folder, Horizon.of_days(NOW, soon_days))


def rules_of(findings: list[Finding]) -> set[str]:
    return {finding.rule.id for finding in findings}


@pytest.mark.parametrize(
    ("rule", "spoil", "file", "line"),
    [
        pytest.param(rule, *case, id=f"{rule}-{number}")
        for rule, cases in SPOILS.items()
        for number, case in enumerate(cases)
    ],
)
def test_a_rule_finds_what_it_is_for_and_nothing_else(
    tmp_path: Path, rule: str, spoil: Spoil, file: str, line: str
) -> None:
    workshop = Workshop(tmp_path / "alice")
    spoil(workshop)
    if not workshop.folder.exists():
        workshop.write()
    (finding,) = check(workshop.folder)
    assert finding.rule.id == rule
    assert finding.path == workshop.folder / file
    lines = finding.path.read_text().splitlines() if finding.path.exists() else [""]
    assert line in lines[finding.line - 1]
    assert (finding.line > 1) == bool(line)
    assert_reads_well(finding)


def assert_reads_well(finding: Finding) -> None:
    """File, line, severity, what is wrong, the rule, and what to do about it."""
    said, remedy = str(finding).split("\n    remedy: ")
    assert said.startswith(f"{finding.path}:{finding.line}: {finding.rule.severity}: ")
    assert said.endswith(f" [{finding.rule.id}]")
    assert len(finding.text.split()) >= 4
    assert len(remedy.split()) >= 2
    assert "\n" not in said + remedy
    assert "PRIVATE KEY" not in said + remedy


def test_every_rule_is_tried() -> None:
    assert set(SPOILS) == set(RULES)


def test_a_keystore_in_order_has_nothing_to_find(tmp_path: Path) -> None:
    assert check(Workshop(tmp_path / "alice").write()) == []


NEAR_MISSES: list[Spoil] = []


def near_miss(spoil: Spoil) -> Spoil:
    NEAR_MISSES.append(spoil)
    return spoil


def governance(name: str, *changes: tuple[str, str]) -> None:
    def change(workshop: Workshop) -> None:
        workshop.replace("governance", *changes)

    change.__name__ = name
    near_miss(change)


governance("topics_of_one_character_or_more", ("<topic_expression>*<", "<topic_expression>?*<"))
governance("all_kinds_encrypt", (">SIGN<", ">ENCRYPT<"))
governance("payload_in_clear", ("<data_protection_kind>ENCRYPT", "<data_protection_kind>NONE"))
governance(
    "strangers_but_control",
    ("<allow_unauthenticated_participants>false", "<allow_unauthenticated_participants>true"),
    (">SIGN<", ">NONE<"),
)


@near_miss
def documents_signed_with_rsa(workshop: Workshop) -> None:
    workshop.permissions_ca = workshop.document_signer = workshop.authority("RSA", Algorithm.RSA)


@near_miss
def documents_signed_with_p384(workshop: Workshop) -> None:
    """Vendors take any key of the permissions CA, as long as its certificate is signed with SHA-256."""
    own = workshop.authority("Permissions CA", Algorithm.EC_P384)
    made = certificate(workshop, PERMISSIONS_CA, own.private_key, ca=True, issuer=own)
    workshop.permissions_ca = workshop.document_signer = Authority(made, own.private_key)


@near_miss
def a_certificate_for_thirty_days(workshop: Workshop) -> None:
    workshop.identity = workshop.make_identity(ALICE, workshop.days(-1, 30))


@near_miss
def a_subject_with_a_comma(workshop: Workshop) -> None:
    workshop.identity = workshop.make_identity("/O=Example, Inc./CN=alice")
    workshop.replace("permissions", (ALICE, r"CN=alice,O=Example\, Inc."))


@near_miss
def a_name_of_ros_2(workshop: Workshop) -> None:
    workshop.identity = workshop.make_identity("/O=Example/CN=/robot/arm")
    workshop.replace("permissions", (ALICE, "CN=/robot/arm,O=Example"))


@near_miss
def a_grant_for_somebody_else_before(workshop: Workshop) -> None:
    text = workshop.permissions
    grant = text[text.index("<grant") : text.index("</grant>") + len("</grant>")]
    workshop.replace("permissions", (grant, grant.replace("alice", "bob") + grant))


@near_miss
def a_narrower_topic_rule_before(workshop: Workshop) -> None:
    rule = section(workshop.governance, "topic_rule")
    workshop.replace("governance", (rule, rule.replace(">*<", ">S?*<") + rule))


@near_miss
def a_narrower_domain_rule_before(workshop: Workshop) -> None:
    rule = section(workshop.governance, "domain_rule")
    workshop.replace("governance", (rule, rule.replace("230", "7") + rule))


@near_miss
def a_wider_topic_in_a_later_rule(workshop: Workshop) -> None:
    add_rule(workshop, "allow", "publish", "Squ*", "A")


@near_miss
def the_same_topic_for_another_action(workshop: Workshop) -> None:
    workshop.replace("permissions", ("<topic>*<", "<topic>T<"))
    add_rule(workshop, "allow", "subscribe", "Square", "A")


@near_miss
def the_same_topic_in_more_domains(workshop: Workshop) -> None:
    workshop.replace("permissions", ("<max>230", "<max>9"))
    add_rule(workshop, "allow", "publish", "Square", "A", last=230)


@pytest.mark.parametrize("near_miss", NEAR_MISSES, ids=lambda spoil: spoil.__name__)
def test_what_only_looks_like_it_is_not_found(tmp_path: Path, near_miss: Spoil) -> None:
    workshop = Workshop(tmp_path / "alice")
    near_miss(workshop)
    assert [str(finding) for finding in check(workshop.write())] == []


@pytest.mark.parametrize(
    ("key", "of_identity", "of_permissions_ca", "of_signature"),
    [
        (["rsa:2048", "-sha256"], None, None, None),
        (["rsa:2048", "-sha384"], None, None, "certificate-signature"),
        (["rsa:2048", "-sha256", "-sigopt", "rsa_padding_mode:pss"], None, None, "certificate-signature"),
        (["rsa-pss", "-pkeyopt", "rsa_keygen_bits:2048"], "rsa-key", None, "certificate-signature"),
        (["rsa:1024", "-sha1"], "weak-algorithm", "weak-algorithm", "weak-algorithm"),
        (["ec", "-pkeyopt", "ec_paramgen_curve:P-521", "-sha256"], "unsupported-key", None, None),
        (["ed25519"], "unsupported-key", "unsupported-key", "certificate-signature"),
    ],
)  # fmt: skip
def test_algorithms_by_openssl(
    key: list[str], of_identity: str | None, of_permissions_ca: str | None, of_signature: str | None
) -> None:
    made = ["-newkey", *key, "-nodes", "-keyout", os.devnull, "-subj", "/CN=alice"]
    path, read = Path("cert.pem"), parse_certificate(openssl("req", "-x509", *made).encode(), "cert.pem")
    for findings, rule in (
        (check_identity_key(path, read), of_identity),
        (check_identity_ca_key(path, read), of_identity),
        (check_permissions_ca_key(path, read), of_permissions_ca),
        (check_signature(path, read, "the certificate"), of_signature),
    ):
        found = list(findings)
        assert [finding.rule.id for finding in found] == [rule] * (rule is not None)
        for finding in found:
            assert_reads_well(finding)


@pytest.mark.parametrize(
    ("first", "second", "found"),
    [
        # Whoever is denied everywhere is not allowed somewhere by a later rule; and the other way round.
        (("deny", "publish", "S*"), ("allow", "publish", "Square", "A"), True),
        (("deny", "publish", "S*", "A"), ("allow", "publish", "Square", "A"), True),
        (("deny", "publish", "S*", "A"), ("allow", "publish", "Square", "B"), False),
        (("deny", "publish", "S*", "A"), ("allow", "publish", "Square"), False),
        (("allow", "publish", "S*", "*"), ("deny", "publish", "Square"), True),
        (("allow", "publish", "S*", "A"), ("deny", "publish", "Square", "A"), False),
        (("allow", "publish", "S*"), ("deny", "publish", "Square"), False),
        (("deny", "publish", "S*", "A*"), ("deny", "publish", "Square", "AB"), True),
        (("deny", "publish", "S*", "A*"), ("deny", "publish", "Square"), False),
    ],
)
def test_deny_rules_take_one_partition_and_allow_rules_need_all(
    tmp_path: Path, first: tuple[str, str, str], second: tuple[str, str, str], found: bool
) -> None:
    workshop = Workshop(tmp_path / "alice")
    workshop.replace("permissions", (section(workshop.permissions, "allow_rule"), ""))
    add_rule(workshop, *first)
    add_rule(workshop, *second)
    add_rule(workshop, "allow", "subscribe", "T")
    assert ("rule-never-matches" in rules_of(check(workshop.write()))) == found


def test_soon_is_what_the_user_says(tmp_path: Path) -> None:
    workshop = Workshop(tmp_path / "alice")
    assert rules_of(check(workshop.write(), soon_days=1001)) == {"certificate-expires-soon", "grant-expires-soon"}
    assert check(workshop.folder, soon_days=999) == []


def test_a_wrong_signature_does_not_hide_what_the_document_says(tmp_path: Path) -> None:
    workshop = Workshop(tmp_path / "alice")
    workshop.replace("governance", ("<max>230", "<max>232"))
    workshop.write()
    workshop.file("governance.p7s", workshop.identity_ca.sign_document(workshop.governance.encode()))
    assert rules_of(check(workshop.folder)) == {"document-wrong-signer", "domain-too-high"}


def test_many_rules_are_compared_in_bounded_time(tmp_path: Path) -> None:
    workshop = Workshop(tmp_path / "alice")
    many = "".join(f"<topic>{'*a' * 20}{number}</topic>" for number in range(4000))
    workshop.replace("permissions", ("<topic>Square</topic>", many), ("<topic>*</topic>", many))
    assert rules_of(check(workshop.write())) == set()
