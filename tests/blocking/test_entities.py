"""ddsi.blocking: the entities as a script or a thread uses them."""

from __future__ import annotations

import gc
import queue
import threading
import weakref
from collections.abc import Callable
from typing import Annotated, Any, assert_type

import pytest

import ddsi
from ddsi import blocking, idl
from ddsi.portal.topics import TopicPortal
from tests.dcps.running import RELIABLE, Note, Shape


@idl.struct
class Plan:
    color: Annotated[str, idl.key, idl.bound(128)]
    owner: str = ""


@idl.struct
class Owned:
    color: Annotated[str, idl.key, idl.bound(128)]
    x: idl.int32
    owner: str = ""


def _threads() -> list[str]:
    return [thread.name for thread in threading.enumerate() if thread.name == "ddsi engine"]


def _in_thread(function: Callable[[], object]) -> threading.Thread:
    thread = threading.Thread(target=function)
    thread.start()
    return thread


class Pair:
    """A matched writer and reader in one participant."""

    def __init__(self, participant: blocking.DomainParticipant, qos: ddsi.Qos = RELIABLE) -> None:
        self.topic = blocking.Topic(participant, "Square", Shape)
        self.writer = blocking.DataWriter(participant, self.topic, qos)
        self.reader = blocking.DataReader(participant, self.topic, qos)
        self.writer.wait_for_matched(timeout=5)


def test_samples_go_from_a_participant_to_another_in_order(domain: int) -> None:
    with blocking.DomainParticipant(domain) as here, blocking.DomainParticipant(domain) as there:
        writer = blocking.DataWriter(here, blocking.Topic(here, "Square", Shape), RELIABLE)
        reader = blocking.DataReader(there, blocking.Topic(there, "Square", Shape), RELIABLE)
        assert_type(reader, blocking.DataReader[Shape])
        writer.wait_for_matched(timeout=5)
        reader.wait_for_matched(timeout=5)
        for number in range(300):
            writer.write(Shape("BLUE", number))
        writer.write_all(Shape("BLUE", number) for number in range(300, 600))
        seen = []
        for sample in reader:
            assert_type(sample.data, Shape)
            seen.append(sample.data.x)
            if len(seen) == 600:
                break
        assert seen == list(range(600))
        writer.wait_for_acknowledgments(timeout=5)
        writer.dispose(Shape("BLUE"))
        end = next(reader)
        assert end.info.instance_state is ddsi.InstanceState.NOT_ALIVE_DISPOSED
        writer.unregister(Shape("BLUE"))


def test_iteration_hands_out_samples_in_the_order_in_which_they_came(domain: int) -> None:
    """Not instance by instance, as take does."""
    with blocking.DomainParticipant(domain) as participant:
        pair = Pair(participant)
        pair.writer.write_all(Shape("abc"[number % 3], number) for number in range(200))
        assert [next(pair.reader).data.x for _ in range(200)] == list(range(200))


def test_what_iteration_fetched_ahead_is_handed_out_by_take_and_ends_a_wait(domain: int) -> None:
    with blocking.DomainParticipant(domain) as participant:
        pair = Pair(participant)
        pair.writer.write_all(Shape("BLUE", number) for number in range(100))
        assert next(pair.reader).data.x == 0
        pair.reader.wait(timeout=5)
        assert [sample.data.x for sample in pair.reader.take(2)] == [1, 2]
        assert next(pair.reader).data.x == 3
        assert [sample.data.x for sample in pair.reader.take()] == list(range(4, 100))
        assert pair.reader.take() == []


def test_threads_that_iterate_over_one_reader_share_its_samples_until_it_is_closed(domain: int) -> None:
    """None of them ends because another took what it had fetched."""
    with blocking.DomainParticipant(domain) as participant:
        pair = Pair(participant)
        seen: list[int] = []
        have_all = threading.Event()

        def iterate() -> None:
            for sample in pair.reader:
                seen.append(sample.data.x)
                if len(seen) == 200:
                    have_all.set()

        threads = [_in_thread(iterate) for _ in range(4)]
        for number in range(200):
            pair.writer.write(Shape("BLUE", number))
        assert have_all.wait(10)
        assert all(thread.is_alive() for thread in threads)
        pair.reader.close()
        for thread in threads:
            thread.join(10)
        assert not any(thread.is_alive() for thread in threads)
        assert sorted(seen) == list(range(200))


