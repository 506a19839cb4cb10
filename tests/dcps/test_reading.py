"""DataReader: iteration, ``take`` and ``read`` with masks, conditions and instances, and samples that do not decode."""

from __future__ import annotations

from typing import Any

import pytest
import trio

import ddsi
from ddsi import InstanceState, ReadCondition, SampleState, ViewState
from tests.dcps.running import RELIABLE, Note, Pair, Shape, eventually, in_trio, pair


async def arrived(p: Pair, *samples: Any) -> None:
    """Write these, and wait until the reader holds them all."""
    for sample in samples:
        await p.writer.write(sample)
    await p.writer.wait_for_acknowledgments(timeout=5)


def colors(samples: list[ddsi.Sample[Shape]]) -> list[str]:
    return [sample.data.color for sample in samples]


# --- iteration -------------------------------------------------------------------------------------------


@in_trio
async def test_iteration_takes_samples_in_order_and_waits_for_more(domain: int) -> None:
    async with pair(domain) as p:

        async def write_later() -> None:
            for number in range(20):
                await p.writer.write(Shape("RED", number))
                await trio.sleep(0.001)

        seen = []
        async with trio.open_nursery() as nursery:
            nursery.start_soon(write_later)
            async for sample in p.reader:
                seen.append(sample.data.x)
                if len(seen) == 20:
                    break
        assert seen == list(range(20))
        assert p.reader.take() == []


@in_trio
async def test_iteration_ends_when_the_reader_is_closed(domain: int) -> None:
    async with ddsi.DomainParticipant(domain) as participant:
        reader = ddsi.DataReader(participant, ddsi.Topic(participant, "Square", Shape))

        async def close_soon() -> None:
            await trio.sleep(0.01)
            reader.close()

        async with trio.open_nursery() as nursery:
            nursery.start_soon(close_soon)
            async for _ in reader:
                raise AssertionError("nobody wrote")


@in_trio
async def test_iteration_ends_when_the_participant_ends(domain: int) -> None:
    ended = []

    async def iterate(reader: ddsi.DataReader[Shape]) -> None:
        async for _ in reader:
            pass
        ended.append(True)

    async with trio.open_nursery() as nursery, ddsi.DomainParticipant(domain) as participant:
        reader = ddsi.DataReader(participant, ddsi.Topic(participant, "Square", Shape))
        nursery.start_soon(iterate, reader)
        await trio.sleep(0.01)
    assert ended == [True]


@in_trio
async def test_two_tasks_share_a_reader_and_no_sample_comes_twice(domain: int) -> None:
    seen: list[int] = []

    async def iterate(reader: ddsi.DataReader[Shape]) -> None:
        async for sample in reader:
            seen.append(sample.data.x)
            await trio.sleep(0)

    async with pair(domain, local=True) as p, trio.open_nursery() as nursery:
        nursery.start_soon(iterate, p.reader)
        nursery.start_soon(iterate, p.reader)
        for number in range(100):
            await p.writer.write(Shape("RED", number))
        await eventually(lambda: len(seen) == 100)
        nursery.cancel_scope.cancel()
    assert sorted(seen) == list(range(100))


# --- take and read ---------------------------------------------------------------------------------------


@in_trio
async def test_take_removes_and_read_leaves(domain: int) -> None:
    async with pair(domain, local=True) as p:
        await arrived(p, Shape("RED"), Shape("BLUE"))
        assert colors(p.reader.read()) == ["RED", "BLUE"]
        assert colors(p.reader.read()) == ["RED", "BLUE"]
        assert colors(p.reader.take(max_samples=1)) == ["RED"]
        assert colors(p.reader.take()) == ["BLUE"]
        assert p.reader.take() == p.reader.read() == []


@in_trio
async def test_at_most_max_samples_come(domain: int) -> None:
    async with pair(domain, local=True) as p:
        await arrived(p, *(Shape("RED", number) for number in range(10)))
        assert [sample.data.x for sample in p.reader.take(3)] == [0, 1, 2]
        assert p.reader.take(0) == []
        assert [sample.data.x for sample in p.reader.read(2)] == [3, 4]
        assert len(p.reader.take(100)) == 7


