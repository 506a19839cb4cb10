"""Participants find each other, lose each other and find each other again: in virtual time."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import pytest

from ddsi.config import Config
from ddsi.simulation import Domain, LinkConditions, Node, invariants
from ddsi.simulation.network import Port
from ddsi.structure.locator import Locator
from ddsi.structure.qos import Qos
from ddsi.structure.qos_policies import KeepAll, Partition, Reliable, TransientLocal
from ddsi.structure.status import PublicationMatched, SubscriptionMatched
from ddsi.trace.events import ParticipantLost
from ddsi.trace.reasons import DropReason, LossReason
from ddsi.trace.sink import MemorySink
from tests.engine.wire import Stranger, engine

RELIABLE = Qos(reliability=Reliable(), history=KeepAll())
LATE = RELIABLE | Qos(durability=TransientLocal())


def knows(node: Node, other: Node) -> bool:
    return other.guid.prefix in node.engine.participants


# --- finding --------------------------------------------------------------------------------------------------------


def test_two_participants_meet_within_a_round_trip() -> None:
    """Nobody waits for a period: an announcement is answered by one, and all the rest follows."""
    domain = Domain(conditions=LinkConditions(delay=0.01))
    domain.node().writer("Square", RELIABLE)
    domain.node().reader("Square", RELIABLE)
    assert domain.run_until(domain.all_matched, 1)
    assert domain.now < 0.1


def test_many_participants_meet() -> None:
    domain = Domain()
    nodes = [domain.node() for _ in range(12)]
    for index, node in enumerate(nodes):
        node.writer(f"topic {index % 3}", RELIABLE)
        node.reader(f"topic {index % 4}", RELIABLE)
    assert domain.run_until(domain.all_matched, 2)
    assert all(len(node.engine.participants) == 11 for node in nodes)


def test_several_participants_of_one_process_or_host_meet() -> None:
    """Each has its ports; what differs is the participant index."""
    domain = Domain()
    nodes = [domain.node(address="10.0.0.1") for _ in range(4)] + [domain.node()]
    for node in nodes:
        node.writer("Square", RELIABLE)
        node.reader("Square", RELIABLE)
    assert domain.run_until(domain.all_matched, 2)
    assert len({node.port.locator for node in nodes}) == 5


def test_unicast_peers_meet_without_multicast() -> None:
    """Each calls the other's host at every index that a participant there may have."""
    domain = Domain()
    a = domain.node(multicast=False, peers=("10.0.0.2",))
    domain.node(address="10.0.0.2", multicast=False, peers=("10.0.0.1",))
    b = domain.node(address="10.0.0.2", multicast=False, peers=("10.0.0.1",))
    a.writer("Square", RELIABLE)
    reader = b.reader("Square", RELIABLE)
    assert domain.run_until(domain.all_matched, 2)
    domain.run(100)
    assert domain.all_matched(), "they keep announcing to each other"
    assert reader.matched_count == 1


def test_one_side_that_knows_the_address_is_enough() -> None:
    domain = Domain()
    a = domain.node(multicast=False)
    b = domain.node(multicast=False, peers=("10.0.0.1",))
    assert domain.run_until(domain.are_introduced, 2)
    domain.run(200)
    assert knows(a, b)
    assert knows(b, a)


def test_a_participant_with_multicast_and_one_without_meet() -> None:
    domain = Domain()
    domain.node().writer("Square", RELIABLE)
    domain.node(multicast=False, peers=("10.0.0.1",)).reader("Square", RELIABLE)
    assert domain.run_until(domain.all_matched, 2)
    domain.run(200)
    assert domain.all_matched()


@pytest.mark.parametrize("loss", [0.3, 0.6])
def test_they_meet_over_a_bad_network(loss: float) -> None:
    for seed in range(5):
        domain = Domain(seed, conditions=LinkConditions(loss=loss, reordering=0.2, duplication=0.2))
        domain.node().writer("Square", RELIABLE)
        domain.node().reader("Square", RELIABLE)
        assert domain.run_until(domain.all_matched, 30), f"seed {seed}"


@pytest.mark.parametrize(
    ("one", "other", "reason"),
    [
        ({"domain_id": 0}, {"domain_id": 1}, None),  # other ports: nothing is heard at all
        ({"config": Config(domain_tag="a")}, {"config": Config(domain_tag="b")}, DropReason.DOMAIN_TAG),
        ({"config": Config(domain_tag="a")}, {}, DropReason.DOMAIN_TAG),
        ({"config": Config(domain_tag="a")}, {"config": Config(domain_tag="a")}, "meet"),
    ],
)
def test_domain_and_tag_keep_participants_apart(
    one: dict[str, int], other: dict[str, int], reason: DropReason | str | None
) -> None:
    domain = Domain()
    a, b = domain.node(**one), domain.node(**other)  # type: ignore[arg-type]
    domain.run(3)
    assert knows(a, b) is (reason == "meet")
    assert knows(b, a) is (reason == "meet")
    if isinstance(reason, DropReason):
        assert a.engine.drops[reason] > 0


