"""``ddsi demo``: its stage, and how it judges what happened; the whole play is ``multiproc_tests``' business."""

from __future__ import annotations

import sys
from collections.abc import Awaitable, Callable
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import pytest
import trio

from ddsi.cli.demo_secured import SecuredScene, _flaws, missing_packages
from ddsi.cli.demo_stage import Actor, Stage, open_stage
from tests.examples.running import ROOT


def actor(name: str, *, status: int = 0, refuses: int = 0, **received: int) -> Actor:
    """One whose process has ended, after receiving so many squares of these colours."""
    made = Actor(name, cast(trio.Process, SimpleNamespace(returncode=status)), "received")
    for colour, count in received.items():
        made.counts["received", "Square", colour] = count
    made.refusals = {f"reason {number}" for number in range(refuses)}
    return made


def on_stage(folder: Path, play: Callable[[Stage], Awaitable[None]]) -> None:
    async def run() -> None:
        with trio.fail_after(60):
            async with open_stage(folder) as stage:
                await play(stage)

    trio.run(run)


# --- the stage -------------------------------------------------------------------------------------------------------


def test_an_actor_is_counted_by_what_it_says_and_heard_when_it_refuses(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    program = (
        "import sys; print('Square     RED        001 002 [30]'); print('READY');"
        "print('ddsi shapes: refused participant 01dd:2:3:4: it is not signed', file=sys.stderr);"
        "print('ddsi shapes: Square: refused 01dd:2:3:5: no rule: none', file=sys.stderr);"
        "print('ddsi shapes: Square: 1 writer matched', file=sys.stderr)"
    )

    async def play(stage: Stage) -> None:
        bob = await stage.start("bob", ["-c", program], verb="received")
        await bob.wait_for_refusals(2)
        await bob.has_ended.wait()
        assert bob.counts == {("received", "Square", "RED"): 1}
        assert bob.is_ready.is_set()
        assert bob.refusals == {"it is not signed", "no rule: none"}

    on_stage(tmp_path, play)
    assert sorted(capsys.readouterr().out.splitlines()) == [
        "bob        received Square RED 001 002 [30]",
        "bob        refused  it is not signed",
        "bob        refused  no rule: none",
    ]


def test_no_process_outlives_the_play(tmp_path: Path) -> None:
    started: list[Actor] = []

    async def play(stage: Stage) -> None:
        started.append(await stage.start("alice", ["-c", "import time; time.sleep(60)"], verb=""))

    on_stage(tmp_path, play)
    assert [one.process.returncode for one in started] == [-15]


def test_everybody_is_told_to_stay_on_the_loopback(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever the environment says; and a folder whose name is no XML is no obstacle to a capture."""
    monkeypatch.setenv("DDSI_URI", "<DDSI/>")
    program = (
        "from ddsi.config.environment import load_config; c = load_config(0); print(*c.interfaces, c.pcap_file, 'end')"
    )

    async def play(stage: Stage) -> None:
        bob = await stage.start("bob", ["-c", program], verb="", capture=Path("/a<&b/c.pcapng"))
        await bob.has_ended.wait()
        assert bob.counts == {("127.0.0.1", "/a<&b/c.pcapng", "end"): 1}, bob.errors

    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    on_stage(tmp_path, play)


# --- the secured scene -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("bob", "flaws"),
    [
        (actor("bob", GREEN=20, refuses=2), []),
        (actor("bob", GREEN=19, refuses=2), ["bob received 19 of 20 samples of alice"]),
        (actor("bob", GREEN=19, RED=1), ["bob received 1 samples of mallory, who may not write"]),
        (actor("bob", GREEN=20, refuses=1), ["bob refused 1 of 2 attempts of mallory"]),
        (actor("bob", GREEN=20, refuses=2, status=1), ["bob ended with status 1"]),
    ],
)
def test_what_is_found_wanting(bob: Actor, flaws: list[str]) -> None:
    assert _flaws(actor("alice"), bob, [actor("mallory", status=-15), actor("mallory", status=-15)]) == flaws


def scene(folder: Path, protected: bytes) -> SecuredScene:
    (folder / "alice.pcapng").write_bytes(protected)
    return SecuredScene(cast(Stage, SimpleNamespace(folder=folder)), 0)


@pytest.mark.parametrize(
    ("clear", "protected", "flaws"),
    [
        (b"..BLUE..BLUE", bytes(40), []),
        (b"..BLUE..", b"..GREEN..", ["GREEN of alice could be read 1 times on the wire"]),
        (b"........", bytes(40), ["the capture of publisher does not show what it wrote"]),
    ],
)
def test_captures_are_searched(tmp_path: Path, clear: bytes, protected: bytes, flaws: list[str]) -> None:
    (tmp_path / "publisher.pcapng").write_bytes(clear)
    assert scene(tmp_path, protected).compare_wires(tmp_path / "publisher.pcapng") == flaws


def test_a_keystore_that_cannot_be_made_is_said_to_be(tmp_path: Path) -> None:
    (tmp_path / "keystore").write_text("a file in its place")

    async def play(stage: Stage) -> None:
        secured = SecuredScene(stage, 0)
        await secured.prepare()
        (flaw,) = await secured.play()
        assert flaw.startswith("no keystore could be made: ddsi keystore: ")

    pytest.importorskip("cryptography")
    on_stage(tmp_path, play)


def test_what_the_extra_brings_is_missed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "lxml", None)
    assert "lxml" in missing_packages()
