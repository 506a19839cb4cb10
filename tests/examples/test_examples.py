"""Every example runs alone, ends by itself, and prints what its docstring promises."""

from __future__ import annotations

import ast
import re
import shlex
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
def in_background(
    name: str, role: str, env: dict[str, str], folder: Path | None = None
) -> Iterator[subprocess.Popen[str]]:
    command = [sys.executable, str(EXAMPLES / name), role]
    process = subprocess.Popen(command, env=env, cwd=folder, stdout=subprocess.PIPE, text=True, encoding="utf-8")
    with process:
        try:
            yield process
        finally:
            process.kill()


def other_role(name: str, role: str, env: dict[str, str], folder: Path | None = None) -> list[str]:
    command = [sys.executable, str(EXAMPLES / name), role]
    done = subprocess.run(
        command, env=env, cwd=folder, capture_output=True, text=True, encoding="utf-8", timeout=30, check=True
    )
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


SECURED = EXAMPLES / "06_secured.py"
TEMPERATURES = [f"bob received {celsius:.1f} of the cellar" for celsius in (11.0, 11.5, 12.0)]


@pytest.fixture(scope="module")
def keystore(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder where the two commands that the example names were run."""
    pytest.importorskip("cryptography")
    folder = tmp_path_factory.mktemp("secured")
    commands = re.findall(r"^    ddsi (keystore .*)$", SECURED.read_text(encoding="utf-8"), re.MULTILINE)
    assert len(commands) == 2
    for words in commands:
        subprocess.run(
            [sys.executable, "-m", "ddsi.cli", *shlex.split(words)],
            env=environment(),
            cwd=folder,
            stdout=subprocess.DEVNULL,
            timeout=30,
            check=True,
        )
    return folder


def assert_bob_is_told(lines: list[str]) -> None:
    (told,) = lines
    assert re.fullmatch(
        r"bob may not publish: .*permissions\.p7s, grant 'bob' \(line \d+\): .* Missing right: publish 'Temperatures'",
        told,
    )


def test_secured(keystore: Path) -> None:
    *received, told = output_of(SECURED, folder=keystore)
    assert received == TEMPERATURES
    assert_bob_is_told([told])


def test_secured_in_two_processes(keystore: Path) -> None:
    env = environment()
    with in_background(SECURED.name, "subscribe", env, keystore) as subscriber:
        assert other_role(SECURED.name, "publish", env, keystore) == []
        output, _ = subscriber.communicate(timeout=30)
    assert output.splitlines() == TEMPERATURES
    assert_bob_is_told(output_of(SECURED, "intrude", folder=keystore))


def test_secured_tells_how_to_make_the_keystore_that_it_misses(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, str(SECURED)], env=environment(), cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stdout) == (1, "")
    told = [line for line in done.stderr.splitlines() if line.startswith("    ddsi keystore ")]
    assert len(told) == 2
    assert all(line in (ast.get_docstring(ast.parse(SECURED.read_text(encoding="utf-8"))) or "") for line in told)


WHO = EXAMPLES / "07_who_is_there.py"


def who_came_and_went(alice: str, bob: str) -> set[str]:
    """What it prints when these are the identities of the two; in which order they come, chance decides."""
    there = {
        f"participant station                     {alice}",
        f"writer      thermometer of Temperatures {alice}",
        f"participant office                      {bob}",
        f"reader      display of Temperatures     {bob}",
    }
    return {f"{sign} {line}" for sign in "+-" for line in there}


def assert_they_came_and_went(lines: list[str], alice: str, bob: str) -> None:
    expected = who_came_and_went(alice, bob)
    assert {line for line in lines if line[0] in "+-"} == expected
    for came in (line for line in expected if line[0] == "+"):
        assert lines.index(came) < lines.index("-" + came[1:])


def test_who_is_there() -> None:
    lines = output_of(WHO)
    assert_they_came_and_went(lines, "not authenticated", "not authenticated")
    told = "  11.0 degrees came for everybody to see, from the thermometer, not authenticated"
    assert [line for line in lines if line[0] == " "] == [told]


def test_who_is_there_and_has_proved_it(keystore: Path) -> None:
    lines = output_of(WHO, "keystore/enclaves", folder=keystore)
    assert_they_came_and_went(lines, "CN=alice", "CN=bob")
    told = "  11.0 degrees came protected, from the thermometer, CN=alice"
    assert [line for line in lines if line[0] == " "] == [told]


def test_who_is_there_in_another_process() -> None:
    env = environment()
    with in_background(WHO.name, "watch", env) as watcher:
        subprocess.run([sys.executable, str(WHO)], env=env, stdout=subprocess.DEVNULL, timeout=30, check=True)
        assert watcher.stdout is not None
        expected = who_came_and_went("not authenticated", "not authenticated")
        while expected:
            line = watcher.stdout.readline()
            assert line, f"it ended without {expected}"
            expected.discard(line.rstrip("\n"))


def test_without_trio() -> None:
    assert output_of(EXAMPLES / "08_without_trio.py") == ["2 + 2 = 4", "3 + 3 = 6", "5 + 5 = 10"]


def test_request_and_reply() -> None:
    assert sorted(output_of(EXAMPLES / "09_request_reply.py")) == [
        "alice: heartbeat: says which samples there are",
        "bob:   nothing, REMOTE_EX_INVALID_ARGUMENT",
    ]


def test_coherent_sets() -> None:
    poses = [f"at ({step}, {2 * step}), looking to {90 * step} degrees" for step in range(4)]
    assert sorted(output_of(EXAMPLES / "10_coherent_sets.py")) == [*poses, "withdrawn: the compass does not answer"]


def test_unknown_type() -> None:
    assert output_of(EXAMPLES / "11_unknown_type.py")[-3:] == [
        "",
        "the stranger reads Report(station='Oslo', wind=Wind(speed=3.5, gusts=array('f', [4.0, 7.5])), remark=None)",
        "the owner reads rain from Bergen",
    ]