# --- losing and finding again ---------------------------------------------------------------------------------------


def pair(domain: Domain, **config: float) -> tuple[Node, Node]:
    """Two nodes with a writer and a reader of one topic, matched."""
    a, b = (domain.node(config=Config(**config)) for _ in range(2))  # type: ignore[arg-type]
    a.writer("Square", LATE)
    b.reader("Square", LATE)
    assert domain.run_until(domain.all_matched, 5)
    return a, b


def test_a_peer_that_restarts_is_found_within_moments() -> None:
    domain = Domain()
    a, b = pair(domain)
    domain.run(30)
    b.restart()
    reader = b.reader("Square", LATE)
    begin = domain.now
    assert domain.run_until(lambda: reader.matched_count == 1, 5)
    assert domain.now - begin < 0.5
    writer = a.writers[0]
    writer.write()
    assert domain.run_until(lambda: len(reader.taken) == 1, 1)
    domain.run(25)
    assert domain.are_introduced(), "its former life is over with its lease"


def test_a_peer_that_restarts_after_a_goodbye_leaves_nothing_behind() -> None:
    domain = Domain()
    a, b = pair(domain)
    b.restart(goodbye=True)
    domain.run(0.1)
    assert len(a.engine.participants) == 1
    assert a.writers[0].matched_count == 0


def test_a_peer_that_restarts_under_the_same_guid_is_found_again() -> None:
    """Stacks that make their prefix from host and process number come back so, in a container each time.

    Everything it says is numbered from 1 again; taken for duplicates it would never be understood.
    """
    trace = MemorySink()
    domain = Domain(trace=trace)
    a, b = domain.node(), domain.node()
    for number in range(5):
        b.writer(f"topic {number}", LATE)
    reader = a.reader("topic 0", LATE)
    assert domain.run_until(domain.all_matched, 5)
    for _ in range(10):
        b.writers[0].write()
    domain.run(20)
    prefix = b.guid.prefix
    b.kill()
    b.start(prefix)
    writer = b.writer("topic 0", LATE)
    begin = domain.now
    writer.write()
    assert domain.run_until(lambda: len(reader.session(writer.guid).changes) == 1, 15)
    assert domain.now - begin < 10
    assert [event.reason for event in trace.of(ParticipantLost)] == [LossReason.RESTARTED]
    domain.run(1)
    assert domain.all_matched()


@pytest.mark.parametrize("outage", [1.0, 25.0, 120.0])
def test_after_an_outage_everything_is_found_within_seconds(outage: float) -> None:
    """Shorter than the lease: nobody noticed.  Longer: both have forgotten each other."""
    domain = Domain()
    a, b = pair(domain)
    writer, reader = a.writers[0], b.readers[0]
    for _ in range(3):
        writer.write()
    domain.run(1)
    domain.network.partition([a.host], [b.host])
    domain.run(outage / 2)
    writer.write()
    domain.run(outage / 2)
    assert domain.are_introduced() is (outage < 20)
    domain.network.heal()
    begin = domain.now
    assert domain.run_until(domain.all_matched, 10)
    assert domain.run_until(lambda: reader.session(writer.guid).numbers[-1:] == [4], 10)
    assert domain.now - begin < 5
    assert invariants.in_order(domain) == []


@pytest.mark.parametrize("outage", [25.0, 300.0])
def test_unicast_peers_find_each_other_again_after_an_outage(outage: float) -> None:
    """Also the one that had no address to call: it was called, and remembers."""
    domain = Domain()
    a = domain.node(multicast=False)
    b = domain.node(multicast=False, peers=("10.0.0.1",))
    a.writer("Square", LATE)
    b.reader("Square", LATE)
    assert domain.run_until(domain.all_matched, 2)
    domain.network.unplug(b.host)
    domain.run(outage)
    assert not knows(a, b)
    domain.network.heal()
    begin = domain.now
    assert domain.run_until(domain.all_matched, 10)
    assert domain.now - begin < 5


def test_an_outage_that_only_one_side_noticed_heals() -> None:
    """One forgot the other and begins anew; the other goes on where it was, with all its counts and numbers."""
    domain = Domain()
    a, b = pair(domain)
    writer, reader = a.writers[0], b.readers[0]
    for size in (10, 5000, 10):
        writer.write(size)
    domain.run(1)
    # Nothing from a reaches b: b's lease on a runs out, while a hears b all the time.
    domain.network.set_link(a.host, b.host, LinkConditions(loss=1.0))
    domain.run(30)
    assert (knows(a, b), knows(b, a)) == (True, False)
    for size in (10, 5000):
        writer.write(size)
    domain.network.set_link(a.host, b.host, LinkConditions(loss=0.1))
    begin = domain.now
    assert domain.run_until(domain.all_matched, 10)
    assert domain.run_until(lambda: reader.session(writer.guid).numbers == [4, 5], 10)
    assert [session.numbers for session in reader.sessions[writer.guid]] == [[1, 2, 3], [4, 5]]
    assert domain.now - begin < 8
    assert writer.matched_count == reader.matched_count == 1


