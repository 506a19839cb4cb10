"""The filtered path in whole domains, over bad networks and with peers that do it differently.

The mechanism is told in ``ddsi.behavior.filtered``; the writer alone: ``test_filtering_writer``.
"""

from __future__ import annotations

from collections.abc import Sequence

import pytest

from ddsi.behavior import filtering_writer
from ddsi.behavior.filtering_writer import FilteringWriter
from ddsi.behavior.reader_proxy import ReaderProxy
from ddsi.behavior.transmissions import SendHeartbeat
from ddsi.config import Config
from ddsi.messages.gap import Gap
from ddsi.messages.raw_submessage import SubmessageKind, iterate_submessages
from ddsi.simulation import Domain, LinkConditions, NodeReader, NodeWriter, invariants
from ddsi.spi import ADMITTED, PENDING, Admission, Decided, HookEffect, Plaintext
from ddsi.structure.discovered import DiscoveredReaderData, DiscoveredWriterData
from ddsi.structure.guid import Guid
from ddsi.structure.qos import Qos
from ddsi.structure.qos_policies import BestEffort, KeepAll, Reliable
from tests.behavior.builders import (
    RELIABLE_QOS,
    reader_guid,
)

WEATHER = LinkConditions(loss=0.2, duplication=0.1, reordering=0.1, jitter=0.001)


class Crowd:
    """One filtering writer and many readers on nodes of their own."""

    def __init__(self, seed: int, readers: int, conditions: LinkConditions, qos: Qos = RELIABLE_QOS) -> None:
        self.domain = Domain(seed, conditions=conditions)
        self.writer: NodeWriter = self.domain.node().writer("keys", RELIABLE_QOS, filters=True)
        self.readers: list[NodeReader] = [
            self.domain.node().reader("keys", qos, uses_filter=True) for _ in range(readers)
        ]
        assert self.domain.run_until(self.domain.all_matched, 10)

    def write_to(self, reader: NodeReader, size: int = 20) -> int:
        change = self.writer.write(size, destination=reader.guid.participant)
        assert change is not None
        return change.sequence_number

    def settle(self) -> None:
        self.domain.run(0.5)
        assert self.domain.run_until(lambda: invariants.is_at_rest(self.domain), 60)
        assert invariants.complete(self.domain) == []
        assert invariants.in_order(self.domain) == []
        assert invariants.memory_released(self.domain) == []


@pytest.mark.parametrize("seed", range(6))
def test_each_of_many_readers_sees_exactly_its_own_samples(seed: int) -> None:
    """Under loss, duplication and reordering; and nobody's history stays behind."""
    crowd = Crowd(seed, 8, WEATHER)
    expected: dict[Guid, list[int]] = {reader.guid: [] for reader in crowd.readers}
    for step in range(80):
        reader = crowd.readers[(step * step + seed) % 8 if step % 3 else 0]
        expected[reader.guid].append(crowd.write_to(reader))
        crowd.domain.run(0.0005)
    crowd.settle()
    for reader in crowd.readers:
        assert reader.session(crowd.writer.guid).numbers == expected[reader.guid]
        assert reader.local.lost.total_count == 0, "numbers for others are no loss"
    assert invariants.quiet(crowd.domain, 20) == [], "no endless heartbeats"


