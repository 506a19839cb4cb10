"""FilteringWriter: a writer whose changes have destinations; each reader gets its own, and a GAP for all others.

DDS-Security 1.1 §7.4.4 (BuiltinParticipantVolatileMessageSecure), RTPS 2.5 §8.4.7.5 (DDS_FILTER).  The mechanism is
told in :mod:`ddsi.behavior.filtered`; this is its writer's side.  It differs from a StatefulWriter in this:

- a change goes to the readers that it :meth:`~ddsi.behavior.reader_proxy.ReaderProxy.is_relevant` for, each time to one
  reader, behind the GAP that explains the numbers between;
- ``lst_seq`` says how far that reader was sent something, and every HEARTBEAT is directed and speaks of that alone.  It
  stops when the reader has acknowledged ``lst_seq``, whatever the others lack;
- a change is kept until the readers it is for have it.  Who does not answer fills up his own share of the history,
  which is bounded, and never the others' (:meth:`FilteringWriter.is_given_up`).
"""

from __future__ import annotations

from itertools import takewhile
from typing import Unpack

from ..structure.cache_change import CacheChange, ChangeKind
from ..structure.coherence import Coherence
from ..structure.guid import GUID_UNKNOWN, Guid
from ..structure.qos import EndpointQos
from .filtered import gap_before
from .reader_proxy import ReaderProxy
from .stateful_writer import StatefulWriter, WriterSettings
from .transmissions import SendHeartbeat, WriterTransmission

__all__ = ["MAX_CHANGES_PER_DESTINATION", "MAX_CHANGES_UNDER_WAY", "FilteringWriter"]

MAX_CHANGES_PER_DESTINATION = 256
"""What one destination may leave unacknowledged.  Who goes on acknowledging may be sent more (a key for each pair of
endpoints: two large participants have thousands), up to MAX_CHANGES_UNDER_WAY."""
MAX_CHANGES_UNDER_WAY = 8192
_SILENCE_S = 10.0
"""As long as a participant's lease usually is: who is there acknowledges sooner, whatever the network loses."""


