"""The README keeps its word: its program runs as printed, its commands exist, and its map shows the rooms there are."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.examples.running import EXAMPLES, ROOT, environment, output_of

README = (ROOT / "README.md").read_text(encoding="utf-8")


def fenced(language: str) -> list[str]:
    """The blocks of code in this language, in order."""
    return re.findall(rf"^```{language}\n(.*?)^```$", README, re.DOTALL | re.MULTILINE)


def test_it_opens_with_one_sentence_and_shows_code_within_a_screen() -> None:
    lines = README.splitlines()
    assert lines[0] == "# ddsi"
    opening = " ".join(lines[2 : lines.index("```python")]).strip()
    assert opening.startswith("`ddsi` is ")
    assert opening.count(". ") == 0
    assert lines.index("```python") < 10


def test_its_program_runs_as_printed_and_prints_what_is_shown(tmp_path: Path) -> None:
    program = tmp_path / "program.py"
    program.write_text(fenced("python")[0], encoding="utf-8")
    assert output_of(program) == fenced("text")[0].splitlines()


def test_its_program_without_trio_runs_with_the_type_of_the_first(tmp_path: Path) -> None:
    first, without_trio, *_ = fenced("python")
    definitions, main, _ = first.partition("async def main")
    assert main
    program = tmp_path / "program.py"
    program.write_text(definitions + without_trio, encoding="utf-8")
    assert output_of(program) == fenced("text")[0].splitlines()


def test_its_program_is_the_first_example() -> None:
    example = (EXAMPLES / "01_hello.py").read_text(encoding="utf-8")
    module = ast.parse(example)
    code = "\n".join(example.splitlines()[module.body[0].end_lineno :]).strip()
    assert code == fenced("python")[0].strip()


def test_its_uri_is_one_that_the_parser_takes() -> None:
    (uri,) = set(re.findall(r"export DDSI_URI='(.*)'", README))
    done = subprocess.run(
        [sys.executable, "-c", "from ddsi.config.environment import load_config; print(load_config(0).interfaces)"],
        env={**environment(), "DDSI_URI": uri},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.stdout == "('lo',)\n", done.stderr


@pytest.mark.parametrize("target", sorted(set(re.findall(r"^    make (\w+)", README, re.MULTILINE))))
def test_the_makefile_has_what_it_tells_to_make(target: str) -> None:
    assert re.search(rf"^{target}:", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE)


@pytest.mark.parametrize("command", sorted(set(re.findall(r"^    ddsi (\w+)", README, re.MULTILINE))))
def test_the_commands_exist(command: str) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "ddsi.cli", command, "--help"],
        env=environment(),
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr


def test_its_map_shows_every_room_in_import_order() -> None:
    drawn = re.findall(r"^    ddsi/(\w+) ", README, re.MULTILINE)
    there = {path.parent.name for path in (ROOT / "ddsi").glob("*/__init__.py")}
    assert set(drawn) == there
    told = re.findall(
        r"^    (\w+) {2,}", ast.get_docstring(ast.parse((ROOT / "ddsi/__init__.py").read_text())) or "", re.M
    )
    assert [room for room in told if room in drawn] == [room for room in drawn if room in told]


@pytest.mark.parametrize("path", sorted(set(re.findall(r"\]\((?!http)([^)#]+)\)", README))))
def test_its_links_lead_somewhere(path: str) -> None:
    assert (ROOT / path).exists()


@pytest.mark.parametrize("path", sorted(set(re.findall(r"`((?:ddsi|examples|docs)/[\w/]+\.(?:py|md))`", README))))
def test_the_files_that_it_names_exist(path: str) -> None:
    assert (ROOT / path).exists()
