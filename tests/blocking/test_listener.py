"""Listeners are called in a thread of their own, and may do there what they like."""

from __future__ import annotations

import logging
import queue
import threading
from typing import Any

import pytest

import ddsi
from ddsi import blocking
from ddsi.blocking.listener import _METHODS
from tests.dcps.running import RELIABLE, Shape


class Recorder(blocking.Listener):
    """Puts what it is told, with the thread's name, into a queue."""

    def __init__(self) -> None:
        self.calls: queue.Queue[tuple[str, Any, str]] = queue.Queue()

    def on_data_available(self, reader: blocking.DataReader[Shape]) -> None:
        self._note("data", [sample.data.x for sample in reader.take() if sample.info.valid_data])

    def on_subscription_matched(self, reader: object, status: ddsi.SubscriptionMatched) -> None:
        self._note("matched", status.current_count)

    def _note(self, what: str, value: object) -> None:
        self.calls.put((what, value, threading.current_thread().name))


def test_data_and_statuses_are_told_in_a_thread_of_the_listeners_own(domain: int) -> None:
    with blocking.DomainParticipant(domain) as participant:
        topic = blocking.Topic(participant, "Square", Shape)
        writer = blocking.DataWriter(participant, topic, RELIABLE)
        recorder = Recorder()
        blocking.DataReader(participant, topic, RELIABLE, listener=recorder)
        assert recorder.calls.get(timeout=5) == ("matched", 1, "ddsi listener")
        seen: list[int] = []
        writer.write_all(Shape("BLUE", number) for number in range(100))
        while len(seen) < 100:
            what, numbers, _ = recorder.calls.get(timeout=5)
            assert what == "data"
            seen += numbers
        assert seen == list(range(100))


def test_a_listener_may_write_create_and_close_its_own_entity(domain: int) -> None:
    done = threading.Event()

    class Busy(blocking.Listener):
        def on_data_available(self, reader: blocking.DataReader[Shape]) -> None:
            blocking.DataReader(participant, topic).close()
            writer.write(Shape("ANSWER"))
            reader.close()
            done.set()

    with blocking.DomainParticipant(domain) as participant:
        topic = blocking.Topic(participant, "Square", Shape)
        writer = blocking.DataWriter(participant, topic, RELIABLE)
        reader = blocking.DataReader(participant, topic, RELIABLE, listener=Busy())
        writer.write(Shape("QUESTION"))
        assert done.wait(5)
        assert reader.is_closed


def test_while_a_listener_is_busy_the_engine_and_other_threads_go_on(domain: int) -> None:
    entered, leave = threading.Event(), threading.Event()

    class Slow(blocking.Listener):
        def on_data_available(self, reader: object) -> None:
            entered.set()
            leave.wait(10)

    with blocking.DomainParticipant(domain) as participant:
        topic = blocking.Topic(participant, "Square", Shape)
        writer = blocking.DataWriter(participant, topic, RELIABLE)
        reader = blocking.DataReader(participant, topic, RELIABLE, listener=Slow())
        writer.write(Shape("BLUE", 1))
        assert entered.wait(5)
        writer.write(Shape("BLUE", 2))
        assert [sample.data.x for sample in reader.take()] == [1, 2]
        leave.set()


def test_arrivals_that_the_listener_does_not_take_are_told_once_each_time_more_comes(domain: int) -> None:
    told: queue.Queue[int] = queue.Queue()

    class Counting(blocking.Listener):
        def on_data_available(self, reader: Any) -> None:
            told.put(1)

    with blocking.DomainParticipant(domain) as participant:
        topic = blocking.Topic(participant, "Square", Shape)
        writer = blocking.DataWriter(participant, topic, RELIABLE)
        reader = blocking.DataReader(participant, topic, RELIABLE, listener=Counting())
        for number in range(3):
            writer.write(Shape("BLUE", number))
            told.get(timeout=5)
        assert told.empty()
        assert len(reader.take()) == 3


def test_what_a_listener_raises_is_logged_and_the_next_call_comes(
    domain: int, caplog: pytest.LogCaptureFixture
) -> None:
    calls: queue.Queue[str] = queue.Queue()

    class Failing(blocking.Listener):
        def on_publication_matched(self, writer: object, status: ddsi.PublicationMatched) -> None:
            calls.put("called")
            raise RuntimeError("by mistake")

    with caplog.at_level(logging.ERROR, "ddsi.blocking"), blocking.DomainParticipant(domain) as participant:
        topic = blocking.Topic(participant, "Square", Shape)
        blocking.DataWriter(participant, topic, listener=Failing())
        for _ in range(2):
            reader = blocking.DataReader(participant, topic)
            calls.get(timeout=5)
            reader.close()
            calls.get(timeout=5)
    assert "by mistake" in caplog.text


def test_a_listener_that_is_replaced_is_called_no_more(domain: int) -> None:
    old, new = Recorder(), Recorder()
    with blocking.DomainParticipant(domain) as participant:
        topic = blocking.Topic(participant, "Square", Shape)
        writer = blocking.DataWriter(participant, topic, RELIABLE)
        reader = blocking.DataReader(participant, topic, RELIABLE, listener=old)
        old.calls.get(timeout=5)
        reader.set_listener(new)
        writer.write(Shape("BLUE", 7))
        assert new.calls.get(timeout=5)[:2] == ("data", [7])
        reader.set_listener(None)
        writer.write(Shape("BLUE", 8))
        reader.wait(timeout=5)
    assert old.calls.empty()
    assert new.calls.empty()


def test_every_status_has_its_method() -> None:
    kinds = {
        kind
        for entity in (
            blocking.DomainParticipant,
            blocking.Topic,
            blocking.Subscriber,
            blocking.DataWriter,
            blocking.DataReader,
        )
        for kind in entity.STATUSES
    }
    assert kinds == {*_METHODS, ddsi.DataAvailable, ddsi.DataOnReaders}, "data have methods with one argument"
    assert all(callable(getattr(blocking.Listener, name)) for name in _METHODS.values())


def test_data_that_came_before_the_listener_and_data_on_a_subscribers_readers_are_told_too(domain: int) -> None:
    told: queue.Queue[object] = queue.Queue()

    class Telling(blocking.Listener):
        def on_data_available(self, reader: Any) -> None:
            told.put(reader)

        def on_data_on_readers(self, subscriber: Any) -> None:
            told.put(subscriber)

    with blocking.DomainParticipant(domain) as participant:
        topic = blocking.Topic(participant, "Square", Shape)
        writer = blocking.DataWriter(participant, topic, RELIABLE)
        subscriber = blocking.Subscriber(participant)
        reader = blocking.DataReader(subscriber, topic, RELIABLE)
        writer.write(Shape("BLUE", 1))
        reader.set_listener(Telling())
        assert told.get(timeout=5) is reader
        reader.set_listener(None)
        subscriber.set_listener(Telling())
        writer.write(Shape("BLUE", 2))
        assert told.get(timeout=5) is subscriber


def test_something_else_is_no_listener(domain: int) -> None:
    wrong: Any = print
    with blocking.DomainParticipant(domain) as participant, pytest.raises(ddsi.BadParameter, match="Listener"):
        participant.set_listener(wrong)
