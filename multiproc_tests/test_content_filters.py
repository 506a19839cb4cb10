"""Content filters between ours and Fast DDS, which evaluates DDS SQL at the writer too: both ways round.

Cyclone DDS neither announces filters nor evaluates those of others; the OMG suite's cases show our reader with it.
"""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest
import trio

from ddsi.behavior.content_filter import filter_signatures
from ddsi.structure.discovered import ContentFilterProperty

from .framework import Capture, async_test, capture, namespace, scenario
from .framework.process import Process
from .peers.build import FASTDDS_FILTERED, build
from .peers.peer import ROOT, network_environment

COUNT = 10
"""Samples in a round: x from 0, then from 10; every second one, from 1 on, is red."""
EXPRESSION = ("x BETWEEN %0 AND %1 AND color = 'RED'", "3", "8", "--", "13", "18")


@dataclass(frozen=True, slots=True)
class Program:
    name: str
    locate: Callable[[], list[str]]

    def __str__(self) -> str:
        return self.name


OURS = Program("ddsi", lambda: [sys.executable, "-m", "multiproc_tests.peers.programs.ddsi_filtered"])
FAST_DDS = Program("fastdds", lambda: [os.fspath(build(FASTDDS_FILTERED))])
PAIRS = [(OURS, OURS), (OURS, FAST_DDS), (FAST_DDS, OURS)]


def _samples(process: Process) -> list[str]:
    return [found.group(1) for found in process.matches(r"SAMPLE (.*)")]


@pytest.mark.peers
@pytest.mark.parametrize(("publisher", "subscriber"), PAIRS, ids=[f"{a}-{b}" for a, b in PAIRS])
@async_test
async def test_only_what_passes_is_sent_and_read_also_when_the_parameters_change(
    publisher: Program, subscriber: Program, tmp_path: Path
) -> None:
    """Announced, evaluated at the writer, and again at the reader; the parameters are announced anew."""
    written, read = publisher.locate(), subscriber.locate()
    with namespace() as host:
        async with capture(host, tmp_path / "filtered.pcap") as wire, scenario("filters", deadline=90) as stage:

            async def start(role: str, command: list[str], *words: str) -> Process:
                return await stage.start(
                    role, [*command, role, host.address, str(COUNT), *words],
                    namespace=host, environment=network_environment(host.interface), folder=ROOT,
                )  # fmt: skip

            sub = await start("sub", read, *EXPRESSION)
            other = await start("sub", OURS.locate(), "x = 4")
            pub = await start("pub", written)
            for process in (pub, sub, other):
                await process.expect("MATCHED .*", timeout=20)
            await trio.sleep(1)
            await pub.send("write")
            await pub.expect("ACKED", timeout=20)
            await sub.expect("SAMPLE RED 7")
            await sub.send("change")
            await sub.expect("CHANGED")
            await trio.sleep(1)
            await pub.send("write")
            await pub.expect("ACKED", timeout=20)
            await sub.expect("SAMPLE RED 17")
            await trio.sleep(0.5)
            assert _samples(sub) == ["RED 3", "RED 5", "RED 7", "RED 13", "RED 15", "RED 17"]
            assert _samples(other) == ["BLUE 4"]
            for process in (pub, sub, other):
                await process.close_input()
                await process.expect("DONE")
    assert _numbers_sent(wire) == {4, 5, 6, 8, 14, 16, 18}, "what nobody wants is not on the wire"
    signatures = {_signature("x = 4"), _signature(EXPRESSION[0], "3", "8"), _signature(EXPRESSION[0], "13", "18")}
    assert _signatures(wire) == signatures, "beside each sample that is not for all"


def _numbers_sent(wire: Capture) -> set[int]:
    """The numbers of the samples in DATA submessages of an application's writer, each once."""
    submessages = wire.dissection("rtps.sm.wrEntityId.entityKind == 0x02").split("submessageId: ")
    samples = (text for text in submessages if text.startswith("DATA (") and "Data present: Set" in text)
    return {
        int(re.findall(r"writerSeqNumber: (\d+)", text)[0]) for text in samples if "Application-defined writer" in text
    }


def _signatures(wire: Capture) -> set[bytes]:
    """The filter signatures beside samples: tshark shows them as little-endian words."""
    words = (mark.split()[1:] for mark in wire.marks("rtps", r"^\s*filterSignature"))
    return {b"".join(bytes.fromhex(word)[::-1] for word in signature) for signature in words}


def _signature(expression: str, *parameters: str) -> bytes:
    announced = ContentFilterProperty(
        content_filtered_topic_name="Filtered",
        related_topic_name="Square",
        filter_class_name="DDSSQL",
        filter_expression=expression,
        expression_parameters=parameters,
    )
    return filter_signatures(announced)[0]
