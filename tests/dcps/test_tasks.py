"""Several tasks at the same entities: none is forgotten, and what one closes ends the waiting of the others."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from typing import Annotated, Any

import pytest
import trio
import trio.testing

import ddsi
from ddsi import InstanceState, ReadCondition, SampleState, StatusCondition, ViewState, WaitSet, idl
from tests.dcps.running import RELIABLE, Shape, in_trio, pair

LIMIT = ddsi.Qos(resource_limits=ddsi.ResourceLimits(max_samples=1))
FULL = RELIABLE | LIMIT
PATIENT = FULL | ddsi.Qos(reliability=ddsi.Reliable(max_blocking_time=60))


@idl.struct
class Where:
    name: Annotated[str, idl.key]
    x: idl.int32 = 0


@idl.struct
class Who:
    name: Annotated[str, idl.key]
    age: idl.int32 = 0


@idl.struct
class Both:
    name: Annotated[str, idl.key]
    x: idl.int32 = 0
    age: idl.int32 = 0


# --- closed under their hands ------------------------------------------------------------------------------


class Everything:
    """One entity of each kind, in one participant: a reader that is full, and a writer that has to wait for it."""

    def __init__(self, participant: ddsi.DomainParticipant) -> None:
        self.participant = participant
        topic = ddsi.Topic(participant, "Square", Shape)
        self.publisher, self.subscriber = ddsi.Publisher(participant), ddsi.Subscriber(participant)
        self.writer = ddsi.DataWriter(self.publisher, topic, PATIENT)
        self.full = ddsi.DataReader(participant, topic, FULL)
        self.reader = ddsi.DataReader(self.subscriber, ddsi.Topic(participant, "Circle", Shape), RELIABLE)

    async def fill(self) -> None:
        for number in range(2):
            await self.writer.write(Shape("RED", number))

    def waits(self) -> dict[str, Callable[[], Awaitable[Any]]]:
        gone = ReadCondition(self.reader, instance_states=InstanceState.NOT_ALIVE_DISPOSED)
        return {
            "write": lambda: self.writer.write(Shape("RED", 2)),
            "dispose": lambda: self.writer.dispose(Shape("RED")),
            "writer.wait_for_matched": lambda: self.writer.wait_for_matched(9),
            "writer.wait_for_acknowledgments": self.writer.wait_for_acknowledgments,
            "publisher.wait_for_acknowledgments": self.publisher.wait_for_acknowledgments,
            "reader.wait_for_matched": lambda: self.reader.wait_for_matched(9),
            "reader.wait": self.reader.wait,
            "subscriber.wait": self.subscriber.wait,
            "WaitSet.wait": WaitSet(gone).wait,
            "wait for a status": WaitSet(StatusCondition(self.subscriber)).wait,
            "wait_for_discovery": self.participant.wait_for_discovery,
        }


@pytest.mark.parametrize("steps", range(5))
@in_trio
async def test_whatever_is_waited_for_says_that_it_was_closed(domain: int, steps: int) -> None:
    """However far the waiting task has come when another one closes the participant."""
    async with ddsi.DomainParticipant(domain) as participant:
        names = list(Everything(participant).waits())
    for name in names:
        async with ddsi.DomainParticipant(domain) as participant:
            everything = Everything(participant)
            await everything.fill()
            said: list[str] = []

            async def wait(operation: Callable[[], Awaitable[Any]], said: list[str] = said) -> None:
                try:
                    await operation()
                except ddsi.AlreadyDeleted as error:
                    said.append(str(error))

            with trio.move_on_after(5) as patience:
                async with trio.open_nursery() as nursery:
                    nursery.start_soon(wait, everything.waits()[name])
                    for _ in range(steps):
                        await trio.lowlevel.checkpoint()
                    participant.close()
            assert not patience.cancelled_caught, f"{name} waits for ever"
            assert len(said) == 1, name


@in_trio
async def test_iterations_and_events_end_with_their_entity_for_all_tasks(domain: int) -> None:
    async with pair(domain) as p:
        ended: list[str] = []

        async def iterate(name: str, source: Any) -> None:
            async for _ in source:
                pass
            ended.append(name)

        async with trio.open_nursery() as nursery:
            for _ in range(3):
                nursery.start_soon(iterate, "samples", p.reader)
                nursery.start_soon(iterate, "events", p.reader.events())
            shared = p.reader.events()
            for _ in range(2):
                nursery.start_soon(iterate, "shared", shared)
            await trio.testing.wait_all_tasks_blocked(0.01)
            p.reader.close()
        assert sorted(ended) == ["events"] * 3 + ["samples"] * 3 + ["shared"] * 2


@in_trio
async def test_a_publisher_does_not_wait_for_a_writer_that_is_closed_meanwhile(domain: int) -> None:
    async with ddsi.DomainParticipant(domain) as participant:
        everything = Everything(participant)
        await everything.fill()
        async with trio.open_nursery() as nursery:
            nursery.start_soon(everything.publisher.wait_for_acknowledgments)
            await trio.testing.wait_all_tasks_blocked(0.01)
            everything.writer.close()


# --- data are news to everybody ------------------------------------------------------------------------------


@in_trio
async def test_waiting_for_samples_takes_the_status_of_available_data_from_nobody(domain: int) -> None:
    """Who waits for something else has not read: DDS 1.4 §2.2.4.2.2 resets the status by read and take alone."""
    async with pair(domain, local=True) as p:
        woken: list[str] = []

        async def wait(name: str, operation: Callable[[], Awaitable[Any]]) -> None:
            await operation()
            woken.append(name)

        disposed = ReadCondition(p.reader, instance_states=InstanceState.NOT_ALIVE_DISPOSED)
        available = StatusCondition(p.reader, ddsi.DataAvailable)
        async with trio.open_nursery() as nursery:
            for number in range(4):
                nursery.start_soon(wait, f"disposed {number}", lambda: p.reader.wait(disposed))
                nursery.start_soon(wait, f"available {number}", WaitSet(available).wait)
                nursery.start_soon(wait, f"either {number}", WaitSet(disposed, available).wait)
            await trio.testing.wait_all_tasks_blocked(0.01)
            await p.writer.write(Shape("RED"))
            await trio.testing.wait_all_tasks_blocked(0.01)
            assert sorted(woken) == sorted(f"{kind} {n}" for kind in ("available", "either") for n in range(4))
            assert p.reader.status(ddsi.DataAvailable).is_available
            await p.writer.dispose(Shape("RED"))
        p.reader.read()
        assert not p.reader.status(ddsi.DataAvailable).is_available


@in_trio
async def test_iterating_reads_so_the_next_sample_is_news_to_others(domain: int) -> None:
    async with pair(domain, local=True) as p:
        await p.writer.write(Shape("RED"))
        events = p.reader.events()
        await anext(p.reader)
        assert not p.reader.status(ddsi.DataAvailable).is_available
        kinds = []
        await p.writer.write(Shape("RED"))
        p.reader.close()
        async for event in events:
            kinds.append(type(event))
        assert kinds.count(ddsi.DataAvailable) >= 1
        assert p.reader.is_closed


@pytest.mark.parametrize("local", [True, False])
@in_trio
async def test_events_tell_of_data_that_came_before_anybody_listened(domain: int, local: bool) -> None:
    async with pair(domain, local=local) as p:
        await p.writer.write(Shape("RED"))
        while not p.reader.status(ddsi.DataAvailable).is_available:
            await trio.sleep(0.002)
        for _ in range(2):  # whoever listens
            async for event in p.reader.events():
                if isinstance(event, ddsi.DataAvailable):
                    break
        assert len(p.reader.take()) == 1


@pytest.mark.parametrize("local", [True, False])
@in_trio
async def test_a_wait_set_is_woken_by_data_on_readers_of_a_subscriber(domain: int, local: bool) -> None:
    async with ddsi.DomainParticipant(domain) as here, ddsi.DomainParticipant(domain) as other:
        there = here if local else other
        subscriber = ddsi.Subscriber(there)
        reader = ddsi.DataReader(subscriber, ddsi.Topic(there, "Square", Shape), RELIABLE)
        writer = ddsi.DataWriter(here, ddsi.Topic(here, "Square", Shape), RELIABLE)
        await writer.wait_for_matched(timeout=5)
        condition = StatusCondition(subscriber, ddsi.DataOnReaders)
        for number in range(3):
            async with trio.open_nursery() as nursery:
                nursery.start_soon(WaitSet(condition).wait, 5)
                await trio.testing.wait_all_tasks_blocked(0.01)
                await writer.write(Shape("RED", number))
            assert [sample.data.x for sample in reader.take()] == [number]
            assert not condition.trigger_value


@in_trio
async def test_who_waits_for_a_state_is_woken_when_another_task_brings_it_about(domain: int) -> None:
    """Reading makes samples READ, and their instance NOT_NEW."""
    async with pair(domain, local=True) as p:
        wanted = [ReadCondition(p.reader, sample_states=SampleState.READ)]
        wanted.append(ReadCondition(p.reader, view_states=ViewState.NOT_NEW))
        await p.writer.write(Shape("RED"))
        async with trio.open_nursery() as nursery:
            for condition in wanted:
                nursery.start_soon(WaitSet(condition).wait, 5)
                nursery.start_soon(p.reader.wait, condition)
            await trio.testing.wait_all_tasks_blocked(0.01)
            p.reader.read()
        p.reader.take()
        await p.writer.write(Shape("BLUE", 1))
        await p.writer.write(Shape("BLUE", 2))
        async with trio.open_nursery() as nursery:
            for condition in wanted[1:]:
                nursery.start_soon(WaitSet(condition).wait, 5)
                nursery.start_soon(p.reader.wait, condition)
            await trio.testing.wait_all_tasks_blocked(0.01)
            p.reader.take(1)


@in_trio
async def test_who_waits_for_a_query_is_woken_by_its_new_parameters(domain: int) -> None:
    async with pair(domain, local=True) as p:
        query = ddsi.QueryCondition(p.reader, expression="x > %0", parameters=["5"])
        await p.writer.write(Shape("RED", 3))
        async with trio.open_nursery() as nursery:
            nursery.start_soon(WaitSet(query).wait, 5)
            nursery.start_soon(p.reader.wait, query)
            await trio.testing.wait_all_tasks_blocked(0.01)
            query.set_query_parameters(["2"])


@in_trio
async def test_what_a_query_raises_leaves_a_wait_set_as_itself(domain: int) -> None:
    """Whenever the sample comes that it is asked about."""
    for steps in range(4):
        async with pair(domain, local=True) as p:
            condition = ReadCondition(p.reader, query=lambda shape: bool(1 // shape.x))
            async with trio.open_nursery() as nursery:

                async def wait(condition: ReadCondition = condition) -> None:
                    with pytest.raises(ZeroDivisionError):
                        await WaitSet(condition).wait(5)

                nursery.start_soon(wait)
                for _ in range(steps):
                    await trio.lowlevel.checkpoint()
                await p.writer.write(Shape("RED", 0))


@in_trio
async def test_who_iterates_a_reader_that_is_not_enabled_gets_what_comes_when_it_is(domain: int) -> None:
    """Until it is enabled its policies may change altogether, which makes another reader of it inside."""
    manual = ddsi.Qos(entity_factory=ddsi.EntityFactory(autoenable_created_entities=False))
    async with ddsi.DomainParticipant(domain) as here, ddsi.DomainParticipant(domain) as there:
        reader = ddsi.DataReader(ddsi.Subscriber(there, manual), ddsi.Topic(there, "Square", Shape))
        writer = ddsi.DataWriter(here, ddsi.Topic(here, "Square", Shape), RELIABLE)
        got: list[Shape] = []

        async def iterate() -> None:
            got.append((await anext(reader)).data)

        async with trio.open_nursery() as nursery:
            nursery.start_soon(iterate)
            await trio.testing.wait_all_tasks_blocked(0.01)
            reader.set_qos(RELIABLE)
            reader.enable()
            await writer.wait_for_matched(timeout=5)
            await writer.write(Shape("RED", 1))
        assert got == [Shape("RED", 1)]


# --- joined topics ---------------------------------------------------------------------------------------


@in_trio
async def test_a_reader_of_joined_topics_has_statuses_and_belongs_to_its_subscriber(domain: int) -> None:
    async with ddsi.DomainParticipant(domain) as participant:
        topics: list[ddsi.Topic[Any]] = [
            ddsi.Topic(participant, "Where", Where),
            ddsi.Topic(participant, "Who", Who),
        ]
        writers = [ddsi.DataWriter(participant, topic, RELIABLE) for topic in topics]
        joined = ddsi.MultiTopic(participant, "Both", Both, "SELECT * FROM Where NATURAL JOIN Who")
        subscriber = ddsi.Subscriber(participant)
        reader = ddsi.MultiTopicReader(subscriber, joined, RELIABLE)
        condition = StatusCondition(reader, ddsi.DataAvailable)
        async with trio.open_nursery() as nursery:
            for wait in (WaitSet(condition).wait, reader.wait, subscriber.wait):
                nursery.start_soon(wait)
            await trio.testing.wait_all_tasks_blocked(0.01)
            await writers[0].write(Where("x", 1))
            await trio.testing.wait_all_tasks_blocked(0.01)
            assert nursery.child_tasks, "half a row is none"
            assert not condition.trigger_value
            await writers[1].write(Who("x", 2))
        found: list[Any] = subscriber.get_datareaders()
        assert found == [reader]
        assert [sample.data for sample in reader.take()] == [Both("x", 1, 2)]
        assert (condition.trigger_value, subscriber.get_datareaders()) == (False, [])
