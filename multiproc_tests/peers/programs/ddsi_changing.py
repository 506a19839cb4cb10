"""Our writer or reader whose policies change as lines on standard input say.

    ddsi_changing pub|sub DOMAIN PARTITION [--exclusive] [--lasting] [--secure GOVERNANCE FOLDER]

Lines: ``partition NAME...``, ``strength N``, ``deadline SECONDS``, ``write NUMBER``, ``end``.  It says MATCHED with how
many are matched whenever that changes, CHANGED or REFUSED after a change, SAMPLE, and INCOMPATIBLE with the policy.
"""

from __future__ import annotations

import os
import sys
from collections.abc import AsyncIterator
from typing import Any

import trio

import ddsi

from .ddsi_shapes import ShapeType, participant_qos, wait_for_input
from .protocol import Arguments, say


async def lines() -> AsyncIterator[list[str]]:
    """What comes on standard input, in words, until it ends."""
    rest = b""
    while True:
        await wait_for_input()
        octets = os.read(sys.stdin.fileno(), 4096)
        if not octets:
            return
        *whole, rest = (rest + octets).split(b"\n")
        for line in whole:
            yield line.decode().split()


def change_of(verb: str, words: list[str]) -> ddsi.Qos:
    if verb == "partition":
        return ddsi.Qos(partition=ddsi.Partition(*words))
    if verb == "strength":
        return ddsi.Qos(ownership_strength=ddsi.OwnershipStrength(int(words[0])))
    return ddsi.Qos(deadline=ddsi.Deadline(float(words[0])))


async def watch(entity: ddsi.Entity) -> None:
    async for event in entity.events():
        match event:
            case ddsi.PublicationMatched(current_count=count) | ddsi.SubscriptionMatched(current_count=count):
                say("MATCHED", count)
            case (
                ddsi.OfferedIncompatibleQos(incompatibilities=reasons)
                | ddsi.RequestedIncompatibleQos(incompatibilities=reasons)
            ):
                say("INCOMPATIBLE", *(reason.policy for reason in reasons))
            case _:
                pass


async def take(reader: ddsi.DataReader[Any]) -> None:
    async for sample in reader:
        if sample.info.valid_data:
            say("SAMPLE", sample.data.x, sample.data.shapesize)


def secured(flags: list[str]) -> ddsi.Qos | None:
    """As alice."""
    if "--secure" not in flags:
        return None
    governance, folder = flags[flags.index("--secure") + 1 :]
    return participant_qos(Arguments(store=folder, name="alice", governance=governance))


async def main() -> None:
    role, domain, partition, *flags = sys.argv[1:]
    group_qos = ddsi.Qos(partition=ddsi.Partition(partition))
    qos = ddsi.Qos(reliability=ddsi.Reliable(max_blocking_time=10), history=ddsi.KeepAll())
    if "--exclusive" in flags:
        qos |= ddsi.Qos(ownership=ddsi.Exclusive())
    if "--lasting" in flags:
        qos |= ddsi.Qos(durability=ddsi.TransientLocal())
    async with ddsi.DomainParticipant(int(domain), qos=secured(flags)) as participant, trio.open_nursery() as nursery:
        topic = ddsi.Topic(participant, "Square", ShapeType)
        entity: Any
        if role == "pub":
            entity = ddsi.DataWriter(ddsi.Publisher(participant, group_qos), topic, qos)
        else:
            entity = ddsi.DataReader(ddsi.Subscriber(participant, group_qos), topic, qos)
            nursery.start_soon(take, entity)
        nursery.start_soon(watch, entity)
        say("READY")
        async for verb, *words in lines():
            if verb == "end":
                break
            if verb == "write":
                await entity.write(ShapeType("BLUE", int(words[0]), 0, os.getpid() & 0xFFFF))
                continue
            try:
                # Of a group where the OMG has it so, and of the endpoint itself where not.
                owner = entity._parent if verb == "partition" else entity
                owner.set_qos(change_of(verb, words))
                say("CHANGED", verb)
            except ddsi.DdsError as error:
                say("REFUSED", " ".join(str(error).split()))
        nursery.cancel_scope.cancel()


if __name__ == "__main__":
    trio.run(main)
