"""``ddsi bench``: the source tree's benchmarks with the same words, and a sentence where there are none."""

from __future__ import annotations

import argparse
import subprocess
import sys
from pathlib import Path

import pytest

from benchmarks.__main__ import _parser
from ddsi.cli import bench
from ddsi.cli.command_line import main


def _options(parser: argparse.ArgumentParser) -> set[str]:
    return {option for action in parser._actions for option in action.option_strings}


def test_it_has_the_options_of_the_benchmarks() -> None:
    parser = argparse.ArgumentParser()
    bench.add_arguments(parser)
    assert _options(parser) == _options(_parser())


def test_it_runs_them_from_any_folder(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "ddsi.cli", "bench", "--list"]
    sources = str(Path(__file__).parents[2])
    done = subprocess.run(
        command, cwd=tmp_path, env={"PYTHONPATH": sources}, capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert "throughput/shape" in done.stdout


def test_words_that_they_refuse_are_refused(capfd: pytest.CaptureFixture[str]) -> None:
    assert main(["bench", "--list", "--rounds", "0"]) == 2
    assert "at least 1" in capfd.readouterr().err


def test_what_pip_installs_has_none(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(bench, "_SOURCES", tmp_path)
    assert main(["bench"]) == 2
    assert "make bench" in capsys.readouterr().err
