"""RepeatFilter: what a writer that was lost repeats, and what only looks like it."""

from __future__ import annotations

from ddsi.behavior.repeats import Position, RepeatFilter
from ddsi.structure.cache_change import CacheChange, ChangeKind
from ddsi.structure.guid import Guid

WRITER = Guid(bytes(range(16)))
OTHER = Guid(bytes(range(1, 17)))


class History:
    def __init__(self) -> None:
        self.added: list[int] = []
        self.repeated: list[int] = []
        self.has_room = True

    def add(self, change: CacheChange, now: float) -> bool:
        if self.has_room:
            self.added.append(change.sequence_number)
        return self.has_room


def filtered(next_sn: int = 4, timestamp: int = 300) -> tuple[RepeatFilter, History]:
    history = History()
    repeats = RepeatFilter(history, lambda change: history.repeated.append(change.sequence_number))
    repeats.remember(WRITER, Position(next_sn, timestamp))
    return repeats, history


def change(number: int, timestamp: int, writer: Guid = WRITER) -> CacheChange:
    return CacheChange(ChangeKind.ALIVE, writer, number, b"octets", source_timestamp=timestamp)


def test_what_was_delivered_before_is_dropped_and_told() -> None:
    repeats, history = filtered()
    for number in (2, 3, 4, 5):
        assert repeats.add(change(number, 100 * number), 0.0)
    assert (history.repeated, history.added) == ([2, 3], [4, 5])


def test_a_writer_that_began_anew_is_known_by_its_time() -> None:
    """Its first number is an old one and its timestamp is not: nothing of it is dropped."""
    repeats, history = filtered()
    for number in (1, 2, 3, 4):
        repeats.add(change(number, 900 + number), 0.0)
    assert (history.repeated, history.added) == ([], [1, 2, 3, 4])


def test_other_writers_are_not_concerned() -> None:
    repeats, history = filtered()
    repeats.add(change(1, 100, OTHER), 0.0)
    assert history.added == [1]


def test_one_that_is_lost_while_it_repeats_is_remembered_where_it_was_first() -> None:
    repeats, history = filtered()
    repeats.add(change(1, 100), 0.0)
    repeats.remember(WRITER, Position(2, 100))
    repeats.add(change(3, 300), 0.0)
    assert (history.repeated, history.added) == ([1, 3], [])


def test_what_finds_no_room_is_no_repeat_when_it_comes_again() -> None:
    repeats, history = filtered()
    history.has_room = False
    assert not repeats.add(change(4, 400), 0.0)
    history.has_room = True
    assert repeats.add(change(4, 400), 0.0)
    assert history.added == [4]


def test_a_thousand_writers_are_remembered_and_then_the_oldest_is_forgotten() -> None:
    repeats, history = filtered()
    for number in range(1024):
        repeats.remember(Guid(number.to_bytes(16, "big")), Position(4, 300))
    repeats.add(change(1, 100), 0.0)
    repeats.add(change(1, 100, Guid((1023).to_bytes(16, "big"))), 0.0)
    assert (history.added, history.repeated) == ([1], [1])
