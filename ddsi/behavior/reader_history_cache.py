"""ReaderHistoryCache: the samples that an application has not taken yet, by instance.  Other name: RHC.

DDS 1.4 §2.2.2.5 (Subscription Module: states, ranks, generation counts), §2.2.3.18-19 (HISTORY, RESOURCE_LIMITS).
What is let in at all, and for how long, its :class:`.sample_gate.SampleGate` decides.
Samples come here in the order that RTPS established and leave in the order of arrival, those of one instance in that of
their source timestamps where DESTINATION_ORDER says so (§2.2.3.17).  It holds octets, not data:
deserialising is done when a sample is taken, by whoever takes it.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from copy import copy

from ..structure.cache_change import CacheChange, ChangeKind, StatusInfo
from ..structure.guid import Guid
from ..structure.qos import EndpointQos
from ..structure.qos_policies import LENGTH_UNLIMITED, AccessScope, BySourceTimestamp, KeepLast
from ..structure.sample_info import (
    ANY_INSTANCE_STATE,
    ANY_SAMPLE_STATE,
    ANY_VIEW_STATE,
    InstanceState,
    SampleInfo,
    SampleState,
    ViewState,
)
from . import source_order
from .content_filter import ContentFilter
from .instance import Instance
from .instance_order import InstanceOrder
from .sample_gate import SampleGate

__all__ = ["Instance", "ReaderHistoryCache", "SampleSelector"]

_COMPACT_ABOVE = 64
_MAX_FORGOTTEN = 1024
_NOT_NEW = ViewState.NOT_NEW
_NEW = ViewState.NEW
_ALIVE = InstanceState.ALIVE
_ANY_STATES = (int(ANY_SAMPLE_STATE), int(ANY_VIEW_STATE), int(ANY_INSTANCE_STATE))
_READ = SampleState.READ

SampleSelector = Callable[[SampleInfo], bool]


class ReaderHistoryCache:
    """A ChangeSink for application readers.

    ``on_news`` is called when something can be read and the last such call has been cleared by :meth:`seen`;
    ``on_rejected`` with the name of a limit, the sample that finds no room, and whether that was its end: a reliable
    one will come again, and is told of once; ``on_timer`` when :meth:`handle_timeout` is wanted earlier than before.
    """

    def __init__(
        self,
        qos: EndpointQos,
        *,
        max_octets: int,
        max_instances: int,
        clock_offset: float = 0.0,
        on_news: Callable[[], None] = lambda: None,
        on_rejected: Callable[[str, CacheChange, bool], None] = lambda limit, change, is_final: None,
        on_timer: Callable[[float], None] = lambda due: None,
        wall_time: Callable[[float], float] | None = None,
    ) -> None:
        """``max_octets``, ``max_instances``: bounds beside the QoS, so that no peer can fill the memory.

        ``clock_offset``: seconds to add to the engine's clock to have wall time, as it was in the beginning;
        ``wall_time(now)`` is it now, if somebody may set it meanwhile.
        """
        limits = qos.resource_limits
        unlimited = LENGTH_UNLIMITED
        self._depth = qos.history.depth if isinstance(qos.history, KeepLast) else 0
        self._max_samples = limits.max_samples if limits.max_samples != unlimited else 0
        self._max_per_instance = limits.max_samples_per_instance if limits.max_samples_per_instance != unlimited else 0
        self._max_instances = (
            min(limits.max_instances, max_instances) if limits.max_instances != unlimited else max_instances
        )
        self._max_octets = max_octets
        presentation = qos.presentation
        self._keeps_arrival_order = presentation.ordered_access and presentation.access_scope > AccessScope.INSTANCE
        self._is_reliable = qos.is_reliable
        self._clock_offset = clock_offset
        self._on_news = on_news
        self._on_rejected = on_rejected
        self._on_timer = on_timer
        self._has_news = self._is_available = False
        self.arrivals: Iterator[int] | None = None  # numbers the samples of several readers as they come
        self.is_withholding = False  # did a reliable writer's sample find no room?
        self.content_filter: ContentFilter | None = None  # what does not pass has been received, and is not kept
        self._withheld: dict[bytes, int] = {}  # by writer: the number that found none last
        self._by_source = isinstance(qos.destination_order, BySourceTimestamp)
        self._instances: dict[bytes, Instance] = {}
        # Hashes of the keys of instances that were known; None: of too many to tell any more.
        self._forgotten: set[int] | None = set()
        self._handles: InstanceOrder | None = None  # from when somebody asks for the next instance
        # In order of arrival.  What was taken from the middle or pushed out stays until it comes to the front
        # or the queue is compacted; such a sample has no change any more.
        self._order: deque[SampleInfo] = deque()
        self._removed_count = 0
        self._octets = 0
        self._gate = SampleGate(
            qos, wall_time=wall_time or (lambda now: now + clock_offset), on_timer=on_timer, max_octets=max_octets
        )

    def __len__(self) -> int:
        """How many samples can be read or taken."""
        return len(self._order) - self._removed_count

    @property
    def octets(self) -> int:
        return self._octets

    @property
    def instances(self) -> dict[bytes, Instance]:
        """The known instances by key.  For looking up only."""
        return self._instances

    def may_have_known(self, key: bytes) -> bool:
        """Is the instance known, or can it not be told that it never was?"""
        return key in self._instances or self._forgotten is None or hash(key) in self._forgotten

    def qos_changed(self, qos: EndpointQos, now: float) -> None:
        """The reader's policies, as far as they may change, are now these.  DDS 1.4 §2.2.3."""
        self._gate.qos_changed(qos, self._instances.values(), now)

    # --- what comes in -----------------------------------------------------------------------------------

    def add(self, change: CacheChange, now: float, *, is_deferred: bool = False) -> bool:
        """Take one change; False when a reliable writer's has to wait until the application has taken something.

        ``is_deferred``: it came before, and was too soon then.
        """
        if self.content_filter is not None and not self.content_filter.passes(change):
            return True
        instance = self._instances.get(change.key)
        if instance is None:
            if change.kind is not ChangeKind.ALIVE:
                return True  # the end of something that nobody here has heard of
            if len(self._instances) >= self._max_instances:
                return self._no_room("max_instances", change)
            instance = Instance(change.key)  # known from the moment that it has a sample
        if change.kind is not ChangeKind.ALIVE:
            self._add_end(instance, change, now)
            return True
        gate = self._gate
        if not gate.is_open and not is_deferred and not gate.admits(instance, change, now):
            return True
        samples = instance.samples
        if self._by_source and source_order.comes_too_late(instance, change, self._depth):
            return True
        if self._depth and len(samples) - instance.end_count >= self._depth:
            octets = len(change.payload)
            if self._octets + octets > self._max_octets and self._outgrows(instance, octets):
                return self._no_room("octets of history", change)
            self._push_out(instance)
        else:
            limit = self._limit_reached(instance, len(change.payload))
            if limit is not None:
                return self._no_room(limit, change)
            if change.key not in self._instances:
                self._instances[change.key] = instance
                if self._handles is not None:
                    self._handles.add(change.key)
        if instance.state is not _ALIVE:
            self._revive(instance)
        if change.writer_guid not in instance.writers:
            instance.writers.add(change.writer_guid)
        info = SampleInfo(change, now + self._clock_offset, valid_data=True)
        info.disposed_generation_count = instance.disposed_generation_count
        info.no_writers_generation_count = instance.no_writers_generation_count
        if self.arrivals is not None:
            info.arrival = next(self.arrivals)
        if self._by_source and samples:
            self._insert(samples, source_order.place_of(instance, change), info)
        else:
            samples.append(info)
            self._order.append(info)
        self._octets += len(change.payload)
        if not gate.is_open:
            gate.admitted(instance, info, change, now)
            if gate.expiring > 2 * len(self) + _COMPACT_ABOVE:
                gate.forget_all_but(info for info in self._order if info._change is not None)
        if not self._has_news:
            self._has_news = self._is_available = True
            self._on_news()
        return True

    def writer_matched(self, writer: Guid, qos: EndpointQos) -> None:
        """A writer was matched, or has other policies now."""
        self._gate.writer_matched(writer, qos)

    def writer_unmatched(self, writer: Guid, now: float) -> None:
        """A writer is gone: it writes no instance, and its policies are forgotten."""
        self.writer_lost(writer, now)
        self._gate.writer_unmatched(writer)
        self._withheld.pop(writer, None)

    def writer_lost(self, writer: Guid, now: float) -> None:
        """A writer was unmatched, or its liveliness was lost: it no longer writes any instance."""
        for instance in list(self._instances.values()):
            if writer in instance.writers:
                instance.writers.discard(writer)
                if instance.owner == writer:
                    instance.owner = None
                if not instance.writers and instance.state is _ALIVE:
                    nobody = CacheChange(ChangeKind.NOT_ALIVE_UNREGISTERED, writer, 0, b"", instance.key)
                    self._end(instance, InstanceState.NOT_ALIVE_NO_WRITERS, nobody, now)
                self._purge(instance)

    def written_again(self, change: CacheChange) -> None:
        """A writer that was lost is back and repeats this, which was delivered before: instances live as it says."""
        instance = self._instances.get(change.key)
        if instance is None:
            return
        if change.kind is ChangeKind.ALIVE:
            instance.writers.add(change.writer_guid)
            if instance.state is InstanceState.NOT_ALIVE_NO_WRITERS:
                self._revive(instance)
        elif change.kind & StatusInfo.UNREGISTERED:
            instance.writers.discard(change.writer_guid)
            if not instance.writers and instance.state is _ALIVE:
                instance.state = InstanceState.NOT_ALIVE_NO_WRITERS
            self._purge(instance)

    def _add_end(self, instance: Instance, change: CacheChange, now: float) -> None:
        """Dispose, unregister, or both.  DDS 1.4 figure 2.11: disposed wins until somebody writes again."""
        may_dispose = self._gate.may_write(change.writer_guid, instance)
        if self._by_source and may_dispose and change.kind & StatusInfo.DISPOSED:
            may_dispose = source_order.is_latest(instance, change)
        if change.kind & StatusInfo.DISPOSED and may_dispose and instance.state is not InstanceState.NOT_ALIVE_DISPOSED:
            self._end(instance, InstanceState.NOT_ALIVE_DISPOSED, change, now)
        if change.kind & StatusInfo.UNREGISTERED:
            instance.writers.discard(change.writer_guid)
            if instance.owner == change.writer_guid:
                instance.owner = None
            if not instance.writers and instance.state is _ALIVE:
                self._end(instance, InstanceState.NOT_ALIVE_NO_WRITERS, change, now)
            self._purge(instance)

    def _end(self, instance: Instance, state: InstanceState, change: CacheChange, now: float) -> None:
        """The instance is not alive any more: a sample without data says so.

        One is enough at the end of its queue, and with KEEP_LAST one in all: an instance that ends and begins again
        a thousand times does not fill the cache.
        """
        instance.state = state
        self._gate.ended(instance, now)
        last = instance.samples[-1] if instance.samples else None
        if last is None or last.valid_data or last.sample_state is _READ:
            if self._depth and instance.end_count:
                self._remove(instance, next(info for info in instance.samples if not info.valid_data))
            instance.end_count += 1
            info = SampleInfo(change, now + self._clock_offset, valid_data=False)
            info.instance_handle = instance.key
            info.disposed_generation_count = instance.disposed_generation_count
            info.no_writers_generation_count = instance.no_writers_generation_count
            if self.arrivals is not None:
                info.arrival = next(self.arrivals)
            instance.samples.append(info)
            self._order.append(info)
            self._octets += len(change.payload)
        if not self._has_news:
            self._has_news = self._is_available = True
            self._on_news()

    def _revive(self, instance: Instance) -> None:
        if instance.state is InstanceState.NOT_ALIVE_DISPOSED:
            instance.disposed_generation_count += 1
        else:
            instance.no_writers_generation_count += 1
        instance.state = _ALIVE
        instance.view_state = _NEW
        self._gate.revived(instance.key)

    def _insert(self, samples: deque[SampleInfo], place: int, info: SampleInfo) -> None:
        """Among its instance's samples there, and before that of them which follows in the order of arrival."""
        at = self._order.index(samples[place]) if place < len(samples) else len(self._order)
        samples.insert(place, info)
        self._order.insert(at, info)

    # --- room ----------------------------------------------------------------------------------------------

    def _limit_reached(self, instance: Instance, octets: int) -> str | None:
        if self._max_per_instance and len(instance.samples) >= self._max_per_instance:
            return "max_samples_per_instance"
        if self._max_samples and len(self) >= self._max_samples:
            return "max_samples"
        if self._octets and self._octets + octets > self._max_octets:
            return "octets of history"
        return None

    def _outgrows(self, instance: Instance, octets: int) -> bool:
        """Does a sample need more room than the one whose place it would take, and there is none?

        Else many instances that each had a small sample once could hold any number of octets.
        """
        oldest = self._oldest(instance).change
        assert oldest is not None
        others = self._octets - len(oldest.payload)
        return bool(others) and octets > len(oldest.payload) and others + octets > self._max_octets

    def lacks_room_for(self, changes: Sequence[CacheChange], *, when_empty: bool = False) -> str | None:
        """The limit that forbids taking all of these now, or ``when_empty``, by name; None if there is room."""
        samples = octets = 0
        added: dict[bytes, int] = {}
        instance_count = 0 if when_empty else len(self._instances)
        for change in changes:
            if change.kind is not ChangeKind.ALIVE:
                continue
            instance = None if when_empty else self._instances.get(change.key)
            if instance is None and change.key not in added:
                instance_count += 1
                if instance_count > self._max_instances:
                    return "max_instances"
            octets += len(change.payload)
            held = (len(instance.samples) if instance is not None else 0) + added.setdefault(change.key, 0)
            if self._depth and held - (instance.end_count if instance is not None else 0) >= self._depth:
                continue  # it takes the place of another
            if self._max_per_instance and held >= self._max_per_instance:
                return "max_samples_per_instance"
            added[change.key] += 1
            samples += 1
        if self._max_samples and samples and (0 if when_empty else len(self)) + samples > self._max_samples:
            return "max_samples"
        before = 0 if when_empty else self._octets
        return "octets of history" if before and before + octets > self._max_octets else None

    def no_room_for(self, changes: Sequence[CacheChange], limit: str) -> bool:
        """These have to become visible together, and cannot: False if a reliable writer's may once the application has
        taken something, True if they are rejected."""
        if self._is_reliable and self.lacks_room_for(changes, when_empty=True) is None:
            return self._no_room(limit, changes[-1])
        self._on_rejected(limit, changes[-1], True)
        return True

    def _no_room(self, limit: str, change: CacheChange) -> bool:
        if not self._is_reliable:
            self._on_rejected(limit, change, True)
            return True
        self.is_withholding = True
        if self._withheld.get(change.writer_guid) != change.sequence_number:
            self._withheld[change.writer_guid] = change.sequence_number
            self._on_rejected(limit, change, False)
        return False

    def _push_out(self, instance: Instance) -> None:
        """KEEP_LAST: the oldest sample with data goes.  What tells of an end stays; there is one such at most."""
        self._remove(instance, self._oldest(instance))

    @staticmethod
    def _oldest(instance: Instance) -> SampleInfo:
        return next(info for info in instance.samples if info.valid_data)

    def _remove(self, instance: Instance, info: SampleInfo) -> None:
        """A sample makes room; its place in the order of arrival is tidied up later."""
        self._leave(instance, info)
        self._discard(info)
        self._removed_count += 1
        self._tidy_up()

    def _tidy_up(self) -> None:
        """The queue holds about as many samples as it has; else those that are gone would pile up behind one that
        nobody takes."""
        if self._removed_count > _COMPACT_ABOVE and self._removed_count * 2 > len(self._order):
            self._order = deque(info for info in self._order if info._change is not None)
            self._removed_count = 0

    def _leave(self, instance: Instance, info: SampleInfo) -> None:
        if instance.samples[0] is info:
            instance.samples.popleft()
        else:
            instance.samples.remove(info)
        if not info.valid_data:
            instance.end_count -= 1
        elif self._by_source:
            source_order.left(instance, info)

    def _discard(self, info: SampleInfo) -> None:
        change = info._change
        assert change is not None
        self._octets -= len(change.payload)
        info._change = None

    def _purge(self, instance: Instance) -> None:
        """Nobody writes it and nothing is left to take: forget it, so that instances come and go without end."""
        if not instance.samples and not instance.writers and instance.state is not _ALIVE:
            self._drop_instance(instance.key)
            if self.is_withholding:  # where nobody takes anything, nobody else would notice that there is room
                self._on_timer(-math.inf)

    # --- what does not stay --------------------------------------------------------------------------------

    def handle_timeout(self, now: float) -> list[bytes]:
        """Drop what has expired; returns the instances that missed their deadline, whose owners lose them."""
        for info in self._gate.expired(now):
            instance = self._instances.get(info.instance_handle)
            if instance is not None and any(known is info for known in instance.samples):  # else it was taken
                self._remove(instance, info)
                self._purge(instance)
        missed = self._gate.missed(now)
        for key in missed:
            if key in self._instances:
                self._instances[key].owner = None
        for change in self._gate.deferred(now):
            instance = self._instances.get(change.key)
            if instance is None or not self._gate.may_write(change.writer_guid, instance):
                self._gate.give_up(change)
            else:
                self.add(change, now, is_deferred=True)
        for key in self._gate.to_purge(now):
            self._forget(key)
        self._gate.arm()
        return missed

    def _forget(self, key: bytes) -> None:
        """READER_DATA_LIFECYCLE, DDS 1.4 §2.2.3.22: the instance goes, with what was not taken of it."""
        instance = self._drop_instance(key)
        if instance is not None:
            for info in list(instance.samples):
                self._remove(instance, info)

    def _drop_instance(self, key: bytes) -> Instance | None:
        instance = self._instances.pop(key, None)
        if instance is not None and self._forgotten is not None:
            self._forgotten.add(hash(key))
            if len(self._forgotten) > _MAX_FORGOTTEN:
                self._forgotten = None
        return instance

    # --- what goes out -----------------------------------------------------------------------------------

    @property
    def has_news(self) -> bool:
        """Has anything come since :meth:`seen`?"""
        return self._has_news

    @property
    def is_available(self) -> bool:
        """Has anything come since :meth:`accessed`?  DDS 1.4 §2.2.4.2.2 (the status DATA_AVAILABLE)."""
        return self._is_available

    def seen(self) -> None:
        """Somebody is about to wait: the next sample is news again.  To others what is here may still be news."""
        self._has_news = False

    def accessed(self) -> None:
        """The application reads or takes: the next sample is news again, and makes data available."""
        self._has_news = self._is_available = False

    def take_next(self) -> tuple[SampleInfo, CacheChange] | None:
        """The oldest sample, removed: the short form of :meth:`take` for ``async for``."""
        order = self._order
        while order:
            info = order.popleft()
            change = info._change
            if change is None:
                self._removed_count -= 1
                continue
            instance = self._instances[info.instance_handle]
            self._leave(instance, info)
            self._octets -= len(change.payload)
            info.view_state = instance.view_state
            instance.view_state = _NOT_NEW
            info.instance_state = instance.state
            info.sample_rank = 0  # it may have been read among others before
            self._has_news = self._is_available = False
            if instance.generation:
                self._set_generation_ranks([(info, instance)])
            self._purge(instance)
            return info, change
        return None

    def take(
        self,
        max_samples: int | None = None,
        *,
        sample_states: int = ANY_SAMPLE_STATE,
        view_states: int = ANY_VIEW_STATE,
        instance_states: int = ANY_INSTANCE_STATE,
        instance: bytes | None = None,
        selector: SampleSelector | None = None,
    ) -> list[tuple[SampleInfo, CacheChange]]:
        """Up to ``max_samples`` (all) of the wanted samples, oldest first, removed from the cache."""
        chosen = self._select(max_samples, sample_states, view_states, instance_states, instance, selector)
        result = [(info, info._change) for info, _ in chosen]
        for info, of in chosen:
            self._leave(of, info)
            self._discard(info)
            self._removed_count += 1
            self._purge(of)
        while self._order and self._order[0]._change is None:
            self._order.popleft()
            self._removed_count -= 1
        self._tidy_up()
        return [(info, change) for info, change in result if change is not None]

    def read(
        self,
        max_samples: int | None = None,
        *,
        sample_states: int = ANY_SAMPLE_STATE,
        view_states: int = ANY_VIEW_STATE,
        instance_states: int = ANY_INSTANCE_STATE,
        instance: bytes | None = None,
        selector: SampleSelector | None = None,
    ) -> list[tuple[SampleInfo, CacheChange]]:
        """As :meth:`take`, but the samples stay and count as read.  What is returned is a copy, as of now."""
        chosen = self._select(max_samples, sample_states, view_states, instance_states, instance, selector)
        result = [(copy(info), info._change) for info, _ in chosen]
        for info, _ in chosen:
            info.sample_state = _READ
        return [(info, change) for info, change in result if change is not None]

    def next_instance(
        self,
        previous: bytes | None,
        *,
        sample_states: int,
        view_states: int,
        instance_states: int,
        selector: SampleSelector | None = None,
    ) -> bytes | None:
        """The first instance behind ``previous`` (None: of all) that has any such sample.  DDS 1.4 §2.2.2.5.3.16."""
        if self._handles is None:
            self._handles = InstanceOrder(self._instances, self._instances)
        for key in self._handles.after(previous):
            if self._select(1, sample_states, view_states, instance_states, key, selector, touch=False):
                return key
        return None

    def peek(
        self,
        *,
        sample_states: int,
        view_states: int,
        instance_states: int,
        instance: bytes | None = None,
        selector: SampleSelector | None = None,
    ) -> list[SampleInfo]:
        """The samples that :meth:`take` would take, untouched."""
        chosen = self._select(None, sample_states, view_states, instance_states, instance, selector, touch=False)
        return [info for info, _ in chosen]

    def matches(
        self, *, sample_states: int, view_states: int, instance_states: int, selector: SampleSelector | None = None
    ) -> bool:
        """Is there any such sample?"""
        return bool(self._select(1, sample_states, view_states, instance_states, None, selector, touch=False))

    def matching(
        self, *, sample_states: int, view_states: int, instance_states: int, selector: SampleSelector | None = None
    ) -> list[SampleInfo]:
        """What stands beside such samples, as it is in the cache; nothing counts as looked at."""
        chosen = self._select(None, sample_states, view_states, instance_states, None, selector, touch=False)
        return [info for info, _ in chosen]

    def _select(
        self,
        max_samples: int | None,
        sample_states: int,
        view_states: int,
        instance_states: int,
        key: bytes | None,
        selector: SampleSelector | None,
        *,
        touch: bool = True,
    ) -> list[tuple[SampleInfo, Instance]]:
        source: deque[SampleInfo] = self._order
        if key is not None:
            only = self._instances.get(key)
            source = only.samples if only is not None else deque()
        chosen: list[tuple[SampleInfo, Instance]] = []
        # As nearly all are asked for so, and to combine two flags costs more than all the rest of this loop.
        of_any_state = (sample_states, view_states, instance_states) == _ANY_STATES
        for info in source:
            if max_samples is not None and len(chosen) >= max_samples:
                break
            if info._change is None:
                continue
            instance = self._instances[info.instance_handle]
            if (
                of_any_state
                or (
                    info.sample_state & sample_states
                    and instance.view_state & view_states
                    and instance.state & instance_states
                )
            ) and (selector is None or selector(info)):
                chosen.append((info, instance))
        if not self._keeps_arrival_order and len(self._instances) > 1:
            chosen = _by_instance(chosen)
        if touch:
            self._mark_access(chosen)
        return chosen

    def _mark_access(self, chosen: list[tuple[SampleInfo, Instance]]) -> None:
        """Fill in what depends on the whole collection.  DDS 1.4 §2.2.2.5.1.5-8 (view state, generations, ranks)."""
        has_generations = False
        for info, instance in reversed(chosen):
            info.sample_rank = instance.rank
            instance.rank += 1
            info.view_state = instance.view_state
            info.instance_state = instance.state
            has_generations = has_generations or instance.generation > 0
        for _, instance in chosen:
            instance.rank = 0
            instance.view_state = _NOT_NEW
        if has_generations:
            self._set_generation_ranks(chosen)

    def _set_generation_ranks(self, chosen: list[tuple[SampleInfo, Instance]]) -> None:
        latest = {info.instance_handle: _generation(info) for info, _ in chosen}  # the last one of each stays
        for info, instance in chosen:
            info.generation_rank = latest[info.instance_handle] - _generation(info)
            info.absolute_generation_rank = instance.generation - _generation(info)


def _by_instance(chosen: list[tuple[SampleInfo, Instance]]) -> list[tuple[SampleInfo, Instance]]:
    """Samples of one instance follow each other; instances and samples each in the order of arrival.

    DDS 1.4 §2.2.2.5.3.8 (read): so it is unless ordered access beyond single instances was asked for.
    """
    of_instance: dict[bytes, list[tuple[SampleInfo, Instance]]] = {}
    for entry in chosen:
        of_instance.setdefault(entry[0].instance_handle, []).append(entry)
    return [entry for entries in of_instance.values() for entry in entries]


def _generation(info: SampleInfo) -> int:
    return info.disposed_generation_count + info.no_writers_generation_count
