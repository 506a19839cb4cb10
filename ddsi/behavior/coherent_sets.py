"""CoherentSets: keeps what belongs to a coherent set from a reader's history until the set is whole.

DDS 1.4 §2.2.3.6 (PRESENTATION, coherent_access), RTPS 2.5 §8.7.6 (Coherent Sets).  A set is what one writer wrote
between the beginning and the end of coherent changes; a reader that asks for coherent access sees all of it or nothing.

It stands between a :class:`.stateful_reader.StatefulReader`, which hands it the changes of each writer in the order
of their numbers, and the history.  So a set needs no order of its own: it begins with the change whose number all its
members bear, and it ends with whatever the writer sends that does not belong to it: a change of the next set, one of no
set, or a change without a sample that says so.  It is whole if no number is missing in between.  What a filter kept
from this reader is not missing; what was lost, or taken out of the writer's history before it came, is, and then
nothing of the set is ever seen.  Nor is it where the writer is gone before the end.

What a set may hold is bounded, as nobody knows whether a stranger will ever end the one that he began.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from ..structure.cache_change import CacheChange
from ..structure.guid import Guid
from ..structure.sequence_number import NumberSet
from .reader_history_cache import ReaderHistoryCache

__all__ = ["OCTETS_BESIDE_PAYLOAD", "CoherentSets", "MakeVisible", "Outlet", "Part", "WhenLost"]

OCTETS_BESIDE_PAYLOAD = 256
"""What a change that waits costs besides its payload: empty ones are bounded too."""

_MAX_FILTERED_RANGES = 256

WhenLost = Callable[[Guid, int, int, str], None]
"""Told of samples that came and will never be seen: their writer, the first number, how many, and why."""


class _Sink(Protocol):
    def add(self, change: CacheChange, now: float) -> bool: ...


class Part:
    """What one writer has written of a set so far.

    ``flaw``: why it will never be whole; then nothing of it is kept.
    """

    __slots__ = ("changes", "first", "flaw", "lost_count", "next_sn", "octets")

    def __init__(self, first: CacheChange) -> None:
        assert first.coherence is not None
        self.first = first
        self.changes: list[CacheChange] = []
        self.octets = 0
        self.next_sn = first.coherence.set_sn
        self.flaw = ""
        self.lost_count = 0

    @property
    def set_sn(self) -> int:
        """The number by which its members know each other."""
        assert self.first.coherence is not None
        return self.first.coherence.set_sn

    @property
    def group_set_sn(self) -> int:
        """The number by which the parts of all writers know each other; 0 where there is none."""
        assert self.first.coherence is not None
        return self.first.coherence.group_set_sn

    def spoil(self, flaw: str) -> None:
        """It will never be whole."""
        if not self.flaw:
            self.flaw = flaw
            self.lost_count += len(self.changes)
            self.changes.clear()
            self.octets = 0


class Outlet(Protocol):
    """Where samples and whole sets go.  What returns False finds no room and is asked for again with the same."""

    def sample(self, change: CacheChange, now: float) -> bool:
        """A change that belongs to no set."""
        ...

    def begun(self, part: Part, now: float) -> None:
        """A writer has begun a part."""
        ...

    def complete(self, part: Part, end: CacheChange, now: float) -> bool:
        """A part is whole: ``end`` is what ended it, a mark or the first change behind it."""
        ...

    def spoilt(self, part: Part, end: CacheChange | None, now: float) -> None:
        """A part was not whole when it ended; None: its writer is gone, or how it ended is not known."""
        ...

    def nothing(self, end: CacheChange, now: float) -> bool:
        """A mark that ends no part: its writer wrote nothing in the set, or a filter kept all of it away."""
        ...


class MakeVisible:
    """The Outlet where access scope is TOPIC: each writer's part is the whole set, and goes into the history."""

    def __init__(self, history: ReaderHistoryCache, sink: _Sink) -> None:
        """``sink`` leads to the history, by way of whoever wants to know of what enters it."""
        self._history = history
        self._sink = sink

    def sample(self, change: CacheChange, now: float) -> bool:
        return self._sink.add(change, now)

    def begun(self, part: Part, now: float) -> None:
        pass

    def complete(self, part: Part, end: CacheChange, now: float) -> bool:
        """All of it, or nothing of it: where there is no room for all, all waits, or is rejected."""
        limit = self._history.lacks_room_for(part.changes)
        if limit is not None:
            return self._history.no_room_for(part.changes, limit)
        for change in part.changes:
            self._sink.add(change, now)
        return True

    def spoilt(self, part: Part, end: CacheChange | None, now: float) -> None:
        pass

    def nothing(self, end: CacheChange, now: float) -> bool:
        return True


