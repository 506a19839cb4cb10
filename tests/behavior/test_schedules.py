"""When HEARTBEATs and ACKNACKs are sent: back-off, what starts it over, and asking once for one thing."""

from __future__ import annotations

import itertools
import math

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
    schedule.heartbeat_received()
    return schedule


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
    schedule.heartbeat_received()
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
    schedule.nack_sent(1.0, 10)
    assert schedule.asked_sn == 10
    assert schedule.repeat_due == schedule.due == 1.0 + NACK_REPEAT_FIRST
    schedule.missing(1.01, is_news=False)
    assert schedule.due == 1.0 + NACK_REPEAT_FIRST


def test_news_is_asked_for_soon_while_an_answer_is_under_way() -> None:
    schedule = in_step()
    schedule.nack_sent(1.0, 10)
    schedule.missing(1.01, is_news=True)
    assert schedule.due == 1.01 + NACK_DELAY


def test_vain_questions_are_repeated_ever_slower() -> None:
    schedule = in_step()
    now = 0.0
    gaps = []
    for _ in range(10):
        schedule.nack_sent(now, 10)
        gaps.append(round(schedule.due - now, 6))
        now = schedule.due
    assert gaps[:3] == [NACK_REPEAT_FIRST, 2 * NACK_REPEAT_FIRST, 4 * NACK_REPEAT_FIRST]
    assert gaps[-1] == NACK_REPEAT_MAX


def test_the_time_to_repeat_is_learnt_from_the_answers() -> None:
    """On a fast link a lost repair is asked for soon, on a slow one not before its answer can be here."""
    fast, slow = in_step(), in_step()
    now = 0.0
    for number in range(1, 20):
        fast.nack_sent(now, number)
        fast.progress(now + 0.0004, number)
        slow.nack_sent(now, number)
        slow.progress(now + 0.3, number)
        now += 1.0
    fast.nack_sent(now, 20)
    slow.nack_sent(now, 20)
    assert round(fast.repeat_due - now, 6) == NACK_REPEAT_MIN
    assert 0.55 < slow.repeat_due - now < 0.7


def test_fresh_samples_say_nothing_about_the_time_of_answers() -> None:
    schedule = in_step()
    schedule.nack_sent(0.0, 10)
    schedule.progress(0.0001, 11)  # was not asked for
    assert schedule.repeat_due == NACK_REPEAT_FIRST


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
