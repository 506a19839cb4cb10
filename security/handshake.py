"""The authentication of one remote participant, as a state machine.  DDS-Security 1.1 §8.3.4, §8.8.2.

Both sides run one of these.  The participant with the lower Guid begins: request, reply, final.  The topic that carries
the messages loses, repeats and reorders them, and anybody can write to it.  From that follow the rules:

* whoever waits says again what it said last, unchanged, ever more slowly (:data:`RESEND_FIRST_S` to
  :data:`RESEND_LAST_S`);
* these messages are large, and best effort repairs no fragments.  So halfway to each repetition the fragments are sent
  again under the number that they had, and those that came of both times make up one message (:class:`Complete`).  The
  repetition itself has a new number, since some readers (Fast DDS) pass on no number twice, and its receiver may need
  to hear it again.  Who has said nothing yet is sent no fragments twice: it may be a victim of whoever announced it;
* a repeated request gets the same reply again and a repeated reply the same final, also when all is done;
* the final is said again until the peer shows that it has the secret (:meth:`Handshake.confirm`): nothing answers it;
* a message that does not verify changes nothing: its reason is reported, and for a moment nothing more is looked at,
  so that a flood of bad messages costs little;
* another request while the final is awaited is answered too, beside the first: requests are not signed, so neither
  of the two can be said to be the true one before its final comes (:data:`MAX_REPLIES`); and both may be;
* after :data:`LIMIT_S` it is given up and begun anew, later each time;
* one that is paused, as others have their turn (:mod:`.waiting_room`), says nothing unasked and keeps what it reached;
* one that is done answers repeats and nothing else.  Who has lost his state begins another, beside the first, which
  takes its place when it is done as well (:meth:`Handshake.is_begun_anew_by`).

:data:`TRANSITIONS` is the whole machine; the rest of the file does what its actions say.  It knows no socket, clock or
thread: inputs are calls, and each returns what is to be done.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import field
from enum import Enum
from typing import Final

from ddsi.spi import Refused
from ddsi.structure.dataclass import dataclass

from .authentication_plugin import Authentication, HandshakeStep, RemoteIdentity, ValidationResult
from .generic_message import AUTH, AUTH_REQUEST, NO_MESSAGE, GenericMessage, MessageIdentity
from .handles import HandshakeHandle, IdentityHandle, Pending
from .tokens import NIL, DataHolder

__all__ = [
    "LIMIT_S",
    "MAX_REPLIES",
    "RESEND_FIRST_S",
    "RESEND_LAST_S",
    "TRANSITIONS",
    "Action",
    "Authenticated",
    "Complete",
    "Event",
    "Failed",
    "Handshake",
    "Output",
    "Reported",
    "Send",
    "State",
    "Work",
]

GREETING_S: Final = 0.01
"""Until the first request: the peer must have learnt of us, or it ignores what we write."""
RESEND_FIRST_S: Final = 0.1
RESEND_LAST_S: Final = 1.0
LIMIT_S: Final = 100.0
"""How long one attempt may take (Cyclone DDS: the same)."""
RETRY_FIRST_S: Final = 10.0
RETRY_LAST_S: Final = 300.0
MAX_REPLIES: Final = 4
MAX_FINALS: Final = 20
"""A peer that needs no keys of ours, and has none for us, never confirms."""
_DEAF_FIRST_S: Final = 0.005
_DEAF_LAST_S: Final = 1.0


class State(Enum):
    VALIDATING = "the identity that the peer announces is looked at"
    GREETING = "we begin, when the peer had a moment to learn of us"
    REQUESTING = "our request is being made"
    AWAIT_REPLY = "the request is sent"
    VERIFYING_REPLY = "the peer's reply is being verified"
    AWAIT_REQUEST = "the peer begins"
    REPLYING = "our reply is being made"
    AWAIT_FINAL = "the reply is sent"
    REPLYING_AGAIN = "a second request came; a reply to it is being made"
    VERIFYING_FINAL = "the peer's final is being verified"
    VERIFYING_ANOTHER = "a final to another reply of ours is being verified"
    AUTHENTICATED = "the peer has proved who it is"
    FAILED = "given up; begun anew after a pause"


class Event(Enum):
    WE_BEGIN = "our Guid is the lower one"
    PEER_BEGINS = "the peer's Guid is the lower one"
    READY = "the plugin made or verified a message"
    REFUSED = "the plugin refuses what it was given"
    AUTH_REQUEST = "the peer asks to be authenticated"
    REQUEST = "a request came"
    REQUEST_AGAIN = "the request that we answered came again"
    REPLY = "a reply came"
    REPLY_AGAIN = "the reply that we verified came again"
    FINAL = "a final came"
    TIMEOUT = "the timer of this state"
    HALF_TIME = "half of the time until the last message will be said again"
    LIMIT = "the attempt takes too long"


class Action(Enum):
    WAIT = "set the timer"
    SEND = "send the message, and set the timer"
    RESEND = "send the last message again, and set a longer timer"
    COMPLETE = "send the fragments of the last message again, as parts of the same"
    MAKE_REQUEST = "let the plugin make a request"
    MAKE_REPLY = "let the plugin make a reply"
    VERIFY = "let the plugin verify the message"
    FINISH = "send the final, if it is ours to send; the peer is authenticated"
    REPORT = "tell why, and be deaf for a moment"
    GIVE_UP = "tell why, and set the timer for another attempt"
    BEGIN = "let the plugin look at the peer's identity"


_S, _E, _A = State, Event, Action

# What is not listed is ignored: a message that comes out of turn, or while the plugin works, will come again.
TRANSITIONS: Final[dict[tuple[State, Event], tuple[Action, State]]] = {
    (_S.VALIDATING, _E.WE_BEGIN): (_A.WAIT, _S.GREETING),
    (_S.VALIDATING, _E.PEER_BEGINS): (_A.SEND, _S.AWAIT_REQUEST),
    (_S.VALIDATING, _E.REFUSED): (_A.GIVE_UP, _S.FAILED),
    # the initiator
    (_S.GREETING, _E.TIMEOUT): (_A.MAKE_REQUEST, _S.REQUESTING),
    (_S.GREETING, _E.AUTH_REQUEST): (_A.MAKE_REQUEST, _S.REQUESTING),
    (_S.REQUESTING, _E.READY): (_A.SEND, _S.AWAIT_REPLY),
    (_S.REQUESTING, _E.REFUSED): (_A.GIVE_UP, _S.FAILED),
    (_S.AWAIT_REPLY, _E.TIMEOUT): (_A.RESEND, _S.AWAIT_REPLY),
    (_S.AWAIT_REPLY, _E.HALF_TIME): (_A.COMPLETE, _S.AWAIT_REPLY),
    (_S.AWAIT_REPLY, _E.REPLY): (_A.VERIFY, _S.VERIFYING_REPLY),
    (_S.AWAIT_REPLY, _E.LIMIT): (_A.GIVE_UP, _S.FAILED),
    (_S.VERIFYING_REPLY, _E.READY): (_A.FINISH, _S.AUTHENTICATED),
    (_S.VERIFYING_REPLY, _E.REFUSED): (_A.REPORT, _S.AWAIT_REPLY),
    (_S.AUTHENTICATED, _E.REPLY_AGAIN): (_A.RESEND, _S.AUTHENTICATED),
    (_S.AUTHENTICATED, _E.TIMEOUT): (_A.RESEND, _S.AUTHENTICATED),
    (_S.AUTHENTICATED, _E.HALF_TIME): (_A.COMPLETE, _S.AUTHENTICATED),
    # the replier
    (_S.AWAIT_REQUEST, _E.TIMEOUT): (_A.RESEND, _S.AWAIT_REQUEST),
    (_S.AWAIT_REQUEST, _E.REQUEST): (_A.MAKE_REPLY, _S.REPLYING),
    (_S.AWAIT_REQUEST, _E.LIMIT): (_A.GIVE_UP, _S.FAILED),
    (_S.REPLYING, _E.READY): (_A.SEND, _S.AWAIT_FINAL),
    (_S.REPLYING, _E.REFUSED): (_A.REPORT, _S.AWAIT_REQUEST),
    (_S.AWAIT_FINAL, _E.TIMEOUT): (_A.RESEND, _S.AWAIT_FINAL),
    (_S.AWAIT_FINAL, _E.HALF_TIME): (_A.COMPLETE, _S.AWAIT_FINAL),
    (_S.AWAIT_FINAL, _E.REQUEST_AGAIN): (_A.RESEND, _S.AWAIT_FINAL),
    (_S.AWAIT_FINAL, _E.REQUEST): (_A.MAKE_REPLY, _S.REPLYING_AGAIN),
    (_S.AWAIT_FINAL, _E.FINAL): (_A.VERIFY, _S.VERIFYING_FINAL),
    (_S.AWAIT_FINAL, _E.LIMIT): (_A.GIVE_UP, _S.FAILED),
    (_S.REPLYING_AGAIN, _E.READY): (_A.SEND, _S.AWAIT_FINAL),
    (_S.REPLYING_AGAIN, _E.REFUSED): (_A.REPORT, _S.AWAIT_FINAL),
    (_S.VERIFYING_FINAL, _E.READY): (_A.FINISH, _S.AUTHENTICATED),
    (_S.VERIFYING_FINAL, _E.REFUSED): (_A.REPORT, _S.AWAIT_FINAL),
    (_S.AUTHENTICATED, _E.FINAL): (_A.VERIFY, _S.VERIFYING_ANOTHER),
    (_S.VERIFYING_ANOTHER, _E.READY): (_A.FINISH, _S.AUTHENTICATED),
    (_S.VERIFYING_ANOTHER, _E.REFUSED): (_A.REPORT, _S.AUTHENTICATED),
    # another attempt
    (_S.FAILED, _E.TIMEOUT): (_A.BEGIN, _S.VALIDATING),
}

_KINDS: Final = {"Req": Event.REQUEST, "Reply": Event.REPLY, "Final": Event.FINAL}
_EXPECTED: Final = {
    State.AWAIT_REQUEST: Event.REQUEST,
    State.AWAIT_REPLY: Event.REPLY,
    State.AWAIT_FINAL: Event.FINAL,
}


# --- what is to be done ---------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Send:
    """Write a message to the peer on the stateless topic."""

    message_class_id: str
    token: DataHolder
    related: MessageIdentity = NO_MESSAGE


@dataclass(frozen=True, slots=True)
class Complete:
    """Send the fragments of that message again under its number; nothing if it had none, or is not the last one."""

    send: Send


@dataclass(frozen=True, slots=True)
class Work:
    """Run the job, and give its result to :meth:`Handshake.worked`."""

    job: Callable[[], object] = field(repr=False)


@dataclass(frozen=True, slots=True)
class Authenticated:
    """The peer is who it says; ``handle`` gives the shared secret and its credentials, instead of any before."""

    handle: HandshakeHandle


@dataclass(frozen=True, slots=True)
class Reported:
    """A message was refused, for a reason that may be the sender's malice; the handshake goes on."""

    reason: str


