"""What type checkers say of a user's program: nothing if it is right, and something on each wrong line."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from . import typed_program

HERE = Path(__file__).parent
ROOT = HERE.parent.parent

RIGHT = HERE / "typed_program.py"
WRONG = HERE / "mistyped_program.txt"  # no .py, so that nobody checks it with the rest


def mypy(program: Path) -> set[int]:
    """The numbers of the lines of which mypy complains."""
    pytest.importorskip("mypy")
    command = [sys.executable, "-m", "mypy", "--strict", "--no-error-summary", str(program)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=120, check=False)
    assert not done.stderr, done.stderr
    return {int(line) for line in re.findall(rf"{program.name}:(\d+): error", done.stdout)}


def pyright(program: Path) -> set[int]:
    """The numbers of the lines of which pyright complains; the programs ask for its strict mode."""
    pytest.importorskip("pyright")
    command = [sys.executable, "-m", "pyright", "--outputjson", str(program)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=240, check=False)
    if not done.stdout.lstrip().startswith("{"):
        pytest.skip(f"pyright cannot run here: {done.stderr[:200]}")
    report = json.loads(done.stdout)
    assert report["summary"]["filesAnalyzed"] == 1
    return {found["range"]["start"]["line"] + 1 for found in report["generalDiagnostics"]}


checkers = pytest.mark.parametrize("checker", [mypy, pyright])


@pytest.mark.slow
@checkers
def test_a_right_program_passes(checker: Callable[[Path], set[int]]) -> None:
    assert checker(RIGHT) == set()


@pytest.mark.slow
@checkers
def test_each_mistake_is_found(checker: Callable[[Path], set[int]], tmp_path: Path) -> None:
    program = tmp_path / "mistyped_program.py"
    program.write_text(WRONG.read_text())
    mistakes = {number for number, line in enumerate(WRONG.read_text().splitlines(), 1) if line.endswith("# mistake")}
    assert len(mistakes) == 9
    assert checker(program) == mistakes


def test_the_right_program_runs() -> None:
    typed_program.program()
