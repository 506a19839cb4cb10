"""``ddsi typeof``, ``echo`` and ``pub`` on a topic of another vendor whose type this program never saw."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest

from ddsi import idl

from .framework import Namespace, Process, Scenario, async_test, namespace, scenario
from .peers.catalogue import CYCLONE_C, CYCLONE_PYTHON, OURS
from .peers.options import Options
from .peers.peer import ROOT, Peer, network_environment

pytestmark = pytest.mark.peers

DOMAIN = 1
DDSI = [sys.executable, "-m", "ddsi.cli"]

TRACK = """\
module radar {
  enum Kind {
    SHIP,
    PLANE
  };

  @final
  struct Point {
    double x;
    double y;
  };

  @final
  union Detail switch (int32) {
    case 1:
    case 2:
      @id(0) string name;
    default:
      sequence<uint8> blob;
  };

  @appendable
  struct Track {
    @key int32 id;
    Kind kind;
    sequence<Point> path;
    Detail detail;
    string<16> label;
    int32 grid[4];
    @optional string note;
  };
};
"""

TRACKS = [
    {"id": 0, "kind": "SHIP", "path": [{"x": 1.5, "y": 0.0}], "detail": {"discriminator": -1, "blob": "0102ff"},
     "label": "l", "grid": [1, 2, 3, 4], "note": None},
    {"id": 1, "kind": "PLANE", "path": [{"x": 1.5, "y": 1.0}, {"x": -2.0, "y": 0.25}],
     "detail": {"discriminator": 1, "name": "two"}, "label": "l", "grid": [1, 2, 3, 4], "note": "n"},
]  # fmt: skip


async def tracks(stage: Scenario, host: Namespace, role: str) -> Process:
    """The program of the other vendor, ready."""
    CYCLONE_PYTHON.locate()
    command = [sys.executable, "-m", "multiproc_tests.peers.programs.cyclonedds_tracks", role, str(DOMAIN)]
    environment = network_environment(host.interface)
    process = await stage.start(role, command, namespace=host, environment=environment, folder=ROOT)
    await process.expect("HOLDING", timeout=20)
    return process


async def ddsi(stage: Scenario, host: Namespace, *words: str) -> Process:
    command = [*DDSI, words[0], "-d", str(DOMAIN), *words[1:]]
    return await stage.start(words[0], command, namespace=host, environment=network_environment(host.interface))


def output(process: Process) -> list[str]:
    return [line.text for line in process.lines if line.stream == "out"]


def errors(process: Process) -> list[str]:
    return [line.text for line in process.lines if line.stream == "err"]


@async_test
async def test_typeof_shows_the_idl_of_each_type() -> None:
    """Both types of one topic, apart, with those who announce them; what is shown compiles to the same type."""
    with namespace() as host:
        async with scenario("typeof", deadline=60) as stage:
            programs = [await tracks(stage, host, role) for role in ("pub", "other")]
            typeof = await ddsi(stage, host, "typeof", "Track")
            as_json = await ddsi(stage, host, "typeof", "Track", "--json")
            await typeof.expect_exit(0, timeout=30)
            await as_json.expect_exit(0, timeout=30)
            for program in programs:
                await program.send("end")
    text = "\n".join(output(typeof))
    assert TRACK in text
    found = {one["type"]: one for one in json.loads("\n".join(output(as_json)))["types"]}
    assert sorted(found) == ["radar::Other", "radar::Track"]
    assert [one["kind"] for one in found["radar::Other"]["endpoints"]] == ["writer"]
    assert found["radar::Track"]["idl"] == TRACK
    assert f"complete {found['radar::Track']['identifiers']['complete'][2:]}" in text
    assert list(idl.loads(text)) == ["radar"]


@async_test
async def test_echo_prints_what_a_stranger_writes() -> None:
    """In its partition, with its history, and to the end of an instance."""
    with namespace() as host:
        async with scenario("echo", deadline=60) as stage:
            writer = await tracks(stage, host, "pub")
            echo = await ddsi(stage, host, "echo", "Track", "--json", "-n", "3")
            for text in TRACKS:
                await echo.expect(f'{{"data": {{"id": {text["id"]}, .*', timeout=30)
            await writer.send("dispose")
            await echo.expect_exit(0, timeout=30)
    samples = [json.loads(line) for line in output(echo)]
    assert [sample["data"] for sample in samples[:2]] == TRACKS
    assert (samples[2]["key"], samples[2]["state"]) == ({"id": 1}, "disposed")


@async_test
async def test_pub_writes_what_a_stranger_reads() -> None:
    with namespace() as host:
        async with scenario("pub", deadline=60) as stage:
            reader = await tracks(stage, host, "sub")
            values = ["id=7", "kind=PLANE", "path[1].y=2", "detail.name=deux", "label=abc", "grid[3]=9", "note=-"]
            pub = await ddsi(stage, host, "pub", "Track", *values, "--at-end", "dispose")
            await pub.expect_exit(0, timeout=30)
            await reader.expect("SAMPLE .*", timeout=10)
            await reader.expect("DISPOSED", timeout=10)
            wrong = await ddsi(stage, host, "pub", "Track", "id=7", "path[0].z=2")
            await wrong.expect_exit(2, timeout=30)
            await reader.send("end")
    sample = next(line.text for line in reader.lines if line.text.startswith("SAMPLE"))
    assert sample == (
        "SAMPLE Track(id=7, kind=<Kind.PLANE: 1>, path=[Point(x=0.0, y=0.0), Point(x=0.0, y=2.0)], "
        "detail=Detail[Union](1, 'deux'), label='abc', grid=[0, 0, 0, 9], note='-')"
    )
    assert errors(wrong)[-1] == "ddsi pub: path[0]: there is no member 'z'; there are x, y"


@async_test
async def test_a_peer_that_tells_no_type_is_read_with_the_users(tmp_path: Path) -> None:
    """``ddsi shapes`` announces what it is told to; here nothing but the type's name."""
    file = tmp_path / "shape.idl"
    file.write_text("@final struct ShapeType { @key string<128> color; int32 x; int32 y; int32 shapesize; };")
    with namespace() as host:
        async with scenario("without type information", deadline=60) as stage:
            silent = {"DDSI_URI": network_environment(host.interface)["DDSI_URI"].replace(
                "<Discovery>", "<Discovery><AnnounceTypes>false</AnnounceTypes>")}  # fmt: skip
            shapes = [*DDSI, "shapes", "pub", "-d", str(DOMAIN), "--rate", "20"]
            await stage.start("shapes", shapes, namespace=host, environment=silent)
            typeof = await ddsi(stage, host, "typeof", "Square")
            await typeof.expect_exit(1, timeout=30)
            alone = await ddsi(stage, host, "echo", "Square")
            await alone.expect_exit(2, timeout=30)
            told = await ddsi(stage, host, "echo", "Square", "--type", str(file), "-n", "2")
            await told.expect_exit(0, timeout=30)
    assert any("announces no type information" in line for line in output(typeof))
    assert errors(alone)[-1].endswith("Give its type: --type FILE.idl::NAME")
    assert all(line.startswith('color: "BLUE", x: ') for line in output(told))


