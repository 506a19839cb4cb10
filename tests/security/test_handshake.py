"""The handshake machine: two of them over a link that loses, repeats and reorders, and what strangers throw at one."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from random import Random

import pytest

from ddsi.spi import Refused
from ddsi.structure.guid import Guid
from ddsi_security.authentication_plugin import HandshakeStep, RemoteIdentity, ValidationResult
from ddsi_security.generic_message import AUTH, AUTH_REQUEST, GenericMessage, MessageIdentity
from ddsi_security.handles import HandshakeHandle, IdentityHandle, Pending
from ddsi_security.handshake import (
    LIMIT_S,
    MAX_FINALS,
    MAX_REPLIES,
    TRANSITIONS,
    Action,
    Authenticated,
    Complete,
    Event,
    Failed,
    Handshake,
    Output,
    Reported,
    Send,
    State,
    Work,
)
from ddsi_security.tokens import NIL, DataHolder

LOW, HIGH = Guid(b"\x01" * 12 + b"\0\0\1\xc1"), Guid(b"\x02" * 12 + b"\0\0\1\xc1")
CLASS = "DDS:Auth:Test:1.0"


@dataclass(eq=False)
class Exchange(HandshakeHandle):
    challenge: str
    theirs: str = ""
    is_returned: bool = False


class Plugin:
    """Proves nothing and checks everything: request c1, reply c1 c2, final c1 c2."""

    def __init__(self, name: str, *, slow: bool = False, begins: bool = False) -> None:
        self.name = name
        self.slow = slow
        self.begins = begins
        self.count = 0
        self.exchanges: list[Exchange] = []

    def validate(self, auth_request: DataHolder) -> RemoteIdentity | Refused | Pending[RemoteIdentity | Refused]:
        if self.begins:
            return RemoteIdentity(ValidationResult.PENDING_HANDSHAKE_REQUEST, IdentityHandle(), NIL)
        ask = DataHolder(f"{CLASS}+AuthReq") if auth_request == NIL else NIL
        return RemoteIdentity(ValidationResult.PENDING_HANDSHAKE_MESSAGE, IdentityHandle(), ask)

    def begin_handshake_request(self, *_: object) -> HandshakeStep | Pending[HandshakeStep]:
        exchange = self._exchange()
        return self._step(exchange, ValidationResult.PENDING_HANDSHAKE_MESSAGE, "Req", exchange.challenge, "")

    def begin_handshake_reply(self, token: DataHolder, *_: object) -> HandshakeStep | Refused | Pending[HandshakeStep]:
        theirs = token.property("c1")
        if not theirs:
            return Refused("a request without challenge")
        exchange = self._exchange()
        exchange.theirs = theirs
        return self._step(exchange, ValidationResult.PENDING_HANDSHAKE_MESSAGE, "Reply", theirs, exchange.challenge)

    def process_handshake(
        self, token: DataHolder, handle: HandshakeHandle
    ) -> HandshakeStep | Refused | Pending[HandshakeStep]:
        assert isinstance(handle, Exchange)
        first, second = token.property("c1") or "", token.property("c2") or ""
        if token.class_id.endswith("+Reply"):
            if first != handle.challenge or not second:
                return Refused("a reply to another request")
            return self._step(handle, ValidationResult.OK_FINAL_MESSAGE, "Final", first, second)
        if (first, second) != (handle.theirs, handle.challenge):
            return Refused("a final to another reply")
        return HandshakeStep(ValidationResult.OK, handle)

    def return_handshake_handle(self, handle: HandshakeHandle) -> None:
        assert isinstance(handle, Exchange)
        handle.is_returned = True

    def return_identity_handle(self, handle: IdentityHandle) -> None:
        """Nothing is kept."""

    def _exchange(self) -> Exchange:
        self.count += 1
        self.exchanges.append(Exchange(f"{self.name}{self.count}"))
        return self.exchanges[-1]

    def _step(
        self, exchange: Exchange, result: ValidationResult, kind: str, first: str, second: str
    ) -> HandshakeStep | Pending[HandshakeStep]:
        step = HandshakeStep(result, exchange, DataHolder(f"{CLASS}+{kind}", (("c1", first), ("c2", second))))
        return Pending(lambda: step) if self.slow else step


class Side:
    """A machine with what it wants done: ``sent``, ``completed`` (the fragments again), ``told`` (the rest)."""

    def __init__(self, guid: Guid, *, slow: bool = False) -> None:
        self.guid = guid
        self.plugin = Plugin("A" if guid == LOW else "B", slow=slow, begins=guid == LOW)
        self.machine = Handshake(
            self.plugin,  # type: ignore[arg-type]
            IdentityHandle(),
            validate=self.plugin.validate,
            participant_data=lambda: b"",
            jitter=lambda: 0.5,
        )
        self.sent: list[GenericMessage] = []
        self.completed: list[Send] = []
        self.told: list[Output] = []

    def do(self, outputs: list[Output], now: float) -> None:
        for output in outputs:
            if isinstance(output, Send):
                identity = MessageIdentity(self.guid, len(self.sent) + 1)
                self.sent.append(
                    GenericMessage(
                        message_identity=identity,
                        related_message_identity=output.related,
                        destination_participant_guid=HIGH if self.guid == LOW else LOW,
                        message_class_id=output.message_class_id,
                        message_data=(output.token,),
                    )
                )
            elif isinstance(output, Complete):
                self.completed.append(output.send)
            elif isinstance(output, Work):
                self.do(self.machine.worked(output.job(), now), now)
            else:
                self.told.append(output)

    def begin(self, now: float = 0.0) -> None:
        self.do(self.machine.begin(now), now)

    def receive(self, message: GenericMessage, now: float) -> None:
        self.do(self.machine.receive(message, now), now)

    def wait(self) -> float:
        """To this side's next deadline, past those at half time."""
        now = self.machine.next_deadline()
        outputs = self.machine.handle_timeout(now)
        self.do(outputs, now)
        return self.wait() if any(isinstance(output, Complete) for output in outputs) else now

    @property
    def is_authenticated(self) -> bool:
        return self.machine.state is State.AUTHENTICATED


