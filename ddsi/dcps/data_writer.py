"""DataWriter: writes samples of one topic.  DDS 1.4 §2.2.2.4.2 (DataWriter)."""

from __future__ import annotations

import math
from dataclasses import replace
from datetime import datetime
from typing import TYPE_CHECKING, ClassVar, Generic, TypeVar

import trio

from ..engine import LocalReader, LocalWriter, subscription_data
from ..structure.builtin_topic_data import SubscriptionBuiltinTopicData
from ..structure.cache_change import ChangeKind, StatusInfo
from ..structure.errors import BadParameter, DdsTimeout, PreconditionNotMet
from ..structure.guid import Guid
from ..structure.qos import EndpointQos, Qos, writer_qos
from ..structure.qos_concerns import QosOwner
from ..structure.qos_policies import BySourceTimestamp, DataRepresentation, DataRepresentationId
from ..structure.status import (
    InconsistentTopic,
    LivelinessLost,
    OfferedDeadlineMissed,
    OfferedIncompatibleQos,
    PublicationMatched,
    SecurityRefused,
    Status,
)
from ..structure.time import Time
from .content_filtered_topic import filter_compiler
from .endpoint import Endpoint, QosPlan
from .entity import check_count, deadline_scope
from .groups import Publisher, check_family
from .topic import Topic

if TYPE_CHECKING:
    from .participant import DomainParticipant

__all__ = ["DataWriter"]

_MOST_KEY_HASHES = 1024  # that are remembered, where every sample bears one

T = TypeVar("T")
Timestamp = float | datetime


