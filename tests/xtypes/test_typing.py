"""What type checkers say of a user's program: nothing if it is right, and something on each wrong line."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.type_checkers import Checker, checkers, marked_mistakes

from . import typed_program

HERE = Path(__file__).parent

RIGHT = HERE / "typed_program.py"
WRONG = HERE / "mistyped_program.txt"  # no .py, so that nobody checks it with the rest


@pytest.mark.slow
@checkers
def test_a_right_program_passes(checker: Checker) -> None:
    assert checker(RIGHT) == set()


@pytest.mark.slow
@checkers
def test_each_mistake_is_found(checker: Checker, tmp_path: Path) -> None:
    program = tmp_path / "mistyped_program.py"
    program.write_text(WRONG.read_text())
    mistakes = marked_mistakes(WRONG.read_text())
    assert len(mistakes) == 9
    assert checker(program) == mistakes


def test_the_right_program_runs() -> None:
    typed_program.program()
