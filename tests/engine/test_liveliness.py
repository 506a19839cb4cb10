"""LIVELINESS in all three kinds, in virtual time: who asserts what, who notices, and how it comes back."""

from __future__ import annotations

import math

import pytest

from ddsi.config import Config
from ddsi.simulation import Domain, LinkConditions, Node, NodeReader, NodeWriter
from ddsi.structure.qos import Qos
from ddsi.structure.qos_policies import (
    Automatic,
    BestEffort,
    KeepAll,
    Liveliness,
    ManualByParticipant,
    ManualByTopic,
    Reliable,
)
from ddsi.structure.sample_info import InstanceState
from ddsi.structure.status import LivelinessChanged, LivelinessLost

LEASE = 2.0
KINDS: list[Liveliness] = [Automatic(LEASE), ManualByParticipant(LEASE), ManualByTopic(LEASE)]
MANUAL = KINDS[1:]


def matched(kind: Liveliness, *, local: bool = False, reliable: bool = True) -> tuple[Domain, NodeWriter, NodeReader]:
    domain = Domain()
    reliability = Reliable() if reliable else BestEffort()
    node = domain.node()
    writer = node.writer("Square", Qos(liveliness=kind, reliability=reliability, history=KeepAll()), keyed=True)
    reader_node = node if local else domain.node()
    reader = reader_node.reader("Square", Qos(liveliness=kind, reliability=reliability, history=KeepAll()), keyed=True)
    assert domain.run_until(domain.all_matched, 1)
    return domain, writer, reader


def alive(reader: NodeReader) -> tuple[int, int]:
    return reader.local.liveliness.alive_count, reader.local.liveliness.not_alive_count


def lost_count(node: Node) -> int:
    return len(node.statuses_of(LivelinessLost))


def assert_it(writer: NodeWriter) -> None:
    writer.node.engine.liveliness.assert_writer(writer.local, writer.node.now)
    writer.node.pump()


def test_automatic_writers_live_without_the_applications_doing() -> None:
    domain, writer, reader = matched(Automatic(LEASE))
    domain.run(100)
    assert alive(reader) == (1, 0)
    assert lost_count(writer.node) == 0


@pytest.mark.parametrize("lease", [0.1, 1.0, 15.0])
def test_automatic_assertions_come_in_time_also_when_some_are_lost(lease: float) -> None:
    domain = Domain(conditions=LinkConditions(loss=0.1))
    writer = domain.node().writer("Square", Qos(liveliness=Automatic(lease)))
    reader = domain.node().reader("Square", Qos(liveliness=Automatic(lease), reliability=Reliable()))
    assert domain.run_until(domain.all_matched, 5)
    domain.run(20 * lease)
    assert len(reader.node.statuses_of(LivelinessChanged)) == 1, "it was alive all the time"
    assert writer.matched_count == 1


def test_one_message_serves_all_automatic_writers() -> None:
    domain = Domain()
    node = domain.node()
    for number in range(10):
        node.writer(f"topic {number}", Qos(liveliness=Automatic(1.0)))
    domain.node()
    domain.run(5)
    before = domain.network.sent
    domain.run(8.0)
    assert domain.network.sent - before < 60, "ten messages, their acknowledgments, and announcements"


@pytest.mark.parametrize("kind", KINDS)
def test_a_writer_that_is_not_asserted_is_not_alive_when_its_lease_ends(kind: Liveliness) -> None:
    """The automatic kind can only fail with its participant; the others fail as soon as the application is silent."""
    domain, writer, reader = matched(kind)
    writer.write(key=7)
    domain.run(0.1)
    begin = domain.now
    if isinstance(kind, Automatic):
        writer.node.kill()
    assert domain.run_until(lambda: alive(reader) == (0, 1), 3 * LEASE)
    assert LEASE - 0.2 <= domain.now - begin <= LEASE + 0.1
    assert reader.matched_count == 1, "it is still matched: only its participant's lease ends that"
    (info, _), (end, _) = reader.taken
    assert (info.instance_handle, end.valid_data, end.instance_state) == (
        b"\x07", False, InstanceState.NOT_ALIVE_NO_WRITERS,
    )  # fmt: skip


@pytest.mark.parametrize("kind", MANUAL)
def test_the_writers_application_is_told_once(kind: Liveliness) -> None:
    domain, writer, _ = matched(kind)
    domain.run(10 * LEASE)
    assert lost_count(writer.node) == 1
    assert writer.local.liveliness.total_count == 1


@pytest.mark.parametrize("kind", MANUAL)
@pytest.mark.parametrize("by_writing", [True, False])
def test_asserting_or_writing_in_time_keeps_it_alive(kind: Liveliness, by_writing: bool) -> None:
    domain, writer, reader = matched(kind)
    for _ in range(20):
        domain.run(LEASE * 0.7)
        if by_writing:
            writer.write()
        else:
            assert_it(writer)
    assert alive(reader) == (1, 0)
    assert lost_count(writer.node) == 0


