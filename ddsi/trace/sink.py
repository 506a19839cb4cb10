"""Where events go: a sink is any callable that takes one.

The engine holds ``trace: TraceSink | None`` and asks ``if trace is not None`` before it makes an event, so tracing
that is off costs one comparison.  A sink is called inside the engine's run: it must not call back into the engine,
and must not raise.
"""

from __future__ import annotations

import json
from collections import deque
from collections.abc import Callable, Collection, Iterable, Iterator
from typing import Protocol, TypeVar

from .event import SCHEMA_NAME, SCHEMA_VERSION, Category, MalformedTrace, TraceEvent
from .events import EVENT_TYPES, from_json

__all__ = ["JsonLinesSink", "MemorySink", "TraceSink", "only", "read_json_lines", "tee"]

TraceSink = Callable[[TraceEvent], None]

_E = TypeVar("_E", bound=TraceEvent)

_DEFAULT_MEMORY_EVENTS = 100_000
MAX_LINE_CHARACTERS = 1 << 20
"""Far above a datagram of 64 KiB in hexadecimal; what is longer is no trace."""


class TextSink(Protocol):
    """The part of a text stream that is written to."""

    def write(self, text: str, /) -> object: ...


class JsonLinesSink:
    """One JSON object a line.  The first line names the schema and its version, every other is an event.

    ``epoch_offset``: seconds to add to an event's ``now`` to get seconds since 1970; it stands in the first line, and
    is left out where there is no such thing (simulation: the trace then depends on the seed alone).
    The stream stays the caller's to flush and close.
    """

    def __init__(self, stream: TextSink, *, epoch_offset: float | None = None) -> None:
        self._stream = stream
        head: dict[str, object] = {"schema": SCHEMA_NAME, "version": SCHEMA_VERSION}
        if epoch_offset is not None:
            head["epoch_offset"] = epoch_offset
        self._write(head)

    def __call__(self, event: TraceEvent) -> None:
        self._write(event.to_json())

    def _write(self, form: dict[str, object]) -> None:
        self._stream.write(json.dumps(form, separators=(",", ":"), ensure_ascii=True, allow_nan=False) + "\n")


class MemorySink:
    """Keeps the newest ``max_events`` events, oldest first; ``dropped_count`` says how many had to go."""

    def __init__(self, max_events: int = _DEFAULT_MEMORY_EVENTS) -> None:
        self.events: deque[TraceEvent] = deque(maxlen=max_events)
        self.dropped_count = 0

    def __call__(self, event: TraceEvent) -> None:
        if len(self.events) == self.events.maxlen:
            self.dropped_count += 1
        self.events.append(event)

    def __iter__(self) -> Iterator[TraceEvent]:
        return iter(self.events)

    def __len__(self) -> int:
        return len(self.events)

    def of(self, event_type: type[_E]) -> list[_E]:
        """The events of one class, oldest first."""
        return [event for event in self.events if isinstance(event, event_type)]


def tee(*sinks: TraceSink | None) -> TraceSink | None:
    """One sink that gives every event to each; None is left out, and none at all is None (tracing stays off)."""
    present = tuple(sink for sink in sinks if sink is not None)
    if len(present) <= 1:
        return present[0] if present else None

    def give_to_all(event: TraceEvent) -> None:
        for sink in present:
            sink(event)

    return give_to_all


def only(
    sink: TraceSink,
    *,
    categories: Collection[Category | str] = (),
    names: Collection[str] = (),
    participants: Collection[bytes] = (),
) -> TraceSink:
    """A sink that passes on what is of one of these categories or has one of these names.

    Where neither is given, all pass; ``participants`` further limits whose engine the events are from.
    """
    wanted_categories, wanted_names = frozenset(categories), frozenset(names)
    wanted_participants = frozenset(participants)
    every_kind = not wanted_categories and not wanted_names

    def pass_on(event: TraceEvent) -> None:
        if wanted_participants and event.participant not in wanted_participants:
            return
        if every_kind or event.CATEGORY in wanted_categories or event.NAME in wanted_names:
            sink(event)

    return pass_on


def read_json_lines(lines: Iterable[str]) -> Iterator[TraceEvent]:
    """The events of a trace that :class:`JsonLinesSink` wrote; empty lines are skipped.

    Raises MalformedTrace with the number of the line that is not as it should be.  Events that a later version
    added are skipped: their names are unknown, but nothing else about the trace is.
    """
    for number, line in enumerate(lines, 1):
        if len(line) > MAX_LINE_CHARACTERS:
            raise MalformedTrace(f"line {number} is longer than {MAX_LINE_CHARACTERS} characters")
        if not line.strip():
            continue
        form = _parsed(line, number)
        if "schema" in form:
            _check_head(form, number)
            continue
        if isinstance(form.get("event"), str) and form["event"] not in EVENT_TYPES:
            continue
        try:
            yield from_json(form)
        except MalformedTrace as error:
            raise MalformedTrace(f"line {number}: {error}") from error


def _parsed(line: str, number: int) -> dict[str, object]:
    try:
        form = json.loads(line)
    except (ValueError, RecursionError) as error:
        raise MalformedTrace(f"line {number} is not JSON") from error
    if not isinstance(form, dict):
        raise MalformedTrace(f"line {number} is not a JSON object")
    return form


def _check_head(form: dict[str, object], number: int) -> None:
    if form["schema"] != SCHEMA_NAME:
        raise MalformedTrace(f"line {number}: the schema is {form['schema']!r:.80}, not {SCHEMA_NAME!r}")
    if form.get("version") != SCHEMA_VERSION:
        raise MalformedTrace(
            f"line {number}: version {form.get('version')!r:.80} of the schema; this program reads {SCHEMA_VERSION}"
        )
