"""ddsi.aio: the entities as a task of asyncio uses them."""

from __future__ import annotations

import asyncio
import functools
import threading
from collections.abc import Awaitable, Callable
from typing import Annotated, Any, ParamSpec, assert_type

import pytest
import trio

import ddsi
from ddsi import aio, idl
from tests.dcps.running import RELIABLE, Note, Shape, config

P = ParamSpec("P")


@idl.struct
class Plan:
    color: Annotated[str, idl.key, idl.bound(128)]
    owner: str = ""


@idl.struct
class Owned:
    color: Annotated[str, idl.key, idl.bound(128)]
    x: idl.int32
    owner: str = ""


def in_asyncio(test: Callable[P, Awaitable[None]]) -> Callable[P, None]:
    """The async test as one that pytest runs.  It fails after twenty seconds rather than hang."""

    @functools.wraps(test)
    def run(*args: P.args, **kwargs: P.kwargs) -> None:
        async def limited() -> None:
            async with asyncio.timeout(20):
                await test(*args, **kwargs)

        asyncio.run(limited())

    return run


class Pair:
    """A writer and a reader in one participant."""

    def __init__(self, participant: aio.DomainParticipant, qos: ddsi.Qos = RELIABLE) -> None:
        self.topic = aio.Topic(participant, "Square", Shape)
        self.writer = aio.DataWriter(participant, self.topic, qos)
        self.reader = aio.DataReader(participant, self.topic, qos)


@in_asyncio
async def test_samples_go_from_a_participant_to_another_in_order(domain: int) -> None:
    async with aio.DomainParticipant(domain) as here, aio.DomainParticipant(domain) as there:
        writer = aio.DataWriter(here, aio.Topic(here, "Square", Shape), RELIABLE)
        reader = aio.DataReader(there, aio.Topic(there, "Square", Shape), RELIABLE)
        assert_type(reader, aio.DataReader[Shape])
        await writer.wait_for_matched(timeout=5)
        await reader.wait_for_matched(timeout=5)
        for number in range(200):
            await writer.write(Shape("BLUE", number))
        await writer.write_all(Shape("BLUE", number) for number in range(200, 400))
        seen = []
        async for sample in reader:
            assert_type(sample.data, Shape)
            seen.append(sample.data.x)
            if len(seen) == 400:
                break
        assert seen == list(range(400))
        await writer.wait_for_acknowledgments(timeout=5)
        await writer.dispose(Shape("BLUE"))
        end = await reader.__anext__()
        assert end.info.instance_state is ddsi.InstanceState.NOT_ALIVE_DISPOSED
        await writer.unregister(Shape("BLUE"))


@in_asyncio
async def test_what_tasks_write_at_once_leaves_in_the_order_in_which_they_asked(domain: int) -> None:
    async with aio.DomainParticipant(domain) as participant:
        pair = Pair(participant)
        await asyncio.gather(*(pair.writer.write(Shape("BLUE", number)) for number in range(200)))
        assert [sample.data.x for sample in await pair.reader.take()] == list(range(200))


@in_asyncio
async def test_cancelling_a_wait_cancels_it_in_the_engine_and_loses_no_sample(domain: int) -> None:
    """Whenever the cancellation comes, every sample is handed out once, and in order."""
    async with aio.DomainParticipant(domain) as participant:
        pair = Pair(participant)
        seen: list[int] = []

        async def iterate() -> None:
            async for sample in pair.reader:
                seen.append(sample.data.x)

        for number in range(150):
            task = asyncio.create_task(iterate())
            for _ in range(number % 7):
                await asyncio.sleep(0)
            await pair.writer.write(Shape("BLUE", number))
            for _ in range(number % 5):
                await asyncio.sleep(0)
            task.cancel()
            with pytest.raises(asyncio.CancelledError):
                await task
        seen += [sample.data.x for sample in await pair.reader.take()]
        assert seen == list(range(150))
        tasks = await participant._engine.run_for_asyncio(_living_calls)
        assert tasks == 1, "only the call that counts"


async def _living_calls() -> int:
    import trio

    root = trio.lowlevel.current_root_task()
    assert root is not None
    waiting = [root]
    count = 0
    while waiting:
        task = waiting.pop()
        count += task.name == "ddsi call"
        waiting += [child for nursery in task.child_nurseries for child in nursery.child_tasks]
    return count


