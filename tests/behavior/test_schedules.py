"""When HEARTBEATs and ACKNACKs are sent: back-off, what starts it over, and asking once for one thing."""

from __future__ import annotations

import itertools
import math

import pytest

from ddsi.behavior.schedules import (
    HEARTBEAT_PERIOD_MAX,
    HEARTBEAT_PERIOD_MIN,
    NACK_DELAY,
    NACK_REPEAT_FIRST,
    NACK_REPEAT_MAX,
    NACK_REPEAT_MIN,
    PREEMPTIVE_MAX,
    PREEMPTIVE_MIN,
    AckNackSchedule,
    HeartbeatSchedule,
)
from ddsi.behavior.send_window import SendWindow


def heartbeat_times(schedule: HeartbeatSchedule, count: int) -> list[float]:
    times = []
    for _ in range(count):
        times.append(schedule.due)
        schedule.sent(schedule.due)
    return times


def test_heartbeats_begin_with_a_write_and_back_off() -> None:
    """50 ms, doubled after every third that nobody answers, at most 4 s."""
    schedule = HeartbeatSchedule()
    assert schedule.due == math.inf
    schedule.written(10.0)
    times = heartbeat_times(schedule, 40)
    gaps = [round(later - earlier, 6) for earlier, later in itertools.pairwise([10.0, *times])]
    assert gaps[:7] == [0.05, 0.05, 0.05, 0.1, 0.1, 0.1, 0.2]
    assert gaps == sorted(gaps)
    assert gaps[-1] == HEARTBEAT_PERIOD_MAX


def test_a_write_leaves_a_heartbeat_that_is_due_soon_alone() -> None:
    """Else a writer that writes all the time would never come to its heartbeat."""
    schedule = HeartbeatSchedule()
    schedule.written(0.0)
    for step in range(1, 5):
        schedule.written(step * 0.01)
    assert schedule.due == HEARTBEAT_PERIOD_MIN


def test_a_write_starts_over_what_had_backed_off() -> None:
    schedule = HeartbeatSchedule()
    schedule.written(0.0)
    now = heartbeat_times(schedule, 30)[-1]
    assert schedule.due > now + 1
    schedule.written(now)
    assert schedule.due == now + HEARTBEAT_PERIOD_MIN


def test_progress_starts_over_and_completion_ends() -> None:
    schedule = HeartbeatSchedule()
    schedule.written(0.0)
    now = heartbeat_times(schedule, 30)[-1]
    schedule.progress(now, complete=False)
    assert schedule.due == now + HEARTBEAT_PERIOD_MIN
    schedule.progress(now, complete=True)
    assert schedule.due == math.inf


# --- ACKNACK --------------------------------------------------------------------------------------------------------


def in_step() -> AckNackSchedule:
    """A reader that has heard its writer's first HEARTBEAT."""
    schedule = AckNackSchedule()
    schedule.heartbeat_received(0.0)
    return schedule


def ask(schedule: AckNackSchedule, now: float, number: int, *, again: bool = False, next_sn: int = 1 << 30) -> None:
    """Ask for a number; ``again``: and for those that were asked for before."""
    schedule.nack_sent(now, [number], is_repeat=again, next_sn=next_sn)


def test_preemptive_acknacks_repeat_ever_slower_until_the_first_heartbeat() -> None:
    schedule = AckNackSchedule()
    schedule.matched(1.0)
    assert schedule.due == 1.0
    times = []
    for _ in range(12):
        times.append(schedule.due)
        schedule.preemptive_sent(schedule.due)
    gaps = [round(later - earlier, 6) for earlier, later in itertools.pairwise(times)]
    assert gaps[:4] == [PREEMPTIVE_MIN, 2 * PREEMPTIVE_MIN, 4 * PREEMPTIVE_MIN, 8 * PREEMPTIVE_MIN]
    assert gaps[-1] == PREEMPTIVE_MAX
    schedule.heartbeat_received(0.0)
    assert not schedule.is_preemptive
    assert schedule.due == math.inf


