"""``wait_for_matched``, ``wait_for_historical_data`` and the timeouts of all waits."""

from __future__ import annotations

from typing import Any

import pytest
import trio

import ddsi
from tests.dcps.running import RELIABLE, Shape, in_trio, pair

HISTORY = RELIABLE | ddsi.Qos(durability=ddsi.TransientLocal())


@in_trio
async def test_waiting_for_a_match_times_out_with_words(domain: int) -> None:
    async with ddsi.DomainParticipant(domain) as participant:
        topic = ddsi.Topic(participant, "Square", Shape)
        writer = ddsi.DataWriter(participant, topic)
        with pytest.raises(ddsi.DdsTimeout, match=r"'Square' has not matched 1 reader.* after 0.01 s"):
            await writer.wait_for_matched(timeout=0.01)
        reader = ddsi.DataReader(participant, topic)
        await writer.wait_for_matched(timeout=0)
        with pytest.raises(ddsi.DdsTimeout, match=r"has not matched 2 writer"):
            await reader.wait_for_matched(2, timeout=0)


@in_trio
async def test_a_match_ends_the_wait_at_once(domain: int) -> None:
    async with ddsi.DomainParticipant(domain) as participant, trio.open_nursery() as nursery:
        topic = ddsi.Topic(participant, "Square", Shape)
        reader = ddsi.DataReader(participant, topic)
        nursery.start_soon(reader.wait_for_matched, 3, 5)
        for _ in range(3):
            await trio.sleep(0.002)
            ddsi.DataWriter(participant, topic)


@in_trio
async def test_the_end_of_the_entity_ends_the_wait(domain: int) -> None:
    async with ddsi.DomainParticipant(domain) as participant:
        topic = ddsi.Topic(participant, "Square", Shape)
        waits: list[tuple[ddsi.Entity, Any]] = [
            (writer := ddsi.DataWriter(participant, topic), lambda: writer.wait_for_matched(9)),
            (reader := ddsi.DataReader(participant, topic), lambda: reader.wait_for_matched(9)),
            (participant, participant.wait_for_discovery),
        ]

        async def fails(wait: Any) -> None:
            with pytest.raises(ddsi.AlreadyDeleted):
                await wait()

        for entity, wait in waits:
            async with trio.open_nursery() as nursery:
                nursery.start_soon(fails, wait)
                await trio.sleep(0.002)
                entity.close()


@pytest.mark.parametrize("timeout", [-1, float("nan"), "1"])
@in_trio
async def test_an_impossible_timeout_is_refused(domain: int, timeout: Any) -> None:
    async with pair(domain, local=True) as p:
        for wait in (
            p.writer.wait_for_acknowledgments,
            lambda timeout: p.writer.wait_for_matched(1, timeout),
            lambda timeout: p.reader.wait_for_matched(1, timeout),
            p.reader.wait_for_historical_data,
        ):
            with pytest.raises(ddsi.BadParameter, match="timeout is a number of seconds"):
                await wait(timeout)


@in_trio
async def test_acknowledgments_that_do_not_come_time_out_with_numbers(domain: int) -> None:
    full = RELIABLE | ddsi.Qos(resource_limits=ddsi.ResourceLimits(max_samples=2))
    async with pair(domain, reader=full) as p:
        for number in range(3):
            await p.writer.write(Shape("RED", number))
        with pytest.raises(ddsi.DdsTimeout, match=r"number 2 of 3 is acknowledged after 0.1 s"):
            await p.writer.wait_for_acknowledgments(0.1)
        p.reader.take()
        await p.writer.wait_for_acknowledgments(5)


# --- history ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("local", [False, True])
@in_trio
async def test_a_late_joiner_has_the_history_when_the_wait_ends(domain: int, local: bool) -> None:
    async with ddsi.DomainParticipant(domain) as here, ddsi.DomainParticipant(domain) as other:
        writer = ddsi.DataWriter(here, ddsi.Topic(here, "Square", Shape), HISTORY)
        for number in range(300):
            await writer.write(Shape("RED", number))
        there = here if local else other
        reader = ddsi.DataReader(there, ddsi.Topic(there, "Square", Shape), HISTORY)
        await reader.wait_for_matched(timeout=5)
        await reader.wait_for_historical_data(timeout=5)
        assert [sample.data.x for sample in reader.take()] == list(range(300))


@in_trio
async def test_an_empty_history_is_complete(domain: int) -> None:
    async with pair(domain, writer=HISTORY, reader=HISTORY) as p:
        await p.reader.wait_for_historical_data(timeout=2)


@in_trio
async def test_without_history_there_is_nothing_to_wait_for(domain: int) -> None:
    async with pair(domain, writer=HISTORY) as p:
        await p.reader.wait_for_historical_data(timeout=0)


@in_trio
async def test_a_volatile_reader_gets_nothing_from_before_the_match(domain: int) -> None:
    async with ddsi.DomainParticipant(domain) as here, ddsi.DomainParticipant(domain) as there:
        writer = ddsi.DataWriter(here, ddsi.Topic(here, "Square", Shape), HISTORY)
        await writer.write(Shape("RED", 0))
        reader = ddsi.DataReader(there, ddsi.Topic(there, "Square", Shape), RELIABLE)
        await writer.wait_for_matched(timeout=5)
        await writer.write(Shape("RED", 1))
        assert (await anext(reader)).data.x == 1


@in_trio
async def test_history_depth_bounds_what_a_late_joiner_gets(domain: int) -> None:
    latest = HISTORY | ddsi.Qos(history=ddsi.KeepLast(2))
    async with ddsi.DomainParticipant(domain) as here, ddsi.DomainParticipant(domain) as there:
        writer = ddsi.DataWriter(here, ddsi.Topic(here, "Square", Shape), latest)
        for number in range(10):
            for color in ("RED", "BLUE"):
                await writer.write(Shape(color, number))
        reader = ddsi.DataReader(there, ddsi.Topic(there, "Square", Shape), HISTORY)
        await reader.wait_for_matched(timeout=5)
        await reader.wait_for_historical_data(timeout=5)
        samples = [(sample.data.color, sample.data.x) for sample in reader.take()]
        assert samples == [("RED", 8), ("RED", 9), ("BLUE", 8), ("BLUE", 9)]


@in_trio
async def test_history_that_does_not_come_times_out(domain: int) -> None:
    full = HISTORY | ddsi.Qos(resource_limits=ddsi.ResourceLimits(max_samples=2))
    async with ddsi.DomainParticipant(domain) as here, ddsi.DomainParticipant(domain) as there:
        writer = ddsi.DataWriter(here, ddsi.Topic(here, "Square", Shape), HISTORY)
        for number in range(5):
            await writer.write(Shape("RED", number))
        reader = ddsi.DataReader(there, ddsi.Topic(there, "Square", Shape), full)
        await reader.wait_for_matched(timeout=5)
        with pytest.raises(ddsi.DdsTimeout, match=r"'Square' still lacks historical data after 0.1 s"):
            await reader.wait_for_historical_data(timeout=0.1)


@in_trio
async def test_discovery_can_be_waited_for(domain: int) -> None:
    async with ddsi.DomainParticipant(domain) as participant, trio.open_nursery() as nursery:

        async def join_and_leave() -> None:
            async with ddsi.DomainParticipant(domain):
                await trio.sleep(0.05)

        nursery.start_soon(join_and_leave)
        with trio.fail_after(5):
            while not participant.discovered_participants():
                await participant.wait_for_discovery()
            while participant.discovered_participants():
                await participant.wait_for_discovery()
