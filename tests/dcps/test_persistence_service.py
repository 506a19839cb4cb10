"""A persistence service: what durable writers wrote is there when they are gone, and nothing comes twice."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

import pytest
import trio

import ddsi
from tests.dcps.running import Note, Shape, config, eventually, in_trio

PERSISTENT = ddsi.Qos(
    reliability=ddsi.Reliable(),
    durability=ddsi.Persistent(),
    history=ddsi.KeepAll(),
    durability_service=ddsi.DurabilityService(history=ddsi.KeepAll()),
    writer_data_lifecycle=ddsi.WriterDataLifecycle(autodispose_unregistered_instances=False),
)
TRANSIENT = PERSISTENT | ddsi.Qos(durability=ddsi.Transient())


@asynccontextmanager
async def service(domain: int, path: Path, **options: tuple[str, ...]) -> AsyncIterator[ddsi.PersistenceService]:
    async with (
        ddsi.DomainParticipant(domain, config=config(announce_types=True)) as participant,
        ddsi.PersistenceService(participant, path, **options) as found,
    ):
        yield found


async def write_and_leave(
    domain: int, keeper: ddsi.PersistenceService, numbers: range, qos: ddsi.Qos = PERSISTENT, color: str = "BLUE"
) -> None:
    """A writer that has gone when this returns, and of which the service has everything."""
    before = keeper.counts().get("Square", 0)
    async with ddsi.DomainParticipant(domain, config=config(announce_types=True)) as participant:
        writer = ddsi.DataWriter(participant, ddsi.Topic(participant, "Square", Shape), qos)
        await writer.wait_for_matched(timeout=5)
        for x in numbers:
            await writer.write(Shape(color, x))
        await eventually(lambda: keeper.counts().get("Square") == before + len(numbers))


async def read_late(domain: int, count: int, qos: ddsi.Qos = PERSISTENT) -> list[int]:
    """What a reader that comes now gets, and whatever else comes in a moment."""
    async with ddsi.DomainParticipant(domain, config=config(announce_types=True)) as participant:
        reader = ddsi.DataReader(participant, ddsi.Topic(participant, "Square", Shape), qos)
        found = []
        with trio.move_on_after(5):
            async for sample in reader:
                found.append(sample.data.x)
                if len(found) == count:
                    break
        await trio.sleep(0.3)
        return found + _values(reader.take())


@in_trio
async def test_a_late_joiner_has_what_a_writer_wrote_that_is_gone(domain: int, tmp_path: Path) -> None:
    async with service(domain, tmp_path / "samples") as keeper:
        await write_and_leave(domain, keeper, range(10))
        assert await read_late(domain, 10) == list(range(10))


@in_trio
async def test_what_is_persistent_survives_the_service_and_what_is_transient_does_not(
    domain: int, tmp_path: Path
) -> None:
    async with service(domain, tmp_path / "samples") as keeper:
        await write_and_leave(domain, keeper, range(5))
        await write_and_leave(domain, keeper, range(5, 8), TRANSIENT)
        assert keeper.counts() == {"Square": 8}
    async with service(domain, tmp_path / "samples") as keeper:
        assert keeper.counts() == {"Square": 5}
        assert await read_late(domain, 5) == list(range(5))


@in_trio
async def test_more_than_may_be_under_way_comes_all_the_same_and_in_order(domain: int, tmp_path: Path) -> None:
    async with service(domain, tmp_path / "samples") as keeper:
        await write_and_leave(domain, keeper, range(1000))
        assert await read_late(domain, 1000) == list(range(1000))


@in_trio
async def test_while_the_writer_lives_nothing_comes_twice(domain: int, tmp_path: Path) -> None:
    async with (
        service(domain, tmp_path / "samples") as keeper,
        ddsi.DomainParticipant(domain, config=config(announce_types=True)) as participant,
    ):
        writer = ddsi.DataWriter(participant, ddsi.Topic(participant, "Square", Shape), PERSISTENT)
        await writer.wait_for_matched(timeout=5)
        for x in range(20):
            await writer.write(Shape("BLUE", x))
        await eventually(lambda: keeper.counts().get("Square") == 20)
        assert await read_late(domain, 20) == list(range(20))


@in_trio
async def test_a_reader_that_was_there_is_not_told_again_when_the_service_starts_anew(
    domain: int, tmp_path: Path
) -> None:
    async with ddsi.DomainParticipant(domain, config=config(announce_types=True)) as participant:
        reader = ddsi.DataReader(participant, ddsi.Topic(participant, "Square", Shape), PERSISTENT)
        async with service(domain, tmp_path / "samples") as keeper:
            await write_and_leave(domain, keeper, range(5))
        await eventually(lambda: _values(reader.read()) == list(range(5)))
        async with service(domain, tmp_path / "samples") as keeper:
            await reader.wait_for_matched(timeout=5)
            await write_and_leave(domain, keeper, range(5, 7))
            await trio.sleep(0.5)
        assert _values(reader.take()) == list(range(7))


@in_trio
async def test_of_each_instance_as_much_is_kept_as_the_writer_asks_for(domain: int, tmp_path: Path) -> None:
    qos = PERSISTENT | ddsi.Qos(durability_service=ddsi.DurabilityService(history=ddsi.KeepLast(2)))
    async with service(domain, tmp_path / "samples") as keeper:
        async with ddsi.DomainParticipant(domain, config=config(announce_types=True)) as participant:
            writer = ddsi.DataWriter(participant, ddsi.Topic(participant, "Square", Shape), qos)
            await writer.wait_for_matched(timeout=5)
            for x in range(10):
                await writer.write(Shape("RED" if x % 2 else "BLUE", x))
            await eventually(lambda: sorted(_held(keeper)) == [6, 7, 8, 9])
        assert sorted(await read_late(domain, 4)) == [6, 7, 8, 9]


@in_trio
async def test_an_instance_that_was_disposed_is_not_told_of(domain: int, tmp_path: Path) -> None:
    async with service(domain, tmp_path / "samples") as keeper:
        async with ddsi.DomainParticipant(domain, config=config(announce_types=True)) as participant:
            writer = ddsi.DataWriter(participant, ddsi.Topic(participant, "Square", Shape), PERSISTENT)
            await writer.wait_for_matched(timeout=5)
            await writer.write(Shape("BLUE", 1))
            await writer.write(Shape("RED", 2))
            await eventually(lambda: keeper.counts().get("Square") == 2)
            await writer.dispose(Shape("BLUE"))
            await eventually(lambda: sorted(_held(keeper)) == [2])
        assert await read_late(domain, 1) == [2]


@in_trio
async def test_only_the_topics_that_were_named_are_served(domain: int, tmp_path: Path) -> None:
    async with service(domain, tmp_path / "samples", topics=("Sq*",)) as keeper:
        async with ddsi.DomainParticipant(domain, config=config(announce_types=True)) as participant:
            note = ddsi.DataWriter(participant, ddsi.Topic(participant, "Note", Note), PERSISTENT)
            await note.write(Note(1))
            await write_and_leave(domain, keeper, range(3))
        assert keeper.counts() == {"Square": 3}


@in_trio
async def test_readers_that_want_no_history_get_none(domain: int, tmp_path: Path) -> None:
    async with service(domain, tmp_path / "samples") as keeper:
        await write_and_leave(domain, keeper, range(3))
        assert await read_late(domain, 0, PERSISTENT | ddsi.Qos(durability=ddsi.Volatile())) == []


@in_trio
async def test_partitions_keep_apart_what_their_writers_wrote(domain: int, tmp_path: Path) -> None:
    async with service(domain, tmp_path / "samples") as keeper:
        await write_and_leave(domain, keeper, range(3), PERSISTENT | ddsi.Qos(partition=ddsi.Partition("a")))
        await write_and_leave(domain, keeper, range(3, 5), PERSISTENT | ddsi.Qos(partition=ddsi.Partition("b")))
        assert await read_late(domain, 2, PERSISTENT | ddsi.Qos(partition=ddsi.Partition("b"))) == [3, 4]


@in_trio
async def test_samples_keep_their_source_timestamps(domain: int, tmp_path: Path) -> None:
    async with service(domain, tmp_path / "samples") as keeper:
        async with ddsi.DomainParticipant(domain, config=config(announce_types=True)) as participant:
            writer = ddsi.DataWriter(participant, ddsi.Topic(participant, "Square", Shape), PERSISTENT)
            await writer.wait_for_matched(timeout=5)
            await writer.write(Shape("BLUE", 1), timestamp=1_700_000_000.5)
            await eventually(lambda: keeper.counts().get("Square") == 1)
        async with ddsi.DomainParticipant(domain, config=config(announce_types=True)) as participant:
            reader = ddsi.DataReader(participant, ddsi.Topic(participant, "Square", Shape), PERSISTENT)
            sample = await anext(reader)
            assert sample.info.source_timestamp == 1_700_000_000.5


@in_trio
async def test_a_file_that_is_none_of_its_own_is_refused_when_it_is_entered(domain: int, tmp_path: Path) -> None:
    """And stays as it was; the same service may be entered when it is gone."""
    letter = tmp_path / "letter"
    letter.write_text("Dear reader. " * 400)
    async with ddsi.DomainParticipant(domain, config=config(announce_types=True)) as participant:
        keeper = ddsi.PersistenceService(participant, letter)
        with pytest.raises(ddsi.BadParameter, match="letter"):
            await keeper.__aenter__()
        assert letter.read_text().startswith("Dear reader.")
        letter.unlink()
        async with keeper:
            assert keeper.counts() == {}


@in_trio
async def test_one_that_is_never_entered_opens_no_file_and_says_so(domain: int, tmp_path: Path) -> None:
    path = tmp_path / "samples"
    async with ddsi.DomainParticipant(domain, config=config(announce_types=True)) as participant:
        waiting = ddsi.PersistenceService(participant, path)
        assert not path.exists()
        with pytest.raises(ddsi.PreconditionNotMet, match="enter it first"):
            waiting.counts()
        other = ddsi.PersistenceService(participant, path)
        async with other:
            with pytest.raises(ddsi.BadParameter, match="no other process uses"):
                await waiting.__aenter__()
        with pytest.raises(ddsi.AlreadyDeleted, match="has ended"):
            other.counts()
        with pytest.raises(ddsi.PreconditionNotMet, match="entered once"):
            await other.__aenter__()
        async with waiting:
            assert waiting.counts() == {}


def _values(samples: list[ddsi.Sample[Shape]]) -> list[int]:
    return [sample.data.x for sample in samples if sample.info.valid_data]


def _held(keeper: ddsi.PersistenceService) -> list[int]:
    """The x of all samples in the store."""
    return [
        int.from_bytes(sample.payload[-8:-4], "little")
        for topic in keeper._store.topics()
        for sample in keeper._store.samples(topic)
        if sample.kind == 0
    ]
