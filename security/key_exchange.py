"""The keys of pairs: ours go to each matched endpoint of a peer, and a pair is complete when the peer's have come.

DDS-Security 1.1 §8.8.9, §8.5.1.7-8.  Keys travel on the volatile secure topic, one message for a participant and one
for each pair of endpoints.  That topic and discovery are two streams, so a key may come before the endpoint that it is
for is known: such messages are kept, so many for each peer and so long, and are used when the pair is matched.

A pair waits for what it needs to decode the other side, and no longer:

* a reader of ours for the writer's keys, where its submessages or its payload are protected;
* a writer of ours for the reader's key, where submessages are protected.  For a protected payload alone it must not
  wait: Cyclone DDS's readers have no key then, and send none;
* both for the participant's key, where whole messages are protected.

A match may end and begin again while both endpoints live, as policies and rights change, and the two sides need not
agree on whether it ended: each judges by what it knows.  Therefore

* keys outlive the match: they are wiped when one of the two endpoints is gone.  Until the two match again nothing is
  protected or opened with them;
* who matches again sends its keys again, and they are the same, for a peer that has kept its match may look at the
  first only;
* keys that come once more say that the peer has matched anew, and may have thrown ours away: it is sent ours again.

The peer's keys may also have been lost here: they came too early and too many, or for an endpoint that was gone for a
moment.  So who waits in vain sends its own again, which is how it asks for the other's.

Only what a peer wrote under the key that the two share is looked at here, and it may speak for itself alone.
"""

from __future__ import annotations

import heapq
import itertools
import math
from collections.abc import Callable, Iterable, Sequence
from typing import Final, Protocol

from ddsi.spi import ADMITTED, PENDING, Admission, Refused
from ddsi.structure.dataclass import dataclass
from ddsi.structure.guid import GUID_UNKNOWN, Guid

from .generic_message import (
    DATAREADER_CRYPTO_TOKENS,
    DATAWRITER_CRYPTO_TOKENS,
    PARTICIPANT_CRYPTO_TOKENS,
    GenericMessage,
)
from .handles import DatareaderCryptoHandle, DatawriterCryptoHandle, ParticipantCryptoHandle
from .local_endpoint import VOLATILE, LocalEndpoint
from .plugins import Cryptographic
from .remote_participant import RemoteParticipant
from .tokens import CryptoToken

__all__ = ["EARLY_KEYS_S", "MAX_EARLY_KEYS", "KeyExchange", "Pair"]

MAX_EARLY_KEYS: Final = 512
"""Of one peer; as many pairs of endpoints may be under way at a time."""
EARLY_KEYS_S: Final = 300.0
"""Cyclone DDS keeps them as long."""
_ANSWER_AFTER_S: Final = 3.0
"""Keys that come sooner after ours were sent are the answer to ours.  Else two that match anew would never end."""
_ASK_FIRST_S: Final = 5.0
_MOST_ASKED: Final = 6
"""Each time after twice as long: for five minutes in all, as long as keys are kept for."""


CryptoHandle = DatawriterCryptoHandle | DatareaderCryptoHandle


@dataclass(slots=True, eq=False)
class Pair:
    """An endpoint of ours and one of a peer.  ``handle`` is the plugin's of the latter; None where nothing is keyed.

    ``needs_key``: it takes the peer's keys to open what it sends; ``has_key``: they have come.  ``is_open``: the two
    were said to be matched.  ``is_parted``: they are matched no more, and were not asked about since.
    """

    local: LocalEndpoint
    remote: Guid
    participant: RemoteParticipant
    handle: CryptoHandle | None
    needs_key: bool
    relay_only: bool
    has_key: bool = False
    is_open: bool = False
    is_parted: bool = False
    sent_at: float = -math.inf
    asking: int = 0
    """Which of the timers is its."""
    remote_entity: bytes = b""
    """Its entity id."""
    is_volatile: bool = False

    def __post_init__(self) -> None:
        self.remote_entity = bytes(self.remote[12:])
        self.is_volatile = self.local.is_volatile


