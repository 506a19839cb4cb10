"""DataWriter: ``write`` returns at once and waits only for room; dispose, unregister, timestamps, acknowledgment."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from datetime import UTC, datetime
from typing import Any

import pytest
import trio

import ddsi
from tests.dcps.running import RELIABLE, Note, Pair, Shape, eventually, in_trio, pair

NOT_DISPOSED = ddsi.Qos(writer_data_lifecycle=ddsi.WriterDataLifecycle(autodispose_unregistered_instances=False))


def limited(max_samples: int, max_blocking_time: float = 0.05) -> ddsi.Qos:
    """Reliable, everything kept, but no more than so many samples."""
    return RELIABLE | ddsi.Qos(
        resource_limits=ddsi.ResourceLimits(max_samples=max_samples),
        reliability=ddsi.Reliable(max_blocking_time=max_blocking_time),
    )


# --- returning at once -----------------------------------------------------------------------------------


@in_trio
async def test_write_without_readers_returns_at_once_and_keeps_nothing(domain: int) -> None:
    async with ddsi.DomainParticipant(domain) as participant:
        writer = ddsi.DataWriter(participant, ddsi.Topic(participant, "Square", Shape), limited(5))
        for number in range(1000):
            await writer.write(Shape("RED", number))


@in_trio
async def test_write_does_not_wait_for_acknowledgment(domain: int) -> None:
    """Seven MiB are below the bound on unacknowledged octets, whoever reads them and however slowly."""
    async with pair(domain, kind=Note, writer=RELIABLE | ddsi.Qos(reliability=ddsi.Reliable(0.0))) as p:
        for number in range(7 * 16):
            await p.writer.write(Note(number, bytes(65_000)))
        await p.writer.wait_for_acknowledgments(timeout=10)
        assert [sample.data.number for sample in p.reader.take()] == list(range(7 * 16))


# --- waiting for room ------------------------------------------------------------------------------------


@pytest.mark.parametrize("local", [False, True])
@in_trio
async def test_a_full_reliable_reader_withholds_acknowledgment(domain: int, local: bool) -> None:
    async with pair(domain, writer=limited(4), reader=limited(3), local=local) as p:
        for number in range(7):
            await p.writer.write(Shape("RED", number))
        with pytest.raises(ddsi.DdsTimeout, match="max_samples"):
            await p.writer.write(Shape("RED", 7))
        with pytest.raises(ddsi.DdsTimeout):
            await p.writer.wait_for_acknowledgments(timeout=0.02)
        assert [sample.data.x for sample in p.reader.take()] == [0, 1, 2]
        await p.writer.write(Shape("RED", 7))
        numbers: list[int] = []
        with trio.fail_after(5):
            while len(numbers) < 5:
                await p.reader.wait()
                numbers += [sample.data.x for sample in p.reader.take()]
        assert numbers == [3, 4, 5, 6, 7]
        await p.writer.wait_for_acknowledgments(timeout=5)


@in_trio
async def test_a_timeout_comes_after_max_blocking_time_and_writes_nothing(domain: int) -> None:
    async with pair(domain, writer=limited(1, max_blocking_time=0.1), reader=limited(1)) as p:
        await p.writer.write(Shape("RED", 0))
        await p.writer.write(Shape("RED", 1))
        before = trio.current_time()
        with pytest.raises(TimeoutError) as caught:
            await p.writer.write(Shape("RED", 2))
        assert 0.1 <= trio.current_time() - before < 1
        assert isinstance(caught.value, ddsi.DdsTimeout)
        for told in ("'Square'", "max_blocking_time=0.1 s", "max_samples"):
            assert told in str(caught.value)
        numbers = [(await anext(p.reader)).data.x for _ in range(2)]
        await p.writer.write(Shape("RED", 3))
        assert [*numbers, (await anext(p.reader)).data.x] == [0, 1, 3]


@in_trio
async def test_a_write_that_waits_goes_on_when_the_reader_takes(domain: int) -> None:
    seen: list[int] = []

    async def read_slowly(reader: ddsi.DataReader[Shape]) -> None:
        async for sample in reader:
            seen.append(sample.data.x)
            await trio.sleep(0.002)
            if len(seen) == 30:
                return

    both = limited(3, max_blocking_time=5)
    async with pair(domain, writer=both, reader=both) as p, trio.open_nursery() as nursery:
        nursery.start_soon(read_slowly, p.reader)
        for number in range(30):
            await p.writer.write(Shape("RED", number))
    assert seen == list(range(30))


@in_trio
async def test_keep_all_without_limits_is_bounded_by_the_octets_not_acknowledged(domain: int) -> None:
    """Nobody takes: the reader fills up to its own bound, the writer to its, and then write waits."""
    impatient = RELIABLE | ddsi.Qos(reliability=ddsi.Reliable(max_blocking_time=0.1))
    async with pair(domain, kind=Note, writer=impatient, unacknowledged_octets=20_000, reader_octets=10_000) as p:
        written = 0
        with pytest.raises(ddsi.DdsTimeout, match="bound 20000"):
            while written < 100:
                await p.writer.write(Note(written, bytes(1000)))
                written += 1
        assert 25 <= written <= 30
        numbers: list[int] = []
        with trio.fail_after(5):
            while len(numbers) < written:
                await p.reader.wait()
                numbers += [sample.data.number for sample in p.reader.take()]
        assert numbers == list(range(written))


@in_trio
async def test_one_sample_larger_than_the_bound_may_be_written_alone(domain: int) -> None:
    async with pair(domain, kind=Note, unacknowledged_octets=1000) as p:
        await p.writer.write(Note(1, bytes(5000)))
        assert len((await anext(p.reader)).data.octets) == 5000


@in_trio
async def test_keep_last_never_waits_for_a_slow_reader(domain: int) -> None:
    latest = ddsi.Qos(reliability=ddsi.Reliable(max_blocking_time=0.0), history=ddsi.KeepLast(1))
    async with pair(domain, writer=latest, reader=limited(1)) as p:
        for number in range(200):
            await p.writer.write(Shape("RED", number))
        seen: list[int] = []
        with trio.fail_after(5):
            while seen[-1:] != [199]:
                seen.append((await anext(p.reader)).data.x)
        assert seen == sorted(set(seen))


@in_trio
async def test_a_writer_closed_while_it_waits_says_so(domain: int) -> None:
    async with pair(domain, writer=limited(1, max_blocking_time=30), reader=limited(1)) as p:
        for number in range(2):
            await p.writer.write(Shape("RED", number))

        async def close_soon() -> None:
            await trio.sleep(0.01)
            p.writer.close()

        async with trio.open_nursery() as nursery:
            nursery.start_soon(close_soon)
            with pytest.raises(ddsi.AlreadyDeleted):
                await p.writer.write(Shape("RED", 2))


@in_trio
async def test_a_reader_that_leaves_makes_room(domain: int) -> None:
    async with pair(domain, writer=limited(1, max_blocking_time=10), reader=limited(1)) as p:
        for number in range(2):
            await p.writer.write(Shape("RED", number))
        async with trio.open_nursery() as nursery:
            nursery.start_soon(p.writer.write, Shape("RED", 2))
            await trio.sleep(0.01)
            p.reader.close()


@in_trio
async def test_max_instances_is_a_limit_too(domain: int) -> None:
    limits = ddsi.Qos(
        reliability=ddsi.Reliable(max_blocking_time=0.01),
        resource_limits=ddsi.ResourceLimits(max_instances=2),
        durability=ddsi.TransientLocal(),
    )
    async with ddsi.DomainParticipant(domain) as participant:
        writer = ddsi.DataWriter(participant, ddsi.Topic(participant, "Square", Shape), limits)
        for color in ("RED", "BLUE", "RED"):
            await writer.write(Shape(color))
        with pytest.raises(ddsi.DdsTimeout, match="max_instances"):
            await writer.write(Shape("GREEN"))


@pytest.mark.parametrize("local", [True, False])
@in_trio
async def test_an_instance_that_is_unregistered_makes_room_for_another(domain: int, local: bool) -> None:
    limits = RELIABLE | ddsi.Qos(
        history=ddsi.KeepLast(1),
        reliability=ddsi.Reliable(max_blocking_time=0.5),
        resource_limits=ddsi.ResourceLimits(max_instances=2),
        durability=ddsi.TransientLocal(),
    )
    async with pair(domain, writer=limits, local=local) as p:
        for number in range(5):
            await p.writer.write(Shape(f"C{number}"))
            await p.writer.unregister(Shape(f"C{number}"))
        await p.writer.write(Shape("A"))
        await p.writer.write(Shape("B"))
        await eventually(lambda: len(p.reader._history) == 12)
        with pytest.raises(ddsi.DdsTimeout, match="max_instances"):
            await p.writer.write(Shape("C"))


# --- readers that are full when the writer goes -------------------------------------------------------------


@asynccontextmanager
async def full(domain: int, *, local: bool) -> AsyncIterator[Pair]:
    """Five samples are written, and the reader has room for two."""
    async with pair(domain, reader=limited(2), local=local) as p:
        for number in range(5):
            await p.writer.write(Shape("RED", number))
        yield p


@pytest.mark.parametrize("local", [True, False])
@in_trio
async def test_a_writer_that_is_closed_lets_a_full_reader_take_the_rest(domain: int, local: bool) -> None:
    async with full(domain, local=local) as p:
        p.writer.close()
        samples = [await anext(p.reader) for _ in range(6)]
        assert [sample.data.x for sample in samples if sample.info.valid_data] == list(range(5))
        await eventually(lambda: not p.reader.matched_publications())
        assert p.reader.status(ddsi.SampleLost).total_count == 0


@pytest.mark.parametrize("local", [True, False])
@in_trio
async def test_what_a_full_reader_had_no_room_for_when_the_match_ended_is_lost(domain: int, local: bool) -> None:
    async with full(domain, local=local) as p:
        held = [] if local else list(p.reader._reader.behavior.writers.values())
        await eventually(lambda: all(len(proxy.reorder) == 3 for proxy in held))
        p.reader.set_qos(ddsi.Qos(partition=ddsi.Partition("elsewhere")))
        await eventually(lambda: not p.reader.matched_publications())
        lost = p.reader.status(ddsi.SampleLost)
        assert (lost.total_count, lost.reason) == (3, "the writer was gone before there was room for it")
        valid = [sample.data.x for sample in p.reader.take() if sample.info.valid_data]
        assert valid == [0, 1]


@pytest.mark.parametrize("local", [True, False])
@in_trio
async def test_an_instance_that_ends_unseen_makes_room_for_another(domain: int, local: bool) -> None:
    """Its samples were taken before its writer unregistered it, so nobody takes anything when it goes."""
    limits = RELIABLE | ddsi.Qos(resource_limits=ddsi.ResourceLimits(max_instances=1))
    async with pair(domain, writer=RELIABLE | NOT_DISPOSED, reader=limits, local=local) as p:
        other = ddsi.DataWriter(p.here, p.writer.topic, RELIABLE)
        await p.reader.wait_for_matched(2)
        await other.wait_for_matched()
        await p.writer.write(Shape("RED"))
        await p.writer.dispose(Shape("RED"))
        await p.writer.wait_for_acknowledgments(5)
        assert len(p.reader.take()) == 2
        await other.write(Shape("BLUE", 1))
        await eventually(lambda: p.reader._history.is_withholding)
        await p.writer.unregister(Shape("RED"))
        assert (await anext(p.reader)).data == Shape("BLUE", 1)


# --- the end of instances --------------------------------------------------------------------------------


@pytest.mark.parametrize("local", [False, True])
@in_trio
async def test_dispose_arrives_with_the_key_and_defaults(domain: int, local: bool) -> None:
    async with pair(domain, local=local) as p:
        await p.writer.write(Shape("RED", 1, 2))
        await p.writer.dispose(Shape("RED", 77, 88))
        alive, disposed = [await anext(p.reader) for _ in range(2)]
    assert alive.info.valid_data
    assert disposed.data == Shape("RED", 0, 0)
    assert not disposed.info.valid_data
    assert disposed.info.instance_state is ddsi.InstanceState.NOT_ALIVE_DISPOSED
    assert disposed.info.instance_handle == alive.info.instance_handle


@pytest.mark.parametrize("local", [False, True])
@in_trio
async def test_unregister_leaves_an_instance_without_writers(domain: int, local: bool) -> None:
    async with pair(domain, writer=RELIABLE | NOT_DISPOSED, local=local) as p:
        await p.writer.write(Shape("RED", 1))
        await p.writer.unregister(Shape("RED"))
        _, ended = [await anext(p.reader) for _ in range(2)]
    assert ended.data == Shape("RED")
    assert not ended.info.valid_data
    assert ended.info.instance_state is ddsi.InstanceState.NOT_ALIVE_NO_WRITERS


@in_trio
async def test_unregister_disposes_by_default(domain: int) -> None:
    async with pair(domain) as p:
        await p.writer.write(Shape("RED", 1))
        await p.writer.unregister(Shape("RED"))
        _, ended = [await anext(p.reader) for _ in range(2)]
    assert ended.info.instance_state is ddsi.InstanceState.NOT_ALIVE_DISPOSED


@in_trio
async def test_an_instance_that_is_written_again_is_new_and_alive(domain: int) -> None:
    async with pair(domain) as p:
        await p.writer.write(Shape("RED", 1))
        await p.writer.dispose(Shape("RED"))
        await p.writer.write(Shape("RED", 2))
        first, _, again = [await anext(p.reader) for _ in range(3)]
    assert first.info.disposed_generation_count == 0
    assert again.info.disposed_generation_count == 1
    assert again.info.instance_state is ddsi.InstanceState.ALIVE


@in_trio
async def test_the_end_of_a_writer_ends_its_instances(domain: int) -> None:
    async with pair(domain, writer=RELIABLE | NOT_DISPOSED) as p:
        await p.writer.write(Shape("RED", 1))
        await p.writer.write(Shape("BLUE", 1))
        p.writer.close()
        samples = [await anext(p.reader) for _ in range(4)]
    ended = {s.data.color: s.info.instance_state for s in samples if not s.info.valid_data}
    assert ended == dict.fromkeys(("RED", "BLUE"), ddsi.InstanceState.NOT_ALIVE_NO_WRITERS)


@in_trio
async def test_a_keyless_topic_has_no_instances_to_end(domain: int) -> None:
    async with ddsi.DomainParticipant(domain) as participant:
        writer = ddsi.DataWriter(participant, ddsi.Topic(participant, "Notes", Note))
        for end in (writer.dispose, writer.unregister):
            with pytest.raises(ddsi.PreconditionNotMet, match="'Notes' has no key"):
                await end(Note(1))


# --- timestamps ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("local", [False, True])
@in_trio
async def test_timestamps_are_seconds_or_datetimes(domain: int, local: bool) -> None:
    moment = datetime(2024, 2, 29, 12, 0, 0, 500_000, tzinfo=UTC)
    async with pair(domain, local=local) as p:
        for timestamp in (moment, moment.timestamp(), 12):
            await p.writer.write(Shape("RED"), timestamp=timestamp)
        await p.writer.dispose(Shape("RED"), timestamp=13.25)
        stamps = [float((await anext(p.reader)).info.source_timestamp) for _ in range(4)]
    assert stamps == pytest.approx([moment.timestamp(), moment.timestamp(), 12, 13.25], abs=1e-6)


@in_trio
async def test_without_a_timestamp_it_is_now(domain: int) -> None:
    async with pair(domain) as p:
        await p.writer.write(Shape("RED"))
        info = (await anext(p.reader)).info
    now = datetime.now(UTC).timestamp()
    assert now - 5 < float(info.source_timestamp) <= float(info.reception_timestamp) + 0.1 <= now + 0.2


@pytest.mark.parametrize("timestamp", [-1.0, float("nan"), float("inf"), "noon", 1e12])
@in_trio
async def test_an_impossible_timestamp_is_refused_and_nothing_written(domain: int, timestamp: Any) -> None:
    async with pair(domain, local=True) as p:
        with pytest.raises(ddsi.BadParameter, match="timestamp"):
            await p.writer.write(Shape("RED"), timestamp=timestamp)
        assert p.reader.take() == []


# --- acknowledgment and matching -------------------------------------------------------------------------


@in_trio
async def test_acknowledgments_come_without_the_reader_taking_anything(domain: int) -> None:
    async with pair(domain) as p:
        for number in range(100):
            await p.writer.write(Shape("RED", number))
        await p.writer.wait_for_acknowledgments(timeout=5)
        assert len(p.reader.take()) == 100


@in_trio
async def test_without_readers_everything_is_acknowledged(domain: int) -> None:
    async with ddsi.DomainParticipant(domain) as participant:
        writer = ddsi.DataWriter(participant, ddsi.Topic(participant, "Square", Shape))
        await writer.write(Shape("RED"))
        await writer.wait_for_acknowledgments(timeout=0)


@in_trio
async def test_matched_subscriptions_are_guids(domain: int) -> None:
    async with pair(domain) as p:
        assert p.writer.matched_subscriptions() == [p.reader.guid]
        assert p.reader.matched_publications() == [p.writer.guid]
        p.reader.close()
        await eventually(lambda: p.writer.matched_subscriptions() == [])


# --- samples that cannot be written ----------------------------------------------------------------------


UNFIT: list[tuple[Any, str]] = [
    (Shape("RED", 2**31), "x: 2147483648 .* int32"),
    (Shape("RED", "left"), "x: 'left'"),  # type: ignore[arg-type]
    (Shape("x" * 129), "color: .* bound of 128"),
    (Note(1), "Shape"),
    (None, "Shape"),
    (("RED", 1, 2), "Shape"),
]


@pytest.mark.parametrize(("unfit", "told"), UNFIT)
@in_trio
async def test_a_sample_that_does_not_fit_its_type_is_refused_and_nothing_written(
    domain: int, unfit: Any, told: str
) -> None:
    async with pair(domain, local=True) as p:
        with pytest.raises(ddsi.BadParameter, match=told):
            await p.writer.write(unfit)
        await p.writer.write(Shape("RED", 1))
        assert [sample.data for sample in p.reader.take()] == [Shape("RED", 1)]
