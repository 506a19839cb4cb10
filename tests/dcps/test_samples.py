"""Samples of all sorts on their way from one participant to another: kinds of topic, sizes, representations."""

from __future__ import annotations

import hashlib

import pytest
import trio

import ddsi
from tests.dcps.running import RELIABLE, Note, Shape, config, eventually, in_trio, pair

MIB = 1 << 20


@pytest.mark.parametrize("representation", [ddsi.XCDR1, ddsi.XCDR2])
@in_trio
async def test_both_representations_arrive(domain: int, representation: ddsi.DataRepresentationId) -> None:
    chosen = RELIABLE | ddsi.Qos(data_representation=ddsi.DataRepresentation(representation))
    async with pair(domain, writer=chosen) as p:
        await p.writer.write(Shape("RED", -1, 2))
        await p.writer.dispose(Shape("RED"))
        sample, end = [await anext(p.reader) for _ in range(2)]
        assert (sample.data, end.data) == (Shape("RED", -1, 2), Shape("RED"))


@in_trio
async def test_best_effort_samples_arrive_too(domain: int) -> None:
    best_effort = ddsi.Qos(reliability=ddsi.BestEffort(), history=ddsi.KeepAll())
    async with pair(domain, writer=best_effort, reader=best_effort) as p:
        seen = []
        for number in range(20):
            await p.writer.write(Shape("RED", number))
            seen.append((await anext(p.reader)).data.x)
        assert seen == list(range(20))


@in_trio
async def test_a_best_effort_reader_of_a_reliable_writer_gets_what_is_written_after_the_match(domain: int) -> None:
    async with pair(domain, reader=ddsi.Qos(history=ddsi.KeepAll())) as p:
        for number in range(20):
            await p.writer.write(Shape("RED", number))
        await eventually(lambda: len(p.reader.read()) == 20)


@pytest.mark.parametrize("size", [0, 1, 60_000, 65_536, MIB + 1])
@in_trio
async def test_sizes_around_every_boundary_arrive_whole(domain: int, size: int) -> None:
    octets = bytes(index * 7 & 0xFF for index in range(size))
    async with pair(domain, kind=Note) as p:
        for number in range(3):
            await p.writer.write(Note(number, octets))
        for number in range(3):
            note = (await anext(p.reader)).data
            assert (note.number, bytes(note.octets) == octets) == (number, True)


@in_trio
async def test_a_small_datagram_size_fragments_and_joins(domain: int) -> None:
    octets = bytes(range(256)) * 400
    async with pair(domain, kind=Note, max_message_size=1452) as p:
        await p.writer.write(Note(1, octets))
        assert bytes((await anext(p.reader)).data.octets) == octets


@pytest.mark.slow
@in_trio
async def test_sixty_four_mebibytes_arrive(domain: int) -> None:
    octets = hashlib.shake_128(b"large").digest(64 * MIB)
    async with pair(domain, kind=Note) as p:
        with trio.fail_after(18):
            await p.writer.write(Note(1, octets))
            assert (await anext(p.reader)).data.octets == octets


@in_trio
async def test_any_buffer_is_taken_for_octets(domain: int) -> None:
    async with pair(domain, kind=Note) as p:
        for octets in (b"octets", bytearray(b"octets"), memoryview(b"octets")):
            await p.writer.write(Note(1, octets))
            assert bytes((await anext(p.reader)).data.octets) == b"octets"


@in_trio
async def test_what_is_changed_after_the_write_does_not_change_the_sample(domain: int) -> None:
    """The sample is serialised by ``write``, not later, and a reader's sample is its own."""
    async with pair(domain, local=True) as p:
        shape = Shape("RED", 1)
        await p.writer.write(shape)
        shape.x = 99
        first = p.reader.read()[0].data
        first.x = 98
        assert p.reader.read()[0].data == Shape("RED", 1)


@in_trio
async def test_many_instances_come_and_go(domain: int) -> None:
    async with pair(domain) as p:
        for number in range(300):
            await p.writer.write(Shape(f"color {number}", number))
            await p.writer.unregister(Shape(f"color {number}"))
        await p.writer.wait_for_acknowledgments(timeout=5)
        samples = p.reader.take()
        assert sum(sample.info.valid_data for sample in samples) == 300
        assert sum(not sample.info.valid_data for sample in samples) == 300
        assert len(p.reader._history.instances) == 0


@in_trio
async def test_two_writers_of_one_instance(domain: int) -> None:
    """An instance has writers as long as one is left that writes it.  DDS 1.4 figure 2.11."""
    not_disposed = RELIABLE | ddsi.Qos(writer_data_lifecycle=ddsi.WriterDataLifecycle(False))
    async with pair(domain, writer=not_disposed) as p:
        other = ddsi.DataWriter(p.there, p.reader.topic, not_disposed)
        for writer in (p.writer, other):
            await writer.wait_for_matched(timeout=5)
            await writer.write(Shape("RED"))
            await writer.wait_for_acknowledgments(timeout=5)
        p.reader.take()
        await p.writer.unregister(Shape("RED"))
        await p.writer.wait_for_acknowledgments(timeout=5)
        assert p.reader.take() == []
        await other.unregister(Shape("RED"))
        (end,) = p.reader.take()
        assert end.info.instance_state is ddsi.InstanceState.NOT_ALIVE_NO_WRITERS


def test_states_are_printed_by_their_names() -> None:
    assert str(ddsi.InstanceState.ALIVE) == "ALIVE"
    assert f"{ddsi.InstanceState.NOT_ALIVE_NO_WRITERS | ddsi.InstanceState.NOT_ALIVE_DISPOSED:>12}" == "   NOT_ALIVE"
    assert str(ddsi.SampleState.READ | ddsi.SampleState.NOT_READ) == "READ|NOT_READ"
    assert str(ddsi.ViewState(0)) == "none"


@in_trio
async def test_all_best_effort_readers_of_the_writers_own_participant_are_handed_each_sample(domain: int) -> None:
    """The first of them must not free it: a volatile writer keeps nothing that all have."""
    async with ddsi.DomainParticipant(domain, config=config()) as participant:
        topic = ddsi.Topic(participant, "Square", Shape)
        writer = ddsi.DataWriter(participant, topic)
        readers = [ddsi.DataReader(participant, topic, ddsi.Qos(history=ddsi.KeepAll())) for _ in range(3)]
        for x in range(5):
            await writer.write(Shape("RED", x))
        assert [[sample.data.x for sample in reader.take()] for reader in readers] == [list(range(5))] * 3
        await writer.wait_for_acknowledgments(timeout=1)
