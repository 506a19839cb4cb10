"""Sends random samples of the random types of some seeds to ``cyclonedds_echo.py``, and compares what comes back."""

from __future__ import annotations

import random
import sys
from typing import Any

import trio

import ddsi
from ddsi.xtypes.definition import struct_type
from tests.xtypes.random_idl import RandomIdl, random_sample

from .protocol import say

KEPT = ddsi.Qos(
    reliability=ddsi.Reliable(),
    history=ddsi.KeepAll(),
    durability=ddsi.TransientLocal(),
    data_representation=ddsi.DataRepresentation(ddsi.XCDR2),
)
SAMPLES = 3


async def exchange(participant: ddsi.DomainParticipant, seed: int) -> None:
    module: Any = ddsi.idl.loads(RandomIdl(seed, keys=True, enums=True).text()).m
    writer = ddsi.DataWriter(participant, ddsi.Topic[Any](participant, f"In{seed}", module.Top), KEPT)
    reader = ddsi.DataReader(participant, ddsi.Topic[Any](participant, f"Out{seed}", module.Top), KEPT)
    dice = random.Random(seed)
    sent: dict[int, Any] = {}
    for number in range(SAMPLES):
        sample = random_sample(struct_type(module.Top), dice)
        sample.id = number
        sent[number] = sample
        await writer.write(sample)
    with trio.move_on_after(40):
        async for received in reader:
            if received.info.valid_data and sent.pop(received.data.id, None) != received.data:
                say("DIFFERENT", seed)
                return
            if not sent:
                say("SAME", seed)
                return
    say("LACKS", seed, *sent, *participant.drop_counts().items())


async def main(seeds: list[int]) -> None:
    async with ddsi.DomainParticipant(0) as participant, trio.open_nursery() as nursery:
        for seed in seeds:
            nursery.start_soon(exchange, participant, seed)
    say("DONE")


if __name__ == "__main__":
    sys.exit(trio.run(main, [int(argument) for argument in sys.argv[1:]]))