@in_asyncio
async def test_tasks_that_iterate_over_one_reader_share_its_samples_until_it_is_closed(domain: int) -> None:
    """None of them ends because another took what it had fetched."""
    async with aio.DomainParticipant(domain) as participant:
        pair = Pair(participant)
        seen: list[int] = []

        async def iterate() -> None:
            async for sample in pair.reader:
                seen.append(sample.data.x)

        tasks = [asyncio.create_task(iterate()) for _ in range(4)]
        for number in range(100):
            await pair.writer.write(Shape("BLUE", number))
            await asyncio.sleep(0)
        while len(seen) < 100:
            await asyncio.sleep(0.005)
        assert not any(task.done() for task in tasks)
        pair.reader.close()
        await asyncio.gather(*tasks)
        assert sorted(seen) == list(range(100))


@in_asyncio
async def test_a_write_that_is_cancelled_while_it_waits_for_room_is_not_done(domain: int) -> None:
    qos = ddsi.Qos(
        reliability=ddsi.Reliable(max_blocking_time=20),
        history=ddsi.KeepAll(),
        resource_limits=ddsi.ResourceLimits(max_samples=2),
    )
    async with aio.DomainParticipant(domain) as here, aio.DomainParticipant(domain) as there:
        writer = aio.DataWriter(here, aio.Topic(here, "Square", Shape), qos)
        reader = aio.DataReader(there, aio.Topic(there, "Square", Shape), qos)
        await writer.wait_for_matched(timeout=5)
        await reader.wait_for_matched(timeout=5)
        written = 0
        with pytest.raises(TimeoutError):
            async with asyncio.timeout(0.3):
                while True:
                    await writer.write(Shape("BLUE", written))
                    written += 1
        # One that waits behind another is cancelled at once too.
        first, second = (asyncio.create_task(writer.write(Shape("BLUE", -1))) for _ in range(2))
        await asyncio.sleep(0.05)
        second.cancel()
        with pytest.raises(asyncio.CancelledError):
            await second
        first.cancel()
        with pytest.raises(asyncio.CancelledError):
            await first
        seen: list[int] = []
        while len(seen) < written:
            seen += [sample.data.x for sample in await reader.take()]
            await asyncio.sleep(0.005)
        assert seen == list(range(written))
        assert await reader.take() == []


@in_asyncio
async def test_errors_come_through_as_themselves(domain: int) -> None:
    async with aio.DomainParticipant(domain) as participant:
        pair = Pair(participant)
        with pytest.raises(ddsi.BadParameter, match="x"):
            await pair.writer.write(Shape("BLUE", "no number"))  # type: ignore[arg-type]
        with pytest.raises(ddsi.DdsTimeout, match="2 reader"):
            await pair.writer.wait_for_matched(2, timeout=0.01)
        pair.writer.close()
        with pytest.raises(ddsi.AlreadyDeleted):
            await pair.writer.write(Shape("BLUE"))
        inner: Any = ddsi.DomainParticipant(domain)
        with pytest.raises(ddsi.BadParameter, match=r"ddsi\.aio"):
            aio.Topic(inner, "Square", Shape)
    with pytest.raises(ddsi.PreconditionNotMet, match="entered once"):
        await participant.__aenter__()
    with pytest.raises(ddsi.PreconditionNotMet, match="enter it first"):
        aio.Topic(aio.DomainParticipant(domain), "Square", Shape)


@in_asyncio
async def test_an_error_of_the_body_leaves_as_itself(domain: int) -> None:
    with pytest.raises(KeyError, match="mine"):
        async with aio.DomainParticipant(domain):
            raise KeyError("mine")
    assert "ddsi engine" not in {thread.name for thread in threading.enumerate()}


@in_asyncio
async def test_a_participant_that_was_not_entered_says_so_and_can_be_closed(domain: int) -> None:
    participant = aio.DomainParticipant(domain)
    with pytest.raises(ddsi.PreconditionNotMet, match="enter it first"):
        participant.events()
    with pytest.raises(ddsi.PreconditionNotMet, match="enter it first"):
        aio.GuardCondition(participant)
    assert participant.status(ddsi.SecurityRevoked) == ddsi.SecurityRevoked()
    participant.close()
    participant.close()
    assert participant.is_closed
    with pytest.raises(ddsi.AlreadyDeleted):
        await participant.__aenter__()