def test_samples_before_the_first_heartbeat_hasten_the_question_a_little() -> None:
    """But a flood of them does not make a flood of ACKNACKs."""
    schedule = AckNackSchedule()
    schedule.matched(0.0)
    for _ in range(10):
        schedule.preemptive_sent(schedule.due)
    sent = now = schedule.due
    schedule.preemptive_sent(now)
    for number in range(10):
        now += 0.001
        schedule.missing(now, is_news=number > 0)
    assert schedule.due == sent + PREEMPTIVE_MIN


def test_a_wanted_acknowledgment_goes_out_at_once() -> None:
    schedule = in_step()
    schedule.acknowledge(3.0)
    assert (schedule.due, schedule.is_wanted) == (3.0, True)
    schedule.complete()
    assert (schedule.due, schedule.is_wanted) == (math.inf, False)


def test_a_little_reordering_is_no_loss() -> None:
    schedule = in_step()
    schedule.missing(1.0, is_news=True)
    assert schedule.due == 1.0 + NACK_DELAY
    schedule.complete()
    assert schedule.due == math.inf


def test_what_was_asked_for_is_not_asked_for_again_at_once() -> None:
    schedule = in_step()
    ask(schedule, 1.0, 10)
    assert schedule.asked_sn == 10
    assert schedule.repeat_due == schedule.due == 1.0 + NACK_REPEAT_FIRST
    schedule.missing(1.01, is_news=False)
    assert schedule.due == 1.0 + NACK_REPEAT_FIRST


def test_news_is_asked_for_soon_while_an_answer_is_under_way() -> None:
    schedule = in_step()
    ask(schedule, 1.0, 10)
    schedule.missing(1.01, is_news=True)
    assert schedule.due == 1.01 + NACK_DELAY


def test_vain_questions_are_repeated_ever_slower() -> None:
    schedule = in_step()
    now = 0.0
    gaps = []
    for _ in range(10):
        ask(schedule, now, 10, again=now > 0)
        gaps.append(round(schedule.due - now, 6))
        now = schedule.due
    assert gaps[:3] == [NACK_REPEAT_FIRST, 2 * NACK_REPEAT_FIRST, 4 * NACK_REPEAT_FIRST]
    assert gaps[-1] == NACK_REPEAT_MAX


def test_the_time_to_repeat_is_learnt_from_the_answers() -> None:
    """On a fast link a lost repair is asked for soon, on a slow one not before its answer can be here."""
    fast, slow = in_step(), in_step()
    now = 0.0
    for number in range(1, 20):
        ask(fast, now, number)
        fast.arrived(now + 0.0004, number)
        ask(slow, now, number)
        slow.arrived(now + 0.3, number)
        now += 1.0
    ask(fast, now, 20)
    ask(slow, now, 20)
    assert round(fast.repeat_due - now, 6) == NACK_REPEAT_MIN
    assert 0.55 < slow.repeat_due - now < 0.7


def test_the_first_heartbeat_gives_a_first_guess_of_the_time_of_answers() -> None:
    """On a long link the first repairs are not asked for again before they can be here."""
    for took, guess in ((0.0002, NACK_REPEAT_FIRST), (0.2, 0.3), (60.0, 10 * NACK_REPEAT_FIRST)):
        schedule = AckNackSchedule()
        schedule.matched(5.0)
        schedule.heartbeat_received(5.0 + took)
        ask(schedule, 100.0, 1)
        assert schedule.repeat_due == pytest.approx(100.0 + guess)


def test_a_heartbeat_lets_it_ask_again_when_the_answer_is_overdue() -> None:
    """However long the pause has grown: the writer is there."""
    schedule = in_step()
    for _ in range(8):
        ask(schedule, min(schedule.due, 1e6), 1, again=schedule.due < math.inf)
    asked = schedule.due - NACK_REPEAT_MAX
    assert not schedule.may_repeat(asked + 1.0)
    schedule.acknowledge(asked + 1.0)
    assert schedule.may_repeat(asked + 1.0)
    assert not schedule.may_repeat(asked + NACK_REPEAT_FIRST / 2)