@dataclass(frozen=True, slots=True)
class Failed:
    """The attempt is over; there will be another in ``retry_s`` seconds."""

    reason: str
    retry_s: float


Output = Send | Complete | Work | Authenticated | Reported | Failed


@dataclass(frozen=True, slots=True)
class _Exchange:
    """A message that we answered (or began with), and the plugin's handle of it."""

    received: DataHolder
    sent: Send
    handle: HandshakeHandle


class Handshake:
    """With one remote participant.  ``jitter()`` gives numbers from 0 to 1, which keep crowds from marching in step."""

    def __init__(
        self,
        authentication: Authentication,
        local_identity: IdentityHandle,
        *,
        validate: Callable[[DataHolder], RemoteIdentity | Refused | Pending[RemoteIdentity | Refused]],
        participant_data: Callable[[], bytes],
        jitter: Callable[[], float],
    ) -> None:
        """``validate(auth request of the peer)`` asks the plugin about the remote identity."""
        self._authentication = authentication
        self._local_identity = local_identity
        self._validate = validate
        self._participant_data = participant_data
        self._jitter = jitter
        self.state = State.VALIDATING
        self.remote_identity: IdentityHandle | None = None
        self._out: list[Output] = []
        self._due = self._half_due = math.inf
        self._limit = math.inf
        self._resend_s = RESEND_FIRST_S
        self._finals = 0
        self._has_spoken = False
        self._is_confirmed = False
        self._is_begun = self._is_paused = False
        self._retry_s = RETRY_FIRST_S
        self._deaf_until = -math.inf
        self._deaf_s = _DEAF_FIRST_S
        self._last_reason = ""
        self._auth_request = NIL  # the peer's
        self._last_sent: Send | None = None
        self._exchanges: list[_Exchange] = []  # not verified yet
        self._done: _Exchange | None = None
        self._message: GenericMessage | None = None  # being worked on
        self._tried = 0  # how many exchanges the final in work did not fit
        self._request: DataHolder | None = None  # the one that our verified reply answered

    # --- inputs ------------------------------------------------------------------------------------------

    def begin(self, now: float) -> list[Output]:
        """The participant was discovered."""
        self._is_begun = True
        self._limit = now + LIMIT_S
        self._begin(now)
        return self._drain()

    def receive(self, message: GenericMessage, now: float) -> list[Output]:
        """A message of the peer, or of somebody who says so, on the stateless topic."""
        if len(message.message_data) != 1:
            return []
        self._has_spoken = True
        token = message.message_data[0]
        if message.message_class_id == AUTH_REQUEST:
            self._auth_request = token
            self._step(Event.AUTH_REQUEST, now)
        elif now >= self._deaf_until or self._is_known(token):
            event = self._event_of(token)
            if event is not None and (self.state, event) in TRANSITIONS:
                self._message = message
                self._step(event, now)
        return self._drain()

    def is_begun_anew_by(self, message: GenericMessage) -> bool:
        """Does the peer, with whom all was done, want another handshake, as it does not know of this one any more?"""
        if self.state is not State.AUTHENTICATED or len(message.message_data) != 1:
            return False
        token = message.message_data[0]
        if message.message_class_id == AUTH_REQUEST:
            return self._request is None and token != self._auth_request
        return self._request is not None and self._event_of(token) is Event.REQUEST and token != self._request

    def worked(self, result: object, now: float) -> list[Output]:
        """The result of the job that a :class:`Work` asked for."""
        self._settle(result, now)
        return self._drain()

    def confirm(self) -> None:
        """Something came under the secret that the two share: the peer has all that it needs."""
        if self.state is State.AUTHENTICATED:
            self._is_confirmed = True
            self._due = self._half_due = math.inf

    def handle_timeout(self, now: float) -> list[Output]:
        if now >= self._limit and (self.state, Event.LIMIT) in TRANSITIONS:
            self._last_reason = self._last_reason or f"no {self._missing()} came within {LIMIT_S:g} s"
            self._step(Event.LIMIT, now)
        elif now >= self._due:
            self._due = self._half_due = math.inf
            self._step(Event.TIMEOUT, now)
        elif now >= self._half_due:
            self._half_due = math.inf
            self._step(Event.HALF_TIME, now)
        return self._drain()

    def pause(self) -> None:
        """Say nothing unasked until :meth:`resume`.  Time goes on: the limit of the attempt stays where it is.

        Of several replies that wait for their final the latest is kept: who waits should cost little.
        """
        self._is_paused = True
        self._due = self._half_due = math.inf
        if self.state is State.AWAIT_FINAL:
            for exchange in self._exchanges[:-1]:
                self._authentication.return_handshake_handle(exchange.handle)
            del self._exchanges[:-1]

    def resume(self, now: float) -> list[Output]:
        """Begin, begin anew, or say again what was said last."""
        self._is_paused = False
        if not self._is_begun:
            return self.begin(now)
        if (self.state, Event.TIMEOUT) not in TRANSITIONS:
            return []
        self._resend_s = RESEND_FIRST_S / 2
        self._due = now
        return self.handle_timeout(now)

    @property
    def is_done(self) -> bool:
        """Authenticated; what comes now are repeats, and finals to other replies of ours."""
        return self.state in (State.AUTHENTICATED, State.VERIFYING_ANOTHER)

    def next_deadline(self) -> float:
        due = min(self._due, self._half_due)
        return min(due, self._limit) if (self.state, Event.LIMIT) in TRANSITIONS else due

    def close(self) -> None:
        """The peer is gone: whatever the plugin holds of it is returned."""
        for exchange in [*self._exchanges, *([self._done] if self._done is not None else [])]:
            self._authentication.return_handshake_handle(exchange.handle)
        self._exchanges.clear()
        self._done = None
        if self.remote_identity is not None:
            self._authentication.return_identity_handle(self.remote_identity)
            self.remote_identity = None

    # --- the machine -------------------------------------------------------------------------------------

    def _step(self, event: Event, now: float) -> None:
        transition = TRANSITIONS.get((self.state, event))
        if transition is None:
            return
        action, self.state = transition
        match action:
            case Action.WAIT:
                self._due = now + GREETING_S
            case Action.SEND:
                self._resend_s = RESEND_FIRST_S
                self._send(now)
            case Action.RESEND:
                self._resend_s = min(2 * self._resend_s, RESEND_LAST_S)
                self._send(now)
            case Action.COMPLETE:
                if self._last_sent is not None:
                    self._out.append(Complete(self._last_sent))
            case Action.MAKE_REQUEST:
                self._make_request(now)
            case Action.MAKE_REPLY:
                if self.state is State.REPLYING_AGAIN:
                    self._be_deaf(now)
                self._make_reply(now)
            case Action.VERIFY:
                self._tried = 0
                self._verify(now)
            case Action.FINISH:
                self._finish(now)
            case Action.REPORT:
                self._report(now)
            case Action.GIVE_UP:
                self._give_up(now)
            case Action.BEGIN:
                self._limit = now + LIMIT_S
                self._begin(now)

    def _begin(self, now: float) -> None:
        self._do(self._validate(self._auth_request), now)

    def _make_request(self, now: float) -> None:
        self._do(
            self._authentication.begin_handshake_request(
                self._local_identity, self._remote(), self._participant_data()
            ),
            now,
        )

    def _make_reply(self, now: float) -> None:
        self._do(
            self._authentication.begin_handshake_reply(
                self._token(), self._remote(), self._local_identity, self._participant_data()
            ),
            now,
        )

    def _verify(self, now: float) -> None:
        """A final is tried with each exchange that may have led to it, the latest first."""
        exchange = self._exchanges[-1 - self._tried]
        self._do(self._authentication.process_handshake(self._token(), exchange.handle), now)

    def _do(self, result: object, now: float) -> None:
        """A plugin's answer: act on it, or let it be worked out."""
        if isinstance(result, Pending):
            self._out.append(Work(result.job))
        else:
            self._settle(result, now)

    def _settle(self, result: object, now: float) -> None:
        match result:
            case RemoteIdentity():
                self._identified(result, now)
            case HandshakeStep():
                self._stepped(result)
                self._step(Event.READY, now)
            case Refused(reason):
                is_final = self.state in (State.VERIFYING_FINAL, State.VERIFYING_ANOTHER)
                if is_final and self._tried + 1 < len(self._exchanges):
                    self._tried += 1
                    self._verify(now)
                    return
                self._last_reason = reason
                self._step(Event.REFUSED, now)

    def _identified(self, remote: RemoteIdentity, now: float) -> None:
        self.remote_identity = remote.handle
        if remote.result is ValidationResult.PENDING_HANDSHAKE_REQUEST:
            self._step(Event.WE_BEGIN, now)
            return
        token = remote.auth_request_token
        self._last_sent = Send(AUTH_REQUEST, token) if token != NIL else None
        self._step(Event.PEER_BEGINS, now)

    def _stepped(self, step: HandshakeStep) -> None:
        """The plugin made or verified a message: remember with what to answer, should the peer's come again."""
        received = self._token() if self._message is not None else NIL
        related = self._message.message_identity if self._message is not None else NO_MESSAGE
        sent = Send(AUTH, step.message, related) if step.message is not None else None
        if self.state in (State.VERIFYING_REPLY, State.VERIFYING_FINAL, State.VERIFYING_ANOTHER):
            chosen = self._exchanges.pop(-1 - self._tried)
            self._request = chosen.received if self.state is not State.VERIFYING_REPLY else None
            if self._done is not None:
                self._authentication.return_handshake_handle(self._done.handle)
            self._done = _Exchange(received, sent or chosen.sent, step.handle)
        elif sent is not None:
            if len(self._exchanges) == MAX_REPLIES:
                self._authentication.return_handshake_handle(self._exchanges.pop(0).handle)
            self._exchanges.append(_Exchange(received, sent, step.handle))
        self._last_sent = sent
        self._message = None

    def _finish(self, now: float) -> None:
        self._due = self._half_due = self._limit = math.inf
        self._resend_s = RESEND_FIRST_S
        if self._last_sent is not None:
            self._send(now)
        self._last_reason = ""
        assert self._done is not None
        self._out.append(Authenticated(self._done.handle))

    def _be_deaf(self, now: float) -> None:
        self._deaf_until = now + self._deaf_s
        self._deaf_s = min(2 * self._deaf_s, _DEAF_LAST_S)

    def _report(self, now: float) -> None:
        self._be_deaf(now)
        self._out.append(Reported(self._last_reason))
        self._message = None
        if self._last_sent is not None:
            self._set_resend(now)

    def _give_up(self, now: float) -> None:
        self._out.append(Failed(self._last_reason, self._retry_s))
        self._due = now + self._retry_s * (1 + 0.1 * self._jitter())
        self._retry_s = min(2 * self._retry_s, RETRY_LAST_S)
        self._deaf_s, self._deaf_until = _DEAF_FIRST_S, -math.inf
        self._last_reason = ""
        self._last_sent = None
        self._auth_request = NIL
        self.close()

    # --- small parts -------------------------------------------------------------------------------------

    def _send(self, now: float) -> None:
        if self._last_sent is not None:
            self._out.append(self._last_sent)
        if self.state is State.AUTHENTICATED:
            self._finals += 1
        if not self._is_confirmed and self._finals < MAX_FINALS:
            self._set_resend(now)

    def _set_resend(self, now: float) -> None:
        if self._is_paused and not self.is_done:
            return
        interval = self._resend_s * (1 + 0.25 * self._jitter())
        self._due = now + interval
        if self._has_spoken:
            self._half_due = now + interval / 2

    def _event_of(self, token: DataHolder) -> Event | None:
        """What a token is to us.  A plugin that does not mark its tokens is taken to send what is expected."""
        kind = _KINDS.get(token.class_id.rpartition("+")[2], _EXPECTED.get(self.state))
        if kind is Event.REQUEST:
            for exchange in self._exchanges:
                if exchange.received == token:
                    self._last_sent = exchange.sent
                    return Event.REQUEST_AGAIN
        if self.state is not State.AUTHENTICATED:
            return kind
        is_repeated = self._done is not None and token == self._done.received
        if kind is Event.REPLY:
            return Event.REPLY_AGAIN if is_repeated else None
        return None if is_repeated or (kind is Event.FINAL and not self._exchanges) else kind

    def _is_known(self, token: DataHolder) -> bool:
        return any(exchange.received == token for exchange in self._exchanges)

    def _missing(self) -> str:
        return {State.AWAIT_REPLY: "reply", State.AWAIT_FINAL: "final"}.get(self.state, "request")

    def _token(self) -> DataHolder:
        assert self._message is not None
        return self._message.message_data[0]

    def _remote(self) -> IdentityHandle:
        assert self.remote_identity is not None
        return self.remote_identity

    def _drain(self) -> list[Output]:
        outputs, self._out = self._out, []
        return outputs
