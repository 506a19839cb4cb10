"""What a reader's history lets in, and how long it stays: OWNERSHIP, TIME_BASED_FILTER, LIFESPAN, DEADLINE."""

from __future__ import annotations

import math

import pytest

from ddsi.behavior.reader_history_cache import ReaderHistoryCache
from ddsi.structure.cache_change import CacheChange, ChangeKind
from ddsi.structure.guid import Guid
from ddsi.structure.qos import Qos, reader_qos, writer_qos
from ddsi.structure.qos_policies import (
    BestEffort,
    Deadline,
    Exclusive,
    KeepAll,
    Lifespan,
    OwnershipStrength,
    Reliable,
    ResourceLimits,
    TimeBasedFilter,
)
from ddsi.structure.sample_info import InstanceState
from ddsi.structure.time import TICKS_PER_SECOND
from tests.behavior.builders import guid

WEAK, STRONG, EQUAL = guid(1), guid(2), guid(3)
ALIVE, DISPOSE, UNREGISTER = ChangeKind.ALIVE, ChangeKind.NOT_ALIVE_DISPOSED, ChangeKind.NOT_ALIVE_UNREGISTERED
WALL = 1_700_000_000.0


class Cache(ReaderHistoryCache):
    """A cache whose wall clock stands WALL seconds ahead of the engine's, unless it is set; it notes its timer."""

    def __init__(self, qos: Qos) -> None:
        self.due = math.inf
        self.wall_offset = WALL
        self._number = 0
        super().__init__(
            reader_qos(Qos(history=KeepAll(), reliability=Reliable()) | qos),
            max_octets=1 << 20,
            max_instances=100,
            on_timer=self._set_timer,
            wall_time=lambda now: now + self.wall_offset,
        )

    def _set_timer(self, due: float) -> None:
        self.due = due

    def match(self, writer: Guid, **policies: object) -> None:
        self.writer_matched(writer, writer_qos(Qos(**policies)))  # type: ignore[arg-type]

    def put(
        self,
        now: float,
        *,
        by: Guid = WEAK,
        key: bytes = b"k",
        kind: ChangeKind = ALIVE,
        written: float | None = None,
    ) -> bool:
        """``written``: when it was written, in the engine's seconds; now."""
        self._number += 1
        change = CacheChange(kind, by, self._number, b"data" if kind is ALIVE else b"", key)
        change.source_timestamp = int((WALL + (now if written is None else written)) * TICKS_PER_SECOND)
        return self.add(change, now)

    def numbers(self) -> list[int]:
        return [change.sequence_number for info, change in self.take() if info.valid_data]

    def state(self, key: bytes = b"k") -> InstanceState:
        return self.instances[key].state

    def ring(self, now: float) -> list[bytes]:
        self.due = math.inf
        return self.handle_timeout(now)


# --- ownership -------------------------------------------------------------------------------------------


def _owned(*, strong: int = 2, equal: int = 2) -> Cache:
    cache = Cache(Qos(ownership=Exclusive()))
    for writer, strength in ((WEAK, 1), (STRONG, strong), (EQUAL, equal)):
        cache.match(writer, ownership=Exclusive(), ownership_strength=OwnershipStrength(strength))
    return cache


def test_the_stronger_writer_takes_an_instance_over_and_keeps_it() -> None:
    cache = _owned()
    for writer in (WEAK, WEAK, STRONG, WEAK, STRONG):
        assert cache.put(1.0, by=writer), "what is not let in has been received all the same"
    assert cache.numbers() == [1, 2, 3, 5]


def test_each_instance_has_an_owner_of_its_own() -> None:
    cache = _owned()
    cache.put(1.0, by=STRONG, key=b"a")
    cache.put(1.0, by=WEAK, key=b"b")
    assert cache.numbers() == [1, 2]


def test_of_equally_strong_writers_the_lower_guid_owns() -> None:
    cache = _owned()
    for writer in (EQUAL, STRONG, EQUAL):
        cache.put(1.0, by=writer)
    assert cache.numbers() == [1, 2]


