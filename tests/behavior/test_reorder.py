"""ReorderBuffer: whose turn it is, what is held back, what will never come, and what has to be asked for."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from ddsi.behavior.reorder import ReorderBuffer
from tests.behavior.builders import change


def buffer(*, max_samples: int = 10, max_octets: int = 1000) -> ReorderBuffer:
    return ReorderBuffer(max_samples=max_samples, max_octets=max_octets)


def drain(reorder: ReorderBuffer) -> list[int]:
    out = []
    while (head := reorder.head()) is not None:
        out.append(head.sequence_number)
        reorder.pop_head()
    return out


def test_changes_come_out_in_order() -> None:
    reorder = buffer()
    for number in (3, 1, 2, 5):
        assert reorder.add(change(number))
    assert drain(reorder) == [1, 2, 3]
    assert (reorder.next_sn, len(reorder)) == (4, 1)


def test_a_change_that_is_here_already_is_refused() -> None:
    reorder = buffer()
    assert reorder.add(change(2))
    assert not reorder.add(change(2))
    reorder.add_irrelevant(3, 6)
    assert not reorder.add(change(4)), "a GAP said that it will never come"
    assert len(reorder) == 1


def test_irrelevant_numbers_are_stepped_over() -> None:
    reorder = buffer()
    reorder.add(change(4))
    reorder.add_irrelevant(2, 4)
    assert drain(reorder) == []
    reorder.add(change(1))
    assert drain(reorder) == [1, 4]


def test_a_gap_over_a_billion_numbers_costs_as_much_as_one_over_two() -> None:
    reorder = buffer()
    reorder.add_irrelevant(1, 10**18)
    reorder.add(change(10**18))
    assert drain(reorder) == [10**18]
    assert not reorder


def test_a_gap_takes_back_what_is_held() -> None:
    """A GAP wins over a change that waits: the writer says that it is not for this reader (any more)."""
    reorder = buffer()
    reorder.add(change(2, b"1234"))
    reorder.add(change(3, b"12"))
    reorder.add_irrelevant(2, 3)
    assert (len(reorder), reorder.octets) == (1, 2)
    reorder.add(change(1))
    assert drain(reorder) == [1, 3]


def test_bounded_in_samples_but_never_for_the_one_whose_turn_it_is() -> None:
    reorder = buffer(max_samples=2)
    assert [reorder.add(change(number)) for number in (3, 4, 5)] == [True, True, False]
    assert reorder.add(change(1)), "or nothing would ever move again"


def test_bounded_in_octets() -> None:
    reorder = buffer(max_octets=10)
    assert reorder.add(change(2, bytes(8)))
    assert not reorder.add(change(3, bytes(3)))
    assert reorder.octets == 8


def test_the_ranges_are_bounded_too() -> None:
    reorder = buffer()
    for number in range(3, 10_000, 2):
        reorder.add_irrelevant(number, number + 1)
    assert len(reorder._range_starts) <= 512
    assert reorder.is_irrelevant(3), "the nearest are kept: they are needed first"


def test_missing_numbers_lowest_first() -> None:
    reorder = buffer()
    reorder.add(change(3))
    reorder.add_irrelevant(5, 7)
    missing = reorder.missing(8)
    assert (missing.base, list(missing)) == (1, [1, 2, 4, 7, 8])
    assert list(reorder.missing(8, excluded={2, 7})) == [1, 4, 8]
    assert list(reorder.missing(8, above=4)) == [7, 8]
    assert reorder.missing(8, above=4).base == 1, "what was asked for before is still not acknowledged"


def test_missing_is_one_bitmap_at_most() -> None:
    missing = buffer().missing(10**12)
    assert (missing.base, missing.num_bits, len(list(missing))) == (1, 256, 256)


def test_nothing_missing_has_the_next_number_as_its_base() -> None:
    reorder = buffer()
    reorder.add_irrelevant(1, 4)
    missing = reorder.missing(3)
    assert (missing.base, bool(missing)) == (4, False)


def test_skipping_counts_what_is_lost() -> None:
    """HEARTBEAT first: below it nothing is to be had any more; what is held below it is not lost."""
    reorder = buffer()
    reorder.add(change(2))
    reorder.add_irrelevant(4, 6)
    assert reorder.skip_to(8) == 4, "1, 3, 6 and 7"
    assert drain(reorder) == [2]
    assert reorder.next_sn == 8


def test_skipping_backwards_does_nothing() -> None:
    reorder = buffer()
    reorder.add_irrelevant(1, 6)
    reorder.head()
    assert reorder.skip_to(3) == 0
    assert reorder.next_sn == 6


@given(
    st.lists(
        st.tuples(st.sampled_from(["add", "gap", "skip"]), st.integers(1, 40), st.integers(1, 6)),
        max_size=60,
    )
)
def test_agrees_with_a_buffer_that_keeps_a_status_per_number(actions: list[tuple[str, int, int]]) -> None:
    """The specification's way: one status for each number.  Deliveries, the next number and losses are the same."""
    reorder = ReorderBuffer(max_samples=100, max_octets=1 << 20)
    held: set[int] = set()
    settled: set[int] = set()
    next_sn = 1
    for action, number, count in actions:
        lost = 0
        if action == "add" and number >= next_sn:
            assert reorder.add(change(number)) == (number not in held and number not in settled)
            if number not in settled:
                held.add(number)
        elif action == "gap":
            reorder.add_irrelevant(number, number + count)
            for irrelevant in range(max(number, next_sn), number + count):
                held.discard(irrelevant)
                settled.add(irrelevant)
        elif action == "skip":
            lost = reorder.skip_to(number)
            gone = {below for below in range(next_sn, number) if below not in held and below not in settled}
            assert lost == len(gone)
            settled |= gone
        expected = []
        while next_sn in held or next_sn in settled:
            if next_sn in held:
                expected.append(next_sn)
                held.discard(next_sn)
            next_sn += 1
        assert drain(reorder) == expected
        assert reorder.next_sn == next_sn
        assert list(reorder.missing(60)) == [
            unknown for unknown in range(next_sn, 61) if unknown not in held and unknown not in settled
        ]
    assert len(reorder) == len(held)
