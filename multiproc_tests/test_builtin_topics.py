"""Readers of the builtin topics see other implementations come and go, with the names on their certificates.

DDS 1.4 §2.2.5, DDS-Security 1.1 §7.4.1.4 to §7.4.1.8.
"""

from __future__ import annotations

import sys
from dataclasses import replace

import pytest

from .framework import async_test, namespace, scenario
from .matrix.refusals import until_said
from .peers.catalogue import CYCLONE_C, FAST_DDS, OURS
from .peers.keystore import shared_keystore
from .peers.options import Options

WITNESS = replace(
    OURS, name="witness", locate=lambda: [sys.executable, "-m", "multiproc_tests.peers.programs.ddsi_who"]
)
PLAIN = Options(readers=0)
STEP_S = 20.0


@pytest.mark.peers
@pytest.mark.parametrize("is_secured", [False, True], ids=["plain", "secured"])
@async_test
async def test_who_comes_and_goes_is_seen_and_by_which_right(is_secured: bool) -> None:
    for peer in (OURS, CYCLONE_C, FAST_DDS):
        peer.locate()
    options = PLAIN
    if is_secured:
        options = replace(PLAIN, keystore=str(shared_keystore().folder), governance="encrypt-all.p7s")
    alice, dave, way = "UNAUTHENTICATED", "UNAUTHENTICATED", "CLEAR"
    if is_secured:
        alice, dave, way = "CN=alice,O=Peers", "CN=dave,O=Peers", "PROTECTED"
    with namespace() as host:
        async with scenario("who is there", deadline=90) as stage:
            witness = await WITNESS.start(stage, "sub", replace(options, identity="bob"), host=host)
            await witness.expect("GUID .*", timeout=STEP_S)
            writer = await CYCLONE_C.start(stage, "pub", replace(options, identity="alice"), host=host)
            reader = await FAST_DDS.start(stage, "sub", replace(options, identity="dave"), host=host)
            for said in (
                f"PARTICIPANT ALIVE Cyclone DDS {way} {alice}",
                f"PUBLICATION ALIVE Square {way} {alice}",
                f"PARTICIPANT ALIVE Fast DDS {way} {dave}",
                f"SUBSCRIPTION ALIVE Square {way} {dave}",
            ):
                await until_said(witness, f"^{said}$", timeout=STEP_S)
            await reader.expect("HOLDING", timeout=STEP_S)  # it has read everything
            for process in (writer, reader):
                await process.close_input()
            for said in (  # not the end of Fast DDS: where it is secured, it may leave that to its long lease
                f"PARTICIPANT NOT_ALIVE_(DISPOSED|NO_WRITERS) Cyclone DDS {way} {alice}",
                f"PUBLICATION NOT_ALIVE_(DISPOSED|NO_WRITERS) Square {way} {alice}",
                f"SUBSCRIPTION NOT_ALIVE_(DISPOSED|NO_WRITERS) Square {way} {dave}",
            ):
                await until_said(witness, f"^{said}$", timeout=STEP_S)
