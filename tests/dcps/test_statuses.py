"""Statuses: typed events in the order in which things happened, and the present value of each at once."""

from __future__ import annotations

import gc
from typing import Any, TypeVar

import pytest
import trio

import ddsi
from ddsi import idl
from tests.dcps.running import RELIABLE, Note, Shape, eventually, in_trio, pair

S = TypeVar("S")


@idl.struct(typename="Shape", extensibility=idl.FINAL)
class KeylessShape:
    """A type of the same name as :class:`Shape` that is not the same."""

    color: str
    x: idl.int32
    y: idl.int32


async def event_of(entity: ddsi.Entity, kind: type[S], seconds: float = 5) -> S:
    """The next event of this kind."""
    with trio.fail_after(seconds):
        async for event in entity.events():
            if isinstance(event, kind):
                return event
    raise AssertionError("the events have ended")


# --- the stream ------------------------------------------------------------------------------------------


@in_trio
async def test_what_happened_before_anybody_listened_comes_first(domain: int) -> None:
    async with pair(domain, local=True) as p:
        assert (await event_of(p.writer, ddsi.PublicationMatched)).current_count == 1


@in_trio
async def test_two_listeners_both_get_every_event(domain: int) -> None:
    async with ddsi.DomainParticipant(domain) as participant:
        topic = ddsi.Topic(participant, "Square", Shape)
        writer = ddsi.DataWriter(participant, topic)
        streams = [writer.events(), writer.events()]
        ddsi.DataReader(participant, topic)
        for stream in streams:
            event = await anext(stream)
            assert isinstance(event, ddsi.PublicationMatched)


@in_trio
async def test_events_end_with_the_entity(domain: int) -> None:
    async with pair(domain, local=True) as p:
        stream = p.reader.events()
        p.reader.close()
        kinds = [type(event) async for event in stream]
        assert ddsi.SubscriptionMatched in kinds
        assert [event async for event in p.reader.events()] == []


@in_trio
async def test_a_stream_that_nobody_reads_is_bounded_and_counts_what_it_forgot(domain: int) -> None:
    async with ddsi.DomainParticipant(domain) as participant:
        topic = ddsi.Topic(participant, "Square", Shape)
        writer = ddsi.DataWriter(participant, topic)
        stream = writer.events()
        for _ in range(600):
            ddsi.DataReader(participant, topic).close()
        assert stream.dropped == 2 * 600 - 1024
        event = await anext(stream)
        assert isinstance(event, ddsi.PublicationMatched)
        assert event.total_count == stream.dropped // 2 + 1


@in_trio
async def test_a_stream_that_is_left_is_forgotten(domain: int) -> None:
    async with ddsi.DomainParticipant(domain) as participant:
        writer = ddsi.DataWriter(participant, ddsi.Topic(participant, "Square", Shape))
        for _ in range(10):
            with trio.move_on_after(0):
                async for _ in writer.events():
                    pass
        gc.collect()
        assert len(writer._streams) <= 1  # the last one may still be in a traceback


# --- matched ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("local", [False, True])
@in_trio
async def test_matching_and_unmatching_is_told_to_both_sides(domain: int, local: bool) -> None:
    async with pair(domain, local=local) as p:
        published, subscribed = p.writer.status(ddsi.PublicationMatched), p.reader.status(ddsi.SubscriptionMatched)
        assert (published.total_count, published.current_count) == (1, 1)
        assert (subscribed.total_count, subscribed.current_count) == (1, 1)
        assert published.last_subscription_handle == p.reader.guid
        assert subscribed.last_publication_handle == p.writer.guid
        stream = p.writer.events()
        await anext(stream)
        p.reader.close()
        event = await anext(stream)
        assert isinstance(event, ddsi.PublicationMatched)
        assert (event.total_count, event.current_count, event.current_count_change) == (1, 0, -1)
        assert event.total_count_change == 0


# --- incompatible QoS ------------------------------------------------------------------------------------

