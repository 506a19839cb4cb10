"""The ``ddsi`` command as people run it: real processes on a loopback of their own, with other vendors beside it."""

from __future__ import annotations

import json
import os
import re
import shlex
import shutil
import signal
import sys
from pathlib import Path
from typing import Any

import pytest
import trio

from .framework import Namespace, Process, Scenario, Unavailable, async_test, namespace, scenario
from .framework.namespace import bare_namespace
from .peers.catalogue import CYCLONE_C, CYCLONE_PYTHON, FAST_DDS
from .peers.options import Options
from .peers.peer import Peer, network_environment

DDSI = [sys.executable, "-m", "ddsi.cli"]
DOMAIN = 1
VENDORS = {CYCLONE_C: "Cyclone DDS", CYCLONE_PYTHON: "Cyclone DDS", FAST_DDS: "Fast DDS"}


async def _ddsi(
    stage: Scenario, host: Namespace, *words: str, name: str = "", unicast: bool = False, **environment: str
) -> Process:
    """Starts ``ddsi WORDS``."""
    network = network_environment(host.interface, [host.address] if unicast else None)
    return await stage.start(name or words[0], [*DDSI, *words], namespace=host, environment=network | environment)


async def _output(process: Process, *, status: int = 0, timeout: float = 20.0) -> list[str]:
    """All that it printed, once it has ended with this status."""
    await process.expect_exit(status, timeout=timeout)
    return [line.text for line in process.lines if line.stream == "out"]


def _errors(process: Process) -> list[str]:
    return [line.text for line in process.lines if line.stream == "err"]


# --- ls --------------------------------------------------------------------------------------------------------------


@pytest.mark.peers
@pytest.mark.parametrize("unicast", [False, True], ids=["multicast", "unicast"])
@async_test
async def test_ls_sees_every_vendor(unicast: bool) -> None:
    """Cyclone DDS in C and in Python and Fast DDS, each with a writer; ls does not list itself."""
    missing: list[Unavailable] = []
    with namespace() as host:
        async with scenario(f"ls {'by unicast' if unicast else ''}", deadline=60) as stage:
            started: list[Peer] = []
            for number, peer in enumerate(VENDORS):
                options = Options(domain=DOMAIN, topic=f"Square{number}", readers=0, unicast=unicast)
                try:
                    process = await peer.start(stage, "pub", options, host=host)
                except Unavailable as error:
                    missing.append(error)
                    continue
                started.append(peer)
                await process.expect("HOLDING")
            listing = await _ddsi(stage, host, "ls", "-d", str(DOMAIN), "--json", "--stats", unicast=unicast)
            form = json.loads("\n".join(await _output(listing)))
    vendors = sorted(participant["vendor"] for participant in form["participants"])
    assert vendors == sorted(VENDORS[peer] for peer in started)
    for participant in form["participants"]:
        _check_participant(participant)
    assert form["domain_id"] == DOMAIN
    assert len(form["topics"]) == len(started)
    assert all(isinstance(count, int) for count in form["stats"]["dropped"].values())
    if missing:
        raise missing[0]


def _check_participant(form: dict[str, Any]) -> None:
    """Every documented member, of its type."""
    guid = r"[0-9a-f]{8}:[0-9a-f]{8}:[0-9a-f]{8}"
    assert re.fullmatch(guid, form["prefix"])
    assert form["guid"] == f"{form['prefix']}:000001c1"
    assert form["vendor_id"] == {"Cyclone DDS": "0110", "Fast DDS": "010f"}[form["vendor"]]
    assert re.fullmatch(r"2\.\d", form["protocol_version"])
    assert form["domain_id"] == DOMAIN
    assert form["lease"] in (10.0, 20.0)
    assert form["host"] == os.uname().nodename
    assert isinstance(form["pid"], int)
    assert form["secured"] is False
    unicast = form["locators"]["metatraffic_unicast"]
    assert all(locator.startswith("udpv4/127.0.0.1:") for locator in unicast)
    assert unicast
    (endpoint,) = form["endpoints"]
    assert re.fullmatch(guid + ":[0-9a-f]{8}", endpoint["guid"])
    assert (endpoint["kind"], endpoint["type"], endpoint["keyed"]) == ("writer", "ShapeType", True)
    assert endpoint["topic"].startswith("Square")
    assert endpoint["qos"]["reliability"]["kind"] == "Reliable"
    assert endpoint["qos"]["durability"] == {"kind": "TransientLocal"}
    assert endpoint["matched"] == []


