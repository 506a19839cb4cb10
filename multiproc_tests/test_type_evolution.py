"""Types that grow on one side only, between processes of ours and of Cyclone DDS 11: every sample arrives.

What the writer does not know has its default, and what the reader does not know is passed over.

DDS-XTypes 1.3 §7.2.4 (assignability), §7.4.3.5 (appendable and mutable types in XCDR2) and §7.4.1 (in XCDR1).
"""

from __future__ import annotations

import json
import sys
from typing import Any

import pytest

from .framework import async_test, namespace, scenario
from .peers.catalogue import CYCLONE_PYTHON, OURS
from .peers.peer import Peer, network_environment

PROGRAMS = "multiproc_tests.peers.programs"
COMMANDS = {OURS: f"{PROGRAMS}.ddsi_evolution", CYCLONE_PYTHON: f"{PROGRAMS}.cyclonedds_evolution"}
COUNT = 5
STEP_S = 30.0

Samples = dict[str, list[dict[str, Any]]]


def expected_of_topic(topic: str, written: str, read: str) -> list[dict[str, Any]]:
    samples = []
    for number in range(COUNT):
        sample: dict[str, Any] = {"id": number, "name": f"name {number}", "x": number / 2}
        if topic == "Grown":
            sample["points"] = [{"x": number, "y": index} for index in range(3)]
        if read == "new":
            is_told = written == "new"
            sample["more"] = [number, number + 1] if is_told else []
            sample["note"] = f"note {number}" if is_told else None
            for point in sample.get("points", ()):
                point["z"] = 9 if is_told else 0
        samples.append(sample)
    return samples


@pytest.mark.peers
@pytest.mark.parametrize(("written", "read"), [("old", "new"), ("new", "old"), ("new", "new")])
@pytest.mark.parametrize(("writer", "reader"), [(OURS, CYCLONE_PYTHON), (CYCLONE_PYTHON, OURS), (OURS, OURS)])
@async_test
async def test_both_versions_of_a_type_understand_each_other(
    writer: Peer, reader: Peer, written: str, read: str
) -> None:
    found: Samples = {}
    for peer in (writer, reader):
        peer.locate()
    with namespace() as host:
        environment = network_environment(host.interface)
        async with scenario("types that grow", deadline=90) as stage:
            processes = [
                await stage.start(
                    role,
                    [sys.executable, "-m", COMMANDS[peer], role, version, str(COUNT)],
                    namespace=host,
                    environment=environment,
                )
                for role, peer, version in (("sub", reader, read), ("pub", writer, written))
            ]
            for process in processes:
                await process.expect("DONE", timeout=STEP_S)
            for line in processes[0].matches(r"SAMPLE (\w+) (.*)"):
                found.setdefault(line[1], []).append(json.loads(line[2]))
    topics = ("Grown", "Changed", "ChangedXcdr1")
    assert found == {topic: expected_of_topic(topic, written, read) for topic in topics}
