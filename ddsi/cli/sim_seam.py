"""Listens at the seam between engine and security: what will be protected is seen before, and what it was caused by.

On the wire most of a secured conversation cannot be read.  Everything passes the hooks, however, so this stands around
them, changes nothing, and tells of each datagram what is in it.  Keys are seen here too: who shows something of
it shows names and sizes (:mod:`ddsi.trace.generic_message`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from enum import Enum
from itertools import compress
from typing import Any, Protocol, runtime_checkable

from ..messages.data import Data
from ..messages.header import HEADER_LENGTH
from ..messages.raw_submessage import iterate_submessages
from ..messages.receiver import MessageReceiver
from ..messages.submessages import Submessage, decode_submessage
from ..spi import Admission, Compute, Outcome, SecurityHooks
from ..spi.hooks import Octets, Parts
from ..structure.cache_change import CacheChange
from ..structure.discovered import DiscoveredParticipantData
from ..structure.guid import Guid, GuidPrefix
from ..trace.generic_message import generic_message_outline

__all__ = ["HandshakeTeller", "Said", "WatchedHooks"]


@runtime_checkable
class HandshakeTeller(Protocol):
    """Hooks that can tell how far the handshake with a peer is; those of ``ddsi_security`` can."""

    def handshake_state(self, remote: GuidPrefix) -> Enum | None: ...


@dataclass(frozen=True, slots=True)
class Said:
    """A submessage as it was before it was protected, but for its payload.  ``sender`` is a writer or a reader.

    ``protected``: of payload, submessage and message, those that were.
    """

    sender: Guid
    submessage: Submessage
    protected: tuple[str, ...] = ()


class WatchedHooks:
    """Stands for ``hooks``; all that it does not name itself goes straight to them.

    ``moved(before, after, cause)`` is called when the handshake with the peer goes on.  ``cause``, in words: a message
    that came, the timer, the peer's announcement; whatever is sent next has the same.  ``teller``: who knows how far it
    is, where something stands between.
    """

    def __init__(
        self, hooks: SecurityHooks, moved: Callable[[Enum | None, Enum, str], None], *, teller: object = None
    ) -> None:
        self.cause = ""
        self._hooks = hooks
        self._teller = hooks if teller is None else teller
        self._moved = moved
        self._peer: GuidPrefix | None = None
        self._state: Enum | None = None
        self._said: list[tuple[bytes, Guid, bytes]] = []  # as it leaves, who says it, as it was
        self._before_protection: dict[bytes, bytes] = {}
        self._payload_writers: set[Guid] = set()

    def __getattr__(self, name: str) -> Any:
        return getattr(self._hooks, name)

    # --- what moves the handshake ------------------------------------------------------------------------

    def remote_participant(self, data: DiscoveredParticipantData, now: float) -> Admission:
        self._peer, self.cause = data.guid.prefix, "the announcement"
        admission = self._hooks.remote_participant(data, now)
        self._look()
        return admission

    def receive_message(self, change: CacheChange, now: float) -> Outcome | None:
        outline = generic_message_outline(change.payload)
        self.cause = "" if outline is None else outline.kind
        outcome = self._hooks.receive_message(change, now)
        self._look()
        return outcome

    def computed(self, effect: Compute, result: object, now: float) -> None:
        self._hooks.computed(effect, result, now)
        self._look()

    def handle_timeout(self, now: float) -> None:
        self.cause = "its timer" if self._state is None else f"its timer in {self._state.name}"
        self._hooks.handle_timeout(now)
        self._look()

    def _look(self) -> None:
        if self._peer is None or not isinstance(self._teller, HandshakeTeller):
            return
        state = self._teller.handshake_state(self._peer)
        if state is not None and state is not self._state:
            before, self._state = self._state, state
            self._moved(before, state, self.cause)

    # --- what leaves -------------------------------------------------------------------------------------

    def encode_payload(self, writer: Guid, payload: Octets) -> Octets:
        protected = self._hooks.encode_payload(writer, payload)
        if protected != payload:
            self._payload_writers.add(writer)
        return protected

    def encode_submessage(self, sender: Guid, receivers: tuple[Guid, ...], submessage: Parts) -> Parts:
        plain = b"".join(submessage)
        protected = self._hooks.encode_submessage(sender, receivers, submessage)
        if protected:
            self._said.append((b"".join(protected), sender, plain))
        return protected

    def encode_message(self, receivers: tuple[Guid, ...], message: Parts) -> Parts:
        before = b"".join(message)
        protected = self._hooks.encode_message(receivers, message)
        self._before_protection[b"".join(protected)] = before
        return protected

    def said_in(self, datagram: bytes) -> list[Said]:
        """What a datagram says that has just left, in order.  To be asked once for each."""
        message = self._before_protection.pop(datagram, datagram)
        places = [(message.find(protected, HEADER_LENGTH), index) for index, (protected, _, _) in enumerate(self._said)]
        found = [self._said[index] for place, index in sorted(places) if place >= 0]
        self._said = [self._said[index] for place, index in places if place < 0]
        said = []
        for protected, sender, plain in found:
            (raw,) = iterate_submessages(plain, start=0)
            layers = (sender in self._payload_writers, protected != plain, message != datagram)
            names = ("payload", "submessage", "message")
            said.append(Said(sender, decode_submessage(raw), tuple(compress(names, layers))))
        return said or list(_said_in_clear(datagram))


def _said_in_clear(datagram: bytes) -> Iterator[Said]:
    """SPDP leaves without being shown to the hooks."""
    for submessage, state in MessageReceiver(datagram):
        if isinstance(submessage, Data):
            yield Said(Guid.of(state.source_guid_prefix, submessage.writer_id), submessage)