def pair(*, slow: bool = False) -> tuple[Side, Side]:
    low, high = Side(LOW, slow=slow), Side(HIGH, slow=slow)
    low.begin()
    high.begin()
    return low, high


def token(kind: str, first: str = "", second: str = "", *, class_id: str = AUTH) -> GenericMessage:
    return GenericMessage(
        message_identity=MessageIdentity(LOW, 99),
        destination_participant_guid=HIGH,
        message_class_id=class_id,
        message_data=(DataHolder(f"{CLASS}+{kind}", (("c1", first), ("c2", second))),),
    )


def awaiting_final() -> tuple[Side, Side]:
    low, high = pair()
    low.wait()
    high.receive(low.sent[-1], 0.01)
    assert high.machine.state is State.AWAIT_FINAL
    return low, high


@pytest.mark.parametrize("slow", [False, True])
def test_three_messages_authenticate_both(slow: bool) -> None:
    low, high = pair(slow=slow)
    low.wait()
    high.receive(low.sent[-1], 0.01)
    low.receive(high.sent[-1], 0.02)
    high.receive(low.sent[-1], 0.03)
    assert low.is_authenticated
    assert high.is_authenticated
    kinds = [message.message_data[0].class_id.partition("+")[2] for message in [*low.sent, *high.sent]]
    assert kinds == ["Req", "Final", "AuthReq", "Reply"]
    assert low.told == [Authenticated(low.plugin.exchanges[0])]
    assert high.told == [Authenticated(high.plugin.exchanges[0])]


def test_reply_and_final_name_what_they_answer() -> None:
    low, high = pair()
    low.wait()
    high.receive(low.sent[-1], 0.01)
    low.receive(high.sent[-1], 0.02)
    assert high.sent[-1].related_message_identity == low.sent[0].message_identity
    assert low.sent[-1].related_message_identity == high.sent[-1].message_identity


def test_who_waits_says_again_the_same_ever_more_slowly() -> None:
    low, _ = pair()
    times = [low.wait() for _ in range(8)]
    assert len({message.message_data for message in low.sent}) == 1
    pauses = [later - earlier for earlier, later in pairwise(times)]
    assert [round(pause, 6) for pause in pauses] == sorted(round(pause, 6) for pause in pauses)
    assert pauses[0] < 0.2
    assert 1.0 <= pauses[-1] <= 1.25


