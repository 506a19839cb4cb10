"""Entities that are made without taking part, until ``enable``; and what belongs to what.  DDS 1.4 §2.2.3.20."""

from __future__ import annotations

from collections.abc import Callable

import pytest

import ddsi

from .running import RELIABLE, Note, Shape, eventually, in_trio, pair

NOT_AT_ONCE = ddsi.Qos(entity_factory=ddsi.EntityFactory(autoenable_created_entities=False))


# --- enable --------------------------------------------------------------------------------------------------------


@in_trio
async def test_a_writer_that_is_not_enabled_is_matched_with_nobody_until_it_is(domain: int) -> None:
    async with ddsi.DomainParticipant(domain, qos=NOT_AT_ONCE) as one, ddsi.DomainParticipant(domain) as other:
        topic = ddsi.Topic(one, "Square", Shape)
        reader = ddsi.DataReader(other, ddsi.Topic(other, "Square", Shape), RELIABLE)
        writer = ddsi.DataWriter(one, topic, RELIABLE)
        assert (writer.is_enabled, topic.is_enabled, one.is_enabled, reader.is_enabled) == (False, False, True, True)
        with pytest.raises(ddsi.PreconditionNotMet, match=r"call enable\(\) first"):
            await writer.write(Shape("RED", 1))
        with pytest.raises(ddsi.PreconditionNotMet):
            await writer.dispose(Shape("RED", 1))
        await eventually(other.discovered_participants)
        assert other.discovered_publications() == []
        writer.enable()
        await writer.wait_for_matched(timeout=5)
        await writer.write(Shape("RED", 1))
        assert (await anext(reader)).data.x == 1
        writer.enable()  # again does nothing


@in_trio
async def test_a_reader_that_is_not_enabled_cannot_be_read(domain: int) -> None:
    async with ddsi.DomainParticipant(domain) as participant:
        subscriber = ddsi.Subscriber(participant, NOT_AT_ONCE)
        topic = ddsi.Topic(participant, "Square", Shape)
        reader = ddsi.DataReader(subscriber, topic)
        writer = ddsi.DataWriter(participant, topic)
        calls: list[Callable[[], object]] = [reader.take, reader.read, lambda: reader.take_next_instance(None)]
        for call in calls:
            with pytest.raises(ddsi.PreconditionNotMet, match="enable"):
                call()
        reader.enable()
        assert reader.matched_publications() == [writer.guid]
        assert reader.take() == []


@in_trio
async def test_whoever_enables_a_group_enables_what_is_in_it_if_the_policy_says_so(domain: int) -> None:
    async with ddsi.DomainParticipant(domain, qos=NOT_AT_ONCE) as participant:
        topic = ddsi.Topic(participant, "Square", Shape)
        publisher = ddsi.Publisher(participant)
        writer = ddsi.DataWriter(publisher, topic)
        with pytest.raises(ddsi.PreconditionNotMet, match="enable <Publisher"):
            writer.enable()
        publisher.enable()
        assert writer.is_enabled
        assert ddsi.DataWriter(publisher, topic).is_enabled
        hesitant = ddsi.Publisher(participant, NOT_AT_ONCE)
        waiting = ddsi.DataWriter(hesitant, topic)
        hesitant.enable()
        assert not waiting.is_enabled
        hesitant.set_qos(ddsi.Qos(entity_factory=ddsi.EntityFactory()))
        assert ddsi.DataWriter(hesitant, topic).is_enabled


@in_trio
async def test_before_it_is_enabled_every_policy_may_change(domain: int) -> None:
    async with ddsi.DomainParticipant(domain) as participant:
        publisher, subscriber = ddsi.Publisher(participant, NOT_AT_ONCE), ddsi.Subscriber(participant, NOT_AT_ONCE)
        topic = ddsi.Topic(participant, "Square", Shape)
        writer = ddsi.DataWriter(publisher, topic, ddsi.Qos(reliability=ddsi.BestEffort()))
        reader = ddsi.DataReader(subscriber, topic)
        changed = RELIABLE | ddsi.Qos(data_representation=ddsi.DataRepresentation(ddsi.XCDR2))
        writer.set_qos(changed)
        reader.set_qos(changed)
        writer.enable()
        reader.enable()
        assert len(participant.discovered_publications()) == 0
        assert (writer.matched_subscriptions(), reader.matched_publications()) == ([reader.guid], [writer.guid])
        await writer.write(Shape("RED", 1))
        (sample,) = reader.take()
        assert sample.data.x == 1
        with pytest.raises(ddsi.ImmutablePolicy):
            writer.set_qos(ddsi.Qos(reliability=ddsi.BestEffort()))
        (known,) = [member for member in participant._by_guid.values() if isinstance(member, ddsi.DataWriter)]
        assert known is writer


