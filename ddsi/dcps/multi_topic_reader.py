"""MultiTopicReader: reads the joined samples of a MultiTopic, as a DataReader reads of a topic.  DDS 1.4 §2.2.2.3.5.

It has a DataReader for each topic, and takes from these whenever it is asked for samples itself.  The latest samples
of their instances are joined; each new combination is a sample of the result, and one that is no more (as a part of it
came to its end, agrees no longer, or does not fulfil the condition any more) the end of the result's instance.
"""

from __future__ import annotations

from contextlib import suppress
from typing import TYPE_CHECKING, Any, TypeVar, cast

from ..behavior.reader_history_cache import ReaderHistoryCache, SampleSelector
from ..structure.cache_change import CacheChange, ChangeKind
from ..structure.errors import BadParameter, PreconditionNotMet
from ..structure.guid import Guid
from ..structure.qos import Qos, reader_qos
from ..structure.sample_info import SampleInfo
from .conditions import ReadCondition
from .data_reader import DataReader
from .entity import EventStream
from .groups import Subscriber
from .multi_topic import MultiTopic
from .sample import Sample
from .sample_reader import SampleReader

if TYPE_CHECKING:
    from ..xtypes.sql import Combination
    from .participant import DomainParticipant

__all__ = ["MultiTopicReader"]

S = TypeVar("S")
T = TypeVar("T")


class _JoinedChange(CacheChange):
    """A sample of the result, as an object: it was never octets."""

    __slots__ = ("data",)

    def __init__(self, kind: ChangeKind, writer: Guid, number: int, key: bytes, ticks: int, data: Any) -> None:
        super().__init__(kind, writer, number, b"", key, ticks)
        self.data = data


class _Part(DataReader[Any]):
    """The reader of one topic; its news are those of the joined reader."""

    _is_part = True
    whole: MultiTopicReader[Any] | None = None

    def _has_news(self) -> None:
        super()._has_news()
        if self.whole is not None:
            self.whole._has_news()


