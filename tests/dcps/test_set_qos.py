"""``set_qos`` on every kind of entity: what it sets changes, what it leaves out stays, and what is fixed is refused."""

from __future__ import annotations

from collections.abc import Callable

import pytest

import ddsi
from ddsi.spi import ProtectedEndpoint
from ddsi.spi.plaintext import Plaintext
from ddsi.structure.discovered import DiscoveredReaderData, DiscoveredWriterData

from .running import RELIABLE, Shape, eventually, in_trio, pair

BLUE, RED = ddsi.Partition("blue"), ddsi.Partition("red")


# --- writers and readers -------------------------------------------------------------------------------------------


@in_trio
async def test_what_is_set_changes_and_the_rest_stays(domain: int) -> None:
    async with pair(domain, local=True) as p:
        p.writer.set_qos(ddsi.Qos(user_data=ddsi.UserData(b"one")))
        p.writer.set_qos(ddsi.Qos(lifespan=ddsi.Lifespan(3)))
        assert p.writer.qos == RELIABLE | ddsi.Qos(user_data=ddsi.UserData(b"one"), lifespan=ddsi.Lifespan(3))
        assert p.writer.endpoint_qos.user_data.value == b"one"
        (handle,) = p.reader.matched_publications()
        assert p.reader.matched_publication_data(handle).qos.lifespan == ddsi.Lifespan(3)


@pytest.mark.parametrize("local", [False, True], ids=["remote", "local"])
@in_trio
async def test_a_partition_changes_at_run_time_and_both_sides_are_told(domain: int, local: bool) -> None:
    async with pair(domain, local=local) as p:
        p.reader.set_qos(ddsi.Qos(partition=BLUE))
        await eventually(lambda: p.writer.status(ddsi.PublicationMatched).current_count == 0)
        assert p.reader.status(ddsi.SubscriptionMatched).current_count == 0
        p.writer.set_qos(ddsi.Qos(partition=ddsi.Partition("b*")))
        await p.matched()
        await p.writer.write(Shape("BLUE", 1, 2))
        assert (await anext(p.reader)).data == Shape("BLUE", 1, 2)


@in_trio
async def test_a_fixed_policy_is_refused_by_name_and_nothing_changes(domain: int) -> None:
    async with pair(domain, local=True) as p:
        for entity in (p.writer, p.reader):
            before = entity.qos
            with pytest.raises(ddsi.ImmutablePolicy, match=r"of 'Square'.*reliability.*BestEffort"):
                entity.set_qos(ddsi.Qos(reliability=ddsi.BestEffort(), partition=BLUE))
            assert entity.qos == before
        assert p.writer.status(ddsi.PublicationMatched).current_count == 1


@in_trio
async def test_policies_that_contradict_each_other_are_refused_and_nothing_changes(domain: int) -> None:
    async with pair(domain, local=True) as p:
        p.reader.set_qos(ddsi.Qos(time_based_filter=ddsi.TimeBasedFilter(0.5)))
        with pytest.raises(ddsi.InconsistentPolicy, match="deadline"):
            p.reader.set_qos(ddsi.Qos(deadline=ddsi.Deadline(0.1), partition=BLUE))
        assert p.reader.endpoint_qos.partition == ddsi.Partition()
        assert p.reader.endpoint_qos.deadline == ddsi.Deadline()


@in_trio
async def test_a_property_that_changes_is_named_and_not_shown(domain: int) -> None:
    async with pair(domain, local=True) as p:
        with pytest.raises(ddsi.ImmutablePolicy, match="properties") as caught:
            p.writer.set_qos(ddsi.Qos(properties={"password": "hidden"}))
        assert "hidden" not in str(caught.value)


@in_trio
async def test_what_is_no_qos_or_closed_is_refused(domain: int) -> None:
    async with pair(domain, local=True) as p:
        with pytest.raises(ddsi.BadParameter, match=r"ddsi.Qos"):
            p.writer.set_qos(BLUE)  # type: ignore[arg-type]
        p.writer.close()
        with pytest.raises(ddsi.AlreadyDeleted):
            p.writer.set_qos(ddsi.Qos(partition=BLUE))


# --- groups, topics, participants ----------------------------------------------------------------------------------