def test_reading_by_states_conditions_and_instances(domain: int) -> None:
    with blocking.DomainParticipant(domain) as participant:
        pair = Pair(participant)
        pair.writer.write_all([Shape("RED", 1), Shape("BLUE", 2), Shape("RED", 3)])
        red = pair.reader.lookup_instance(Shape("RED"))
        assert [sample.data.x for sample in pair.reader.read(instance=red)] == [1, 3]
        big = ddsi.ReadCondition(query=lambda shape: shape.x > 2)
        pair.reader.wait(big, timeout=5)
        assert [sample.data.x for sample in pair.reader.take(condition=big)] == [3]
        unread = pair.reader.take(sample_states=ddsi.SampleState.NOT_READ)
        assert [sample.data.x for sample in unread] == [2]
        with pytest.raises(ddsi.DdsTimeout, match="no such sample"):
            pair.reader.wait(timeout=0.01)


def test_errors_come_through_as_themselves(domain: int) -> None:
    with blocking.DomainParticipant(domain) as participant:
        pair = Pair(participant)
        with pytest.raises(ddsi.BadParameter, match="x"):
            pair.writer.write(Shape("BLUE", "no number"))  # type: ignore[arg-type]
        with pytest.raises(ddsi.DdsTimeout, match="2 reader"):
            pair.writer.wait_for_matched(2, timeout=0.01)
        with pytest.raises(ddsi.BadParameter, match="has the statuses"):
            pair.writer.status(ddsi.SubscriptionMatched)
        with pytest.raises(ddsi.InconsistentPolicy):
            blocking.DataReader(
                participant,
                pair.topic,
                ddsi.Qos(history=ddsi.KeepLast(5), resource_limits=ddsi.ResourceLimits(max_samples_per_instance=2)),
            )
        with pytest.raises(ddsi.ImmutablePolicy):
            pair.writer.set_qos(ddsi.Qos(durability=ddsi.TransientLocal()))
        pair.writer.set_qos(ddsi.Qos(user_data=ddsi.UserData(b"new")))
        assert pair.writer.qos.user_data == ddsi.UserData(b"new")
        pair.writer.close()
        pair.writer.close()
        with pytest.raises(ddsi.AlreadyDeleted):
            pair.writer.write(Shape("BLUE"))


def test_an_error_of_the_body_leaves_as_itself(domain: int) -> None:
    with pytest.raises(KeyError, match="mine"), blocking.DomainParticipant(domain):
        raise KeyError("mine")


def test_entities_of_trio_are_refused_with_a_word_on_why(domain: int) -> None:
    inner: Any = ddsi.DomainParticipant(domain)
    with pytest.raises(ddsi.BadParameter, match=r"ddsi\.blocking"):
        blocking.Topic(inner, "Square", Shape)


def test_queries_of_conditions_may_not_call_back(domain: int) -> None:
    """They run in the engine's thread, which would wait for itself for ever."""
    with blocking.DomainParticipant(domain) as participant:
        pair = Pair(participant)
        pair.writer.write(Shape("BLUE", 1))
        asking = ddsi.ReadCondition(query=lambda _shape: bool(pair.reader.take()))
        with pytest.raises(ddsi.PreconditionNotMet, match="engine's own thread"):
            pair.reader.take(condition=asking)


def test_closing_ends_what_waits_in_other_threads(domain: int) -> None:
    with blocking.DomainParticipant(domain) as participant:
        pair = Pair(participant)
        ended: list[str] = []

        def iterate() -> None:
            for _ in pair.reader:
                pass
            ended.append("iteration")

        def listen() -> None:
            for _ in pair.reader.events():
                pass
            ended.append("events")

        def wait() -> None:
            with pytest.raises(ddsi.AlreadyDeleted):
                pair.reader.wait()
            ended.append("wait")

        threads = [_in_thread(iterate), _in_thread(listen), _in_thread(wait)]
    for thread in threads:
        thread.join(5)
    assert sorted(ended) == ["events", "iteration", "wait"]