def test_large_samples_are_repaired_for_one_that_counts_anew() -> None:
    """Its NACK_FRAGs are counted from 1 again, and must not be taken for old ones."""
    domain = Domain()
    a, b = pair(domain)
    writer, reader = a.writers[0], b.readers[0]
    domain.network.set_link(a.host, b.host, LinkConditions(loss=0.3))
    for _ in range(20):
        writer.write(20_000)
    assert domain.run_until(lambda: len(reader.taken) == 20, 60)
    domain.network.set_link(a.host, b.host, LinkConditions(loss=1.0))
    domain.run(30)
    domain.network.set_link(a.host, b.host, LinkConditions(loss=0.3))
    begin = domain.now
    assert domain.run_until(lambda: len(reader.session(writer.guid).changes) == 20 and domain.all_matched(), 60)
    assert domain.now - begin < 15


# --- leases ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("lease", [1.0, 5.0, 20.0])
def test_a_silent_participant_is_forgotten_when_its_lease_ends(lease: float) -> None:
    domain = Domain()
    a, b = pair(domain, lease_duration=lease)
    domain.run(100)
    assert knows(a, b), "announcements renew it"
    b.kill()
    begin = domain.now
    assert domain.run_until(lambda: not knows(a, b), 200)
    assert lease * 0.5 <= domain.now - begin <= lease + 0.001
    assert a.writers[0].matched_count == 0
    assert a.statuses_of(PublicationMatched)[-1] == PublicationMatched(
        total_count=1,
        current_count=0,
        current_count_change=-1,
        last_subscription_handle=b.readers[0].guid,
    )


def test_anything_that_is_heard_renews_the_lease() -> None:
    """Not only announcements: a busy peer is alive."""
    domain = Domain()
    a, b = domain.node(config=Config(lease_duration=5.0)), domain.node()
    writer, reader = a.writer("Square", RELIABLE), b.reader("Square", RELIABLE)
    assert domain.run_until(domain.all_matched, 5)
    original = domain.network.send

    def without_announcements(source: Port, destinations: Sequence[Locator], octets: bytes) -> None:
        if not invariants.is_announcement(octets):
            original(source, destinations, octets)

    domain.network.send = without_announcements  # type: ignore[method-assign]
    for _ in range(30):
        writer.write()
        domain.run(1)
    assert knows(b, a)
    domain.run(6)
    assert not knows(b, a)
    assert reader.matched_count == 0


def test_an_infinite_lease_never_ends() -> None:
    domain = Domain()
    a, b = domain.node(config=Config(lease_duration=math.inf, spdp_interval=5.0)), domain.node()
    a.writer("Square", RELIABLE)
    domain.run(5)
    a.kill()
    domain.run(100_000)
    assert knows(b, a)


def test_a_lease_that_was_changed_holds_from_then_on() -> None:
    domain = Domain()
    a, b = pair(domain)
    engine = b.engine
    engine.discovery.announce_change(replace(engine.discovery.data, lease_duration=60.0), domain.now)
    b.pump()
    domain.run(1)
    assert a.engine.participants[b.guid.prefix].data.lease_duration == 60.0
    b.kill()
    domain.run(50)
    assert knows(a, b)
    domain.run(15)
    assert not knows(a, b)


# --- goodbye --------------------------------------------------------------------------------------------------------


def test_a_goodbye_is_heard_at_once_by_all() -> None:
    domain = Domain()
    a, b = pair(domain)
    c = domain.node(multicast=False, peers=("10.0.0.1",))
    domain.run_until(domain.are_introduced, 2)
    a.close()
    domain.run(0.1)
    assert not knows(b, a)
    assert not knows(c, a)
    assert b.readers[0].matched_count == 0
    assert isinstance(b.statuses_of(SubscriptionMatched)[-1], SubscriptionMatched)


def test_an_announcement_that_a_goodbye_overtook_brings_nobody_back() -> None:
    """They came by different sockets, and the later one was read first."""
    participant, stranger = engine(), Stranger()
    stranger.introduce(participant, 1.0)
    participant.receive_datagram(stranger.goodbye(), stranger.address, 2.0)
    for _ in range(2):
        participant.receive_datagram(stranger.spdp(), stranger.address, 2.001)
    assert not participant.participants
    assert participant.drops[DropReason.OUT_OF_ORDER] == 2
    participant.receive_datagram(stranger.spdp(), stranger.address, 3.1)
    assert list(participant.participants) == [stranger.prefix], "it has begun anew, and counts from 1"


