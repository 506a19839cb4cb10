"""When operations yield, and when what was written leaves.

``write`` and iteration yield after 64 operations or a millisecond; queued samples leave when a message is full, when
the loop goes idle, or after a millisecond.  The mock clock stands still, so that only counts matter where counts are
tested.
"""

from __future__ import annotations

import functools
import time
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from typing import Any

import trio
import trio.testing

import ddsi
from ddsi.trace import events
from tests.dcps.running import RELIABLE, Note, Shape, domain, in_trio, pair

__all__ = ["domain"]


def with_a_clock_that_stands_still(test: Callable[..., Awaitable[None]]) -> Callable[..., None]:
    def run(domain: int) -> None:
        trio.run(functools.partial(test, domain), clock=trio.testing.MockClock(rate=0))

    run.__name__, run.__doc__ = test.__name__, test.__doc__
    return run


class Turns:
    """Counts how often the loop comes around while something else runs."""

    def __init__(self) -> None:
        self.count = 0

    async def take(self) -> None:
        while True:
            self.count += 1
            await trio.lowlevel.checkpoint()


async def local_pair(participant: ddsi.DomainParticipant) -> tuple[ddsi.DataWriter[Shape], ddsi.DataReader[Shape]]:
    topic = ddsi.Topic(participant, "Square", Shape)
    return ddsi.DataWriter(participant, topic, RELIABLE), ddsi.DataReader(participant, topic, RELIABLE)


async def yields_during(operations: Callable[[], Awaitable[None]]) -> int:
    async with trio.open_nursery() as nursery:
        turns = Turns()
        nursery.start_soon(turns.take)
        await trio.lowlevel.checkpoint()
        before = turns.count
        await operations()
        counted = turns.count - before
        nursery.cancel_scope.cancel()
    return counted


@with_a_clock_that_stands_still
async def test_write_yields_after_sixty_four_operations(domain: int) -> None:
    async with ddsi.DomainParticipant(domain) as participant:
        writer, _ = await local_pair(participant)

        async def write() -> None:
            for number in range(640):
                await writer.write(Shape("RED", number))

        assert 9 <= await yields_during(write) <= 12


@with_a_clock_that_stands_still
async def test_iteration_yields_after_sixty_four_operations(domain: int) -> None:
    async with ddsi.DomainParticipant(domain) as participant:
        writer, reader = await local_pair(participant)
        for number in range(640):
            await writer.write(Shape("RED", number))

        async def read() -> None:
            for _ in range(640):
                await anext(reader)

        assert 9 <= await yields_during(read) <= 12


@in_trio
async def test_write_yields_after_a_millisecond(domain: int) -> None:
    async with ddsi.DomainParticipant(domain) as participant:
        writer, _ = await local_pair(participant)

        async def write_slowly() -> None:
            for number in range(10):
                await writer.write(Shape("RED", number))
                time.sleep(0.0015)

        assert await yields_during(write_slowly) >= 9


class SentSamples:
    """A trace sink that counts the samples in each message: those written here hold the word "marker"."""

    def __init__(self) -> None:
        self.messages: list[int] = []

    def __call__(self, event: Any) -> None:
        if isinstance(event, events.MessageSent) and b"marker" in event.octets:
            self.messages.append(event.octets.count(b"marker"))


@asynccontextmanager
async def traced(domain: int, kind: type[Any]) -> AsyncIterator[tuple[ddsi.DataWriter[Any], SentSamples]]:
    """A writer with a reader in another participant, and what it sends."""
    sent = SentSamples()
    async with ddsi.DomainParticipant(domain, trace=sent) as here, ddsi.DomainParticipant(domain) as there:
        writer = ddsi.DataWriter(here, ddsi.Topic(here, "Square", kind), RELIABLE)
        reader = ddsi.DataReader(there, ddsi.Topic(there, "Square", kind), RELIABLE)
        await writer.wait_for_matched(timeout=5)
        await reader.wait_for_matched(timeout=5)
        await trio.sleep(0.01)
        yield writer, sent


def stop_the_clock(entity: ddsi.DataWriter[Any]) -> None:
    """From now on it is always the same time for the entity, however busy this machine is."""
    pump: Any = entity._pump
    moment = trio.current_time()
    pump.now = lambda: moment


@in_trio
async def test_a_burst_shares_a_message_that_leaves_when_the_loop_is_idle(domain: int) -> None:
    async with traced(domain, Shape) as (writer, sent):
        await trio.lowlevel.checkpoint()
        stop_the_clock(writer)
        for number in range(10):
            await writer.write(Shape("marker", number))
        written = sum(sent.messages)
        for _ in range(3):
            await trio.lowlevel.checkpoint()
        assert written <= 1  # the first one may have left alone
        assert sum(sent.messages) == 10
        assert len(sent.messages) <= 2


@in_trio
async def test_a_full_message_leaves_at_once(domain: int) -> None:
    async with traced(domain, Note) as (writer, sent):
        stop_the_clock(writer)
        octets = b"marker" + bytes(10_000)
        for number in range(8):
            await writer.write(Note(number, octets))
        assert sum(sent.messages) >= 6


@in_trio
async def test_a_task_that_hogs_the_loop_sends_after_a_millisecond_all_the_same(domain: int) -> None:
    """Its next write is the first opportunity: that yields, and what was queued goes."""
    async with traced(domain, Shape) as (writer, sent):
        for number in range(3):
            await writer.write(Shape("marker", number))
            time.sleep(0.002)
        assert sum(sent.messages) >= 1


@in_trio
async def test_a_task_that_waits_leaves_nothing_queued(domain: int) -> None:
    """Write, then wait for the answer: the question must not lie in a queue meanwhile."""
    async with pair(domain) as p:
        answers = ddsi.DataReader(p.here, ddsi.Topic(p.here, "Circle", Shape), RELIABLE)
        answerer = ddsi.DataWriter(p.there, ddsi.Topic(p.there, "Circle", Shape), RELIABLE)
        await answers.wait_for_matched(timeout=5)
        await answerer.wait_for_matched(timeout=5)

        async def answer() -> None:
            async for sample in p.reader:
                await answerer.write(sample.data)

        async with trio.open_nursery() as nursery:
            nursery.start_soon(answer)
            before = trio.current_time()
            for number in range(50):
                await p.writer.write(Shape("RED", number))
                assert (await anext(answers)).data.x == number
            assert trio.current_time() - before < 2
            nursery.cancel_scope.cancel()