@in_trio
async def test_the_sample_state_tells_what_was_read_before(domain: int) -> None:
    async with pair(domain, local=True) as p:
        await arrived(p, Shape("RED", 1))
        assert [sample.info.sample_state for sample in p.reader.read()] == [SampleState.NOT_READ]
        await arrived(p, Shape("RED", 2))
        assert [s.data.x for s in p.reader.read(sample_states=SampleState.READ)] == [1]
        assert [s.data.x for s in p.reader.read(sample_states=SampleState.NOT_READ)] == [2]
        assert p.reader.read(sample_states=SampleState.NOT_READ) == []
        assert [s.info.sample_state for s in p.reader.take()] == [SampleState.READ] * 2


@in_trio
async def test_the_view_state_tells_which_instances_are_new(domain: int) -> None:
    async with pair(domain, local=True) as p:
        await arrived(p, Shape("RED", 1))
        assert [sample.info.view_state for sample in p.reader.read()] == [ViewState.NEW]
        await arrived(p, Shape("RED", 2), Shape("BLUE", 1))
        assert colors(p.reader.read(view_states=ViewState.NEW)) == ["BLUE"]
        assert colors(p.reader.take(view_states=ViewState.NOT_NEW)) == ["RED", "RED", "BLUE"]


@in_trio
async def test_the_instance_state_selects_what_has_ended(domain: int) -> None:
    async with pair(domain, local=True) as p:
        await arrived(p, Shape("RED", 1), Shape("BLUE", 1))
        await p.writer.dispose(Shape("RED"))
        assert colors(p.reader.take(instance_states=InstanceState.ALIVE)) == ["BLUE"]
        ended = p.reader.take(instance_states=InstanceState.NOT_ALIVE)
        assert [(sample.data.color, sample.info.valid_data) for sample in ended] == [("RED", True), ("RED", False)]


@in_trio
async def test_a_condition_brings_its_masks_and_its_query(domain: int) -> None:
    condition = ReadCondition(sample_states=SampleState.NOT_READ, query=lambda shape: shape.x > 5)
    async with pair(domain, local=True) as p:
        await arrived(p, *(Shape("RED", number) for number in range(10)))
        assert [s.data.x for s in p.reader.read(2, condition=condition)] == [6, 7]
        assert [s.data.x for s in p.reader.take(condition=condition)] == [8, 9]
        assert [s.data.x for s in p.reader.take(condition=condition, sample_states=SampleState.READ)] == []
        assert [s.data.x for s in p.reader.take()] == [0, 1, 2, 3, 4, 5, 6, 7]


@in_trio
async def test_an_instance_is_selected_by_its_handle(domain: int) -> None:
    async with pair(domain, local=True) as p:
        await arrived(p, Shape("RED", 1), Shape("BLUE", 1), Shape("RED", 2))
        red = p.reader.lookup_instance(Shape("RED", 99))
        assert red is not None
        assert [s.data.x for s in p.reader.take(instance=red)] == [1, 2]
        assert p.reader.lookup_instance(Shape("GREEN")) is None
        (blue,) = p.reader.read()
        assert colors(p.reader.take(instance=blue.info.instance_handle)) == ["BLUE"]


@in_trio
async def test_an_instance_that_was_never_known_is_refused_by_name(domain: int) -> None:
    """DDS 1.4 §2.2.2.5.3.14.  A key that its writer alone knows, a sample, a word: none is an instance here."""
    async with pair(domain, local=True) as p:
        await arrived(p, Shape("RED", 1))
        green = p.writer.register_instance(Shape("GREEN"))
        wrong: Any
        for wrong in (green, b"", "RED", Shape("RED")):
            for look in (p.reader.take, p.reader.read):
                with pytest.raises(ddsi.BadParameter, match=r"of 'Square'.*never known an instance .*lookup_instance"):
                    look(instance=wrong)
        assert colors(p.reader.take()) == ["RED"]


@in_trio
async def test_an_instance_that_is_gone_has_no_samples(domain: int) -> None:
    """Who takes in rounds until nothing is left is not punished for having taken the end of the instance."""
    async with pair(domain, local=True) as p:
        await arrived(p, Shape("RED", 1))
        red = p.reader.read()[0].info.instance_handle
        await p.writer.unregister(Shape("RED"))
        rounds = 0
        while p.reader.take(1, instance=red):
            rounds += 1
        assert rounds == 2, "the sample and the end"
        assert p.reader.lookup_instance(Shape("RED")) is None
        assert p.reader.read(instance=red) == []


