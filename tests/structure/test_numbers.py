"""Time, duration, sequence numbers and their sets."""

from __future__ import annotations

import math
import pickle
from datetime import UTC, datetime

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ddsi.structure.sequence_number import MAX_SET_BITS, NumberSet
from ddsi.structure.time import (
    TICKS_PER_SECOND,
    Time,
    duration_from_wire,
    duration_to_wire,
    ticks_from_nanoseconds,
)


@pytest.mark.parametrize(
    ("seconds", "wire"),
    [
        (0, (0, 0)),
        (1, (1, 0)),
        (0.5, (0, 0x80000000)),
        (0.1, (0, 0x1999999A)),
        (0.7, (0, 0xB3333334)),  # up: who rounds down to nanoseconds as he reads, as Fast DDS does, must not find less
        (1.25, (1, 0x40000000)),
        (0.999999999999, (1, 0)),  # rounds up, and carries
        (math.inf, (0x7FFFFFFF, 0xFFFFFFFF)),
        (1e12, (0x7FFFFFFF, 0xFFFFFFFF)),  # too long for the field
    ],
)
def test_durations_on_the_wire(seconds: float, wire: tuple[int, int]) -> None:
    assert duration_to_wire(seconds) == wire


@given(st.integers(0, 10**9), st.integers(0, 999_999_999))
def test_durations_come_back_as_people_wrote_them(seconds: int, nanoseconds: int) -> None:
    """So that policies compare as numbers: a deadline of 0.1 is 0.1 at the peer too."""
    duration = round(seconds + nanoseconds / 10**9, 6)
    assert duration_from_wire(*duration_to_wire(duration)) == pytest.approx(duration, abs=1e-9)
    assert duration_from_wire(*duration_to_wire(seconds / 1000)) == seconds / 1000


@given(st.integers(0, 999_999_999))
def test_who_rounds_down_to_nanoseconds_reads_what_was_written(nanoseconds: int) -> None:
    whole, fraction = duration_to_wire(5 + nanoseconds / 10**9)
    assert (whole, fraction * 10**9 >> 32) == (5, nanoseconds)


@pytest.mark.parametrize("fraction", [0xFFFFFFFF, 0x7FFFFFFF, 0])
def test_infinite_is_written_in_several_ways(fraction: int) -> None:
    assert duration_from_wire(0x7FFFFFFF, fraction) == math.inf


def test_a_time_is_seconds_and_exact_ticks() -> None:
    time = Time(3 * TICKS_PER_SECOND + 1)
    assert time == pytest.approx(3.0)
    assert time.ticks == 3 * TICKS_PER_SECOND + 1
    assert time + 1 == pytest.approx(4.0)
    assert Time.from_seconds(2.5).ticks == 5 << 31
    assert Time.from_seconds(time) is time
    assert Time(0).to_datetime() == datetime(1970, 1, 1, tzinfo=UTC)
    assert pickle.loads(pickle.dumps(time)).ticks == time.ticks


@pytest.mark.parametrize("seconds", [-1.0, 2.0**32, math.inf])
def test_a_time_that_has_no_stamp_is_refused(seconds: float) -> None:
    with pytest.raises(ValueError, match="seconds since 1970"):
        Time.from_seconds(seconds)


@given(st.integers(0, (1 << 32) * 10**9 - 1))
def test_nanoseconds_survive(nanoseconds: int) -> None:
    """A tick is a quarter of a nanosecond."""
    assert Time.from_nanoseconds(nanoseconds).nanoseconds == nanoseconds
    assert ticks_from_nanoseconds(nanoseconds) < 1 << 64


# --- sets -----------------------------------------------------------------------------------------------------------


def test_the_first_bit_stands_for_the_base() -> None:
    numbers = NumberSet.of(12, [13, 15])
    assert (numbers.base, numbers.num_bits, numbers.bitmap) == (12, 4, 0b0101)
    assert list(numbers) == [13, 15]
    assert (13 in numbers, 12 in numbers, 99 in numbers, "13" in numbers) == (True, False, False, False)
    assert numbers.end == 16


def test_an_empty_set_still_has_its_base() -> None:
    numbers = NumberSet(7)
    assert (list(numbers), bool(numbers), numbers.end) == ([], False, 7)
    assert not NumberSet(7, 3, 0), "bits, but none is set"


def test_what_lies_outside_is_left_out() -> None:
    numbers = NumberSet.of(10, [1, 9, 10, 10 + MAX_SET_BITS - 1, 10 + MAX_SET_BITS, 10**9])
    assert list(numbers) == [10, 10 + MAX_SET_BITS - 1]
    assert numbers.num_bits == MAX_SET_BITS


@given(st.integers(1, 10**12), st.sets(st.integers(0, 300)))
def test_sets_hold_what_was_put_in(base: int, offsets: set[int]) -> None:
    members = sorted(base + offset for offset in offsets)
    numbers = NumberSet.of(base, members)
    expected = [number for number in members if number < base + MAX_SET_BITS]
    assert list(numbers) == expected
    assert all(number in numbers for number in expected)
    assert bool(numbers) == bool(expected)
    assert numbers.num_bits == (expected[-1] - base + 1 if expected else 0)