@async_test
async def test_ls_lists_what_was_asked_for() -> None:
    """Without a terminal the tables are plain text: no escapes."""
    with namespace() as host:
        async with scenario("ls of ours", deadline=60) as stage:
            publisher = await _ddsi(stage, host, "shapes", "pub", "-d", "1", "-t", "Square,Circle", "--rate", "5")
            await publisher.expect(r"Square +BLUE .*")
            everything = await _output(await _ddsi(stage, host, "ls", "-d", "1"))
            topics = await _output(await _ddsi(stage, host, "ls", "topics", "-d", "1", "--topic", "C*"))
            nobody = await _ddsi(stage, host, "ls", "-d", "2", "--time", "0.3")
            await nobody.expect_exit(0)
    text = "\n".join(everything)
    assert "\x1b" not in text
    assert "Participants of domain 1: 1" in text
    assert re.search(r"\n +1 +ddsi +ddsi shapes pub ", text)
    assert re.search(r"\n +Circle +writer +ShapeType +#1 ddsi +0 +reliable, volatile +", text)
    assert topics[0] == "Topics: 1"
    assert topics[2].split() == ["Circle", "ShapeType", "1", "0", "-"]
    assert "nobody answered" in _errors(nobody)[0]


@async_test
async def test_ls_watch_without_a_terminal_is_a_line_for_each_change() -> None:
    """Who comes, who goes; Ctrl+C ends it with 130."""
    with namespace() as host:
        async with scenario("ls --watch", deadline=60) as stage:
            watching = await _ddsi(stage, host, "ls", "--watch", "-d", "1")
            publisher = await _ddsi(stage, host, "shapes", "pub", "-d", "1", "-n", "3", "--rate", "5", "--wait", "1")
            await watching.expect(r"..:..:.. \+ participant 01dd\S+ ddsi \"ddsi shapes pub\" at 127.0.0.1:\d+")
            await watching.expect(r"..:..:.. \+ writer \S+ Square ShapeType fits 0: reliable, volatile")
            subscriber = await _ddsi(stage, host, "shapes", "sub", "-d", "1", "-t", "Square", "-r", "-n", "3")
            await watching.expect(r"..:..:.. \+ reader \S+ Square ShapeType fits 1: reliable, volatile\S*.*")
            await publisher.expect_exit(0)
            await subscriber.expect_exit(0)
            await watching.expect(r"..:..:.. - participant 01dd\S+ ddsi \"ddsi shapes .ub\" .*")
            await watching.expect(r"..:..:.. - participant 01dd\S+ ddsi \"ddsi shapes .ub\" .*")
            watching.signal(signal.SIGINT)
            await watching.expect_exit(130)
            assert _errors(watching) == []


@async_test
async def test_a_pipe_that_is_closed_early() -> None:
    """``head`` has what it wanted; the command ends though nothing more happens, and says nothing."""
    with namespace() as host:
        async with scenario("closed pipes", deadline=60) as stage:
            for words in ("ls --watch --json -d 1", "trace -d 1", "sim --scenario lossy-link --diagram", "demo"):
                line = f"{shlex.join([*DDSI, *words.split()])} | head -n 1; exit ${{PIPESTATUS[0]}}"
                shell = await stage.start(
                    words, ["bash", "-c", line], namespace=host, environment=network_environment("lo")
                )
                assert len(await _output(shell, status=141)) == 1
                assert _errors(shell) == []


