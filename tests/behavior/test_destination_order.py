"""DESTINATION_ORDER by source timestamp: whatever overtakes whatever, each instance ends alike.  DDS 1.4 §2.2.3.17."""

from __future__ import annotations

from itertools import permutations

import pytest

from ddsi.behavior.reader_history_cache import ReaderHistoryCache
from ddsi.structure.cache_change import CacheChange, ChangeKind
from ddsi.structure.qos import Qos, reader_qos
from ddsi.structure.qos_policies import BySourceTimestamp, KeepAll, KeepLast, Reliable
from ddsi.structure.sample_info import InstanceState, SampleInfo
from tests.behavior.builders import guid

BY_SOURCE = Qos(history=KeepAll(), reliability=Reliable(), destination_order=BySourceTimestamp())
DISPOSE, UNREGISTER = ChangeKind.NOT_ALIVE_DISPOSED, ChangeKind.NOT_ALIVE_UNREGISTERED


class Cache(ReaderHistoryCache):
    """Takes changes by the second in which they were written, and by whom."""

    def __init__(self, qos: Qos = BY_SOURCE) -> None:
        self._numbers: dict[int, int] = {}
        super().__init__(reader_qos(qos), max_octets=1 << 20, max_instances=100)

    @property
    def state(self) -> InstanceState:
        return self.instances[b"a"].state

    def put(self, written_at: int, *, by: int = 1, key: bytes = b"a", kind: ChangeKind = ChangeKind.ALIVE) -> None:
        number = self._numbers[by] = self._numbers.get(by, 0) + 1
        change = CacheChange(kind, guid(by), number, bytes(8), key, written_at << 32)
        assert self.add(change, now=100.0)


def times(taken: list[tuple[SampleInfo, CacheChange]]) -> list[int]:
    return [info.source_ticks >> 32 for info, _ in taken if info.valid_data]


@pytest.mark.parametrize("arriving", list(permutations((1, 2, 3))))
def test_samples_leave_in_the_order_in_which_they_were_written(arriving: tuple[int, ...]) -> None:
    cache = Cache()
    for time in arriving:
        cache.put(time, by=time)
    assert times(cache.take()) == [1, 2, 3]


@pytest.mark.parametrize("arriving", list(permutations((1, 2, 3))))
def test_keep_last_keeps_those_that_were_written_last(arriving: tuple[int, ...]) -> None:
    cache = Cache(BY_SOURCE | Qos(history=KeepLast(2)))
    for time in arriving:
        cache.put(time, by=time)
    assert times(cache.take()) == [2, 3]
    assert (len(cache), cache.octets) == (0, 0)


def test_each_instance_has_its_own_order_and_keeps_its_place_among_others() -> None:
    cache = Cache()
    cache.put(5, key=b"a")
    cache.put(1, key=b"b")
    cache.put(4, key=b"a", by=2)
    assert [(info.instance_handle, info.source_ticks >> 32) for info, _ in cache.read()] == [
        (b"a", 4),
        (b"a", 5),
        (b"b", 1),
    ]
    assert [info.sample_rank for info, _ in cache.read()] == [1, 0, 0]
    assert times(cache.take(instance=b"a")) == [4, 5]


def test_what_is_older_than_what_was_taken_comes_too_late() -> None:
    cache = Cache()
    cache.put(2)
    assert times(cache.take()) == [2]
    cache.put(1, by=2)
    cache.put(3, by=2)
    assert times(cache.take()) == [3]


def test_what_was_read_may_still_be_preceded() -> None:
    cache = Cache()
    cache.put(2)
    cache.read()
    cache.put(1, by=2)
    assert times(cache.read()) == [1, 2]


def test_of_what_was_written_at_once_the_writers_guid_decides() -> None:
    for arriving in ((1, 2), (2, 1)):
        cache = Cache(BY_SOURCE | Qos(history=KeepLast(1)))
        for writer in arriving:
            cache.put(7, by=writer)
        ((info, _),) = cache.take()
        assert info.publication_handle == guid(2)


def test_a_dispose_that_was_overtaken_ends_nothing() -> None:
    cache = Cache()
    cache.put(1)
    cache.put(3)
    cache.put(2, by=2, kind=DISPOSE)
    assert cache.state is InstanceState.ALIVE
    assert times(cache.take()) == [1, 3]


def test_a_sample_that_a_dispose_overtook_does_not_bring_the_instance_back() -> None:
    cache = Cache()
    cache.put(1)
    cache.put(3, by=2, kind=DISPOSE)
    cache.put(2)
    assert cache.state is InstanceState.NOT_ALIVE_DISPOSED
    cache.put(4)
    assert times(cache.take()) == [1, 4]


def test_who_unregisters_late_is_gone_all_the_same() -> None:
    cache = Cache()
    cache.put(5)
    cache.put(2, kind=UNREGISTER)
    assert cache.state is InstanceState.NOT_ALIVE_NO_WRITERS
