"""StatefulReader: a reader that knows its writers, keeps their order and asks for what is missing.

RTPS 2.5 §8.4.12 (RTPS StatefulReader behavior).  What is in order goes into the ``history``: the
ReaderHistoryCache of an application's reader, or whatever takes a builtin topic's changes.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Protocol

from ..structure.cache_change import CacheChange
from ..structure.discovered import DiscoveredWriterData
from ..structure.guid import Guid
from ..structure.locator import Locator
from ..structure.qos import EndpointQos
from ..structure.qos_policies import Transient
from ..structure.sequence_number import NumberSet
from ..trace.reasons import DropReason
from .defrag import FRAGMENT_SILENCE, Defragmenter, Keep, PartialSample
from .dropping import WhenDropped, drop_silently
from .originals import Originals
from .repeats import Position, RepeatFilter
from .transmissions import SendAckNack, SendNackFrag
from .writer_proxy import WriterProxy

__all__ = ["ChangeSink", "RemoteWriter", "StatefulReader"]

_MAX_NACK_FRAGS_AT_ONCE = 32
_OLD_NUMBERS_OF_A_RESTART = 16


class ChangeSink(Protocol):
    """Where changes go when their turn has come."""

    def add(self, change: CacheChange, now: float) -> bool:
        """Take the change; False when there is no room and a reliable writer's must wait (RTPS 2.5 §8.2.10.1)."""
        ...


class RemoteWriter:
    """A remote writer as the participant sees it: who reads it here, and its fragments.  Other name: proxy_writer."""

    __slots__ = ("asserts_by_data", "data", "defragmenter", "guid", "is_reliable", "participant", "readers")

    def __init__(self, data: DiscoveredWriterData, defragmenter: Defragmenter, participant: object = None) -> None:
        self.data = data
        self.guid = data.guid
        self.defragmenter = defragmenter
        self.participant = participant
        self.is_reliable = data.qos.is_reliable
        liveliness = data.qos.liveliness
        self.asserts_by_data = liveliness.KIND > 0 and liveliness.lease_duration < math.inf
        self.readers: list[tuple[StatefulReader, WriterProxy]] = []

    def readers_changed(self) -> None:
        """A reader was matched or unmatched: is anybody here who will ask for what is missing?"""
        self.is_reliable = any(proxy.is_reliable for _, proxy in self.readers)
        if self.defragmenter.keep is not Keep.NEWEST:
            self.defragmenter.keep = Keep.LOWEST if self.is_reliable else Keep.HIGHEST

    def forget_settled(self, delivered_sn: int = 0) -> None:
        """Drop unfinished samples that nobody waits for: below a best-effort delivery, or passed by every reliable
        reader.

        They would never be finished, and as the lowest numbers they would keep the others out.
        """
        if self.is_reliable:
            self.defragmenter.notice_number(min(proxy.next_sn for _, proxy in self.readers if proxy.is_reliable))
        elif self.defragmenter.keep is not Keep.NEWEST:
            self.defragmenter.notice_number(delivered_sn)