# --- a terminal ------------------------------------------------------------------------------------------------------


async def _on_terminal(stage: Scenario, host: Namespace, *words: str) -> Process:
    """The command on a pseudo-terminal; what is sent to the process is typed."""
    if shutil.which("script") is None:
        raise Unavailable("the program 'script' is missing: apt-get install bsdutils")
    environment = {**network_environment(host.interface), "TERM": "xterm", "COLUMNS": "120", "LINES": "40"}
    environment["NO_COLOR"] = ""
    command = ["script", "-qefc", shlex.join([*DDSI, *words]), "/dev/null"]
    return await stage.start(f"{words[0]} on a terminal", command, namespace=host, environment=environment)


@async_test
async def test_ls_watch_on_a_terminal() -> None:
    """It paints, takes the terminal back to what it was, and Ctrl+C is 130."""
    with namespace() as host:
        async with scenario("ls --watch on a terminal", deadline=60) as stage:
            watching = await _on_terminal(stage, host, "ls", "--watch", "--stats", "-d", "1")
            await watching.expect(r".*Participants of domain 1: 0.*")
            await _ddsi(stage, host, "shapes", "pub", "-d", "1", "--time", "15")
            await watching.expect(r".*Participants of domain 1: 1.*")
            await watching.expect(r".*Square.*writer.*ShapeType.*reliable, volatile.*")
            await watching.send("\x03")
            await watching.expect_exit(130)
    painted = "\n".join(line.text for line in watching.lines if line.stream == "out")
    assert painted.startswith("\x1b[?1049h")
    assert painted.rstrip().endswith("\x1b[?25h\x1b[?1049l")


@async_test
async def test_shapes_on_a_terminal() -> None:
    """A subscriber draws the shape in its colour, and says how many came when it ends."""
    with namespace() as host:
        async with scenario("shapes on a terminal", deadline=60) as stage:
            subscriber = await _on_terminal(stage, host, "shapes", "sub", "-d", "1", "-n", "20")
            await subscriber.expect(r".*┌─+┐.*")
            await _ddsi(stage, host, "shapes", "pub", "-d", "1", "-c", "RED", "--size", "60", "--time", "15")
            await subscriber.expect(r".*│ *\x1b\[38;5;196m█+\x1b\[0m *│.*")
            await subscriber.expect(r".*Square +\d+ samples?, 1 writer matched.*")
            await subscriber.expect(r".*\x1b\[\?1049lSquare +20 samples, 1 writer matched", timeout=15)
            await subscriber.expect_exit(0)


# --- shapes ----------------------------------------------------------------------------------------------------------


@pytest.mark.peers
@pytest.mark.parametrize("peer", VENDORS, ids=str)
@async_test
async def test_shapes_with_another_vendor(peer: Peer) -> None:
    """Both ways: theirs reads what we publish, we read what theirs publishes."""
    with namespace() as host:
        async with scenario(f"shapes with {peer}", deadline=60) as stage:
            theirs = await peer.start(stage, "sub", Options(domain=DOMAIN, volatile=True, count=5), host=host)
            words = ["-d", "1", "-n", "5", "--wait", "1", "--keep-all", "--time", "15"]
            ours = await _ddsi(stage, host, "shapes", "pub", *words)
            written = [
                f"SAMPLE {color} {int(x)} {int(y)} {size}" for color, x, y, size in _samples(await _output(ours))
            ]
            assert len(written) == 5
            for sample in written:
                await theirs.expect(re.escape(sample))

            words = ["-d", "1", "-t", "Circle", "-r", "--keep-all", "-n", "5", "--time", "15"]
            ours = await _ddsi(stage, host, "shapes", "sub", *words)
            options = Options(domain=DOMAIN, topic="Circle", colors=("GREEN",), volatile=True, count=5)
            theirs = await peer.start(stage, "pub", options, host=host)
            received = _samples(await _output(ours))
            await theirs.expect("HOLDING")
            assert [f"WROTE {color} {int(x)} {int(y)} {size}" for color, x, y, size in received] == [
                found[0] for found in theirs.matches("WROTE .*")
            ]