def test_halfway_to_each_repetition_the_fragments_are_sent_again() -> None:
    low, high = awaiting_final()
    sent_at, half = 0.01, high.machine.next_deadline()
    repeated_at = high.wait()
    assert repeated_at - half == pytest.approx(half - sent_at)
    assert [send.token for send in high.completed] == [high.sent[-1].message_data[0]]
    low.receive(high.sent[-1], repeated_at)
    low.wait()
    assert [send.token for send in low.completed] == [low.sent[-1].message_data[0]], "the final"
    low.machine.confirm()
    assert low.machine.next_deadline() == float("inf")


def test_fragments_are_sent_again_only_to_who_has_said_something() -> None:
    low, high = pair()
    for _ in range(5):
        low.wait()
    assert not low.completed
    low.receive(high.sent[0], 2.0)
    low.wait()
    low.wait()
    assert {send.token for send in low.completed} == {low.sent[-1].message_data[0]}


def test_a_repeated_request_gets_the_same_reply() -> None:
    low, high = awaiting_final()
    high.receive(low.sent[-1], 0.02)
    assert high.sent[-1].message_data == high.sent[-2].message_data
    assert len(high.plugin.exchanges) == 1


def test_a_repeated_reply_gets_the_same_final_for_ever() -> None:
    low, high = awaiting_final()
    low.receive(high.sent[-1], 0.02)
    final = low.sent[-1]
    low.machine.confirm()
    low.receive(high.sent[-1], 500.0)
    assert low.sent[-1].message_data == final.message_data
    assert low.sent[-1] is not final
    assert low.told == [Authenticated(low.plugin.exchanges[0])]
    assert low.machine.next_deadline() == float("inf")


def test_the_final_is_said_again_until_the_peer_confirms_or_long_enough() -> None:
    low, high = awaiting_final()
    low.receive(high.sent[-1], 0.02)
    count = len(low.sent)
    low.wait()
    assert len(low.sent) == count + 1
    assert low.sent[-1].message_data == low.sent[-2].message_data
    while low.machine.next_deadline() < float("inf"):
        low.wait()
    assert len(low.sent) == count + MAX_FINALS - 1
    low, high = awaiting_final()
    low.receive(high.sent[-1], 0.02)
    low.machine.confirm()
    assert low.machine.next_deadline() == float("inf")


def test_a_bad_message_changes_nothing_and_is_reported() -> None:
    low, high = awaiting_final()
    high.receive(token("Final", "x", "y"), 0.02)
    assert high.told == [Reported("a final to another reply")]
    low.receive(high.sent[-1], 0.03)
    high.receive(low.sent[-1], 0.1)
    assert high.is_authenticated


def test_after_a_bad_message_it_is_deaf_for_a_moment_that_grows() -> None:
    _, high = awaiting_final()
    for index in range(1000):
        high.receive(token("Final", "x", str(index)), 0.02 + index * 0.001)
    assert 3 < len(high.told) < 12


def test_a_forged_request_does_not_displace_the_true_one() -> None:
    low, high = awaiting_final()
    true_reply = high.sent[-1]
    for index in range(MAX_REPLIES - 1):
        high.receive(token("Req", f"forged{index}"), 0.1 * (index + 1))
    assert len(high.plugin.exchanges) == MAX_REPLIES
    low.receive(true_reply, 0.5)
    high.receive(low.sent[-1], 0.6)
    assert high.is_authenticated
    assert isinstance(high.told[-1], Authenticated)
    assert high.told[-1].handle is high.plugin.exchanges[0]
    assert not any(exchange.is_returned for exchange in high.plugin.exchanges)
    high.machine.close()
    assert all(exchange.is_returned for exchange in high.plugin.exchanges)