STRICT = ddsi.Qos(
    reliability=ddsi.Reliable(),
    durability=ddsi.TransientLocal(),
    deadline=ddsi.Deadline(1.0),
    liveliness=ddsi.ManualByTopic(1.0),
    ownership=ddsi.Exclusive(),
    destination_order=ddsi.BySourceTimestamp(),
    latency_budget=ddsi.LatencyBudget(0.5),
    data_representation=ddsi.DataRepresentation(ddsi.XCDR2),
)
LAX = ddsi.Qos(reliability=ddsi.BestEffort(), latency_budget=ddsi.LatencyBudget(1.0))
POLICIES = [
    "reliability", "durability", "deadline", "latency_budget", "ownership", "liveliness", "destination_order",
    "data_representation",
]  # fmt: skip


@pytest.mark.parametrize("local", [False, True])
@in_trio
async def test_both_sides_hear_which_policies_do_not_fit_and_why(domain: int, local: bool) -> None:
    async with ddsi.DomainParticipant(domain) as here, ddsi.DomainParticipant(domain) as other:
        there = here if local else other
        writer = ddsi.DataWriter(here, ddsi.Topic(here, "Square", Shape), LAX)
        reader = ddsi.DataReader(there, ddsi.Topic(there, "Square", Shape), STRICT)
        offered = await event_of(writer, ddsi.OfferedIncompatibleQos)
        requested = await event_of(reader, ddsi.RequestedIncompatibleQos)
        assert writer.status(ddsi.OfferedIncompatibleQos) == offered
        assert reader.status(ddsi.RequestedIncompatibleQos) == requested
        assert [reason.policy for reason in offered.incompatibilities] == POLICIES
        assert requested.incompatibilities == offered.incompatibilities
        first = offered.incompatibilities[0]
        assert (first.policy_id, first.offered, first.requested) == (11, "BestEffort", "Reliable")
        assert str(first) == "reliability: offered BestEffort, requested Reliable"
        assert offered.last_policy_id == requested.last_policy_id == 11
        assert (offered.last_subscription_handle, requested.last_publication_handle) == (reader.guid, writer.guid)
        assert offered.total_count == offered.total_count_change == 1
        refusals = here.match_refusals()
        assert "BestEffort" in str(refusals[writer.guid, reader.guid])
        assert writer.status(ddsi.PublicationMatched).total_count == 0


# --- inconsistent topic ----------------------------------------------------------------------------------


@pytest.mark.parametrize("local", [False, True])
@in_trio
async def test_a_peer_that_uses_the_topics_name_with_another_type_is_told_of(domain: int, local: bool) -> None:
    """To the endpoint that met it, and to the topic, whose status it is.  DDS 1.4 §2.2.4.1."""
    async with ddsi.DomainParticipant(domain) as here, ddsi.DomainParticipant(domain) as other:
        there = here if local else other
        topic = ddsi.Topic(here, "Square", Shape)
        writer, reader = ddsi.DataWriter(here, topic), ddsi.DataReader(here, topic)
        ddsi.DataReader(there, ddsi.Topic(there, "Square", Note))
        ddsi.DataWriter(there, ddsi.Topic(there, "Square", Note))
        assert (await event_of(writer, ddsi.InconsistentTopic)).remote_type_name == "Note"
        assert (await event_of(reader, ddsi.InconsistentTopic)).remote_type_name == "Note"
        await eventually(lambda: topic.status(ddsi.InconsistentTopic).total_count == 2)
        assert (await event_of(topic, ddsi.InconsistentTopic)).total_count == 1


@in_trio
async def test_keyed_and_keyless_types_of_one_name_do_not_match(domain: int) -> None:
    async with ddsi.DomainParticipant(domain) as here, ddsi.DomainParticipant(domain) as there:
        reader = ddsi.DataReader(here, ddsi.Topic(here, "Square", Shape))
        ddsi.DataWriter(there, ddsi.Topic(there, "Square", KeylessShape))
        await event_of(reader, ddsi.InconsistentTopic)
        assert reader.matched_publications() == []
        (refusal,) = here.match_refusals().values()
        assert str(refusal) == "type: offered Shape (without key), requested Shape (with key)"


# --- liveliness ------------------------------------------------------------------------------------------


