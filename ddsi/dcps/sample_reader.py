"""SampleReader: read and take, wait, and ``async for``, of whoever holds samples for an application.

DDS 1.4 §2.2.2.5.3 (DataReader): what readers of topics and readers of builtin topics share.  How a change in the cache
becomes a sample is theirs.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, ClassVar, Generic, Self, TypeVar, cast

import trio

from ..behavior.reader_history_cache import ReaderHistoryCache, SampleSelector
from ..structure.cache_change import CacheChange
from ..structure.errors import BadParameter, PreconditionNotMet
from ..structure.qos import Qos
from ..structure.qos_concerns import QosOwner
from ..structure.sample_info import (
    ANY_INSTANCE_STATE,
    ANY_SAMPLE_STATE,
    ANY_VIEW_STATE,
    SampleInfo,
    SampleState,
    check_states,
)
from ..structure.status import DataAvailable
from ..transport import Pump
from .conditions import ReadCondition
from .entity import Entity, EventStream, check_count
from .sample import Sample

if TYPE_CHECKING:
    from .participant import DomainParticipant

__all__ = ["SampleReader"]

S = TypeVar("S")
T = TypeVar("T")

_AVAILABLE = DataAvailable(is_available=True)
_UNREAD = ReadCondition(sample_states=SampleState.NOT_READ)


class SampleReader(Entity, Generic[T]):
    """The base of DataReader and BuiltinTopicReader."""

    _QOS_OWNER: ClassVar[QosOwner] = "reader"
    STATUSES: ClassVar[tuple[type, ...]] = (DataAvailable,)

    _history: ReaderHistoryCache
    _is_part: ClassVar[bool] = False  # of a MultiTopicReader, which takes from it

    def __init__(self, participant: DomainParticipant, qos: Qos | None) -> None:
        super().__init__(qos)
        self._participant = participant
        self._pump: Pump = participant._running_pump()
        self._news = trio.lowlevel.ParkingLot()

    def status(self, kind: type[S]) -> S:
        if kind is DataAvailable:
            return cast(S, DataAvailable(is_available=self._history.is_available))
        return super().status(kind)

    def status_changes(self) -> frozenset[type]:
        changes = super().status_changes()
        return changes | {DataAvailable} if self._history.is_available else changes

    def events(self) -> EventStream:
        """As of any entity; where samples are here that nobody has looked at, it begins by telling of them."""
        stream = super().events()
        if self._history.has_news:
            stream.put(_AVAILABLE)
        return stream

    # --- reading -----------------------------------------------------------------------------------------

    if not TYPE_CHECKING:  # type checkers refuse a plain `for` by themselves

        def __iter__(self):
            raise PreconditionNotMet(
                f"{self!r} is iterated by `async for`; `for` is for ddsi.blocking, and for what take() returns"
            )

    def __aiter__(self) -> Self:
        return self

    async def __anext__(self) -> Sample[T]:
        """Take the next sample, waiting for one.  Iteration ends when the reader is closed.

        Raises NotAllowedBySecurity when it was closed because its participant's rights have ended.
        """
        await self._pump.checkpoint(self._pump.now())
        self._check_iterable()
        while not self._is_closed:
            taken = self._history.take_next()
            if taken is not None:
                sample = self._sample(*taken)
                self._after_taking()
                if sample is not None:
                    return sample
                continue
            await self._wait_for_news()
        self._check_not_revoked()
        raise StopAsyncIteration

    def take(
        self,
        max_samples: int | None = None,
        *,
        condition: ReadCondition | None = None,
        sample_states: int = ANY_SAMPLE_STATE,
        view_states: int = ANY_VIEW_STATE,
        instance_states: int = ANY_INSTANCE_STATE,
        instance: bytes | None = None,
    ) -> list[Sample[T]]:
        """Samples that are here now, removed from the reader; never waits.

        ``max_samples``: at most so many, those that came first.  Masks select by state, ``condition`` brings masks of
        its own, ``instance`` (an ``info.instance_handle``; None: all) selects one instance: one that is gone has no
        samples, one that was never known raises BadParameter (DDS 1.4 §2.2.2.5.3.15, take_instance).  The samples of an
        instance follow each other, oldest first; with ordered access to the whole topic (``Presentation``) all of them
        stand as they came.  With access scope GROUP it is called within ``subscriber.access()``, and returns one sample
        at most where access is ordered.  Raises PreconditionNotMet, AlreadyDeleted.
        """
        max_samples = self._begin_reading(max_samples, instance)
        states, selector = self._selection(condition, sample_states, view_states, instance_states)
        self._history.accessed()
        sort_key = condition._sort_key if condition is not None else None
        if sort_key is not None and max_samples is not None:
            selector = self._first_of_order(sort_key, max_samples, states, instance, selector)
        taken = self._history.take(max_samples, **states, instance=instance, selector=selector)
        samples = [sample for info, change in taken if (sample := self._sample(info, change)) is not None]
        self._drop_undecodable()
        self._after_taking()
        if taken:
            self._reconsider()
        return samples if sort_key is None else _in_order(samples, sort_key)

    def read(
        self,
        max_samples: int | None = None,
        *,
        condition: ReadCondition | None = None,
        sample_states: int = ANY_SAMPLE_STATE,
        view_states: int = ANY_VIEW_STATE,
        instance_states: int = ANY_INSTANCE_STATE,
        instance: bytes | None = None,
    ) -> list[Sample[T]]:
        """As :meth:`take`, but the samples stay in the reader and count as read from now on.

        DDS 1.4 §2.2.2.5.3.8 (read), §2.2.2.5.3.14 (read_instance).
        """
        max_samples = self._begin_reading(max_samples, instance)
        states, selector = self._selection(condition, sample_states, view_states, instance_states)
        self._history.accessed()
        sort_key = condition._sort_key if condition is not None else None
        if sort_key is not None and max_samples is not None:
            selector = self._first_of_order(sort_key, max_samples, states, instance, selector)
        found = self._history.read(max_samples, **states, instance=instance, selector=selector)
        samples = [sample for info, change in found if (sample := self._sample(info, change)) is not None]
        self._drop_undecodable()
        if found:
            self._reconsider()
        return samples if sort_key is None else _in_order(samples, sort_key)

    def take_next_instance(
        self,
        previous: bytes | None,
        max_samples: int | None = None,
        *,
        condition: ReadCondition | None = None,
        sample_states: int = ANY_SAMPLE_STATE,
        view_states: int = ANY_VIEW_STATE,
        instance_states: int = ANY_INSTANCE_STATE,
    ) -> list[Sample[T]]:
        """As :meth:`take`, of the first instance behind the handle ``previous`` that has such samples.

        None begins with the first of all, and the last one is followed by nothing.  ``previous`` need not be known any
        more: handles have an order of their own.  DDS 1.4 §2.2.2.5.3.17.
        """
        states = (sample_states, view_states, instance_states)
        handle = self._next_instance(previous, condition, *states)
        if handle is None:
            return []
        return self.take(
            max_samples, condition=condition, sample_states=sample_states, view_states=view_states,
            instance_states=instance_states, instance=handle,
        )  # fmt: skip

    def read_next_instance(
        self,
        previous: bytes | None,
        max_samples: int | None = None,
        *,
        condition: ReadCondition | None = None,
        sample_states: int = ANY_SAMPLE_STATE,
        view_states: int = ANY_VIEW_STATE,
        instance_states: int = ANY_INSTANCE_STATE,
    ) -> list[Sample[T]]:
        """As :meth:`take_next_instance`, but the samples stay and count as read.  DDS 1.4 §2.2.2.5.3.16."""
        states = (sample_states, view_states, instance_states)
        handle = self._next_instance(previous, condition, *states)
        if handle is None:
            return []
        return self.read(
            max_samples, condition=condition, sample_states=sample_states, view_states=view_states,
            instance_states=instance_states, instance=handle,
        )  # fmt: skip

    async def wait(self, condition: ReadCondition | None = None) -> None:
        """Until there is a sample that fits ``condition`` (none given: one that has not been read).

        Raises AlreadyDeleted, also when the reader is closed meanwhile.
        """
        self._check_enabled()
        await self._pump.checkpoint(self._pump.now())
        while not self._matches(condition or _UNREAD):
            self._drop_undecodable()
            self._check_open()
            await self._wait_for_news()
        self._check_open()
        self._drop_undecodable()

    # --- inside ------------------------------------------------------------------------------------------

    def _begin_reading(self, max_samples: int | None, instance: bytes | None) -> int | None:
        """May the application look now, and at how many samples at most?"""
        self._check_enabled()
        if max_samples is not None:
            check_count("max_samples", max_samples)
        if instance is not None and not (isinstance(instance, bytes) and self._history.may_have_known(instance)):
            raise BadParameter(
                f"{self!r} has never known an instance {instance!r}: instance is the info.instance_handle of a sample "
                "that was read here, or what lookup_instance(sample) returns"
            )
        return max_samples

    def _tell(self) -> None:
        """A listener is about to be told of what has come.  The next arrival is news again, taken or not."""
        self._history.seen()

    def _check_iterable(self) -> None:
        """May samples be taken one after the other as they come?"""

    def _next_instance(
        self, previous: bytes | None, condition: ReadCondition | None, samples: int, views: int, instances: int
    ) -> bytes | None:
        self._check_enabled()
        states, selector = self._selection(condition, samples, views, instances)
        return self._history.next_instance(previous, selector=selector, **states)

    def _sample(self, info: SampleInfo, change: CacheChange) -> Sample[T] | None:
        """The sample as an object; None if its octets are not one."""
        raise NotImplementedError

    def _on_close(self) -> None:
        self._pump.woken(self._history, self._news)

    def _after_taking(self) -> None:
        """There is room again."""

    def _drop_undecodable(self) -> None:
        """What was found not to decode while it stays in the cache: nobody shall meet it again."""

    async def _wait_for_news(self) -> None:
        """Until something may have changed.  What this task has written must not wait meanwhile."""
        self._history.seen()
        self._pump.before_waiting()
        if self._history.has_news:  # what was acted upon just now has written into it
            return
        if self._pump.can_be_led:
            await self._pump.lead(self._history)
        else:
            await self._news.park()
            self._pump.has_yielded()

    def _has_news(self) -> None:
        self._pump.woken(self._history, self._news)
        if self._changed:
            self._changed.unpark_all()
        for stream in self._streams:
            stream.put(_AVAILABLE)

    def _reconsider(self) -> None:
        """Samples are in other states now, or somebody waits for others: whoever waits looks again."""
        self._pump.woken(self._history, self._news)
        if self._changed:
            self._changed.unpark_all()

    def _selection(
        self, condition: ReadCondition | None, sample_states: int, view_states: int, instance_states: int
    ) -> tuple[dict[str, int], SampleSelector | None]:
        selector: SampleSelector | None = None
        check_states(sample_states, view_states, instance_states)
        if condition is not None:
            if not isinstance(condition, ReadCondition):
                raise BadParameter(f"condition is a ddsi.ReadCondition or QueryCondition, not {condition!r}")
            sample_states &= condition.sample_states
            view_states &= condition.view_states
            instance_states &= condition.instance_states
            selector = condition._selector(self)
        states = {"sample_states": sample_states, "view_states": view_states, "instance_states": instance_states}
        return states, selector

    def _matches(self, condition: ReadCondition) -> bool:
        """Is there such a sample?"""
        states, selector = self._selection(condition, ANY_SAMPLE_STATE, ANY_VIEW_STATE, ANY_INSTANCE_STATE)
        return self._history.matches(selector=selector, **states)

    def _first_of_order(
        self,
        sort_key: Callable[[T], Any],
        count: int,
        states: dict[str, int],
        instance: bytes | None,
        selector: SampleSelector | None,
    ) -> SampleSelector:
        """Selects of the samples that are wanted the first so many in their order."""
        found = self._history.peek(**states, instance=instance, selector=selector)
        samples = [(info, self._sample(info, info.change)) for info in found if info.change is not None]
        decoded = [(sort_key(sample.data), info) for info, sample in samples if sample is not None]
        decoded.sort(key=lambda entry: entry[0])
        chosen = {id(info) for _, info in decoded[:count]}
        return lambda info: id(info) in chosen

    def _selector(self, query: Callable[[T], bool]) -> SampleSelector:
        def selects(info: SampleInfo) -> bool:
            change = info.change
            sample = self._sample(info, change) if change is not None else None
            return sample is not None and bool(query(sample.data))

        return selects


def _in_order(samples: list[Sample[T]], sort_key: Callable[[T], Any]) -> list[Sample[T]]:
    """Sorted, with the ranks that samples have in this order: how many of the same instance follow."""
    samples.sort(key=lambda sample: sort_key(sample.data))
    following: dict[bytes, int] = {}
    for sample in reversed(samples):
        handle = sample.info.instance_handle
        sample.info.sample_rank = following.get(handle, 0)
        following[handle] = sample.info.sample_rank + 1
    return samples
