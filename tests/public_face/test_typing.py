"""What type checkers say of a user's program: nothing where it is right, and something on each wrong line."""

from __future__ import annotations

from pathlib import Path

import pytest
import trio

from tests.dcps.running import domain as domain
from tests.public_face import program
from tests.type_checkers import Checker, checkers, marked_mistakes

HERE = Path(__file__).parent
RIGHT = HERE / "program.py"
WRONG = HERE / "mistakes.txt"


@pytest.mark.slow
@checkers
def test_a_right_program_passes(checker: Checker) -> None:
    assert checker(RIGHT) == set()


@pytest.mark.slow
@checkers
def test_each_mistake_is_found(checker: Checker, tmp_path: Path) -> None:
    checked = tmp_path / "mistakes.py"
    checked.write_text(WRONG.read_text())
    mistakes = marked_mistakes(WRONG.read_text())
    assert len(mistakes) == 10
    assert checker(checked) == mistakes


def test_the_right_program_does_what_it_says(domain: int) -> None:
    assert trio.run(program.main, domain) == [
        "1 readers", "BLUE", "10 b''", "11 b'\\x00\\x00\\x00'", "matched 1", "RED 16",
    ]  # fmt: skip
