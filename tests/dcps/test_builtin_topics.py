"""Who is there, as an application sees it: readers of builtin topics, and the data behind handles.  DDS 1.4 §2.2.5."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest
import trio

import ddsi

from .running import RELIABLE, Note, Shape, config, eventually, in_trio, pair

ALIVE, DISPOSED = ddsi.InstanceState.ALIVE, ddsi.InstanceState.NOT_ALIVE_DISPOSED
PARTITION = ddsi.Partition("here")
QOS = RELIABLE | ddsi.Qos(
    partition=PARTITION, user_data=ddsi.UserData(b"mine"), data_tags=ddsi.DataTags(("colour", "red"))
)


# --- readers of builtin topics --------------------------------------------------------------------------------------


@in_trio
async def test_who_joins_and_leaves_is_told_in_a_loop(domain: int) -> None:
    async with ddsi.DomainParticipant(domain) as participant:
        participants = ddsi.BuiltinTopicReader(participant, ddsi.ParticipantBuiltinTopicData)
        qos = ddsi.Qos(entity_name="guest", user_data=ddsi.UserData(b"hello"))
        async with ddsi.DomainParticipant(domain, qos=qos) as guest:
            sample = await anext(participants)
            assert sample.info.valid_data
            assert (sample.data.key, sample.data.entity_name, sample.data.user_data) == (guest.guid, "guest", b"hello")
            assert (sample.data.vendor_name, sample.data.domain_id) == ("ddsi", domain)
            assert sample.data.security == ddsi.ParticipantSecurity()
            assert sample.info.instance_handle == sample.info.publication_handle == guest.guid
            left = guest.guid
        async for sample in participants:
            assert (sample.data.key, sample.info.instance_state, sample.info.valid_data) == (left, DISPOSED, False)
            assert sample.data.entity_name == "guest"
            break


@in_trio
async def test_writers_and_readers_come_with_all_their_policies(domain: int) -> None:
    async with pair(domain, writer=QOS, reader=QOS) as p:
        publications = ddsi.BuiltinTopicReader(p.there, ddsi.PublicationBuiltinTopicData)
        subscriptions = ddsi.BuiltinTopicReader(p.here, ddsi.SubscriptionBuiltinTopicData)
        (publication,) = [sample.data for sample in publications.take()]
        (subscription,) = [sample.data for sample in subscriptions.take()]
        assert (publication.key, publication.participant_key) == (p.writer.guid, p.here.guid)
        assert (subscription.key, subscription.participant_key) == (p.reader.guid, p.there.guid)
        for data in (publication, subscription):
            assert (data.topic_name, data.qos.partition, data.user_data) == ("Square", PARTITION, b"mine")
            assert data.data_tags == (("colour", "red"),)
            assert data.qos.is_reliable
            assert data.security == ddsi.EndpointSecurity()
        p.writer.close()
        end = await anext(publications)
        assert (end.data, end.info.instance_state) == (publication, DISPOSED)


@in_trio
async def test_one_that_is_made_late_sees_all_who_are_there_and_nobody_of_its_own_participant(domain: int) -> None:
    async with pair(domain) as p:
        ddsi.DataWriter(p.there, ddsi.Topic(p.there, "Other", Note))
        publications = ddsi.BuiltinTopicReader(p.there, ddsi.PublicationBuiltinTopicData)
        again = ddsi.BuiltinTopicReader(p.there, ddsi.PublicationBuiltinTopicData)
        participants = ddsi.BuiltinTopicReader(p.there, ddsi.ParticipantBuiltinTopicData)
        assert [sample.data.key for sample in publications.take()] == [p.writer.guid]
        assert [sample.data.key for sample in participants.take()] == [p.here.guid]
        assert [sample.data.key for sample in again.take()] == [p.writer.guid], "what one takes, another keeps"


@in_trio
async def test_they_are_read_waited_for_and_selected_from_as_all_readers_are(domain: int) -> None:
    async with pair(domain) as p:
        publications = ddsi.BuiltinTopicReader(p.there, ddsi.PublicationBuiltinTopicData)
        await publications.wait()
        assert len(publications.read()) == 1
        (sample,) = publications.read(instance=p.writer.guid, sample_states=ddsi.SampleState.READ)
        assert sample.data.type_name == p.writer.topic.type_name
        assert publications.read(sample_states=ddsi.SampleState.NOT_READ) == []
        of_notes = ddsi.ReadCondition(query=lambda data: data.topic_name == "Notes")
        assert publications.read(condition=of_notes) == []
        writer = ddsi.DataWriter(p.here, ddsi.Topic(p.here, "Notes", Note))
        await publications.wait(of_notes)
        assert [sample.data.key for sample in publications.take(condition=of_notes)] == [writer.guid]
        assert len(publications.take(1)) == 1
        assert publications.take() == []


@in_trio
async def test_whose_lease_runs_out_has_no_writers(domain: int) -> None:
    """A participant that falls silent says no goodbye."""
    async with ddsi.DomainParticipant(domain) as participant:
        participants = ddsi.BuiltinTopicReader(participant, ddsi.ParticipantBuiltinTopicData)
        async with ddsi.DomainParticipant(domain, config=config(lease_duration=0.4)) as silent:
            sample = await anext(participants)
            assert sample.data.lease_duration == pytest.approx(0.4, abs=1e-6)
            transport = silent._pump.transport  # type: ignore[union-attr]
            transport.send = lambda parts, locator: True  # type: ignore[method-assign]
            sample = await anext(participants)
            assert sample.info.instance_state is ddsi.InstanceState.NOT_ALIVE_NO_WRITERS


@in_trio
async def test_it_ends_with_its_participant_and_wakes_whoever_waits(domain: int) -> None:
    async with ddsi.DomainParticipant(domain) as participant:
        participants = ddsi.BuiltinTopicReader(participant, ddsi.ParticipantBuiltinTopicData)
        seen: list[Any] = []

        async def watch() -> None:
            async for sample in participants:
                seen.append(sample)
            seen.append("end")

        async with trio.open_nursery() as nursery:
            nursery.start_soon(watch)
            await trio.sleep(0.01)
            participant.close()
        assert seen == ["end"]
        with pytest.raises(ddsi.AlreadyDeleted):
            participants.take()
        with pytest.raises(ddsi.AlreadyDeleted):
            ddsi.BuiltinTopicReader(participant, ddsi.ParticipantBuiltinTopicData)


@in_trio
async def test_a_closed_one_is_told_nothing_more(domain: int) -> None:
    async with ddsi.DomainParticipant(domain) as participant:
        participants = ddsi.BuiltinTopicReader(participant, ddsi.ParticipantBuiltinTopicData)
        participants.close()
        participants.close()
        async with ddsi.DomainParticipant(domain):
            await eventually(participant.discovered_participants)
        assert len(participants._history) == 0


@in_trio
async def test_it_reads_four_kinds_and_says_so(domain: int) -> None:
    async with ddsi.DomainParticipant(domain) as participant:
        with pytest.raises(ddsi.BadParameter, match="ParticipantBuiltinTopicData, TopicBuiltinTopicData, Publication"):
            ddsi.BuiltinTopicReader(participant, Shape)  # type: ignore[type-var]
        publications = ddsi.BuiltinTopicReader(participant, ddsi.PublicationBuiltinTopicData)
        assert repr(publications) == "<BuiltinTopicReader of DCPSPublication, 0 samples>"


@in_trio
async def test_a_topic_lasts_as_long_as_the_endpoints_that_it_is_known_by(domain: int) -> None:
    async with pair(domain, writer=QOS, reader=QOS) as p:
        topics = ddsi.BuiltinTopicReader(p.there, ddsi.TopicBuiltinTopicData)
        (square,) = topics.take()
        assert (square.data.name, square.data.type_name) == ("Square", "Shape")
        assert square.data.qos.partition == PARTITION
        other = ddsi.DataWriter(p.here, ddsi.Topic(p.here, "Square", Shape))
        note = ddsi.DataWriter(p.here, ddsi.Topic(p.here, "Notes", Note))
        assert (await anext(topics)).data.name == "Notes", "the second writer makes no second topic"
        p.writer.close()
        note.close()
        end = await anext(topics)
        assert (end.data.name, end.info.instance_state) == ("Notes", DISPOSED)
        other.close()
        end = await anext(topics)
        assert (end.info.instance_handle, end.info.instance_state) == (square.data.key, DISPOSED)
        ddsi.DataWriter(p.here, ddsi.Topic(p.here, "Square", Shape))
        again = await anext(topics)
        assert (again.data.key, again.info.instance_state) == (square.data.key, ALIVE)


# --- what is behind a handle ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("local", [False, True], ids=["remote", "of the same participant"])
@in_trio
async def test_a_sample_leads_to_its_writer_and_that_to_its_participant(domain: int, local: bool) -> None:
    async with pair(domain, writer=QOS, reader=QOS, local=local) as p:
        await p.writer.write(Shape("BLUE"))
        sample = await anext(p.reader)
        publication = p.reader.matched_publication_data(sample.info.publication_handle)
        assert (publication.key, publication.topic_name, publication.type_name) == (
            p.writer.guid,
            "Square",
            p.writer.topic.type_name,
        )
        announced = replace(publication.qos, history=ddsi.KeepAll())  # which a writer keeps to itself
        assert announced == p.writer.endpoint_qos
        assert publication.data_tags == (("colour", "red"),)
        assert publication.security == ddsi.EndpointSecurity()
        participant = p.there.discovered_participant_data(publication.participant_key)
        assert (participant.key, participant.security) == (p.here.guid, ddsi.ParticipantSecurity())


@pytest.mark.parametrize("local", [False, True], ids=["remote", "of the same participant"])
@in_trio
async def test_a_writer_knows_its_readers(domain: int, local: bool) -> None:
    async with pair(domain, writer=QOS, reader=QOS, local=local) as p:
        (handle,) = p.writer.matched_subscriptions()
        subscription = p.writer.matched_subscription_data(handle)
        assert (subscription.key, subscription.participant_key) == (p.reader.guid, p.there.guid)
        assert (subscription.user_data, subscription.content_filter) == (b"mine", None)


@in_trio
async def test_who_is_not_matched_or_not_there_has_no_data(domain: int) -> None:
    async with pair(domain) as p:
        writer, reader = p.writer, p.reader
        unmatched = ddsi.DataWriter(p.here, ddsi.Topic(p.here, "Notes", Note))
        await eventually(lambda: len(p.there.discovered_publications()) == 2)
        with pytest.raises(ddsi.BadParameter, match=r"reader of 'Square': writer .* is not matched, or no longer"):
            reader.matched_publication_data(unmatched.guid)
        with pytest.raises(ddsi.BadParameter, match=r"writer of 'Notes': reader .* is not matched"):
            unmatched.matched_subscription_data(reader.guid)
        with pytest.raises(ddsi.BadParameter, match="knows no participant"):
            p.here.discovered_participant_data(writer.guid)
        assert p.there.discovered_participant_data(p.here.guid).key == p.here.guid
        here, handle = p.here.guid, writer.guid
        p.here.close()
        await eventually(lambda: not p.there.discovered_participants())
        for gone in (
            lambda: reader.matched_publication_data(handle),
            lambda: p.there.discovered_participant_data(here),
        ):
            with pytest.raises(ddsi.BadParameter, match="no longer"):
                gone()
        with pytest.raises(ddsi.AlreadyDeleted):
            writer.matched_subscription_data(reader.guid)


@in_trio
async def test_what_changes_is_seen_behind_the_handle(domain: int) -> None:
    """A participant's own data is what it announces of itself."""
    qos = ddsi.Qos(entity_name="me", properties={"open": ddsi.Property("yes", propagate=True), "closed": "no"})
    async with ddsi.DomainParticipant(domain, qos=qos) as participant:
        own = participant.discovered_participant_data(participant.guid)
        assert (own.entity_name, [name for name, _ in own.properties]) == ("me", ["open"])