@in_trio
async def test_ranks_and_counts_tell_the_place_among_the_samples_of_an_instance(domain: int) -> None:
    async with pair(domain, local=True) as p:
        await arrived(p, Shape("RED", 1), Shape("BLUE", 1), Shape("RED", 2))
        await p.writer.dispose(Shape("RED"))
        await arrived(p, Shape("RED", 3))
        infos = [sample.info for sample in p.reader.take()]
    assert [info.sample_rank for info in infos] == [3, 2, 1, 0, 0]
    assert [info.disposed_generation_count for info in infos] == [0, 0, 0, 1, 0]
    assert [info.generation_rank for info in infos] == [1, 1, 1, 0, 0]


@in_trio
async def test_keep_last_keeps_the_latest_of_each_instance(domain: int) -> None:
    latest = ddsi.Qos(reliability=ddsi.Reliable(), history=ddsi.KeepLast(2))
    async with pair(domain, reader=latest) as p:
        await arrived(p, *(Shape(color, number) for number in range(5) for color in ("RED", "BLUE")))
        assert sorted((s.data.color, s.data.x) for s in p.reader.take()) == [
            ("BLUE", 3), ("BLUE", 4), ("RED", 3), ("RED", 4),
        ]  # fmt: skip


@in_trio
async def test_a_keyless_topic_is_one_instance(domain: int) -> None:
    async with pair(domain, kind=Note, reader=RELIABLE | ddsi.Qos(history=ddsi.KeepLast(1))) as p:
        await arrived(p, Note(1), Note(2, b"octets"))
        (sample,) = p.reader.take()
    assert (sample.data.number, bytes(sample.data.octets)) == (2, b"octets")
    assert sample.info.instance_handle == b""


@in_trio
async def test_the_publication_handle_is_the_writers_guid(domain: int) -> None:
    async with pair(domain) as p:
        await p.writer.write(Shape("RED"))
        assert (await anext(p.reader)).info.publication_handle == p.writer.guid


# --- waiting ---------------------------------------------------------------------------------------------


@in_trio
async def test_wait_ends_when_there_is_something_unread(domain: int) -> None:
    async with pair(domain, local=True) as p:
        await p.writer.write(Shape("RED"))
        await p.reader.wait()
        p.reader.read()
        with trio.move_on_after(0.01) as scope:
            await p.reader.wait()
        assert scope.cancelled_caught
        await p.writer.write(Shape("RED"))
        await p.reader.wait()


@in_trio
async def test_wait_for_a_condition_ignores_what_does_not_fit_it(domain: int) -> None:
    async with pair(domain, local=True) as p, trio.open_nursery() as nursery:
        woken: list[str] = []

        async def wait(name: str, condition: ReadCondition) -> None:
            await p.reader.wait(condition)
            woken.append(name)

        nursery.start_soon(wait, "ten", ReadCondition(query=lambda shape: shape.x == 10))
        nursery.start_soon(wait, "end", ReadCondition(instance_states=InstanceState.NOT_ALIVE_DISPOSED))
        await p.writer.write(Shape("RED", 9))
        await trio.sleep(0.005)
        assert woken == []
        await p.writer.write(Shape("RED", 10))
        await eventually(lambda: woken == ["ten"])
        await p.writer.dispose(Shape("RED"))
        await eventually(lambda: woken == ["ten", "end"])


@in_trio
async def test_wait_says_when_the_reader_is_closed(domain: int) -> None:
    async with pair(domain, local=True) as p, trio.open_nursery() as nursery:

        async def wait() -> None:
            with pytest.raises(ddsi.AlreadyDeleted):
                await p.reader.wait()

        nursery.start_soon(wait)
        await trio.sleep(0.005)
        p.reader.close()


@in_trio
async def test_wait_says_so_too_when_a_sample_came_just_before(domain: int) -> None:
    async with pair(domain, local=True) as p, trio.open_nursery() as nursery:

        async def wait() -> None:
            with pytest.raises(ddsi.AlreadyDeleted):
                await p.reader.wait()

        nursery.start_soon(wait)
        await trio.sleep(0.005)
        await p.writer.write(Shape("RED"))
        p.reader.close()


