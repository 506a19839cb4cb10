"""WriterHistoryCache: what a writer can still send, under HISTORY, RESOURCE_LIMITS and DURABILITY."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ddsi.behavior.writer_history_cache import WriterHistoryCache
from ddsi.structure.cache_change import CacheChange, ChangeKind
from ddsi.structure.qos import Qos, writer_qos
from ddsi.structure.qos_policies import KeepAll, KeepLast, ResourceLimits, TransientLocal, Volatile
from tests.behavior.builders import change, guid

KEEP_ALL = Qos(history=KeepAll())
ENDED = ChangeKind.NOT_ALIVE_DISPOSED_UNREGISTERED


def cache(qos: Qos = KEEP_ALL) -> WriterHistoryCache:
    return WriterHistoryCache(writer_qos(qos))


def held(whc: WriterHistoryCache) -> list[int]:
    return [change.sequence_number for change in whc.changes()]


def fill(whc: WriterHistoryCache, *keys: bytes, octets: int = 10) -> None:
    for key in keys:
        whc.add(change(whc.last_sn + 1, bytes(octets), key=key))


def test_an_empty_cache_begins_behind_its_end() -> None:
    whc = cache()
    assert (whc.first_sn, whc.last_sn, len(whc)) == (1, 0, 0)
    fill(whc, b"", b"")
    whc.acknowledged_up_to(2)
    assert (whc.first_sn, whc.last_sn, len(whc)) == (3, 2, 0)


def test_keep_last_replaces_per_instance() -> None:
    whc = cache(Qos(history=KeepLast(2)))
    fill(whc, b"a", b"a", b"b")
    replaced = whc.add(change(4, key=b"a"))
    assert replaced is not None
    assert replaced.sequence_number == 1
    assert held(whc) == [2, 3, 4]
    assert whc.first_sn == 2


def test_keep_last_replaces_what_nobody_has_acknowledged() -> None:
    whc = cache(Qos(history=KeepLast(1)))
    fill(whc, *[b""] * 5)
    assert held(whc) == [5]
    assert (whc.octets, whc.unacknowledged_octets) == (10, 10)


def test_volatile_forgets_what_everybody_has() -> None:
    whc = cache(Qos(history=KeepAll(), durability=Volatile()))
    fill(whc, *[b""] * 4)
    assert whc.acknowledged_up_to(3) == 30
    assert held(whc) == [4]
    assert (whc.acked_sn, whc.octets, whc.unacknowledged_octets) == (3, 10, 10)


def test_transient_local_keeps_it_but_counts_it_as_safe() -> None:
    whc = cache(Qos(history=KeepAll(), durability=TransientLocal()))
    fill(whc, *[b""] * 4)
    assert whc.acknowledged_up_to(3) == 30
    assert held(whc) == [1, 2, 3, 4]
    assert (whc.octets, whc.unacknowledged_octets) == (40, 10)
    assert whc.keeps_acknowledged


def test_acknowledgment_never_goes_back_nor_beyond_the_end() -> None:
    whc = cache()
    fill(whc, *[b""] * 3)
    whc.acknowledged_up_to(99)
    assert whc.acked_sn == 3
    whc.acknowledged_up_to(1)
    assert whc.acked_sn == 3


@pytest.mark.parametrize(
    ("qos", "keys", "key", "reason"),
    [
        (KEEP_ALL, [b"a"] * 50, b"a", None),
        (Qos(history=KeepAll(), resource_limits=ResourceLimits(max_samples=2)), [b"a"], b"a", None),
        (Qos(history=KeepAll(), resource_limits=ResourceLimits(max_samples=2)), [b"a", b"b"], b"a", "max_samples"),
        (
            Qos(history=KeepAll(), resource_limits=ResourceLimits(max_samples=9, max_samples_per_instance=2)),
            [b"a", b"a"],
            b"a",
            "max_samples_per_instance",
        ),
        (
            Qos(history=KeepAll(), resource_limits=ResourceLimits(max_samples=9, max_samples_per_instance=2)),
            [b"a", b"a"],
            b"b",
            None,
        ),
        (Qos(history=KeepAll(), resource_limits=ResourceLimits(max_instances=1)), [b"a"], b"b", "max_instances"),
        (Qos(history=KeepAll(), resource_limits=ResourceLimits(max_instances=1)), [b"a"], b"a", None),
        # With KEEP_LAST the oldest of the instance makes room.
        (Qos(history=KeepLast(1), resource_limits=ResourceLimits(max_samples=2)), [b"a", b"b"], b"a", None),
        (Qos(history=KeepLast(1), resource_limits=ResourceLimits(max_samples=2)), [b"a", b"b"], b"c", "max_samples"),
    ],
)
def test_why_a_write_has_to_wait(qos: Qos, keys: list[bytes], key: bytes, reason: str | None) -> None:
    whc = cache(qos)
    fill(whc, *keys)
    assert whc.lacks_room(key) == reason


def test_room_comes_back_with_acknowledgment() -> None:
    whc = cache(Qos(history=KeepAll(), resource_limits=ResourceLimits(max_samples=1, max_instances=1)))
    fill(whc, b"a")
    assert whc.lacks_room(b"b") is not None
    whc.acknowledged_up_to(1)
    assert whc.lacks_room(b"b") is None


def test_an_instance_that_has_ended_gives_way_when_all_know() -> None:
    """DDS 1.4 §2.2.2.4.2.7: who unregisters an instance has nothing to say of it any more."""
    limits = ResourceLimits(max_instances=2)
    whc = cache(Qos(history=KeepLast(2), durability=TransientLocal(), resource_limits=limits))
    fill(whc, b"a", b"b", b"a")
    whc.add(CacheChange(ENDED, guid(1), 4, b"end", b"a"))
    whc.acknowledged_up_to(3)
    assert (whc.lacks_room(b"c"), held(whc)) == ("max_instances", [2, 3, 4])
    whc.acknowledged_up_to(4)
    assert held(whc) == [2, 3, 4], "a late joiner, or who comes back, may hear of the end while there is room"
    assert (whc.lacks_room(b"c"), held(whc)) == (None, [2])
    assert (whc.octets, whc.unacknowledged_octets) == (10, 0)


def test_an_instance_that_is_written_again_does_not_give_way() -> None:
    limits = ResourceLimits(max_instances=1)
    whc = cache(Qos(history=KeepLast(1), durability=TransientLocal(), resource_limits=limits))
    for number in (1, 3):
        fill(whc, b"a")
        assert whc.lacks_room(b"b") == "max_instances"
        whc.add(CacheChange(ENDED, guid(1), number + 1, b"", b"a"))
        whc.acknowledged_up_to(number + 1)
    fill(whc, b"a")
    whc.acknowledged_up_to(5)
    assert (whc.lacks_room(b"b"), held(whc)) == ("max_instances", [5])


def test_instances_that_have_ended_are_bounded() -> None:
    whc = cache(Qos(history=KeepLast(1), durability=TransientLocal()))
    for number in range(1, 10_001):
        whc.add(CacheChange(ENDED, guid(1), number, b"", number.to_bytes(4)))
        whc.acknowledged_up_to(number)
    assert held(whc) == list(range(10_001 - 8192, 10_001))


def test_one_change_can_be_removed() -> None:
    """LIFESPAN is over, or the only reader that it was for is gone."""
    whc = cache()
    fill(whc, *[b""] * 3)
    removed = whc.remove(2)
    assert removed is not None
    assert held(whc) == [1, 3]
    assert whc.remove(2) is None
    assert whc.get(2) is None
    assert whc.unacknowledged_octets == 20


@given(
    st.sampled_from(
        [
            KEEP_ALL,
            Qos(history=KeepLast(1)),
            Qos(history=KeepLast(3)),
            Qos(history=KeepAll(), durability=TransientLocal()),
        ]
    ),
    st.lists(st.tuples(st.sampled_from("wra"), st.integers(0, 30)), max_size=60),
)
def test_counts_are_right_whatever_happens(qos: Qos, actions: list[tuple[str, int]]) -> None:
    whc = cache(qos)
    model: dict[int, CacheChange] = {}
    acked = 0
    for action, number in actions:
        if action == "w":
            added = change(whc.last_sn + 1, bytes(number), key=bytes((number % 3,)))
            replaced = whc.add(added)
            model[added.sequence_number] = added
            if replaced is not None:
                del model[replaced.sequence_number]
        elif action == "r":
            assert whc.remove(number) is model.pop(number, None)
        else:
            whc.acknowledged_up_to(number)
            acked = max(acked, min(number, whc.last_sn))
            if not whc.keeps_acknowledged:
                model = {sn: kept for sn, kept in model.items() if sn > acked}
        assert held(whc) == sorted(model)
        assert whc.octets == sum(len(kept.payload) for kept in model.values())
        assert whc.unacknowledged_octets == sum(len(kept.payload) for sn, kept in model.items() if sn > acked)
        assert whc.first_sn == min(model, default=whc.last_sn + 1)