def test_of_two_true_requests_the_one_whose_final_comes_last_counts() -> None:
    """A late request for authentication made the initiator begin twice."""
    low, high = awaiting_final()
    low.receive(high.sent[-1], 0.02)
    again = Side(LOW)
    again.plugin.count = 10
    again.begin(0.03)
    again.wait()
    high.receive(again.sent[-1], 0.05)
    second_reply = high.sent[-1]
    high.receive(low.sent[-1], 0.2)
    assert isinstance(high.told[-1], Authenticated)
    assert high.told[-1].handle is high.plugin.exchanges[0]
    again.receive(second_reply, 0.3)
    high.receive(again.sent[-1], 0.4)
    assert high.told[-1] == Authenticated(high.plugin.exchanges[1])
    assert high.plugin.exchanges[0].is_returned
    high.receive(again.sent[-1], 0.5)
    assert len(high.told) == 2


def test_replies_under_way_are_bounded() -> None:
    _, high = awaiting_final()
    for index in range(20):
        high.receive(token("Req", f"forged{index}"), 0.02 + 2 * index)
    assert len(high.plugin.exchanges) == 21
    assert sum(not exchange.is_returned for exchange in high.plugin.exchanges) == MAX_REPLIES


def test_a_flood_of_requests_is_answered_ever_more_slowly() -> None:
    _, high = awaiting_final()
    for index in range(1000):
        high.receive(token("Req", f"forged{index}"), 0.02 + index * 0.001)
    assert 3 < len(high.plugin.exchanges) < 12


def authenticated() -> tuple[Side, Side]:
    low, high = awaiting_final()
    low.receive(high.sent[-1], 0.02)
    high.receive(low.sent[-1], 0.03)
    assert low.is_authenticated
    assert high.is_authenticated
    return low, high


def test_another_request_begins_anew_and_a_late_copy_does_not() -> None:
    low, high = authenticated()
    request, final = low.sent
    assert high.machine.is_begun_anew_by(token("Req", "another"))
    assert not high.machine.is_begun_anew_by(request)
    assert not high.machine.is_begun_anew_by(final)
    assert not low.machine.is_begun_anew_by(request), "we begin, and nobody else"


def test_another_request_for_authentication_begins_anew() -> None:
    low, high = authenticated()
    assert low.machine.is_begun_anew_by(token("AuthReq", "another", class_id=AUTH_REQUEST))
    low.receive(high.sent[0], 0.1)
    assert not low.machine.is_begun_anew_by(high.sent[0])
    assert not high.machine.is_begun_anew_by(token("AuthReq", class_id=AUTH_REQUEST)), "it waits for a request"


def test_a_request_for_authentication_hurries_the_initiator() -> None:
    low, _ = pair()
    low.receive(token("AuthReq", class_id=AUTH_REQUEST), 0.001)
    assert low.machine.state is State.AWAIT_REPLY


def test_silence_ends_in_failure_and_in_another_attempt_after_a_pause() -> None:
    low, _ = pair()
    while low.machine.state is not State.FAILED:
        now = low.wait()
    assert LIMIT_S <= now < LIMIT_S + 3
    assert low.told == [Failed("no reply came within 100 s", 10.0)]
    assert low.plugin.exchanges[0].is_returned
    begun = low.wait()
    assert now + 10 <= begun <= now + 11.5
    while low.machine.state is not State.FAILED:
        low.wait()
    assert low.told[-1] == Failed("no reply came within 100 s", 20.0)


def test_an_identity_that_is_refused_is_given_up_at_once() -> None:
    low = Side(LOW)
    low.machine._validate = lambda _: Refused("class id DDS:Auth:Other")
    low.begin()
    assert low.told == [Failed("class id DDS:Auth:Other", 10.0)]


def test_messages_of_several_tokens_or_none_are_ignored() -> None:
    low, high = awaiting_final()
    low.receive(high.sent[-1], 0.02)
    for tokens in ((), low.sent[-1].message_data * 2):
        message = GenericMessage(
            message_identity=MessageIdentity(LOW, 7),
            destination_participant_guid=HIGH,
            message_class_id=AUTH,
            message_data=tokens,
        )
        high.receive(message, 0.03)
    assert high.machine.state is State.AWAIT_FINAL