@async_test
async def test_a_secured_topic_is_shown_to_those_with_rights(tmp_path: Path) -> None:
    """Everything is encrypted: one without an identity sees neither type nor samples."""
    with namespace() as host:
        async with scenario("secured", deadline=90) as stage:
            create = [*DDSI, "keystore", "create", str(tmp_path / "keys"), "-d", str(DOMAIN), "--preset", "encrypt-all"]
            made = await stage.start("keystore", [*create, "--identity", "alice", "--identity", "bob"])
            await made.expect_exit(0, timeout=20)
            alice, bob = (str(tmp_path / "keys" / "enclaves" / name) for name in ("alice", "bob"))
            shapes = [*DDSI, "shapes", "pub", "-d", str(DOMAIN), "--rate", "10", "--secure", alice]
            await stage.start("shapes", shapes, namespace=host, environment=network_environment(host.interface))
            echo = await ddsi(stage, host, "echo", "Square", "-n", "2", "--secure", bob)
            await echo.expect_exit(0, timeout=40)
            typeof = await ddsi(stage, host, "typeof", "Square", "--time", "4", "--secure", bob)
            stranger = await ddsi(stage, host, "typeof", "Square", "--time", "2")
            await typeof.expect_exit(0, timeout=40)
            await stranger.expect_exit(1, timeout=40)
    assert all(line.startswith('color: "BLUE", x: ') for line in output(echo))
    assert "struct ShapeType {" in output(typeof)
    assert output(stranger)[0] == "// Nobody was seen with a writer or reader of Square."


@pytest.mark.parametrize("peer", [CYCLONE_C, OURS], ids=str)
@async_test
async def test_every_vendor_that_tells_its_types_is_echoed(peer: Peer) -> None:
    """Cyclone DDS 0.10 in C, and our own program; cyclonedds for Python has its own tests above."""
    with namespace() as host:
        async with scenario(f"echo {peer}", deadline=60) as stage:
            options = Options(domain=DOMAIN, count=2, wait_s=40)
            await peer.start(stage, "pub", options, host=host)
            echo = await ddsi(stage, host, "echo", "Square", "-n", "2")
            await echo.expect_exit(0, timeout=40)
    assert output(echo) == ['color: "BLUE", x: 0, y: 0, shapesize: 30', 'color: "BLUE", x: 1, y: 2, shapesize: 30']
