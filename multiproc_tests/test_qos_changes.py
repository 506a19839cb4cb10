"""Policies that change on live endpoints, between processes and between implementations.  DDS 1.4 §2.2.3.

Fast DDS follows a changed partition.  Cyclone DDS does not, of an endpoint that it knows: we part from it all the same,
and when we meet it again samples go on.
"""

from __future__ import annotations

import sys

import pytest
import trio

from .framework import Namespace, Process, Scenario, async_test, namespace, scenario
from .peers.catalogue import CYCLONE_C, CYCLONE_PYTHON, FAST_DDS
from .peers.keystore import shared_keystore
from .peers.options import Options
from .peers.peer import Peer, network_environment

PROGRAMS = "multiproc_tests.peers.programs"
STEP_S = 20.0
DOMAIN = "1"


async def changing(stage: Scenario, host: Namespace, name: str, program: str, *arguments: str) -> Process:
    process = await stage.start(
        name,
        [sys.executable, "-m", f"{PROGRAMS}.{program}", *arguments],
        namespace=host,
        environment=network_environment(host.interface),
    )
    await process.expect("READY", timeout=STEP_S)
    return process


async def change(process: Process, line: str) -> None:
    await process.send(line)
    await process.expect(f"CHANGED {line.split()[0]}", timeout=STEP_S)


async def matched(*processes: Process, count: int = 1) -> None:
    for process in processes:
        await process.expect(f"MATCHED {count}", timeout=STEP_S)


@pytest.mark.peers
@pytest.mark.parametrize("reader", ["ours", "fastdds"])
@async_test
async def test_a_writer_leaves_a_partition_and_comes_back_by_a_wildcard(reader: str) -> None:
    if reader == "fastdds":
        FAST_DDS.locate()
    with namespace() as host:
        async with scenario("a partition that changes", deadline=90) as stage:
            writer = await changing(stage, host, "writer", "ddsi_changing", "pub", DOMAIN, "blue")
            if reader == "ours":
                other = await changing(stage, host, "reader", "ddsi_changing", "sub", DOMAIN, "blue")
            else:
                options = Options(domain=int(DOMAIN), partitions=("blue",), volatile=True, count=3)
                other = await FAST_DDS.start(stage, "sub", options, host=host)
            await matched(other, writer)
            await writer.send("write 1")
            await other.expect(r"SAMPLE (BLUE )?1 .*", timeout=STEP_S)
            await change(writer, "partition red")
            await matched(other, count=0)
            await writer.send("write 2")
            await change(writer, "partition b*")
            await matched(other)
            await writer.send("write 3")
            await other.expect(r"SAMPLE (BLUE )?3 .*", timeout=STEP_S)
            assert not other.matches(r"SAMPLE (BLUE )?2 .*")


@pytest.mark.peers
@pytest.mark.parametrize("peer", [CYCLONE_C, FAST_DDS], ids=["cyclone", "fastdds"])
@async_test
async def test_a_reader_that_meets_a_writer_again_has_its_history_once(peer: Peer) -> None:
    """Fast DDS sends all of it again.  Cyclone DDS has noticed nothing, and repeats what it is asked for."""
    peer.locate()
    with namespace() as host:
        async with scenario("history that is known", deadline=90) as stage:
            reader = await changing(stage, host, "reader", "ddsi_changing", "sub", DOMAIN, "blue", "--lasting")
            await peer.start(stage, "pub", Options(domain=int(DOMAIN), partitions=("blue",), count=3), host=host)
            for number in range(3):
                await reader.expect(rf"SAMPLE {number} .*", timeout=STEP_S)
            for _ in range(2):
                await change(reader, "partition red")
                await matched(reader, count=0)
                await trio.sleep(0.5)
                await change(reader, "partition blue")
                await matched(reader)
                await trio.sleep(2)
            assert len(reader.matches("SAMPLE .*")) == 3