@in_asyncio
async def test_cancelling_the_body_closes_the_participant(domain: int) -> None:
    participants = []

    async def body() -> None:
        async with aio.DomainParticipant(domain) as participant:
            participants.append(participant)
            await Pair(participant).reader.wait()

    task = asyncio.create_task(body())
    while not participants:
        await asyncio.sleep(0.005)
    task.cancel()
    with pytest.raises(asyncio.CancelledError):
        await task
    assert participants[0].is_closed


@in_asyncio
async def test_a_participant_whose_entering_is_cancelled_leaves_nothing_behind(domain: int) -> None:
    for steps in range(6):
        task = asyncio.create_task(aio.DomainParticipant(domain).__aenter__())
        for _ in range(steps):
            await asyncio.sleep(0)
        task.cancel()
        try:
            participant = await task
        except asyncio.CancelledError:
            continue
        await participant.__aexit__(None, None, None)
    for thread in threading.enumerate():
        if thread.name == "ddsi engine":
            thread.join(5)
            assert not thread.is_alive()


@in_asyncio
async def test_closing_ends_what_other_tasks_wait_for(domain: int) -> None:
    async def collect(stream: Any) -> list[Any]:
        return [item async for item in stream]

    async with aio.DomainParticipant(domain) as participant:
        pair = Pair(participant)
        iteration = asyncio.create_task(collect(pair.reader))
        events = asyncio.create_task(collect(pair.reader.events()))
        wait = asyncio.create_task(pair.reader.wait())
        await asyncio.sleep(0.05)
    assert await iteration == []
    assert isinstance((await events)[0], ddsi.SubscriptionMatched)
    with pytest.raises(ddsi.AlreadyDeleted):
        await wait


@in_asyncio
async def test_reading_groups_and_who_is_there(domain: int) -> None:
    async with aio.DomainParticipant(domain) as here, aio.DomainParticipant(domain) as there:
        in_a = ddsi.Qos(partition=ddsi.Partition("a"))
        topic = aio.Topic(here, "Note", Note)
        writer = aio.DataWriter(aio.Publisher(here, in_a), topic)
        reader = aio.DataReader(aio.Subscriber(there, in_a), aio.Topic(there, "Note", Note), RELIABLE)
        await reader.wait_for_matched(timeout=5)
        await reader.wait_for_historical_data(timeout=5)
        assert reader.matched_publications() == [writer.guid]
        builtin = aio.BuiltinTopicReader(there, ddsi.PublicationBuiltinTopicData)
        await builtin.wait()
        assert [sample.data.topic_name for sample in await builtin.read()] == ["Note"]
        assert reader.status(ddsi.SubscriptionMatched).current_count == 1
        await writer.write_all([Note(1), Note(2)])
        await reader.wait(ddsi.ReadCondition(query=lambda note: note.number == 2))
        assert [sample.data.number for sample in await reader.read(1)] == [1]
        unread = await reader.take(sample_states=ddsi.SampleState.NOT_READ)
        assert [sample.data.number for sample in unread] == [2]
        reader.close()
        await asyncio.wait_for(there.wait_for_discovery(), 10) if not there.discovered_publications() else None
        assert [data.topic_name for data in there.discovered_publications()] == ["Note"]


@in_asyncio
async def test_other_tasks_run_while_one_waits(domain: int) -> None:
    async with aio.DomainParticipant(domain) as participant:
        pair = Pair(participant)
        waiting = asyncio.create_task(pair.reader.__anext__())
        for _ in range(10):
            await asyncio.sleep(0)
        assert not waiting.done()
        await pair.writer.write(Shape("BLUE", 1))
        assert (await waiting).data.x == 1


