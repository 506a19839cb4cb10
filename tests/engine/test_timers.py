"""Timers: deadlines by key in one heap, with lazy deletion."""

from __future__ import annotations

import math

from hypothesis import given
from hypothesis import strategies as st

from ddsi.engine.timers import Timers


def test_the_earliest_is_due_first() -> None:
    timers = Timers()
    timers.set("b", 2.0)
    timers.set("a", 1.0)
    assert timers.next_deadline() == 1.0
    assert timers.pop_due(0.5) is None
    assert [timers.pop_due(5.0), timers.pop_due(5.0), timers.pop_due(5.0)] == ["a", "b", None]
    assert timers.next_deadline() == math.inf


def test_equal_deadlines_come_in_the_order_of_setting() -> None:
    """Whatever the keys are: they are never compared with each other."""
    timers = Timers()
    keys = [object(), "x", 3, (1, "y")]
    for key in keys:
        timers.set(key, 1.0)
    assert [timers.pop_due(1.0) for _ in keys] == keys


def test_setting_again_replaces() -> None:
    timers = Timers()
    timers.set("a", 1.0)
    timers.set("a", 3.0)
    assert timers.next_deadline() == 3.0
    timers.set("a", 2.0)
    assert timers.next_deadline() == 2.0
    assert len(timers) == 1
    assert timers.pop_due(9.0) == "a"
    assert timers.pop_due(9.0) is None


def test_cancelling_and_infinity_disarm() -> None:
    timers = Timers()
    timers.set("a", 1.0)
    timers.set("b", 1.0)
    timers.cancel("a")
    timers.cancel("nothing")
    timers.set("b", math.inf)
    assert (timers.next_deadline(), len(timers)) == (math.inf, 0)


def test_a_timer_that_is_set_all_the_time_takes_no_more_room() -> None:
    timers = Timers()
    for number in range(100_000):
        timers.set("a", float(number))
    assert len(timers._heap) <= 64 + 4 + 1


@given(
    st.lists(
        st.tuples(st.sampled_from(["set", "cancel", "pop"]), st.integers(0, 5), st.integers(0, 20)),
        max_size=200,
    )
)
def test_agrees_with_a_plain_table(actions: list[tuple[str, int, int]]) -> None:
    timers = Timers()
    table: dict[int, tuple[float, int]] = {}
    for order, (action, key, number) in enumerate(actions):
        if action == "set":
            if table.get(key, (None, 0))[0] != float(number):  # setting it to what it is leaves its place
                table[key] = (float(number), order)
            timers.set(key, float(number))
        elif action == "cancel":
            table.pop(key, None)
            timers.cancel(key)
        else:
            due = [(deadline, placed, name) for name, (deadline, placed) in table.items() if deadline <= number]
            expected = min(due)[2] if due else None
            assert timers.pop_due(float(number)) == expected
            if expected is not None:
                del table[expected]
        assert timers.next_deadline() == min((deadline for deadline, _ in table.values()), default=math.inf)
        assert len(timers) == len(table)