def test_events_and_statuses(domain: int) -> None:
    with blocking.DomainParticipant(domain) as participant:
        pair = Pair(participant)
        events = pair.reader.events()
        event = next(events)
        assert isinstance(event, ddsi.SubscriptionMatched)
        assert pair.reader.status(ddsi.SubscriptionMatched).current_count == 1
        pair.writer.close()
        assert isinstance(next(events), ddsi.LivelinessChanged | ddsi.SubscriptionMatched)


def test_groups_topics_and_who_is_there(domain: int) -> None:
    with blocking.DomainParticipant(domain) as here, blocking.DomainParticipant(domain) as there:
        topic = blocking.Topic(here, "Note", Note)
        assert (topic.name, topic.type, topic.type_name) == ("Note", Note, "Note")
        in_a = ddsi.Qos(partition=ddsi.Partition("a"))
        writer = blocking.DataWriter(blocking.Publisher(here, in_a), topic)
        subscriber = blocking.Subscriber(there, in_a)
        reader = blocking.DataReader(subscriber, blocking.Topic(there, "Note", Note), RELIABLE)
        reader.wait_for_matched(timeout=5)
        reader.wait_for_historical_data(timeout=5)
        assert reader.matched_publications() == [writer.guid]
        assert reader.matched_publication_data(writer.guid).topic_name == "Note"
        writer.wait_for_matched(timeout=5)
        assert writer.matched_subscriptions() == [reader.guid]
        assert writer.matched_subscription_data(reader.guid).type_name == "Note"
        builtin = blocking.BuiltinTopicReader(there, ddsi.PublicationBuiltinTopicData)
        assert_type(builtin, blocking.BuiltinTopicReader[ddsi.PublicationBuiltinTopicData])
        builtin.wait(timeout=5)
        assert [sample.data.topic_name for sample in builtin.take()] == ["Note"]
        assert [data.guid for data in there.discovered_participants()] == [here.guid]
        assert there.match_refusals() == {}
        with pytest.raises(ddsi.DdsTimeout):
            here.wait_for_discovery(timeout=0)


def test_many_threads_share_one_writer(domain: int) -> None:
    with blocking.DomainParticipant(domain) as participant:
        pair = Pair(participant)

        def write(color: str) -> None:
            for number in range(50):
                pair.writer.write(Shape(color, number))

        for thread in [_in_thread(lambda color=color: write(color)) for color in "abcd"]:  # type: ignore[misc]
            thread.join(10)
        by_color: dict[str, list[int]] = {}
        for sample in pair.reader.take():
            by_color.setdefault(sample.data.color, []).append(sample.data.x)
        assert by_color == {color: list(range(50)) for color in "abcd"}


def test_a_write_that_finds_no_room_waits_and_then_says_so(domain: int) -> None:
    qos = ddsi.Qos(
        reliability=ddsi.Reliable(max_blocking_time=0.05),
        history=ddsi.KeepAll(),
        resource_limits=ddsi.ResourceLimits(max_samples=2),
    )
    with blocking.DomainParticipant(domain) as here, blocking.DomainParticipant(domain) as there:
        writer = blocking.DataWriter(here, blocking.Topic(here, "Square", Shape), qos)
        reader = blocking.DataReader(there, blocking.Topic(there, "Square", Shape), qos)
        writer.wait_for_matched(timeout=5)
        reader.wait_for_matched(timeout=5)
        with pytest.raises(ddsi.DdsTimeout, match="max_blocking_time"):
            for number in range(10):
                writer.write(Shape("BLUE", number))


