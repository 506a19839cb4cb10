"""PRESENTATION as applications meet it: coherent sets, ordered access, access blocks, and suspended publications."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass

import pytest
import trio

import ddsi
from ddsi import AccessScope, Presentation, ReadCondition, SampleState
from tests.dcps.running import RELIABLE, Shape, config, eventually, in_trio

TOPICS = ("Red", "Green")
INSTANCE, TOPIC, GROUP = AccessScope.INSTANCE, AccessScope.TOPIC, AccessScope.GROUP


@dataclass
class Stage:
    """A publisher and a subscriber, each with an endpoint on both topics."""

    publisher: ddsi.Publisher
    subscriber: ddsi.Subscriber
    writers: list[ddsi.DataWriter[Shape]]
    readers: list[ddsi.DataReader[Shape]]

    async def arrived(self) -> None:
        for writer in self.writers:
            await writer.wait_for_acknowledgments(timeout=5)

    def held(self) -> int:
        return sum(len(reader._history) for reader in self.readers)


@asynccontextmanager
async def stage(
    domain: int, policy: Presentation, *, requested: Presentation | None = None, local: bool = False
) -> AsyncIterator[Stage]:
    async with (
        ddsi.DomainParticipant(domain, config=config()) as here,
        ddsi.DomainParticipant(domain, config=config()) as there,
    ):
        other = here if local else there
        publisher = ddsi.Publisher(here, ddsi.Qos(presentation=policy))
        subscriber = ddsi.Subscriber(other, ddsi.Qos(presentation=requested or policy))
        writers = [ddsi.DataWriter(publisher, ddsi.Topic(here, name, Shape), RELIABLE) for name in TOPICS]
        readers = [ddsi.DataReader(subscriber, ddsi.Topic(other, name, Shape), RELIABLE) for name in TOPICS]
        for writer, reader in zip(writers, readers, strict=True):
            await writer.wait_for_matched(timeout=10)
            await reader.wait_for_matched(timeout=10)
        yield Stage(publisher, subscriber, writers, readers)


def numbers(samples: list[ddsi.Sample[Shape]]) -> list[int]:
    return [sample.data.x for sample in samples]


# --- coherent sets ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("local", [False, True])
@pytest.mark.parametrize("scope", [TOPIC, GROUP])
@in_trio
async def test_a_set_becomes_visible_when_it_ends(domain: int, scope: AccessScope, local: bool) -> None:
    async with stage(domain, Presentation(scope, coherent_access=True), local=local) as s:
        with s.publisher.coherent_changes():
            for number in range(3):
                await s.writers[0].write(Shape("RED", number))
            await s.writers[1].write(Shape("GREEN", 3))
            await s.arrived()
            assert s.held() == 0
        await eventually(lambda: s.held() == 4)
        with s.subscriber.access():
            assert [numbers(reader.take()) for reader in s.readers] == [[0, 1, 2], [3]]


@in_trio
async def test_with_instance_scope_a_set_means_nothing(domain: int) -> None:
    async with stage(domain, Presentation(INSTANCE, coherent_access=True)) as s:
        with s.publisher.coherent_changes():
            await s.writers[0].write(Shape("RED", 1))
            await eventually(lambda: s.held() == 1)
        assert numbers(s.readers[0].take()) == [1]


@in_trio
async def test_a_reader_that_does_not_ask_sees_samples_at_once(domain: int) -> None:
    async with stage(domain, Presentation(GROUP, coherent_access=True), requested=Presentation()) as s:
        with s.publisher.coherent_changes():
            await s.writers[0].write(Shape("RED", 1))
            await eventually(lambda: s.held() == 1)
        await s.arrived()
        assert s.held() == 1, "the end of the set is no sample"


@in_trio
async def test_sets_may_be_nested_and_the_outermost_counts(domain: int) -> None:
    async with stage(domain, Presentation(TOPIC, coherent_access=True)) as s:
        with s.publisher.coherent_changes():
            s.publisher.begin_coherent_changes()
            await s.writers[0].write(Shape("RED", 1))
            s.publisher.end_coherent_changes()
            await s.arrived()
            assert s.held() == 0
        await eventually(lambda: s.held() == 1)


@pytest.mark.parametrize("scope", [TOPIC, GROUP])
@in_trio
async def test_what_a_body_that_raises_has_written_is_never_seen(domain: int, scope: AccessScope) -> None:
    async with stage(domain, Presentation(scope, coherent_access=True)) as s:
        with pytest.raises(ZeroDivisionError), s.publisher.coherent_changes():
            await s.writers[0].write(Shape("RED", 1))
            raise ZeroDivisionError
        with s.publisher.coherent_changes():
            await s.writers[0].write(Shape("RED", 2))
        await eventually(lambda: s.held() == 1)
        with s.subscriber.access():
            assert numbers(s.readers[0].take()) == [2]
        await eventually(lambda: s.readers[0].status(ddsi.SampleLost).total_count >= 1)


@in_trio
async def test_a_set_that_was_not_begun_cannot_be_ended(domain: int) -> None:
    async with stage(domain, Presentation(TOPIC, coherent_access=True)) as s:
        with pytest.raises(ddsi.PreconditionNotMet, match="begin_coherent_changes"):
            s.publisher.end_coherent_changes()
        s.publisher.close()
        with pytest.raises(ddsi.AlreadyDeleted):
            s.publisher.begin_coherent_changes()


@in_trio
async def test_a_publisher_that_is_closed_within_its_set_never_shows_it(domain: int) -> None:
    async with stage(domain, Presentation(GROUP, coherent_access=True)) as s:
        with s.publisher.coherent_changes():
            await s.writers[0].write(Shape("RED", 1))
            await s.arrived()
            s.publisher.close()
        await eventually(lambda: s.readers[0].status(ddsi.SubscriptionMatched).current_count == 0)
        assert s.held() == 0


@in_trio
async def test_a_set_waits_as_a_whole_until_there_is_room_for_all_of_it(domain: int) -> None:
    async with (
        ddsi.DomainParticipant(domain, config=config()) as here,
        ddsi.DomainParticipant(domain, config=config()) as there,
    ):
        policy = ddsi.Qos(presentation=Presentation(TOPIC, coherent_access=True))
        publisher, subscriber = ddsi.Publisher(here, policy), ddsi.Subscriber(there, policy)
        writer = ddsi.DataWriter(publisher, ddsi.Topic(here, "Red", Shape), RELIABLE)
        tight = RELIABLE | ddsi.Qos(resource_limits=ddsi.ResourceLimits(max_samples=3, max_samples_per_instance=3))
        reader = ddsi.DataReader(subscriber, ddsi.Topic(there, "Red", Shape), tight)
        await writer.wait_for_matched(timeout=10)
        await reader.wait_for_matched(timeout=10)
        await writer.write(Shape("RED", 0))
        with publisher.coherent_changes():
            for number in (1, 2, 3):
                await writer.write(Shape("RED", number))
        await eventually(lambda: len(reader._history) == 1)
        await trio.sleep(0.05)
        assert numbers(reader.take()) == [0]
        await eventually(lambda: len(reader._history) == 3)
        assert numbers(reader.take()) == [1, 2, 3]
        with publisher.coherent_changes():
            for number in range(4):
                await writer.write(Shape("RED", number))
        await writer.write(Shape("RED", 9))
        await eventually(lambda: len(reader._history) == 1)
        assert numbers(reader.take()) == [9], "what can never find room is rejected, and nothing else"
        assert reader.status(ddsi.SampleRejected).total_count > 0


# --- access ----------------------------------------------------------------------------------------------


@in_trio
async def test_with_group_scope_reading_is_for_access_blocks(domain: int) -> None:
    async with stage(domain, Presentation(GROUP)) as s:
        for look in (s.readers[0].take, s.readers[0].read, s.subscriber.get_datareaders):
            with pytest.raises(ddsi.PreconditionNotMet, match=r"subscriber\.access\(\)"):
                look()
        with pytest.raises(ddsi.PreconditionNotMet, match=r"subscriber\.access\(\)"):
            await anext(s.readers[0])
        with s.subscriber.access() as subscriber:
            assert subscriber is s.subscriber
            assert s.readers[0].take() == []
            with s.subscriber.access():
                pass
            assert s.readers[0].take() == [], "the outer block goes on"
        with pytest.raises(ddsi.PreconditionNotMet, match="begin_access"):
            s.subscriber.end_access()


@pytest.mark.parametrize("scope", [INSTANCE, TOPIC])
@in_trio
async def test_elsewhere_access_blocks_mean_nothing(domain: int, scope: AccessScope) -> None:
    async with stage(domain, Presentation(scope, coherent_access=True, ordered_access=True)) as s:
        with s.subscriber.access():
            await s.writers[0].write(Shape("RED", 1))
            await eventually(lambda: s.held() == 1)
            assert s.subscriber.get_datareaders() == [s.readers[0]]
        assert numbers(s.readers[0].take()) == [1]


@in_trio
async def test_nothing_becomes_visible_during_access(domain: int) -> None:
    async with stage(domain, Presentation(GROUP, coherent_access=True)) as s:
        with s.subscriber.access():
            with s.publisher.coherent_changes():
                for writer in s.writers:
                    await writer.write(Shape("RED", 1))
            await s.arrived()
            assert s.held() == 0
        assert s.held() == 2


@pytest.mark.parametrize("coherent", [False, True])
@in_trio
async def test_with_ordered_access_to_the_group_readers_are_named_once_for_each_sample(
    domain: int, coherent: bool
) -> None:
    async with stage(domain, Presentation(GROUP, coherent, ordered_access=True)) as s:
        for number in range(6):
            await s.writers[number % 3 % 2].write(Shape("RED", number))
        await eventually(lambda: s.held() == 6)
        with s.subscriber.access():
            readers = s.subscriber.get_datareaders()
            assert [TOPICS.index(reader.topic.name) for reader in readers] == [0, 1, 0, 0, 1, 0]
            assert [numbers(reader.take()) for reader in readers] == [[number] for number in range(6)]
            assert s.subscriber.get_datareaders() == []


@in_trio
async def test_readers_are_chosen_by_the_states_of_their_samples(domain: int) -> None:
    async with stage(domain, Presentation(TOPIC, ordered_access=True)) as s:
        for writer in s.writers:
            await writer.write(Shape("RED", 1))
            await writer.write(Shape("RED", 2))
        await eventually(lambda: s.held() == 4)
        assert s.subscriber.get_datareaders() == s.readers
        s.readers[0].read()
        assert s.subscriber.get_datareaders(sample_states=SampleState.NOT_READ) == s.readers[1:]
        unread = ReadCondition(sample_states=SampleState.NOT_READ)
        assert s.subscriber.get_datareaders(unread) == s.readers[1:]


@in_trio
async def test_a_subscriber_waits_for_any_of_its_readers(domain: int) -> None:
    async with stage(domain, Presentation(GROUP, coherent_access=True)) as s:

        async def write_soon() -> None:
            await trio.sleep(0.02)
            with s.publisher.coherent_changes():
                await s.writers[1].write(Shape("RED", 1))

        async with trio.open_nursery() as nursery:
            nursery.start_soon(write_soon)
            await s.subscriber.wait()
        with s.subscriber.access():
            assert s.subscriber.get_datareaders() == s.readers[1:]
            assert numbers(s.readers[1].read()) == [1]
        with trio.move_on_after(0.05) as scope:
            await s.subscriber.wait()
        assert scope.cancelled_caught, "what was read is no news"
        s.subscriber.notify_datareaders()
        s.subscriber.close()
        with pytest.raises(ddsi.AlreadyDeleted):
            await s.subscriber.wait()


# --- order -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("policy", "expected"),
    [
        (Presentation(), [0, 2, 1, 3]),
        (Presentation(INSTANCE, ordered_access=True), [0, 2, 1, 3]),
        (Presentation(TOPIC), [0, 2, 1, 3]),
        (Presentation(TOPIC, ordered_access=True), [0, 1, 2, 3]),
    ],
)
@in_trio
async def test_order_beyond_instances_is_for_those_who_ask(
    domain: int, policy: Presentation, expected: list[int]
) -> None:
    async with stage(domain, Presentation(GROUP, ordered_access=True), requested=policy) as s:
        for number in range(4):
            await s.writers[0].write(Shape(("RED", "BLUE")[number % 2], number))
        await eventually(lambda: s.held() == 4)
        assert numbers(s.readers[0].take()) == expected


# --- suspended publications ------------------------------------------------------------------------------


@pytest.mark.parametrize("local", [False, True])
@in_trio
async def test_what_is_suspended_is_sent_when_publications_resume(domain: int, local: bool) -> None:
    async with stage(domain, Presentation(), local=local) as s:
        s.publisher.suspend_publications()
        for number in range(3):
            for writer in s.writers:
                await writer.write(Shape("RED", number))
        await trio.sleep(0.05)
        assert s.held() == 0
        with pytest.raises(ddsi.DdsTimeout):
            await s.writers[0].wait_for_acknowledgments(timeout=0.01)
        s.publisher.resume_publications()
        await s.arrived()
        assert [numbers(reader.take()) for reader in s.readers] == [[0, 1, 2]] * 2
        with pytest.raises(ddsi.PreconditionNotMet, match="suspend_publications"):
            s.publisher.resume_publications()


@in_trio
async def test_a_writer_that_is_made_meanwhile_is_suspended_too(domain: int) -> None:
    async with stage(domain, Presentation()) as s:
        s.publisher.suspend_publications()
        late = ddsi.DataWriter(s.publisher, s.writers[0].topic, RELIABLE)
        await late.wait_for_matched(timeout=10)
        await late.write(Shape("RED", 1))
        await trio.sleep(0.05)
        assert s.held() == 0
        s.publisher.resume_publications()
        await eventually(lambda: s.held() == 1)


@in_trio
async def test_what_keep_last_replaces_while_suspended_is_never_sent(domain: int) -> None:
    async with (
        ddsi.DomainParticipant(domain, config=config()) as here,
        ddsi.DomainParticipant(domain, config=config()) as there,
    ):
        publisher = ddsi.Publisher(here)
        writer = ddsi.DataWriter(publisher, ddsi.Topic(here, "Red", Shape), ddsi.Qos(history=ddsi.KeepLast(1)))
        reader = ddsi.DataReader(there, ddsi.Topic(there, "Red", Shape), RELIABLE)
        await writer.wait_for_matched(timeout=10)
        await reader.wait_for_matched(timeout=10)
        publisher.suspend_publications()
        for number in range(5):
            await writer.write(Shape("RED", number))
        publisher.resume_publications()
        await eventually(lambda: len(reader._history) == 1)
        assert numbers(reader.take()) == [4]


@in_trio
async def test_a_publisher_that_is_closed_sends_what_it_kept(domain: int) -> None:
    async with stage(domain, Presentation()) as s:
        s.publisher.suspend_publications()
        for writer in s.writers:
            await writer.write(Shape("RED", 1))
        s.publisher.close()
        await eventually(lambda: all(reader.read(max_samples=1) for reader in s.readers))


@pytest.mark.parametrize("local", [True, False])
@in_trio
async def test_a_writer_that_is_closed_meanwhile_sends_what_it_kept(domain: int, local: bool) -> None:
    async with stage(domain, Presentation(), local=local) as s:
        s.publisher.suspend_publications()
        for number in range(3):
            await s.writers[0].write(Shape("RED", number))
        s.writers[0].close()
        await eventually(lambda: s.held() == 4)
        samples = s.readers[0].take()
        assert numbers([sample for sample in samples if sample.info.valid_data]) == [0, 1, 2]
        assert samples[-1].info.instance_state is ddsi.InstanceState.NOT_ALIVE_DISPOSED


@in_trio
async def test_a_publisher_waits_for_the_acknowledgments_of_all_its_writers(domain: int) -> None:
    async with stage(domain, Presentation()) as s:
        await s.writers[1].write(Shape("RED", 1))
        await s.publisher.wait_for_acknowledgments(timeout=5)
        assert s.held() == 1
        s.publisher.suspend_publications()
        await s.writers[0].write(Shape("RED", 1))
        with pytest.raises(ddsi.DdsTimeout, match="Publisher"):
            await s.publisher.wait_for_acknowledgments(timeout=0.02)
        s.publisher.resume_publications()
        await s.publisher.wait_for_acknowledgments(timeout=5)
