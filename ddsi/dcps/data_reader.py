"""DataReader: reads samples of one topic.  DDS 1.4 §2.2.2.5.3 (DataReader)."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, ClassVar, TypeVar

import trio

from ..behavior.content_filter import Evaluate
from ..behavior.reader_history_cache import ReaderHistoryCache
from ..engine import KeyCodec, LocalReader, LocalWriter, publication_data
from ..structure.builtin_topic_data import PublicationBuiltinTopicData
from ..structure.cache_change import CacheChange
from ..structure.discovered import ContentFilterProperty
from ..structure.errors import BadParameter, DdsTimeout, MalformedSample, PreconditionNotMet
from ..structure.guid import Guid
from ..structure.qos import EndpointQos, Qos, reader_qos
from ..structure.qos_policies import AccessScope, DataRepresentation, DataRepresentationId
from ..structure.sample_info import SampleInfo
from ..structure.status import (
    DataAvailable,
    InconsistentTopic,
    LivelinessChanged,
    RequestedDeadlineMissed,
    RequestedIncompatibleQos,
    SampleLost,
    SampleRejected,
    SecurityRefused,
    Status,
    SubscriptionMatched,
)
from ..xtypes.type_support import TypeSupport
from .content_filtered_topic import ContentFilteredTopic
from .endpoint import Endpoint, QosPlan
from .entity import check_count, deadline_scope
from .groups import Subscriber, check_family
from .sample import Sample
from .sample_reader import SampleReader
from .topic import Topic

if TYPE_CHECKING:
    from .participant import DomainParticipant

__all__ = ["DataReader", "key_codec"]

T = TypeVar("T")

_LOOK_FOR_HISTORY_S = 0.005


class DataReader(SampleReader[T], Endpoint):
    """Reads samples of a topic: ``async for sample in reader``, or ``take`` and ``read``, which never wait."""

    STATUSES: ClassVar[tuple[type, ...]] = (
        DataAvailable,
        SubscriptionMatched,
        RequestedIncompatibleQos,
        LivelinessChanged,
        RequestedDeadlineMissed,
        SampleLost,
        SampleRejected,
        InconsistentTopic,
        SecurityRefused,
    )

    def __init__(
        self,
        parent: DomainParticipant | Subscriber,
        topic: Topic[T] | ContentFilteredTopic[T],
        qos: Qos | None = None,
    ) -> None:
        """``qos`` goes before the subscriber's, and that before the topic's; the rest is the OMG's default.

        Of a ContentFilteredTopic it gets only what passes; its own topic is the related one then.  Raises
        InconsistentPolicy, NotAllowedBySecurity, AlreadyDeleted; then nothing has been created.
        """
        filtered: ContentFilteredTopic[T] | None = None
        if isinstance(topic, ContentFilteredTopic):
            topic._check_open()
            filtered, topic = topic, topic.related_topic
        participant = check_family(parent, topic, Subscriber)
        super().__init__(participant, qos)
        self._parent = parent
        self._topic: Topic[T] = topic
        self._filtered = filtered
        self._is_enabled = parent._enables_members
        support = topic.type_support
        self._deserialize = support.deserialize
        self._deserialize_key = support.deserialize_key
        self._undecodable: list[CacheChange] = []
        plan = self._plan()
        self._qos, self._endpoint_qos = plan.merged, plan.resolved
        self._create(plan)
        if filtered is not None:
            filtered._readers.add(self)
        parent._adopt(self)
        self._pump.settle()

    def _create(self, plan: QosPlan) -> None:
        parent, topic, support, filtered = self._parent, self._topic, self._topic.type_support, self._filtered
        self._reader: LocalReader = self._pump.engine.create_reader(
            topic.name,
            support.type_name,
            plan.resolved,
            self._pump.now(),
            is_enabled=self._is_enabled,
            is_keyed=support.is_keyed,
            keys=key_codec(support) if support.is_keyed else None,
            content_filter=(filtered._announced, filtered._evaluate) if filtered is not None else None,
            types=support.type_description if self._pump.engine.config.announce_types else None,
            group=parent._group if isinstance(parent, Subscriber) else None,
        )
        history = self._reader.history
        assert history is not None
        self._history: ReaderHistoryCache = history
        self._participant._register(self._reader.guid, self)

    def _create_anew(self, plan: QosPlan) -> None:
        before = self._history
        super()._create_anew(plan)
        self._pump.woken(before, self._news)  # who waits for samples waits for those of the new one

    def _delete(self, local: LocalWriter | LocalReader) -> None:
        assert isinstance(local, LocalReader)
        self._participant._deregister(local.guid)
        self._participant._when_running(lambda pump: pump.engine.delete_reader(local, pump.now()))

    def _on_enable(self) -> None:
        self._pump.engine.user_endpoints.enable_reader(self._reader, self._pump.now())
        self._pump.settle()

    def __repr__(self) -> str:
        return f"<DataReader of {self._topic.name!r} {self.guid}, {len(self._history)} samples>"

    @property
    def topic(self) -> Topic[T]:
        return self._topic

    @property
    def content_filtered_topic(self) -> ContentFilteredTopic[T] | None:
        """What it was made of, if that was not the topic itself."""
        return self._filtered

    @property
    def guid(self) -> Guid:
        return self._reader.guid

    def lookup_instance(self, sample: T) -> bytes | None:
        """The handle of the instance that ``sample`` belongs to; None if the reader does not know it."""
        key = self._topic.type_support.key(sample)
        return key if key in self._history.instances else None

    def get_key_value(self, handle: bytes) -> T:
        """A sample with the key of a known instance, the type's defaults elsewhere.  Raises BadParameter.

        DDS 1.4 §2.2.2.5.3.29.
        """
        if handle not in self._history.instances:
            raise BadParameter(f"{self!r} knows no instance {handle!r}, or no longer")
        return self._topic.type_support.sample_from_key(handle)

    # --- waiting -----------------------------------------------------------------------------------------

    async def wait_for_matched(self, count: int = 1, timeout: float | None = None) -> None:
        """Until at least ``count`` writers are matched.  Raises DdsTimeout after ``timeout`` seconds."""
        check_count("count", count)
        await self._participant._wait_until(
            self, lambda: self._reader.matched.current_count >= count, timeout,
            f"reader of {self._topic.name!r} has not matched {count} writer(s)",
        )  # fmt: skip

    async def wait_for_historical_data(self, timeout: float | None = None) -> None:
        """Until all that the matched transient-local writers held at the match has come.  Raises DdsTimeout.

        DDS 1.4 §2.2.2.5.3.32.  Returns at once where no matched writer keeps history.
        """
        self._check_open()
        scope = deadline_scope(timeout)
        self._pump.before_waiting()
        await trio.lowlevel.checkpoint()
        with scope:
            # Looked at now and then: a HEARTBEAT that says "there was nothing" is no news for anybody else.
            while True:
                self._check_open()
                if all(proxy.has_historical_data for proxy in self._reader.behavior.writers.values()):
                    return
                await trio.sleep(_LOOK_FOR_HISTORY_S)
        raise DdsTimeout(f"reader of {self._topic.name!r} still lacks historical data after {timeout} s")

    def matched_publications(self) -> list[Guid]:
        """The Guids of the writers that are matched now."""
        return list(self._reader.behavior.writers)

    def matched_publication_data(self, handle: Guid) -> PublicationBuiltinTopicData:
        """What is known of a writer that is matched now: its QoS, and of its security who writes, and how protected.

        ``handle``: its Guid, of :meth:`matched_publications` or a sample's ``info.publication_handle``.  A writer of
        our own participant is known too.  Raises BadParameter when it is not matched, or no longer; a
        BuiltinTopicReader still has the data of one that is gone.  DDS 1.4 §2.2.2.5.3.33.
        """
        self._check_open()
        proxy = self._reader.behavior.writers.get(handle)
        if proxy is None:
            raise BadParameter(f"reader of {self._topic.name!r}: writer {handle!r} is not matched, or no longer")
        return publication_data(proxy.data, self._pump.engine.hooks)

    # --- inside ------------------------------------------------------------------------------------------

    def _resolve(self, merged: Qos) -> EndpointQos:
        return _with_representations(reader_qos(merged), self._topic.type_support.representations)

    def _local(self) -> LocalReader:
        return self._reader

    def _follow(self, plan: QosPlan) -> None:
        self._pump.engine.qos_changes.change_reader(self._reader, plan.resolved, self._pump.now())
        super()._follow(plan)
        self._pump.settle()

    def _set_content_filter(self, announced: ContentFilterProperty, evaluate: Evaluate) -> None:
        """Its content-filtered topic has other parameters."""
        self._pump.engine.set_content_filter(self._reader, announced, evaluate, self._pump.now())
        self._pump.settle()

    def _sample(self, info: SampleInfo, change: CacheChange) -> Sample[T] | None:
        """The sample as an object; None, and counted as lost, if its octets are not one."""
        try:
            if info.valid_data:
                return Sample(self._deserialize(change.payload), info)
            return Sample(self._key_sample(change, info), info)
        except MalformedSample as error:
            if not any(change is known for known in self._undecodable):
                self._undecodable.append(change)
                self._pump.engine.sample_malformed(self._reader, change, str(error))
                self._pump.settle()
            return None

    def _drop_undecodable(self) -> None:
        """What was found not to decode while it stays in the cache: nobody shall meet it again."""
        if self._undecodable:
            undecodable, self._undecodable = self._undecodable, []
            self._history.take(selector=lambda info: any(info.change is known for known in undecodable))
            self._after_taking()

    def _key_sample(self, change: CacheChange, info: SampleInfo) -> T:
        if len(change.payload) >= 4:
            return self._deserialize_key(change.payload)
        return self._topic.type_support.sample_from_key(info.instance_handle)

    def _begin_reading(self, max_samples: int | None, instance: bytes | None) -> int | None:
        max_samples = super()._begin_reading(max_samples, instance)
        return self._parent._limit_of(self, max_samples) if isinstance(self._parent, Subscriber) else max_samples

    def _check_iterable(self) -> None:
        scope = self._endpoint_qos.presentation.access_scope
        if scope is AccessScope.GROUP and isinstance(self._parent, Subscriber):
            raise PreconditionNotMet(
                f"{self!r} has access scope GROUP: take() within `with subscriber.access():`, as what it shows has to "
                "fit what the subscriber's other readers show"
            )

    def _after_taking(self) -> None:
        """There is room again: a reliable writer whose samples had to wait may go on."""
        if self._history.is_withholding:
            self._history.is_withholding = False
            self._pump.engine.samples_taken(self._reader, self._pump.now())
            self._pump.settle()

    def _has_news(self) -> None:
        super()._has_news()
        self._parent._has_news()

    def _status_changed(self, status: Status) -> None:
        if isinstance(status, InconsistentTopic):
            self._topic._found_inconsistent(status)
        super()._status_changed(status)

    def _on_close(self) -> None:
        self._parent._disown(self)
        super()._on_close()
        self._delete(self._reader)


def _with_representations(qos: EndpointQos, possible: tuple[DataRepresentationId, ...]) -> EndpointQos:
    """A reader understands both, unless it is told to insist on one, or the type is for one alone."""
    if qos.data_representation.ids:
        return qos
    return replace(qos, data_representation=DataRepresentation(*sorted(possible)))


def key_codec(support: TypeSupport[Any]) -> KeyCodec:
    """How the engine finds the instances of this type."""
    return KeyCodec(
        from_payload=support.key_from_payload,
        from_key_payload=support.key_from_key_payload,
        from_key_hash=support.key_from_key_hash,
        to_key_hash=lambda key: support.key_hash(key, DataRepresentationId.XCDR1),
        to_secret_key_hash=lambda key: support.key_hash(key, DataRepresentationId.XCDR1, is_secret=True),
    )