def test_one_thread_serves_all_participants_and_ends_with_the_last(domain: int) -> None:
    assert _threads() == []
    with blocking.DomainParticipant(domain) as outer:
        with blocking.DomainParticipant(domain):
            assert _threads() == ["ddsi engine"]
        assert _threads() == ["ddsi engine"]
        assert not outer.is_closed
    assert outer.is_closed
    assert _threads() == []
    outer.close()


def test_a_participant_that_cannot_be_made_leaves_no_thread(domain: int) -> None:
    with pytest.raises(ddsi.ConfigurationError):
        blocking.DomainParticipant(domain, config=ddsi.Config(interfaces=("no-such-interface",)))
    for thread in threading.enumerate():
        if thread.name == "ddsi engine":
            thread.join(5)
    assert _threads() == []


def test_a_forgotten_participant_is_closed_and_tells_of_it(domain: int) -> None:
    participant = blocking.DomainParticipant(domain)
    loop = [participant]
    loop.append(loop)  # type: ignore[arg-type]  # so that the collector decides when
    thread = next(thread for thread in threading.enumerate() if thread.name == "ddsi engine")
    gone = weakref.ref(participant)
    del participant, loop
    with pytest.warns(ResourceWarning, match="was forgotten"):
        gc.collect()
    assert gone() is None
    thread.join(5)
    assert not thread.is_alive()


def test_entities_of_a_closed_participant_say_so(domain: int) -> None:
    with blocking.DomainParticipant(domain) as participant:
        pair = Pair(participant)
    for operation in (
        lambda: pair.writer.write(Shape("BLUE")),
        pair.reader.take,
        pair.reader.wait,
        pair.writer.wait_for_matched,
        lambda: blocking.Topic(participant, "Square", Shape),
        participant.discovered_participants,
    ):
        with pytest.raises(ddsi.AlreadyDeleted):
            operation()
    assert list(pair.reader) == []
    pair.reader.close()


def test_conditions_and_wait_sets(domain: int) -> None:
    with blocking.DomainParticipant(domain) as participant:
        pair = Pair(participant)
        guard = blocking.GuardCondition(participant)
        big = blocking.QueryCondition(pair.reader, expression="x > %0", parameters=["2"])
        any_data = blocking.ReadCondition(pair.reader)
        matched = blocking.StatusCondition(pair.writer, ddsi.PublicationMatched)
        waiting = blocking.WaitSet(participant, guard, big)
        with pytest.raises(ddsi.DdsTimeout, match="2 conditions"):
            waiting.wait(timeout=0.01)
        pair.writer.write_all([Shape("RED", 1), Shape("RED", 3)])
        assert waiting.wait(timeout=5) == [big]
        assert any_data.trigger_value
        assert [sample.data.x for sample in pair.reader.take(condition=big)] == [3]
        big.set_query_parameters(["0"])
        assert big.trigger_value
        waiting.detach(big)
        setting = _in_thread(lambda: guard.set_trigger_value(True))
        assert waiting.wait(timeout=5) == [guard]
        setting.join()
        waiting.attach(matched)
        assert waiting.conditions == (guard, matched)
        assert matched.trigger_value
        assert pair.writer.status_changes() == {ddsi.PublicationMatched}
        assert pair.writer.status(ddsi.PublicationMatched).current_count_change == 1
        assert not matched.trigger_value
    with pytest.raises(ddsi.AlreadyDeleted):
        blocking.WaitSet(participant, guard)


def test_content_filters_and_instances_one_after_the_other(domain: int) -> None:
    with blocking.DomainParticipant(domain) as participant:
        topic = blocking.Topic(participant, "Square", Shape)
        only_big = blocking.ContentFilteredTopic(participant, "Big", topic, "x > %0", ["5"])
        assert_type(only_big.related_topic, TopicPortal[Shape])
        assert (only_big.filter_expression, only_big.expression_parameters) == ("x > %0", ("5",))
        reader = blocking.DataReader(participant, only_big, RELIABLE)
        assert_type(reader, blocking.DataReader[Shape])
        writer = blocking.DataWriter(participant, topic, RELIABLE)
        writer.write_all([Shape("a", 1), Shape("b", 6), Shape("c", 7)])
        only_big.set_expression_parameters(["0"])
        writer.write(Shape("a", 2))
        first = reader.read_next_instance(None)
        assert [sample.data for sample in first] == [Shape("a", 2)]
        second = reader.take_next_instance(first[0].info.instance_handle)
        assert [sample.data for sample in second] == [Shape("b", 6)]
        assert sorted(sample.data.x for sample in reader.take()) == [2, 7]