class CoherentSets:
    """A ChangeSink; one for each reader that asks for coherent access beyond single instances, or for group order."""

    def __init__(self, outlet: Outlet, *, assembles: bool, max_octets: int, on_lost: WhenLost) -> None:
        """``assembles``: sets are kept together; else all that matters is the order, which is the outlet's affair.

        ``max_octets``: what unfinished sets of all writers may hold together.
        """
        self._outlet = outlet
        self._assembles = assembles
        self._max_octets = max_octets
        self._on_lost = on_lost
        self._parts: dict[Guid, Part] = {}
        # Numbers that a writer sent to others only: [start, end), ascending as they came.
        self._filtered: dict[Guid, list[tuple[int, int]]] = {}
        self.octets = 0

    def __repr__(self) -> str:
        return f"<CoherentSets {len(self._parts)} begun, {self.octets} octets>"

    @property
    def begun_count(self) -> int:
        """How many writers have begun a set and not ended it."""
        return len(self._parts)

    # --- what comes in -----------------------------------------------------------------------------------

    def add(self, change: CacheChange, now: float) -> bool:
        """One change, in its writer's order; False when it has to wait for room, and will be given again."""
        coherence = change.coherence
        set_sn = coherence.set_sn if coherence is not None and not coherence.is_end and self._assembles else 0
        part = self._parts.get(change.writer_guid)
        if part is None:
            if set_sn:
                self._begin(change, now)
                return True
            return self._outlet.sample(change, now) if not change.is_end_of_set else self._outlet.nothing(change, now)
        if part.set_sn == set_sn:
            self._hold(part, change)
            return True
        if not self._end(part, change, now):
            return False
        return change.is_end_of_set or self.add(change, now)

    def filtered(self, writer: Guid, start: int, end: int) -> None:
        """The writer has numbers in [start, end) that are for others: not missing."""
        ranges = self._filtered.setdefault(writer, [])
        ranges.append((start, end))
        if len(ranges) > _MAX_FILTERED_RANGES:
            del ranges[0]  # a set that needed it will not be whole: rather that than without a bound

    def gap_received(self, writer: Guid, start: int, numbers: NumberSet, filtered_count: int) -> None:
        """A GAP over [start, base) and the members, so many of which a filter kept away.  RTPS 2.5 §8.3.8.4.

        Where that is not all of them nobody can tell which: then all count as missing.
        """
        if filtered_count == max(numbers.base - start, 0) + len(list(numbers)):
            self.filtered(writer, start, numbers.base)
            for number in numbers:
                self.filtered(writer, number, number + 1)

    def passed(self, writer: Guid, next_sn: int, now: float) -> None:
        """Below ``next_sn`` nothing more will come.  A part of which a number is missing there need not wait for what
        ends it: that may be missing too, and the writer silent from now on."""
        part = self._parts.get(writer)
        if part is not None and part.next_sn < next_sn and not self._are_filtered(writer, part.next_sn, next_sn):
            self._spoil(part, f"number {part.next_sn} of its coherent set is missing")
            self._give_up(part, None, now)

    def writer_unmatched(self, writer: Guid, now: float) -> None:
        """The writer is gone: what it has begun will never be whole."""
        self._filtered.pop(writer, None)
        part = self._parts.get(writer)
        if part is not None:
            self._spoil(part, "its writer was gone before the end of its coherent set")
            self._give_up(part, None, now)

    # --- parts -------------------------------------------------------------------------------------------

    def _begin(self, change: CacheChange, now: float) -> None:
        part = self._parts[change.writer_guid] = Part(change)
        self._outlet.begun(part, now)
        self._hold(part, change)

    def _hold(self, part: Part, change: CacheChange) -> None:
        self._count_numbers(part, change)
        if part.flaw:
            part.lost_count += 1
            return
        octets = len(change.payload) + OCTETS_BESIDE_PAYLOAD
        if self.octets + octets > self._max_octets:
            self._spoil(part, f"its coherent set holds more than {self._max_octets} octets")
            part.lost_count += 1
            return
        part.changes.append(change)
        part.octets += octets
        self.octets += octets

    def _count_numbers(self, part: Part, change: CacheChange) -> None:
        """Everything up to this change must have come, or be for others."""
        number = change.sequence_number
        if (
            number != part.next_sn
            and not part.flaw
            and not self._are_filtered(change.writer_guid, part.next_sn, number)
        ):
            self._spoil(part, f"number {part.next_sn} of its coherent set is missing")
        part.next_sn = number + 1

    def _spoil(self, part: Part, flaw: str) -> None:
        self.octets -= part.octets
        part.spoil(flaw)

    def _are_filtered(self, writer: Guid, start: int, end: int) -> bool:
        """Are all numbers in [start, end) for others?"""
        if end < start:
            return False
        for first, past in sorted(self._filtered.get(writer, ())):
            if first <= start < past:
                start = past
        return start >= end

    def _end(self, part: Part, end: CacheChange, now: float) -> bool:
        next_sn = part.next_sn
        self._count_numbers(part, end)
        if part.flaw:
            self._give_up(part, end, now)
        elif not self._outlet.complete(part, end, now):
            part.next_sn = next_sn
            return False
        else:
            self._forget(part)
        ranges = self._filtered.get(end.writer_guid)
        if ranges is not None:
            self._filtered[end.writer_guid] = [kept for kept in ranges if kept[1] > next_sn]
        return True

    def _give_up(self, part: Part, end: CacheChange | None, now: float) -> None:
        self._outlet.spoilt(part, end, now)
        self._forget(part)
        self._on_lost(part.first.writer_guid, part.first.sequence_number, part.lost_count, part.flaw)

    def _forget(self, part: Part) -> None:
        del self._parts[part.first.writer_guid]
        self.octets -= part.octets
