"""``ddsi trace``: watch what goes over the wire, record it, or draw a recording.

A participant of its own hears discovery and whatever is sent to its groups.  What an application exchanges, the
application can record itself: ``DDSI_URI`` has ``Tracing``.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterable, Iterator
from contextlib import ExitStack
from dataclasses import replace
from functools import partial
from itertools import islice
from typing import BinaryIO, Protocol

import trio

from ..config.environment import load_config
from ..dcps import DomainParticipant
from ..structure.qos import Qos
from ..trace.event import Category, TraceEvent
from ..trace.sequence_diagram import DEFAULT_CATEGORIES, SequenceDiagram, sequence_diagram
from .arguments import add_domain, count, seconds
from .exit_status import CommandError, ExitStatus
from .runner import run as run_async
from .terminal import can_print, terminal_width, uses_colour
from .trace_source import TraceSource
from .trace_text import TraceText

__all__ = ["SUMMARY", "add_arguments", "categories", "run"]

SUMMARY = "watch or record what goes over the wire, or draw a recording"

_QUEUED_EVENTS = 10_000
_FOLLOW_S = 0.1
_CAPTURE_SUFFIXES = (".pcapng", ".pcap")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "file",
        nargs="?",
        metavar="FILE",
        help="a recording (JSON lines, pcap, pcapng; - for standard input); without: watch",
    )
    add_domain(parser)
    parser.add_argument(
        "--record", metavar="FILE", help="write there instead: .pcapng, else JSON lines (- for standard output)"
    )
    parser.add_argument(
        "--time", type=seconds, metavar="SECONDS", help="watch or record for so long (default: until Ctrl+C)"
    )
    parser.add_argument("--follow", action="store_true", help="FILE grows: go on as it does, until Ctrl+C")
    parser.add_argument("--limit", type=count, metavar="N", help="at most so many events of FILE")
    drawing = parser.add_argument_group("drawing")
    drawing.add_argument("--text", action="store_true", help="a line for each event instead of a sequence diagram")
    drawing.add_argument("--only", type=categories, default=DEFAULT_CATEGORIES, metavar="NAMES",
                         help=f"categories, of {', '.join(Category)}; default: all but timer")  # fmt: skip
    drawing.add_argument("--ascii", action="store_true", help="no box drawing")
    drawing.add_argument("--width", type=count, metavar="N", help="characters of a line (default: the terminal's)")


def categories(text: str) -> frozenset[Category]:
    try:
        return frozenset(Category(name) for name in text.split(","))
    except ValueError:
        raise argparse.ArgumentTypeError(f"categories are {', '.join(Category)}, not {text!r}") from None


def run(arguments: argparse.Namespace) -> int:
    if arguments.file is None:
        if arguments.follow or arguments.limit:
            raise CommandError("--follow and --limit are for a FILE")
        if arguments.record is not None:
            return run_async(partial(_record, arguments))
        return run_async(partial(_watch, arguments))
    if arguments.record is not None:
        raise CommandError("--record is for a domain, not for a FILE that is a recording already")
    with ExitStack() as files:
        stream = sys.stdin.buffer if arguments.file == "-" else files.enter_context(open(arguments.file, "rb"))
        if arguments.follow:
            return run_async(partial(_follow, arguments, stream))
        return _draw(arguments, stream)


# --- a domain ----------------------------------------------------------------------------------------------------


async def _record(arguments: argparse.Namespace) -> int:
    config = load_config(arguments.domain)
    if arguments.record == "-":
        config = replace(config, trace_file="stdout", pcap_file="")
    elif arguments.record.endswith(_CAPTURE_SUFFIXES):
        config = replace(config, trace_file="", pcap_file=arguments.record)
    else:
        config = replace(config, trace_file=arguments.record, trace_append=False, pcap_file="")
    async with DomainParticipant(arguments.domain, config=config, qos=_NAME):
        until = f"for {arguments.time:g} s" if arguments.time else "until Ctrl+C"
        print(f"ddsi trace: recording domain {arguments.domain} to {arguments.record} {until}", file=sys.stderr)
        await _for_a_while(arguments)
    return ExitStatus.OK


async def _watch(arguments: argparse.Namespace) -> int:
    """Events wait in a queue while they are drawn: a sink is called inside the engine, which must not wait."""
    send, receive = trio.open_memory_channel[TraceEvent](_QUEUED_EVENTS)
    missed = 0

    def put(event: TraceEvent) -> None:
        nonlocal missed
        try:
            send.send_nowait(event)
        except trio.WouldBlock:
            missed += 1

    drawing = _drawing(arguments)
    async with trio.open_nursery() as nursery:

        async def draw() -> None:
            async for event in receive:
                _print(drawing.lines(event))

        nursery.start_soon(draw)
        async with DomainParticipant(arguments.domain, trace=put, qos=_NAME):
            await _for_a_while(arguments)
        send.close()
    if missed:
        print(f"ddsi trace: {missed} events came faster than they could be drawn", file=sys.stderr)
    return ExitStatus.OK


async def _for_a_while(arguments: argparse.Namespace) -> None:
    if arguments.time is None:
        await trio.sleep_forever()
    await trio.sleep(arguments.time)


_NAME = Qos(entity_name="ddsi trace")

# --- a file ------------------------------------------------------------------------------------------------------


def _draw(arguments: argparse.Namespace, stream: BinaryIO) -> int:
    """The whole file.  Where it is broken, what stands before is drawn all the same."""
    source = TraceSource(stream, arguments.file)
    events, failure = _all_of(islice(source.events(), arguments.limit))
    if arguments.text:
        text = TraceText(arguments.only)
        for event in events:
            _print(text.lines(event), flush=False)
    else:
        _print(
            sequence_diagram(
                events,
                width=arguments.width or terminal_width(),
                colour=uses_colour(),
                ascii_only=_wants_ascii(arguments),
                categories=arguments.only,
            ),
            flush=False,
        )
    if failure is not None:
        raise failure
    return ExitStatus.OK


def _all_of(events: Iterator[TraceEvent]) -> tuple[list[TraceEvent], CommandError | None]:
    found: list[TraceEvent] = []
    try:
        found.extend(events)
    except CommandError as error:
        return found, error
    return found, None


async def _follow(arguments: argparse.Namespace, stream: BinaryIO) -> int:
    """In a thread, as reading a file blocks; at its end the thread waits through the loop, which can be cancelled."""

    def wait() -> None:
        trio.from_thread.run(trio.sleep, _FOLLOW_S)

    def draw() -> None:
        drawing = _drawing(arguments)
        for event in islice(TraceSource(stream, arguments.file, wait).events(), arguments.limit):
            trio.from_thread.check_cancelled()
            _print(drawing.lines(event))

    # A pipe may be silent for ever in a read that nobody can end: that thread is left behind.
    await trio.to_thread.run_sync(draw, abandon_on_cancel=not stream.seekable())
    return ExitStatus.OK


# --- drawing -----------------------------------------------------------------------------------------------------


class _Drawing(Protocol):
    def lines(self, event: TraceEvent, /) -> list[str]: ...


def _drawing(arguments: argparse.Namespace) -> _Drawing:
    if arguments.text:
        return TraceText(arguments.only)
    return SequenceDiagram(
        width=arguments.width or terminal_width(),
        colour=uses_colour(),
        ascii_only=_wants_ascii(arguments),
        categories=arguments.only,
    )


def _wants_ascii(arguments: argparse.Namespace) -> bool:
    return bool(arguments.ascii) or not can_print("├┄●✗▶")


def _print(lines: Iterable[str], *, flush: bool = True) -> None:
    for line in lines:
        print(line, flush=flush)
