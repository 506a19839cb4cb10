"""However a datagram is made, it costs at most ten times the steps of an honest one of its size.

Honest is a datagram full of small samples, which is the most work that anybody gives us for good reason.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import pytest

from ddsi.messages.data import Data
from ddsi.messages.interpreter import InfoSource
from ddsi.messages.raw_submessage import SubmessageKind, iterate_submessages
from ddsi.structure.builtin_entity_ids import (
    PARTICIPANT_STATELESS_MESSAGE_READER,
    PARTICIPANT_STATELESS_MESSAGE_WRITER,
)
from ddsi.structure.guid import GuidPrefix
from ddsi.trace.reasons import DropReason
from tests.engine.steps import steps_of
from tests.engine.wire import Stranger, sent
from tests.engine.worst import HONEST, MOST_OCTETS, WORST, listener
from tests.fuzz.session import Ear, Session, recorded

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


# --- to one with security, by somebody who has recorded what its peer said ------------------------------------------


def _full_of(one: bytes) -> bytes:
    head = recorded()[0][:20]
    return head + one * ((MOST_OCTETS - len(head)) // len(one))


def _envelopes(*, last: int = 0) -> bytes:
    """The shortest that was recorded, again and again; ``last`` is laid over its last octet, in the MAC's postfix."""
    found: list[bytes] = []
    for octets in recorded():
        start = -1
        for raw in iterate_submessages(octets):
            if raw.kind == SubmessageKind.SEC_PREFIX:
                start = raw.offset
            elif raw.kind == SubmessageKind.SEC_POSTFIX:
                found.append(octets[start : raw.end])
    one = min(found, key=len)
    return _full_of(one[:-8] + bytes([one[-8] ^ last]) + one[-7:])


def _messages(payload: bytes) -> bytes:
    ids = (PARTICIPANT_STATELESS_MESSAGE_READER, PARTICIPANT_STATELESS_MESSAGE_WRITER)
    return _full_of(Data(*ids, 9, None, payload).encode())


def _newcomers() -> bytes:
    """With the peer's tokens, which are no secret."""
    spdp, out = recorded()[0], bytearray(recorded()[0][:20])
    for number in range(MOST_OCTETS // (len(spdp) + 24)):
        prefix = GuidPrefix(b"\1\x55" + number.to_bytes(10, "big"))
        out += InfoSource((2, 4), b"\1\x55", prefix).encode() + spdp[20:].replace(spdp[8:20], prefix)
    return bytes(out)


SECURED: dict[str, Callable[[], bytes]] = {
    "envelopes again": _envelopes,
    "envelopes with a wrong MAC": lambda: _envelopes(last=1),
    "envelopes of nothing": lambda: _full_of(b"\x31\1\x14\0" + bytes(20) + b"\x32\1\x14\0" + bytes(20)),
    "messages of nothing": lambda: _messages(b"\0\1\0\0"),
    "messages of zeros": lambda: _messages(b"\0\1\0\0" + bytes(100)),
    "newcomers with tokens": _newcomers,
}


@pytest.mark.parametrize("name", SECURED)
def test_neither_does_one_to_a_secured_participant(name: str) -> None:
    octets = SECURED[name]()
    assert MOST_OCTETS * 0.9 < len(octets) <= MOST_OCTETS
    session = Session.make()
    bob = Ear(session.bob.engine)
    drops = bob.engine.drops.total()
    steps = steps_of(lambda: bob.hear(octets, session.alice.port.locator))
    assert steps <= MOST_TIMES * honest_steps(), f"{steps / honest_steps():.1f} times"
    assert bob.engine.drops.total() > drops


# --- and what is dropped for it -------------------------------------------------------------------------------------


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