def test_two_loops_in_two_threads_share_the_engine(domain: int) -> None:
    met = threading.Barrier(2, timeout=10)
    engines: list[object] = []

    async def one() -> None:
        async with aio.DomainParticipant(domain) as participant:
            pair = Pair(participant, RELIABLE | ddsi.Qos(partition=ddsi.Partition(threading.current_thread().name)))
            await asyncio.to_thread(met.wait)
            engines.append(participant._engine)
            await pair.writer.write(Shape("BLUE", 1))
            assert (await pair.reader.__anext__()).data.x == 1
            await asyncio.to_thread(met.wait)

    threads = [threading.Thread(target=lambda: asyncio.run(one())) for _ in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(20)
    assert len(engines) == 2
    assert engines[0] is engines[1]


@in_asyncio
async def test_conditions_filters_and_groups(domain: int) -> None:
    async with aio.DomainParticipant(domain) as participant:
        topic = aio.Topic(participant, "Square", Shape)
        filtered = aio.ContentFilteredTopic(participant, "Big", topic, "x > %0", ["5"])
        subscriber = aio.Subscriber(participant)
        reader = aio.DataReader(subscriber, filtered, RELIABLE)
        assert_type(reader, aio.DataReader[Shape])
        writer = aio.DataWriter(participant, topic, RELIABLE)
        guard = aio.GuardCondition(participant)
        seven = aio.QueryCondition(reader, expression="x = 7")
        waiting = asyncio.create_task(aio.WaitSet(participant, guard, seven).wait(timeout=10))
        await writer.write_all([Shape("a", 1), Shape("b", 6), Shape("c", 7)])
        assert await waiting == [seven]
        await subscriber.wait()
        assert await subscriber.get_datareaders() == [reader]
        (first,) = await reader.read_next_instance(None)
        assert first.data == Shape("b", 6)
        (second,) = await reader.take_next_instance(first.info.instance_handle)
        assert second.data == Shape("c", 7)
        assert await reader.take(condition=seven) == []
        waiting = asyncio.create_task(aio.WaitSet(participant, guard).wait())
        await asyncio.sleep(0)
        guard.set_trigger_value(True)
        assert await waiting == [guard]


@in_asyncio
async def test_topics_are_joined(domain: int) -> None:
    async with aio.DomainParticipant(domain) as participant:
        shapes = aio.DataWriter(participant, aio.Topic(participant, "Square", Shape), RELIABLE)
        plans = aio.DataWriter(participant, aio.Topic(participant, "Plan", Plan), RELIABLE)
        text = "SELECT color, x, owner FROM Square NATURAL JOIN Plan WHERE x < %0"
        topic = aio.MultiTopic(participant, "Owned", Owned, text, ["10"])
        assert (topic.name, topic.subscription_expression, topic.expression_parameters) == ("Owned", text, ("10",))
        reader = aio.MultiTopicReader(participant, topic, RELIABLE)
        assert_type(reader, aio.MultiTopicReader[Owned])
        await reader.wait_for_matched(timeout=5)
        waiting = asyncio.create_task(reader.__anext__())
        await shapes.write_all([Shape("BLUE", 1), Shape("RED", 20)])
        await plans.write_all([Plan("BLUE", "Ada"), Plan("RED", "Bob")])
        sample = await waiting
        assert_type(sample, ddsi.Sample[Owned])
        assert sample.data == Owned("BLUE", 1, "Ada")
        assert await reader.take() == []
        topic.set_expression_parameters(["100"])
        await reader.wait(aio.QueryCondition(reader, expression="x > 10"))
        assert Owned("RED", 20, "Bob") in [sample.data for sample in await reader.take()]
        with pytest.raises(ddsi.BadParameter, match="has no topic 'Plans'"):
            aio.MultiTopic(participant, "Owned", Owned, "SELECT * FROM Plans")
        inner: Any = topic._inner
        with pytest.raises(ddsi.BadParameter, match=r"ddsi\.aio"):
            aio.MultiTopicReader(participant, inner)
    assert [sample async for sample in reader] == []


def test_a_participant_is_refused_where_asyncio_does_not_run() -> None:
    async def main() -> None:
        async with aio.DomainParticipant(0, config=config()):
            pass

    with pytest.raises(ddsi.PreconditionNotMet, match=r"asyncio\.run\(main\(\)\).*ddsi for trio, of ddsi\.blocking"):
        trio.run(main)
