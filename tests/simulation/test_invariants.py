"""Each invariant finds what it is there to find: a domain is made well, one thing in it is broken, and it says so."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from ddsi.simulation import Domain, LinkConditions, NodeReader, NodeWriter, invariants
from ddsi.simulation.invariants import is_announcement
from ddsi.simulation.run import run_seed, run_seeds
from ddsi.simulation.scenario import Create, Failure, Restart, Scenario, Wait
from ddsi.structure.cache_change import CacheChange, ChangeKind
from ddsi.structure.qos import Qos
from ddsi.structure.qos_policies import KeepAll, Reliable, ResourceLimits, TransientLocal

RELIABLE = Qos(reliability=Reliable(), history=KeepAll())


def well_made(writes: int = 4) -> tuple[Domain, NodeWriter, NodeReader]:
    """A writer and a reader on two nodes that have come to rest, with some samples between them."""
    domain = Domain(seed=1)
    writer, reader = domain.node().writer("Square", RELIABLE), domain.node().reader("Square", RELIABLE)
    assert domain.run_until(domain.all_matched, 1)
    for _ in range(writes):
        writer.write(size=3)
    domain.run(1)
    return domain, writer, reader


def test_a_domain_at_rest_has_no_flaws() -> None:
    domain, _, reader = well_made()
    assert reader.taken
    assert invariants.is_at_rest(domain)
    assert invariants.at_rest(domain) == []
    assert invariants.quiet(domain, 10) == []


def _twice(writer: NodeWriter, reader: NodeReader) -> None:
    changes = reader.session(writer.guid).changes
    changes.append(changes[-1])


def _swapped(writer: NodeWriter, reader: NodeReader) -> None:
    changes = reader.session(writer.guid).changes
    changes[0], changes[1] = changes[1], changes[0]


def _altered(writer: NodeWriter, reader: NodeReader) -> None:
    change = reader.session(writer.guid).changes[2]
    change.payload = bytes(change.payload[:-1]) + b"?"


def _truncated(writer: NodeWriter, reader: NodeReader) -> None:
    change = reader.session(writer.guid).changes[2]
    change.payload = change.payload[:-1]


def _invented(writer: NodeWriter, reader: NodeReader) -> None:
    invented = CacheChange(ChangeKind.ALIVE, writer.guid, 99, b"")
    reader.session(writer.guid).changes.append(invented)


def _of_another(writer: NodeWriter, reader: NodeReader) -> None:
    writer.written[3].destination = writer.guid.participant


def _not_taken(writer: NodeWriter, reader: NodeReader) -> None:
    reader.taken.pop()


@pytest.mark.parametrize(
    ("break_it", "flaw"),
    [
        (_twice, "4 came after 4"),
        (_swapped, "1 came after 2"),
        (_altered, "3 is not as it was written"),
        (_truncated, "3 is not as it was written"),
        (_invented, "99 was never written"),
        (_of_another, "3 was for another"),
        (_not_taken, "3 samples taken of 4 received"),
    ],
)
def test_order_and_content(break_it: Callable[[NodeWriter, NodeReader], None], flaw: str) -> None:
    domain, writer, reader = well_made()
    break_it(writer, reader)
    assert any(flaw in found for found in invariants.in_order(domain))


def test_a_hole_is_found() -> None:
    domain, writer, reader = well_made()
    del reader.session(writer.guid).changes[1]
    (found,) = invariants.complete(domain)
    assert "2 never came, of 4" in found


def test_history_from_before_the_match_is_found() -> None:
    domain, writer, reader = well_made()
    proxy = writer.local.behavior.readers[reader.guid]
    proxy.history_sn = 2
    (found,) = invariants.complete(domain)
    assert "1, 2 came, which were written before the match" in found


def test_what_a_reader_without_room_rejected_need_not_be_taken() -> None:
    """Best effort has no way to make the writer wait."""
    domain = Domain(seed=1)
    writer = domain.node().writer("Square", Qos(history=KeepAll()))
    few = Qos(history=KeepAll(), resource_limits=ResourceLimits(max_samples=2))
    reader = domain.node().reader("Square", few, takes=False)
    assert domain.run_until(domain.all_matched, 1)
    for _ in range(5):
        writer.write()
    domain.run(1)
    reader.hurry()
    assert (len(reader.taken), reader.local.rejected.total_count) == (2, 3)
    assert invariants.in_order(domain) == []
    reader.taken.pop()
    assert any("1 samples taken of 5 received" in flaw for flaw in invariants.in_order(domain))


def test_only_a_reliable_pair_is_owed_the_rest_of_a_sample() -> None:
    for qos, owes in ((RELIABLE, True), (Qos(history=KeepAll()), False)):
        domain = Domain(seed=1)
        writer, reader = domain.node().writer("Square", qos), domain.node().reader("Square", qos)
        assert domain.run_until(domain.all_matched, 1)
        # Only the last fragment is small enough to get through.
        domain.network.set_link(writer.node.host, reader.node.host, LinkConditions(mtu=600))
        writer.write(3000)
        domain.run(0.1)
        assert any("unfinished samples" in flaw for flaw in invariants.memory_released(domain)) is owes


def test_a_match_that_should_not_be_and_one_that_is_missing_are_found() -> None:
    domain, writer, reader = well_made()
    reader.local.match_changed(writer.guid, 1)
    assert any("2 matched, 1 fit" in flaw for flaw in invariants.matched(domain))
    domain, writer, reader = well_made()
    del writer.local.behavior.readers[reader.guid]
    assert any("the writer has not matched" in flaw for flaw in invariants.matched(domain))


def test_strangers_are_found() -> None:
    domain, _, _ = well_made()
    domain.nodes[0].engine.participants.clear()
    assert any("not everybody knows everybody: {'a': 0, 'b': 1}" in flaw for flaw in invariants.matched(domain))


def test_memory_that_is_not_given_back_is_found() -> None:
    domain, writer, reader = well_made()
    writer.local.behavior.cache.unacknowledged_octets = 5
    proxy = reader.local.behavior.writers[writer.guid]
    proxy.reorder.add(CacheChange(ChangeKind.ALIVE, writer.guid, 9, b"x"))
    flaws = invariants.memory_released(domain)
    assert any("counts 5 unacknowledged octets" in flaw for flaw in flaws)
    assert any("still holds back 1 samples" in flaw for flaw in flaws)


def test_buffers_above_their_bound_are_found() -> None:
    domain, writer, reader = well_made()
    for number in range(10, 10 + 1030):
        reader.local.behavior.writers[writer.guid].reorder._changes[number] = CacheChange(
            ChangeKind.ALIVE, writer.guid, number, b""
        )
    writer.local.behavior.cache.octets += 1
    domain.nodes[0].engine.defrag_budget.octets = 1 << 40
    flaws = invariants.memory_bounded(domain)
    assert any("1030 samples wait for their turn" in flaw for flaw in flaws)
    assert any("wrongly" in flaw for flaw in flaws)
    assert any("octets of unfinished samples" in flaw for flaw in flaws)


def test_talk_in_a_quiet_time_is_found() -> None:
    domain, writer, _ = well_made()
    wall = domain.now + 1

    def speak() -> None:
        writer.write()

    domain.network.at(wall, speak)
    (found,) = invariants.quiet(domain, 5)
    assert f"messages in a quiet time, the first at {wall:.3f} s: INFO_TS DATA" in found
    assert domain.network.watch is None


def test_too_many_announcements_are_found() -> None:
    domain, _, _ = well_made()
    node = domain.nodes[0]

    def announce() -> None:
        node.engine.discovery.announce_change(node.engine.discovery.data, domain.now)
        node.pump()

    for number in range(200):
        domain.network.at(domain.now + number * 0.01, announce)
    assert any(flaw.startswith("a announced itself") for flaw in invariants.quiet(domain, 5))


def test_waking_up_for_nothing_is_found() -> None:
    domain, _, _ = well_made()
    node = domain.nodes[0]
    engine = node.engine

    def fidget() -> None:
        node.timeout_count += 1
        engine.handle_timeout(domain.now)

    for number in range(300):
        domain.network.at(domain.now + number * 0.01, fidget)
    assert any("woke up" in flaw for flaw in invariants.quiet(domain, 5))


def test_only_spdp_is_an_announcement() -> None:
    domain = Domain(seed=1)
    seen: list[bytes] = []
    domain.network.watch = lambda sender, octets: seen.append(octets)
    domain.node().writer()
    domain.node()
    domain.run(1)
    kinds = [is_announcement(octets) for octets in seen]
    assert any(kinds)
    assert not all(kinds)


def test_replaced_samples_of_keep_last_are_not_missed() -> None:
    """With KEEP_LAST a reader may get only what the history still held when it asked."""
    domain = Domain(seed=3, conditions=LinkConditions(loss=0.5))
    writer = domain.node().writer("Square", Qos(durability=TransientLocal()))
    reader = domain.node().reader("Square", Qos(reliability=Reliable(), durability=TransientLocal()))
    domain.run(2)
    for _ in range(50):
        writer.write()
    domain.run(20)
    numbers = reader.session(writer.guid).numbers
    assert numbers[-1] == 50
    assert len(numbers) < 50
    assert invariants.complete(domain) == []
    del reader.session(writer.guid).changes[-1]
    assert invariants.complete(domain) != []


# --- what a failure says --------------------------------------------------------------------------------------------


def _failing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(invariants, "matched", lambda domain: ["a flaw"])


def test_a_failing_seed_says_how_to_replay_it(monkeypatch: pytest.MonkeyPatch) -> None:
    _failing(monkeypatch)
    with pytest.raises(Failure, match="a flaw") as raised:
        Scenario.from_seed(11).run()
    assert raised.value.seed == 11
    assert "ddsi sim --seed 11" in str(raised.value)
    lines: list[str] = []
    assert run_seeds([11, 12], lines.append) == [11, 12]
    assert "ddsi sim --seed 12" in lines[1]
    assert lines[-1] == "2 seeds, 2 failed: 11, 12"


def test_a_seed_that_holds_says_what_happened() -> None:
    lines: list[str] = []
    assert run_seed(11, lines.append)
    assert lines[0].startswith("seed 11: ")
    assert lines[-1].endswith("every invariant held")
    assert run_seeds([11], lines.append) == []
    assert lines[-1] == "1 seeds, 0 failed"


def test_steps_read_as_sentences() -> None:
    assert str(Wait(0.5)) == "0.5 s pass"
    assert str(Restart(2, goodbye=False)) == "node 2: restarts after a crash"
    assert str(Restart(2, goodbye=True)) == "node 2: restarts after a goodbye"
    (create, *_) = (step for step in Scenario.from_seed(11).steps if isinstance(step, Create))
    assert str(create).startswith("node 0: writer of Square, Qos(reliability=Reliable(")
