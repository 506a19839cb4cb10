"""``ddsi keystore check`` as a command, and on keystores that others made."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from ddsi_security.keystore.finding import Finding
from ddsi_security.keystore.horizon import Horizon
from ddsi_security.keystore.linter import RULES, check_keystore

from .keystores import NOW, Shell, Workshop


def check(folder: Path, *, soon_days: int = 30) -> list[Finding]:
    return check_keystore(folder, Horizon.of_days(NOW, soon_days))


def rules_of(findings: list[Finding]) -> set[str]:
    return {finding.rule.id for finding in findings}


# --- the command ---------------------------------------------------------------------------------------------


def test_the_command_prints_findings_and_fails_on_errors_only(shell: Shell, tmp_path: Path) -> None:
    workshop = Workshop(tmp_path / "alice")
    workshop.replace("governance", ("<max>230", "<max>232"))
    folder = workshop.write()
    assert shell.run("keystore", "check", folder) == 0
    assert "warning: domain 232: Cyclone DDS refuses" in shell.out
    assert shell.out.endswith("\n0 errors, 1 warning, 0 notes.\n")
    (folder / "key.pem").chmod(0o644)
    assert shell.run("keystore", "check", folder) == 1
    assert f"{folder}/key.pem:1: error: the private key is open to everybody (mode 0644) [key-exposed]\n" in shell.out
    assert f"    remedy: chmod 600 {folder}/key.pem; if others" in shell.out
    assert shell.run("keystore", "check", folder, "--ignore", "key-exposed", "--ignore", "domain-too-high") == 0
    assert shell.out == "0 errors, 0 warnings, 0 notes.\n"


def test_the_command_prints_json(shell: Shell, tmp_path: Path) -> None:
    folder = Workshop(tmp_path / "alice").write()
    (folder / "cert.pem").unlink()
    assert shell.run("keystore", "check", folder, "--json") == 1
    said = json.loads(shell.out)
    (finding,) = said.pop("findings")
    assert said == {"errors": 1, "warnings": 0, "notes": 0}
    assert finding.keys() == {"file", "line", "rule", "severity", "text", "remedy"}
    assert (finding["file"], finding["line"], finding["rule"], finding["severity"]) == (
        str(folder / "cert.pem"), 1, "file-missing", "error",
    )  # fmt: skip


def test_the_command_lists_its_rules(shell: Shell) -> None:
    assert shell.run("keystore", "check", "--rules") == 0
    assert [line.split()[0] for line in shell.out.splitlines()] == list(RULES)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["nowhere"], "nowhere is not a folder: name a keystore"),
        (["."], "holds no identity: make one with `ddsi keystore create`"),
        ([], "which keystore? Name a folder"),
        ([".", "--ignore", "x"], "there is no rule 'x': ddsi keystore check --rules lists them"),
    ],
)
def test_what_cannot_be_checked_is_a_sentence(
    shell: Shell, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, words: list[str], said: str
) -> None:
    monkeypatch.chdir(tmp_path)
    assert said in shell.refused("check", *words)


# --- keystores of others -------------------------------------------------------------------------------------


def test_what_create_makes_has_nothing_to_find(shell: Shell, tmp_path: Path) -> None:
    for preset in ("encrypt", "encrypt-all", "submessage", "sign", "authenticate"):
        shell.make("create", tmp_path / preset, "--identity", "alice", "--identity", "bob", "--preset", preset)
        findings = check(tmp_path / preset)
        assert rules_of(findings) == ({"control-without-protection"} if preset == "authenticate" else set())


def test_what_identities_share_is_found_once(shell: Shell, tmp_path: Path) -> None:
    shell.make("create", tmp_path, "--identity", "alice", "--identity", "bob", "--domain", "0-232")
    findings = [finding for finding in check(tmp_path) if "governance" in finding.path.name]
    assert [finding.path for finding in findings] == [tmp_path / "enclaves/governance.p7s"]
