"""ReaderHistoryCache: states, generations and ranks of DDS 1.4 §2.2.2.5, KEEP_LAST, limits, and what waits for room."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ddsi.behavior.reader_history_cache import ReaderHistoryCache
from ddsi.structure.cache_change import CacheChange, ChangeKind
from ddsi.structure.qos import Qos, reader_qos
from ddsi.structure.qos_policies import (
    AccessScope,
    BestEffort,
    KeepAll,
    KeepLast,
    Presentation,
    Reliable,
    ResourceLimits,
)
from ddsi.structure.sample_info import InstanceState, SampleInfo, SampleState, ViewState
from tests.behavior.builders import change, guid

KEEP_ALL = Qos(history=KeepAll(), reliability=Reliable())
TOPIC = AccessScope.TOPIC
ORDERED = Qos(presentation=Presentation(TOPIC, ordered_access=True))
W1, W2 = guid(1), guid(2)
DISPOSE, UNREGISTER = ChangeKind.NOT_ALIVE_DISPOSED, ChangeKind.NOT_ALIVE_UNREGISTERED
BOTH = ChangeKind.NOT_ALIVE_DISPOSED_UNREGISTERED
ALIVE, DISPOSED = InstanceState.ALIVE, InstanceState.NOT_ALIVE_DISPOSED
NO_WRITERS = InstanceState.NOT_ALIVE_NO_WRITERS


class Cache(ReaderHistoryCache):
    """A cache that counts its calls, and takes changes in short."""

    def __init__(self, qos: Qos = KEEP_ALL, *, max_octets: int = 1 << 20, max_instances: int = 100) -> None:
        self.news = 0
        self.rejected: list[str] = []
        self._number = 0
        super().__init__(
            reader_qos(qos),
            max_octets=max_octets,
            max_instances=max_instances,
            on_news=self._count_news,
            on_rejected=lambda limit, change, is_final: self.rejected.append(limit),
        )

    def _count_news(self) -> None:
        self.news += 1

    def put(self, key: bytes = b"a", kind: ChangeKind = ChangeKind.ALIVE, *, by: bytes = W1, octets: int = 4) -> bool:
        self._number += 1
        payload = bytes(octets) if kind is ChangeKind.ALIVE else b""
        return self.add(CacheChange(kind, guid(by[0]), self._number, payload, key), now=float(self._number))


def numbers(taken: list[tuple[SampleInfo, CacheChange]]) -> list[int]:
    return [change.sequence_number for _, change in taken]


def states(taken: list[tuple[SampleInfo, CacheChange]]) -> list[tuple[bool, InstanceState]]:
    return [(info.valid_data, info.instance_state) for info, _ in taken]


# --- taking and reading ---------------------------------------------------------------------------------------------


def test_samples_leave_by_instance_and_within_each_in_the_order_of_arrival() -> None:
    """DDS 1.4 §2.2.2.5.3.8, for access scope INSTANCE, and wherever order was not asked for."""
    for presentation in (Presentation(), Presentation(AccessScope.INSTANCE, False, True), Presentation(TOPIC, True)):
        cache = Cache(KEEP_ALL | Qos(presentation=presentation))
        for key in (b"a", b"b", b"a"):
            cache.put(key)
        assert numbers(cache.take()) == [1, 3, 2]
        assert (len(cache), cache.octets) == (0, 0)


def test_with_ordered_access_to_the_topic_samples_leave_in_the_order_of_arrival() -> None:
    cache = Cache(KEEP_ALL | ORDERED)
    for key in (b"a", b"b", b"a"):
        cache.put(key)
    assert numbers(cache.read()) == numbers(cache.take()) == [1, 2, 3]


def test_at_most_so_many_are_the_ones_that_came_first() -> None:
    cache = Cache()
    for key in (b"a", b"b", b"a", b"b"):
        cache.put(key)
    assert numbers(cache.take(3)) == [1, 3, 2]


def test_reading_leaves_them_and_marks_them_read() -> None:
    cache = Cache()
    cache.put()
    ((first, _),) = cache.read()
    assert first.sample_state is SampleState.NOT_READ
    ((second, _),) = cache.read()
    assert second.sample_state is SampleState.READ
    assert first.sample_state is SampleState.NOT_READ, "what was handed out stays as it was"
    assert len(cache) == 1
    assert numbers(cache.take(sample_states=SampleState.NOT_READ)) == []
    assert numbers(cache.take(sample_states=SampleState.READ)) == [1]


def test_at_most_so_many_and_the_rest_later() -> None:
    cache = Cache()
    for _ in range(5):
        cache.put()
    assert numbers(cache.take(2)) == [1, 2]
    assert numbers(cache.take(2)) == [3, 4]
    assert numbers(cache.take(2)) == [5]


def test_one_instance_or_a_selector() -> None:
    cache = Cache()
    for key in (b"a", b"b", b"a", b"b"):
        cache.put(key)
    assert numbers(cache.read(instance=b"b")) == [2, 4]
    assert cache.read(instance=b"c") == []
    assert numbers(cache.take(selector=lambda info: info.instance_handle == b"a")) == [1, 3]
    assert cache.matches(sample_states=SampleState.READ, view_states=ViewState.NOT_NEW, instance_states=ALIVE)
    assert not cache.matches(sample_states=SampleState.NOT_READ, view_states=ViewState.NOT_NEW, instance_states=ALIVE)


_STATES = (
    "valid_data",
    "view_state",
    "instance_state",
    "sample_rank",
    "generation_rank",
    "absolute_generation_rank",
    "disposed_generation_count",
    "no_writers_generation_count",
)


def test_take_next_is_take_of_one() -> None:
    """The short form for iteration hands out the same, one at a time."""
    one, other = Cache(), Cache()
    script: list[tuple[bytes, ChangeKind]] = [
        (b"a", ChangeKind.ALIVE),
        (b"b", ChangeKind.ALIVE),
        (b"a", DISPOSE),
        (b"a", ChangeKind.ALIVE),
        (b"b", UNREGISTER),
    ]
    for key, kind in script:
        one.put(key, kind)
        other.put(key, kind)
    for _ in script:
        ((info, expected),) = one.take(1)
        taken = other.take_next()
        assert taken is not None
        assert taken[1].sequence_number == expected.sequence_number
        for name in _STATES:
            assert getattr(taken[0], name) == getattr(info, name), name
    assert other.take_next() is None
    assert (len(other), other.octets) == (0, 0)


def test_news_is_told_once_until_it_is_seen() -> None:
    cache = Cache()
    cache.put()
    cache.put()
    assert cache.news == 1
    cache.seen()
    cache.put()
    assert cache.news == 2


# --- instance and view states ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("script", "expected"),
    [
        # What a reader that takes everything at the end sees: (has data, state of the instance then).
        ("w", [(True, ALIVE)]),
        ("wd", [(True, DISPOSED), (False, DISPOSED)]),
        ("wu", [(True, NO_WRITERS), (False, NO_WRITERS)]),
        ("wb", [(True, DISPOSED), (False, DISPOSED)]),
        ("wdu", [(True, DISPOSED), (False, DISPOSED)]),  # disposed wins over no writers
        ("wud", [(True, DISPOSED), (False, DISPOSED)]),  # one sample without data says it all
        ("wdd", [(True, DISPOSED), (False, DISPOSED)]),
        ("wdw", [(True, ALIVE), (False, ALIVE), (True, ALIVE)]),
        ("wuw", [(True, ALIVE), (False, ALIVE), (True, ALIVE)]),
        ("wWu", [(True, ALIVE), (True, ALIVE)]),  # the other writer still writes it
        ("wWuU", [(True, NO_WRITERS), (True, NO_WRITERS), (False, NO_WRITERS)]),
        ("wWd", [(True, DISPOSED), (True, DISPOSED), (False, DISPOSED)]),  # anybody may dispose
        ("d", []),  # the end of something that nobody here has heard of
        ("u", []),
        ("wl", [(True, NO_WRITERS), (False, NO_WRITERS)]),  # the writer was lost
        ("wdl", [(True, DISPOSED), (False, DISPOSED)]),
        ("wWl", [(True, ALIVE), (True, ALIVE)]),
    ],
)
def test_instance_states(script: str, expected: list[tuple[bool, InstanceState]]) -> None:
    """w, d, u, b: written, disposed, unregistered, both by one writer (W and so on: by another); l: it is lost."""
    cache = Cache()
    kinds = {"w": ChangeKind.ALIVE, "d": DISPOSE, "u": UNREGISTER, "b": BOTH}
    for step in script:
        if step == "l":
            cache.writer_lost(W1, 0.0)
        else:
            cache.put(kind=kinds[step.lower()], by=W1 if step.islower() else W2)
    assert states(cache.take()) == expected


def test_an_instance_is_new_until_it_is_looked_at_and_again_when_it_comes_back() -> None:
    cache = Cache()
    cache.put()
    assert cache.take()[0][0].view_state is ViewState.NEW
    cache.put()
    assert cache.take()[0][0].view_state is ViewState.NOT_NEW
    cache.put(kind=DISPOSE)
    assert cache.take()[0][0].view_state is ViewState.NOT_NEW
    cache.put()
    assert cache.take()[0][0].view_state is ViewState.NEW


def test_generations_are_counted_and_ranked() -> None:
    """DDS 1.4 §2.2.2.5.1.5-8: generations of a sample against the last of its instance, in the set and in all."""
    cache = Cache()
    cache.put()  # generation 0
    cache.put(kind=DISPOSE)
    cache.put()  # 1: disposed once
    cache.put(kind=UNREGISTER)
    cache.put()  # 2: without writers once
    taken = cache.read()
    assert [
        (info.disposed_generation_count, info.no_writers_generation_count, info.valid_data) for info, _ in taken
    ] == [(0, 0, True), (0, 0, False), (1, 0, True), (1, 0, False), (1, 1, True)]
    assert [info.sample_rank for info, _ in taken] == [4, 3, 2, 1, 0]
    assert [info.generation_rank for info, _ in taken] == [2, 2, 1, 1, 0]
    assert [info.absolute_generation_rank for info, _ in taken] == [2, 2, 1, 1, 0]
    part = cache.read(3)
    assert [info.generation_rank for info, _ in part] == [1, 1, 0], "the last of the set is of generation 1"
    assert [info.absolute_generation_rank for info, _ in part] == [2, 2, 1]


def test_ranks_count_within_each_instance() -> None:
    cache = Cache()
    for key in (b"a", b"b", b"a", b"a", b"b"):
        cache.put(key)
    assert [info.sample_rank for info, _ in cache.take()] == [2, 1, 0, 1, 0]


def test_ranks_count_within_each_instance_where_instances_are_mixed() -> None:
    cache = Cache(KEEP_ALL | ORDERED)
    for key in (b"a", b"b", b"a", b"a", b"b"):
        cache.put(key)
    assert [info.sample_rank for info, _ in cache.take()] == [2, 1, 1, 0, 0]


def test_generations_count_within_each_instance_where_instances_are_mixed() -> None:
    cache = Cache(KEEP_ALL | ORDERED)
    for key, kind in ((b"a", None), (b"b", None), (b"a", DISPOSE), (b"b", None), (b"a", None)):
        cache.put(key, kind if kind is not None else ChangeKind.ALIVE)
    infos = [info for info, _ in cache.take()]
    assert [info.disposed_generation_count for info in infos] == [0, 0, 0, 0, 1]
    assert [info.generation_rank for info in infos] == [1, 0, 1, 0, 0]
    assert [info.absolute_generation_rank for info in infos] == [1, 0, 1, 0, 0]


def test_instances_come_and_go_without_end() -> None:
    """An instance that nobody writes is forgotten when its last sample is taken."""
    cache = Cache(max_instances=2)
    for number in range(10):
        key = bytes((number,))
        assert cache.put(key)
        cache.put(key, BOTH)
        cache.take()
    assert cache.instances == {}


def test_what_was_never_known_can_be_told_from_what_is_gone_while_that_is_not_too_much() -> None:
    cache = Cache()
    for number in range(1100):
        key = str(number).encode()
        cache.put(key)
        assert cache.may_have_known(key)
        cache.put(key, UNREGISTER)
        cache.take()
        assert key not in cache.instances
        assert cache.may_have_known(b"0")
        assert cache.may_have_known(b"never") == (number >= 1024)


def test_a_lost_writer_takes_only_its_own_instances() -> None:
    cache = Cache()
    cache.put(b"a", by=W1)
    cache.put(b"b", by=W2)
    cache.take()
    cache.writer_lost(W1, 0.0)
    ((info, _),) = cache.take()
    assert (info.instance_handle, info.instance_state, info.valid_data) == (b"a", NO_WRITERS, False)
    assert list(cache.instances) == [b"b"]


# --- HISTORY and RESOURCE_LIMITS --------------------------------------------------------------------------------


def test_keep_last_replaces_the_oldest_of_the_instance() -> None:
    cache = Cache(Qos(history=KeepLast(2)))
    for key in (b"a", b"a", b"b", b"a"):
        cache.put(key)
    assert sorted(numbers(cache.take())) == [2, 3, 4]


@pytest.mark.parametrize("depth", [1, 2, 5])
def test_keep_last_holds_no_more_samples_than_its_depth_whatever_ends_between(depth: int) -> None:
    """A dispose that nobody has taken does not make room for another sample (nor take it)."""
    cache = Cache(Qos(history=KeepLast(depth)))
    for _ in range(4 * depth):
        cache.put()
        cache.put(kind=DISPOSE)
        cache.put()
        cache.put()
    taken = cache.take()
    assert sum(info.valid_data for info, _ in taken) == depth
    assert sum(not info.valid_data for info, _ in taken) <= 1


def test_with_keep_last_an_end_stays_when_samples_are_pushed_out() -> None:
    cache = Cache(Qos(history=KeepLast(1)))
    cache.put()
    cache.put(kind=DISPOSE)
    cache.put()
    assert [(number, info.valid_data) for number, (info, _) in zip((2, 3), cache.take(), strict=True)] == [
        (2, False),
        (3, True),
    ]


@pytest.mark.parametrize(
    ("limits", "keys", "limit"),
    [
        (ResourceLimits(max_samples=2), [b"a", b"b", b"c"], "max_samples"),
        (ResourceLimits(max_samples=9, max_samples_per_instance=2), [b"a", b"a", b"a"], "max_samples_per_instance"),
        (ResourceLimits(max_instances=2), [b"a", b"b", b"c"], "max_instances"),
    ],
)
def test_a_full_reliable_reader_lets_the_writer_wait(limits: ResourceLimits, keys: list[bytes], limit: str) -> None:
    cache = Cache(KEEP_ALL | Qos(resource_limits=limits))
    assert [cache.put(key) for key in keys] == [True, True, False]
    assert cache.rejected == [limit]
    waiting = CacheChange(ChangeKind.ALIVE, guid(W1[0]), 3, bytes(4), keys[2])
    assert not cache.add(waiting, now=4.0)
    assert cache.rejected == [limit], "the same change again is no further rejection"
    cache.put(keys[0], BOTH)
    cache.take()
    assert cache.put(keys[2])


@pytest.mark.parametrize("limit", ["max_samples", "max_instances"])
def test_a_full_best_effort_reader_rejects(limit: str) -> None:
    cache = Cache(Qos(history=KeepAll(), reliability=BestEffort(), resource_limits=ResourceLimits(**{limit: 1})))
    assert cache.put(b"a")
    assert cache.put(b"b"), "it is dealt with"
    assert cache.rejected == [limit]
    assert numbers(cache.take()) == [1]


def test_octets_are_bounded_without_any_limit_in_the_qos() -> None:
    cache = Cache(max_octets=100)
    assert [cache.put(octets=60) for _ in range(2)] == [True, False]
    cache.take()
    assert cache.put(octets=500), "one sample always fits, or it could never be had"


def test_octets_are_bounded_with_keep_last_too() -> None:
    """A hundred thousand instances of one large sample each are no less a burden."""
    cache = Cache(Qos(history=KeepLast(1), reliability=Reliable()), max_octets=100)
    assert [cache.put(bytes((key,)), octets=40) for key in range(4)] == [True, True, False, False]
    assert cache.put(b"\0", octets=40), "a sample that replaces another needs no room"


@pytest.mark.parametrize("reliability", [Reliable(), BestEffort()])
def test_a_sample_larger_than_the_one_that_it_replaces_needs_room(reliability: Reliable | BestEffort) -> None:
    """Else a hundred thousand instances that had a small sample each could hold any number of octets."""
    cache = Cache(Qos(history=KeepLast(1), reliability=reliability), max_octets=100)
    for key in b"abc":
        assert cache.put(bytes((key,)), octets=30)
    assert cache.put(b"a", octets=41) is isinstance(reliability, BestEffort)
    assert (cache.octets, cache.rejected) == (90, ["octets of history"])
    assert cache.put(b"a", octets=40), "so much room there is"
    assert cache.put(b"a", octets=20), "and for a smaller one always"
    cache.take()
    assert cache.put(b"a", octets=60)
    assert cache.put(b"a", octets=500), "one sample always fits, or it could never be had"


def test_an_instance_that_goes_by_itself_makes_room() -> None:
    """Where the application took all samples there is nothing to take that would show it."""
    due: list[float] = []
    limits = ResourceLimits(max_instances=1)
    qos = reader_qos(Qos(history=KeepAll(), reliability=Reliable(), resource_limits=limits))
    cache = ReaderHistoryCache(qos, max_octets=100, max_instances=9, on_timer=due.append)
    for number, kind in enumerate((ChangeKind.ALIVE, DISPOSE)):
        assert cache.add(CacheChange(kind, W1, number, b"", b"a"), now=1.0)
    cache.take()
    assert not cache.add(CacheChange(ChangeKind.ALIVE, W2, 1, b"", b"b"), now=1.0)
    assert (cache.is_withholding, due) == (True, [])
    cache.add(CacheChange(UNREGISTER, W1, 3, b"", b"a"), now=2.0)
    assert due
    assert due[0] <= 2.0


def test_limits_on_samples_hold_with_keep_last_too() -> None:
    cache = Cache(Qos(history=KeepLast(1), reliability=Reliable(), resource_limits=ResourceLimits(max_samples=2)))
    assert [cache.put(key) for key in (b"a", b"b", b"c")] == [True, True, False]
    assert cache.put(b"a")


def test_what_was_refused_leaves_no_trace() -> None:
    """A sample without room does not make its instance known, else refused keys would use up max_instances."""
    cache = Cache(Qos(history=KeepAll(), reliability=BestEffort(), resource_limits=ResourceLimits(max_samples=1)))
    cache.put(b"a")
    cache.put(b"b")
    assert list(cache.instances) == [b"a"]


@given(
    st.sampled_from([KeepAll(), KeepLast(1), KeepLast(3)]),
    st.lists(st.tuples(st.sampled_from("wWdDuUlLtTnr"), st.integers(0, 2)), max_size=80),
)
def test_counts_are_right_whatever_happens(history: KeepAll | KeepLast, script: list[tuple[str, int]]) -> None:
    cache = Cache(Qos(history=history, reliability=Reliable()))
    kinds = {"w": ChangeKind.ALIVE, "d": DISPOSE, "u": UNREGISTER}
    handed_out: list[int] = []
    for step, key_number in script:
        key = bytes((key_number,))
        if step in "lL":
            cache.writer_lost(W1 if step == "l" else W2, 0.0)
        elif step == "t":
            handed_out += numbers(cache.take(2, instance=key))
        elif step == "T":
            handed_out += numbers(cache.take(1))
        elif step == "n":
            taken = cache.take_next()
            handed_out += [taken[1].sequence_number] if taken else []
        elif step == "r":
            cache.read(2)
        else:
            cache.put(key, kinds[step.lower()], by=W1 if step.islower() else W2)
        held = [info for instance in cache.instances.values() for info in instance.samples]
        assert len(cache) == len(held) == len(cache.read())
        for instance in cache.instances.values():
            assert instance.end_count == sum(not info.valid_data for info in instance.samples)
            if isinstance(history, KeepLast):
                assert len(instance.samples) - instance.end_count <= history.depth
                assert instance.end_count <= 1
            assert all(info.instance_handle == instance.key for info in instance.samples)
    handed_out += numbers(cache.take())
    written = [number for number in handed_out if number]
    assert len(set(written)) == len(written), "nothing is handed out twice"
    assert cache.octets == 0


def test_a_sample_knows_when_it_was_written_and_received() -> None:
    cache = Cache()
    received = change(1, b"abcd")
    received.source_timestamp = 5 << 32
    cache.add(received, now=2.5)
    ((info, _),) = cache.take()
    assert (info.source_timestamp, info.reception_timestamp, info.publication_handle) == (
        5.0,
        2.5,
        received.writer_guid,
    )


def test_what_is_taken_from_behind_a_sample_that_nobody_takes_leaves_nothing_behind() -> None:
    cache = Cache()
    cache.put(b"a")
    for _ in range(1000):
        cache.put(b"b")
        assert len(cache.take(instance=b"b")) == 1
    assert len(cache._order) < 200
    cache.put(b"b")
    assert numbers(cache.take()) == [1, 1002]