@pytest.mark.parametrize("end", ["unregistered", "lost", "unmatched"])
def test_the_next_strongest_takes_over_when_the_owner_is_gone(end: str) -> None:
    cache = _owned()
    cache.put(1.0, by=WEAK)
    cache.put(1.0, by=STRONG)
    match end:
        case "unregistered":
            cache.put(2.0, by=STRONG, kind=UNREGISTER)
        case "lost":
            cache.writer_lost(STRONG, 2.0)
        case _:
            cache.writer_unmatched(STRONG, 2.0)
    cache.put(3.0, by=WEAK)
    assert [(info.valid_data, info.instance_state) for info, _ in cache.take()] == [(True, InstanceState.ALIVE)] * 3


def test_a_writer_that_grows_stronger_takes_over() -> None:
    cache = _owned()
    cache.put(1.0, by=STRONG)
    cache.match(WEAK, ownership=Exclusive(), ownership_strength=OwnershipStrength(9))
    cache.put(1.0, by=WEAK)
    cache.put(1.0, by=STRONG)
    assert cache.numbers() == [1, 2]


def test_only_the_owner_disposes() -> None:
    cache = _owned()
    cache.put(1.0, by=STRONG)
    cache.put(1.0, by=WEAK, kind=DISPOSE)
    assert cache.state() is InstanceState.ALIVE
    cache.put(1.0, by=STRONG, kind=DISPOSE)
    assert cache.state() is InstanceState.NOT_ALIVE_DISPOSED


def test_an_instance_lives_as_long_as_somebody_writes_it_be_it_in_vain() -> None:
    cache = _owned()
    cache.put(1.0, by=STRONG)
    cache.put(1.0, by=WEAK)
    cache.put(1.0, by=STRONG, kind=UNREGISTER)
    assert cache.state() is InstanceState.ALIVE
    cache.writer_unmatched(WEAK, 2.0)
    assert cache.state() is InstanceState.NOT_ALIVE_NO_WRITERS


def test_an_owner_that_misses_its_deadline_loses_the_instance() -> None:
    cache = Cache(Qos(ownership=Exclusive(), deadline=Deadline(1.0)))
    cache.match(WEAK, ownership=Exclusive(), ownership_strength=OwnershipStrength(1))
    cache.match(STRONG, ownership=Exclusive(), ownership_strength=OwnershipStrength(2))
    cache.put(0.0, by=STRONG)
    cache.put(0.5, by=WEAK)
    assert cache.ring(1.0) == [b"k"]
    cache.put(1.1, by=WEAK)
    assert cache.numbers() == [1, 3]


# --- time-based filter -----------------------------------------------------------------------------------


def test_of_what_comes_too_soon_nothing_is_let_in() -> None:
    cache = Cache(Qos(time_based_filter=TimeBasedFilter(1.0)))
    for now in (0.0, 0.5, 0.9, 1.0, 1.9, 2.0):
        cache.put(now)
    assert cache.numbers() == [1, 4, 6]


FILTERED = Qos(time_based_filter=TimeBasedFilter(1.0))


def test_the_last_of_what_came_too_soon_is_let_in_when_nothing_follows() -> None:
    """DDS 1.4 §2.2.3.12: where writing pauses, a reliable reader gets the last sample after all."""
    cache = Cache(FILTERED)
    for now in (0.0, 0.5, 0.9):
        cache.put(now)
    cache.ring(1.8)
    assert cache.numbers() == [1]
    cache.ring(1.9)
    assert cache.numbers() == [3]
    cache.put(2.5)
    cache.ring(9.0)
    assert cache.numbers() == [4]
    cache.ring(20.0)
    assert cache.numbers() == []


def test_a_best_effort_reader_is_promised_no_last_sample() -> None:
    cache = Cache(FILTERED | Qos(reliability=BestEffort()))
    cache.put(0.0)
    cache.put(0.5)
    cache.ring(9.0)
    assert cache.numbers() == [1]


@pytest.mark.parametrize("kind", [DISPOSE, ChangeKind.ALIVE])
def test_what_was_held_back_does_not_come_behind_what_followed_it(kind: ChangeKind) -> None:
    cache = Cache(FILTERED)
    cache.put(0.0)
    cache.put(0.5)
    cache.put(1.2, kind=kind)
    cache.ring(9.0)
    assert [change.sequence_number for _, change in cache.take()] == [1, 3]