@pytest.mark.parametrize("seed", range(4))
def test_a_peer_that_omits_the_gap_converges_by_acknack(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """A GAP that should accompany a sample may be lost, or never be sent."""
    monkeypatch.setattr(filtering_writer, "gap_before", lambda reader, change: None)
    crowd = Crowd(seed, 4, WEATHER if seed else LinkConditions())
    for step in range(40):
        crowd.write_to(crowd.readers[step % 4])
    crowd.settle()
    for index, reader in enumerate(crowd.readers):
        assert reader.session(crowd.writer.guid).numbers == list(range(index + 1, 41, 4))


@pytest.mark.parametrize("seed", range(4))
def test_a_peer_whose_heartbeats_speak_of_all_numbers_converges_too(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """So does Cyclone DDS: its GAPs come in answer to an ACKNACK only, for whatever the HEARTBEAT made us ask."""

    def undirected(writer: FilteringWriter, proxy: ReaderProxy, *, liveliness: bool = False) -> SendHeartbeat:
        writer._heartbeat_count += 1
        first, last = writer.cache.first_sn, writer.cache.last_sn
        return SendHeartbeat(first, last, writer._heartbeat_count, proxy.acked_sn >= proxy.lst_seq, (proxy,))

    monkeypatch.setattr(filtering_writer, "gap_before", lambda reader, change: None)
    monkeypatch.setattr(FilteringWriter, "directed_heartbeat", undirected)
    crowd = Crowd(seed, 4, WEATHER if seed else LinkConditions())
    for step in range(300):
        crowd.write_to(crowd.readers[step % 4 if step % 100 < 80 else 0])
    crowd.settle()
    for index, reader in enumerate(crowd.readers):
        expected = [step + 1 for step in range(300) if (step % 4 if step % 100 < 80 else 0) == index]
        assert reader.session(crowd.writer.guid).numbers == expected
        assert reader.local.lost.total_count == 0
    assert invariants.quiet(crowd.domain, 20) == []


def test_without_loss_the_gap_makes_asking_needless() -> None:
    """The numbers between are explained in the datagram of the sample, so no ACKNACK asks for anything."""
    crowd = Crowd(1, 3, LinkConditions())
    asked: list[int] = []

    def watch(sender: bytes, octets: bytes) -> None:
        if sender != crowd.writer.guid.prefix:
            asked.extend(raw.kind for raw in iterate_submessages(octets) if raw.kind == SubmessageKind.ACKNACK)

    for step in range(30):
        crowd.write_to(crowd.readers[step % 3])
        crowd.domain.run(0.01)
    crowd.domain.network.watch = watch
    before = len(asked)
    crowd.write_to(crowd.readers[0])
    crowd.domain.run(0.01)
    assert len(asked) - before == 1, "one acknowledgment, and nothing from the others"


@pytest.mark.parametrize("seed", range(3))
def test_large_filtered_samples_arrive_in_fragments(seed: int) -> None:
    crowd = Crowd(seed, 3, WEATHER)
    expected: dict[Guid, list[int]] = {reader.guid: [] for reader in crowd.readers}
    for step in range(12):
        reader = crowd.readers[step % 3]
        expected[reader.guid].append(crowd.write_to(reader, size=20_000 if step % 2 else 10))
    crowd.settle()
    assert {reader.guid: reader.session(crowd.writer.guid).numbers for reader in crowd.readers} == expected


def test_best_effort_readers_are_not_affected() -> None:
    crowd = Crowd(1, 3, LinkConditions(), Qos(reliability=BestEffort(), history=KeepAll()))
    for step in range(9):
        crowd.write_to(crowd.readers[step % 3])
    crowd.domain.run(1)
    for index, reader in enumerate(crowd.readers):
        assert reader.session(crowd.writer.guid).numbers == list(range(index + 1, 10, 3))
        assert reader.local.lost.total_count == 0, "numbers for others are no loss"


class _Hesitant(Plaintext):
    """Admits no writer until it has made up its mind."""

    def __init__(self) -> None:
        self.effects: list[HookEffect] = []

    def match(self, local: Guid, remote: DiscoveredWriterData | DiscoveredReaderData) -> Admission:
        return ADMITTED if local.entity_id.is_builtin else PENDING

    def drain_effects(self) -> Sequence[HookEffect]:
        effects, self.effects = self.effects, []
        return effects


def test_what_was_written_before_the_reader_admits_the_writer_comes_at_once_then() -> None:
    """Two that authenticate each other are never done at the same moment, and the first to be sends its keys."""
    domain = Domain(seed=1)
    hooks = _Hesitant()
    node = domain.node()
    writer = node.writer("keys", RELIABLE_QOS, filters=True)
    late = domain.node(make_hooks=lambda: hooks).reader("keys", RELIABLE_QOS, uses_filter=True)
    other = domain.node().reader("keys", RELIABLE_QOS, uses_filter=True)
    assert domain.run_until(lambda: writer.matched_count == 2, 5)
    for reader in (other, late, other, late):
        writer.write(destination=reader.guid.participant)
    domain.run(3)
    assert (late.matched_count, late.taken) == (0, [])
    assert other.session(writer.guid).numbers == [1, 3], "and the other did not wait"
    hooks.effects.append(Decided(late.guid, writer.guid, ADMITTED))
    late.node.pump()
    domain.run(0.02)
    assert late.session(writer.guid).numbers == [2, 4]
    assert late.local.lost.total_count == 0
    domain.run(0.1)
    assert held_by(writer) == []


def test_one_reader_that_is_silent_blocks_nobody() -> None:
    """It is cut off and gets a hundred samples; the others get theirs meanwhile, and it does when it is back."""
    crowd = Crowd(1, 3, LinkConditions())
    silent, *others = crowd.readers
    crowd.domain.network.unplug(silent.node.host)
    for _ in range(100):
        crowd.write_to(silent, size=5000)
        for reader in others:
            crowd.write_to(reader)
        crowd.domain.run(0.01)
    for reader in others:
        assert len(reader.session(crowd.writer.guid).changes) == 100
    assert silent.session(crowd.writer.guid).changes == []
    crowd.domain.network.heal()
    crowd.settle()
    assert len(silent.session(crowd.writer.guid).changes) == 100


def test_a_reader_that_is_deleted_takes_its_unfinished_samples_with_it() -> None:
    """The defragmenter, which its participant's readers share, is pruned of what was meant for it alone."""
    domain = Domain(seed=1)
    writer = domain.node().writer("keys", RELIABLE_QOS, filters=True)
    node = domain.node()
    one, other = (node.reader("keys", RELIABLE_QOS, uses_filter=True) for _ in range(2))
    assert domain.run_until(domain.all_matched, 1)
    # Of each sample only the last fragment is small enough to get through.
    domain.network.set_link(writer.node.host, node.host, LinkConditions(mtu=600))
    for reader in (one, other):
        writer.write(3000, destination=reader.guid)
    domain.run(0.01)
    defragmenter = node.engine.remote_writers[writer.guid].defragmenter
    assert list(defragmenter.partial_for(one.guid.entity_id)) == [1]
    assert list(defragmenter.partial_for(other.guid.entity_id)) == [2]
    one.delete()
    assert len(defragmenter) == 1
    assert list(defragmenter.partial_for(other.guid.entity_id)) == [2]
    domain.network.set_link(writer.node.host, node.host, LinkConditions())
    domain.run(5)
    assert other.session(writer.guid).numbers == [2]


def test_local_readers_see_only_their_own_as_well() -> None:
    domain = Domain(seed=1)
    node = domain.node()
    writer = node.writer("keys", RELIABLE_QOS, filters=True)
    one, other = node.reader("keys", RELIABLE_QOS), node.reader("keys", RELIABLE_QOS)
    for reader in (one, other, one):
        writer.write(destination=reader.guid)
    writer.write(destination=reader_guid(9))
    assert one.session(writer.guid).numbers == [1, 3]
    assert other.session(writer.guid).numbers == [2]
    assert held_by(writer) == []


def held_by(writer: NodeWriter) -> list[int]:
    return [change.sequence_number for change in writer.local.behavior.cache.changes()]


def test_gaps_reach_only_the_reader_they_are_for() -> None:
    """Each is addressed by participant and entity, so that no other reader learns numbers that are not its own."""
    crowd = Crowd(1, 3, LinkConditions())
    gaps: list[tuple[bytes, bytes]] = []

    def watch(sender: bytes, octets: bytes) -> None:
        destination = b""
        for raw in iterate_submessages(octets):
            if raw.kind == SubmessageKind.INFO_DST:
                destination = bytes(raw.body)
            elif raw.kind == SubmessageKind.GAP:
                gaps.append((destination, Gap.decode(raw.flags, raw.body).reader_id))

    crowd.domain.network.watch = watch
    for step in range(6):
        crowd.write_to(crowd.readers[step % 3])
    crowd.domain.run(1)
    assert len(gaps) == 5
    assert set(gaps) <= {(bytes(reader.guid.prefix), bytes(reader.guid.entity_id)) for reader in crowd.readers}


def test_the_config_bound_on_unacknowledged_octets_is_not_for_filtering_writers() -> None:
    domain = Domain(seed=1)
    writer = domain.node(config=Config(unacknowledged_octets=1000)).writer("keys", RELIABLE_QOS, filters=True)
    reader = domain.node().reader("keys", Qos(reliability=Reliable(), history=KeepAll()), uses_filter=True)
    assert domain.run_until(domain.all_matched, 1)
    for _ in range(5):
        assert writer.write(900, destination=reader.guid) is not None
