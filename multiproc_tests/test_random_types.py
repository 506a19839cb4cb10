"""Samples of random types go to a process of Cyclone DDS 11 and come back as they were, through the wire each way.

``tests/xtypes/test_random_idl.py`` compares octets with those of the package's Python; here its C core has its say too,
which checks every sample against the type before anybody may read it.
"""

from __future__ import annotations

import sys

import pytest

from tests.xtypes.random_idl import RandomIdl

from .framework import async_test, namespace, scenario
from .peers.catalogue import CYCLONE_PYTHON, OURS
from .peers.peer import network_environment

PROGRAMS = "multiproc_tests.peers.programs"
TYPES = 20


def playable_seeds() -> list[str]:
    """The package cannot describe unions by a character to others, and so has no topics of them."""
    seeds = [seed for seed in range(2 * TYPES) if "switch (char)" not in RandomIdl(seed, keys=True, enums=True).text()]
    assert len(seeds) >= TYPES
    return [str(seed) for seed in seeds[:TYPES]]


@pytest.mark.peers
@async_test
async def test_samples_of_random_types_come_back_as_they_were() -> None:
    for peer in (OURS, CYCLONE_PYTHON):
        peer.locate()
    seeds = playable_seeds()
    with namespace() as host:
        environment = network_environment(host.interface)
        # Its types are made after ours, flattened: of the same octets, but not of the same description.
        unsaid = "<AnnounceTypes>false</AnnounceTypes></Discovery>"
        environment["DDSI_URI"] = environment["DDSI_URI"].replace("</Discovery>", unsaid)
        async with scenario("random types", deadline=120) as stage:
            echo, sender = [
                await stage.start(
                    name,
                    [sys.executable, "-m", f"{PROGRAMS}.{program}", *seeds],
                    namespace=host,
                    environment=environment,
                )
                for name, program in (("echo", "cyclonedds_echo"), ("sender", "ddsi_echoed"))
            ]
            await sender.expect("DONE", timeout=60)
            await echo.close_input()
    assert sorted(found[1] for found in sender.matches(r"SAME (\d+)")) == sorted(seeds), sender.matches(".*")
