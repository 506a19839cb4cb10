"""StatefulWriter: a writer that knows its readers, and repairs what they miss.

RTPS 2.5 §8.4.9.2 (Reliable StatefulWriter behavior), §8.4.8 (best effort).  It decides what is to be sent and
answers with transmissions; encoding, packing and sending is the engine's.

Two positions say how far it is.  ``next_unsent_sn``: everything below was sent to all readers that were matched
then (or, filtered, to those it concerned).  A reader that comes later asks for history like for anything
else it misses, so there is no second path for late joiners.
"""

from __future__ import annotations

import heapq
import math
from collections import deque
from collections.abc import Iterable
from dataclasses import replace
from typing import NotRequired, TypedDict

from ..structure.cache_change import CacheChange, ChangeKind
from ..structure.coherence import Coherence
from ..structure.discovered import DiscoveredReaderData
from ..structure.guid import GUID_UNKNOWN, Guid
from ..structure.locator import Locator
from ..structure.qos import EndpointQos
from ..structure.sequence_number import NumberSet
from ..trace.reasons import DropReason
from .acked_numbers import AckedNumbers
from .content_filter import ContentFilter
from .deadline_watch import DeadlineWatch
from .dropping import WhenDropped, drop_silently
from .filtered import directed_heartbeat_range, gap_for, is_irrelevant
from .reader_proxy import ReaderProxy
from .schedules import HeartbeatSchedule
from .send_window import SendWindow
from .transmissions import SendData, SendFragments, SendHeartbeat, SendHeartbeatFrag, WriterTransmission
from .writer_history_cache import WriterHistoryCache

__all__ = ["StatefulWriter", "WriterSettings"]

_STALLED_AFTER_S = 0.5
_PACE_S = 0.001
_LEAST_REPAIR_OCTETS = 64 * 1024  # what one request for repair brings at least, however small the window is


class WriterSettings(TypedDict):
    """The keywords of a StatefulWriter, for those that are made with the same."""

    fragment_octets: int
    unacknowledged_octets_max: int
    on_dropped: NotRequired[WhenDropped]


