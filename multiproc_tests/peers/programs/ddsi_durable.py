"""Our writer of persistent samples, or a reader that asks for them.

    ddsi_durable pub|sub DOMAIN COUNT

The writer says WROTE after each of COUNT samples and lives on; the reader says SAMPLE for whatever comes.
"""

from __future__ import annotations

import sys

import trio

import ddsi

from .ddsi_shapes import ShapeType
from .protocol import say

QOS = ddsi.Qos(
    reliability=ddsi.Reliable(max_blocking_time=10),
    history=ddsi.KeepAll(),
    durability=ddsi.Persistent(),
    durability_service=ddsi.DurabilityService(history=ddsi.KeepAll()),
)


async def main() -> None:
    role, domain, count = sys.argv[1:]
    async with ddsi.DomainParticipant(int(domain)) as participant:
        topic = ddsi.Topic(participant, "Square", ShapeType)
        say("READY")
        if role == "sub":
            async for sample in ddsi.DataReader(participant, topic, QOS):
                if sample.info.valid_data:
                    say("SAMPLE", sample.data.x)
            return
        writer = ddsi.DataWriter(participant, topic, QOS)
        await writer.wait_for_matched()
        for number in range(int(count)):
            await writer.write(ShapeType("BLUE", number, 0, 30))
            say("WROTE", number)
        await trio.sleep_forever()


if __name__ == "__main__":
    trio.run(main)
