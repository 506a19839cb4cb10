"""READER_DATA_LIFECYCLE: what has ended long enough ago is forgotten, samples and all.  DDS 1.4 §2.2.3.22."""

from __future__ import annotations

import math

import pytest

from ddsi.behavior.reader_history_cache import ReaderHistoryCache
from ddsi.structure.cache_change import CacheChange, ChangeKind
from ddsi.structure.qos import EndpointQos, Qos, reader_qos
from ddsi.structure.qos_policies import KeepAll, ReaderDataLifecycle, Reliable
from tests.behavior.builders import guid

DISPOSE, UNREGISTER = ChangeKind.NOT_ALIVE_DISPOSED, ChangeKind.NOT_ALIVE_UNREGISTERED


class Cache(ReaderHistoryCache):
    """With the clock of the one who asks for its timer."""

    def __init__(self, *, disposed: float = math.inf, no_writers: float = math.inf) -> None:
        self.due = math.inf
        self._number = 0
        super().__init__(
            self.qos(disposed, no_writers), max_octets=1 << 20, max_instances=100, on_timer=self._asked_for
        )

    @staticmethod
    def qos(disposed: float, no_writers: float) -> EndpointQos:
        delays = ReaderDataLifecycle(no_writers, disposed)
        return reader_qos(Qos(history=KeepAll(), reliability=Reliable(), reader_data_lifecycle=delays))

    def _asked_for(self, due: float) -> None:
        self.due = min(self.due, due)

    def put(self, now: float, kind: ChangeKind = ChangeKind.ALIVE, *, key: bytes = b"a") -> None:
        self._number += 1
        assert self.add(CacheChange(kind, guid(1), self._number, bytes(8), key), now)

    def run(self, until: float) -> None:
        while self.due <= until:
            due, self.due = self.due, math.inf
            self.handle_timeout(due)


@pytest.mark.parametrize(
    ("cache", "end"), [(Cache(disposed=5), DISPOSE), (Cache(no_writers=5), UNREGISTER)], ids=["disposed", "no writers"]
)
def test_after_the_delay_nothing_of_the_instance_is_left(cache: Cache, end: ChangeKind) -> None:
    cache.put(0)
    cache.put(1, end)
    cache.run(5.9)
    assert len(cache) == 2
    cache.run(6.1)
    assert (len(cache), cache.octets, list(cache.instances)) == (0, 0, [])
    assert cache.take() == []
    cache.put(7)
    ((info, _),) = cache.take()
    assert info.disposed_generation_count == info.no_writers_generation_count == 0, "it begins anew"


def test_each_state_has_a_delay_of_its_own() -> None:
    cache = Cache(disposed=5)
    cache.put(0)
    cache.put(0, key=b"b")
    cache.put(1, DISPOSE)
    cache.put(1, UNREGISTER, key=b"b")
    cache.run(1000)
    assert list(cache.instances) == [b"b"]


def test_an_instance_that_lives_again_stays() -> None:
    cache = Cache(disposed=5)
    cache.put(0)
    cache.put(1, DISPOSE)
    cache.put(4)
    cache.run(100)
    assert len(cache) == 3


def test_instances_are_forgotten_each_in_its_time() -> None:
    cache = Cache(disposed=5)
    for time, key in ((0, b"a"), (1, b"b"), (2, b"c")):
        cache.put(time, key=key)
        cache.put(time, DISPOSE, key=key)
    cache.run(6.5)
    assert list(cache.instances) == [b"c"]


def test_a_delay_that_is_set_later_counts_from_then() -> None:
    cache = Cache()
    cache.put(0)
    cache.put(1, DISPOSE)
    cache.qos_changed(Cache.qos(2, math.inf), 10.0)
    cache.run(11.9)
    assert len(cache) == 2
    cache.run(12.1)
    assert len(cache) == 0
