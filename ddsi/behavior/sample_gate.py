"""SampleGate: which samples a reader's policies let in, how long they stay, and which do not come in time.

DDS 1.4 §2.2.3.9 (OWNERSHIP), §2.2.3.12 (TIME_BASED_FILTER), §2.2.3.16 (LIFESPAN), §2.2.3.7 (DEADLINE), §2.2.3.22
(READER_DATA_LIFECYCLE).  It stands
before a :class:`.reader_history_cache.ReaderHistoryCache` and only says; the cache does.  What is turned away has been
received all the same, as far as RTPS is concerned; of what came too soon a reliable reader gets the last sample when
its writer pauses.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Callable, Iterable

from ..structure.cache_change import CacheChange
from ..structure.qos import EndpointQos
from ..structure.qos_policies import BySourceTimestamp, Exclusive
from ..structure.sample_info import InstanceState, SampleInfo
from ..structure.time import TICKS_PER_SECOND
from .deadline_watch import DeadlineWatch
from .instance import Instance
from .owners import Owners

__all__ = ["SampleGate"]


class SampleGate:
    """``is_open``: nothing is turned away or expires, so nothing need be asked.

    ``on_timer`` is called when :meth:`expired` and :meth:`missed` are to be asked earlier than was said before.
    """

    __slots__ = (
        "_by_source",
        "_deadline",
        "_deferred",
        "_deferred_octets",
        "_expiries",
        "_expiry_count",
        "_lifespans",
        "_max_octets",
        "_on_timer",
        "_owners",
        "_purges",
        "_quiet",
        "_separation",
        "_timer_due",
        "_wall_time",
        "is_open",
    )

    def __init__(
        self,
        qos: EndpointQos,
        *,
        wall_time: Callable[[float], float],
        on_timer: Callable[[float], None],
        max_octets: int = 1 << 20,
    ) -> None:
        """``wall_time(now)``: seconds since 1970.  ``max_octets``: of samples that the time-based filter holds back."""
        self._owners = Owners() if isinstance(qos.ownership, Exclusive) else None
        self._separation = qos.time_based_filter.minimum_separation
        self._by_source = isinstance(qos.destination_order, BySourceTimestamp)
        # The latest sample of each instance that came too soon; let in when nothing has followed it for so long.
        self._deferred: dict[bytes, CacheChange] = {}
        self._deferred_octets = 0
        self._max_octets = max_octets
        self._quiet = DeadlineWatch(self._separation) if qos.is_reliable and self._separation > 0 else None
        self._deadline = DeadlineWatch(qos.deadline.period) if qos.deadline.period < math.inf else None
        # What nothing was heard of for so long since its end is forgotten: the same account as that of deadlines.
        self._purges = {state: DeadlineWatch(delay) for state, delay in _purge_delays(qos) if delay < math.inf}
        self._wall_time = wall_time
        self._on_timer = on_timer
        # Of the matched writers whose samples expire; and these samples by when, with a number that orders equal ones.
        self._lifespans: dict[bytes, float] = {}
        self._expiries: list[tuple[float, int, SampleInfo]] = []
        self._expiry_count = 0
        self._timer_due = math.inf
        self._may_be_open()

    def _may_be_open(self) -> None:
        self.is_open = (
            self._owners is None
            and self._separation == 0
            and self._deadline is None
            and not self._lifespans
            and not self._deferred
        )

    def qos_changed(self, qos: EndpointQos, instances: Iterable[Instance], now: float) -> None:
        """Policies that may change have changed; the new periods of ``instances`` begin now."""
        by_state: dict[InstanceState, list[bytes]] = {state: [] for state in InstanceState}
        for instance in instances:
            by_state[instance.state].append(instance.key)
        self._separation = qos.time_based_filter.minimum_separation
        if qos.is_reliable and (self._separation > 0 or self._deferred):
            self._quiet = DeadlineWatch.anew(self._quiet, self._separation, (), now)
        alive = by_state[InstanceState.ALIVE]
        self._deadline = DeadlineWatch.anew(self._deadline, qos.deadline.period, alive, now)
        before, self._purges = self._purges, {}
        for state, delay in _purge_delays(qos):
            watch = DeadlineWatch.anew(before.get(state), delay, by_state[state], now)
            if watch is not None:
                self._purges[state] = watch
        self._may_be_open()
        self.arm()

    # --- the writers -------------------------------------------------------------------------------------

    def writer_matched(self, writer: bytes, qos: EndpointQos) -> None:
        """A writer was matched, or has other policies now: its strength, and how long its samples live."""
        if self._owners is not None:
            self._owners.writer_matched(writer, qos.ownership_strength.value)
        if qos.lifespan.duration < math.inf:
            self._lifespans[writer] = qos.lifespan.duration
            self.is_open = False
        else:
            self._lifespans.pop(writer, None)

    def writer_unmatched(self, writer: bytes) -> None:
        self._lifespans.pop(writer, None)
        if self._owners is not None:
            self._owners.writer_lost(writer)

    def may_write(self, writer: bytes, instance: Instance) -> bool:
        """Does it own the instance, or would it take it over?"""
        return self._owners is None or self._owners.may_write(writer, instance.owner)

    # --- samples -----------------------------------------------------------------------------------------

    def admits(self, instance: Instance, change: CacheChange, now: float) -> bool:
        """Is the sample from the instance's owner, not expired, and due after the one before it?

        A sample that has to wait for room is asked about again, so nothing is noted here that would answer otherwise
        the second time.
        """
        lifespan = self._lifespans.get(change.writer_guid)
        if lifespan is not None:
            # By the writer's clock and ours, as the specification has it; a clock that goes ahead gains nothing by it.
            age = self._wall_time(now) - change.source_timestamp / TICKS_PER_SECOND
            change.expiry = now + min(lifespan - age, lifespan)
            if change.expiry <= now:
                return False
        if self._owners is not None:
            instance.writers.add(change.writer_guid)
            if not self._owners.may_write(change.writer_guid, instance.owner):
                return False
            instance.owner = change.writer_guid
        if self._deadline is not None:
            self._deadline.heard(change.key, now)
            self.arm()
        # The first sample of a new life is no repetition.
        if now - instance.accepted_at >= self._separation or instance.state is not InstanceState.ALIVE:
            return True
        if self._quiet is not None:
            self._defer(self._quiet, change, now)
        return False

    def admitted(self, instance: Instance, info: SampleInfo, change: CacheChange, now: float) -> None:
        """The sample is in the cache."""
        instance.accepted_at = now
        if self._deferred:
            self._forget_deferred(instance.key)
        if change.writer_guid in self._lifespans:
            self._expiry_count += 1
            heapq.heappush(self._expiries, (change.expiry, self._expiry_count, info))
            self.arm()

    def ended(self, instance: Instance, now: float) -> None:
        """The instance is not alive any more, as its state says: nothing is expected of it."""
        if self._deadline is not None:
            self._deadline.forget(instance.key)
        if self._deferred:
            self._forget_deferred(instance.key)
        for state, purge in self._purges.items():
            if state is instance.state:
                purge.heard(instance.key, now)
                self.arm()
            else:
                purge.forget(instance.key)

    def revived(self, key: bytes) -> None:
        """The instance is alive again."""
        for purge in self._purges.values():
            purge.forget(key)

    # --- what came too soon ------------------------------------------------------------------------------

    def _defer(self, quiet: DeadlineWatch, change: CacheChange, now: float) -> None:
        """DDS 1.4 §2.2.3.12: when a writer pauses, a reliable reader is to have the last that it wrote after all.

        Of too many octets nobody is promised that.
        """
        before = self._deferred.get(change.key)
        if self._by_source and before is not None and before.source_timestamp > change.source_timestamp:
            return
        self._forget_deferred(change.key)
        octets = len(change.payload)
        if self._deferred_octets + octets <= self._max_octets:
            self._deferred[change.key] = change
            self._deferred_octets += octets
            quiet.heard(change.key, now)
            self.arm()

    def _forget_deferred(self, key: bytes) -> None:
        change = self._deferred.pop(key, None)
        if change is not None:
            self._deferred_octets -= len(change.payload)
            if self._quiet is not None:
                self._quiet.forget(key)
            self._may_be_open()

    def deferred(self, now: float) -> list[CacheChange]:
        """What came too soon and was not followed by anything.  Asked when the timer rings.

        A sample that is not let in by then, as there is no room, is here again some time later.
        """
        self._timer_due = math.inf
        if self._quiet is None or self._quiet.due > now:
            return []
        keys = self._quiet.missed(now)
        for key in [key for key in keys if self._deferred[key].expiry <= now]:
            self._forget_deferred(key)
        return [self._deferred[key] for key in keys if key in self._deferred]

    def give_up(self, change: CacheChange) -> None:
        """It was deferred, and may not be let in any more."""
        self._forget_deferred(change.key)

    # --- the clock ---------------------------------------------------------------------------------------

    def arm(self) -> None:
        """See to it that somebody asks in time."""
        due = self._expiries[0][0] if self._expiries else math.inf
        if self._deadline is not None:
            due = min(due, self._deadline.due)
        if self._quiet is not None:
            due = min(due, self._quiet.due)
        for purge in self._purges.values():
            due = min(due, purge.due)
        if due < self._timer_due:
            self._timer_due = due
            self._on_timer(due)

    def expired(self, now: float) -> list[SampleInfo]:
        """The samples whose life is over, which may have been taken already.  Asked when the timer rings."""
        self._timer_due = math.inf
        found = []
        while self._expiries and self._expiries[0][0] <= now:
            found.append(heapq.heappop(self._expiries)[2])
        return found

    def missed(self, now: float) -> list[bytes]:
        """The instances of which nothing came in time.  Asked when the timer rings."""
        self._timer_due = math.inf
        if self._deadline is None or self._deadline.due > now:
            return []
        return self._deadline.missed(now)

    def to_purge(self, now: float) -> list[bytes]:
        """The instances that ended so long ago that nothing of them shall stay.  Asked when the timer rings."""
        self._timer_due = math.inf
        keys = [key for purge in self._purges.values() if purge.due <= now for key in purge.missed(now)]
        for key in keys:
            self.revived(key)
        return keys

    @property
    def expiring(self) -> int:
        """How many samples are kept in mind because they will expire."""
        return len(self._expiries)

    def forget_all_but(self, present: Iterable[SampleInfo]) -> None:
        """Most samples are taken before they expire: their octets need not stay here as long as they could live."""
        here = {id(info) for info in present}
        self._expiries = [entry for entry in self._expiries if id(entry[2]) in here]
        heapq.heapify(self._expiries)


def _purge_delays(qos: EndpointQos) -> tuple[tuple[InstanceState, float], ...]:
    policy = qos.reader_data_lifecycle
    return (
        (InstanceState.NOT_ALIVE_DISPOSED, policy.autopurge_disposed_samples_delay),
        (InstanceState.NOT_ALIVE_NO_WRITERS, policy.autopurge_nowriter_samples_delay),
    )
