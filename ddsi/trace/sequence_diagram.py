"""The trace as a sequence diagram for a terminal: participants are columns, time runs down, messages are arrows.

    A = 01dd0000:00000000:0000000a  ddsi "writer"
    B = 01dd0000:00000000:0000000b  ddsi "reader"

          time  A         B
      0.000000  ●         │     wrote Square #2 (24 octets)
      0.000000  ├┄┄┄┄✗    │     lost (loss): DATA Square #2
      0.000000  ├────────▶│     HEARTBEAT Square 1..2 count 2
      0.000500  │◀────────┤     ACKNACK Square base 2 missing {2} count 1

A pure function of the events.  A message that both its sender and a receiver traced is drawn once per receiver, when
it arrives; one that nobody here received is drawn when it is sent.  Whole lines are what arrives, dotted ones
what a (simulated) network does to a message.
"""

from __future__ import annotations

import textwrap
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass
from enum import Enum

from ..structure.guid import GuidPrefix
from ..structure.locator import Locator
from .describe import Describer
from .event import Category, TraceEvent
from .event_text import event_text
from .events import LinkDelayed, LinkDropped, LinkDuplicated, MessageReceived, MessageSent
from .lanes import ASCII, Lanes, Stroke
from .message_parts import Part, message_parts

__all__ = ["DEFAULT_CATEGORIES", "SequenceDiagram", "sequence_diagram"]

DEFAULT_CATEGORIES = frozenset(Category) - {Category.TIMER}
_TIME_WIDTH = 12
_MAX_PITCH, _MIN_PITCH = 10, 5
_LEAST_TEXT_WIDTH = 32
_LEAST_WIDTH = 60

_RESET, _BOLD, _DIM, _RED = "\x1b[0m", "\x1b[1m", "\x1b[2m", "\x1b[31m"
# Cyan, green, magenta, blue, yellow: one for each sender in turn.
_COLOURS = ("\x1b[36m", "\x1b[32m", "\x1b[35m", "\x1b[34m", "\x1b[33m")
_ALARMING = frozenset({"dropped", "incompatible", "topic_inconsistent", "sample_lost", "sample_rejected"})


def sequence_diagram(
    events: Iterable[TraceEvent],
    *,
    width: int = 100,
    colour: bool = False,
    ascii_only: bool = False,
    categories: Collection[Category] = DEFAULT_CATEGORIES,
    describer: Describer | None = None,
) -> Iterator[str]:
    """The lines of the diagram, a legend of the participants first.  Reads all events before it gives out the first
    line, so that columns and names are known from the top; :class:`SequenceDiagram` does without.

    ``width``: characters a line may have (text goes on below; 60 at least).  ``colour``: with ANSI escapes.
    ``ascii_only``: without box drawing.
    """
    all_events = list(events)
    describer = describer or Describer()
    drawn_later = _learn(all_events, describer)
    origin = all_events[0].now if all_events else None
    diagram = SequenceDiagram(
        width=width, colour=colour, ascii_only=ascii_only, categories=categories, describer=describer, origin=origin
    )
    yield from diagram.legend()
    for index, event in enumerate(all_events):
        if index not in drawn_later:
            yield from diagram.lines(event)


def _learn(events: Sequence[TraceEvent], describer: Describer) -> set[int]:
    """Names from all events; returns the indices of those MessageSent that are drawn by what became of them.

    A message is recognised by its octets.  The same octets may be sent again (SPDP does, each few seconds): what
    arrives belongs to the last time that they were sent.
    """
    names = describer.names
    sent_at: dict[bytes, int] = {}
    drawn_later: set[int] = set()
    for index, event in enumerate(events):
        names.learn_event(event)
        if isinstance(event, MessageSent):
            sent_at[event.octets] = index
        if isinstance(event, MessageSent | MessageReceived):
            for part in message_parts(event.octets, describer).parts:
                if part.destination != GuidPrefix.UNKNOWN:
                    names.participant(part.destination)
        if isinstance(event, MessageReceived | LinkDropped):
            is_own = isinstance(event, MessageReceived) and event.octets[8:20] == event.participant
            if event.octets in sent_at and not is_own:
                drawn_later.add(sent_at[event.octets])
    return drawn_later


class _Drawn(Enum):
    """What a row shows in the lanes."""

    EVENT = "event"
    ARRIVES = "arrives"
    DISTURBED = "disturbed"
    LOST = "lost"


