"""docs/cli.md names what there is: every command with every option of its own, every status."""

from __future__ import annotations

import argparse
import re
from importlib import import_module
from pathlib import Path

import pytest

from ddsi.cli.command_line import _COMMANDS
from ddsi.cli.exit_status import ExitStatus
from ddsi.cli.sim_scenarios import SCENARIOS

PAGE = (Path(__file__).parents[2] / "docs" / "cli.md").read_text(encoding="utf-8")
SECTIONS = {match[1]: match[2] for match in re.finditer(r"^## `ddsi (\w+)`\n(.*?)(?=^## )", PAGE, re.M | re.S)}


@pytest.mark.parametrize("name", _COMMANDS)
def test_every_option_is_there(name: str) -> None:
    parser = argparse.ArgumentParser()
    import_module(f"ddsi.cli.{name}").add_arguments(parser)
    options = {option for action in parser._actions for option in action.option_strings if option.startswith("--")}
    said = set(re.findall(r"--[a-z][a-z-]*", SECTIONS[name])) | {"--help", "--domain", "--json", "--color"}
    assert options - said == set()
    assert said - options <= {"--help", "--domain", "--json", "--color", "--stats"}, "gone, but still described"


def test_every_command_is_there() -> None:
    assert set(SECTIONS) == set(_COMMANDS)


def test_every_status_is_there() -> None:
    (table,) = re.findall(r"^## How a command ends\n(.*?)^## ", PAGE, re.M | re.S)
    assert {int(number) for number in re.findall(r"\b\d+\b", re.sub(r"`[^`]*`", "", table))} >= set(ExitStatus)


def test_its_example_is_a_scenario() -> None:
    assert set(re.findall(r"--scenario ([a-z-]+)", PAGE)) <= set(SCENARIOS)
