"""Every example runs alone, ends by itself, and prints what its docstring promises."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from tests.examples.running import EXAMPLES, environment, output_of

PROGRAMS = sorted(EXAMPLES.glob("*.py"))


@pytest.mark.parametrize("program", PROGRAMS, ids=[program.stem for program in PROGRAMS])
def test_an_example_says_what_one_will_see_and_how_to_run_it(program: Path) -> None:
    text = ast.get_docstring(ast.parse(program.read_text(encoding="utf-8"))) or ""
    assert "You will see" in text
    assert f"python examples/{program.name}" in text


def test_the_examples_are_numbered_in_the_order_in_which_they_grow() -> None:
    assert [path.name[:3] for path in PROGRAMS] == [f"{number:02}_" for number in range(1, len(PROGRAMS) + 1)]


def test_hello() -> None:
    assert output_of(EXAMPLES / "01_hello.py") == [
        "ShapeType(color='BLUE', x=10, y=20, shapesize=30, additional_payload_size=b'')"
    ]


ROBOTS = [
    "arm    battery  50%  alive",
    "rover  battery 100%  alive",
    "rover  battery  75%  alive",
    "arm                  not alive disposed",
    "rover                not alive no writers",
]


def test_keyed_topic() -> None:
    assert output_of(EXAMPLES / "02_keyed_topic.py") == ROBOTS


def test_late_joiner() -> None:
    assert output_of(EXAMPLES / "03_late_joiner.py") == [
        "written before anybody reads: 11.0 to 13.0",
        "volatile  reader: nothing",
        "lasting   reader: 12.0, 12.5, 13.0",
        "volatile  reader: 20.5",
        "lasting   reader: 20.5",
    ]


@contextmanager
def in_background(name: str, role: str, env: dict[str, str]) -> Iterator[subprocess.Popen[str]]:
    process = subprocess.Popen(
        [sys.executable, str(EXAMPLES / name), role], env=env, stdout=subprocess.PIPE, text=True, encoding="utf-8"
    )
    with process:
        try:
            yield process
        finally:
            process.kill()


def other_role(name: str, role: str, env: dict[str, str]) -> list[str]:
    command = [sys.executable, str(EXAMPLES / name), role]
    done = subprocess.run(command, env=env, capture_output=True, text=True, encoding="utf-8", timeout=30, check=True)
    return done.stdout.splitlines()


def test_keyed_topic_in_two_processes() -> None:
    env = environment()
    with in_background("02_keyed_topic.py", "read", env) as reader:
        assert other_role("02_keyed_topic.py", "write", env) == []
        output, _ = reader.communicate(timeout=30)
    assert output.splitlines() == ROBOTS


def test_late_joiner_in_two_processes() -> None:
    env = environment()
    with in_background("03_late_joiner.py", "write", env) as writer:
        assert writer.stdout is not None
        assert writer.stdout.readline() == "written before anybody reads: 11.0 to 13.0\n"
        assert other_role("03_late_joiner.py", "read", env) == ["lasting   reader: 12.0, 12.5, 13.0"]


def test_lossy_link_tells_the_story_of_a_repair() -> None:
    lines = output_of(EXAMPLES / "04_lossy_link.py")
    story = [
        r"├─+▶│ +DATA Square #1$",
        r"sender the link breaks$",
        r"├┄+✗ +│ +lost \(loss\): DATA Square #2",
        r"sender the link is whole again$",
        r"├─+▶│ +HEARTBEAT Square 1\.\.2 ",
        r"│◀─+┤ +ACKNACK Square base 2 missing \{2\} ",
        r"├─+▶│ +DATA Square #2",
        r"├─+▶│ +DATA Square #3",
        r"written \[1, 2, 3\], received \[1, 2, 3\], ",
    ]
    remaining = iter(lines)
    for expected in story:
        assert any(re.search(expected, line) for line in remaining), f"{expected} in\n" + "\n".join(lines)


def test_lossy_link_is_the_same_each_time_and_another_by_another_seed() -> None:
    program = EXAMPLES / "04_lossy_link.py"
    once = output_of(program, "0.4", "7")
    assert once == output_of(program, "0.4", "7")
    assert once != output_of(program, "0.4", "8")
    assert once[-1].startswith("written [1, 2, 3, 4, 5], received [1, 2, 3, 4, 5], ")


def test_own_plugin_refuses_whom_the_builtin_one_admits() -> None:
    pytest.importorskip("cryptography")
    *met, misspelt = output_of(EXAMPLES / "05_own_plugin.py")
    assert met == [
        "alice and bob:     authenticated, and both hold one secret",
        "alice and mallory: alice refuses: CN=mallory is not on our list",
        "bob and mallory:   authenticated, and both hold one secret",
    ]
    assert misspelt.endswith(" is '__main__:AlowList': __main__ has no AlowList: did you mean AllowList?")