@in_trio
async def test_a_group_changes_those_of_its_members_that_do_not_say_themselves(domain: int) -> None:
    async with ddsi.DomainParticipant(domain) as participant:
        topic = ddsi.Topic(participant, "Square", Shape)
        publisher = ddsi.Publisher(participant, ddsi.Qos(partition=BLUE))
        follows = ddsi.DataWriter(publisher, topic)
        insists = ddsi.DataWriter(publisher, topic, ddsi.Qos(partition=BLUE))
        reader = ddsi.DataReader(participant, topic, ddsi.Qos(partition=RED))
        publisher.set_qos(ddsi.Qos(partition=RED, group_data=ddsi.GroupData(b"g")))
        assert follows.endpoint_qos.partition == RED
        assert insists.endpoint_qos.partition == BLUE
        assert insists.endpoint_qos.group_data == follows.endpoint_qos.group_data == ddsi.GroupData(b"g")
        assert reader.matched_publications() == [follows.guid]


@in_trio
async def test_what_one_member_may_not_no_member_does(domain: int) -> None:
    async with ddsi.DomainParticipant(domain) as participant:
        topic = ddsi.Topic(participant, "Square", Shape)
        subscriber = ddsi.Subscriber(participant)
        plain = ddsi.DataReader(subscriber, topic)
        ddsi.DataReader(subscriber, topic, ddsi.Qos(time_based_filter=ddsi.TimeBasedFilter(2)))
        with pytest.raises(ddsi.InconsistentPolicy):
            subscriber.set_qos(ddsi.Qos(deadline=ddsi.Deadline(1)))
        with pytest.raises(ddsi.ImmutablePolicy, match="presentation"):
            subscriber.set_qos(ddsi.Qos(presentation=ddsi.Presentation(ordered_access=True)))
        assert plain.endpoint_qos.deadline == ddsi.Deadline()
        assert subscriber.qos == ddsi.Qos()


@in_trio
async def test_a_topic_changes_its_endpoints_wherever_they_belong(domain: int) -> None:
    async with ddsi.DomainParticipant(domain) as participant:
        topic = ddsi.Topic(participant, "Square", Shape)
        other = ddsi.Topic(participant, "Circle", Shape)
        writers = [
            ddsi.DataWriter(participant, topic),
            ddsi.DataWriter(ddsi.Publisher(participant), topic),
            ddsi.DataWriter(participant, other),
        ]
        topic.set_qos(ddsi.Qos(topic_data=ddsi.TopicData(b"t")))
        assert [writer.endpoint_qos.topic_data.value for writer in writers] == [b"t", b"t", b""]
        with pytest.raises(ddsi.ImmutablePolicy, match=r"topic 'Square'.*durability"):
            topic.set_qos(ddsi.Qos(durability=ddsi.TransientLocal()))


@in_trio
async def test_user_data_of_a_participant_change(domain: int) -> None:
    async with ddsi.DomainParticipant(domain) as one, ddsi.DomainParticipant(domain) as other:
        await eventually(other.discovered_participants)
        one.set_qos(ddsi.Qos(user_data=ddsi.UserData(b"new")))
        await eventually(lambda: other.discovered_participants()[0].user_data == b"new")
        with pytest.raises(ddsi.ImmutablePolicy, match="entity_name"):
            one.set_qos(ddsi.Qos(entity_name="other"))


@in_trio
async def test_before_it_is_entered_a_participant_may_change_altogether(domain: int) -> None:
    participant = ddsi.DomainParticipant(domain)
    participant.set_qos(ddsi.Qos(entity_name="named"))
    async with participant, ddsi.DomainParticipant(domain) as other:
        await eventually(lambda: [data.entity_name for data in other.discovered_participants()] == ["named"])


# --- security ------------------------------------------------------------------------------------------------------


class _Forbids(Plaintext):
    """No endpoint may be in the partition ``red``."""

    def local_endpoint_changed(self, data: DiscoveredWriterData | DiscoveredReaderData) -> ProtectedEndpoint:
        if "red" in data.qos.partition.names:
            raise ddsi.NotAllowedBySecurity("no rights in partition 'red'")
        return super().local_endpoint_changed(data)


@in_trio
async def test_a_forbidden_partition_is_refused_and_nothing_changes(
    domain: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("ddsi.transport.pump.load_hooks", lambda properties, **given: _Forbids())
    async with ddsi.DomainParticipant(domain) as participant:
        topic = ddsi.Topic(participant, "Square", Shape)
        publisher = ddsi.Publisher(participant)
        writers = [ddsi.DataWriter(publisher, topic, ddsi.Qos(partition=BLUE)), ddsi.DataWriter(publisher, topic)]
        changes: list[Callable[[ddsi.Qos], None]] = [writers[0].set_qos, publisher.set_qos]
        for change in changes:
            with pytest.raises(ddsi.NotAllowedBySecurity, match="red"):
                change(ddsi.Qos(partition=RED))
        assert [writer.endpoint_qos.partition for writer in writers] == [BLUE, ddsi.Partition()]
