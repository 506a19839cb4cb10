"""Repeats: what a writer that was lost sends again when it is back, and a reader has already delivered.

RTPS 2.5 §8.4.10 knows a match that ended no more: when the lease of a participant runs out (a cable was pulled, a
process stood still) and it is heard again, or when a writer and a reader part and meet again by a new partition, its
writers are matched as if they were new, and those that keep history send it all once more.  To the application these
would be the same samples twice.  So a reader remembers of each writer that it lost how far it had come, and drops what
lies before.

A number alone does not tell a repeat from a sample of a writer that has restarted under its old GUID (stacks that make
it of host and process number do so, in containers each time) and counts from 1 again.  Its samples are later ones, so
the source timestamp of the last sample delivered decides.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from ..structure.cache_change import CacheChange
from ..structure.dataclass import dataclass
from ..structure.guid import Guid

__all__ = ["Position", "RepeatFilter"]

_MAX_WRITERS = 1024


@dataclass(frozen=True, slots=True)
class Position:
    """How far a reader had come: the number whose turn it was, and the source timestamp of the last one delivered.

    ``is_forgotten``: the writer knows the reader no more either, so it tells all that it keeps.
    """

    next_sn: int
    timestamp: int
    is_forgotten: bool = False


class _Sink(Protocol):
    def add(self, change: CacheChange, now: float) -> bool: ...


class RepeatFilter:
    """A ChangeSink before the history of a reader that has lost writers; remembers of 1024 at most.

    What is dropped counts as delivered, but still says that its writer writes the instance: it goes to ``on_repeat``.
    """

    __slots__ = ("_history", "_on_repeat", "_positions")

    def __init__(self, history: _Sink, on_repeat: Callable[[CacheChange], None]) -> None:
        self._history = history
        self._on_repeat = on_repeat
        self._positions: dict[bytes, Position] = {}

    def remember(self, writer: Guid, position: Position) -> None:
        """The writer was lost there.  One that was lost again while it repeated was farther the first time."""
        known = self._positions.pop(writer, None)
        if known is not None and known.next_sn > position.next_sn:
            position = known
        while len(self._positions) >= _MAX_WRITERS:
            del self._positions[next(iter(self._positions))]
        self._positions[writer] = position

    def position_of(self, writer: Guid) -> Position | None:
        """Where the reader had come with a writer that it has lost, and that has sent nothing new since."""
        return self._positions.get(writer)

    def add(self, change: CacheChange, now: float) -> bool:
        position = self._positions.get(change.writer_guid)
        if position is not None:
            if change.sequence_number < position.next_sn and change.source_timestamp <= position.timestamp:
                self._on_repeat(change)
                return True
            # It goes on where it was, or has begun anew.
            del self._positions[change.writer_guid]
        return self._history.add(change, now)