@pytest.mark.peers
@pytest.mark.parametrize("governance", ["metadata-data", "data", "all-origin"])
@pytest.mark.parametrize("peer", [CYCLONE_C, FAST_DDS], ids=["cyclone", "fastdds"])
@async_test
async def test_secured_a_writer_leaves_a_partition_and_comes_back(peer: Peer, governance: str) -> None:
    """Fast DDS throws away the keys of who leaves, and Cyclone DDS does not notice."""
    peer.locate()
    folder, document = str(shared_keystore().folder), f"{governance}.p7s"
    with namespace() as host:
        async with scenario("a secured partition that changes", deadline=90) as stage:
            secure = ("--secure", document, folder)
            writer = await changing(stage, host, "writer", "ddsi_changing", "pub", DOMAIN, "blue", *secure)
            security = {"keystore": folder, "identity": "bob", "governance": document}
            options = Options(domain=int(DOMAIN), partitions=("blue",), volatile=True, count=4, **security)  # type: ignore[arg-type]
            reader = await peer.start(stage, "sub", options, host=host)
            await matched(reader, writer)
            await writer.send("write 1")
            await reader.expect("SAMPLE BLUE 1 .*", timeout=STEP_S)
            for number in (2, 3):
                await change(writer, "partition red")
                await matched(writer, count=0)
                await trio.sleep(0.5)
                await change(writer, "partition blue")
                await matched(writer)
                await writer.send(f"write {number}")
                await reader.expect(f"SAMPLE BLUE {number} .*", timeout=STEP_S)


@pytest.mark.peers
@pytest.mark.parametrize("role", ["pub", "sub"], ids=["its writer", "its reader"])
@async_test
async def test_samples_go_on_with_a_peer_that_noticed_nothing(role: str) -> None:
    CYCLONE_PYTHON.locate()
    with namespace() as host:
        async with scenario("parting from Cyclone DDS", deadline=90) as stage:
            theirs = await changing(stage, host, "cyclone", "cyclonedds_changing", role, DOMAIN, "blue")
            our_role = "sub" if role == "pub" else "pub"
            ours = await changing(stage, host, "ours", "ddsi_changing", our_role, DOMAIN, "blue")
            writer, reader = (theirs, ours) if role == "pub" else (ours, theirs)
            await matched(ours, theirs)
            await writer.send("write 1")
            await reader.expect("SAMPLE 1 .*", timeout=STEP_S)
            await change(ours, "partition red")
            await matched(ours, count=0)
            await writer.send("write 2")
            await change(ours, "partition blue")
            await matched(ours)
            await writer.send("write 3")
            await reader.expect("SAMPLE 3 .*", timeout=STEP_S)
            if role == "sub":  # its writer has kept for us what we did not acknowledge
                assert not reader.matches("SAMPLE 2 .*")
            assert not theirs.matches("MATCHED 0")


@pytest.mark.peers
@pytest.mark.parametrize(
    ("writers", "reader"),
    [("ddsi_changing", "cyclonedds_changing"), ("cyclonedds_changing", "ddsi_changing")],
    ids=["Cyclone DDS reads", "Cyclone DDS writes"],
)
@async_test
async def test_an_instance_changes_hands_when_a_strength_does(writers: str, reader: str) -> None:
    CYCLONE_PYTHON.locate()
    arguments = (DOMAIN, "blue", "--exclusive")
    with namespace() as host:
        async with scenario("strengths that change", deadline=90) as stage:
            one = await changing(stage, host, "one", writers, "pub", *arguments)
            await change(one, "strength 5")
            other = await changing(stage, host, "other", writers, "pub", *arguments)
            await change(other, "strength 3")
            listener = await changing(stage, host, "reader", reader, "sub", *arguments)
            await matched(one, other)
            await matched(listener, count=2)
            await one.send("write 1")
            await listener.expect(f"SAMPLE 1 {one.pid & 0xFFFF}", timeout=STEP_S)
            await other.send("write 2")
            await one.send("write 3")
            await listener.expect(f"SAMPLE 3 {one.pid & 0xFFFF}", timeout=STEP_S)
            await change(other, "strength 9")
            await trio.sleep(0.5)  # the change travels beside the samples
            await other.send("write 4")
            await listener.expect(f"SAMPLE 4 {other.pid & 0xFFFF}", timeout=STEP_S)
            await one.send("write 5")
            await other.send("write 6")
            await listener.expect(f"SAMPLE 6 {other.pid & 0xFFFF}", timeout=STEP_S)
            assert not listener.matches("SAMPLE (2|5) .*")


@async_test
async def test_a_deadline_that_is_no_longer_offered_parts_both_and_a_shorter_one_joins_them() -> None:
    with namespace() as host:
        async with scenario("deadlines that change", deadline=60) as stage:
            writer = await changing(stage, host, "writer", "ddsi_changing", "pub", DOMAIN, "blue")
            await change(writer, "deadline 2")
            reader = await changing(stage, host, "reader", "ddsi_changing", "sub", DOMAIN, "blue")
            await change(reader, "deadline 3")
            await matched(writer, reader)
            await change(writer, "deadline 4")
            for process in (writer, reader):
                await process.expect("MATCHED 0", timeout=STEP_S)
                await process.expect("INCOMPATIBLE deadline", timeout=STEP_S)
            await change(writer, "deadline 1")
            await matched(writer, reader)