# --- samples that do not decode --------------------------------------------------------------------------


def spoil(p: Pair) -> None:
    """From now on the writer writes octets that are a Shape's key and then end too early."""
    whole = p.writer._serialize
    p.writer._serialize = lambda sample: whole(sample)[:-4]


@pytest.mark.parametrize("local", [False, True])
@pytest.mark.parametrize("way", ["iteration", "take", "read", "wait", "query"])
@in_trio
async def test_a_sample_that_does_not_decode_is_counted_as_lost_once(domain: int, way: str, local: bool) -> None:
    async with pair(domain, local=local) as p:
        await p.writer.write(Shape("RED", 1))
        serialize = p.writer._serialize
        spoil(p)
        await p.writer.write(Shape("RED", 2))
        p.writer._serialize = serialize
        await p.writer.write(Shape("RED", 3))
        await p.writer.wait_for_acknowledgments(timeout=5)
        if way == "iteration":
            seen = [(await anext(p.reader)).data.x for _ in range(2)]
        elif way == "take":
            seen = [sample.data.x for sample in p.reader.take()]
        elif way == "read":
            seen = [[sample.data.x for sample in p.reader.read()] for _ in range(3)][-1]
        else:
            condition = ReadCondition(query=lambda shape: shape.x > 1)
            await p.reader.wait(condition)
            assert [s.data.x for s in p.reader.read(condition=condition)] == [3]
            seen = [sample.data.x for sample in p.reader.take(condition=condition if way == "query" else None)]
            seen = [1, *seen] if way == "query" else seen
        lost = p.reader.status(ddsi.SampleLost)
    assert seen == [1, 3]
    assert lost.total_count == 1
    assert "Shape" in lost.reason
    assert "does not decode" in lost.reason


@in_trio
async def test_a_sample_without_a_readable_key_is_lost_too(domain: int) -> None:
    async with pair(domain) as p:
        serialize = p.writer._serialize
        p.writer._serialize = lambda sample: b"\x00\x01\x00\x00\xff\xff\xff\xff"
        await p.writer.write(Shape("RED", 1))
        p.writer._serialize = serialize
        await p.writer.write(Shape("RED", 2))
        assert (await anext(p.reader)).data.x == 2
        assert p.reader.status(ddsi.SampleLost).total_count == 1


@in_trio
async def test_the_loss_of_an_undecodable_sample_is_an_event(domain: int) -> None:
    async with pair(domain, local=True) as p:
        spoil(p)
        events = p.reader.events()
        await p.writer.write(Shape("RED", 1))
        assert p.reader.take() == []
        async for event in events:
            if isinstance(event, ddsi.SampleLost):
                assert event.total_count_change == 1
                break


# --- one instance after the other ----------------------------------------------------------------------------------


@in_trio
async def test_instances_are_gone_through_by_their_handles(domain: int) -> None:
    async with pair(domain, local=True) as p:
        for color in ("RED", "BLUE", "RED", "GREEN"):
            await p.writer.write(Shape(color, 1))
        found: list[list[str]] = []
        handle: bytes | None = None
        while samples := p.reader.read_next_instance(handle):
            handle = samples[0].info.instance_handle
            found.append([sample.data.color for sample in samples])
        assert sorted(found) == [["BLUE"], ["GREEN"], ["RED", "RED"]]
        taken = p.reader.take_next_instance(None, 1)
        assert [sample.data.color for sample in taken] == found[0][:1]
        assert p.reader.take_next_instance(None, sample_states=ddsi.SampleState.NOT_READ) == []


@in_trio
async def test_the_next_instance_follows_one_that_is_gone(domain: int) -> None:
    async with pair(domain, local=True) as p:
        for color in ("RED", "BLUE"):
            await p.writer.write(Shape(color, 1))
            await p.writer.unregister(Shape(color))
        (first, _) = p.reader.take_next_instance(None)
        (second, _) = p.reader.take_next_instance(first.info.instance_handle)
        assert {first.data.color, second.data.color} == {"RED", "BLUE"}
        assert p.reader.take_next_instance(second.info.instance_handle) == []
