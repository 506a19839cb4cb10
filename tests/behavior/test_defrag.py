"""Defragmenter: fragments in any order become samples; what never will is dropped, and memory has a bound."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ddsi.behavior.defrag import FRAGMENT_SILENCE, DefragBudget, Defragmenter, Keep, PartialSample

TO_ALL = bytes(4)
R1, R2 = b"\0\0\1\4", b"\0\0\2\4"


def defragmenter(budget: DefragBudget | None = None, *, max_samples: int = 8, keep: Keep = Keep.LOWEST) -> Defragmenter:
    return Defragmenter(budget or DefragBudget(1 << 20), max_samples=max_samples, keep=keep)


def add(
    defrag: Defragmenter,
    number: int,
    fragment: int,
    *,
    of: int = 3,
    size: int = 10,
    reader: bytes = TO_ALL,
    now: float = 0.0,
    sealed: bool = False,
) -> PartialSample | None:
    """One fragment of ``size`` octets, of a sample of ``of`` fragments, each filled with its own number."""
    return defrag.add(
        number, reader, sample_size=of * size, fragment_size=size, first=fragment, count=1,
        fragments=bytes((fragment,)) * size, now=now, is_sealed=sealed,
    )  # fmt: skip


def is_complete(sample: PartialSample | None) -> bool:
    return sample is not None and sample.is_complete


def test_fragments_in_any_order_make_the_sample() -> None:
    defrag = defragmenter()
    assert not is_complete(add(defrag, 1, 3))
    assert not is_complete(add(defrag, 1, 1))
    sample = add(defrag, 1, 2)
    assert sample is not None
    assert sample.is_complete
    assert bytes(sample.octets) == b"\1" * 10 + b"\2" * 10 + b"\3" * 10
    assert (len(defrag), defrag.octets) == (0, 0)


def test_a_fragment_that_comes_twice_counts_once() -> None:
    defrag = defragmenter()
    assert not any(is_complete(add(defrag, 1, fragment)) for fragment in (1, 1, 1, 2, 2))
    assert is_complete(add(defrag, 1, 3))


def test_the_last_fragment_is_shorter_and_several_may_come_at_once() -> None:
    defrag = defragmenter()
    first = defrag.add(
        1, TO_ALL, sample_size=25, fragment_size=10, first=2, count=2, fragments=b"b" * 10 + b"c" * 5 + b"\0\0\0", now=0
    )
    assert not is_complete(first)
    sample = defrag.add(1, TO_ALL, sample_size=25, fragment_size=10, first=1, count=1, fragments=b"a" * 10, now=0)
    assert sample is not None
    assert bytes(sample.octets) == b"a" * 10 + b"b" * 10 + b"c" * 5


def test_missing_fragments_are_named() -> None:
    defrag = defragmenter()
    add(defrag, 1, 2, of=6)
    sample = add(defrag, 1, 4, of=6)
    assert sample is not None
    assert list(sample.missing()) == [1, 3, 5, 6]
    assert list(sample.missing(up_to=3)) == [1, 3]
    assert sample.missing(up_to=3).base == 1
    add(defrag, 1, 1, of=6)
    assert not sample.missing(up_to=2)
    assert sample.fragment_count == 6


def test_missing_fragments_fit_one_bitmap() -> None:
    sample = PartialSample(100_000, 10)
    sample.add(1, 1, bytes(10))
    missing = sample.missing()
    assert (missing.base, missing.num_bits, list(missing)[-1]) == (2, 256, 257)


@given(st.permutations(range(1, 8)), st.integers(1, 20))
def test_whatever_the_order(order: list[int], last_size: int) -> None:
    """Seven fragments of 20 octets, the last of them perhaps shorter: complete with the last to come, not before."""
    payload = bytes(range(6 * 20 + last_size))
    defrag = defragmenter()
    sample = None
    for position, fragment in enumerate(order, 1):
        sample = defrag.add(
            1,
            TO_ALL,
            sample_size=len(payload),
            fragment_size=20,
            first=fragment,
            count=1,
            fragments=payload[(fragment - 1) * 20 : fragment * 20],
            now=0,
        )
        assert is_complete(sample) == (position == 7)
    assert sample is not None
    assert bytes(sample.octets) == payload


# --- for whom ------------------------------------------------------------------------------------------------------


def test_repairs_for_one_reader_join_what_came_for_all() -> None:
    """A writer answers a NACK_FRAG to the reader that asked; the sample is complete for everybody then."""
    defrag = defragmenter()
    add(defrag, 1, 1)
    add(defrag, 1, 2, reader=R1)
    sample = add(defrag, 1, 3, reader=R2)
    assert sample is not None
    assert sample.is_complete
    assert sample.reader_id == TO_ALL


def test_a_repair_may_come_before_what_it_repairs() -> None:
    defrag = defragmenter()
    add(defrag, 1, 2, reader=R1)
    add(defrag, 1, 1, reader=R2)
    sample = add(defrag, 1, 3)
    assert sample is not None
    assert sample.reader_id == TO_ALL
    assert list(sample.missing()) == [1]
    assert len(defrag) == 1
    assert is_complete(add(defrag, 1, 1, reader=R2))


def test_what_is_for_one_reader_is_joined_for_it_alone() -> None:
    """A filtering writer may send one number to one reader only; nobody else asks for it or gets it."""
    defrag = defragmenter()
    add(defrag, 1, 1, reader=R1)
    add(defrag, 1, 1, reader=R2)
    add(defrag, 2, 1)
    assert list(defrag.partial_for(R1)) == [1, 2]
    assert list(defrag.partial_for(b"\0\0\3\4")) == [2]
    add(defrag, 1, 2, reader=R1)
    sample = add(defrag, 1, 3, reader=R1)
    assert sample is not None
    assert (sample.is_complete, sample.reader_id) == (True, R1)
    assert list(defrag.partial_for(R2)) == [1, 2]


def test_the_defragmenter_is_pruned_when_a_reader_is_deleted() -> None:
    defrag = defragmenter()
    for number in (1, 2, 3):
        add(defrag, number, 1, reader=R1)
    add(defrag, 2, 1, reader=R2)
    add(defrag, 4, 1)
    defrag.prune(R1)
    assert list(defrag.partial_for(R1)) == [4], "what is for all stays for the others"
    assert list(defrag.partial_for(R2)) == [2, 4]
    assert len(defrag) == 2


# --- bounds --------------------------------------------------------------------------------------------------------


def test_reliable_keeps_the_lowest_when_full() -> None:
    """The lowest is what everybody waits for; the highest will be sent again."""
    defrag = defragmenter(max_samples=2)
    add(defrag, 5, 1)
    add(defrag, 7, 1)
    assert add(defrag, 9, 1) is None
    assert defrag.dropped == 1
    assert add(defrag, 3, 1) is not None
    assert list(defrag.partial_for(R1)) == [5, 3]


def test_best_effort_keeps_the_newest_when_full() -> None:
    defrag = defragmenter(max_samples=2, keep=Keep.HIGHEST)
    for number in (5, 7, 9):
        assert add(defrag, number, 1) is not None
    assert list(defrag.partial_for(R1)) == [7, 9]
    assert defrag.dropped == 1


def test_where_numbers_say_nothing_those_that_began_last_are_kept() -> None:
    """Forged numbers, however high, do not keep out a low one."""
    defrag = defragmenter(max_samples=2, keep=Keep.NEWEST)
    for number in (1 << 60, 7, 1 << 61, 8):
        assert add(defrag, number, 1) is not None
    assert list(defrag.partial_for(R1)) == [1 << 61, 8]
    assert defrag.dropped == 2


def test_where_anybody_may_have_begun_a_sample_another_size_begins_it_anew() -> None:
    defrag = defragmenter(keep=Keep.NEWEST)
    add(defrag, 1, 1, of=3)
    for fragment in (1, 2, 3):
        assert not is_complete(add(defrag, 1, fragment, of=4))
    assert is_complete(add(defrag, 1, 4, of=4))
    assert (defrag.dropped, len(defrag), defrag.octets) == (1, 0, 0)


def test_a_sample_beyond_the_whole_budget_is_refused_before_memory_is_taken() -> None:
    budget = DefragBudget(100)
    defrag = defragmenter(budget)
    assert add(defrag, 1, 1, of=10) is None
    assert (budget.octets, defrag.dropped) == (0, 1)


def test_many_small_fragments_are_counted_too() -> None:
    """One octet of bookkeeping for each fragment: a million fragments of one octet are two million octets."""
    budget = DefragBudget(150)
    assert add(defragmenter(budget), 1, 1, of=100, size=1) is None
    assert add(defragmenter(budget), 1, 1, of=1, size=100) is not None


def test_all_writers_of_a_participant_share_one_budget() -> None:
    budget = DefragBudget(100)
    one, other = defragmenter(budget), defragmenter(budget)
    add(one, 1, 1, of=2, size=20)
    add(one, 2, 1, of=2, size=20)
    assert add(other, 9, 1, of=2, size=20) is not None, "the writer that holds most gives way"
    assert (list(one.partial_for(R1)), list(other.partial_for(R1))) == ([1], [9])
    assert budget.octets == one.octets + other.octets <= 100


def test_the_heaviest_writer_cannot_push_out_the_others() -> None:
    budget = DefragBudget(100)
    heavy, light = defragmenter(budget), defragmenter(budget)
    add(light, 1, 1, of=1 + 1, size=8)
    for number in range(1, 20):
        add(heavy, number, 1, of=2, size=20)
    assert list(light.partial_for(R1)) == [1]
    assert list(heavy.partial_for(R1)) == [1]
    assert heavy.dropped == 18


def test_a_writer_that_is_gone_gives_everything_back() -> None:
    budget = DefragBudget(1000)
    one, other = defragmenter(budget), defragmenter(budget)
    add(one, 1, 1)
    add(other, 1, 1)
    one.close()
    assert (len(one), budget.octets) == (0, other.octets)
    assert budget.heaviest() is other


def test_what_is_sealed_and_what_was_opened_are_never_joined() -> None:
    """Else whoever has no key could put a piece of his own into a sample that is protected fragment by fragment."""
    for first in (True, False):
        defrag = defragmenter()
        assert add(defrag, 1, 1, of=2, sealed=first) is not None
        assert add(defrag, 1, 2, of=2, sealed=not first) is None
        sample = add(defrag, 1, 2, of=2, sealed=first)
        assert sample is not None
        assert (sample.is_complete, sample.is_sealed) == (True, first)


@given(
    st.lists(
        st.tuples(st.integers(0, 2), st.integers(1, 12), st.sampled_from([TO_ALL, R1, R2]), st.integers(1, 4)),
        max_size=120,
    ),
    st.sampled_from(Keep),
)
def test_counted_and_bounded_whatever_comes(arrivals: list[tuple[int, int, bytes, int]], keep: Keep) -> None:
    budget = DefragBudget(200)
    defrags = [defragmenter(budget, max_samples=3, keep=keep) for _ in range(3)]
    for which, number, reader, fragment in arrivals:
        add(defrags[which], number, fragment, of=4, size=8, reader=reader)
        if fragment == 4:
            defrags[which].notice_number(number)
        assert budget.octets == sum(defrag.octets for defrag in defrags) <= 200
        for defrag in defrags:
            held = [sample for samples in defrag._partial.values() for sample in samples.values()]
            assert len(held) == len(defrag) <= 3
            assert sum(sample.memory for sample in held) == defrag.octets


def test_a_writer_that_contradicts_itself_is_not_believed() -> None:
    defrag = defragmenter()
    add(defrag, 1, 1, of=3)
    assert add(defrag, 1, 2, of=4) is None
    assert add(defrag, 1, 2, of=3, size=11) is None
    assert defrag.dropped == 2
    add(defrag, 1, 2, of=3)
    assert is_complete(add(defrag, 1, 3, of=3))


def test_numbers_that_are_settled_are_forgotten() -> None:
    defrag = defragmenter()
    for number in (1, 2, 3):
        add(defrag, number, 1)
    defrag.notice_number(3)
    assert list(defrag.partial_for(R1)) == [3]


# --- when to ask ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("last_arrival", "asked_at", "now", "may_repeat", "expected"),
    [
        (1.0, -9.0, 1.0 + FRAGMENT_SILENCE / 2, True, False),  # fragments are still coming
        (1.0, -9.0, 1.0 + FRAGMENT_SILENCE, False, True),  # silence, and never asked
        (1.0, 1.1, 1.2, False, False),  # asked since, and the answer is not overdue
        (1.0, 1.1, 1.2, True, True),  # it is overdue
        (1.3, 1.1, 1.4, False, True),  # the answer came, in part, and ended
    ],
)
def test_when_missing_fragments_are_asked_for(
    last_arrival: float, asked_at: float, now: float, may_repeat: bool, expected: bool
) -> None:
    sample = PartialSample(30, 10)
    sample.last_arrival, sample.asked_at = last_arrival, asked_at
    assert sample.is_silent(now, may_repeat=may_repeat) is expected


# --- fragments that are made where they belong -----------------------------------------------------------------------


def test_what_was_begun_for_fragments_is_held_once_they_are_added() -> None:
    defrag = defragmenter()
    begun = defrag.begin(1, TO_ALL, 20, sample_size=30, fragment_size=10)
    assert begun is not None
    place = begun.place_of(1, 2)
    assert place is not None
    assert (len(place), len(defrag), defrag.octets) == (20, 0, 0)
    place[:] = b"\1" * 10 + b"\2" * 10
    sample = defrag.add(
        1, TO_ALL, sample_size=30, fragment_size=10, first=1, count=2, fragments=place, now=0.0, begun=begun
    )
    assert sample is begun
    assert (len(defrag), defrag.octets) == (1, begun.memory)
    sample = add(defrag, 1, 3)
    assert is_complete(sample)
    assert sample is begun
    assert bytes(begun.octets) == b"\1" * 10 + b"\2" * 10 + b"\3" * 10


def test_nothing_is_begun_for_less_than_half_a_sample() -> None:
    defrag = defragmenter()
    assert defrag.begin(1, TO_ALL, 65_000, sample_size=1 << 40, fragment_size=65_000) is None
    assert defrag.begin(1, TO_ALL, 10, sample_size=30, fragment_size=10) is None
    assert defrag.begin(1, TO_ALL, 10, sample_size=20, fragment_size=10) is not None


def test_a_place_is_given_of_what_is_not_here_alone() -> None:
    defrag = defragmenter()
    add(defrag, 1, 2)
    begun = defrag.begin(1, R1, 10, sample_size=30, fragment_size=10)
    assert begun is not None
    assert [begun.place_of(first, count) is not None for first, count in ((1, 1), (2, 1), (3, 1), (1, 2), (2, 2))] == [
        True, False, True, False, False,
    ]  # fmt: skip
    place = begun.place_of(3, 1)
    assert place is not None
    place[:] = b"anything.."  # it turned out not to be genuine, and was not added
    assert not is_complete(add(defrag, 1, 1))
    assert is_complete(add(defrag, 1, 3))
    assert bytes(begun.octets) == b"\1" * 10 + b"\2" * 10 + b"\3" * 10


def test_nothing_is_begun_of_what_contradicts_or_is_for_another() -> None:
    defrag = defragmenter()
    add(defrag, 1, 2, reader=R1)
    assert defrag.begin(1, R1, 30, sample_size=40, fragment_size=10) is None
    assert defrag.begin(1, R2, 20, sample_size=30, fragment_size=10) is None
    add(defrag, 2, 2, sealed=True)
    assert defrag.begin(2, TO_ALL, 20, sample_size=30, fragment_size=10) is None
