"""SpdpAnnouncer: when to announce ourselves, where to, and whom to call after an outage."""

from __future__ import annotations

import itertools
import math

import pytest

from ddsi.discovery.spdp import SpdpAnnouncer
from ddsi.structure.locator import Locator

GROUP = Locator.udp_v4("239.255.0.1", 7400)
PEER = Locator.udp_v4("10.0.0.9", 7410)


def announcer(*destinations: Locator, period: float = 4.0, jitter: float = 0.5) -> SpdpAnnouncer:
    """``jitter``: what the random source says, from 0 to 1; 0.5 is none."""
    return SpdpAnnouncer(destinations or (GROUP,), period, lambda: jitter)


def times(spdp: SpdpAnnouncer, until: float) -> list[float]:
    """When it announces to its destinations."""
    found = []
    while (due := spdp.next_deadline()) <= until:
        if GROUP in spdp.due_destinations(due):
            found.append(round(due, 6))
    return found


def test_nothing_is_due_before_the_start() -> None:
    assert announcer().next_deadline() == math.inf


def test_six_in_quick_succession_then_one_a_period() -> None:
    """Nobody knows who listens already, so the first ones come quickly, ever slower."""
    spdp = announcer()
    spdp.start(10.0)
    assert times(spdp, 30.0) == [10.0, 10.1, 10.3, 10.7, 11.5, 13.1, 17.1, 21.1, 25.1, 29.1]


def test_a_short_period_is_not_exceeded_by_the_quick_ones() -> None:
    spdp = announcer(period=0.3)
    spdp.start(0.0)
    assert times(spdp, 1.4) == [0.0, 0.1, 0.3, 0.6, 0.9, 1.2]


@pytest.mark.parametrize(("jitter", "interval"), [(0.0, 3.6), (0.5, 4.0), (1.0, 4.4)])
def test_the_period_varies_by_a_tenth(jitter: float, interval: float) -> None:
    """Hosts that started together do not stay together."""
    spdp = announcer(jitter=jitter)
    spdp.start(0.0)
    announced = times(spdp, 60.0)
    assert [round(later - earlier, 6) for earlier, later in itertools.pairwise(announced[6:])] == [interval] * (
        len(announced) - 7
    )


def test_what_changed_is_announced_at_once() -> None:
    spdp = announcer()
    spdp.start(0.0)
    times(spdp, 20.0)
    spdp.announce_soon(20.0)
    assert spdp.next_deadline() == 20.0


def test_a_lost_participant_is_called_ever_less_often_for_ten_minutes() -> None:
    spdp = announcer(period=1e6)
    spdp.start(0.0)
    times(spdp, 100.0)
    spdp.participant_lost((PEER,), 100.0)
    called = []
    while spdp.next_deadline() < 2000:
        due = spdp.next_deadline()
        assert spdp.due_destinations(due) == [PEER]
        called.append(due)
    assert called[0] == 101.0
    gaps = [later - earlier for earlier, later in itertools.pairwise(called)]
    assert gaps == sorted(gaps)
    assert max(gaps) == 30.0
    assert 690 < called[-1] < 740
    assert len(called) < 40


def test_a_participant_that_is_found_again_is_not_called_any_more() -> None:
    spdp = announcer(period=1e6)
    spdp.start(0.0)
    spdp.due_destinations(0.0)
    spdp.participant_lost((PEER,), 0.0)
    spdp.participant_found((PEER,))
    spdp.participant_found((GROUP,))  # nobody asked for it
    times(spdp, 10)
    assert spdp.next_deadline() > 1000


def test_who_cannot_be_reached_is_not_called() -> None:
    spdp = announcer(period=1e6)
    spdp.participant_lost((), 0.0)
    assert spdp.next_deadline() == math.inf


def test_only_so_many_lost_ones_are_called() -> None:
    spdp = announcer(period=1e6)
    for number in range(500):
        spdp.participant_lost((Locator.udp_v4("10.0.0.1", 1000 + number),), 0.0)
    called = spdp.due_destinations(1.0)
    assert len(called) == 64
    assert called[-1].port == 1499, "the latest"


def test_peers_and_group_are_announced_to_together() -> None:
    spdp = announcer(GROUP, PEER)
    spdp.start(0.0)
    assert spdp.due_destinations(0.0) == [GROUP, PEER]
    assert spdp.due_destinations(0.05) == []
