"""Cancellation at any await leaves everything consistent.

Each story is run again and again, cancelled one step later each time, until it runs to its end; after each, the
participants that live on must work as before, and nothing of the cancelled one may be left.
"""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from typing import Any

import trio

import ddsi
from tests.dcps.running import RELIABLE, Pair, Shape, eventually, in_trio, pair

MOST_STEPS = 400


class CancelAtStep(trio.abc.Instrument):
    """Cancels a scope after the given number of steps of the task that makes it."""

    def __init__(self, steps: int) -> None:
        self.scope = trio.CancelScope()
        self._steps = steps
        self._task = trio.lowlevel.current_task()

    def after_task_step(self, task: trio.lowlevel.Task) -> None:
        if task is self._task:
            self._steps -= 1
            if self._steps == 0:
                self.scope.cancel()


async def cancelled_at_each_step(
    story: Callable[[], Awaitable[None]], afterwards: Callable[[], Awaitable[None]]
) -> int:
    """Runs the story until it is no longer cancelled; returns in how many steps that was."""
    for steps in range(1, MOST_STEPS):
        instrument = CancelAtStep(steps)
        trio.lowlevel.add_instrument(instrument)
        try:
            with instrument.scope:
                await story()
        finally:
            trio.lowlevel.remove_instrument(instrument)
        await afterwards()
        if not instrument.scope.cancelled_caught:
            return steps
    raise AssertionError("the story does not end")


async def conversation(p: Pair, count: int = 3) -> None:
    """Samples go from the writer to the reader, all and in order."""
    for number in range(count):
        await p.writer.write(Shape("PROBE", number))
    seen: list[int] = []
    with trio.fail_after(5):
        async for sample in p.reader:
            if sample.data.color == "PROBE" and sample.info.valid_data:
                seen.append(sample.data.x)
            if len(seen) == count:
                break
    assert seen == list(range(count))
    await p.writer.wait_for_acknowledgments(timeout=5)


@in_trio
async def test_entering_using_and_leaving_a_participant(domain: int) -> None:
    async with pair(domain) as p:
        tasks = trio.lowlevel.current_statistics().tasks_living

        async def story() -> None:
            async with ddsi.DomainParticipant(domain) as participant:
                topic = ddsi.Topic(participant, "Square", Shape)
                reader = ddsi.DataReader(participant, topic, RELIABLE)
                writer = ddsi.DataWriter(participant, topic, RELIABLE)
                await reader.wait_for_matched(2)
                await writer.wait_for_matched(2)
                for number in range(100):
                    await writer.write(Shape("STORY", number))
                await writer.dispose(Shape("STORY"))
                async for sample in reader:
                    if not sample.info.valid_data:
                        break
                await writer.wait_for_acknowledgments()

        async def afterwards() -> None:
            await eventually(lambda: [peer.guid for peer in p.here.discovered_participants()] == [p.there.guid])
            assert trio.lowlevel.current_statistics().tasks_living == tasks
            await conversation(p)

        assert await cancelled_at_each_step(story, afterwards) > 8


@in_trio
async def test_writing(domain: int) -> None:
    """A write that was cancelled was either done or not; the ones after it are as if it had never been tried."""
    async with pair(domain) as p:

        async def story() -> None:
            for number in range(300):
                await p.writer.write(Shape("STORY", number))
            await p.writer.unregister(Shape("STORY"))

        async def afterwards() -> None:
            await p.writer.wait_for_acknowledgments(timeout=5)
            numbers = [sample.data.x for sample in p.reader.take() if sample.info.valid_data]
            assert numbers == list(range(len(numbers)))
            await conversation(p)

        assert await cancelled_at_each_step(story, afterwards) > 4


@in_trio
async def test_waiting_for_room(domain: int) -> None:
    full = RELIABLE | ddsi.Qos(
        resource_limits=ddsi.ResourceLimits(max_samples=2), reliability=ddsi.Reliable(max_blocking_time=30)
    )
    async with pair(domain, writer=full, reader=full) as p:

        async def story() -> None:
            for number in range(5):
                await p.writer.write(Shape("STORY", number))

        async def afterwards() -> None:
            numbers: list[int] = []
            with trio.fail_after(5):
                while p.writer._writer.behavior.min_acked_sn() < p.writer._writer.behavior.cache.last_sn:
                    numbers += [sample.data.x for sample in p.reader.take()]
                    await trio.sleep(0.002)
            numbers += [sample.data.x for sample in p.reader.take()]
            assert numbers == list(range(len(numbers)))
            assert p.writer._writer.wants_acknowledgment == 0

        for steps in (1, 2, 3, 4, 5, 6, 8, 10):
            instrument = CancelAtStep(steps)
            trio.lowlevel.add_instrument(instrument)
            with trio.move_on_after(0.05), instrument.scope:
                await story()
            trio.lowlevel.remove_instrument(instrument)
            await afterwards()


@in_trio
async def test_iterating_loses_no_sample(domain: int) -> None:
    """Whatever the step at which iteration is cancelled, the next one goes on with the next sample."""
    async with pair(domain) as p:
        for steps in range(1, 30):
            for number in range(200):
                await p.writer.write(Shape("STORY", number))
            seen: list[int] = []
            instrument = CancelAtStep(steps)
            trio.lowlevel.add_instrument(instrument)
            with instrument.scope:
                async for sample in p.reader:
                    seen.append(sample.data.x)
                    if len(seen) == 200:
                        break
            trio.lowlevel.remove_instrument(instrument)
            with trio.fail_after(5):
                while len(seen) < 200:
                    sample = await anext(p.reader)
                    seen.append(sample.data.x)
            assert seen == list(range(200))


@in_trio
async def test_every_wait_can_be_cancelled_and_repeated(domain: int) -> None:
    async with ddsi.DomainParticipant(domain) as participant:
        topic = ddsi.Topic(participant, "Square", Shape)
        writer, reader = ddsi.DataWriter(participant, topic, RELIABLE), ddsi.DataReader(participant, topic)
        waits: list[Callable[[], Awaitable[Any]]] = [
            lambda: writer.wait_for_matched(2),
            lambda: reader.wait_for_matched(2),
            reader.wait,
            lambda: anext(reader),
            lambda: anext(participant.events()),
            participant.wait_for_discovery,
        ]
        for wait in waits * 2:
            with trio.move_on_after(0.005) as scope:
                await wait()
            assert scope.cancelled_caught
        await writer.write(Shape("RED"))
        assert [sample.data.color for sample in reader.take()] == ["RED"]


@in_trio
async def test_operations_that_need_not_wait_are_cancellation_points_all_the_same(domain: int) -> None:
    async with pair(domain, local=True) as p:
        await p.writer.write(Shape("RED"))
        operations: list[Callable[[], Awaitable[Any]]] = [
            lambda: p.writer.write(Shape("BLUE")),
            lambda: p.writer.dispose(Shape("RED")),
            lambda: p.writer.unregister(Shape("RED")),
            lambda: anext(p.reader),
            p.reader.wait,
            p.writer.wait_for_matched,
            p.writer.wait_for_acknowledgments,
            p.reader.wait_for_matched,
            p.reader.wait_for_historical_data,
        ]
        for operation in operations:
            with trio.CancelScope() as scope:
                scope.cancel()
                await operation()
            assert scope.cancelled_caught, operation
        assert [sample.data.color for sample in p.reader.take()] == ["RED"]
