"""Ours as a peer that filters: publishes shapes, or subscribes those that pass an expression.

    python -m multiproc_tests.peers.programs.ddsi_filtered pub ADDRESS COUNT
    python -m multiproc_tests.peers.programs.ddsi_filtered sub ADDRESS COUNT EXPRESSION [PARAMETER...] [-- PARAMETER...]

What stands behind ``--`` are the parameters once it reads "change" on its input.  The events are those of
``fastdds_filtered.cpp``.
"""

from __future__ import annotations

import sys
from typing import Annotated

import trio

import ddsi
from ddsi import idl

QOS = ddsi.Qos(reliability=ddsi.Reliable(), durability=ddsi.TransientLocal(), history=ddsi.KeepAll())
WAIT_S = 20


@idl.struct(extensibility=idl.FINAL)
class ShapeType:
    color: Annotated[str, idl.key, idl.bound(128)]
    x: idl.int32
    y: idl.int32
    shapesize: idl.int32


def say(line: str) -> None:
    print(line, flush=True)


async def next_command() -> str:
    line: str = await trio.to_thread.run_sync(sys.stdin.readline, abandon_on_cancel=True)
    return line.strip()


async def publish(participant: ddsi.DomainParticipant, count: int) -> None:
    writer = ddsi.DataWriter(participant, ddsi.Topic(participant, "Square", ShapeType), QOS)
    await writer.wait_for_matched(timeout=WAIT_S)
    say("MATCHED 1")
    first = 0
    while await next_command() == "write":
        for x in range(first, first + count):
            color = "RED" if x % 2 else "BLUE"
            await writer.write(ShapeType(color, x, 2 * x, x % 10))
            say(f"WROTE {color} {x}")
        first += count
        await writer.wait_for_acknowledgments(WAIT_S)
        say("ACKED")


async def subscribe(participant: ddsi.DomainParticipant, words: list[str]) -> None:
    expression, *parameters = words
    later: list[str] = []
    if "--" in parameters:
        parameters, later = parameters[: parameters.index("--")], parameters[parameters.index("--") + 1 :]
    topic = ddsi.Topic(participant, "Square", ShapeType)
    filtered = ddsi.ContentFilteredTopic(participant, "Filtered", topic, expression, parameters)
    reader = ddsi.DataReader(participant, filtered, QOS)

    async def take() -> None:
        await reader.wait_for_matched(timeout=WAIT_S)
        say("MATCHED 1")
        async for sample in reader:
            say(f"SAMPLE {sample.data.color} {sample.data.x}" if sample.info.valid_data else "DISPOSED")

    async with trio.open_nursery() as nursery:
        nursery.start_soon(take)
        while await next_command() == "change":
            filtered.set_expression_parameters(later)
            say("CHANGED")
        nursery.cancel_scope.cancel()


async def main() -> None:
    role, _, count, *words = sys.argv[1:]
    async with ddsi.DomainParticipant(0) as participant:
        if role == "pub":
            await publish(participant, int(count))
        else:
            await subscribe(participant, words)
    say("DONE")


if __name__ == "__main__":
    trio.run(main)