def _samples(lines: list[str]) -> list[tuple[str, ...]]:
    found = [re.fullmatch(r"\w+ +(\w+) +(\d+) (\d+) \[(\d+)\]", line) for line in lines]
    assert all(found)
    return [match.groups() for match in found if match]


@async_test
async def test_shapes_types_and_qos_between_ours() -> None:
    """A late joiner gets the history of an appendable shape in XCDR2, in a partition; an instance's end is told."""
    qos = ["-d", "1", "-t", "Triangle", "-p", "yard", "-x", "2", "--extensibility", "appendable", "-r"]
    with namespace() as host:
        async with scenario("late joiner", deadline=60) as stage:
            lasting = ["--transient-local", "--keep-last", "3"]
            publisher = await _ddsi(
                stage, host, "shapes", "pub", *qos, *lasting, "-n", "100", "--rate", "20", "--at-end", "dispose"
            )
            for _ in range(10):
                await publisher.expect(r"Triangle +BLUE .*")
            subscriber = await _ddsi(stage, host, "shapes", "sub", *qos, *lasting, "--time", "9")
            outside = await _ddsi(
                stage, host, "shapes", "sub", "-d", "1", "-t", "Triangle", "--time", "5", name="outside"
            )
            await publisher.expect_exit(0)
            await subscriber.expect(r"Triangle +BLUE +disposed")
            received = await _output(subscriber)
            assert await _output(outside) == []
    written = [line.text for line in publisher.lines if line.stream == "out"]
    samples = [line for line in received if "[" in line]
    assert len(samples) >= 3
    assert samples == written[-len(samples) :]


@async_test
async def test_shapes_say_what_did_not_come() -> None:
    """Status 1 and a sentence where a count was asked for and the time is up."""
    with namespace() as host:
        async with scenario("nobody there", deadline=60) as stage:
            subscriber = await _ddsi(stage, host, "shapes", "sub", "-d", "2", "-n", "3", "--time", "0.5")
            publisher = await _ddsi(stage, host, "shapes", "pub", "-d", "1", "-n", "3", "--wait", "1", "--time", "0.5")
            await subscriber.expect_exit(1)
            await publisher.expect_exit(1)
    assert "ddsi shapes: 0 of 3 samples came in 0.5 s" in _errors(subscriber)
    assert "ddsi shapes: not everything was written in 0.5 s" in _errors(publisher)


# --- why -------------------------------------------------------------------------------------------------------------


@async_test
async def test_why_names_policy_values_and_remedy() -> None:
    """Status 1 as long as something does not fit, 0 once all does."""
    with namespace() as host:
        async with scenario("why", deadline=60) as stage:
            await _ddsi(stage, host, "shapes", "pub", "-d", "1", "-b", "--time", "20")
            subscriber = await _ddsi(stage, host, "shapes", "sub", "-d", "1", "-r", "--transient-local", "-t", "Square")
            text = await _output(await _ddsi(stage, host, "why", "-d", "1"), status=1)
            machine = await _output(await _ddsi(stage, host, "why", "Square", "-d", "1", "--json"), status=1)
            other = await _output(await _ddsi(stage, host, "why", "Circle", "-d", "1", "--time", "1"), status=1)
            subscriber.signal(signal.SIGTERM)
            await subscriber.expect_exit(143)
            await _output(await _ddsi(stage, host, "why", "-d", "1", "--time", "1"))
    assert text[0] == "Square: 1 writer and 1 reader do not match"
    assert "  reliability: offered BestEffort, requested Reliable" in text
    assert "    remedy: make the writer Reliable(), or let the reader be content with BestEffort()" in text
    (mismatch,) = json.loads("\n".join(machine))["mismatches"]
    assert (mismatch["topic"], mismatch["kind"]) == ("Square", "qos")
    assert [one["policy"] for one in mismatch["disagreements"]] == ["reliability", "durability"]
    assert {*mismatch["disagreements"][0]} == {"policy", "offered", "requested", "detail", "remedy"}
    assert mismatch["writer"]["entity_name"] == "ddsi shapes pub"
    assert "Nobody was seen with a writer or reader of Circle" in other[0]


