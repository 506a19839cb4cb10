"""Sinks: JSON lines and back, a bounded memory, tee and filters."""

import io
import json

import pytest

from ddsi.structure.guid import GuidPrefix
from ddsi.structure.locator import Locator
from ddsi.trace.event import Category, MalformedTrace
from ddsi.trace.events import MessageSent, ParticipantClosed, Remark, TimerFired
from ddsi.trace.sink import JsonLinesSink, MemorySink, only, read_json_lines, tee

A, B = GuidPrefix(bytes(11) + b"\x0a"), GuidPrefix(bytes(11) + b"\x0b")
EVENTS = [
    MessageSent(0.5, A, (Locator.udp_v4("127.0.0.1", 7410),), b"RTPS"),
    TimerFired(0.75, B, "heartbeat", 0.75),
    Remark(1.0, A, "näher\nhier"),
    ParticipantClosed(2.0, B),
]


def test_json_lines_are_a_head_and_one_object_a_line() -> None:
    stream = io.StringIO()
    sink = JsonLinesSink(stream, epoch_offset=1e9)
    for event in EVENTS:
        sink(event)
    lines = stream.getvalue().splitlines()
    assert json.loads(lines[0]) == {"schema": "ddsi-trace", "version": 1, "epoch_offset": 1e9}
    assert [json.loads(line)["event"] for line in lines[1:]] == [event.NAME for event in EVENTS]
    assert stream.getvalue().isascii()
    assert list(read_json_lines(lines)) == EVENTS


def test_two_sinks_given_the_same_events_write_the_same_octets() -> None:
    first, second = io.StringIO(), io.StringIO()
    sinks = tee(JsonLinesSink(first), None, JsonLinesSink(second))
    assert sinks is not None
    for event in EVENTS:
        sinks(event)
    assert first.getvalue() == second.getvalue() != ""


@pytest.mark.parametrize(
    ("line", "why"),
    [
        ("{", "line 2 is not JSON"),
        ("[1]", "line 2 is not a JSON object"),
        ('{"now": 1}', "line 2: no event is called None"),
        ('{"event": "remark", "now": 1.0, "participant": "00"}', "line 2: event 'remark': 'participant'"),
        ('{"schema": "other", "version": 1}', "the schema is 'other'"),
        ('{"schema": "ddsi-trace", "version": 99}', "version 99 of the schema; this program reads 1"),
        ("[" * 500_000, "line 2 is not JSON"),
        (" " * 3_000_000, "line 2 is longer"),
    ],
    ids=lambda text: text[:30].strip(),
)
def test_a_broken_line_is_refused_with_its_number(line: str, why: str) -> None:
    with pytest.raises(MalformedTrace, match=why):
        list(read_json_lines(["", line]))


def test_an_event_of_a_later_version_is_skipped() -> None:
    later = '{"event": "moon_phase", "now": 1.0, "participant": "00"}'
    assert list(read_json_lines([later, json.dumps(EVENTS[3].to_json())])) == [EVENTS[3]]


def test_memory_keeps_the_newest_and_counts_the_rest() -> None:
    memory = MemorySink(max_events=3)
    for event in EVENTS:
        memory(event)
    assert list(memory) == EVENTS[1:]
    assert memory.dropped_count == 1
    assert memory.of(Remark) == [EVENTS[2]]


def test_tee_of_nothing_keeps_tracing_off() -> None:
    memory = MemorySink()
    assert tee() is None
    assert tee(None, None) is None
    assert tee(None, memory) is memory


def test_only_filters_by_category_name_and_participant() -> None:
    def passed(**wanted: object) -> list[str]:
        memory = MemorySink()
        sink = only(memory, **wanted)  # type: ignore[arg-type]
        for event in EVENTS:
            sink(event)
        return [event.NAME for event in memory]

    assert passed() == [event.NAME for event in EVENTS]
    assert passed(categories=[Category.TIMER]) == ["timer_fired"]
    assert passed(categories=["timer"], names=["remark"]) == ["timer_fired", "remark"]
    assert passed(participants=[B]) == ["timer_fired", "participant_closed"]
    assert passed(names=["remark", "timer_fired"], participants=[B]) == ["timer_fired"]
