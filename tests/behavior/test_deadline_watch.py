"""DeadlineWatch: one timer for all instances, and each miss told once a period.  DDS 1.4 §2.2.3.7."""

from __future__ import annotations

import math

from hypothesis import given
from hypothesis import strategies as st

from ddsi.behavior.deadline_watch import DeadlineWatch


def test_nothing_is_expected_before_something_was_heard() -> None:
    watch = DeadlineWatch(2.0)
    assert watch.due == math.inf
    watch.heard(b"a", 1.0)
    assert watch.due == 3.0


def test_what_is_heard_in_time_is_not_missed() -> None:
    watch = DeadlineWatch(2.0)
    for now in (0.0, 1.9, 3.8):
        watch.heard(b"a", now)
        assert watch.missed(now) == []
    assert watch.due == 5.8


def test_a_miss_is_told_once_a_period_and_only_of_the_silent() -> None:
    watch = DeadlineWatch(2.0)
    watch.heard(b"a", 0.0)
    watch.heard(b"b", 1.0)
    assert watch.missed(2.0) == [b"a"]
    assert watch.missed(2.5) == []
    assert watch.missed(3.0) == [b"b"]
    assert watch.missed(4.0) == [b"a"]


def test_nothing_is_expected_of_an_instance_that_ended() -> None:
    watch = DeadlineWatch(2.0)
    watch.heard(b"a", 0.0)
    watch.forget(b"a")
    assert watch.missed(9.0) == []
    assert watch.due == math.inf


def test_a_period_of_zero_does_not_ring_for_ever() -> None:
    watch = DeadlineWatch(0.0)
    watch.heard(b"a", 1.0)
    assert watch.missed(1.5) == [b"a"]
    assert watch.due > 1.5


@given(st.lists(st.tuples(st.sampled_from([b"a", b"b", b"c"]), st.floats(0.0, 1.0)), max_size=40))
def test_due_is_never_late(steps: list[tuple[bytes, float]]) -> None:
    """Whoever asks when it is due learns of every miss, by a model that looks at each instance."""
    watch, now = DeadlineWatch(1.0), 0.0
    heard: dict[bytes, float] = {}
    for key, pause in steps:
        now += pause
        if watch.due <= now:
            expected = {name for name, at in heard.items() if at + 1.0 <= now}
            missed = watch.missed(now)
            assert set(missed) == expected
            heard.update(dict.fromkeys(missed, now))
        else:
            assert all(at + 1.0 > now for at in heard.values())
        heard[key] = now
        watch.heard(key, now)