@in_trio
async def test_a_manual_writer_that_is_not_asserted_is_no_longer_alive(domain: int) -> None:
    manual = RELIABLE | ddsi.Qos(liveliness=ddsi.ManualByTopic(0.1))
    async with pair(domain, writer=manual, reader=manual) as p:
        assert p.reader.status(ddsi.LivelinessChanged).alive_count == 1
        await event_of(p.writer, ddsi.LivelinessLost)
        await eventually(lambda: p.reader.status(ddsi.LivelinessChanged).alive_count == 0)
        assert p.reader.status(ddsi.LivelinessChanged).not_alive_count == 1
        p.writer.assert_liveliness()
        await eventually(lambda: p.reader.status(ddsi.LivelinessChanged).alive_count == 1)
        assert p.reader.status(ddsi.LivelinessChanged).not_alive_count == 0
        assert p.reader.status(ddsi.LivelinessChanged).last_publication_handle == p.writer.guid


@pytest.mark.parametrize("kind", [ddsi.ManualByTopic, ddsi.ManualByParticipant])
@in_trio
async def test_asserting_or_writing_in_time_keeps_a_writer_alive(domain: int, kind: Any) -> None:
    manual = RELIABLE | ddsi.Qos(liveliness=kind(0.6))
    async with pair(domain, writer=manual, reader=manual) as p:
        for number in range(9):
            if number % 3 == 0:
                await p.writer.write(Shape("RED", number))
            elif kind is ddsi.ManualByTopic:
                p.writer.assert_liveliness()
            else:
                p.here.assert_liveliness()
            await trio.sleep(0.09)
        assert p.writer.status(ddsi.LivelinessLost).total_count == 0
        assert p.reader.status(ddsi.LivelinessChanged).alive_count == 1


@in_trio
async def test_an_automatic_writer_stays_alive_by_itself(domain: int) -> None:
    automatic = RELIABLE | ddsi.Qos(liveliness=ddsi.Automatic(1.0))
    async with pair(domain, writer=automatic, reader=automatic) as p:
        stream = p.reader.events()
        await trio.sleep(1.4)
        p.reader.close()
        changes = [event async for event in stream if isinstance(event, ddsi.LivelinessChanged)]
        assert [event.alive_count for event in changes] == [1]  # at the match


# --- lost and rejected -----------------------------------------------------------------------------------


@in_trio
async def test_best_effort_samples_that_the_network_loses_are_counted(domain: int) -> None:
    best_effort = ddsi.Qos(reliability=ddsi.BestEffort(), history=ddsi.KeepAll())
    async with pair(domain, writer=best_effort, reader=best_effort) as p:
        await p.writer.write(Shape("RED", 0))
        assert (await anext(p.reader)).data.x == 0
        transport: Any = p.here._pump.transport  # type: ignore[union-attr]
        send, transport.send = transport.send, lambda parts, locator: True
        for number in (1, 2):
            await p.writer.write(Shape("RED", number))
        await trio.sleep(0.01)
        transport.send = send
        await p.writer.write(Shape("RED", 3))
        assert (await anext(p.reader)).data.x == 3
        assert p.reader.status(ddsi.SampleLost).total_count == 2
        assert (await event_of(p.reader, ddsi.SampleLost)).total_count_change == 2


@in_trio
async def test_best_effort_samples_that_find_no_room_are_rejected(domain: int) -> None:
    limited = ddsi.Qos(history=ddsi.KeepAll(), resource_limits=ddsi.ResourceLimits(max_samples=2))
    async with pair(domain, reader=limited) as p:
        for number in range(5):
            await p.writer.write(Shape("RED", number))
        await eventually(lambda: p.reader.status(ddsi.SampleRejected).total_count == 3)
        assert p.reader.status(ddsi.SampleRejected).reason == "max_samples"
        assert [sample.data.x for sample in p.reader.take()] == [0, 1]
        await p.writer.write(Shape("RED", 5))
        assert (await anext(p.reader)).data.x == 5


# --- status() --------------------------------------------------------------------------------------------


@in_trio
async def test_a_status_that_never_changed_has_its_initial_value(domain: int) -> None:
    async with ddsi.DomainParticipant(domain) as participant:
        topic = ddsi.Topic(participant, "Square", Shape)
        entities = (participant, topic, ddsi.DataWriter(participant, topic), ddsi.DataReader(participant, topic))
        for entity in entities:
            for kind in entity.STATUSES:
                if kind not in (ddsi.PublicationMatched, ddsi.SubscriptionMatched, ddsi.LivelinessChanged):
                    assert entity.status(kind) == kind()


