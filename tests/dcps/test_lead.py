"""A task that waits for samples reads the socket itself; whatever ends that, nothing that comes is left unread."""

from __future__ import annotations

import trio

import ddsi

from .running import Note, Pair, domain, eventually, in_trio, pair

__all__ = ["domain"]


async def _take_all(reader: ddsi.DataReader[Note], taken: list[int]) -> None:
    async for sample in reader:
        taken.append(sample.data.number)


async def _somebody_leads(of: Pair, taken: list[int]) -> None:
    """A sample makes the task that waits for it the leader, as it waits again: the second one if not the first."""
    for count in (1, 2):
        await trio.sleep(0.001)
        await of.writer.write(Note(-1))
        await eventually(lambda: len(taken) == count)  # noqa: B023
    await eventually(lambda: of.reader._pump._lead._waits_for is not None)
    taken.clear()


@in_trio
async def test_who_waits_for_samples_leads(domain: int) -> None:
    async with pair(domain, kind=Note) as of, trio.open_nursery() as nursery:
        taken: list[int] = []
        nursery.start_soon(_take_all, of.reader, taken)
        await _somebody_leads(of, taken)
        for number in range(100):
            await of.writer.write(Note(number))
            await eventually(lambda: len(taken) == number + 1)  # noqa: B023
        assert taken == list(range(100))
        nursery.cancel_scope.cancel()


@in_trio
async def test_who_stops_waiting_leaves_the_socket_to_the_pump(domain: int) -> None:
    async with pair(domain, kind=Note) as of:
        taken: list[int] = []
        async with trio.open_nursery() as nursery:
            nursery.start_soon(_take_all, of.reader, taken)
            await _somebody_leads(of, taken)
            nursery.cancel_scope.cancel()
        await of.writer.write(Note(1))
        await of.writer.wait_for_acknowledgments(5)
        assert [sample.data.number for sample in of.reader.take()] == [1]


@in_trio
async def test_while_the_leader_is_busy_elsewhere_others_are_served(domain: int) -> None:
    async with pair(domain, kind=Note) as of:
        for number in range(3):
            await of.writer.write(Note(number))
            assert (await anext(of.reader)).data.number == number
        await trio.sleep(0.01)
        await of.writer.write(Note(3))
        await of.writer.wait_for_acknowledgments(5)


@in_trio
async def test_news_that_the_leader_did_not_read_itself_wakes_it(domain: int) -> None:
    """Of a writer in its own participant, which needs no socket."""
    async with pair(domain, kind=Note) as of, trio.open_nursery() as nursery:
        taken: list[int] = []
        nursery.start_soon(_take_all, of.reader, taken)
        await _somebody_leads(of, taken)
        local = ddsi.DataWriter(of.there, ddsi.Topic(of.there, "Square", Note), of.writer.qos)
        await local.write(Note(7))
        await eventually(lambda: taken == [7])
        await of.writer.write(Note(8))
        await eventually(lambda: taken == [7, 8])
        nursery.cancel_scope.cancel()


@in_trio
async def test_the_samples_of_others_are_handed_to_them(domain: int) -> None:
    async with pair(domain, kind=Note) as of, trio.open_nursery() as nursery:
        other = ddsi.DataReader(of.there, ddsi.Topic(of.there, "Circle", Note), of.reader.qos)
        writer = ddsi.DataWriter(of.here, ddsi.Topic(of.here, "Circle", Note), of.writer.qos)
        await writer.wait_for_matched(timeout=5)
        taken: list[int] = []
        others: list[int] = []
        nursery.start_soon(_take_all, of.reader, taken)
        await _somebody_leads(of, taken)
        nursery.start_soon(_take_all, other, others)
        for number in range(20):
            await (of.writer if number % 2 else writer).write(Note(number))
            await eventually(lambda: len(taken) + len(others) == number + 1)  # noqa: B023
        assert (taken, others) == (list(range(1, 20, 2)), list(range(0, 20, 2)))
        nursery.cancel_scope.cancel()


@in_trio
async def test_the_end_of_the_participant_ends_the_wait(domain: int) -> None:
    async with pair(domain, kind=Note) as of, trio.open_nursery() as nursery:
        taken: list[int] = []
        nursery.start_soon(_take_all, of.reader, taken)
        await _somebody_leads(of, taken)
        of.there.close()