class DataWriter(Endpoint, Generic[T]):
    """Writes samples of a topic; created without waiting, closed with its participant or by ``close()``."""

    _QOS_OWNER: ClassVar[QosOwner] = "writer"
    STATUSES: ClassVar[tuple[type, ...]] = (
        PublicationMatched,
        OfferedIncompatibleQos,
        LivelinessLost,
        OfferedDeadlineMissed,
        InconsistentTopic,
        SecurityRefused,
    )

    def __init__(self, parent: DomainParticipant | Publisher, topic: Topic[T], qos: Qos | None = None) -> None:
        """``qos`` goes before the publisher's, and that before the topic's; the rest is the OMG's default (reliable).

        Raises InconsistentPolicy, NotAllowedBySecurity, AlreadyDeleted; then nothing has been created.
        """
        participant = check_family(parent, topic, Publisher)
        super().__init__(qos)
        self._parent = parent
        self._participant = participant
        self._topic: Topic[T] = topic
        support = topic.type_support
        self._support = support
        self._is_enabled = parent._enables_members
        self._key = support.key
        self._is_keyed = support.is_keyed
        # What it has registered, by writing or in so many words; without key it is all one instance, b"".
        self._instances: dict[bytes, None] = {}
        self._latest_ticks = 0
        self._progress = trio.lowlevel.ParkingLot()
        self._pump = participant._running_pump()
        plan = self._plan()
        self._qos, self._endpoint_qos = plan.merged, plan.resolved
        self._create(plan)
        parent._adopt(self)
        self._pump.settle()

    def _create(self, plan: QosPlan) -> None:
        parent, topic, support, resolved = self._parent, self._topic, self._support, plan.resolved
        representation = resolved.data_representation.ids[0]
        self._writer: LocalWriter = self._pump.engine.create_writer(
            topic.name,
            support.type_name,
            resolved,
            self._pump.now(),
            is_enabled=self._is_enabled,
            is_keyed=support.is_keyed,
            compile_filter=filter_compiler(support),
            types=support.type_description if self._pump.engine.config.announce_types else None,
            group=parent._group if isinstance(parent, Publisher) else None,
        )
        if isinstance(parent, Publisher) and parent._is_suspended:
            self._pump.engine.presentation.suspend(self._writer)
        self._representation = representation
        self._serialize = support.serializer(representation)
        self._serialize_key = support.key_serializer(representation)
        self._hides_keys = support.is_keyed and self._writer.protection.key_protected
        self._key_hashes: dict[bytes, bytes] = {}
        self._is_by_source = isinstance(resolved.destination_order, BySourceTimestamp)
        self._participant._register(self._writer.guid, self)

    def _delete(self, local: LocalWriter | LocalReader) -> None:
        assert isinstance(local, LocalWriter)
        self._participant._deregister(local.guid)
        self._participant._when_running(lambda pump: pump.engine.delete_writer(local, pump.now()))

    def _on_enable(self) -> None:
        self._pump.engine.user_endpoints.enable_writer(self._writer, self._pump.now())
        self._pump.settle()

    def __repr__(self) -> str:
        return f"<DataWriter of {self._topic.name!r} {self.guid}>"

    @property
    def topic(self) -> Topic[T]:
        return self._topic

    @property
    def guid(self) -> Guid:
        return self._writer.guid

    # --- writing -----------------------------------------------------------------------------------------

    async def write(self, sample: T, *, timestamp: Timestamp | None = None) -> None:
        """Write one sample.  Returns as soon as it is in the history and on its way.

        It waits only where a reliable writer may not take more (resource limits, octets not acknowledged), and
        then at most ``max_blocking_time``: DdsTimeout.  ``timestamp``: seconds since 1970 or a datetime; now.
        Raises BadParameter, naming the member, when the sample cannot be serialised; AlreadyDeleted.
        """
        pump = self._pump
        now = pump.now()
        await pump.checkpoint(now)
        if self._is_closed or not self._is_enabled:
            self._check_enabled()
        writer = self._writer
        payload = self._serialize(sample)
        key = self._key(sample) if self._is_keyed else b""
        if writer.behavior.lacks_room(len(payload), key) is not None:
            now = await self._wait_for_room(len(payload), key)
        pump.engine.write(
            writer, ChangeKind.ALIVE, payload, key, now,
            source_timestamp=None if timestamp is None and not self._is_by_source else self._source_ticks(timestamp),
            key_hash=self._key_hash(key) if self._hides_keys else b"",
        )  # fmt: skip
        if key not in self._instances:
            self._instances[key] = None
        pump.written(now)

    async def dispose(self, sample: T, *, timestamp: Timestamp | None = None) -> None:
        """The instance that ``sample`` belongs to (only its key fields matter) has come to its end."""
        await self._write_end(ChangeKind.NOT_ALIVE_DISPOSED, sample, timestamp)

    async def unregister(self, sample: T, *, timestamp: Timestamp | None = None) -> None:
        """This writer will not write the instance any more; by default that disposes it too (WriterDataLifecycle)."""
        autodispose = self._endpoint_qos.writer_data_lifecycle.autodispose_unregistered_instances
        kind = ChangeKind.NOT_ALIVE_DISPOSED_UNREGISTERED if autodispose else ChangeKind.NOT_ALIVE_UNREGISTERED
        await self._write_end(kind, sample, timestamp)

    async def _write_end(self, kind: ChangeKind, sample: T, timestamp: Timestamp | None) -> None:
        self._check_has_instances()
        now = self._pump.now()
        await self._pump.checkpoint(now)
        self._check_enabled()
        payload = self._serialize_key(sample)
        key = self._support.key(sample)
        if self._writer.behavior.lacks_room(len(payload), key) is not None:
            now = await self._wait_for_room(len(payload), key)
        self._pump.engine.write(
            self._writer, kind, payload, key, now,
            source_timestamp=None if timestamp is None and not self._is_by_source else self._source_ticks(timestamp),
            key_hash=self._key_hash(key),
        )  # fmt: skip
        if kind & StatusInfo.UNREGISTERED:
            self._instances.pop(key, None)
        else:
            self._instances[key] = None
        self._pump.written(now)

    def _source_ticks(self, timestamp: Timestamp | None) -> int:
        """A source timestamp.  Raises BadParameter where it is older than the one before and readers order by source.

        DDS 1.4 §2.2.2.4.2.6; a clock that was set back, where none is given, gets no sample out of order.
        """
        ticks = self._pump.engine.wall_ticks() if timestamp is None else _ticks(timestamp)
        if self._is_by_source:
            if ticks < self._latest_ticks:
                if timestamp is not None:
                    raise BadParameter(
                        f"timestamp {timestamp} is older than the one before, {float(Time(self._latest_ticks))}, and "
                        "readers order by source: write in order, or with ByReceptionTimestamp()"
                    )
                ticks = self._latest_ticks
            self._latest_ticks = ticks
        return ticks

    # --- instances ---------------------------------------------------------------------------------------

    def register_instance(self, sample: T) -> bytes:
        """Announce that the instance that ``sample`` belongs to will be written; returns its handle.

        Writing does so too.  Nobody is told: RTPS knows no such message.  DDS 1.4 §2.2.2.4.2.5.
        """
        self._check_has_instances()
        self._check_enabled()
        key = self._support.key(sample)
        self._instances[key] = None
        return key

    def lookup_instance(self, sample: T) -> bytes | None:
        """The handle of the instance that ``sample`` belongs to; None if it is not registered here."""
        key = self._support.key(sample)
        return key if key in self._instances else None

    def get_key_value(self, handle: bytes) -> T:
        """A sample with the key of a registered instance, the type's defaults elsewhere.  Raises BadParameter.

        DDS 1.4 §2.2.2.4.2.9.
        """
        if handle not in self._instances:
            raise BadParameter(f"{self!r} has registered no instance {handle!r}, or has unregistered it")
        return self._support.sample_from_key(handle)

    def _check_has_instances(self) -> None:
        if not self._is_keyed:
            raise PreconditionNotMet(f"topic {self._topic.name!r} has no key, so it has no instances to end")

    def _say_farewell(self) -> None:
        """Unregister all instances; WriterDataLifecycle decides that this disposes them.  DDS 1.4 §2.2.3.21.

        Where it does not, the end of the writer, which all readers hear of, says as much.  What was kept back, as
        publications are suspended, is sent.
        """
        if self._pump.is_closed:
            return
        engine, now = self._pump.engine, self._pump.now()
        instances, self._instances = self._instances, {}
        if self._is_keyed and self._endpoint_qos.writer_data_lifecycle.autodispose_unregistered_instances:
            for key in instances:
                engine.write(
                    self._writer, ChangeKind.NOT_ALIVE_DISPOSED_UNREGISTERED,
                    self._serialize_key(self._support.sample_from_key(key)), key, now, key_hash=self._key_hash(key),
                )  # fmt: skip
        if self._writer.behavior.is_suspended:
            engine.presentation.resume(self._writer, now)

    def _key_hash(self, key: bytes) -> bytes:
        """Where the key is protected the hash is a digest, and goes with samples too: nobody can compute it before
        decrypting them."""
        found = self._key_hashes.get(key)
        if found is None:
            if len(self._key_hashes) >= _MOST_KEY_HASHES:
                self._key_hashes.clear()
            found = self._support.key_hash(key, self._representation, is_secret=self._hides_keys)
            self._key_hashes[key] = found
        return found

    async def _wait_for_room(self, octets: int, key: bytes) -> float:
        """Until one more change of so many octets may enter; returns the time.  Raises DdsTimeout."""
        limit = self._endpoint_qos.reliability.max_blocking_time
        behavior = self._writer.behavior
        with trio.move_on_after(limit) if limit < math.inf else trio.CancelScope():
            asked_at = -1
            while (reason := behavior.lacks_room(octets, key)) is not None:
                asked_at = self._ask_for_acknowledgment(asked_at)
                await self._wait_for_progress()
                self._check_open()
            return self._pump.now()
        raise DdsTimeout(
            f"writer of {self._topic.name!r} found no room within max_blocking_time={limit} s: {reason}; "
            "its readers are too slow, or one of them does not answer"
        )

    def _ask_for_acknowledgment(self, asked_at: int) -> int:
        """Ask the readers what they have, but not the same twice: a reader that is full answers and gets no further,
        and asking at each answer would turn waiting into a storm.  Its writer's heartbeats go on asking, at their pace.
        """
        acked_sn = self._writer.behavior.min_acked_sn()
        if acked_sn != asked_at:
            self._pump.engine.request_acknowledgment(self._writer, self._pump.now())
        self._pump.settle()
        return acked_sn

    async def _wait_for_progress(self) -> None:
        self._writer.wants_acknowledgment += 1
        try:
            await self._progress.park()
        finally:
            self._writer.wants_acknowledgment -= 1

    # --- waiting -----------------------------------------------------------------------------------------

    async def wait_for_acknowledgments(self, timeout: float | None = None) -> None:
        """Until every matched reliable reader has all that was written so far.  Raises DdsTimeout.

        DDS 1.4 §2.2.2.4.2.15.  A reader that is unmatched meanwhile counts as satisfied.
        """
        self._check_open()
        await trio.lowlevel.checkpoint()
        self._check_open()
        behavior = self._writer.behavior
        last_sn = behavior.cache.last_sn
        with deadline_scope(timeout):
            self._pump.settle()
            asked_at = -1
            while behavior.min_acked_sn() < last_sn:
                asked_at = self._ask_for_acknowledgment(asked_at)
                await self._wait_for_progress()
                self._check_open()
            return
        raise DdsTimeout(
            f"writer of {self._topic.name!r}: number {behavior.min_acked_sn()} of {last_sn} is acknowledged "
            f"after {timeout} s"
        )

    async def wait_for_matched(self, count: int = 1, timeout: float | None = None) -> None:
        """Until at least ``count`` readers are matched.  Raises DdsTimeout after ``timeout`` seconds."""
        check_count("count", count)
        await self._participant._wait_until(
            self, lambda: self._writer.matched.current_count >= count, timeout,
            f"writer of {self._topic.name!r} has not matched {count} reader(s)",
        )  # fmt: skip

    def matched_subscriptions(self) -> list[Guid]:
        """The Guids of the readers that are matched now."""
        return [*self._writer.behavior.readers, *self._writer.behavior.local_readers]

    def matched_subscription_data(self, handle: Guid) -> SubscriptionBuiltinTopicData:
        """What is known of a reader that is matched now: its QoS, and of its security who reads, and how protected.

        ``handle``: its Guid, of :meth:`matched_subscriptions`.  A reader of our own participant is known too.  Raises
        BadParameter when it is not matched, or no longer.  DDS 1.4 §2.2.2.4.2 (get_matched_subscription_data).
        """
        self._check_open()
        behavior = self._writer.behavior
        proxy = behavior.readers.get(handle) or behavior.local_readers.get(handle)
        if proxy is None:
            raise BadParameter(f"writer of {self._topic.name!r}: reader {handle!r} is not matched, or no longer")
        return subscription_data(proxy.data, self._pump.engine.hooks)

    def assert_liveliness(self) -> None:
        """Say that this writer is alive, where its liveliness is manual.  DDS 1.4 §2.2.2.4.2.22."""
        self._check_open()
        self._pump.engine.liveliness.assert_writer(self._writer, self._pump.now())
        self._pump.settle()

    # --- inside ------------------------------------------------------------------------------------------

    def _resolve(self, merged: Qos) -> EndpointQos:
        return _with_representation(writer_qos(merged), self._support.representations, self._topic)

    def _local(self) -> LocalWriter:
        return self._writer

    def _follow(self, plan: QosPlan) -> None:
        engine, now = self._pump.engine, self._pump.now()
        engine.qos_changes.change_writer(self._writer, plan.resolved, now, self._instances)
        super()._follow(plan)
        self._pump.settle()

    def _made_progress(self) -> None:
        self._progress.unpark_all()

    def _status_changed(self, status: Status) -> None:
        if isinstance(status, InconsistentTopic):
            self._topic._found_inconsistent(status)
        super()._status_changed(status)

    def _on_close(self) -> None:
        self._parent._disown(self)
        self._progress.unpark_all()
        self._say_farewell()
        self._delete(self._writer)


def _with_representation(qos: EndpointQos, possible: tuple[DataRepresentationId, ...], topic: Topic[T]) -> EndpointQos:
    """A writer offers one representation: the first that was asked for, else the type's own choice."""
    wanted = qos.data_representation.ids or possible[:1]
    if wanted[0] not in (DataRepresentationId.XCDR1, DataRepresentationId.XCDR2):
        raise BadParameter(f"topic {topic.name!r}: {wanted[0].name} cannot be written; use XCDR1 or XCDR2")
    if wanted[0] not in possible:
        raise BadParameter(f"topic {topic.name!r}: its type is for {possible[0].name} alone, not for {wanted[0].name}")
    return replace(qos, data_representation=DataRepresentation(wanted[0]))


def _ticks(timestamp: Timestamp) -> int:
    """A source timestamp in ticks.  Raises BadParameter."""
    seconds = timestamp.timestamp() if isinstance(timestamp, datetime) else timestamp
    if not isinstance(seconds, (int, float)):
        raise BadParameter(f"timestamp is a number of seconds since 1970 or a datetime, not {timestamp!r}")
    try:
        return Time.from_seconds(seconds).ticks
    except (ValueError, TypeError) as error:
        raise BadParameter(f"timestamp: {error}") from error