def test_what_is_held_back_waits_for_room_and_ends_with_its_life() -> None:
    limits = ResourceLimits(max_samples=1, max_instances=1, max_samples_per_instance=1)
    cache = Cache(FILTERED | Qos(resource_limits=limits))
    cache.put(0.0)
    cache.put(0.5)
    cache.ring(1.5)
    assert cache.numbers() == [1]
    cache.ring(2.5)
    assert cache.numbers() == [2]


def test_instances_are_filtered_each_for_itself_and_ends_never() -> None:
    cache = Cache(Qos(time_based_filter=TimeBasedFilter(1.0)))
    cache.put(0.0, key=b"a")
    cache.put(0.1, key=b"b")
    cache.put(0.2, key=b"a", kind=DISPOSE)
    assert cache.state(b"a") is InstanceState.NOT_ALIVE_DISPOSED
    cache.put(0.3, key=b"a")
    assert cache.state(b"a") is InstanceState.ALIVE, "a new life begins at once"
    assert sorted(cache.numbers()) == [1, 2, 4]


def test_a_sample_that_waited_for_room_is_let_in_when_there_is_some() -> None:
    """The second question about the same sample gets the same answer."""
    limits = ResourceLimits(max_samples=1, max_instances=1, max_samples_per_instance=1)
    cache = Cache(Qos(time_based_filter=TimeBasedFilter(1.0), resource_limits=limits))
    assert cache.put(0.0)
    assert not cache.put(1.0)
    assert cache.numbers() == [1]
    assert cache.put(1.1)
    assert cache.numbers() == [3]


# --- lifespan --------------------------------------------------------------------------------------------


def test_a_sample_leaves_when_its_life_is_over() -> None:
    cache = Cache(Qos())
    cache.match(WEAK, lifespan=Lifespan(1.0))
    cache.put(0.0)
    cache.put(0.5)
    assert cache.due == pytest.approx(1.0)
    cache.ring(1.001)
    assert cache.due == pytest.approx(1.5)
    assert (len(cache), cache.octets) == (1, 4)
    assert cache.numbers() == [2]
    assert cache.ring(2.0) == [], "it was taken before"


def test_what_was_on_its_way_too_long_is_not_let_in() -> None:
    cache = Cache(Qos())
    cache.match(WEAK, lifespan=Lifespan(1.0))
    cache.put(5.0, written=3.9)
    cache.put(5.0, written=4.5)
    assert cache.numbers() == [2]
    assert cache.due == pytest.approx(5.5)


def test_a_writer_whose_clock_goes_ahead_gains_nothing() -> None:
    cache = Cache(Qos())
    cache.match(WEAK, lifespan=Lifespan(1.0))
    cache.put(0.0, written=1000.0)
    assert cache.due == pytest.approx(1.0)


def test_a_wall_clock_that_is_set_does_not_end_everything() -> None:
    cache = Cache(Qos())
    cache.match(WEAK, lifespan=Lifespan(1.0))
    cache.wall_offset -= 3600.0
    cache.put(7200.0, written=7200.0 - 3600.0)
    assert cache.numbers() == [1]


def test_samples_of_a_writer_without_a_lifespan_stay() -> None:
    cache = Cache(Qos())
    cache.match(WEAK, lifespan=Lifespan(1.0))
    cache.put(0.0, by=STRONG, written=-100.0)
    cache.ring(50.0)
    assert cache.numbers() == [1]


def test_what_was_taken_is_not_kept_until_it_expires() -> None:
    cache = Cache(Qos())
    cache.match(WEAK, lifespan=Lifespan(3600.0))
    for number in range(1000):
        cache.put(number / 100)
        cache.take_next()
    assert cache._gate.expiring < 100


# --- deadline --------------------------------------------------------------------------------------------


def test_instances_that_are_silent_for_too_long_are_told_by_key() -> None:
    cache = Cache(Qos(deadline=Deadline(2.0)))
    cache.put(0.0, key=b"a")
    cache.put(1.0, key=b"b")
    assert cache.due == 2.0
    assert cache.ring(2.0) == [b"a"]
    assert cache.due == 3.0
    cache.put(2.9, key=b"b")
    assert cache.ring(3.0) == []
    assert cache.due == 4.0


def test_nothing_is_expected_of_an_instance_that_ended() -> None:
    cache = Cache(Qos(deadline=Deadline(2.0)))
    cache.put(0.0)
    cache.put(1.0, kind=DISPOSE)
    assert cache.ring(2.0) == []
    assert cache.due == math.inf