class FilteringWriter(StatefulWriter):
    """The history is KEEP_ALL, as a change for one reader must not push out another's."""

    def __init__(self, guid: Guid, qos: EndpointQos, **settings: Unpack[WriterSettings]) -> None:
        super().__init__(guid, qos, **settings)
        # The numbers in the cache by destination, ascending.  A dict serves as an ordered set.
        self._held: dict[Guid, dict[int, None]] = {}
        # Of destinations that overflow: the lowest of these when that was seen last to have changed, and when.
        self._lowest: dict[Guid, tuple[int, float]] = {}

    def lacks_room(self, octets: int, key: bytes) -> str | None:
        """Only resource limits hold a write back: octets that one reader leaves unacknowledged are not the others'
        affair."""
        reason = self.cache.lacks_room(key)
        return f"resource limit {reason}" if reason is not None else None

    def has_overflow(self, destination: Guid) -> bool:
        """Does this destination hold as many unacknowledged changes as one may?"""
        return len(self._held.get(destination, ())) >= MAX_CHANGES_PER_DESTINATION

    def is_given_up(self, destination: Guid, now: float) -> bool:
        """It overflows, and has not acknowledged anything for a while.  Asked before each change for it."""
        if not self.has_overflow(destination):
            self._lowest.pop(destination, None)
            return False
        held = self._held[destination]
        lowest = next(iter(held))
        known, since = self._lowest.get(destination, (0, now))
        if known != lowest:
            since = now
            self._lowest[destination] = (lowest, now)
        return now - since >= _SILENCE_S or len(held) >= MAX_CHANGES_UNDER_WAY

    def new_change(
        self,
        kind: ChangeKind,
        payload: bytes,
        key: bytes,
        source_timestamp: int,
        now: float,
        *,
        key_hash: bytes = b"",
        destination: Guid = GUID_UNKNOWN,
        related: tuple[Guid, int] | None = None,
        coherence: Coherence | None = None,
    ) -> CacheChange:
        change = super().new_change(
            kind,
            payload,
            key,
            source_timestamp,
            now,
            key_hash=key_hash,
            destination=destination,
            related=related,
            coherence=coherence,
        )
        self._held.setdefault(destination, {})[change.sequence_number] = None
        return change

    def sends_directly(self, change: CacheChange) -> bool:
        return False

    # --- to each reader its own --------------------------------------------------------------------------

    def _transmit(self, change: CacheChange, now: float) -> list[WriterTransmission]:
        """The sample to each reader it is meant for, after a GAP for what was not."""
        out: list[WriterTransmission] = []
        for proxy in self.readers.values():
            if not proxy.is_relevant(change) or change.sequence_number <= proxy.history_sn:
                continue
            is_reliable = self.is_reliable and proxy.is_reliable
            gap = gap_before(proxy, change) if is_reliable else None
            if gap is not None:
                out.append(gap)
            out.extend(self._whole_change(change, proxy))
            proxy.lst_seq = change.sequence_number
            if is_reliable:
                out.append(self.directed_heartbeat(proxy))
        self._advance_unsent()
        return out

    def fragments_again(self, change: CacheChange) -> list[WriterTransmission]:
        """All fragments of a change that was sent, under its number; nothing where it fitted into one message.

        Best effort knows no NACK_FRAG.  Who got a part joins it with what comes now; who got all takes it for old, or
        as once more the same.
        """
        if len(change.payload) <= change.fragment_octets:
            return []
        return [item for proxy in self._readers_of(change) for item in self._whole_change(change, proxy)]

    def piggyback_heartbeat(self) -> SendHeartbeat | None:
        return None

    def directed_heartbeat(self, proxy: ReaderProxy, *, liveliness: bool = False) -> SendHeartbeat:
        """What is there for this reader, up to ``lst_seq``; ``first == last + 1`` when nothing is."""
        last = proxy.lst_seq
        # Of each destination the first will do: a long history must not cost time with every heartbeat.
        oldest = (
            next((number for number in numbers if number > proxy.history_sn), last + 1)
            for numbers in self._numbers_for(proxy)
        )
        first = min([*oldest, last + 1])
        self._heartbeat_count += 1
        return SendHeartbeat(first, last, self._heartbeat_count, proxy.acked_sn >= last, (proxy,), liveliness)

    def assert_liveliness(self) -> list[SendHeartbeat]:
        reliable = [proxy for proxy in self.readers.values() if self.is_reliable and proxy.is_reliable]
        return [self.directed_heartbeat(proxy, liveliness=True) for proxy in reliable]

    def _heartbeats_for(self, lagging: list[ReaderProxy]) -> list[WriterTransmission]:
        return [self.directed_heartbeat(proxy) for proxy in lagging]

    # --- acknowledged, per reader --------------------------------------------------------------------------

    def min_acked_sn(self) -> int:
        """As if everybody who has all that was meant for him had acknowledged everything."""
        lagging = [proxy.acked_sn for proxy in self.readers.values() if self._lags(proxy)]
        local = [proxy.acked_sn for proxy in self.local_readers.values() if proxy.is_reliable]
        return min([*lagging, *local, self.next_unsent_sn - 1 if self.readers else self.cache.last_sn])

    def _has_lagging_readers(self) -> bool:
        return any(self._lags(proxy) for proxy in self.readers.values())

    def _lags(self, proxy: ReaderProxy) -> bool:
        return proxy.is_reliable and proxy.acked_sn < proxy.lst_seq

    def _gap_end(self, proxy: ReaderProxy) -> int:
        return proxy.lst_seq + 1

    def _proxy_added(self, proxy: ReaderProxy) -> None:
        """A late joiner that is to have history: the highest number of it that is for this reader counts as sent."""
        proxy.lst_seq = max([proxy.history_sn, *(next(reversed(numbers)) for numbers in self._numbers_for(proxy))])

    def _proxy_removed(self, proxy: ReaderProxy) -> None:
        """What only this reader lacked is kept no longer."""
        self._release_up_to(self.cache.last_sn, proxy)

    def _free_acknowledged(self, proxy: ReaderProxy) -> None:
        """A change goes when the readers it is for have it; the others' acknowledgments mean nothing."""
        self._release_up_to(proxy.acked_sn, proxy)

    def _advance_unsent(self) -> None:
        self.next_unsent_sn += 1
        self._release(self.next_unsent_sn - 1)

    def _expire(self, sequence_number: int) -> None:
        change = self.cache.get(sequence_number)
        if change is not None:
            self._drop(change)

    def _release_up_to(self, sequence_number: int, proxy: ReaderProxy) -> None:
        """This reader needs none of its changes up to here (inclusive) any more."""
        for numbers in self._numbers_for(proxy):
            for number in list(takewhile(lambda number: number <= sequence_number, numbers)):
                self._release(number)

    def _release(self, number: int) -> None:
        """Forget a change if all the readers that it is for have it, and no later one is to have it."""
        change = self.cache.get(number)
        if change is None or self.cache.keeps_acknowledged or number >= self.next_unsent_sn:
            return
        if not any(proxy.is_reliable and proxy.acked_sn < number for proxy in self._readers_of(change)):
            self._drop(change)

    def _drop(self, change: CacheChange) -> None:
        self.cache.remove(change.sequence_number)
        numbers = self._held[change.destination]
        del numbers[change.sequence_number]
        if not numbers:
            del self._held[change.destination]
            self._lowest.pop(change.destination, None)

    def _readers_of(self, change: CacheChange) -> list[ReaderProxy]:
        proxies = (*self.readers.values(), *self.local_readers.values())
        return [proxy for proxy in proxies if proxy.is_relevant(change)]

    def _numbers_for(self, proxy: ReaderProxy) -> list[dict[int, None]]:
        """The numbers in the cache that are relevant to this reader, each destination's ascending."""
        destinations = (proxy.guid, proxy.participant_guid, GUID_UNKNOWN)
        return [self._held[destination] for destination in destinations if destination in self._held]
