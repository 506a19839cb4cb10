"""Type checkers, run on a user's program: of which lines do they complain?"""

from __future__ import annotations

import json
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

__all__ = ["Checker", "checkers", "marked_mistakes"]

Checker = Callable[[Path], set[int]]
ROOT = Path(__file__).parents[1]


def mypy(checked: Path) -> set[int]:
    """The lines of which mypy complains, in strict mode."""
    pytest.importorskip("mypy")
    command = [sys.executable, "-m", "mypy", "--strict", "--no-error-summary", str(checked)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=120, check=False)
    assert not done.stderr, done.stderr
    return {int(line) for line in re.findall(rf"{checked.name}:(\d+): error", done.stdout)}


def pyright(checked: Path) -> set[int]:
    """The lines of which pyright complains; a program may ask for its strict mode."""
    pytest.importorskip("pyright")
    command = [sys.executable, "-m", "pyright", "--outputjson", str(checked)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=240, check=False)
    if not done.stdout.lstrip().startswith("{"):
        pytest.skip(f"pyright cannot run here: {done.stderr[:200]}")
    report = json.loads(done.stdout)
    assert report["summary"]["filesAnalyzed"] == 1
    return {found["range"]["start"]["line"] + 1 for found in report["generalDiagnostics"]}


checkers = pytest.mark.parametrize("checker", [mypy, pyright])


def marked_mistakes(text: str) -> set[int]:
    """The lines that say of themselves that they are wrong."""
    return {number for number, line in enumerate(text.splitlines(), 1) if line.endswith("# mistake")}
