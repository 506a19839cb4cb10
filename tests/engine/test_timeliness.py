"""DEADLINE, LIFESPAN, OWNERSHIP and TIME_BASED_FILTER between participants and within one, in virtual time."""

from __future__ import annotations

import pytest

from ddsi.simulation import Domain, NodeReader, NodeWriter
from ddsi.structure.cache_change import ChangeKind
from ddsi.structure.qos import Qos
from ddsi.structure.qos_policies import (
    Deadline,
    Exclusive,
    KeepAll,
    Lifespan,
    OwnershipStrength,
    Reliable,
    ResourceLimits,
    TimeBasedFilter,
    TransientLocal,
)
from ddsi.structure.status import OfferedDeadlineMissed, RequestedDeadlineMissed

KEPT = Qos(reliability=Reliable(), history=KeepAll())


def matched(
    qos: Qos, reader_qos: Qos = Qos(), *, local: bool, takes: bool = True
) -> tuple[Domain, NodeWriter, NodeReader]:
    domain = Domain()
    node = domain.node()
    writer = node.writer("Square", KEPT | qos, keyed=True)
    reader_node = node if local else domain.node()
    reader = reader_node.reader("Square", KEPT | qos | reader_qos, keyed=True, takes=takes)
    assert domain.run_until(domain.all_matched, 1)
    return domain, writer, reader


def write_every(domain: Domain, writer: NodeWriter, period: float, times: int, key: int = 0) -> None:
    for _ in range(times):
        assert writer.write(key=key) is not None
        domain.run(period)


def numbers(reader: NodeReader) -> list[int]:
    return [change.sequence_number for info, change in reader.taken if info.valid_data]


both_ways = pytest.mark.parametrize("local", [False, True], ids=["remote", "local"])


# --- deadline --------------------------------------------------------------------------------------------


@both_ways
def test_a_deadline_that_is_kept_is_no_news(local: bool) -> None:
    domain, writer, reader = matched(Qos(deadline=Deadline(2.0)), local=local)
    write_every(domain, writer, 1.9, 20)
    assert writer.node.statuses_of(OfferedDeadlineMissed) == []
    assert reader.node.statuses_of(RequestedDeadlineMissed) == []


@both_ways
def test_each_period_without_a_sample_is_told_to_both_sides(local: bool) -> None:
    domain, writer, reader = matched(Qos(deadline=Deadline(2.0)), local=local)
    writer.write()
    domain.run(7.0)
    expected = [(count, 1, b"\0") for count in (1, 2, 3)]
    for node, kind in ((writer.node, OfferedDeadlineMissed), (reader.node, RequestedDeadlineMissed)):
        found = node.statuses_of(kind)
        assert found == [kind(total_count=a, total_count_change=b, last_instance_handle=c) for a, b, c in expected]


def test_instances_are_late_each_for_itself_and_not_after_their_end() -> None:
    domain, writer, reader = matched(Qos(deadline=Deadline(2.0)), local=False)
    writer.write(key=1)
    writer.write(key=2)
    writer.end(ChangeKind.NOT_ALIVE_DISPOSED, key=1)
    domain.run(2.5)
    assert writer.local.deadline.total_count == reader.local.deadline.total_count == 1
    assert writer.local.deadline.last_instance_handle == reader.local.deadline.last_instance_handle == b"\2"


def test_a_deleted_reader_misses_nothing() -> None:
    domain, writer, reader = matched(Qos(deadline=Deadline(2.0)), local=False)
    writer.write()
    domain.run(1.0)
    reader.delete()
    domain.run(5.0)
    assert reader.node.statuses_of(RequestedDeadlineMissed) == []


# --- lifespan --------------------------------------------------------------------------------------------


@both_ways
def test_what_nobody_took_in_time_is_gone(local: bool) -> None:
    domain, writer, reader = matched(Qos(lifespan=Lifespan(1.0)), local=local, takes=False)
    write_every(domain, writer, 0.4, 5)
    reader.take()
    assert numbers(reader) == [4, 5]


def test_late_joiners_do_not_get_what_has_expired() -> None:
    domain, writer, _ = matched(Qos(lifespan=Lifespan(1.0), durability=TransientLocal()), local=False)
    write_every(domain, writer, 0.4, 5)
    late = domain.node().reader("Square", KEPT | Qos(durability=TransientLocal()), keyed=True)
    domain.run(0.1)
    assert numbers(late) == [4, 5]


def test_expired_samples_make_room_for_those_that_wait() -> None:
    limits = ResourceLimits(max_samples=2, max_instances=10, max_samples_per_instance=2)
    domain, writer, reader = matched(Qos(lifespan=Lifespan(5.0)), Qos(resource_limits=limits), local=False, takes=False)
    writer.write()
    writer.write()
    domain.run(4.0)
    writer.write()
    domain.run(2.0)
    reader.take()
    assert numbers(reader) == [3]


# --- ownership -------------------------------------------------------------------------------------------


@both_ways
def test_the_strongest_writer_owns_until_it_leaves(local: bool) -> None:
    qos = KEPT | Qos(ownership=Exclusive())
    domain = Domain()
    nodes = [domain.node()] * 3 if local else [domain.node() for _ in range(3)]
    weak = nodes[0].writer("Square", qos | Qos(ownership_strength=OwnershipStrength(3)), keyed=True)
    strong = nodes[1].writer("Square", qos | Qos(ownership_strength=OwnershipStrength(4)), keyed=True)
    reader = nodes[2].reader("Square", qos, keyed=True)
    assert domain.run_until(domain.all_matched, 1)
    for _ in range(5):
        weak.write()
        strong.write()
        domain.run(0.1)
    strong.delete()
    domain.run(0.1)
    weak.write()
    weak.write()
    domain.run(0.1)
    writers = [change.writer_guid for info, change in reader.taken if info.valid_data]
    assert writers.count(strong.guid) == 5
    assert writers[-2:] == [weak.guid] * 2
    assert writers.count(weak.guid) <= 3, "at most one before the stronger was heard"


# --- time-based filter -----------------------------------------------------------------------------------


@both_ways
def test_samples_that_come_too_soon_are_acknowledged_and_not_shown(local: bool) -> None:
    domain, writer, reader = matched(Qos(), Qos(time_based_filter=TimeBasedFilter(1.0)), local=local)
    write_every(domain, writer, 0.26, 12)
    assert numbers(reader) == [1, 5, 9]
    assert writer.local.behavior.min_acked_sn() == 12
    domain.run(1.0)
    assert numbers(reader) == [1, 5, 9, 12], "where writing pauses, the last one comes after all"
