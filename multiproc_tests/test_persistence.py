"""What was written survives its writer and the service that keeps it, both killed; late joiners get it."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from .framework import Namespace, Process, Scenario, async_test, namespace, scenario
from .peers.catalogue import CYCLONE_PYTHON
from .peers.peer import network_environment

DOMAIN = 1
COUNT = 20


async def durable(stage: Scenario, host: Namespace, vendor: str, role: str, name: str) -> Process:
    command = [sys.executable, "-m", f"multiproc_tests.peers.programs.{vendor}_durable", role, str(DOMAIN), str(COUNT)]
    started = await stage.start(name, command, namespace=host, environment=network_environment(host.interface))
    await started.expect("READY", timeout=20)
    return started


async def service(stage: Scenario, host: Namespace, file: Path, name: str, kept: str) -> Process:
    """``ddsi persist``, once it says what it has."""
    command = [sys.executable, "-m", "ddsi.cli", "persist", str(file), "-d", str(DOMAIN)]
    started = await stage.start(name, command, namespace=host, environment=network_environment(host.interface))
    await started.expect(f"samples kept: {kept}", timeout=20)
    return started


@pytest.mark.parametrize(
    ("writers", "readers"),
    [
        ("ddsi", "ddsi"),
        pytest.param("cyclonedds", "ddsi", marks=pytest.mark.peers),
        pytest.param("ddsi", "cyclonedds", marks=pytest.mark.peers),
    ],
)
@async_test
async def test_a_late_joiner_gets_what_was_written_by_who_is_dead(writers: str, readers: str, tmp_path: Path) -> None:
    if "cyclonedds" in (writers, readers):
        CYCLONE_PYTHON.locate()
    file = tmp_path / "samples.sqlite"
    with namespace() as host:
        async with scenario(f"persistence {writers} {readers}", deadline=90) as stage:
            keeper = await service(stage, host, file, "keeper", "none")
            writer = await durable(stage, host, writers, "pub", "writer")
            await writer.expect(f"WROTE {COUNT - 1}", timeout=20)
            await keeper.expect(f"samples kept: Square: {COUNT}", timeout=20)
            for process in (writer, keeper):
                process.kill()
                await process.wait()
            await service(stage, host, file, "next keeper", f"Square: {COUNT}")
            reader = await durable(stage, host, readers, "sub", "reader")
            await reader.expect(f"SAMPLE {COUNT - 1}", timeout=40)
            assert [match[1] for match in reader.matches("SAMPLE (.*)")] == [str(number) for number in range(COUNT)]
