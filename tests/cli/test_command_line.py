"""``main``: which subcommand, which status, one sentence."""

from __future__ import annotations

import argparse
import subprocess
import sys
from importlib import metadata
from types import SimpleNamespace

import pytest

from ddsi.cli import command_line
from ddsi.cli.command_line import main
from ddsi.cli.exit_status import CommandError
from ddsi.structure.errors import ConfigurationError


def _command(run: object, summary: str = "do it") -> SimpleNamespace:
    return SimpleNamespace(SUMMARY=summary, add_arguments=lambda parser: parser.add_argument("--much"), run=run)


def _plug_in(monkeypatch: pytest.MonkeyPatch, **commands: object) -> None:
    """Installed packages with entry points of these names."""

    def load(command: object) -> object:
        if isinstance(command, Exception):
            raise command
        return command

    points = [
        SimpleNamespace(name=name, value=f"somewhere:{name}", load=lambda command=command: load(command))
        for name, command in commands.items()
    ]
    monkeypatch.setattr(metadata, "entry_points", lambda group: points if group == "ddsi.cli" else [])


def test_help_names_every_command(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["--help"])
    assert ended.value.code == 0
    shown = capsys.readouterr().out
    for name in ("ls", "why", "shapes", "trace", "sim", "idl", "demo", "doctor"):
        assert f"\n    {name} " in shown


@pytest.mark.parametrize("name", command_line._COMMANDS)
def test_every_command_has_its_help_and_says_of_itself_what_the_table_says(
    name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        main([name, "--help"])
    assert ended.value.code == 0
    said = " ".join(capsys.readouterr().out.split())
    assert command_line._sentence(command_line._COMMANDS[name]) in said


def test_version(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["--version"])
    assert capsys.readouterr().out.split() == ["ddsi", metadata.version("ddsi")]


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        ([], "ddsi: the following arguments are required: COMMAND; see ddsi --help\n"),
        (["ls", "-d", "233"], "a domain is a number from 0 to 232, not '233'; see ddsi ls --help\n"),
        (["ls", "-d", "x"], "a whole number is wanted, not 'x'; see ddsi ls --help\n"),
        (["ls", "--time", "-1"], "a number of seconds above 0 is wanted, not '-1'; see ddsi ls --help\n"),
        (["ls", "--time", "nan"], "a number of seconds above 0 is wanted, not 'nan'; see ddsi ls --help\n"),
        (["shapes", "pub", "-n", "0"], "a number from 1 up is wanted, not '0'; see ddsi shapes --help\n"),
        (["shapes", "pub", "--payload", "-1"], "a number of octets is wanted, not '-1'; see ddsi shapes --help\n"),
        (["shapes", "pub", "--rate", "1e9"], "above 0 and at most 10000, not '1e9'; see ddsi shapes --help\n"),
        (["sim", "--seed", "-3"], "a seed is a whole number from 0 up, not '-3'; see ddsi sim --help\n"),
        (["trace", "--only", "data,dta"], "remark, not 'data,dta'; see ddsi trace --help\n"),
        (["ls", "--nonsense"], "unrecognized arguments: --nonsense; see ddsi --help\n"),
    ],
)
def test_a_wrong_argument_is_one_sentence(words: list[str], sentence: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(words)
    assert ended.value.code == 2
    said = capsys.readouterr().err
    assert said.endswith(sentence)
    assert said.count("\n") == 1


def test_an_unknown_command_is_one_sentence_with_those_that_there_are(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["lss"])
    assert ended.value.code == 2
    said = capsys.readouterr().err
    assert "'lss'" in said
    assert "doctor" in said
    assert said.count("\n") == 1


@pytest.mark.parametrize(
    ("error", "said"),
    [
        (CommandError("no such\nthing"), "ddsi more: no such thing\n"),
        (ConfigurationError("line 1 is wrong"), "ddsi more: line 1 is wrong\n"),
        (
            FileNotFoundError(2, "No such file or directory", "x.jsonl"),
            "ddsi more: x.jsonl: No such file or directory\n",
        ),
        (OSError("something"), "ddsi more: something\n"),
    ],
)
def test_errors_of_users_are_a_sentence_and_status_2(
    error: Exception, said: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def run(arguments: argparse.Namespace) -> int:
        raise error

    _plug_in(monkeypatch, more=_command(run))
    assert main(["more"]) == 2
    assert capsys.readouterr().err == said


def test_an_error_of_ours_is_not_hidden(monkeypatch: pytest.MonkeyPatch) -> None:
    def run(arguments: argparse.Namespace) -> int:
        raise ZeroDivisionError

    _plug_in(monkeypatch, more=_command(run))
    with pytest.raises(ZeroDivisionError):
        main(["more"])


def test_a_keyboard_interrupt_is_130(monkeypatch: pytest.MonkeyPatch) -> None:
    def run(arguments: argparse.Namespace) -> int:
        raise KeyboardInterrupt

    _plug_in(monkeypatch, more=_command(run))
    assert main(["more"]) == 130


def test_another_package_brings_a_command(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    seen = []

    def run(arguments: argparse.Namespace) -> int:
        seen.append(arguments.much)
        return 7

    _plug_in(monkeypatch, more=_command(run, "do more"), broken=ImportError("no lxml, 100%"))
    assert main(["more", "--much", "yes"]) == 7
    assert seen == ["yes"]
    with pytest.raises(SystemExit):
        main(["--help"])
    shown = capsys.readouterr().out
    assert "do more" in shown
    assert "cannot be loaded: no lxml, 100%" in shown


def test_a_command_that_does_not_load_is_a_sentence(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    _plug_in(monkeypatch, broken=ImportError("no lxml"))
    assert main(["broken"]) == 2
    assert capsys.readouterr().err == "ddsi broken: somewhere:broken cannot be loaded: no lxml\n"


def test_another_package_cannot_take_the_place_of_ours(monkeypatch: pytest.MonkeyPatch) -> None:
    _plug_in(monkeypatch, sim=_command(lambda arguments: 99))
    assert main(["sim", "--list"]) == 0


def test_only_the_chosen_command_is_imported() -> None:
    """Start-up is waited for by a person: no other command, no rich, no peer."""
    program = (
        "import sys\n"
        "from ddsi.cli import main\n"
        "assert 'argparse' in sys.modules\n"
        "assert main(['sim', '--list']) == 0\n"
        "found = {name for name in sys.modules if name.startswith('ddsi.cli.')}\n"
        "assert not found & {'ddsi.cli.ls', 'ddsi.cli.doctor', 'ddsi.cli.shapes', 'ddsi.cli.demo'}, found\n"
        "assert 'rich' not in sys.modules and 'cyclonedds' not in sys.modules\n"
    )
    subprocess.run([sys.executable, "-c", program], check=True, timeout=60, stdout=subprocess.DEVNULL)


def test_a_misspelt_command_is_answered_with_all_there_are(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Those of other packages too, and without importing them."""
    _plug_in(monkeypatch, keystore=AssertionError("imported"))
    with pytest.raises(SystemExit) as ended:
        main(["keystor"])
    assert ended.value.code == 2
    said = capsys.readouterr().err
    assert all(name in said for name in ("'keystor'", "keystore", *command_line._COMMANDS))


@pytest.mark.parametrize("words", [["shapes", "pub", "--rate", "0"], ["pub", "T", "x=1", "--rate", "1e9"]])
def test_a_rate_is_no_duration(words: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(words)
    assert "samples a second" in capsys.readouterr().err