class StatefulWriter:
    """One local writer, whose changes are for all its readers.  Where they are not: FilteringWriter."""

    def __init__(
        self,
        guid: Guid,
        qos: EndpointQos,
        *,
        fragment_octets: int,
        unacknowledged_octets_max: int,
        on_dropped: WhenDropped = drop_silently,
    ) -> None:
        """``fragment_octets``: payloads larger than this travel in fragments of this size, which may change later.

        ``on_dropped`` is told what is not acted upon: why, whose it was, its sequence number or count.
        """
        self.guid = guid
        self.qos = qos
        self.cache = WriterHistoryCache(qos)
        self.fragment_octets = fragment_octets
        self.is_reliable = qos.is_reliable
        self.readers: dict[Guid, ReaderProxy] = {}
        self.local_readers: dict[Guid, ReaderProxy] = {}
        self.locators: tuple[Locator, ...] = ()
        self.next_unsent_sn = 1
        self.is_suspended = False  # the application has asked that nothing new be sent for now
        self.has_group_news = False  # readers are to be told how far the other writers of its publisher are
        self.window = SendWindow()
        self.heartbeat = HeartbeatSchedule()
        self._reliable_readers = 0
        # How far the reliable readers of other participants have acknowledged, and those of them that hold the window.
        self._acked, self._acked_in_window = AckedNumbers(), AckedNumbers()
        self._locator_uses: dict[Locator, int] = {}
        self._unacknowledged_octets_max = unacknowledged_octets_max
        self._on_dropped = on_dropped
        self._next_unsent_fragment = 1
        self._pace_due = math.inf
        self._heartbeat_count = 0
        self._heartbeat_frag_count = 0
        # What was sent and not acknowledged by the readers that still answer: (number, octets), ascending.
        self._in_flight: deque[tuple[int, int]] = deque()
        self._in_flight_octets = 0
        self._expiries: list[tuple[float, int]] = []  # a heap: the lifespan may change, so a later sample ends earlier
        self.deadline = DeadlineWatch(qos.deadline.period) if qos.deadline.period < math.inf else None

    def __repr__(self) -> str:
        sent = f"sent {self.next_unsent_sn - 1} of {self.cache.last_sn}"
        return f"<StatefulWriter {self.guid} {sent}, {len(self.readers)} readers>"

    @property
    def in_flight_octets(self) -> int:
        """What was sent and not yet acknowledged by the readers that still answer; the window bounds it."""
        return self._in_flight_octets

    # --- the application's side --------------------------------------------------------------------------

    def qos_changed(self, qos: EndpointQos, instances: Iterable[bytes], now: float) -> None:
        """Policies that may change have changed; DDS 1.4 §2.2.3.  What is in the history keeps its LIFESPAN.

        ``instances``: those of which a DEADLINE may now be expected, if none was before.
        """
        self.deadline = DeadlineWatch.anew(self.deadline, qos.deadline.period, instances, now)
        self.qos = qos

    @property
    def needs_key(self) -> bool:
        """Must changes come with their key: for the history's or the deadline's sake, or for readers of our own?"""
        return self.cache.keeps_instances or bool(self.local_readers) or self.deadline is not None

    def lacks_room(self, octets: int, key: bytes) -> str | None:
        """Why one more change of so many octets has to wait, in words; None when it has not to."""
        reason = self.cache.lacks_room(key)
        if reason is not None:
            return f"resource limit {reason}"
        if self.is_reliable and (self._reliable_readers or self.local_readers):
            waiting = self.cache.unacknowledged_octets
            if waiting and waiting + octets > self._unacknowledged_octets_max:
                return f"{waiting} octets are not acknowledged (bound {self._unacknowledged_octets_max})"
        return None

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
        """Add a change to the history; RTPS 2.5 §8.2.7.1 (Writer::new_change).

        It is sent by :meth:`unsent_changes`.
        """
        cache = self.cache
        lifespan = self.qos.lifespan.duration
        change = CacheChange(
            kind,
            self.guid,
            cache.last_sn + 1,
            payload,
            key,
            source_timestamp,
            key_hash=key_hash,
            destination=destination,
            related=related,
            coherence=coherence,
        )
        change.fragment_octets = self.fragment_octets
        cache.add(change)
        if lifespan != math.inf and kind is ChangeKind.ALIVE:  # DDS 1.4 §2.2.3.16: data expires, not the end of it
            change.expiry = now + lifespan
            heapq.heappush(self._expiries, (change.expiry, change.sequence_number))
        if self.deadline is not None:
            self._expected(kind, key, now)
        if self._reliable_readers:
            self.heartbeat.written(now)
        return change

    def end_coherent_set(self, coherence: Coherence, source_timestamp: int, now: float) -> CacheChange:
        """Add what is no sample: the end of this writer's part in a coherent set.  RTPS 2.5 §8.7.6.

        It belongs to no instance, so neither HISTORY, nor DEADLINE, nor LIFESPAN apply to it.
        """
        number = self.cache.last_sn + 1
        change = CacheChange(ChangeKind.ALIVE, self.guid, number, b"", b"", source_timestamp, coherence=coherence)
        change.fragment_octets = self.fragment_octets
        self.cache.add(change)
        if self._reliable_readers:
            self.heartbeat.written(now)
        return change

    def withdraw(self, change: CacheChange) -> None:
        """Forget a change that was just added, before anybody was sent it: its number stays empty."""
        assert change.sequence_number >= self.next_unsent_sn
        self.cache.remove(change.sequence_number)

    def _expected(self, kind: ChangeKind, key: bytes, now: float) -> None:
        """The next sample of the instance is expected within the DEADLINE; after its end none is."""
        assert self.deadline is not None
        if kind is ChangeKind.ALIVE:
            self.deadline.heard(key, now)
        else:
            self.deadline.forget(key)

    def sends_directly(self, change: CacheChange) -> bool:
        """The fast path: nothing waits before this change, it fits, and it goes to everybody as one DATA.

        Agrees with :meth:`unsent_changes`, which is the general form; marks the change as sent.
        """
        sequence_number = change.sequence_number
        size = len(change.payload)
        if self.next_unsent_sn != sequence_number or size > self.fragment_octets or self.is_suspended:
            return False
        if self._reliable_readers:
            if self._in_flight_octets >= self.window.octets:
                return False
            self._in_flight.append((sequence_number, size))
            self._in_flight_octets += size
        self.next_unsent_sn = sequence_number + 1
        if not self._reliable_readers:
            self.cache.acknowledged_up_to(self.min_acked_sn())
        return True

    def min_acked_sn(self) -> int:
        """All up to here (inclusive) is acknowledged by every matched reliable reader, or was never for it.

        What best-effort readers were not sent yet, or not handed, counts as not acknowledged.
        """
        acked = min(self.next_unsent_sn - 1 if self.readers else self.cache.last_sn, self._acked.lowest)
        for proxy in self.local_readers.values():
            if proxy.acked_sn < acked:
                acked = proxy.acked_sn
        return acked

    # --- matching ----------------------------------------------------------------------------------------

    def matched_reader_add(
        self,
        data: DiscoveredReaderData,
        locators: tuple[Locator, ...],
        now: float,
        content_filter: ContentFilter | None = None,
    ) -> list[WriterTransmission]:
        """RTPS 2.5 §8.4.7.3.1.  A reliable reader is told at once what there is, lest it waits or asks.

        ``content_filter``: what this reader lets pass, for a writer that acts on it.
        """
        proxy = ReaderProxy(data, locators, history_sn=self._history_sn_for(data, self.next_unsent_sn - 1), now=now)
        proxy.match_sn = self.next_unsent_sn - 1
        proxy.content_filter = content_filter
        self._proxy_added(proxy)
        self._forget_reader(data.guid)
        self.readers[data.guid] = proxy
        self._reliable_readers += self.is_reliable and proxy.is_reliable
        self._count(proxy)
        self._locators_changed((), proxy.locators)
        if not (self.is_reliable and proxy.is_reliable):
            return []
        if self._lags(proxy):
            self.heartbeat.written(now)
        return [self.directed_heartbeat(proxy)]

    def matched_local_reader_add(self, data: DiscoveredReaderData, now: float) -> ReaderProxy:
        """A reader of the same participant: it is handed the changes themselves."""
        proxy = ReaderProxy(data, (), history_sn=self._history_sn_for(data, self.cache.last_sn), now=now)
        self.local_readers[data.guid] = proxy
        return proxy

    def matched_reader_remove(self, guid: Guid, now: float) -> None:
        """RTPS 2.5 §8.4.7.3.3.  What only this reader lacked counts as acknowledged from now on."""
        proxy = self.local_readers.pop(guid, None) or self._forget_reader(guid)
        if proxy is not None:
            self._proxy_removed(proxy)
            self._acknowledged(proxy, now)

    def _forget_reader(self, guid: Guid) -> ReaderProxy | None:
        """One of another participant, if there is such a one."""
        proxy = self.readers.pop(guid, None)
        if proxy is not None:
            self._reliable_readers -= self.is_reliable and proxy.is_reliable
            self._discount(proxy)
            self._locators_changed(proxy.locators, ())
        return proxy

    def matched_reader_update(self, guid: Guid, data: DiscoveredReaderData, locators: tuple[Locator, ...]) -> None:
        """The reader announced itself anew, perhaps from elsewhere."""
        proxy = self.readers[guid]
        proxy.data = data
        self._locators_changed(proxy.locators, locators)
        proxy.locators = locators

    def _locators_changed(self, before: tuple[Locator, ...], after: tuple[Locator, ...]) -> None:
        """Of one reader.  Several may be reached at the same place, which a sample is sent to once."""
        uses = self._locator_uses
        for locator in after:
            uses[locator] = uses.get(locator, 0) + 1
        for locator in before:
            uses[locator] -= 1
            if not uses[locator]:
                del uses[locator]
        self.locators = tuple(uses)

    # --- what is new -------------------------------------------------------------------------------------

    def unsent_changes(self, now: float) -> list[WriterTransmission]:
        """Everything that is to be sent for the first time now, as far as the window allows.

        RTPS 2.5 §8.4.7.5.4 (next_unsent_change), for all readers at once.
        """
        out: list[WriterTransmission] = []
        while self.next_unsent_sn <= self.cache.last_sn and not self.is_suspended:
            change = self.cache.get(self.next_unsent_sn)
            if change is None or not self.readers:
                self._advance_unsent()
            else:
                transmissions = self._transmit(change, now)
                if not transmissions and self.next_unsent_sn == change.sequence_number:
                    break
                out.extend(transmissions)
        return out

    def _transmit(self, change: CacheChange, now: float) -> list[WriterTransmission]:
        """The first transmission of a change, or the next part of it; nothing when it has to wait."""
        if self._window_is_full() or self._pace_due != math.inf:
            return []
        if len(change.payload) > change.fragment_octets:
            return self._send_fragments(change, now)
        self._sent(change)
        return [SendData(change)]

    def _send_fragments(self, change: CacheChange, now: float) -> list[WriterTransmission]:
        """The next burst of a large change: as much as the window; the rest follows a moment later.

        No reader acknowledges fragments, so within one sample only pace protects its socket buffer; a
        HEARTBEAT_FRAG behind each burst lets it ask early for what it missed.
        """
        first = self._next_unsent_fragment
        last_of_all = self.fragment_count(change)
        last = min(first + max(self.window.octets // change.fragment_octets, 1) - 1, last_of_all)
        out: list[WriterTransmission] = [SendFragments(change, first, last)]
        if last == last_of_all:
            self._sent(change)
            return out
        self._next_unsent_fragment = last + 1
        self._pace_due = now + _PACE_S
        if self._reliable_readers:
            self._heartbeat_frag_count += 1
            out.append(SendHeartbeatFrag(change, last, self._heartbeat_frag_count))
        return out

    def fragment_count(self, change: CacheChange) -> int:
        return -(-len(change.payload) // change.fragment_octets)

    def _whole_change(self, change: CacheChange, proxy: ReaderProxy) -> list[WriterTransmission]:
        if len(change.payload) <= change.fragment_octets:
            return [SendData(change, proxy)]
        return [SendFragments(change, 1, self.fragment_count(change), proxy)]

    def _window_is_full(self) -> bool:
        return self._reliable_readers > 0 and self._in_flight_octets >= self.window.octets

    def _sent(self, change: CacheChange) -> None:
        if self._reliable_readers:
            size = len(change.payload)
            self._in_flight.append((change.sequence_number, size))
            self._in_flight_octets += size
        self._advance_unsent()

    def _advance_unsent(self) -> None:
        self.next_unsent_sn += 1
        self._next_unsent_fragment = 1
        if not self._reliable_readers:
            self.cache.acknowledged_up_to(self.min_acked_sn())

    # --- heartbeats --------------------------------------------------------------------------------------

    def piggyback_heartbeat(self) -> SendHeartbeat | None:
        """The HEARTBEAT that rides behind fresh samples: it asks for an answer when the window fills up.

        There is none while little is under way and the periodic one is due anyhow: in the datagram of the samples
        that it announces, it could only reveal losses that the samples themselves reveal.
        """
        if not self._reliable_readers:
            return None
        is_asking = self._in_flight_octets * 2 >= self.window.octets
        if not is_asking and self.heartbeat.due != math.inf:
            return None
        return self._heartbeat(None, final=not is_asking)

    def request_acknowledgment(self) -> list[WriterTransmission]:
        """Somebody waits for acknowledgment: ask all that lack something (final flag clear)."""
        return self._heartbeats_for(self._lagging_readers())

    def assert_liveliness(self) -> list[SendHeartbeat]:
        """A HEARTBEAT with the liveliness flag to all readers.  RTPS 2.5 §8.4.13.5."""
        if not self.readers or not self.is_reliable:
            return []
        return [self._heartbeat(None, final=True, liveliness=True)]

    def directed_heartbeat(self, proxy: ReaderProxy) -> SendHeartbeat:
        """A HEARTBEAT to one reader, about what concerns it; final when it has everything."""
        last_sent = self.next_unsent_sn - 1
        proxy.lst_seq = max(proxy.lst_seq, last_sent)
        first, last = directed_heartbeat_range(self.cache, proxy, last_sent)
        self._heartbeat_count += 1
        return SendHeartbeat(first, last, self._heartbeat_count, proxy.acked_sn >= proxy.lst_seq, (proxy,))

    def _heartbeat(
        self, readers: tuple[ReaderProxy, ...] | None, *, final: bool, liveliness: bool = False
    ) -> SendHeartbeat:
        last = self.next_unsent_sn - 1
        first = min(self.cache.first_sn, last + 1)
        self._heartbeat_count += 1
        return SendHeartbeat(first, last, self._heartbeat_count, final, readers, liveliness)

    def _lags(self, proxy: ReaderProxy) -> bool:
        """Was it sent something that it has not acknowledged?"""
        return proxy.is_reliable and proxy.acked_sn < self.next_unsent_sn - 1

    def _has_lagging_readers(self) -> bool:
        return self._acked.lowest < self.next_unsent_sn - 1

    def _lagging_readers(self) -> list[ReaderProxy]:
        return [proxy for proxy in self.readers.values() if self._lags(proxy)]

    def _heartbeats_for(self, lagging: list[ReaderProxy]) -> list[WriterTransmission]:
        if not lagging:
            return []
        readers = None if len(lagging) == len(self.readers) else tuple(lagging)
        return [self._heartbeat(readers, final=False)]

    # --- the clock ---------------------------------------------------------------------------------------

    def next_deadline(self) -> float:
        expiry = self._expiries[0][0] if self._expiries else math.inf
        missed = self.deadline.due if self.deadline is not None else math.inf
        return min(self.heartbeat.due, self._pace_due, expiry, missed)

    def handle_timeout(self, now: float) -> list[WriterTransmission]:
        out: list[WriterTransmission] = []
        while self._expiries and self._expiries[0][0] <= now:
            self._expire(heapq.heappop(self._expiries)[1])
        if self._pace_due <= now:
            self._pace_due = math.inf
            out.extend(self.unsent_changes(now))
        if self.heartbeat.due <= now:
            lagging = self._lagging_readers()
            if self._mark_stalled(lagging, now):
                out.extend(self.unsent_changes(now))
            asked = [proxy for proxy in lagging if proxy.heartbeat_due <= now]
            out.extend(self._heartbeats_for(asked))
            for proxy in asked:
                proxy.asked(now)
            if self.has_group_news:
                self.has_group_news = False
                out.extend(replace(heartbeat, liveliness=False) for heartbeat in self.assert_liveliness())
            if asked:
                self.heartbeat.sent(now)
            elif lagging:
                self.heartbeat.due = min(proxy.heartbeat_due for proxy in lagging)
            else:
                self.heartbeat.stop()
        return out

    def _expire(self, sequence_number: int) -> None:
        """A change's LIFESPAN is over; it may be gone already."""
        self.cache.remove(sequence_number)

    def _mark_stalled(self, lagging: list[ReaderProxy], now: float) -> bool:
        """Readers that have not answered for a while no longer hold the window; returns whether that freed it."""
        newly = [
            p
            for p in lagging
            if not p.is_stalled and now - p.progress_time > _STALLED_AFTER_S and self._window_is_full()
        ]
        for proxy in newly:
            self._discount(proxy)
            proxy.is_stalled = True
            self._count(proxy)
        if newly:
            self._drain_in_flight()
        return bool(newly) and not self._window_is_full()

    # --- what readers answer -----------------------------------------------------------------------------

    def receive_acknack(
        self, proxy: ReaderProxy, requested: NumberSet, count: int, now: float, *, final: bool
    ) -> list[WriterTransmission]:
        """ACKNACK: all below ``requested.base`` arrived, the members are missing.  RTPS 2.5 §8.4.9.2, §8.3.8.1.

        From a best-effort reader it means nothing (§8.4.9.1 knows no such transition).
        """
        if not (self.is_reliable and proxy.is_reliable):
            return []
        preemptive = requested.base <= 1 and not requested and not final
        if preemptive:
            proxy.accepts_acknack(count, now)
            if not proxy.accepts_preemptive(now):
                self._on_dropped(DropReason.RATE_LIMITED, proxy.guid, count)
                return []
        elif not proxy.accepts_acknack(count, now):
            self._on_dropped(DropReason.STALE_COUNT, proxy.guid, count)
            return []
        if requested.base > self.cache.last_sn + 1:
            # Forged, or by a reader that was told lies.  The truth helps it; to believe it would end our heartbeats.
            self._on_dropped(DropReason.INVALID_SEQUENCE, proxy.guid, requested.base)
            return [self.directed_heartbeat(proxy)]
        proxy.answered(now)
        self._discount(proxy)
        was_stalled, proxy.is_stalled = proxy.is_stalled, False
        is_news = proxy.acked_changes_set(self._committed_sn(proxy, requested.base - 1))
        self._count(proxy)
        if is_news or was_stalled:
            self._acknowledged(proxy, now)
        out = self._requested_changes(proxy, requested, now) if requested else []
        if not final or (out and self._lags(proxy)):
            out.append(self.directed_heartbeat(proxy))
        if self._lags(proxy):
            self.heartbeat.written(now)
        out.extend(self.unsent_changes(now))
        return out

    def _committed_sn(self, proxy: ReaderProxy, acknowledged_sn: int) -> int:
        """How far (inclusive) a reader needs nothing any more that says it has all up to there."""
        return min(acknowledged_sn, self.cache.last_sn)

    def _requested_changes(self, proxy: ReaderProxy, requested: NumberSet, now: float) -> list[WriterTransmission]:
        """Send again what is here, and a GAP for what is not.  RTPS 2.5 §8.4.7.5.3, §8.4.9.2.10-12."""
        end_sn = self.next_unsent_sn
        budget = max(self.window.octets, self.fragment_octets, _LEAST_REPAIR_OCTETS)
        irrelevant: list[int] = []
        out: list[WriterTransmission] = []
        for number in requested:
            if number >= end_sn:
                break
            change = self.cache.get(number)
            if change is None or is_irrelevant(self.cache, proxy, number) or proxy.asks_in_vain():
                irrelevant.append(number)
            elif budget > 0 and proxy.may_resend(number, now):
                if number > proxy.match_sn:
                    self.window.lost(now)
                sent, octets = self._resend(change, proxy, budget)
                out.extend(sent)
                budget -= octets
        gaps: list[WriterTransmission] = list(gap_for(self.cache, proxy, irrelevant, self._gap_end(proxy)))
        return gaps + out

    def _gap_end(self, proxy: ReaderProxy) -> int:
        """How far (exclusive) a GAP to this reader may reach: never beyond what a HEARTBEAT to it would announce."""
        return self.next_unsent_sn

    def _resend(self, change: CacheChange, proxy: ReaderProxy, budget: int) -> tuple[list[WriterTransmission], int]:
        """One change to one reader, or the beginning of it that fits the budget: a NACK_FRAG asks for the rest."""
        size = len(change.payload)
        if size <= change.fragment_octets:
            return [SendData(change, proxy)], size
        last = min(max(budget // change.fragment_octets, 1), self.fragment_count(change))
        return [SendFragments(change, 1, last, proxy)], last * change.fragment_octets

    def receive_nack_frag(
        self, proxy: ReaderProxy, sequence_number: int, missing: NumberSet, count: int, now: float
    ) -> list[WriterTransmission]:
        """NACK_FRAG: some fragments of one change are missing.  RTPS 2.5 §8.3.8.10, §8.4.14.1."""
        if not (self.is_reliable and proxy.is_reliable):
            return []
        if not proxy.accepts_nack_frag(count, now):
            self._on_dropped(DropReason.STALE_COUNT, proxy.guid, count)
            return []
        proxy.answered(now)
        if sequence_number > min(self.next_unsent_sn, self.cache.last_sn):
            return []  # nothing of it was sent; a GAP would say that it never will be
        change = self.cache.get(sequence_number)
        if change is None or is_irrelevant(self.cache, proxy, sequence_number):
            return list(gap_for(self.cache, proxy, [sequence_number], self._gap_end(proxy)))
        unsent = self._next_unsent_fragment if sequence_number == self.next_unsent_sn else None
        end = unsent if unsent is not None else self.fragment_count(change) + 1
        budget = max(max(self.window.octets, _LEAST_REPAIR_OCTETS) // change.fragment_octets, 1)
        wanted = [number for number in missing if 1 <= number < end][:budget]
        if not wanted:
            return []
        self.window.lost(now)
        out: list[WriterTransmission] = [SendFragments(change, *run, proxy) for run in _runs(wanted)]
        out.append(self.directed_heartbeat(proxy))
        return out

    # --- acknowledged ------------------------------------------------------------------------------------

    def local_reader_progress(self, proxy: ReaderProxy, acked_sn: int, now: float) -> None:
        """A reader of this participant took what was handed to it."""
        if proxy.acked_changes_set(acked_sn):
            self._acknowledged(proxy, now)

    def _acknowledged(self, proxy: ReaderProxy, now: float) -> None:
        """Somebody acknowledged more, or left: free what nobody needs, and let the window slide."""
        self._free_acknowledged(proxy)
        self._drain_in_flight()
        # What was not sent yet is lacked by all: a local reader takes a change before it leaves for the others.
        all_sent = self.next_unsent_sn > self.cache.last_sn
        is_complete = all_sent and not self._has_lagging_readers() and not self.has_group_news
        self.heartbeat.progress(now, complete=is_complete)

    def _free_acknowledged(self, proxy: ReaderProxy) -> None:
        """This reader has more than before, or is gone."""
        self.cache.acknowledged_up_to(self.min_acked_sn())

    def _proxy_added(self, proxy: ReaderProxy) -> None:
        """A reader is about to be matched."""

    def _proxy_removed(self, proxy: ReaderProxy) -> None:
        """A reader is matched no more."""

    def _count(self, proxy: ReaderProxy) -> None:
        """Among those whose numbers :attr:`_acked` and :attr:`_acked_in_window` know."""
        if proxy.is_reliable:
            self._acked.add(proxy.acked_sn)
            if proxy.holds_window:
                self._acked_in_window.add(proxy.acked_sn)

    def _discount(self, proxy: ReaderProxy) -> None:
        """Its number is about to change, or whether it holds the window, or it goes."""
        if proxy.is_reliable:
            self._acked.remove(proxy.acked_sn)
            if proxy.holds_window:
                self._acked_in_window.remove(proxy.acked_sn)

    def _drain_in_flight(self) -> None:
        acked = min(self._acked_in_window.lowest, self.cache.last_sn)
        freed = 0
        in_flight = self._in_flight
        while in_flight and in_flight[0][0] <= acked:
            freed += in_flight.popleft()[1]
        self._in_flight_octets -= freed
        self.window.acknowledged(freed)

    def _history_sn_for(self, data: DiscoveredReaderData, sent_sn: int) -> int:
        """The highest number that a reader matched now must not get: all sent so far, unless both sides keep history.

        What was written but waits for the window will be sent to this reader with the others, so it may ask for it too.
        """
        wants_history = data.qos.is_transient_local and data.qos.is_reliable and self.qos.is_transient_local
        return 0 if wants_history else sent_sn


def _runs(numbers: list[int]) -> list[tuple[int, int]]:
    """Ascending numbers as inclusive runs: [1, 2, 5] gives [(1, 2), (5, 5)]."""
    runs: list[tuple[int, int]] = []
    for number in numbers:
        if runs and runs[-1][1] == number - 1:
            runs[-1] = (runs[-1][0], number)
        else:
            runs.append((number, number))
    return runs