@in_trio
async def test_what_was_never_enabled_leaves_without_a_word(domain: int) -> None:
    async with ddsi.DomainParticipant(domain, qos=NOT_AT_ONCE) as participant:
        topic = ddsi.Topic(participant, "Square", Shape)
        for endpoint in (ddsi.DataWriter(participant, topic), ddsi.DataReader(participant, topic)):
            endpoint.close()
            with pytest.raises(ddsi.AlreadyDeleted):
                endpoint.enable()
        ddsi.DataWriter(participant, topic)


# --- what belongs to what ------------------------------------------------------------------------------------------


@in_trio
async def test_entities_are_found_where_they_belong(domain: int) -> None:
    async with ddsi.DomainParticipant(domain) as participant:
        topic = ddsi.Topic(participant, "Square", Shape)
        publisher, subscriber = ddsi.Publisher(participant), ddsi.Subscriber(participant)
        writer, reader = ddsi.DataWriter(publisher, topic), ddsi.DataReader(subscriber, topic)
        alone = ddsi.DataWriter(participant, topic)
        assert participant.contained_entities() == [topic, publisher, subscriber, alone]
        assert publisher.contained_entities() == [writer]
        assert participant.contains_entity(writer.guid)
        assert not publisher.contains_entity(reader.guid)
        assert not subscriber.contains_entity(alone.guid)
        assert publisher.lookup_datawriter("Square") is writer
        assert publisher.lookup_datawriter("Circle") is None
        assert subscriber.lookup_datareader("Square") is reader
        assert participant.lookup_topicdescription("Square") is topic
        assert participant.lookup_topicdescription("Circle") is None


@in_trio
async def test_all_that_is_contained_is_deleted_and_the_container_stays(domain: int) -> None:
    async with ddsi.DomainParticipant(domain) as participant:
        topic = ddsi.Topic(participant, "Square", Shape)
        writer = ddsi.DataWriter(ddsi.Publisher(participant), topic)
        participant.delete_contained_entities()
        assert (writer.is_closed, topic.is_closed, participant.is_closed) == (True, True, False)
        assert participant.contained_entities() == []
        ddsi.DataWriter(participant, ddsi.Topic(participant, "Square", Shape))


# --- ignoring ------------------------------------------------------------------------------------------------------


@in_trio
async def test_an_ignored_writer_is_unmatched_and_comes_back_for_nothing(domain: int) -> None:
    async with pair(domain) as p:
        (handle,) = p.reader.matched_publications()
        p.there.ignore_publication(handle)
        assert p.reader.matched_publications() == []
        p.writer.set_qos(ddsi.Qos(user_data=ddsi.UserData(b"announced again")))
        other = ddsi.DataWriter(p.here, ddsi.Topic(p.here, "Square", Shape), RELIABLE)
        await p.reader.wait_for_matched(timeout=5)
        assert p.reader.matched_publications() == [other.guid]


@in_trio
async def test_an_ignored_reader_gets_nothing_more(domain: int) -> None:
    async with pair(domain) as p:
        (handle,) = p.writer.matched_subscriptions()
        p.here.ignore_subscription(handle)
        assert p.writer.matched_subscriptions() == []


@in_trio
async def test_an_ignored_topic_has_no_remote_endpoints(domain: int) -> None:
    async with pair(domain) as p:
        p.there.ignore_topic("Square")
        assert p.reader.matched_publications() == []
        ddsi.DataWriter(p.here, ddsi.Topic(p.here, "Square", Shape), RELIABLE)
        circle = ddsi.DataWriter(p.here, ddsi.Topic(p.here, "Circle", Shape), RELIABLE)
        await eventually(lambda: [data.guid for data in p.there.discovered_publications()] == [circle.guid])