@pytest.mark.parametrize("kind", MANUAL)
@pytest.mark.parametrize("by_writing", [True, False])
@pytest.mark.parametrize("local", [True, False])
def test_it_comes_back_to_life_and_can_be_lost_again(kind: Liveliness, by_writing: bool, local: bool) -> None:
    domain, writer, reader = matched(kind, local=local)
    for turn in range(1, 4):
        domain.run(2 * LEASE)
        assert alive(reader) == (0, 1)
        assert lost_count(writer.node) == turn
        if by_writing:
            writer.write()
        else:
            assert_it(writer)
        domain.run(0.1)
        assert alive(reader) == (1, 0)


def test_best_effort_writers_are_asserted_by_their_data() -> None:
    domain, writer, reader = matched(ManualByTopic(LEASE), reliable=False)
    for _ in range(10):
        domain.run(LEASE * 0.7)
        writer.write()
    assert alive(reader) == (1, 0)


def test_one_assertion_serves_all_manual_by_participant_writers() -> None:
    domain = Domain()
    a, b = domain.node(), domain.node()
    qos = Qos(liveliness=ManualByParticipant(LEASE), reliability=Reliable())
    writers = [a.writer(f"topic {number}", qos) for number in range(3)]
    readers = [b.reader(f"topic {number}", qos) for number in range(3)]
    domain.run_until(domain.all_matched, 1)
    for _ in range(5):
        domain.run(LEASE * 0.7)
        assert_it(writers[0])
    assert [alive(reader) for reader in readers] == [(1, 0)] * 3
    domain.run(2 * LEASE)
    assert [alive(reader) for reader in readers] == [(0, 1)] * 3
    assert_it(writers[1])
    domain.run(0.1)
    assert [alive(reader) for reader in readers] == [(1, 0)] * 3
    assert lost_count(a) == 3


def test_manual_by_topic_speaks_for_one_writer_alone() -> None:
    domain = Domain()
    a, b = domain.node(), domain.node()
    qos = Qos(liveliness=ManualByTopic(LEASE), reliability=Reliable())
    one, other = a.writer("one", qos), a.writer("other", qos)
    reads_one, reads_other = b.reader("one", qos), b.reader("other", qos)
    domain.run_until(domain.all_matched, 1)
    for _ in range(5):
        domain.run(LEASE * 0.7)
        assert_it(one)
    assert (alive(reads_one), alive(reads_other)) == ((1, 0), (0, 1))
    assert other.local.liveliness.total_count == 1


def test_automatic_writers_revive_when_their_participant_is_heard_again() -> None:
    domain = Domain()
    a = domain.node(config=Config(lease_duration=100.0, spdp_interval=1.0))
    b = domain.node(config=Config(lease_duration=100.0))
    writer = a.writer("Square", Qos(liveliness=Automatic(LEASE)))
    reader = b.reader("Square", Qos(liveliness=Automatic(LEASE)))
    domain.run_until(domain.all_matched, 1)
    domain.network.unplug(a.host)
    domain.run(3 * LEASE)
    assert alive(reader) == (0, 1)
    domain.network.heal()
    domain.run(3)
    assert alive(reader) == (1, 0)
    assert writer.matched_count == 1


def test_a_dead_writer_that_is_unmatched_is_no_longer_counted() -> None:
    domain, writer, reader = matched(ManualByTopic(LEASE))
    domain.run(2 * LEASE)
    assert alive(reader) == (0, 1)
    writer.delete()
    domain.run(1)
    assert alive(reader) == (0, 0)


def test_a_dead_local_writer_that_is_unmatched_is_no_longer_counted() -> None:
    domain, writer, reader = matched(ManualByTopic(LEASE), local=True)
    domain.run(2 * LEASE)
    writer.delete()
    assert alive(reader) == (0, 0)


@pytest.mark.parametrize("local", [False, True])
def test_a_reader_that_comes_late_learns_that_a_writer_is_dead_and_that_it_revives(local: bool) -> None:
    domain, writer, reader = matched(ManualByTopic(LEASE), local=local)
    domain.run(2 * LEASE)
    late = reader.node.reader("Square", Qos(liveliness=ManualByTopic(LEASE), history=KeepAll()), keyed=True)
    domain.run(1.1 * LEASE)
    assert (alive(reader), alive(late)) == ((0, 1), (0, 1))
    assert_it(writer)
    domain.run(LEASE / 2)
    assert (alive(reader), alive(late)) == ((1, 0), (1, 0))


def test_endless_leases_cost_nothing() -> None:
    domain = Domain()
    writer = domain.node().writer("Square", Qos(liveliness=ManualByTopic(math.inf)))
    reader = domain.node().reader("Square", Qos(liveliness=ManualByTopic(math.inf)))
    domain.run_until(domain.all_matched, 1)
    domain.run(10_000)
    assert alive(reader) == (1, 0)
    assert lost_count(writer.node) == 0
    assert len(reader.node.engine.liveliness._asserted) == 0


def test_a_lease_of_nothing_does_not_keep_us_busy_for_ever() -> None:
    domain = Domain()
    node = domain.node()
    node.writer("Square", Qos(liveliness=Automatic(0.0)))
    domain.node().reader("Square", Qos(liveliness=Automatic(math.inf)))
    domain.run(2)
    before = node.timeout_count
    domain.run(1)
    assert node.timeout_count - before < 500
