"""However a datagram is made, it costs at most ten times the steps of an honest one of its size.

Honest is a datagram full of small samples, which is the most work that anybody gives us for good reason.
"""

from __future__ import annotations

from functools import cache

import pytest

from ddsi.trace.reasons import DropReason
from tests.engine.steps import steps_of
from tests.engine.wire import Stranger, sent
from tests.engine.worst import HONEST, MOST_OCTETS, WORST, listener

MOST_TIMES = 10
MOST_SENT = 2 * MOST_OCTETS
"""Octets in answer, to a peer that has spoken from where it says that it lives."""


def cost(octets: bytes) -> tuple[int, int]:
    """The steps of hearing it and of acting upon it, and the octets that are sent for it."""
    participant, _, _ = listener()
    address = Stranger().address
    steps = steps_of(lambda: participant.receive_datagram(octets, address, 1.0))
    answers: list[int] = []
    steps += steps_of(lambda: answers.extend(len(each) * len(octets) for each, octets in sent(participant)))
    return steps, sum(answers)


@cache
def honest_steps() -> int:
    return cost(HONEST())[0]


def test_an_honest_datagram_of_that_size_holds_a_thousand_samples_and_all_arrive() -> None:
    """Else the comparison would be with nothing."""
    participant, _, reader = listener()
    participant.receive_datagram(HONEST(), Stranger().address, 1.0)
    assert reader.history is not None
    assert len(reader.history) > 1000
    assert participant.drops == {}


@pytest.mark.parametrize("name", WORST)
def test_no_datagram_costs_more_than_ten_times_an_honest_one(name: str) -> None:
    octets = WORST[name]()
    assert MOST_OCTETS * 0.6 < len(octets) <= MOST_OCTETS
    steps, answered = cost(octets)
    assert steps <= MOST_TIMES * honest_steps(), f"{steps / honest_steps():.1f} times"
    assert answered <= MOST_SENT


def test_what_is_too_much_for_one_message_is_counted_and_the_next_message_is_heard() -> None:
    participant, _, _ = listener()
    address = Stranger().address
    participant.receive_datagram(WORST["newcomers"](), address, 1.0)
    assert participant.drops[DropReason.OVERLOADED_MESSAGE] > 100
    before = len(participant.participants)
    assert before < 20
    friend = Stranger(7)
    participant.receive_datagram(friend.spdp(), friend.address, 1.0)
    assert len(participant.participants) == before + 1


def test_a_step_is_a_line_and_a_loop_has_as_many_as_it_has_turns() -> None:
    def loop(turns: int) -> None:
        for _ in range(turns):
            pass

    assert steps_of(lambda: loop(1000)) - steps_of(lambda: loop(500)) == 1000
