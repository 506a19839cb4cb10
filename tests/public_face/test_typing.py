"""What type checkers say of a user's program: nothing where it is right, and something on each wrong line."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
import trio

from tests.dcps.running import domain as domain
from tests.public_face import program

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
RIGHT = HERE / "program.py"
WRONG = HERE / "mistakes.txt"


def mypy(checked: Path) -> set[int]:
    """The lines of which mypy complains, in strict mode."""
    pytest.importorskip("mypy")
    command = [sys.executable, "-m", "mypy", "--strict", "--no-error-summary", str(checked)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=120, check=False)
    assert not done.stderr, done.stderr
    return {int(line) for line in re.findall(rf"{checked.name}:(\d+): error", done.stdout)}


def pyright(checked: Path) -> set[int]:
    """The lines of which pyright complains."""
    pytest.importorskip("pyright")
    command = [sys.executable, "-m", "pyright", "--outputjson", str(checked)]
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
    checked = tmp_path / "mistakes.py"
    checked.write_text(WRONG.read_text())
    mistakes = {number for number, line in enumerate(WRONG.read_text().splitlines(), 1) if line.endswith("# mistake")}
    assert len(mistakes) == 10
    assert checker(checked) == mistakes


def test_the_right_program_does_what_it_says(domain: int) -> None:
    assert trio.run(program.main, domain) == [
        "1 readers", "BLUE", "10 b''", "11 b'\\x00\\x00\\x00'", "matched 1", "RED 16",
    ]  # fmt: skip