# --- instances of a writer -----------------------------------------------------------------------------------------


@in_trio
async def test_a_writer_knows_the_instances_that_it_registered(domain: int) -> None:
    async with pair(domain, local=True) as p:
        red = p.writer.register_instance(Shape("RED"))
        assert p.writer.lookup_instance(Shape("RED", 5)) == red
        assert p.writer.get_key_value(red) == Shape("RED")
        assert p.writer.lookup_instance(Shape("BLUE")) is None
        await p.writer.write(Shape("BLUE", 1))
        blue = p.writer.lookup_instance(Shape("BLUE"))
        assert blue is not None
        assert blue == p.reader.lookup_instance(Shape("BLUE"))
        assert p.reader.get_key_value(blue) == Shape("BLUE")
        await p.writer.unregister(Shape("BLUE"))
        assert p.writer.lookup_instance(Shape("BLUE")) is None
        for entity in (p.writer, p.reader):
            with pytest.raises(ddsi.BadParameter, match="instance"):
                entity.get_key_value(b"nobody's")


@in_trio
async def test_a_topic_without_key_has_no_instances_to_register(domain: int) -> None:
    async with pair(domain, kind=Note, local=True) as p:
        with pytest.raises(ddsi.PreconditionNotMet, match="no key"):
            p.writer.register_instance(Note(1))


@pytest.mark.parametrize("local", [False, True], ids=["remote", "local"])
@pytest.mark.parametrize("autodispose", [False, True])
@in_trio
async def test_a_writer_that_is_closed_ends_its_instances_as_its_policy_says(
    domain: int, autodispose: bool, local: bool
) -> None:
    """DDS 1.4 §2.2.3.21 (WRITER_DATA_LIFECYCLE): deleting a writer unregisters all that it has registered."""
    lifecycle = ddsi.Qos(writer_data_lifecycle=ddsi.WriterDataLifecycle(autodispose))
    async with pair(domain, writer=RELIABLE | lifecycle, local=local) as p:
        await p.writer.write(Shape("RED", 1))
        await p.writer.write(Shape("BLUE", 1))
        await p.writer.unregister(Shape("BLUE"))
        p.writer.close()
        samples = [await anext(p.reader) for _ in range(4)]
        ends = {sample.data.color: sample.info.instance_state for sample in samples if not sample.info.valid_data}
        expected = ddsi.InstanceState.NOT_ALIVE_DISPOSED if autodispose else ddsi.InstanceState.NOT_ALIVE_NO_WRITERS
        assert ends == {"RED": expected, "BLUE": expected}


@in_trio
async def test_a_participant_that_leaves_disposes_what_it_wrote(domain: int) -> None:
    async with ddsi.DomainParticipant(domain) as there:
        reader = ddsi.DataReader(there, ddsi.Topic(there, "Square", Shape), RELIABLE)
        async with ddsi.DomainParticipant(domain) as here:
            writer = ddsi.DataWriter(here, ddsi.Topic(here, "Square", Shape), RELIABLE)
            await writer.wait_for_matched(timeout=5)
            await writer.write(Shape("RED", 1))
        assert (await anext(reader)).data.x == 1
        end = await anext(reader)
        assert (end.data.color, end.info.instance_state) == ("RED", ddsi.InstanceState.NOT_ALIVE_DISPOSED)


@in_trio
async def test_who_orders_by_source_must_write_in_order(domain: int) -> None:
    by_source = RELIABLE | ddsi.Qos(destination_order=ddsi.BySourceTimestamp())
    async with pair(domain, writer=by_source, reader=by_source, local=True) as p:
        await p.writer.write(Shape("RED", 1), timestamp=2e9)
        with pytest.raises(ddsi.BadParameter, match=r"timestamp 1900000000.0 is older.*in order"):
            await p.writer.write(Shape("RED", 2), timestamp=1.9e9)
        await p.writer.write(Shape("RED", 3))  # a clock that was set back, so to speak
        samples = p.reader.take()
        assert [sample.data.x for sample in samples] == [1, 3]
        assert samples[0].info.source_timestamp == samples[1].info.source_timestamp
