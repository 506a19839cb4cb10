"""Request and reply with a program of another vendor that knows nothing of DDS-RPC but its types."""

from __future__ import annotations

import sys

import pytest

from .framework import async_test, namespace, scenario
from .peers.catalogue import CYCLONE_PYTHON
from .peers.peer import ROOT, network_environment

pytestmark = pytest.mark.peers

DOMAIN = 1
ANSWERS = ["ANSWER REMOTE_EX_OK 23", "ANSWER REMOTE_EX_OK 24", "ANSWER REMOTE_EX_INVALID_ARGUMENT 0"]


@pytest.mark.parametrize(("client", "service"), [("ddsi", "cyclonedds"), ("cyclonedds", "ddsi"), ("ddsi", "ddsi")])
@async_test
async def test_calls_are_answered_or_refused(client: str, service: str) -> None:
    """The types match as each vendor compares them, so both know the same types by the same hashes."""
    if "cyclonedds" in (client, service):
        CYCLONE_PYTHON.locate()
    with namespace() as host:
        async with scenario("rpc", deadline=60) as stage:
            environment = network_environment(host.interface)
            programs = {}
            for name, role in ((service, "serve"), (client, "call")):
                command = [sys.executable, "-m", f"multiproc_tests.peers.programs.{name}_rpc", role, str(DOMAIN)]
                programs[role] = await stage.start(role, command, namespace=host, environment=environment, folder=ROOT)
                await programs[role].expect("READY", timeout=20)
            await programs["call"].expect_exit(0, timeout=30)
            await programs["serve"].send("end")
            await programs["serve"].expect_exit(0, timeout=20)
    said = [line.text for line in programs["call"].lines if line.stream == "out"]
    assert said[1:] == ANSWERS
