"""Entities: created without await, closed with what they belong to or before, their Qos merged from three places."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from typing import Any, assert_type

import pytest
import trio

import ddsi
from tests.dcps.running import RELIABLE, Note, Shape, config, eventually, in_trio

# --- a participant that is not open ----------------------------------------------------------------------


def test_nothing_works_before_the_participant_is_entered() -> None:
    participant = ddsi.DomainParticipant(0)
    for use in (
        lambda: ddsi.Topic(participant, "Square", Shape),
        lambda: ddsi.Publisher(participant),
        lambda: ddsi.Subscriber(participant),
        lambda: participant.guid,
        participant.discovered_participants,
        participant.drop_counts,
    ):
        with pytest.raises(ddsi.PreconditionNotMet, match="async with"):
            use()


@in_trio
async def test_a_participant_is_entered_once(domain: int) -> None:
    async with ddsi.DomainParticipant(domain) as participant:
        with pytest.raises(ddsi.PreconditionNotMet, match="entered once"):
            await participant.__aenter__()
    with pytest.raises(ddsi.AlreadyDeleted):
        await participant.__aenter__()


@in_trio
async def test_a_participant_that_cannot_open_its_sockets_says_why_and_can_be_made_again(domain: int) -> None:
    with pytest.raises(ddsi.ConfigurationError, match=r"'nowhere0'.*there are: .*lo"):
        async with ddsi.DomainParticipant(domain, config=config(interfaces=("nowhere0",))):
            raise AssertionError("it was entered")
    async with ddsi.DomainParticipant(domain):
        pass


@pytest.mark.parametrize("domain_id", [-1, 233, "0", 1.0, None])
def test_a_domain_id_is_a_number_from_0_to_232(domain_id: Any) -> None:
    with pytest.raises(ddsi.BadParameter, match="0 to 232"):
        ddsi.DomainParticipant(domain_id)


# --- closing ---------------------------------------------------------------------------------------------


@in_trio
async def test_everything_is_closed_with_its_participant(domain: int) -> None:
    async with ddsi.DomainParticipant(domain) as participant:
        topic = ddsi.Topic(participant, "Square", Shape)
        publisher, subscriber = ddsi.Publisher(participant), ddsi.Subscriber(participant)
        entities: list[ddsi.Entity] = [
            participant, topic, publisher, subscriber,
            ddsi.DataWriter(participant, topic), ddsi.DataWriter(publisher, topic),
            ddsi.DataReader(participant, topic), ddsi.DataReader(subscriber, topic),
        ]  # fmt: skip
        assert not any(entity.is_closed for entity in entities)
    assert all(entity.is_closed for entity in entities)
    for entity in entities:
        entity.close()


@in_trio
async def test_a_group_closes_its_members_and_nothing_else(domain: int) -> None:
    async with ddsi.DomainParticipant(domain) as participant:
        topic = ddsi.Topic(participant, "Square", Shape)
        publisher = ddsi.Publisher(participant)
        inside, beside = ddsi.DataWriter(publisher, topic), ddsi.DataWriter(participant, topic)
        publisher.close()
        assert inside.is_closed
        assert not beside.is_closed
        with pytest.raises(ddsi.AlreadyDeleted):
            ddsi.DataWriter(publisher, topic)


@in_trio
async def test_closing_a_topic_leaves_its_endpoints_and_makes_no_more(domain: int) -> None:
    async with ddsi.DomainParticipant(domain) as participant:
        topic = ddsi.Topic(participant, "Square", Shape)
        writer, reader = ddsi.DataWriter(participant, topic), ddsi.DataReader(participant, topic)
        topic.close()
        await writer.write(Shape("RED"))
        assert len(reader.take()) == 1
        with pytest.raises(ddsi.AlreadyDeleted, match="Square"):
            ddsi.DataReader(participant, topic)


@in_trio
async def test_what_is_closed_says_so(domain: int) -> None:
    async with ddsi.DomainParticipant(domain) as participant:
        topic = ddsi.Topic(participant, "Square", Shape)
        writer, reader = ddsi.DataWriter(participant, topic), ddsi.DataReader(participant, topic)
        for _ in range(2):
            writer.close()
            reader.close()
        uses: list[Callable[[], object]] = [reader.take, reader.read, writer.assert_liveliness]
        for use in uses:
            with pytest.raises(ddsi.AlreadyDeleted, match="'Square'"):
                use()
        waits: list[Callable[[], Awaitable[None]]] = [
            lambda: writer.write(Shape("RED")),
            lambda: writer.dispose(Shape("RED")),
            lambda: writer.unregister(Shape("RED")),
            writer.wait_for_matched,
            writer.wait_for_acknowledgments,
            reader.wait,
            reader.wait_for_matched,
            reader.wait_for_historical_data,
        ]
        for wait in waits:
            with pytest.raises(ddsi.AlreadyDeleted, match="'Square'"):
                await wait()
        assert [sample async for sample in reader] == []
        assert writer.guid != reader.guid


@in_trio
async def test_a_writer_closed_between_the_yield_and_the_write_writes_nothing(domain: int) -> None:
    async with ddsi.DomainParticipant(domain) as participant:
        topic = ddsi.Topic(participant, "Square", Shape)
        writer, reader = ddsi.DataWriter(participant, topic), ddsi.DataReader(participant, topic)

        async def write_for_ever() -> None:
            with pytest.raises(ddsi.AlreadyDeleted):
                while True:
                    await writer.write(Shape("RED"))

        async with trio.open_nursery() as nursery:
            nursery.start_soon(write_for_ever)
            await trio.sleep(0.005)
            writer.close()
            reader.take()
        assert [sample for sample in reader.take() if sample.info.valid_data] == []


@in_trio
async def test_entities_that_come_and_go_are_forgotten(domain: int) -> None:
    async with ddsi.DomainParticipant(domain) as participant:
        for _ in range(50):
            topic = ddsi.Topic(participant, "Square", Shape)
            publisher = ddsi.Publisher(participant)
            ddsi.DataWriter(publisher, topic).close()
            ddsi.DataReader(participant, topic).close()
            publisher.close()
            topic.close()
        assert len(participant._members) == 0
        engine: Any = participant._pump.engine  # type: ignore[union-attr]
        assert engine.user_writers() == engine.user_readers() == []


# --- Qos -------------------------------------------------------------------------------------------------


@in_trio
async def test_what_nobody_sets_is_the_omgs_default(domain: int) -> None:
    """Writers are reliable by default and readers are not.  DDS 1.4 §2.2.3, the table of defaults."""
    async with ddsi.DomainParticipant(domain) as participant:
        topic = ddsi.Topic(participant, "Square", Shape)
        offered = ddsi.DataWriter(participant, topic).endpoint_qos
        requested = ddsi.DataReader(participant, topic).endpoint_qos
    assert offered.reliability == ddsi.Reliable(max_blocking_time=0.1)
    assert requested.reliability == ddsi.BestEffort()
    for qos in (offered, requested):
        assert qos.history == ddsi.KeepLast(1)
        assert qos.durability == ddsi.Volatile()
        assert qos.ownership == ddsi.Shared()
    assert offered.data_representation.ids == (ddsi.XCDR1,)
    assert requested.data_representation.ids == (ddsi.XCDR1, ddsi.XCDR2)


@in_trio
async def test_a_type_may_be_for_one_representation_alone(domain: int) -> None:
    """DDS-XTypes 1.3 §7.3.1.2.1.16, ``@data_representation``."""

    @ddsi.idl.struct(extensibility=ddsi.idl.FINAL, representations=(ddsi.XCDR2,))
    class Modern:
        x: ddsi.idl.int32

    old = ddsi.Qos(data_representation=ddsi.DataRepresentation(ddsi.XCDR1))
    async with ddsi.DomainParticipant(domain) as participant:
        topic = ddsi.Topic(participant, "Modern", Modern)
        assert ddsi.DataWriter(participant, topic).endpoint_qos.data_representation.ids == (ddsi.XCDR2,)
        assert ddsi.DataReader(participant, topic).endpoint_qos.data_representation.ids == (ddsi.XCDR2,)
        with pytest.raises(ddsi.BadParameter, match="'Modern': its type is for XCDR2 alone, not for XCDR1"):
            ddsi.DataWriter(participant, topic, old)


@in_trio
async def test_the_entitys_own_qos_goes_before_the_groups_and_that_before_the_topics(domain: int) -> None:
    async with ddsi.DomainParticipant(domain) as participant:
        topic = ddsi.Topic(
            participant,
            "Square",
            Shape,
            ddsi.Qos(history=ddsi.KeepLast(5), durability=ddsi.TransientLocal(), deadline=ddsi.Deadline(5)),
        )
        group = ddsi.Qos(partition=ddsi.Partition("group"), deadline=ddsi.Deadline(6), history=ddsi.KeepLast(6))
        own = ddsi.Qos(history=ddsi.KeepAll())
        publisher, subscriber = ddsi.Publisher(participant, group), ddsi.Subscriber(participant, group)
        for entity in (ddsi.DataWriter(publisher, topic, own), ddsi.DataReader(subscriber, topic, own)):
            qos = entity.endpoint_qos
            assert qos.history == ddsi.KeepAll()
            assert qos.deadline == ddsi.Deadline(6)
            assert qos.durability == ddsi.TransientLocal()
            assert qos.partition == ddsi.Partition("group")
            assert entity.qos.history == ddsi.KeepAll()


@in_trio
async def test_partitions_of_publisher_and_subscriber_decide_who_meets(domain: int) -> None:
    async with ddsi.DomainParticipant(domain) as here, ddsi.DomainParticipant(domain) as there:
        writer = ddsi.DataWriter(
            ddsi.Publisher(here, ddsi.Qos(partition=ddsi.Partition("left", "middle"))),
            ddsi.Topic(here, "Square", Shape),
        )
        readers = {
            name: ddsi.DataReader(
                ddsi.Subscriber(there, ddsi.Qos(partition=ddsi.Partition(name))), ddsi.Topic(there, "Square", Shape)
            )
            for name in ("left", "mid*", "right", "")
        }
        await writer.wait_for_matched(2, timeout=5)
        await eventually(lambda: len(here.match_refusals()) == 2)
        matched = {name for name, reader in readers.items() if reader.guid in writer.matched_subscriptions()}
        assert matched == {"left", "mid*"}
        assert {refusal.kind for refusal in here.match_refusals().values()} == {"partition"}


@in_trio
async def test_a_shared_qos_is_taken_by_all_and_each_names_what_it_has_no_use_for(domain: int) -> None:
    shared = RELIABLE | ddsi.Qos(lifespan=ddsi.Lifespan(1), time_based_filter=ddsi.TimeBasedFilter(0.1))
    async with ddsi.DomainParticipant(domain, qos=ddsi.Qos(deadline=ddsi.Deadline(1))) as participant:
        topic = ddsi.Topic(participant, "Square", Shape, ddsi.Qos(lifespan=ddsi.Lifespan(2)))
        writer, reader = ddsi.DataWriter(participant, topic, shared), ddsi.DataReader(participant, topic, shared)
        groups = ddsi.Publisher(participant, shared), ddsi.Subscriber(participant, shared)
        assert participant.unused_policies == ("deadline",)
        assert topic.unused_policies == ()
        assert [entity.unused_policies for entity in (writer, *groups, reader)] == [
            ("time_based_filter",),
            ("time_based_filter",),
            ("lifespan",),
            ("lifespan",),
        ]
        reader.set_qos(ddsi.Qos(transport_priority=ddsi.TransportPriority(1)))
        assert reader.unused_policies == ("lifespan", "transport_priority")


@in_trio
async def test_contradicting_policies_are_refused_and_nothing_is_created(domain: int) -> None:
    mad = ddsi.Qos(history=ddsi.KeepLast(10), resource_limits=ddsi.ResourceLimits(max_samples_per_instance=5))
    async with ddsi.DomainParticipant(domain) as participant:
        topic = ddsi.Topic(participant, "Square", Shape)
        for kind in (ddsi.DataWriter, ddsi.DataReader):
            with pytest.raises(ddsi.InconsistentPolicy, match="max_samples_per_instance"):
                kind(participant, topic, mad)
        assert set(participant._members) == {topic}


@in_trio
async def test_a_name_and_user_data_of_a_participant_reach_its_peers(domain: int) -> None:
    qos = ddsi.Qos(entity_name="arm", user_data=ddsi.UserData(b"\x00left"))
    async with ddsi.DomainParticipant(domain, qos=qos) as named, ddsi.DomainParticipant(domain) as peer:
        await eventually(peer.discovered_participants)
        (seen,) = peer.discovered_participants()
        assert (seen.guid, seen.entity_name, seen.user_data) == (named.guid, "arm", b"\x00left")


# --- arguments -------------------------------------------------------------------------------------------


@in_trio
async def test_entities_of_the_wrong_kind_are_refused_in_words(domain: int) -> None:
    async with ddsi.DomainParticipant(domain) as participant:
        topic = ddsi.Topic(participant, "Square", Shape)
        publisher, subscriber = ddsi.Publisher(participant), ddsi.Subscriber(participant)
        wrong: list[tuple[Any, str]] = [
            (lambda: ddsi.DataWriter(subscriber, topic), "DomainParticipant or a Publisher"),  # type: ignore[arg-type]
            (lambda: ddsi.DataReader(publisher, topic), "DomainParticipant or a Subscriber"),  # type: ignore[arg-type]
            (lambda: ddsi.DataWriter(topic, topic), "DomainParticipant or a Publisher"),  # type: ignore[arg-type]
            (lambda: ddsi.DataReader(participant, "Square"), "ddsi.Topic"),  # type: ignore[arg-type]
            (lambda: ddsi.DataWriter(participant, topic, ddsi.Reliable()), "ddsi.Qos"),  # type: ignore[arg-type]
            (lambda: ddsi.Topic(participant, "", Shape), "1 to 255 octets"),
            (lambda: ddsi.Topic(participant, "x" * 256, Shape), "1 to 255 octets"),
            (lambda: ddsi.Topic(participant, "Square", int), "int"),
        ]
        for make, told in wrong:
            with pytest.raises(ddsi.BadParameter, match=told):
                make()
        assert set(participant._members) == {topic, publisher, subscriber}


@in_trio
async def test_a_topic_of_another_participant_is_refused(domain: int) -> None:
    async with ddsi.DomainParticipant(domain) as one, ddsi.DomainParticipant(domain) as other:
        topic = ddsi.Topic(one, "Square", Shape)
        with pytest.raises(ddsi.PreconditionNotMet, match="'Square'"):
            ddsi.DataWriter(other, topic)


@in_trio
async def test_entities_say_what_they_are(domain: int) -> None:
    participant = ddsi.DomainParticipant(domain)
    assert repr(participant) == f"<DomainParticipant of domain {domain}, not entered>"
    async with participant:
        topic = ddsi.Topic(participant, "Square", Shape)
        writer, reader = ddsi.DataWriter(participant, topic), ddsi.DataReader(participant, topic)
        await writer.write(Shape("RED"))
        assert repr(topic) == "<Topic 'Square' of Shape>"
        assert repr(writer) == f"<DataWriter of 'Square' {writer.guid}>"
        assert repr(reader) == f"<DataReader of 'Square' {reader.guid}, 1 samples>"
        assert repr(ddsi.Publisher(participant)) == f"<Publisher in domain {domain}, 0 members>"
        assert str(participant.guid.prefix) in repr(participant)
    assert repr(participant) == f"<DomainParticipant of domain {domain}, closed>"


@in_trio
async def test_entities_are_generic_over_their_sample(domain: int) -> None:
    async with ddsi.DomainParticipant(domain) as participant:
        topic = ddsi.Topic(participant, "Notes", Note)
        writer, reader = ddsi.DataWriter(participant, topic), ddsi.DataReader(participant, topic)
        assert_type(writer, ddsi.DataWriter[Note])
        assert_type(reader.take(), list[ddsi.Sample[Note]])
        assert writer.topic is reader.topic is topic
        assert (topic.type, topic.type_name, topic.name) == (Note, "Note", "Notes")
        assert topic.participant is participant
        assert participant.domain_id == domain


@in_trio
async def test_an_explicit_config_goes_before_the_environment(domain: int, monkeypatch: pytest.MonkeyPatch) -> None:
    chosen = config(domain_tag="chosen")
    monkeypatch.setenv("DDSI_URI", "<DDSI><Domain><Nonsense/></Domain></DDSI>")
    with pytest.raises(ddsi.ConfigurationError, match="Nonsense"):
        ddsi.DomainParticipant(domain)
    async with ddsi.DomainParticipant(domain, config=chosen) as participant:
        assert participant.config.domain_tag == "chosen"
        assert RELIABLE.history == ddsi.KeepAll()
