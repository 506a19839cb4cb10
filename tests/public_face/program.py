"""A user's program that touches all of the public face; test_typing.py has it checked, and runs it."""

from __future__ import annotations

import math
from datetime import UTC, datetime
from typing import Annotated, assert_type

import trio

import ddsi
from ddsi import idl


@idl.struct(typename="ShapeType", extensibility=idl.APPENDABLE)
class ShapeType:
    color: Annotated[str, idl.key, idl.bound(128)]
    x: idl.int32
    y: idl.int32
    shapesize: idl.int32
    additional_payload_size: idl.sequence[idl.uint8] = b""


QOS = ddsi.Qos(
    reliability=ddsi.Reliable(max_blocking_time=0.5),
    durability=ddsi.TransientLocal(),
    history=ddsi.KeepLast(10),
    deadline=ddsi.Deadline(math.inf),
    liveliness=ddsi.Automatic(lease_duration=30),
    data_representation=ddsi.DataRepresentation(ddsi.XCDR1),
) | ddsi.Qos(ownership=ddsi.Shared(), resource_limits=ddsi.ResourceLimits(max_samples=1000))


async def watch(writer: ddsi.DataWriter[ShapeType], seen: list[str]) -> None:
    async for event in writer.events():
        match event:
            case ddsi.PublicationMatched(current_count=count):
                seen.append(f"{count} readers")
            case ddsi.OfferedIncompatibleQos(incompatibilities=reasons):
                seen.append(", ".join(reason.policy for reason in reasons))
            case _:
                pass


async def main(domain: int) -> list[str]:
    seen: list[str] = []
    async with ddsi.DomainParticipant(domain) as participant, trio.open_nursery() as nursery:
        assert_type(participant, ddsi.DomainParticipant)
        topic = ddsi.Topic(participant, "Square", ShapeType)
        assert_type(topic, ddsi.Topic[ShapeType])
        publisher = ddsi.Publisher(participant, ddsi.Qos(partition=ddsi.Partition("a", "b")))
        subscriber = ddsi.Subscriber(participant, ddsi.Qos(partition=ddsi.Partition("*")))
        writer = ddsi.DataWriter(publisher, topic, QOS)
        reader = ddsi.DataReader(subscriber, topic, QOS)
        assert_type(writer, ddsi.DataWriter[ShapeType])
        assert_type(reader, ddsi.DataReader[ShapeType])
        nursery.start_soon(watch, writer, seen)
        await writer.wait_for_matched(count=1, timeout=5)
        try:
            await writer.write(ShapeType("BLUE", 10, 20, 30), timestamp=datetime.now(UTC))
            await writer.write(ShapeType("BLUE", 11, 21, 30, bytes(3)), timestamp=12.5)
            await writer.wait_for_acknowledgments(timeout=5)
            await writer.dispose(ShapeType("BLUE", 0, 0, 0))
        except ddsi.DdsTimeout as error:
            raise AssertionError(str(error)) from error
        await reader.wait(ddsi.ReadCondition(query=lambda shape: shape.x == 10))
        await reader.wait_for_historical_data(timeout=5)
        for sample in reader.read(1, sample_states=ddsi.SampleState.NOT_READ, view_states=ddsi.ViewState.NEW):
            assert_type(sample, ddsi.Sample[ShapeType])
            assert_type(sample.data, ShapeType)
            assert_type(sample.data.color, str)
            assert_type(sample.info, ddsi.SampleInfo)
            assert_type(sample.info.source_timestamp, ddsi.Time)
            seen.append(sample.data.color)
        async for sample in reader:
            assert_type(sample.data, ShapeType)
            if not sample.info.valid_data:
                assert sample.info.instance_state is ddsi.InstanceState.NOT_ALIVE_DISPOSED
                break
            seen.append(f"{sample.data.x} {bytes(sample.data.additional_payload_size)!r}")
        assert_type(reader.take(), list[ddsi.Sample[ShapeType]])
        assert_type(writer.status(ddsi.PublicationMatched), ddsi.PublicationMatched)
        seen.append(f"matched {reader.status(ddsi.SubscriptionMatched).total_count}")
        (publication,) = reader.matched_publications()
        assert_type(reader.matched_publication_data(publication), ddsi.PublicationBuiltinTopicData)
        assert_type(reader.matched_publication_data(publication).security.subject_name, str)
        participants = ddsi.BuiltinTopicReader(participant, ddsi.ParticipantBuiltinTopicData)
        assert_type(participants.take(), list[ddsi.Sample[ddsi.ParticipantBuiltinTopicData]])
        octets = ddsi.serialize(ShapeType("RED", 1, 2, 3), representation=ddsi.XCDR2)
        assert_type(octets, bytes)
        assert_type(ddsi.deserialize(ShapeType, octets), ShapeType)
        seen.append(f"{ddsi.deserialize(ShapeType, octets).color} {len(ddsi.key_hash(ShapeType('RED', 1, 2, 3)))}")
        writer.close()
        nursery.cancel_scope.cancel()
    return seen