@in_trio
async def test_asking_for_a_status_that_the_entity_has_not_names_those_it_has(domain: int) -> None:
    async with ddsi.DomainParticipant(domain) as participant:
        topic = ddsi.Topic(participant, "Square", Shape)
        with pytest.raises(ddsi.BadParameter, match=r"a Topic has the statuses InconsistentTopic, but no .*SampleLost"):
            topic.status(ddsi.SampleLost)


@in_trio
async def test_a_status_tells_what_changed_since_it_was_read_last(domain: int) -> None:
    async with ddsi.DomainParticipant(domain) as participant:
        topic = ddsi.Topic(participant, "Square", Shape)
        writer = ddsi.DataWriter(participant, topic)
        assert writer.status_changes() == frozenset()
        readers = [ddsi.DataReader(participant, topic) for _ in range(3)]
        readers.pop().close()
        assert writer.status_changes() == {ddsi.PublicationMatched}
        status = writer.status(ddsi.PublicationMatched)
        assert (status.total_count, status.total_count_change) == (3, 3)
        assert (status.current_count, status.current_count_change) == (2, 2)
        assert writer.status_changes() == frozenset()
        again = writer.status(ddsi.PublicationMatched)
        assert (again.total_count, again.total_count_change, again.current_count_change) == (3, 0, 0)
        readers.pop().close()
        status = writer.status(ddsi.PublicationMatched)
        assert (status.total_count_change, status.current_count_change) == (0, -1)


@in_trio
async def test_events_tell_their_own_change_whoever_reads_the_status(domain: int) -> None:
    async with ddsi.DomainParticipant(domain) as participant:
        topic = ddsi.Topic(participant, "Square", Shape)
        writer = ddsi.DataWriter(participant, topic)
        for _ in range(2):
            ddsi.DataReader(participant, topic)
        writer.status(ddsi.PublicationMatched)
        events = writer.events()
        assert [(await anext(events)).total_count_change for _ in range(2)] == [1, 1]  # type: ignore[union-attr]


# --- data ----------------------------------------------------------------------------------------------------------


@in_trio
async def test_data_are_a_status_of_the_reader_and_of_its_subscriber(domain: int) -> None:
    async with ddsi.DomainParticipant(domain) as participant:
        topic = ddsi.Topic(participant, "Square", Shape)
        subscriber = ddsi.Subscriber(participant)
        reader = ddsi.DataReader(subscriber, topic, RELIABLE)
        writer = ddsi.DataWriter(participant, topic, RELIABLE)
        events, group_events = reader.events(), subscriber.events()
        assert not reader.status(ddsi.DataAvailable).is_available
        assert not subscriber.status(ddsi.DataOnReaders).is_available
        for number in range(3):
            await writer.write(Shape("RED", number))
        assert await event_of_stream(events, ddsi.DataAvailable) == ddsi.DataAvailable(is_available=True)
        assert await anext(group_events) == ddsi.DataOnReaders(is_available=True)
        assert reader.status(ddsi.DataAvailable).is_available
        assert subscriber.status(ddsi.DataOnReaders).is_available
        assert reader.status_changes() == {ddsi.DataAvailable, ddsi.SubscriptionMatched, ddsi.LivelinessChanged}
        assert subscriber.status_changes() == {ddsi.DataOnReaders}
        reader.read()
        assert not reader.status(ddsi.DataAvailable).is_available
        assert not subscriber.status(ddsi.DataOnReaders).is_available


@in_trio
async def test_data_that_nobody_reads_is_one_event_and_crowds_nothing_out(domain: int) -> None:
    async with pair(domain, local=True) as p:
        events = p.reader.events()
        for number in range(2000):
            await p.writer.write(Shape("RED", number))
            if number % 100 == 0:
                p.reader.read(1)
        p.reader.close()
        assert events.dropped == 0
        kinds = [type(event) async for event in events]
        assert kinds == [ddsi.SubscriptionMatched, ddsi.LivelinessChanged, ddsi.DataAvailable]


async def event_of_stream(events: ddsi.EventStream, kind: type[S]) -> S:
    async for event in events:
        if isinstance(event, kind):
            return event
    raise AssertionError("the events have ended")
