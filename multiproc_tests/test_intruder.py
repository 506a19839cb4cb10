"""A secured pair, and a process beside it that knows everything but the keys: nothing of his is accepted.

He has recorded all that passed from the first announcement on, and attacks those of the pair that are ours
(``peers/programs/intruder.py``) while they talk.  The same in virtual time, under more governances:
``tests/security/simulated/test_hostile.py``.
"""

from __future__ import annotations

import re
import signal
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from .framework import Namespace, Process, Scenario, async_test, namespace, scenario
from .matrix.stories import Cast
from .peers.catalogue import CYCLONE_C, FAST_DDS, OURS
from .peers.keystore import shared_keystore
from .peers.options import Options
from .peers.peer import Peer, network_environment

ROOT = Path(__file__).resolve().parents[1]
ORDERS = ("replay", "alter", "forge", "steal", "flood")
MOST_GROWTH_KIB = 96 << 10
"""Of a participant that comes to know hundreds of strangers."""
MORE_SAMPLES = 10


@pytest.mark.peers
@pytest.mark.parametrize(
    ("publisher", "subscriber", "governance"),
    [(OURS, OURS, "all-submessages"), (CYCLONE_C, OURS, "encrypt-all"), (OURS, FAST_DDS, "sign-all")],
    ids=str,
)
@async_test
async def test_nothing_of_an_intruder_is_accepted(publisher: Peer, subscriber: Peer, governance: str) -> None:
    for peer in (publisher, subscriber):
        peer.locate()
    options = Options(
        keystore=str(shared_keystore().folder),
        governance=f"{governance}.p7s",
        count=100_000,
        interval_ms=40,
        wait_s=120,
    )
    written, read = (replace(options, identity=name) for name in ("alice", "bob"))
    with namespace() as host:
        async with scenario(f"intruder-{governance}-{publisher}-{subscriber}", deadline=150) as stage:
            intruder = await _start_intruder(stage, host, options.topic)
            cast = Cast(stage, host, host, publisher, subscriber, written, read)
            reader, writer = await cast.start_subscriber(), await cast.start_publisher()
            victims = [process for process, peer in ((writer, publisher), (reader, subscriber)) if peer is OURS]
            await _until_more_samples(reader)
            before = [_resident_kib(victim) for victim in victims]
            for order in ORDERS:
                await intruder.send(order)
                await intruder.expect(f"DONE {order} .*", timeout=90)
                await _until_more_samples(reader)
            for victim, resident in zip(victims, before, strict=True):
                assert _resident_kib(victim) - resident < MOST_GROWTH_KIB
                await _check_reasons(victim)
            _check_samples(writer, reader)


async def _start_intruder(stage: Scenario, host: Namespace, topic: str) -> Process:
    command = [sys.executable, "-m", "multiproc_tests.peers.programs.intruder", topic]
    environment = network_environment(host.interface)
    intruder = await stage.start("intruder", command, namespace=host, environment=environment, folder=ROOT)
    await intruder.expect("READY", timeout=20)
    return intruder


async def _until_more_samples(reader: Process) -> None:
    for _ in range(MORE_SAMPLES):
        await reader.expect("SAMPLE .*", timeout=20)


def _check_samples(writer: Process, reader: Process) -> None:
    """What was written, in order, once each; and each of the two has met one other, once."""
    written = [match[1] for match in writer.matches("WROTE (.*)")]
    received = [match[1] for match in reader.matches("SAMPLE (.*)")]
    assert len(received) > MORE_SAMPLES * len(ORDERS)
    assert received == written[: len(received)]
    assert [match[0] for process in (writer, reader) for match in process.matches("MATCHED .*")] == ["MATCHED 1"] * 2


async def _check_reasons(victim: Process) -> None:
    """It has counted what it did not take, by reason, and said in its log who did not authenticate."""
    victim.signal(signal.SIGUSR1)
    counts = dict(word.split("=") for word in (await victim.expect("DROPPED (.*)"))[1].split())
    for reason in ("malformed_message", "rejected_by_security", "clear_text", "not_rtps"):
        assert int(counts.get(reason, 0)) > 0, f"{victim.name} counted nothing as {reason}: {counts}"
    log = [line.text for line in victim.lines if line.stream == "err"]
    assert any(re.search(r"authentication of [0-9a-f:]+: ", line) for line in log)


def _resident_kib(process: Process) -> int:
    status = Path(f"/proc/{process.pid}/status").read_text()
    (found,) = re.findall(r"^VmRSS:\s+(\d+) kB$", status, re.M)
    return int(found)