def test_a_goodbye_of_somebody_unknown_keeps_nobody_out() -> None:
    participant, stranger = engine(), Stranger()
    participant.receive_datagram(stranger.goodbye(), stranger.address, 1.0)
    participant.receive_datagram(stranger.spdp(), stranger.address, 1.1)
    assert list(participant.participants) == [stranger.prefix]


def test_endpoints_that_are_deleted_are_unmatched_at_once() -> None:
    domain = Domain()
    a, b = pair(domain)
    b.readers[0].delete()
    domain.run(0.1)
    assert a.writers[0].matched_count == 0
    assert len(a.engine.known_readers) == 0
    assert knows(a, b)
    a.writers[0].delete()
    domain.run(0.1)
    assert len(b.engine.known_writers) == 0


def test_a_thousand_endpoints_come_and_go_without_a_trace() -> None:
    """Of "endpoint gone" nothing is kept once nobody can lack it: latecomers never knew the endpoint."""
    domain = Domain()
    a, b = domain.node(), domain.node()
    domain.run_until(domain.are_introduced, 5)
    for _ in range(250):
        for endpoint in (a.writer("x", RELIABLE), a.reader("y", RELIABLE)):
            endpoint.delete()
        domain.run(0.2)
    domain.run(2 * a.setup.config.lease_duration + 1)
    a.writer("last")
    domain.run(5)
    for writer in a.engine.local_writers.values():
        assert len(writer.behavior.cache) <= 2
    assert (len(b.engine.known_writers), len(b.engine.known_readers)) == (1, 0)
    assert len(b.engine.remote_writers) == 5
    late = domain.node()
    domain.run(5)
    assert len(late.engine.known_writers) == 1


def test_what_ended_while_only_we_had_lost_a_peer_is_told_when_it_hears_us_again() -> None:
    """It never noticed the outage, so it would believe in the endpoint as long as we live."""
    domain = Domain()
    a = domain.node(config=Config(lease_duration=60.0))
    b = domain.node(config=Config(lease_duration=3.0))
    writer, reader = a.writer("Square", LATE), b.reader("Square", LATE)
    assert domain.run_until(domain.all_matched, 5)
    domain.network.partition([a.host], [b.host])
    domain.run(5)
    assert (knows(a, b), knows(b, a)) == (False, True)
    writer.delete()
    a.writer("Circle")
    domain.run(2)
    domain.network.heal()
    domain.run(8)
    assert reader.matched_count == 0
    assert [data.topic_name for data in b.engine.known_writers.all()] == ["Circle"]


# --- matching -------------------------------------------------------------------------------------------------------


def test_partitions_decide_across_the_network_too() -> None:
    domain = Domain()
    a, b = domain.node(), domain.node()
    writers = [
        a.writer("Square", Qos(partition=Partition(*names))) for names in ((), ("red",), ("re*",), ("blue", "red"))
    ]
    readers = [b.reader("Square", Qos(partition=Partition(*names))) for names in ((), ("red",), ("*",), ("b?ue",))]
    domain.run(1)
    assert domain.all_matched()
    assert [writer.matched_count for writer in writers] == [2, 2, 1, 3]
    assert [reader.matched_count for reader in readers] == [1, 3, 3, 1]


def test_refusals_are_kept_with_their_reason_and_forgotten_with_their_cause() -> None:
    domain = Domain()
    a, b = domain.node(), domain.node()
    writer = a.writer("Square", Qos(partition=Partition("p")))
    reader = b.reader("Square", RELIABLE | Qos(durability=TransientLocal()))
    domain.run(1)
    refusal = a.engine.matchmaker.refusals[(writer.guid, reader.guid)]
    assert str(refusal) == "partition: offered ('p',), requested ('',)"
    assert b.engine.matchmaker.refusals[(reader.guid, writer.guid)] == refusal
    reader.delete()
    domain.run(1)
    assert a.engine.matchmaker.refusals == b.engine.matchmaker.refusals == {}


def test_both_sides_are_told_of_incompatible_qos_once() -> None:
    domain = Domain()
    a, b = domain.node(), domain.node()
    writer, reader = a.writer("Square", Qos()), b.reader("Square", Qos(durability=TransientLocal()))
    domain.run(10)
    assert writer.local.incompatible.total_count == 1
    assert reader.local.incompatible.total_count == 1
    (reason,) = writer.local.incompatible.incompatibilities
    assert str(reason) == "durability: offered Volatile, requested TransientLocal"
    assert reader.local.incompatible.incompatibilities == (reason,)
    assert reader.local.incompatible.last_publication_handle == writer.guid