@dataclass(frozen=True, slots=True)
class _Row:
    """One line to be: ``receivers`` is empty where none is known, and for what happens within one participant."""

    drawn: _Drawn
    sender: GuidPrefix
    receivers: tuple[GuidPrefix, ...]
    text: str
    alarming: bool = False


class SequenceDiagram:
    """The diagram line by line, for events as they come.

    Whenever a participant turns up that has no column yet, the columns' head is given again.  Sent messages are drawn
    when they are sent, received ones when they are received: meant for the trace of one participant.  ``origin`` is
    the ``now`` from which times are counted, that of the first event if it is not given.
    """

    def __init__(
        self,
        *,
        width: int = 100,
        colour: bool = False,
        ascii_only: bool = False,
        categories: Collection[Category] = DEFAULT_CATEGORIES,
        describer: Describer | None = None,
        origin: float | None = None,
    ) -> None:
        self._width = max(width, _LEAST_WIDTH)
        self._colour = colour
        self._ascii_only = ascii_only
        self._categories = frozenset(categories)
        self._describer = describer or Describer()
        self._names = self._describer.names
        self._origin = origin
        self._lanes = Lanes(0, _MAX_PITCH)
        self._columns: dict[GuidPrefix, int] = {}
        self._is_last_shared = False
        # Who has shown itself up to now (in the order in which it did): whom a multicast can have reached.
        self._present: dict[GuidPrefix, None] = {}

    def legend(self) -> list[str]:
        """Those who are new since the last legend, and the columns' head, which holds until the next."""
        known = list(self._names.participants)
        new = [prefix for prefix in known if prefix not in self._columns]
        gap = ("",) if self._columns else ()
        room = self._width - _TIME_WIDTH - 2 - _LEAST_TEXT_WIDTH
        count = min(len(known), room // _MIN_PITCH)
        self._lanes = Lanes(count, min(_MAX_PITCH, room // count) if count else _MAX_PITCH)
        # The last column stands for everyone beyond it.
        self._is_last_shared = count < len(known)
        self._columns = {prefix: min(index, count - 1) for index, prefix in enumerate(known)}
        letters = [self._names.letter(prefix) for prefix in known[:count]]
        if self._is_last_shared:
            letters[-1] = "…"
        who = [f"{self._names.letter(prefix)} = {prefix}  {self._names.participant(prefix)}".rstrip() for prefix in new]
        head = f"{'time':>{_TIME_WIDTH}}  {self._lanes.head(letters)}".rstrip()
        return [self._in_ascii(line) for line in (*gap, *who, "", self._styled(head, _BOLD))]

    def lines(self, event: TraceEvent) -> list[str]:
        """What this event adds: nothing if its category is not wanted, else one line or more."""
        self._names.learn_event(event)
        if self._origin is None:
            self._origin = event.now
        rows = self._rows(event)
        if event.CATEGORY not in self._categories:
            return []
        lines = self.legend() if any(self._is_new(row) for row in rows) else []
        time = f"{event.now - self._origin:.6f}"
        for row in rows:
            lines += self._laid_out(time, row)
            time = ""
        return lines

    def _is_new(self, row: _Row) -> bool:
        """Is there someone who has a letter, but no column yet?  (A flood of strangers has neither; see ``Names``.)"""
        return any(
            prefix not in self._columns and prefix in self._names.participants
            for prefix in (row.sender, *row.receivers)
        )

    def _rows(self, event: TraceEvent) -> list[_Row]:
        self._present[event.participant] = None
        match event:
            case MessageSent():
                return self._sent(event)
            case MessageReceived():
                return self._received(event)
            case LinkDropped() | LinkDelayed() | LinkDuplicated():
                return [self._disturbed(event)]
            case _:
                text = event_text(event, self._names)
                return [_Row(_Drawn.EVENT, event.participant, (), text, event.NAME in _ALARMING)]

    def _sent(self, event: MessageSent) -> list[_Row]:
        rows = []
        message = message_parts(event.octets, self._describer)
        for part in message.parts:
            receivers = self._receivers(event.participant, part, event.destinations)
            text = ", ".join(part.texts)
            if not receivers:
                text = f"to {_first_of(event.destinations)}: {text}"
            rows.append(_Row(_Drawn.ARRIVES, event.participant, receivers, text))
        return rows

    def _received(self, event: MessageReceived) -> list[_Row]:
        message = message_parts(event.octets, self._describer, receiver=event.participant)
        if message.source == GuidPrefix.UNKNOWN:
            text = f"from {event.source}: {', '.join(message.parts[0].texts)}"
            return [_Row(_Drawn.EVENT, event.participant, (), text)]
        self._present[message.source] = None
        rows = []
        for part in message.parts:
            text = ", ".join(part.texts)
            if part.destination not in (GuidPrefix.UNKNOWN, event.participant):
                text = f"for {self._names.letter(part.destination)}: {text}"
            if message.source == event.participant:
                text = f"own message: {text}"
            rows.append(_Row(_Drawn.ARRIVES, message.source, (event.participant,), text))
        return rows

    def _disturbed(self, event: LinkDropped | LinkDelayed | LinkDuplicated) -> _Row:
        message = message_parts(event.octets, self._describer)
        receivers = self._receivers(event.participant, message.parts[0], (event.destination,))
        if event.receiver is not None:
            receivers = (event.receiver,)
        text = f"{event_text(event, self._names)}: {', '.join(text for part in message.parts for text in part.texts)}"
        if isinstance(event, LinkDropped):
            return _Row(_Drawn.LOST, event.participant, receivers, text, alarming=True)
        return _Row(_Drawn.DISTURBED, event.participant, receivers, text)

    def _receivers(self, sender: GuidPrefix, part: Part, destinations: tuple[Locator, ...]) -> tuple[GuidPrefix, ...]:
        """Whom a part of a message is for, by INFO_DST, by multicast, by the addresses that peers announced."""
        if part.destination != GuidPrefix.UNKNOWN:
            return (part.destination,)
        if any(locator.is_multicast for locator in destinations):
            return tuple(prefix for prefix in self._present if prefix != sender)
        found = (self._names.participant_at(locator) for locator in destinations)
        return tuple(dict.fromkeys(prefix for prefix in found if prefix is not None and prefix != sender))

    def _laid_out(self, time: str, row: _Row) -> list[str]:
        """The row as lines: time, lanes, text; what the first has no room for goes on below."""
        last = self._lanes.count - 1
        sender = self._columns.get(row.sender, last)
        receivers = [self._columns.get(prefix, last) for prefix in row.receivers]
        lanes = self._drawn_lanes(row, sender, receivers)
        colour = _RED if row.alarming else _DIM if row.drawn is _Drawn.EVENT else _COLOURS[sender % len(_COLOURS)]
        text = row.text
        if self._is_last_shared and last in (sender, *receivers):
            whom = ",".join(self._names.letter(prefix) for prefix in row.receivers)
            text = f"{self._names.letter(row.sender)}{f' to {whom}' if whom else ''}: {text}"
        room = self._width - _TIME_WIDTH - 2 - self._lanes.width
        first, *more = textwrap.wrap(text, room, break_on_hyphens=False) or [""]
        lines = [f"{time:>{_TIME_WIDTH}}  {self._styled(lanes, colour)}{self._coloured_text(first, row)}"]
        beside = f"{'':{_TIME_WIDTH}}  {self._lanes.bars()}"
        lines += [f"{beside}{self._coloured_text(rest, row)}" for rest in more]
        return [self._in_ascii(line.rstrip()) for line in lines]

    def _drawn_lanes(self, row: _Row, sender: int, receivers: list[int]) -> str:
        match row.drawn:
            case _Drawn.EVENT:
                return self._lanes.event(sender)
            case _Drawn.ARRIVES:
                return self._lanes.arrow(sender, receivers)
            case _Drawn.DISTURBED:
                return self._lanes.arrow(sender, receivers, stroke=Stroke.DOTTED)
            case _Drawn.LOST:
                return self._lanes.lost(sender, receivers[0] if receivers else None)

    def _coloured_text(self, text: str, row: _Row) -> str:
        if row.alarming:
            return self._styled(text, _RED)
        return self._styled(text, _DIM) if row.drawn is _Drawn.EVENT else text

    def _styled(self, text: str, escape: str) -> str:
        return f"{escape}{text}{_RESET}" if self._colour and text else text

    def _in_ascii(self, line: str) -> str:
        return line.translate(ASCII).encode("ascii", "replace").decode() if self._ascii_only else line


def _first_of(destinations: tuple[Locator, ...]) -> str:
    more = f" and {len(destinations) - 1} more" if len(destinations) > 1 else ""
    return f"{destinations[0]}{more}" if destinations else "nobody"