@pytest.mark.parametrize("seed", range(200))
def test_loss_duplication_and_reordering_only_delay(seed: int) -> None:
    """Both sides begin at different times; half of all messages get lost, some come twice, some late."""
    dice = Random(seed)
    sides = {LOW: Side(LOW, slow=dice.random() < 0.5), HIGH: Side(HIGH, slow=dice.random() < 0.5)}
    queue: list[tuple[float, int, Guid, GenericMessage]] = []
    starts = {guid: dice.random() for guid in sides}
    begun: set[Guid] = set()
    seen = dict.fromkeys(sides, 0)
    now = 0.0
    for _ in range(2000):
        for guid, side in sides.items():
            for message in side.sent[seen[guid] :]:
                for _ in range(dice.choice((0, 0, 0, 1, 1, 2))):
                    queue.append((now + dice.random() * 0.5, len(queue), guid, message))
            seen[guid] = len(side.sent)
        queue.sort()
        waiting = {starts[guid] for guid in sides if guid not in begun} | {
            sides[guid].machine.next_deadline() for guid in begun
        }
        now = min([*waiting, *(entry[0] for entry in queue[:1])])
        if all(side.is_authenticated for side in sides.values()):
            break
        for guid, side in sides.items():
            if guid not in begun and starts[guid] <= now:
                begun.add(guid)
                side.begin(now)
            elif guid in begun and side.machine.next_deadline() <= now:
                side.do(side.machine.handle_timeout(now), now)
        while queue and queue[0][0] <= now:
            _, _, source, message = queue.pop(0)
            receiver = HIGH if source == LOW else LOW
            if receiver in begun:
                sides[receiver].receive(message, now)
    assert all(side.is_authenticated for side in sides.values()), f"seed {seed}, {now:.1f} s"
    low, high = sides[LOW], sides[HIGH]
    assert low.plugin.exchanges[0].challenge == high.plugin.exchanges[-1].theirs


def test_every_state_can_be_left_and_reached() -> None:
    """But for the last one, which is left with the participant."""
    assert {state for state, _ in TRANSITIONS} == set(State)
    assert {state for _, state in TRANSITIONS.values()} == set(State)
    assert {event for _, event in TRANSITIONS} == set(Event)
    assert {action for action, _ in TRANSITIONS.values()} == set(Action)


# --- others have their turn -----------------------------------------------------------------------------------------


def test_one_that_is_paused_says_nothing_unasked_and_still_answers() -> None:
    low, high = pair()
    low.wait()
    low.machine.pause()
    high.receive(low.sent[-1], 0.01)
    count = len(low.sent)
    low.do(low.machine.handle_timeout(50.0), 50.0)
    assert len(low.sent) == count
    low.receive(high.sent[-1], 51.0)
    assert low.is_authenticated
    assert low.machine.next_deadline() < 52.0, "its final is said again, until the peer confirms"


def test_one_that_resumes_says_again_what_it_said_last() -> None:
    low, _ = pair()
    low.wait()
    low.machine.pause()
    count = len(low.sent)
    low.do(low.machine.resume(30.0), 30.0)
    assert len(low.sent) == count + 1
    assert low.sent[-1].message_data == low.sent[-2].message_data
    assert 30.1 <= low.machine.next_deadline() <= 30.2


def test_a_pause_does_not_lengthen_the_attempt() -> None:
    _, high = pair()
    high.machine.pause()
    assert high.machine.next_deadline() == LIMIT_S
    assert high.wait() == LIMIT_S
    assert isinstance(high.told[-1], Failed)


def test_one_that_never_had_its_turn_begins_with_it() -> None:
    low = Side(LOW)
    low.do(low.machine.resume(5.0), 5.0)
    assert low.machine.state is State.GREETING


def test_while_it_is_paused_only_the_latest_reply_waits_for_its_final() -> None:
    low, high = awaiting_final()
    high.receive(token("Req", "forged"), 0.5)
    high.machine.pause()
    assert [exchange.is_returned for exchange in high.plugin.exchanges] == [True, False]
    high.do(high.machine.resume(2.0), 2.0)
    high.receive(low.sent[-1], 3.0)
    low.receive(high.sent[-1], 3.1)
    high.receive(low.sent[-1], 3.2)
    assert high.is_authenticated
