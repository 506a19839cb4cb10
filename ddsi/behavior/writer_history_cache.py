"""WriterHistoryCache: the changes that a writer can still send.  Other name: WHC.

RTPS 2.5 §8.2.3 (HistoryCache), DDS 1.4 §2.2.3.18 (HISTORY) and §2.2.3.19 (RESOURCE_LIMITS).  It keeps and
counts; it knows no reader.  Invariants: numbers ascend by one per change and are never reused;
``first_sn`` is the lowest number still here, or ``last_sn + 1`` when there is none.
"""

from __future__ import annotations

from collections import deque
from itertools import islice

from ..structure.cache_change import CacheChange, ChangeKind
from ..structure.qos import EndpointQos
from ..structure.qos_policies import LENGTH_UNLIMITED, KeepLast

__all__ = ["WriterHistoryCache"]

_MOST_ENDED = 8192
_LIMITS_ON_ALL = ("max_instances", "max_samples")


class WriterHistoryCache:
    """Changes by sequence number, and by instance where KEEP_LAST or a limit per instance asks for it."""

    __slots__ = (
        "_acked_sn",
        "_by_instance",
        "_changes",
        "_depth",
        "_ended",
        "_first_sn",
        "_keeps_acknowledged",
        "_max_instances",
        "_max_per_instance",
        "_max_samples",
        "_set_ends",
        "_set_sizes",
        "keeps_instances",
        "last_sn",
        "octets",
        "unacknowledged_octets",
    )

    def __init__(self, qos: EndpointQos) -> None:
        limits = qos.resource_limits
        self._changes: dict[int, CacheChange] = {}
        self._by_instance: dict[bytes, deque[int]] = {}
        self._depth = qos.history.depth if isinstance(qos.history, KeepLast) else 0
        self._max_samples = limits.max_samples if limits.max_samples != LENGTH_UNLIMITED else 0
        self._max_instances = limits.max_instances if limits.max_instances != LENGTH_UNLIMITED else 0
        per_instance = limits.max_samples_per_instance
        self._max_per_instance = per_instance if per_instance != LENGTH_UNLIMITED else 0
        self._keeps_acknowledged = qos.is_transient_local
        self.keeps_instances = bool(self._depth or self._max_instances or self._max_per_instance)
        # How many members of each coherent set are here, by the number of its first; and the number that ends it.
        self._set_sizes: dict[int, int] = {}
        self._set_ends: dict[int, int] = {}
        # Instances that all know to be disposed and unregistered, in the order in which they ended.
        self._ended: dict[bytes, None] = {}
        self._first_sn = 1
        self._acked_sn = 0
        self.last_sn = 0
        self.octets = 0
        self.unacknowledged_octets = 0

    def __len__(self) -> int:
        return len(self._changes)

    @property
    def first_sn(self) -> int:
        """The lowest number that is still here; ``last_sn + 1`` when the cache is empty."""
        # The cursor passes each number once in a writer's life, so this costs nothing on average.
        while self._first_sn <= self.last_sn and self._first_sn not in self._changes:
            self._first_sn += 1
        return self._first_sn

    @property
    def acked_sn(self) -> int:
        """All up to here (inclusive) is acknowledged by every reliable reader that counts."""
        return self._acked_sn

    @property
    def keeps_acknowledged(self) -> bool:
        """Does a change stay for late joiners when everybody has it?  (Durability beyond volatile.)"""
        return self._keeps_acknowledged

    def get(self, sequence_number: int) -> CacheChange | None:
        return self._changes.get(sequence_number)

    def changes(self) -> list[CacheChange]:
        """All that is here, ascending."""
        return list(self._changes.values())

    def lacks_room(self, key: bytes) -> str | None:
        """The limit that forbids one more change of this instance now, by name; None when there is room.

        With KEEP_LAST an old change of the instance makes room for the new one, so only the limits on
        instances, and on samples of all of them, can be met.
        """
        if not self.keeps_instances:
            return "max_samples" if self._max_samples and len(self._changes) >= self._max_samples else None
        if self._ended and self._limit_reached(key) in _LIMITS_ON_ALL:
            self._forget_ended()
        return self._limit_reached(key)

    def _limit_reached(self, key: bytes) -> str | None:
        instance = self._by_instance.get(key)
        if self._max_instances and instance is None and len(self._by_instance) >= self._max_instances:
            return "max_instances"
        if self._depth and instance is not None and len(instance) >= self._depth:
            return None
        if self._max_samples and len(self._changes) >= self._max_samples:
            return "max_samples"
        if self._max_per_instance and instance is not None and len(instance) >= self._max_per_instance:
            return "max_samples_per_instance"
        return None

    def add(self, change: CacheChange) -> CacheChange | None:
        """Store the change under its number, which is ``last_sn + 1``; returns the one that KEEP_LAST pushed out."""
        sequence_number = change.sequence_number
        assert sequence_number == self.last_sn + 1, "sequence numbers ascend by one"
        self.last_sn = sequence_number
        self._changes[sequence_number] = change
        size = len(change.payload)
        self.octets += size
        self.unacknowledged_octets += size
        if change.coherence is not None:
            self._enter_set(change)
        if not self.keeps_instances or change.is_end_of_set:
            return None
        instance = self._by_instance.get(change.key)
        if instance is None:
            instance = self._by_instance[change.key] = deque()
        if self._ended:
            self._ended.pop(change.key, None)
        instance.append(sequence_number)
        return self._take_oldest(instance) if self._depth and len(instance) > self._depth else None

    def remove(self, sequence_number: int) -> CacheChange | None:
        """Forget one change (lifespan over, its only reader gone); returns it if it was there."""
        change = self._changes.get(sequence_number)
        if change is None:
            return None
        instance = self._by_instance.get(change.key) if not change.is_end_of_set else None
        if instance is not None:
            instance.remove(sequence_number)
            if not instance:
                del self._by_instance[change.key]
        self._drop(change)
        return change

    def acknowledged_up_to(self, sequence_number: int) -> int:
        """Every reliable reader has all up to this number (inclusive): returns how many octets that freed.

        A volatile writer forgets them (RTPS 2.5 §8.4.9.1.1), a transient-local one only counts them as safe.
        """
        before = self.unacknowledged_octets
        for number in range(self._acked_sn + 1, min(sequence_number, self.last_sn) + 1):
            change = self._changes.get(number)
            if change is None:
                continue
            if self._keeps_acknowledged and not self._is_idle_end(change):
                self.unacknowledged_octets -= len(change.payload)
                if change.kind is ChangeKind.NOT_ALIVE_DISPOSED_UNREGISTERED and self.keeps_instances:
                    self._note_ended(change)
            else:
                self.remove(number)
        self._acked_sn = max(self._acked_sn, min(sequence_number, self.last_sn))
        if len(self._ended) > _MOST_ENDED:
            self._forget_ended()
        return before - self.unacknowledged_octets

    # --- instances that have ended -----------------------------------------------------------------------

    def _note_ended(self, end: CacheChange) -> None:
        if self._by_instance[end.key][-1] == end.sequence_number:
            self._ended[end.key] = None

    def _forget_ended(self) -> None:
        """The instances that ended longest ago give way.  DDS 1.4 §2.2.2.4.2.7 (unregister_instance).

        Their writer has nothing to say of them any more, and all readers know.  They are kept for a reader that was
        lost without noticing it, and has to hear of the end when it is found again.
        """
        for key in list(islice(self._ended, max(len(self._ended) - _MOST_ENDED, 1))):
            del self._ended[key]
            for number in list(self._by_instance.get(key, ())):
                self.remove(number)

    def _take_oldest(self, instance: deque[int]) -> CacheChange:
        change = self._changes[instance.popleft()]
        self._drop(change)
        return change

    def _drop(self, change: CacheChange) -> None:
        size = len(change.payload)
        del self._changes[change.sequence_number]
        self.octets -= size
        if change.sequence_number > self._acked_sn:
            self.unacknowledged_octets -= size
        if change.coherence is not None:
            self._leave_set(change)

    # --- coherent sets -----------------------------------------------------------------------------------

    def _enter_set(self, change: CacheChange) -> None:
        assert change.coherence is not None
        set_sn = change.coherence.set_sn
        if change.coherence.is_end:
            self._set_ends[set_sn] = change.sequence_number
        elif set_sn:
            self._set_sizes[set_sn] = self._set_sizes.get(set_sn, 0) + 1

    def _is_idle_end(self, change: CacheChange) -> bool:
        """Does it end a set of which nothing is here?  No late joiner needs that."""
        return change.is_end_of_set and change.coherence is not None and change.coherence.set_sn not in self._set_sizes

    def _leave_set(self, change: CacheChange) -> None:
        """With the last member of a set goes its end, once all have it: ends must not pile up behind KEEP_LAST."""
        assert change.coherence is not None
        set_sn = change.coherence.set_sn
        if change.coherence.is_end:
            if self._set_ends.get(set_sn) == change.sequence_number:
                del self._set_ends[set_sn]
            return
        if not set_sn:
            return
        self._set_sizes[set_sn] -= 1
        if not self._set_sizes[set_sn]:
            del self._set_sizes[set_sn]
            if self._set_ends.get(set_sn, self._acked_sn + 1) <= self._acked_sn:
                self.remove(self._set_ends[set_sn])