class StatefulReader:
    """One local reader.  All its methods take the proxy they are about; nothing is looked up twice."""

    def __init__(
        self,
        guid: Guid,
        qos: EndpointQos,
        history: ChangeSink,
        *,
        reorder_max_samples: int,
        reorder_max_octets: int,
        on_dropped: WhenDropped = drop_silently,
    ) -> None:
        """``on_dropped`` is told what is not acted upon: why, whose it was, its sequence number or count."""
        self.guid = guid
        self.qos = qos
        self.history = history
        self.is_reliable = qos.is_reliable
        self.writers: dict[Guid, WriterProxy] = {}
        # What to do with what a writer that was lost repeats.  None: to begin anew is right, as builtin topics do.
        self.on_repeat: Callable[[CacheChange], None] | None = None
        self._repeats: RepeatFilter | None = None
        self._originals = Originals() if qos.durability.KIND >= Transient.KIND else None
        self._reorder_max_samples = reorder_max_samples
        self._reorder_max_octets = reorder_max_octets
        self._on_dropped = on_dropped

    def __repr__(self) -> str:
        return f"<StatefulReader {self.guid}, {len(self.writers)} writers>"

    # --- matching ----------------------------------------------------------------------------------------

    def matched_writer_add(
        self,
        data: DiscoveredWriterData,
        locators: tuple[Locator, ...],
        now: float,
        *,
        uses_filter: bool = False,
        is_local: bool = False,
    ) -> WriterProxy:
        """RTPS 2.5 §8.4.10.3.1.  A reliable pair starts with a preemptive ACKNACK, due now."""
        proxy = WriterProxy(
            data,
            locators,
            is_reliable=self.is_reliable and data.qos.is_reliable,
            needs_historical_data=self.qos.is_transient_local and data.qos.is_transient_local,
            uses_filter=uses_filter,
            is_local=is_local,
            max_samples=self._reorder_max_samples,
            max_octets=self._reorder_max_octets,
        )
        if proxy.is_reliable and not is_local:
            proxy.schedule.matched(now)
        position = self._repeats.position_of(data.guid) if self._repeats is not None else None
        if position is not None and not position.is_forgotten:
            proxy.resume_sn = position.next_sn
        self.writers[data.guid] = proxy
        return proxy

    def matched_writer_remove(
        self, guid: Guid, now: float, *, may_return: bool = False, is_forgotten: bool = False
    ) -> WriterProxy | None:
        """RTPS 2.5 §8.4.10.3.3.

        What was waiting for a number that will not come any more is delivered before it goes.  But what keeps history
        and ``may_return`` will send it again, in order; all of it, where it has forgotten this reader.
        """
        proxy = self.writers.pop(guid, None)
        if proxy is None:
            return None
        may_return = may_return and self.on_repeat is not None
        if proxy.is_reliable and proxy.reorder and not (may_return and proxy.needs_historical_data):
            # Only where something waits behind what is missing: else a writer that never lost us may still bring that.
            proxy.reorder.skip_to(proxy.last_seq + 1)
            self._deliver(proxy, now)
        if may_return and proxy.latest_timestamp >= 0:
            self._remember(proxy, is_forgotten=is_forgotten)
        if self._originals is not None:
            self._originals.writer_ended(guid, proxy.next_sn - 1)
        return proxy

    def is_repeated(self, change: CacheChange) -> bool:
        """Is it handed on by a service, and known from its own writer or from another service?"""
        return self._originals is not None and self._originals.is_repeated(change, self.writers)

    def _remember(self, proxy: WriterProxy, *, is_forgotten: bool) -> None:
        """From now on, what comes passes the filter first: a reader that loses nobody is spared that."""
        if self._repeats is None:
            assert self.on_repeat is not None
            self.history = self._repeats = RepeatFilter(self.history, self.on_repeat)
        self._repeats.remember(proxy.guid, Position(proxy.next_sn, proxy.latest_timestamp, is_forgotten))

    # --- what writers send -------------------------------------------------------------------------------

    def receive_data(self, proxy: WriterProxy, change: CacheChange, now: float) -> int:
        """One whole change: returns how many numbers before it are lost for good (best effort only).

        The first branch is the fast path: it is this number's turn and nothing waits.
        """
        number = change.sequence_number
        reorder = proxy.reorder
        if number == reorder.next_sn and not reorder and (not proxy.schedule.is_preemptive or not proxy.is_reliable):
            if number > proxy.last_seq:
                proxy.last_seq = number
            if self.history.add(change, now):
                reorder.next_sn = number + 1
                proxy.latest_timestamp = change.source_timestamp
                if not proxy.is_reliable:
                    return 0
                if proxy.schedule.due != math.inf:
                    proxy.schedule.arrived(now, number)
                    proxy.note_missing(now)
                return 0
        if proxy.is_reliable:
            self._receive_reliable(proxy, change, now)
            return 0
        return self._receive_best_effort(proxy, change, now)

    def _receive_best_effort(self, proxy: WriterProxy, change: CacheChange, now: float) -> int:
        """RTPS 2.5 §8.4.12.1: later numbers win, lower ones that come late are dropped.

        The first number received is taken as it is: what came before it was not for us.  Nor was what a filtering
        writer skips.
        """
        number = change.sequence_number
        if number < proxy.next_sn and not self._begins_anew(proxy, number):
            self._on_dropped(DropReason.OUT_OF_ORDER, proxy.guid, number)
            return 0
        proxy.contradictions = 0
        is_first = proxy.last_seq == 0
        lost = proxy.reorder.skip_to(number)  # what a GAP named is no loss
        proxy.reorder.head()
        proxy.last_seq = number
        proxy.reorder.next_sn = number + 1
        proxy.latest_timestamp = change.source_timestamp
        self.history.add(change, now)
        return 0 if is_first or proxy.uses_filter else lost

    def _begins_anew(self, proxy: WriterProxy, number: int) -> bool:
        """Many old numbers and not one that is new: the writer has restarted under the same GUID and counts from 1."""
        proxy.contradictions += 1
        if proxy.contradictions < _OLD_NUMBERS_OF_A_RESTART:
            return False
        proxy.reorder.next_sn, proxy.last_seq = number, 0
        return True

    def _receive_reliable(self, proxy: WriterProxy, change: CacheChange, now: float) -> None:
        number = change.sequence_number
        if number < proxy.next_sn:
            self._on_dropped(DropReason.DUPLICATE, proxy.guid, number)
            return
        proxy.last_seq = max(proxy.last_seq, number)
        if number in proxy.reorder:
            self._on_dropped(DropReason.DUPLICATE, proxy.guid, number)
        else:
            self._keep(proxy, change)
        proxy.schedule.arrived(now, number)
        self._progressed(proxy, now)

    def _keep(self, proxy: WriterProxy, change: CacheChange) -> None:
        """Until its turn comes.  Where there is no room, what is farther off gives way."""
        number = change.sequence_number
        while not proxy.reorder.add(change):
            farthest = proxy.reorder.drop_farthest(beyond=number)
            self._on_dropped(DropReason.TABLE_FULL_REORDER, proxy.guid, farthest or number)
            if not farthest:
                return

    def receive_gap(self, proxy: WriterProxy, start: int, numbers: NumberSet, now: float) -> None:
        """GAP.  RTPS 2.5 §8.3.8.4, §8.4.12.2.8."""
        proxy.irrelevant_change_set(start, numbers)
        proxy.schedule.arrived(now, start)
        self._progressed(proxy, now)

    def receive_heartbeat(
        self, proxy: WriterProxy, first: int, last: int, count: int, now: float, *, final: bool
    ) -> int:
        """HEARTBEAT: returns how many numbers are lost for good.  RTPS 2.5 §8.3.8.6, §8.4.12.2.3."""
        if not proxy.is_reliable:
            return 0
        if not proxy.accepts_heartbeat(count, now):
            self._on_dropped(DropReason.STALE_COUNT, proxy.guid, count)
            return 0
        lost = proxy.receive_heartbeat(first, last, now, final=final)
        self._deliver(proxy, now)
        if proxy.next_sn <= proxy.last_seq:
            proxy.note_missing(now)
        return lost

    def _progressed(self, proxy: WriterProxy, now: float) -> None:
        if not proxy.schedule.is_preemptive or not proxy.is_reliable:
            self._deliver(proxy, now)
        if proxy.is_reliable:
            proxy.note_missing(now)

    def _deliver(self, proxy: WriterProxy, now: float) -> bool:
        """Hand over what is in order; stops where the history has no room.  Returns whether anything moved.

        Before the first HEARTBEAT of a reliable writer nothing is: only it tells what comes first.
        """
        before = proxy.next_sn
        while (change := proxy.reorder.head()) is not None:
            if not self.history.add(change, now):
                break
            proxy.latest_timestamp = change.source_timestamp
            proxy.reorder.pop_head()
        return proxy.next_sn != before

    def resume(self, now: float) -> list[WriterProxy]:
        """The application took samples: deliver what waited for room; returns the proxies whose position moved."""
        moved = [proxy for proxy in self.writers.values() if proxy.reorder and self._deliver(proxy, now)]
        for proxy in moved:
            if proxy.is_reliable:
                proxy.schedule.acknowledge(now)
        return moved

    # --- the clock ---------------------------------------------------------------------------------------

    def handle_timeout(
        self, proxy: WriterProxy, remote: RemoteWriter | None, now: float
    ) -> list[SendAckNack | SendNackFrag]:
        """The proxy's schedule is due: an ACKNACK, and NACK_FRAGs for samples that came in part.

        An ACKNACK that is only wanted as an acknowledgment leaves out what was asked for a moment ago.
        """
        schedule = proxy.schedule
        if schedule.due > now:
            return []
        if schedule.is_preemptive:
            return [proxy.preemptive_acknack(now)]
        may_repeat = schedule.may_repeat(now)
        if may_repeat and proxy.resume_sn and proxy.will_not_repeat():
            proxy.reorder.skip_to(proxy.resume_sn)
            self._deliver(proxy, now)
        partial = self._partial_samples(proxy, remote)
        missing = proxy.missing_changes(excluded=partial, above=0 if may_repeat else schedule.asked_sn)
        silent = [
            (number, sample)
            for number, sample in sorted(partial.items())[:_MAX_NACK_FRAGS_AT_ONCE]
            if sample.is_silent(now, may_repeat=may_repeat)
        ]
        out: list[SendAckNack | SendNackFrag] = []
        if missing or silent or schedule.is_wanted:
            out.append(proxy.acknack(missing))
        for number, sample in silent:
            sample.asked_at = now
            out.append(proxy.nack_frag(number, sample.missing()))
        if missing or silent:
            asked = sorted([*missing, *(number for number, _ in silent)])
            schedule.nack_sent(now, asked, is_repeat=may_repeat, next_sn=proxy.next_sn)
        elif partial:
            schedule.wait(now + FRAGMENT_SILENCE)
        elif not may_repeat and proxy.missing_changes():
            schedule.wait(schedule.repeat_due)
        else:  # nothing is missing, though the history may have no room for what is here
            schedule.complete()
        return out

    def _partial_samples(self, proxy: WriterProxy, remote: RemoteWriter | None) -> dict[int, PartialSample]:
        """Samples of which fragments are here: asked for by fragment, not as a whole."""
        if remote is None or not len(remote.defragmenter):
            return {}
        partial = remote.defragmenter.partial_for(self.guid.entity_id)
        return {number: sample for number, sample in partial.items() if proxy.next_sn <= number <= proxy.last_seq}

    def fragment_received(self, proxy: WriterProxy, sequence_number: int, now: float) -> bool:
        """A fragment of this number came: is the sample wanted at all?  It is known to exist from now on."""
        if sequence_number < proxy.next_sn:
            self._on_dropped(DropReason.DUPLICATE, proxy.guid, sequence_number)
            return False
        if proxy.is_reliable:
            proxy.last_seq = max(proxy.last_seq, sequence_number - 1)
            proxy.schedule.arrived(now, sequence_number)
        return True