def test_fresh_samples_say_nothing_about_the_time_of_answers() -> None:
    schedule = in_step()
    ask(schedule, 0.0, 10)
    schedule.arrived(0.0001, 11)  # was not asked for
    assert schedule.repeat_due == NACK_REPEAT_FIRST


def test_an_answer_after_a_repetition_gives_a_lower_bound() -> None:
    """Nobody can tell which question it answers, but not one that was asked later than the last."""
    schedule = in_step()
    ask(schedule, 0.0, 10)
    ask(schedule, 1.0, 10, again=True)
    schedule.arrived(1.03, 10)
    ask(schedule, 2.0, 20)
    assert schedule.repeat_due == pytest.approx(2.0 + 2 * 0.03 + NACK_DELAY)


def test_losses_do_not_make_a_fast_link_seem_slow() -> None:
    """Every other repair is lost and asked for twice; the others still tell how fast answers come."""
    schedule = in_step()
    now = 0.0
    for number in range(1, 41, 2):
        schedule.nack_sent(now, [number, number + 1], is_repeat=False, next_sn=number)
        schedule.arrived(now + 0.001, number)
        again = schedule.repeat_due
        schedule.nack_sent(again, [number + 1], is_repeat=True, next_sn=number + 1)
        schedule.arrived(again + 0.001, number + 1)
        now = again + 0.1
    ask(schedule, now, 50)
    assert schedule.repeat_due - now == pytest.approx(NACK_REPEAT_MIN)


def test_who_asks_often_in_vain_does_not_take_that_for_the_time_of_an_answer() -> None:
    """One late answer makes the others seem early, but what was asked for thrice does not answer the first question."""
    schedule = in_step()
    ask(schedule, 0.0, 1)
    schedule.arrived(0.2, 1)
    for step in range(50):
        ask(schedule, 1.0 + 0.5 * step, 2, again=step > 0)
    schedule.arrived(25.52, 2)
    ask(schedule, 26.0, 3)
    assert schedule.repeat_due == pytest.approx(26.0 + 2 * 0.2 + NACK_DELAY)


def test_a_link_that_is_slower_than_expected_is_found_to_be_so() -> None:
    """Though each question is repeated before the first answer can be here."""
    schedule = in_step()
    now, repeated = 0.0, 0
    for number in range(1, 40):
        asked = now
        ask(schedule, now, number)
        while schedule.repeat_due < asked + 0.4:
            repeated += 1
            ask(schedule, schedule.repeat_due, number, again=True)
        schedule.arrived(asked + 0.4, number)
        now = asked + 1.0
    assert repeated < 10


def test_news_does_not_put_off_what_is_overdue() -> None:
    schedule = in_step()
    ask(schedule, 0.0, 10)
    for step in range(1, 5):
        ask(schedule, 0.01 * step, 10 + step, next_sn=5)
    assert schedule.repeat_due == NACK_REPEAT_FIRST
    ask(schedule, 0.045, 20, next_sn=15)
    assert schedule.repeat_due == 0.045 + NACK_REPEAT_FIRST, "all of the older ones had come"


# --- the window -----------------------------------------------------------------------------------------------------


def test_the_window_grows_with_what_arrives_and_halves_with_what_is_lost() -> None:
    window = SendWindow()
    before = window.octets
    window.acknowledged(before)
    assert window.octets == before + before // 4
    window.lost(1.0)
    halved = window.octets
    assert halved == (before + before // 4) // 2
    window.lost(1.001)
    assert window.octets == halved, "one burst of losses is one sign"
    for step in range(100):
        window.lost(2.0 + step)
    assert 16 * 1024 <= window.octets < halved
    for _ in range(1000):
        window.acknowledged(window.octets)
    assert window.octets <= 4 << 20
