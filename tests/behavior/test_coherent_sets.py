"""CoherentSets: of what one writer wrote together a reader sees all or nothing.  RTPS 2.5 §8.7.6."""

from __future__ import annotations

from dataclasses import dataclass, field

from hypothesis import given, settings
from hypothesis import strategies as st

from ddsi.behavior.coherent_sets import OCTETS_BESIDE_PAYLOAD, CoherentSets, MakeVisible
from ddsi.behavior.reader_history_cache import ReaderHistoryCache
from ddsi.structure.cache_change import CacheChange, ChangeKind
from ddsi.structure.coherence import Coherence
from ddsi.structure.guid import Guid
from ddsi.structure.qos import Qos, reader_qos
from ddsi.structure.qos_policies import BestEffort, KeepAll, Reliable, ResourceLimits
from ddsi.structure.sequence_number import NumberSet
from tests.behavior.builders import guid

W1, W2 = guid(1), guid(2)
KEEP_ALL = Qos(history=KeepAll(), reliability=Reliable())


@dataclass
class Bench:
    """The sets of one reader, with the history behind them; takes changes in short."""

    qos: Qos = KEEP_ALL
    max_octets: int = 1 << 20
    lost: list[tuple[int, int]] = field(default_factory=list)
    reasons: list[str] = field(default_factory=list)
    rejected: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.history = ReaderHistoryCache(
            reader_qos(self.qos),
            max_octets=1 << 20,
            max_instances=100,
            on_rejected=lambda limit, change, is_final: self.rejected.append(limit) if is_final else None,
        )
        self.sets = CoherentSets(
            MakeVisible(self.history, self.history),
            assembles=True,
            max_octets=self.max_octets,
            on_lost=self._note_lost,
        )

    def _note_lost(self, writer: Guid, first: int, count: int, why: str) -> None:
        self.lost.append((first, count))
        self.reasons.append(why)

    def put(self, number: int, of: int = 0, *, by: Guid = W1, size: int = 4) -> bool:
        """A change of the set that begins with ``of``; 0: of none."""
        coherence = Coherence(of) if of else None
        change = CacheChange(ChangeKind.ALIVE, by, number, bytes(size), b"k", coherence=coherence)
        return self.sets.add(change, 0.0)

    def end(self, number: int, *, by: Guid = W1) -> bool:
        return self.sets.add(CacheChange(ChangeKind.ALIVE, by, number, b"", coherence=Coherence(is_end=True)), 0.0)

    def seen(self) -> list[int]:
        return [change.sequence_number for _, change in self.history.take()]


def test_a_set_is_seen_when_its_writer_says_that_it_has_ended() -> None:
    bench = Bench()
    for number in (1, 2, 3):
        assert bench.put(number, of=1)
        assert bench.seen() == []
    assert bench.end(4)
    assert bench.seen() == [1, 2, 3]
    assert (bench.sets.octets, bench.sets.begun_count) == (0, 0)


def test_a_change_of_the_next_set_or_of_none_ends_a_set() -> None:
    bench = Bench()
    bench.put(1, of=1)
    bench.put(2, of=2)
    assert bench.seen() == [1]
    bench.put(3)
    assert bench.seen() == [2, 3]


def test_sets_of_different_writers_do_not_touch_each_other() -> None:
    bench = Bench()
    bench.put(1, of=1, by=W1)
    bench.put(1, of=1, by=W2)
    bench.end(2, by=W2)
    assert bench.seen() == [1]
    assert bench.sets.begun_count == 1


def test_a_set_that_lacks_its_beginning_its_middle_or_its_end_is_never_seen() -> None:
    for numbers, end in (((2, 3), 4), ((1, 3), 4), ((1, 2), 4)):
        bench = Bench()
        for number in numbers:
            bench.put(number, of=1)
        bench.end(end)
        assert bench.seen() == []
        assert bench.lost == [(numbers[0], 2)]
        assert "missing" in bench.reasons[0]


def test_what_a_filter_kept_away_is_not_missing() -> None:
    bench = Bench()
    bench.put(2, of=1)  # 1 was for others
    bench.end(6)
    assert bench.seen() == [], "unless the writer says so"
    bench = Bench()
    bench.sets.filtered(W1, 1, 2)
    bench.put(2, of=1)
    bench.sets.gap_received(W1, 3, NumberSet.of(5, [5]), filtered_count=3)
    bench.end(6)
    assert bench.seen() == [2]


def test_a_gap_of_which_not_all_was_filtered_leaves_something_missing() -> None:
    bench = Bench()
    bench.put(1, of=1)
    bench.sets.gap_received(W1, 2, NumberSet(4), filtered_count=1)
    bench.end(4)
    assert bench.seen() == []


