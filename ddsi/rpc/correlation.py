"""Writers and readers that know which sample answers which: by its identity, and PID_RELATED_SAMPLE_IDENTITY.

DDS-RPC 1.0 §7.8.2 (inline QoS of replies).  Entities of ``dcps``, with what applications otherwise have no use for.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Generic, TypeVar

from ..dcps import DataReader, DataWriter, DomainParticipant, Sample, Topic
from ..structure.cache_change import CacheChange, ChangeKind
from ..structure.guid import Guid
from ..structure.qos import Qos
from ..structure.sample_info import SampleInfo

__all__ = ["CorrelatedReader", "CorrelatedSample", "CorrelatedWriter", "Identity"]

T = TypeVar("T")
Identity = tuple[Guid, int]
"""The writer of a sample, and its number."""


class CorrelatedSample(Sample[T]):
    """``identity``: its own; ``related``: that of the sample which it answers, where its writer said so."""

    __slots__ = ("identity", "related")

    def __init__(self, data: T, info: SampleInfo, identity: Identity, related: Identity | None) -> None:
        super().__init__(data, info)
        self.identity = identity
        self.related = related


class CorrelatedWriter(DataWriter[T], Generic[T]):
    """Writes with a word on what a sample answers."""

    async def write_related(self, sample: T, related: Identity | None) -> Identity:
        """As ``write``; returns the identity of the new sample."""
        pump = self._pump
        now = pump.now()
        await pump.checkpoint(now)
        self._check_enabled()
        payload = self._serialize(sample)
        key = self._support.key(sample) if self._is_keyed else b""
        if self._writer.behavior.lacks_room(len(payload), key) is not None:
            now = await self._wait_for_room(len(payload), key)
        change = pump.engine.write(
            self._writer, ChangeKind.ALIVE, payload, key, now,
            source_timestamp=self._source_ticks(None) if self._is_by_source else None,
            key_hash=self._key_hash(key) if self._hides_keys else b"", related=related,
        )  # fmt: skip
        self._instances[key] = None
        pump.written(now)
        return self.guid, change.sequence_number


class CorrelatedReader(DataReader[T], Generic[T]):
    """Hands out samples that know their identities.

    With ``on_samples`` they are handed over as they arrive, without a task that waits for them; it must not raise.
    """

    def __init__(
        self,
        participant: DomainParticipant,
        topic: Topic[T],
        qos: Qos,
        on_samples: Callable[[list[Sample[T]]], None] | None = None,
        on_end: Callable[[], None] | None = None,
    ) -> None:
        self._on_samples = on_samples
        self._on_end = on_end
        super().__init__(participant, topic, qos)

    def _sample(self, info: SampleInfo, change: CacheChange) -> Sample[T] | None:
        sample = super()._sample(info, change)
        if sample is None:
            return None
        return CorrelatedSample(sample.data, info, (change.writer_guid, change.sequence_number), change.related)

    def _has_news(self) -> None:
        if self._on_samples is None or self._is_closed:
            super()._has_news()
        else:
            self._on_samples(self.take())

    def _on_close(self) -> None:
        super()._on_close()
        if self._on_end is not None:
            self._on_end()