# --- trace -----------------------------------------------------------------------------------------------------------


@async_test
async def test_trace_records_follows_and_draws(tmp_path: Path) -> None:
    """A recording is drawn while it grows, and again when it is complete; both kinds of file hold the discovery."""
    lines, capture = tmp_path / "seen.jsonl", tmp_path / "seen.pcapng"
    with namespace() as host:
        async with scenario("trace", deadline=60) as stage:
            recording = await _ddsi(
                stage, host, "trace", "-d", "1", "--record", str(lines), "--time", "4", name="record"
            )
            with trio.fail_after(10):
                while not lines.exists():
                    await trio.sleep(0.02)
            following = await _ddsi(stage, host, "trace", str(lines), "--follow", name="follow")
            capturing = await _ddsi(
                stage, host, "trace", "-d", "1", "--record", str(capture), "--time", "3", name="pcap"
            )
            await following.expect(r"A = 01dd\S+ +ddsi.*")
            await _ddsi(stage, host, "shapes", "pub", "-d", "1", "--time", "15")
            await following.expect(r".*discovered writer Square@. \(ShapeType\).*")
            await recording.expect_exit(0)
            await capturing.expect_exit(0)
            following.signal(signal.SIGINT)
            await following.expect_exit(130)
            assert _errors(following) == []
            drawn = await _output(await _ddsi(stage, host, "trace", str(lines), name="draw"))
            captured = await _output(await _ddsi(stage, host, "trace", str(capture), "--text", name="text"))
    assert any('"ddsi trace"' in line for line in drawn)
    assert any("discovered writer Square@" in line for line in drawn)
    assert any("DATA SEDP pub" in line for line in captured)
    assert any("DATA SPDP" in line for line in captured)


@async_test
async def test_trace_watches_live() -> None:
    with namespace() as host:
        async with scenario("trace, live", deadline=60) as stage:
            watching = await _ddsi(stage, host, "trace", "-d", "1", "--text", "--only", "discovery")
            await watching.expect(r"A = 01dd\S+  ddsi")
            await watching.expect(r" +0\.000000  A participant created in domain 1")
            await _ddsi(stage, host, "shapes", "pub", "-d", "1", "--time", "15")
            await watching.expect(r"B = 01dd\S+  ddsi \"ddsi shapes pub\"")
            await watching.expect(r" +\d+\.\d+  A discovered B \(ddsi, lease 20 s\)")
            await watching.expect(r" +\d+\.\d+  A discovered writer Square@B \(ShapeType\), .*")
            watching.signal(signal.SIGINT)
            await watching.expect_exit(130)


@async_test
async def test_a_file_that_cannot_be_written() -> None:
    with namespace() as host:
        async with scenario("no such folder", deadline=30) as stage:
            recording = await _ddsi(stage, host, "trace", "-d", "1", "--record", "/nowhere/at/all.jsonl")
            await recording.expect_exit(2)
            (sentence,) = _errors(recording)
    assert sentence.startswith("ddsi trace: ")
    assert "/nowhere/at/all.jsonl" in sentence


# --- demo, doctor ----------------------------------------------------------------------------------------------------


