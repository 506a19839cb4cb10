"""LocalWriter and LocalReader: an application's endpoint as the engine holds it.

What was announced of it, its behavior, where its messages are packed, and its statuses (DDS 1.4 §2.2.4.1).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import field, replace
from typing import ClassVar

from ..behavior.coherent_sets import CoherentSets
from ..behavior.content_filter import CompileFilter
from ..behavior.publisher_group import PublisherGroup
from ..behavior.reader_history_cache import ReaderHistoryCache
from ..behavior.stateful_reader import StatefulReader
from ..behavior.stateful_writer import StatefulWriter
from ..behavior.subscriber_group import SubscriberGroup
from ..messages.heartbeat import HeartbeatGroupInfo
from ..messages.packer import MessagePacker
from ..spi import ProtectedEndpoint
from ..structure.cache_change import CacheChange, ChangeKind
from ..structure.dataclass import dataclass
from ..structure.discovered import DiscoveredReaderData, DiscoveredWriterData
from ..structure.guid import Guid
from ..structure.status import (
    Incompatibility,
    InconsistentTopic,
    LivelinessChanged,
    LivelinessLost,
    OfferedDeadlineMissed,
    OfferedIncompatibleQos,
    PublicationMatched,
    RequestedDeadlineMissed,
    RequestedIncompatibleQos,
    SampleLost,
    SampleRejected,
    SampleRejectedKind,
    Status,
    SubscriptionMatched,
)

__all__ = ["KeyCodec", "LocalReader", "LocalWriter", "Octets"]

Octets = bytes | bytearray | memoryview

_REJECTED_BY = {
    "max_instances": SampleRejectedKind.INSTANCES_LIMIT,
    "max_samples_per_instance": SampleRejectedKind.SAMPLES_PER_INSTANCE_LIMIT,
}


@dataclass(frozen=True, slots=True)
class KeyCodec:
    """How a reader finds the instance that octets belong to; made from the topic's type.

    Each returns the key in canonical form and raises MalformedSample.  ``from_key_hash`` returns None where the
    hash is a digest that cannot be turned back.  ``to_secret_key_hash`` always makes a digest (DDS-Security 1.1
    §8.4.2.7, is_key_protected).
    """

    from_payload: Callable[[Octets], bytes]
    from_key_payload: Callable[[Octets], bytes]
    from_key_hash: Callable[[bytes], bytes | None]
    to_key_hash: Callable[[bytes], bytes]
    to_secret_key_hash: Callable[[bytes], bytes]


class LocalWriter:
    """A DataWriter of this participant (or one of its builtin writers)."""

    KIND: ClassVar[str] = "writer"

    __slots__ = (
        "assertion_due",
        "behavior",
        "compile_filter",
        "data",
        "deadline",
        "group",
        "guid",
        "has_fresh_samples",
        "has_lost_liveliness",
        "incompatible",
        "inconsistent",
        "joining_readers",
        "liveliness",
        "matched",
        "packer",
        "protection",
        "receivers",
        "timer_due",
        "wants_acknowledgment",
    )

    def __init__(self, data: DiscoveredWriterData, behavior: StatefulWriter, packer: MessagePacker) -> None:
        self.data = data
        self.guid: Guid = data.guid
        self.behavior = behavior
        self.packer = packer
        self.group: PublisherGroup | None = None  # that of its publisher
        self.has_fresh_samples = False  # were any packed since the last piggybacked HEARTBEAT?
        self.protection = ProtectedEndpoint()
        self.receivers: tuple[Guid, ...] = ()
        self.joining_readers: frozenset[Guid] = frozenset()  # those that open a payload after joining its fragments
        self.matched = PublicationMatched()
        self.incompatible = OfferedIncompatibleQos()
        self.inconsistent = InconsistentTopic()
        self.liveliness = LivelinessLost()
        self.deadline = OfferedDeadlineMissed()
        self.timer_due = float("inf")
        self.assertion_due = float("inf")
        self.has_lost_liveliness = False
        self.wants_acknowledgment = 0  # how many wait for its progress
        self.compile_filter: CompileFilter | None = None  # without it no reader's content filter is evaluated

    def group_info(self, first_sn: int, last_sn: int) -> HeartbeatGroupInfo | None:
        """What a HEARTBEAT over these numbers says of the publisher, where its order matters.  RTPS 2.5 §8.3.8.6.

        Of this writer: up to ``current_gsn`` it has nothing but what the HEARTBEAT announces.
        """
        group, behavior = self.group, self.behavior
        if group is None or not group.is_numbered(self.guid):
            return None
        current_gsn = group.group_sn
        for number in range(behavior.next_unsent_sn, behavior.cache.last_sn + 1):
            unsent = behavior.cache.get(number)
            if unsent is not None and unsent.coherence is not None:
                current_gsn = unsent.coherence.group_sn - 1
                break
        first, last = behavior.cache.get(first_sn), behavior.cache.get(last_sn)
        # What all have acknowledged may be out of the cache; how far it went is worth telling to those who come now.
        last_gsn = min(group.last_of(self.guid), current_gsn)
        if last is not None and last.coherence is not None:
            last_gsn = last.coherence.group_sn
        first_gsn = first.coherence.group_sn if first is not None and first.coherence is not None else last_gsn + 1
        return HeartbeatGroupInfo(current_gsn, first_gsn, last_gsn, group.writer_set, bytes(4))

    def match_changed(self, reader: Guid, change: int) -> Status:
        """One matched reader more (+1) or less (-1)."""
        status = self.matched
        self.matched = PublicationMatched(
            total_count=status.total_count + max(change, 0),
            total_count_change=max(change, 0),
            current_count=status.current_count + change,
            current_count_change=change,
            last_subscription_handle=reader,
        )
        return self.matched

    def found_incompatible(self, reader: Guid, reasons: tuple[Incompatibility, ...]) -> Status:
        self.incompatible = OfferedIncompatibleQos(
            total_count=self.incompatible.total_count + 1,
            total_count_change=1,
            last_policy_id=reasons[0].policy_id,
            incompatibilities=reasons,
            last_subscription_handle=reader,
        )
        return self.incompatible

    def inconsistent_topic(self, remote_type_name: str, reason: str) -> Status:
        self.inconsistent = _one_more(self.inconsistent, remote_type_name, reason)
        return self.inconsistent

    def liveliness_lost(self) -> Status:
        self.liveliness = replace(self.liveliness, total_count=self.liveliness.total_count + 1, total_count_change=1)
        return self.liveliness

    def deadline_missed(self, key: bytes) -> Status:
        total = self.deadline.total_count + 1
        self.deadline = OfferedDeadlineMissed(total_count=total, total_count_change=1, last_instance_handle=key)
        return self.deadline


@dataclass(slots=True)
class LocalReader:
    """A DataReader of this participant.  ``history`` is the behavior's change sink."""

    KIND: ClassVar[str] = "reader"

    data: DiscoveredReaderData
    behavior: StatefulReader
    history: ReaderHistoryCache | None
    keys: KeyCodec | None
    guid: Guid = field(init=False)
    uses_filter: bool = False
    sets: CoherentSets | None = None  # what stands before the history, where the reader asks for more than samples
    subscriber: SubscriberGroup | None = None  # that of its subscriber, where access scope is GROUP
    protection: ProtectedEndpoint = ProtectedEndpoint()
    matched: SubscriptionMatched = SubscriptionMatched()
    incompatible: RequestedIncompatibleQos = RequestedIncompatibleQos()
    liveliness: LivelinessChanged = LivelinessChanged()
    deadline: RequestedDeadlineMissed = RequestedDeadlineMissed()
    lost: SampleLost = SampleLost()
    rejected: SampleRejected = SampleRejected()
    inconsistent: InconsistentTopic = InconsistentTopic()
    _keys_by_hash: dict[bytes, bytes] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.guid = self.data.guid

    def match_changed(self, writer: Guid, change: int) -> Status:
        """One matched writer more (+1) or less (-1)."""
        status = self.matched
        self.matched = SubscriptionMatched(
            total_count=status.total_count + max(change, 0),
            total_count_change=max(change, 0),
            current_count=status.current_count + change,
            current_count_change=change,
            last_publication_handle=writer,
        )
        return self.matched

    def liveliness_changed(self, writer: Guid, *, alive: int, not_alive: int) -> Status:
        """So many writers more (or, negative, less) are alive, or are not."""
        status = self.liveliness
        self.liveliness = LivelinessChanged(
            alive_count=status.alive_count + alive,
            alive_count_change=alive,
            not_alive_count=status.not_alive_count + not_alive,
            not_alive_count_change=not_alive,
            last_publication_handle=writer,
        )
        return self.liveliness

    def found_incompatible(self, writer: Guid, reasons: tuple[Incompatibility, ...]) -> Status:
        self.incompatible = RequestedIncompatibleQos(
            total_count=self.incompatible.total_count + 1,
            total_count_change=1,
            last_policy_id=reasons[0].policy_id,
            incompatibilities=reasons,
            last_publication_handle=writer,
        )
        return self.incompatible

    def samples_lost(self, count: int, reason: str) -> Status:
        self.lost = SampleLost(total_count=self.lost.total_count + count, total_count_change=count, reason=reason)
        return self.lost

    def deadline_missed(self, key: bytes) -> Status:
        total = self.deadline.total_count + 1
        self.deadline = RequestedDeadlineMissed(total_count=total, total_count_change=1, last_instance_handle=key)
        return self.deadline

    def sample_rejected(self, limit: str, key: bytes) -> SampleRejected:
        """``limit``: as the history calls it; octets of history count as samples."""
        self.rejected = SampleRejected(
            total_count=self.rejected.total_count + 1,
            total_count_change=1,
            last_reason=_REJECTED_BY.get(limit, SampleRejectedKind.SAMPLES_LIMIT),
            last_instance_handle=key,
            reason=limit,
        )
        return self.rejected

    def inconsistent_topic(self, remote_type_name: str, reason: str) -> Status:
        self.inconsistent = _one_more(self.inconsistent, remote_type_name, reason)
        return self.inconsistent

    def key_of(self, change: CacheChange) -> bytes | None:
        """The canonical key of the change's instance; None when it cannot be told.  Raises MalformedSample.

        Without a payload only the key hash names the instance; where it is a digest, it is looked up among those known.
        """
        if self.keys is None:
            return b""
        if change.kind is ChangeKind.ALIVE:
            return self.keys.from_payload(change.payload)
        if len(change.payload) >= 4:
            return self.keys.from_key_payload(change.payload)
        if not change.key_hash:
            return None
        if self.protection.key_protected:
            return self._known_key(change.key_hash, self.keys.to_secret_key_hash)
        return self.keys.from_key_hash(change.key_hash) or self._known_key(change.key_hash, self.keys.to_key_hash)

    def _known_key(self, key_hash: bytes, to_key_hash: Callable[[bytes], bytes]) -> bytes | None:
        if self.history is None:
            return None
        known = self._keys_by_hash
        if key_hash not in known:
            if len(known) > 2 * len(self.history.instances) + 64:
                known.clear()
            hashed = set(known.values())
            for key in self.history.instances:
                if key not in hashed:
                    known[to_key_hash(key)] = key
        return known.get(key_hash)


def _one_more(status: InconsistentTopic, remote_type_name: str, reason: str) -> InconsistentTopic:
    return InconsistentTopic(
        total_count=status.total_count + 1, total_count_change=1, remote_type_name=remote_type_name, reason=reason
    )