class Outbox(Protocol):
    """Writes a key message on the volatile secure topic."""

    def __call__(
        self,
        remote: RemoteParticipant,
        message_class_id: str,
        tokens: Sequence[CryptoToken],
        *,
        destination_endpoint: Guid = GUID_UNKNOWN,
        source_endpoint: Guid = GUID_UNKNOWN,
    ) -> None: ...


class KeyExchange:
    """For one participant of ours.  ``decide(local, remote, admission)`` is called when a waiting pair is complete."""

    def __init__(
        self,
        cryptographic: Cryptographic,
        local_participant: ParticipantCryptoHandle,
        *,
        is_rtps_protected: bool,
        outbox: Outbox,
        decide: Callable[[Guid, Guid, Admission], None],
    ) -> None:
        self._cryptographic = cryptographic
        self._local_participant = local_participant
        self._is_rtps_protected = is_rtps_protected
        self._outbox = outbox
        self._decide = decide
        self.pairs: dict[tuple[Guid, Guid], Pair] = {}
        self.by_remote: dict[bytes, list[Pair]] = {}
        """The pairs of each remote endpoint, by its 16 octets."""
        self.by_handle: dict[CryptoHandle, Pair] = {}
        # When to ask for keys: time, number of the timer, for which pair, how often it has asked.
        self._timers: list[tuple[float, int, Pair, int]] = []
        self._timer_numbers = itertools.count(1)

    # --- pairs -------------------------------------------------------------------------------------------

    def match(
        self, local: LocalEndpoint, remote: Guid, participant: RemoteParticipant, now: float, *, relay_only: bool
    ) -> Admission:
        """Make a pair of two endpoints that may match.  PENDING until the peer's keys are there."""
        pair = self.pairs.get((local.guid, remote))
        if pair is not None and pair.is_parted and pair.relay_only != relay_only:
            self._remove(pair)
            pair = None
        is_known = pair is not None and not pair.is_parted
        if pair is None:
            pair = self._register(local, remote, participant, relay_only=relay_only)
        pair.is_parted = False
        if not is_known and not local.is_volatile:
            self._send_keys(pair, now)
            self._use_early(pair, now)
            if pair.needs_key and not pair.has_key:
                self._ask_at(now, pair, 0)
        pair.is_open = self._is_complete(pair)
        return ADMITTED if pair.is_open else PENDING

    def handle_timeout(self, now: float) -> None:
        """Ask for the keys that do not come.  The first time only says what time it is: a match happens at no time."""
        while self.next_deadline() <= now:
            _, _, pair, asked = heapq.heappop(self._timers)
            pair.asking = 0
            if asked:
                self._send_keys(pair, now)
            if asked < _MOST_ASKED:
                self._ask_at(now + _ASK_FIRST_S * 2**asked, pair, asked + 1)

    def next_deadline(self) -> float:
        while self._timers:
            due, number, pair, _ = self._timers[0]
            if pair.asking == number and not pair.has_key:
                return due
            heapq.heappop(self._timers)
        return math.inf

    def _ask_at(self, due: float, pair: Pair, asked: int) -> None:
        pair.asking = next(self._timer_numbers)
        heapq.heappush(self._timers, (due, pair.asking, pair, asked))

    def unmatch(self, local: Guid, remote: Guid) -> None:
        """The two are matched no more.  They may be again, so their keys are kept, and not used."""
        pair = self.pairs.get((local, remote))
        if pair is not None:
            pair.is_open, pair.is_parted, pair.asking = False, True, 0

    def remote_endpoint_lost(self, remote: Guid) -> None:
        """A peer's endpoint is gone: its keys are wiped."""
        for pair in list(self.by_remote.get(remote, ())):
            self._remove(pair)

    def endpoint_deleted(self, local: LocalEndpoint) -> None:
        for pair in [pair for pair in self.pairs.values() if pair.local is local]:
            self._remove(pair)
        if local.handle is not None:
            self._unregister(local.handle)

    def forget(self, participant: RemoteParticipant) -> None:
        """The participant is gone, and all its pairs with it.  The key that the two share goes last (§8.5.1.7.7)."""
        for pair in [pair for pair in self.pairs.values() if pair.participant is participant]:
            self._remove(pair)
        participant.early.clear()
        if participant.crypto is not None:
            self._cryptographic.unregister_participant(participant.crypto)
            participant.crypto = None
        participant.has_keys = False

    def begin_anew(self, participant: RemoteParticipant, volatile: Iterable[LocalEndpoint], now: float) -> None:
        """It authenticated anew, as it has lost what it knew of us.  The topic that carries keys begins by itself."""
        for local in volatile:
            remote = Guid.of(participant.guid.prefix, VOLATILE[local.guid.entity_id])
            self.match(local, remote, participant, now, relay_only=False)
            self._decide(local.guid, remote, ADMITTED)
        self.send_participant_keys(participant)

    def _register(
        self, local: LocalEndpoint, remote: Guid, participant: RemoteParticipant, *, relay_only: bool
    ) -> Pair:
        handle: CryptoHandle | None = None
        attributes, needs_key = local.attributes, False
        if local.handle is not None and participant.crypto is not None and participant.shared_secret is not None:
            if isinstance(local.handle, DatawriterCryptoHandle):
                handle = self._cryptographic.register_matched_remote_datareader(
                    local.handle, participant.crypto, participant.shared_secret, relay_only=relay_only
                )
                needs_key = attributes.is_submessage_protected
            else:
                handle = self._cryptographic.register_matched_remote_datawriter(
                    local.handle, participant.crypto, participant.shared_secret
                )
                needs_key = attributes.is_submessage_protected or attributes.is_payload_protected
        pair = Pair(local, remote, participant, handle, needs_key and not local.is_volatile, relay_only)
        self.pairs[(local.guid, remote)] = pair
        self.by_remote.setdefault(bytes(remote), []).append(pair)
        if handle is not None:
            self.by_handle[handle] = pair
        return pair

    def _remove(self, pair: Pair) -> None:
        """Its keys are wiped."""
        pair.asking = 0
        del self.pairs[pair.local.guid, pair.remote]
        others = self.by_remote[pair.remote]
        others.remove(pair)
        if not others:
            del self.by_remote[pair.remote]
        if pair.handle is not None:
            del self.by_handle[pair.handle]
            self._unregister(pair.handle)

    def _is_complete(self, pair: Pair) -> bool:
        needs_participant_key = self._is_rtps_protected and not pair.local.is_volatile
        return (pair.has_key or not pair.needs_key) and (pair.participant.has_keys or not needs_participant_key)

    def _unregister(self, handle: CryptoHandle) -> None:
        if isinstance(handle, DatawriterCryptoHandle):
            self._cryptographic.unregister_datawriter(handle)
        else:
            self._cryptographic.unregister_datareader(handle)

    # --- ours to them ------------------------------------------------------------------------------------

    def send_participant_keys(self, participant: RemoteParticipant) -> None:
        """Always, and at once: a peer that began the handshake waits for ours before it sends its own (Cyclone DDS)."""
        assert participant.crypto is not None
        tokens = self._cryptographic.create_local_participant_crypto_tokens(self._local_participant, participant.crypto)
        self._post(participant, PARTICIPANT_CRYPTO_TOKENS, tokens, GUID_UNKNOWN, GUID_UNKNOWN)

    def _send_keys(self, pair: Pair, now: float) -> None:
        pair.sent_at = now
        local, remote = pair.local.handle, pair.handle
        if isinstance(local, DatawriterCryptoHandle) and isinstance(remote, DatareaderCryptoHandle):
            tokens = self._cryptographic.create_local_datawriter_crypto_tokens(local, remote)
            self._post(pair.participant, DATAWRITER_CRYPTO_TOKENS, tokens, pair.remote, pair.local.guid)
        elif isinstance(local, DatareaderCryptoHandle) and isinstance(remote, DatawriterCryptoHandle):
            tokens = self._cryptographic.create_local_datareader_crypto_tokens(local, remote)
            self._post(pair.participant, DATAREADER_CRYPTO_TOKENS, tokens, pair.remote, pair.local.guid)

    def _post(
        self,
        participant: RemoteParticipant,
        message_class_id: str,
        tokens: Sequence[CryptoToken],
        destination_endpoint: Guid,
        source_endpoint: Guid,
    ) -> None:
        if tokens:
            self._outbox(
                participant,
                message_class_id,
                tokens,
                destination_endpoint=destination_endpoint,
                source_endpoint=source_endpoint,
            )
            self._cryptographic.return_crypto_tokens(tokens)

    # --- theirs to us ------------------------------------------------------------------------------------

    def receive(self, participant: RemoteParticipant, message: GenericMessage, now: float) -> Refused | None:
        """A key message of this participant, by which pairs may become complete."""
        if message.message_class_id == PARTICIPANT_CRYPTO_TOKENS:
            return self._participant_keys(participant, message)
        local, remote = message.destination_endpoint_guid, message.source_endpoint_guid
        if message.message_class_id not in (DATAWRITER_CRYPTO_TOKENS, DATAREADER_CRYPTO_TOKENS):
            return Refused(f"a message of the unknown class {message.message_class_id[:64]!r}")
        if remote.prefix != participant.guid.prefix:
            return Refused(f"it brings keys of {remote}, which is not its own")
        pair = self.pairs.get((local, remote))
        if pair is None:
            self._keep_early(participant, (local, remote), message, now)
            return None
        is_repeated = pair.has_key
        refusal = self._endpoint_keys(pair, message)
        if is_repeated and refusal is None and pair.is_open and now - pair.sent_at >= _ANSWER_AFTER_S:
            self._send_keys(pair, now)
        self._open(pair)
        return refusal

    def _participant_keys(self, participant: RemoteParticipant, message: GenericMessage) -> Refused | None:
        assert participant.crypto is not None
        refusal = self._cryptographic.set_remote_participant_crypto_tokens(
            self._local_participant, participant.crypto, message.message_data
        )
        if refusal is not None:
            return refusal
        if not participant.has_keys:
            participant.has_keys = True
            for pair in list(self.pairs.values()):
                if pair.participant is participant:
                    self._open(pair)
        return None

    def _endpoint_keys(self, pair: Pair, message: GenericMessage) -> Refused | None:
        local, remote, tokens = pair.local.handle, pair.handle, message.message_data
        refusal: Refused | None = Refused(f"keys of another kind of endpoint than {pair.remote} is")
        if message.message_class_id == DATAWRITER_CRYPTO_TOKENS:
            if isinstance(local, DatareaderCryptoHandle) and isinstance(remote, DatawriterCryptoHandle):
                refusal = self._cryptographic.set_remote_datawriter_crypto_tokens(local, remote, tokens)
        elif isinstance(local, DatawriterCryptoHandle) and isinstance(remote, DatareaderCryptoHandle):
            refusal = self._cryptographic.set_remote_datareader_crypto_tokens(local, remote, tokens)
        if refusal is None:
            pair.has_key = True
        return refusal

    def _open(self, pair: Pair) -> None:
        if not pair.is_open and not pair.is_parted and self._is_complete(pair):
            pair.is_open = True
            self._decide(pair.local.guid, pair.remote, ADMITTED)

    # --- early keys --------------------------------------------------------------------------------------

    def _keep_early(
        self, participant: RemoteParticipant, pair: tuple[Guid, Guid], message: GenericMessage, now: float
    ) -> None:
        early = participant.early
        early.pop(pair, None)
        if len(early) >= MAX_EARLY_KEYS:
            del early[next(iter(early))]
        early[pair] = (message, now + EARLY_KEYS_S)

    def _use_early(self, pair: Pair, now: float) -> None:
        message, expiry = pair.participant.early.pop((pair.local.guid, pair.remote), (None, 0.0))
        if message is not None and now < expiry:
            self._endpoint_keys(pair, message)