def test_coherent_sets_and_access_to_several_readers(domain: int) -> None:
    together = ddsi.Qos(presentation=ddsi.Presentation(ddsi.AccessScope.GROUP, coherent_access=True))
    with blocking.DomainParticipant(domain) as participant:
        publisher = blocking.Publisher(participant, together)
        subscriber = blocking.Subscriber(participant, together)
        topics = [blocking.Topic(participant, name, Shape) for name in ("Square", "Circle")]
        writers = [blocking.DataWriter(publisher, topic, RELIABLE) for topic in topics]
        readers = [blocking.DataReader(subscriber, topic, RELIABLE) for topic in topics]
        for writer in writers:
            writer.wait_for_matched(timeout=5)

        def numbers() -> list[int]:
            with subscriber.access():
                return [sample.data.x for reader in readers for sample in reader.take()]

        with publisher.coherent_changes():
            for number, writer in enumerate(writers):
                writer.write(Shape("BLUE", number))
            assert numbers() == []
        subscriber.wait(timeout=5)
        with subscriber.access():
            assert set(subscriber.get_datareaders()) == set(readers)
        assert numbers() == [0, 1]
        with pytest.raises(KeyError), publisher.coherent_changes():
            writers[0].write(Shape("BLUE", 9))
            raise KeyError
        assert numbers() == []
        publisher.wait_for_acknowledgments(timeout=5)
        publisher.suspend_publications()
        publisher.resume_publications()
        with pytest.raises(ddsi.PreconditionNotMet):
            publisher.end_coherent_changes()
        with pytest.raises(ddsi.DdsTimeout, match="no samples in"):
            subscriber.wait(timeout=0.01)


def test_instances_entities_and_what_is_ignored(domain: int) -> None:
    late = ddsi.Qos(entity_factory=ddsi.EntityFactory(autoenable_created_entities=False))
    with blocking.DomainParticipant(domain) as participant:
        pair = Pair(participant)
        handle = pair.writer.register_instance(Shape("BLUE"))
        assert pair.writer.lookup_instance(Shape("BLUE")) == handle
        assert pair.writer.get_key_value(handle) == Shape("BLUE")
        pair.writer.write(Shape("BLUE", 3))
        assert pair.reader.get_key_value(handle) == Shape("BLUE")
        publisher = blocking.Publisher(participant, late)
        writer = blocking.DataWriter(publisher, pair.topic, RELIABLE)
        assert (publisher.is_enabled, writer.is_enabled) == (True, False)
        writer.enable()
        assert writer.is_enabled
        assert publisher.contains_entity(writer.guid)
        assert participant.contains_entity(writer.guid)
        publisher.delete_contained_entities()
        assert writer.is_closed
        assert participant.knows_all_announced()
        with blocking.DomainParticipant(domain) as other:
            other.ignore_topic("Square")
            other.ignore_publication(pair.writer.guid)
            other.ignore_subscription(pair.reader.guid)
            ignoring = blocking.DataReader(other, blocking.Topic(other, "Square", Shape), RELIABLE)
            with pytest.raises(ddsi.DdsTimeout):
                ignoring.wait_for_matched(timeout=0.2)
        participant.delete_contained_entities()
        assert pair.reader.is_closed


