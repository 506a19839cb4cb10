"""``ddsi keystore`` as a command: what it loads, and what it says without the packages that it needs."""

from __future__ import annotations

import argparse
import subprocess
import sys
import time
from importlib import metadata
from pathlib import Path

import pytest

from ddsi.structure.errors import ConfigurationError
from ddsi_security.keystore import command, explain_command, lazy_command
from ddsi_security.keystore.linter import RULES

from .keystores import Shell

PAGE = (Path(__file__).parents[3] / "docs/keystore.md").read_text(encoding="utf-8")


def test_help_loads_no_cryptographic_library() -> None:
    """A person waits for it, and it may not even be installed."""
    program = (
        "import sys\n"
        "from ddsi.cli import main\n"
        "for words in (['--help'], ['keystore', '--help'], ['keystore', 'create', '--help'], ['explain', '--help']):\n"
        "    try:\n"
        "        main(words)\n"
        "    except SystemExit as ended:\n"
        "        assert ended.code == 0\n"
        "assert 'ddsi_security.keystore.command' in sys.modules\n"
        "assert not {'cryptography', 'lxml'} & set(sys.modules)\n"
    )
    subprocess.run([sys.executable, "-c", program], check=True, timeout=60, stdout=subprocess.DEVNULL)


@pytest.mark.parametrize("package", ["cryptography", "lxml"])
def test_without_its_packages_it_says_what_to_install(monkeypatch: pytest.MonkeyPatch, package: str) -> None:
    def missing(name: str) -> object:
        raise ModuleNotFoundError(f"No module named '{package}.x509'", name=f"{package}.x509")

    monkeypatch.setattr(lazy_command, "import_module", missing)
    with pytest.raises(ConfigurationError, match=rf"the package {package}: pip install 'ddsi\[security\]'"):
        lazy_command.run_lazily("checking", "check", argparse.Namespace())


def test_a_mistake_of_ours_is_not_taken_for_a_missing_package() -> None:
    with pytest.raises(ModuleNotFoundError, match="no_such_module"):
        lazy_command.run_lazily("no_such_module", "check", argparse.Namespace())


def test_both_entry_points_are_declared() -> None:
    points = {point.name: point.value for point in metadata.entry_points(group="ddsi.cli")}
    assert points["keystore"] == command.__name__
    assert points["explain"] == explain_command.__name__


@pytest.mark.parametrize("name", command._ACTIONS)
def test_every_subcommand_has_its_help_and_its_place_in_the_manual(shell: Shell, name: str) -> None:
    assert shell.run("keystore", name, "--help") == 0
    said = shell.out
    assert f"ddsi keystore {name}" in PAGE
    for option in {word.strip("[],") for word in said.split() if word.startswith("--")}:
        assert option in ("--help", "--json") or option in PAGE, f"{option} of {name} is not in the manual"


def test_the_manual_s_commands_of_openssl_make_what_has_nothing_to_find(shell: Shell, tmp_path: Path) -> None:
    shell.now = time.time_ns()  # openssl knows no other
    shell.create(tmp_path / "ks")
    commands = PAGE[PAGE.index("    for ca in identity_ca") :].partition("    ddsi keystore check .")[0]
    made = subprocess.run(
        ["sh", "-e"], input=commands, cwd=tmp_path, capture_output=True, text=True, timeout=60, check=False
    )
    assert made.returncode == 0, made.stderr
    assert "subject=CN=alice,O=Example" in made.stdout
    assert shell.run("keystore", "check", tmp_path) == 0
    assert shell.out == "0 errors, 0 warnings, 0 notes.\n"


def test_every_rule_is_in_the_manual() -> None:
    for rule in RULES.values():
        assert f"| `{rule.id}` | {rule.severity} |" in PAGE
