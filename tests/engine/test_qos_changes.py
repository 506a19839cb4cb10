"""Policies that change on live endpoints: peers see it, pairs are judged again, timers follow.  DDS 1.4 §2.2.3."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ddsi.discovery.matching import judge
from ddsi.engine import SendDatagram
from ddsi.simulation import Domain, LinkConditions, NodeReader, NodeWriter
from ddsi.simulation.endpoints import payload_of
from ddsi.structure.cache_change import ChangeKind
from ddsi.structure.errors import ImmutablePolicy
from ddsi.structure.qos import Qos
from ddsi.structure.qos_changes import CHANGEABLE
from ddsi.structure.qos_policies import (
    BestEffort,
    Deadline,
    Exclusive,
    GroupData,
    KeepAll,
    KeepLast,
    LatencyBudget,
    Lifespan,
    OwnershipStrength,
    Partition,
    Reliable,
    ResourceLimits,
    TimeBasedFilter,
    TopicData,
    TransientLocal,
    TransportPriority,
    UserData,
    Volatile,
)
from ddsi.structure.status import (
    OfferedIncompatibleQos,
    RequestedDeadlineMissed,
    RequestedIncompatibleQos,
)

KEPT = Qos(reliability=Reliable(), history=KeepAll())
both_ways = pytest.mark.parametrize("local", [False, True], ids=["remote", "local"])


def matched(qos: Qos = Qos(), *, local: bool, takes: bool = True) -> tuple[Domain, NodeWriter, NodeReader]:
    domain = Domain()
    node = domain.node()
    writer = node.writer("Square", KEPT | qos, keyed=True)
    reader = (node if local else domain.node()).reader("Square", KEPT | qos, keyed=True, takes=takes)
    assert domain.run_until(domain.all_matched, 1)
    return domain, writer, reader


def counts(writer: NodeWriter, reader: NodeReader) -> tuple[int, int]:
    return writer.matched_count, reader.matched_count


def numbers(reader: NodeReader) -> list[int]:
    return [change.sequence_number for info, change in reader.taken if info.valid_data]


# --- partitions ----------------------------------------------------------------------------------------------------


@both_ways
def test_another_partition_ends_the_match_and_the_old_one_brings_it_back(local: bool) -> None:
    domain, writer, reader = matched(local=local)
    writer.change(KEPT | Qos(partition=Partition("blue")))
    domain.run(0.5)
    assert counts(writer, reader) == (0, 0)
    writer.write()
    writer.change(KEPT)
    domain.run(0.5)
    assert counts(writer, reader) == (1, 1)
    writer.write()
    domain.run(0.5)
    assert numbers(reader) == [2], "volatile: what was written in the other partition is not for this reader"


@both_ways
@pytest.mark.parametrize("who", ["writer", "reader"])
def test_who_meets_a_reader_again_gives_it_only_what_that_lacks(local: bool, who: str) -> None:
    """Transient local: what was written meanwhile comes, as to a late joiner; what was delivered before does not."""
    domain, writer, reader = matched(Qos(durability=TransientLocal()), local=local)
    mover = writer if who == "writer" else reader
    for partition in (Partition("blue"), Partition()) * 3:
        writer.write()
        domain.run(0.5)
        mover.change(KEPT | Qos(durability=TransientLocal(), partition=partition))
        domain.run(0.5)
    assert counts(writer, reader) == (1, 1)
    assert numbers(reader) == [1, 2, 3, 4, 5, 6]


@both_ways
@pytest.mark.parametrize(("durability", "lost"), [(TransientLocal(), 0), (Volatile(), 2)], ids=["kept", "volatile"])
def test_what_a_full_reader_had_no_room_for_is_lost_only_if_nobody_keeps_it(
    local: bool, durability: TransientLocal | Volatile, lost: int
) -> None:
    kept = KEPT | Qos(durability=durability)
    domain = Domain()
    node = domain.node()
    writer = node.writer("Square", kept, keyed=True)
    few = kept | Qos(resource_limits=ResourceLimits(max_samples=2))
    reader = (node if local else domain.node()).reader("Square", few, keyed=True, takes=False)
    assert domain.run_until(domain.all_matched, 1)
    for _ in range(4):
        writer.write()
    domain.run(0.5)
    for partition in (Partition("blue"), Partition()):
        writer.change(kept | Qos(partition=partition))
        domain.run(0.5)
    for _ in range(3):
        reader.take()
        domain.run(0.5)
    assert reader.local.lost.total_count == lost
    assert numbers(reader) == [1, 2, 3, 4][: 4 - lost]


@both_ways
def test_a_wildcard_fits_at_run_time_too(local: bool) -> None:
    domain, writer, reader = matched(Qos(partition=Partition("north")), local=local)
    reader.change(KEPT | Qos(partition=Partition("sou*")))
    domain.run(0.5)
    assert counts(writer, reader) == (0, 0)
    writer.change(KEPT | Qos(partition=Partition("north", "south")))
    domain.run(0.5)
    assert counts(writer, reader) == (1, 1)


def test_a_change_of_partition_leaves_the_other_readers_in_peace() -> None:
    domain, writer, first = matched(Qos(partition=Partition("a", "b")), local=False)
    second = domain.node().reader("Square", KEPT | Qos(partition=Partition("b")), keyed=True)
    domain.run(0.5)
    first.change(KEPT | Qos(partition=Partition("c")))
    for _ in range(3):
        writer.write()
    domain.run(0.5)
    assert numbers(second) == [1, 2, 3]
    assert numbers(first) == []
    assert writer.local.behavior.min_acked_sn() == 3


# --- deadline ------------------------------------------------------------------------------------------------------


@both_ways
def test_a_deadline_that_is_set_later_is_watched_from_then_on(local: bool) -> None:
    domain, writer, reader = matched(local=local)
    writer.write()
    domain.run(5)
    writer.change(KEPT | Qos(deadline=Deadline(1)))
    domain.run(0.1)
    reader.change(KEPT | Qos(deadline=Deadline(2)))
    domain.run(2.5)
    assert counts(writer, reader) == (1, 1)
    assert (writer.local.deadline.total_count, reader.local.deadline.total_count) == (2, 1)
    writer.change(KEPT)
    domain.run(0.1)
    assert counts(writer, reader) == (0, 0), "no deadline is offered, and one is requested"


@both_ways
def test_a_stricter_reader_and_a_slacker_writer_part_with_the_reason(local: bool) -> None:
    domain, writer, reader = matched(Qos(deadline=Deadline(5)), local=local)
    reader.change(KEPT | Qos(deadline=Deadline(3)))
    domain.run(0.5)
    assert counts(writer, reader) == (0, 0)
    assert writer.node.statuses_of(OfferedIncompatibleQos) == [writer.local.incompatible]
    assert reader.node.statuses_of(RequestedIncompatibleQos) == [reader.local.incompatible]
    for status in (writer.local.incompatible, reader.local.incompatible):
        assert [reason.policy for reason in status.incompatibilities] == ["deadline"]
    writer.change(KEPT | Qos(deadline=Deadline(2)))
    domain.run(0.5)
    assert counts(writer, reader) == (1, 1)


def test_what_does_not_concern_the_deadline_does_not_prolong_it() -> None:
    domain, writer, reader = matched(Qos(deadline=Deadline(2)), local=False)
    writer.write()
    for _ in range(4):
        domain.run(0.9)
        writer.change(KEPT | Qos(deadline=Deadline(2), user_data=UserData(bytes([domain.network.now > 1]))))
        reader.change(KEPT | Qos(deadline=Deadline(2), user_data=UserData(bytes([domain.network.now > 1]))))
    assert writer.local.deadline.total_count == reader.local.deadline.total_count == 1
    assert reader.node.statuses_of(RequestedDeadlineMissed)


# --- what needs no new match ---------------------------------------------------------------------------------------


@both_ways
def test_an_instance_changes_hands_when_strengths_change(local: bool) -> None:
    qos = KEPT | Qos(ownership=Exclusive())
    domain = Domain()
    nodes = [domain.node()] * 3 if local else [domain.node() for _ in range(3)]
    one = nodes[0].writer("Square", qos | Qos(ownership_strength=OwnershipStrength(5)), keyed=True)
    other = nodes[1].writer("Square", qos | Qos(ownership_strength=OwnershipStrength(3)), keyed=True)
    reader = nodes[2].reader("Square", qos, keyed=True)
    assert domain.run_until(domain.all_matched, 1)

    def heard() -> list[NodeWriter]:
        reader.taken.clear()
        for writer in (one, other, one, other):
            writer.write()
            domain.run(0.1)
        owners = {change.writer_guid for info, change in reader.taken if info.valid_data}
        return [writer for writer in (one, other) if writer.guid in owners]

    assert heard() == [one]
    other.change(qos | Qos(ownership_strength=OwnershipStrength(7)))
    domain.run(0.5)
    reader.taken.clear()
    other.write()
    domain.run(0.1)
    assert heard() == [other]


@both_ways
def test_a_lifespan_holds_for_what_is_written_from_then_on(local: bool) -> None:
    domain, writer, reader = matched(local=local, takes=False)
    writer.write()
    writer.change(KEPT | Qos(lifespan=Lifespan(10)))
    domain.run(0.1)
    writer.write()
    writer.change(KEPT | Qos(lifespan=Lifespan(1)))
    domain.run(0.1)
    writer.write()
    domain.run(2)
    reader.take()
    assert numbers(reader) == [1, 2]


def test_what_a_writer_keeps_ends_when_its_own_lifespan_does() -> None:
    domain, writer, _ = matched(Qos(durability=TransientLocal(), lifespan=Lifespan(10)), local=False)
    writer.write()
    writer.change(KEPT | Qos(durability=TransientLocal(), lifespan=Lifespan(1)))
    writer.write()
    domain.run(2)
    assert [change.sequence_number for change in writer.local.behavior.cache.changes()] == [1]


@both_ways
def test_a_time_based_filter_comes_and_goes(local: bool) -> None:
    domain, writer, reader = matched(local=local)

    def passed() -> list[int]:
        reader.taken.clear()
        for _ in range(4):
            writer.write()
            domain.run(0.3)
        return numbers(reader)

    assert passed() == [1, 2, 3, 4]
    reader.change(KEPT | Qos(time_based_filter=TimeBasedFilter(0.5)))
    assert passed() == [5, 7], "0.6 s apart"
    reader.change(KEPT)
    assert passed() == [9, 10, 11, 12]


def test_peers_see_what_is_only_carried() -> None:
    domain, writer, reader = matched(local=False)
    carried = Qos(
        user_data=UserData(b"u"), topic_data=TopicData(b"t"), group_data=GroupData(b"g"),
        latency_budget=LatencyBudget(0.5), transport_priority=TransportPriority(4),
    )  # fmt: skip
    reader.change(KEPT | Qos(latency_budget=LatencyBudget(1.0)))
    writer.change(KEPT | carried)
    domain.run(0.5)
    (seen,) = [data for data in reader.node.engine.known_writers.all() if data.guid == writer.guid]
    for name in ("user_data", "topic_data", "group_data", "latency_budget", "transport_priority"):
        assert getattr(seen.qos, name) == getattr(carried, name)
    assert counts(writer, reader) == (1, 1)
    assert reader.local.matched.total_count == 1, "the match stayed"
    assert reader.local.behavior.writers[writer.guid].data.qos.user_data.value == b"u"


def test_user_data_of_the_participant_are_announced_anew() -> None:
    domain, writer, reader = matched(local=False)
    node = writer.node
    node.engine.qos_changes.change_user_data(b"new", node.now)
    node.pump()
    domain.run(0.5)
    assert reader.node.engine.participants[node.guid.prefix].data.user_data == b"new"
    assert counts(writer, reader) == (1, 1)


# --- what is fixed -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "fixed",
    [
        Qos(reliability=BestEffort()),
        Qos(history=KeepLast(3)),
        Qos(durability=TransientLocal()),
        Qos(ownership=Exclusive()),
    ],
)
def test_a_fixed_policy_is_refused_by_name_and_all_stays(fixed: Qos) -> None:
    domain, writer, reader = matched(local=False)
    before = (writer.local.data, reader.local.data)
    for endpoint in (writer, reader):
        with pytest.raises(ImmutablePolicy, match=r"(writer|reader) of 'Square'.*" + repr(fixed)[4:].split("=")[0]):
            endpoint.change(KEPT | fixed | Qos(partition=Partition("elsewhere")))
    domain.run(0.5)
    assert (writer.local.data, reader.local.data) == before
    assert counts(writer, reader) == (1, 1)


def test_the_names_of_what_may_change_are_those_of_policies() -> None:
    assert set(Qos.__dataclass_fields__) > CHANGEABLE


# --- transport priority --------------------------------------------------------------------------------------------


def test_a_priority_marks_what_the_writer_sends_from_then_on() -> None:
    _, writer, _ = matched(local=False)
    engine = writer.node.engine

    def priorities() -> set[int]:
        """Of the datagrams that one sample is sent in."""
        payload = payload_of(writer.guid, 1, 8)
        engine.write(writer.local, ChangeKind.ALIVE, payload, payload[4:5], writer.node.now)
        return {effect.priority for effect in engine.drain_effects() if isinstance(effect, SendDatagram)}

    assert priorities() == {0}
    writer.change(KEPT | Qos(transport_priority=TransportPriority(46)))
    assert priorities() == {46}


# --- whatever changes in whatever order ----------------------------------------------------------------------------

_PARTITIONS = st.sampled_from([(), ("a",), ("b",), ("a*",), ("a", "b"), ("?",)])
_POLICIES = st.builds(
    lambda names, period, budget: Qos(
        partition=Partition(*names), deadline=Deadline(period), latency_budget=LatencyBudget(budget)
    ),
    _PARTITIONS, st.sampled_from([5.0, 10.0, 20.0]), st.sampled_from([0.0, 0.0, 1.0]),
)  # fmt: skip
_CHANGES = st.lists(st.tuples(st.integers(0, 3), _POLICIES, st.sampled_from([0.0, 0.003, 0.3])), max_size=12)


@settings(max_examples=40, deadline=None)
@given(changes=_CHANGES, seed=st.integers(0, 1000))
def test_in_the_end_those_are_matched_that_fit_and_samples_reach_them(
    changes: list[tuple[int, Qos, float]], seed: int
) -> None:
    """In bad weather: two writers and two readers, of which one pair is of one participant, change while they meet."""
    domain = Domain(seed, conditions=LinkConditions(loss=0.1, reordering=0.1, duplication=0.05, jitter=0.001))
    nodes = [domain.node() for _ in range(3)]
    writers = [node.writer("Square", KEPT, keyed=True) for node in nodes[:2]]
    readers = [node.reader("Square", KEPT, keyed=True) for node in nodes[1:]]
    endpoints: list[NodeWriter | NodeReader] = [*writers, *readers]
    for who, policies, pause in changes:
        endpoints[who].change(KEPT | policies)
        domain.run(pause)
    domain.run(10.0)
    for writer in writers:
        fitting = {reader.guid for reader in readers if judge(writer.local.data, reader.local.data) is None}
        assert {*writer.local.behavior.readers, *writer.local.behavior.local_readers} == fitting
        assert writer.matched_count == len(fitting)
    for reader in readers:
        fitting = {writer.guid for writer in writers if judge(writer.local.data, reader.local.data) is None}
        assert reader.local.behavior.writers.keys() == fitting
        assert reader.matched_count == reader.local.liveliness.alive_count == len(fitting)
        reader.taken.clear()
    written = {writer.guid: writer.write() for writer in writers}
    domain.run(5.0)
    for reader in readers:
        taken = {change.writer_guid: change.sequence_number for info, change in reader.taken if info.valid_data}
        expected = {guid: written[guid] for guid in reader.local.behavior.writers}
        assert taken == {guid: change.sequence_number for guid, change in expected.items() if change is not None}