def test_a_part_that_lacks_a_number_for_good_is_not_kept_until_its_writer_speaks_again() -> None:
    """What ends it may be among those that never come."""
    for is_filtered in (True, False):
        bench = Bench()
        bench.put(1, of=1)
        bench.sets.passed(W1, 2, 0.0)
        assert bench.sets.begun_count == 1
        if is_filtered:
            bench.sets.filtered(W1, 2, 4)
        bench.sets.passed(W1, 4, 0.0)
        assert (bench.sets.begun_count, bench.lost) == ((1, []) if is_filtered else (0, [(1, 1)]))


def test_a_writer_that_is_gone_takes_its_unfinished_set_with_it() -> None:
    bench = Bench()
    bench.put(1, of=1)
    bench.sets.writer_unmatched(W1, 0.0)
    assert (bench.seen(), bench.lost, bench.sets.octets, bench.sets.begun_count) == ([], [(1, 1)], 0, 0)
    assert "gone" in bench.reasons[0]


def test_a_set_waits_until_there_is_room_for_all_of_it() -> None:
    bench = Bench(KEEP_ALL | Qos(resource_limits=ResourceLimits(max_samples=3)))
    bench.put(1)
    for number in (2, 3, 4):
        assert bench.put(number, of=2)
    assert not bench.end(5)
    assert not bench.end(5), "asked again, with the same answer"
    assert bench.seen() == [1]
    assert bench.end(5)
    assert bench.seen() == [2, 3, 4]


def test_a_set_that_will_never_find_room_is_rejected_and_so_is_one_of_best_effort() -> None:
    limits = Qos(resource_limits=ResourceLimits(max_samples=2))
    for qos, first in ((KEEP_ALL | limits, []), (Qos(history=KeepAll(), reliability=BestEffort()) | limits, [1])):
        bench = Bench(qos)
        if first:
            bench.put(1)
        for number in range(2, 4 if first else 5):
            bench.put(number, of=2)
        assert bench.end(9 if first else 5) is True
        assert bench.seen() == first
    assert bench.lost or bench.rejected == ["max_samples"]


def test_an_endless_set_of_a_stranger_is_bounded_in_octets_and_in_number() -> None:
    for size in (0, 1000):
        bench = Bench(max_octets=100 * OCTETS_BESIDE_PAYLOAD)
        for number in range(1, 2_000):
            assert bench.put(number, of=1, size=size)
            assert bench.sets.octets <= 100 * OCTETS_BESIDE_PAYLOAD
        assert bench.sets.octets == 0, "given up, it holds nothing any more"
        bench.put(1, of=1, by=W2)
        bench.end(2, by=W2)
        assert bench.seen() == [1], "and leaves room to others"
        bench.end(2_000)
        assert bench.lost == [(1, 1_999)]
        assert "more than" in bench.reasons[0]


def test_ranges_that_a_writer_says_to_have_filtered_are_bounded() -> None:
    bench = Bench()
    for number in range(1, 2_000, 2):
        bench.sets.filtered(W1, number, number + 1)
    assert len(bench.sets._filtered[W1]) <= 256


# --- against a model -------------------------------------------------------------------------------------

WRITTEN = st.lists(st.tuples(st.integers(1, 5), st.booleans(), st.booleans()), max_size=12)
"""Sets by their number of changes: ended by a mark or by what follows; and whether a change of none follows."""


def _history(sets: list[tuple[int, bool, bool]]) -> list[tuple[int, int, str]]:
    """Number, set, and what it is: of what a writer wrote."""
    out: list[tuple[int, int, str]] = []
    for size, is_marked, has_single in sets:
        first = len(out) + 1
        out += [(first + i, first, "member") for i in range(size)]
        if is_marked:
            out.append((len(out) + 1, first, "end"))
        if has_single:
            out.append((len(out) + 1, 0, "single"))
    return out


@settings(max_examples=100)
@given(WRITTEN, st.sets(st.integers(1, 60)), st.sets(st.integers(1, 60)))
def test_exactly_the_sets_of_which_nothing_is_missing_are_seen(
    sets: list[tuple[int, bool, bool]], lost: set[int], filtered: set[int]
) -> None:
    """The model: a set is seen if every number from its first to what ends it came, or was filtered; singles always."""
    written = _history(sets)
    bench = Bench()
    here = {number for number, _, _ in written} - lost - filtered
    for number, of, what in written:
        if number in filtered:
            bench.sets.filtered(W1, number, number + 1)
        elif number in here:
            if what == "end":
                bench.end(number)
            else:
                bench.put(number, of=of)
    expected = [number for number, _, what in written if what == "single" and number in here]
    for first in {of for _, of, _ in written if of}:
        members = [number for number, of, what in written if of == first and what == "member"]
        ends = [number for number in here if number > members[-1]]
        came = [number for number in members if number in here]
        if ends and came and all(number in here or number in filtered for number in range(first, min(ends))):
            expected += came
    assert bench.seen() == sorted(expected)