def test_topics_are_joined(domain: int) -> None:
    with blocking.DomainParticipant(domain) as participant:
        shapes = blocking.DataWriter(participant, blocking.Topic(participant, "Square", Shape), RELIABLE)
        plans = blocking.DataWriter(participant, blocking.Topic(participant, "Plan", Plan), RELIABLE)
        text = "SELECT color, x, owner FROM Square NATURAL JOIN Plan WHERE x < %0"
        topic = blocking.MultiTopic(participant, "Owned", Owned, text, ["10"])
        assert (topic.name, topic.subscription_expression, topic.expression_parameters) == ("Owned", text, ("10",))
        reader = blocking.MultiTopicReader(blocking.Subscriber(participant), topic, RELIABLE)
        assert_type(reader, blocking.MultiTopicReader[Owned])
        reader.wait_for_matched(timeout=5)
        shapes.write_all([Shape("BLUE", 1), Shape("RED", 20)])
        with pytest.raises(ddsi.DdsTimeout, match="no such sample"):
            reader.wait(timeout=0.01)
        plans.write_all([Plan("BLUE", "Ada"), Plan("RED", "Bob")])
        assert next(reader).data == Owned("BLUE", 1, "Ada")
        assert reader.take() == []
        topic.set_expression_parameters(["100"])
        reader.wait(blocking.QueryCondition(reader, expression="x > 10"), timeout=5)
        assert Owned("RED", 20, "Bob") in [sample.data for sample in reader.take()]
        with pytest.raises(ddsi.BadParameter, match="has no topic 'Plans'"):
            blocking.MultiTopic(participant, "Owned", Owned, "SELECT * FROM Plans")
        inner: Any = topic._inner
        with pytest.raises(ddsi.BadParameter, match=r"ddsi\.blocking"):
            blocking.MultiTopicReader(participant, inner)
    assert list(reader) == []


def test_a_listener_is_told_when_samples_are_joined(domain: int) -> None:
    joined: queue.SimpleQueue[Owned] = queue.SimpleQueue()

    class Taking(blocking.Listener):
        def on_data_available(self, reader: blocking.MultiTopicReader[Owned]) -> None:
            for sample in reader.take():
                joined.put(sample.data)

    with blocking.DomainParticipant(domain) as participant:
        shapes = blocking.DataWriter(participant, blocking.Topic(participant, "Square", Shape), RELIABLE)
        plans = blocking.DataWriter(participant, blocking.Topic(participant, "Plan", Plan), RELIABLE)
        topic = blocking.MultiTopic(participant, "Owned", Owned, "SELECT * FROM Square NATURAL JOIN Plan")
        reader = blocking.MultiTopicReader(participant, topic, RELIABLE, listener=Taking())
        reader.wait_for_matched(timeout=5)
        plans.write(Plan("BLUE", "Ada"))
        for number in range(3):
            shapes.write(Shape("BLUE", number))
            assert joined.get(timeout=10) == Owned("BLUE", number, "Ada")


def test_a_listener_is_told_of_joined_samples_whether_it_takes_them_or_not(domain: int) -> None:
    """Also of those that are there when the reader is made."""
    told: queue.SimpleQueue[object] = queue.SimpleQueue()

    class Hearing(blocking.Listener):
        def on_data_available(self, reader: blocking.MultiTopicReader[Owned]) -> None:
            told.put(reader)

    lasting = RELIABLE | ddsi.Qos(durability=ddsi.TransientLocal())
    with blocking.DomainParticipant(domain) as participant:
        shapes = blocking.DataWriter(participant, blocking.Topic(participant, "Square", Shape), lasting)
        plans = blocking.DataWriter(participant, blocking.Topic(participant, "Plan", Plan), lasting)
        topic = blocking.MultiTopic(participant, "Owned", Owned, "SELECT * FROM Square NATURAL JOIN Plan")
        plans.write(Plan("BLUE", "Ada"))
        shapes.write(Shape("BLUE", 0))
        reader = blocking.MultiTopicReader(participant, topic, lasting, listener=Hearing())
        assert told.get(timeout=10) is reader
        for number in range(1, 4):
            shapes.write(Shape("BLUE", number))
            assert told.get(timeout=10) is reader
        assert [sample.data.x for sample in reader.take()] == [0, 1, 2, 3]
