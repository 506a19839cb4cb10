"""Many tasks at few entities, all of them cancelled at random: every reliable sample is taken once, by somebody."""

from __future__ import annotations

from collections import Counter
from collections.abc import Awaitable, Callable
from random import Random

import pytest
import trio

import ddsi
from ddsi import ReadCondition, StatusCondition, WaitSet
from tests.dcps.running import RELIABLE, Shape, eventually, in_trio

SAMPLES = 25
PATIENT = RELIABLE | ddsi.Qos(reliability=ddsi.Reliable(max_blocking_time=60))
Taken = Counter[tuple[ddsi.Guid, int]]


def tight(dice: Random) -> ddsi.Qos:
    limits = dice.choice(
        [ddsi.ResourceLimits(), ddsi.ResourceLimits(max_samples=1), ddsi.ResourceLimits(max_samples=3)]
    )
    return PATIENT | ddsi.Qos(resource_limits=limits)


async def write_all(writer: ddsi.DataWriter[Shape], first: int, dice: Random) -> None:
    """A write that is cancelled has written nothing."""
    for number in range(first, first + SAMPLES):
        is_written = False
        while not is_written:
            with trio.move_on_after(dice.choice([0, 0.0005, 0.003, 30])):
                await writer.write(Shape(dice.choice("ABC"), number))
                is_written = True
        if dice.random() < 0.2:
            await trio.sleep(dice.choice([0, 0.001]))


async def take_some(subscriber: ddsi.Subscriber, reader: ddsi.DataReader[Shape], taken: Taken, dice: Random) -> None:
    """In one of the ways to wait and to take, or until it is cancelled."""
    conditions = ReadCondition(reader), StatusCondition(reader, ddsi.DataAvailable)
    ways: list[Callable[[], Awaitable[object]]] = [
        reader.wait,
        subscriber.wait,
        WaitSet(*conditions).wait,
        WaitSet(*conditions[:1]).wait,
    ]
    with trio.move_on_after(dice.choice([0, 0.0005, 0.005, 30])):
        if dice.random() < 0.4:
            samples = [await anext(reader)]
        else:
            await dice.choice(ways)()
            samples = reader.take(dice.choice([None, 1, 2]))
        taken.update((sample.info.publication_handle, sample.data.x) for sample in samples)


@pytest.mark.parametrize("local", [True, False])
@pytest.mark.parametrize("seed", range(3))
@in_trio
async def test_every_sample_is_taken_once_whoever_waits_and_is_cancelled(domain: int, seed: int, local: bool) -> None:
    dice = Random(seed)
    async with ddsi.DomainParticipant(domain) as here, ddsi.DomainParticipant(domain) as other:
        there = here if local else other
        writers = [ddsi.DataWriter(here, ddsi.Topic(here, "Square", Shape), tight(dice)) for _ in range(2)]
        readers: list[tuple[ddsi.Subscriber, ddsi.DataReader[Shape], Taken]] = []
        for _ in range(2):
            subscriber = ddsi.Subscriber(there)
            reader = ddsi.DataReader(subscriber, ddsi.Topic(there, "Square", Shape), tight(dice))
            readers.append((subscriber, reader, Counter()))
        for writer in writers:
            await writer.wait_for_matched(2)
        for _, reader, _ in readers:
            await reader.wait_for_matched(2)

        async def go_on_taking(subscriber: ddsi.Subscriber, reader: ddsi.DataReader[Shape], taken: Taken) -> None:
            while True:
                await take_some(subscriber, reader, taken, dice)
                await trio.lowlevel.checkpoint()

        async with trio.open_nursery() as nursery:
            for entry in readers * 3:
                nursery.start_soon(go_on_taking, *entry)
            async with trio.open_nursery() as writing:
                for writer in writers:
                    for task in range(2):
                        writing.start_soon(write_all, writer, task * SAMPLES, dice)
            expected = Counter((writer.guid, number) for writer in writers for number in range(2 * SAMPLES))
            await eventually(lambda: all(taken.total() >= expected.total() for _, _, taken in readers))
            nursery.cancel_scope.cancel()
        for _, _, taken in readers:
            assert taken == expected