class MultiTopicReader(SampleReader[T]):
    """``take``, ``read``, ``wait``, conditions and ``async for`` as of any reader.

    ``info.publication_handle`` and the source timestamp are those of the sample that made the combination.
    """

    def __init__(self, parent: DomainParticipant | Subscriber, topic: MultiTopic[T], qos: Qos | None = None) -> None:
        """``qos``: of its readers of the topics, as for a DataReader; its history and limits hold for the result too.

        Raises what DataReader raises; then nothing has been created.
        """
        if not isinstance(topic, MultiTopic):
            raise BadParameter(f"a MultiTopicReader reads of a ddsi.MultiTopic, not of {topic!r}")
        topic._check_open()
        participant = topic.participant
        super().__init__(participant, qos)
        from ..xtypes.sql import NaturalJoin

        self._parent = parent
        self._topic = topic
        self._support = topic.type_support
        self._join = NaturalJoin(topic._plan)
        # The combinations that make each instance of the result, and those that each instance of a topic is part of.
        self._of_result: dict[bytes, dict[Combination, None]] = {}
        self._of_part: dict[tuple[int, bytes], dict[Combination, bytes]] = {}
        self._number = 0
        engine = self._pump.engine
        merged = topic.topics[0].qos | self.qos
        self._history = ReaderHistoryCache(
            reader_qos(Qos(history=merged.history, resource_limits=merged.resource_limits)),
            max_octets=1,  # there are none in it
            max_instances=engine.config.max_instances,
            clock_offset=engine.wall_ticks() / (1 << 32) - self._pump.now(),
        )
        self._parts: list[_Part] = []
        try:
            for part_topic in topic.topics:
                self._parts.append(_Part(parent, part_topic, qos))
        except BaseException:
            for part in self._parts:
                part.close()
            raise
        for part in self._parts:
            part.whole = self
        topic._readers.add(self)
        parent._adopt(self)

    def __repr__(self) -> str:
        return f"<MultiTopicReader of {self._topic.name!r}, {len(self._history)} samples>"

    @property
    def topic(self) -> MultiTopic[T]:
        return self._topic

    @property
    def readers(self) -> tuple[DataReader[Any], ...]:
        """One for each topic, in the order of the expression: for their statuses and matches, not to take from."""
        return tuple(self._parts)

    async def wait_for_matched(self, count: int = 1, timeout: float | None = None) -> None:
        """Until each of its readers has matched so many writers.  Raises DdsTimeout."""
        for part in self._parts:
            await part.wait_for_matched(count, timeout)

    def status(self, kind: type[S]) -> S:
        self._absorb()
        return super().status(kind)

    def status_changes(self) -> frozenset[type]:
        self._absorb()
        return super().status_changes()

    def events(self) -> EventStream:
        self._absorb_if_allowed()
        return super().events()

    # --- inside ------------------------------------------------------------------------------------------

    def _selection(
        self, condition: ReadCondition | None, sample_states: int, view_states: int, instance_states: int
    ) -> tuple[dict[str, int], SampleSelector | None]:
        """Whoever selects looks at what is here: what came to the parts is joined first."""
        self._absorb()
        return super()._selection(condition, sample_states, view_states, instance_states)

    def _tell(self) -> None:
        """What came to the parts is news to them again only when it was taken."""
        self._absorb_if_allowed()
        super()._tell()

    def _absorb_if_allowed(self) -> None:
        with suppress(PreconditionNotMet):  # they may not be taken from: not enabled, or outside `subscriber.access()`
            self._absorb()

    async def _wait_for_news(self) -> None:
        self._pump.before_waiting()
        if self._absorb():
            return
        await self._news.park()
        self._pump.has_yielded()
        self._absorb()

    def _sample(self, info: SampleInfo, change: CacheChange) -> Sample[T]:
        assert isinstance(change, _JoinedChange)
        return Sample(cast(T, change.data), info)

    def _absorb(self) -> bool:
        """Take what has come to the parts, and join it; returns whether there was anything."""
        has_come = False
        if self._is_closed:
            return has_come
        for topic, part in enumerate(self._parts):
            for sample in part.take():
                has_come = True
                info = sample.info
                if info.valid_data:
                    self._join.put(topic, info.instance_handle, sample.data)
                else:
                    self._join.remove(topic, info.instance_handle)
                self._combine(topic, info.instance_handle, info.publication_handle, info.source_ticks, info.valid_data)
        return has_come

    def _join_again(self) -> None:
        """The condition is another one."""
        self._absorb()
        ticks = self._pump.engine.wall_ticks()
        for handle in self._join.handles(0):
            self._combine(0, handle, self._parts[0].guid, ticks, is_there=True)
        self._pump.woken(self._history, self._news)

    def _combine(self, topic: int, handle: bytes, writer: Guid, ticks: int, is_there: bool) -> None:
        """An instance of one topic has changed: what is made of it now, and what no more?"""
        before = self._of_part.pop((topic, handle), {})
        holds = self._topic._holds
        rows = self._join.rows_with(topic, handle) if is_there else ()
        found = {combination: row for combination, row in rows if holds is None or holds(row)}
        for combination, row in found.items():
            result = self._topic._plan.result_of(row)
            key = self._support.key(result)
            former = before.get(combination)
            if former is not None and former != key:
                self._end(combination, former, writer, ticks)
            for place in enumerate(combination):
                self._of_part.setdefault(place, {})[combination] = key
            self._of_result.setdefault(key, {})[combination] = None
            self._add(ChangeKind.ALIVE, writer, key, ticks, result)
        for combination, key in before.items():
            if combination not in found:
                self._end(combination, key, writer, ticks)

    def _end(self, combination: Combination, key: bytes, writer: Guid, ticks: int) -> None:
        """This combination is no more; with the last one the instance of the result ends."""
        for place in enumerate(combination):
            self._of_part.get(place, {}).pop(combination, None)
        made = self._of_result.get(key, {})
        made.pop(combination, None)
        if not made:
            self._of_result.pop(key, None)
            instance = self._history.instances.get(key)
            if self._support.is_keyed and instance is not None:
                instance.writers.clear()  # whoever made it: when its end is taken nothing of it stays
                data = self._support.sample_from_key(key)
                self._add(ChangeKind.NOT_ALIVE_DISPOSED_UNREGISTERED, writer, key, ticks, data)

    def _add(self, kind: ChangeKind, writer: Guid, key: bytes, ticks: int, data: Any) -> None:
        self._number += 1
        self._history.add(_JoinedChange(kind, writer, self._number, key, ticks, data), self._pump.now())

    def _on_close(self) -> None:
        super()._on_close()
        for part in self._parts:
            part.close()
        self._parent._disown(self)