@pytest.mark.peers
@async_test
async def test_demo_with_a_foreign_peer() -> None:
    """Data flows between two processes of ours and one of Cyclone DDS, then between a secured pair; an intruder is kept
    out.  It ends by itself with 0, without a terminal."""
    CYCLONE_PYTHON.locate()
    with namespace() as host:
        async with scenario("demo", deadline=60) as stage:
            demo = await _ddsi(stage, host, "demo")
            await demo.close_input()
            lines = await _output(demo, timeout=58)
    for line in (
        "subscriber received all 40 samples of publisher.",
        "subscriber received all 40 samples of cyclonedds.",
        "cyclonedds received all 40 samples of publisher.",
        "bob received all 20 samples of alice.",
    ):
        assert line in lines
    assert sum(line.startswith("cyclonedds received Square BLUE ") for line in lines) == 40
    assert sum(line.startswith("subscriber received ") for line in lines) == 80 + 2
    assert sum(line.startswith("bob        received Square GREEN ") for line in lines) == 20
    assert not any(line.startswith("bob        received Square RED ") for line in lines)
    (told,) = (line for line in lines if line.startswith("mallory    may not "))
    assert re.search(r"permissions\.p7s, grant 'mallory' \(line \d+\): .* Missing right: publish .*'Square'", told)
    refused = sorted(line for line in lines if line.startswith("bob        refused  permissions of 'CN=mallory'"))
    assert len(refused) == 2
    assert re.search(r"grant 'mallory' \(line \d+\): .* Missing right: publish .*'Square'", refused[0])
    assert "signed by another certificate" in refused[1]
    assert re.fullmatch(r"On the wire: BLUE of .* GREEN of alice not once in [\d,]+\.", lines[-1])
    assert not any("\x1b" in line for line in lines)


def _without(*packages: str) -> list[str]:
    """The demo, where these packages are not installed."""
    absent = "; ".join(f"sys.modules[{name!r}] = None" for name in packages)
    return [sys.executable, "-c", f"import sys; {absent}; from ddsi.cli import main; sys.exit(main(['demo']))"]


@async_test
async def test_demo_without_a_foreign_peer_and_without_security() -> None:
    with namespace() as host:
        async with scenario("demo of ours", deadline=60) as stage:
            demo = await stage.start("demo", _without("cyclonedds", "cryptography"), namespace=host)
            lines = await _output(demo, timeout=55)
    assert lines[1].startswith("No other DDS is installed here")
    assert lines[-2:] == [
        "subscriber received all 40 samples of publisher.",
        "Security is not shown: cryptography missing; pip install 'ddsi[security]'.",
    ]


@async_test
async def test_demo_with_a_foreign_peer_that_does_not_start(tmp_path: Path) -> None:
    """A package that is there but broken is said to be, and the demo goes on without it."""
    broken = tmp_path / "cyclonedds"
    broken.mkdir()
    (broken / "__init__.py").write_text("raise ImportError('no libddsc here')")
    with namespace() as host:
        async with scenario("demo, broken peer", deadline=60) as stage:
            demo = await _ddsi(stage, host, "demo", PYTHONPATH=str(tmp_path))
            lines = await _output(demo, timeout=55)
    assert "does not start (ImportError: no libddsc here)" in lines[1]
    assert "subscriber received all 40 samples of publisher." in lines


@async_test
async def test_demo_says_what_did_not_arrive() -> None:
    """In a network without even a loopback: status 1, a clear sentence, and what the processes said."""
    with bare_namespace() as host:
        async with scenario("demo without a network", deadline=60) as stage:
            demo = await stage.start("demo", _without("cyclonedds"), namespace=host)
            await demo.expect_exit(1, timeout=55)
            sentence, *details = _errors(demo)
    assert sentence == "ddsi demo: subscriber received 0 of 40 samples of publisher"
    assert any("127.0.0.1" in line for line in details)


@async_test
async def test_doctor_in_a_network_of_its_own() -> None:
    with namespace() as host:
        async with scenario("doctor", deadline=30) as stage:
            form = json.loads("\n".join(await _output(await _ddsi(stage, host, "doctor", "--json"))))
    found = {finding["subject"]: finding for finding in form["findings"]}
    assert form["faults"] == 0
    assert found["multicast"]["text"] == "a datagram to 239.255.0.1 on lo comes back"
    assert found["sockets"]["text"] == "a participant of domain 0 would use lo, port 7410 (participant index 0)"
