"""What the checkers do not check: modules say what they are, tests mirror the rooms, files keep to one noun."""

from __future__ import annotations

import ast
from pathlib import Path

ROOT = Path(__file__).parents[1]
SOURCES = sorted([*(ROOT / "ddsi").rglob("*.py"), *(ROOT / "security").rglob("*.py")])
LONGEST = 800
"""Lines.  Most modules have 80 to 350; one that outgrows this has a second noun in it."""


def _name(path: Path) -> str:
    return path.relative_to(ROOT).as_posix()


def test_modules_say_what_they_are() -> None:
    """Each begins with what it is, the chapter it implements, and what it does not do."""
    silent = [_name(path) for path in SOURCES if not ast.get_docstring(ast.parse(path.read_text(encoding="utf-8")))]
    assert silent == []


def test_modules_are_of_one_noun() -> None:
    lengths = {_name(path): len(path.read_text(encoding="utf-8").splitlines()) for path in SOURCES}
    assert {name: lines for name, lines in lengths.items() if lines > LONGEST} == {}
    vague = {"utils", "util", "helpers", "helper", "common", "misc", "manager"}
    assert [_name(path) for path in SOURCES if path.stem in vague] == []


def test_tests_mirror_the_rooms() -> None:
    rooms = {path.parent.name for path in (ROOT / "ddsi").glob("*/__init__.py")} | {"security"}
    tested = {path.parent.name for path in (ROOT / "tests").glob("*/test_*.py")}
    assert tested - rooms <= {"benchmarks", "examples", "fuzz", "public_face"}
    assert {"config", "security", "structure"} <= rooms
