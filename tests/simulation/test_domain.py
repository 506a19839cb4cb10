"""Domains of simulated participants: they meet, exchange samples, crash and come back."""

from __future__ import annotations

from ddsi.config import Config
from ddsi.simulation import Domain, LinkConditions
from ddsi.structure.cache_change import ChangeKind
from ddsi.structure.qos import Qos
from ddsi.structure.qos_policies import KeepAll, KeepLast, Reliable
from ddsi.structure.status import SubscriptionMatched
from ddsi.trace.events import EndpointCreated, MessageReceived, MessageSent, ParticipantCreated, Remark
from ddsi.trace.sink import MemorySink

RELIABLE = Qos(reliability=Reliable(), history=KeepAll())


def test_two_participants_meet_and_samples_arrive_in_order() -> None:
    domain = Domain(seed=1)
    writer, reader = domain.node().writer("Square", RELIABLE), domain.node().reader("Square", RELIABLE)
    assert domain.run_until(domain.all_matched, 1)
    for size in (3, 7, 103, 5003):  # with header and key a multiple of 4: what is shorter arrives padded
        writer.write(size)
    domain.run(1)
    assert reader.session(writer.guid).numbers == [1, 2, 3, 4]
    assert [len(change.payload) - 5 for _, change in reader.taken] == [3, 7, 103, 5003]
    assert (writer.matched_count, reader.matched_count) == (1, 1)


def test_instances_end_as_the_writer_says() -> None:
    domain = Domain(seed=1)
    writer = domain.node().writer("Circle", RELIABLE, keyed=True)
    reader = domain.node().reader("Circle", RELIABLE, keyed=True)
    domain.run_until(domain.all_matched, 1)
    writer.write(key=1)
    writer.write(key=2)
    writer.end(ChangeKind.NOT_ALIVE_DISPOSED, key=1)
    domain.run(1)
    assert [(info.instance_handle, info.valid_data) for info, _ in reader.taken] == [
        (b"\x01", True),
        (b"\x02", True),
        (b"\x01", False),
    ]


def test_readers_of_one_node_need_no_network() -> None:
    domain = Domain(seed=1, conditions=LinkConditions(loss=1.0))
    node = domain.node()
    writer, reader = node.writer("Square", RELIABLE), node.reader("Square", RELIABLE)
    writer.write()
    assert reader.session(writer.guid).numbers == [1]
    assert domain.all_matched()


def test_a_restarted_node_is_another_participant_without_endpoints() -> None:
    domain = Domain(seed=1)
    a, b = domain.node(), domain.node()
    reader = b.reader("Square", RELIABLE)
    domain.run(1)
    before = b.guid
    b.restart()
    assert b.guid != before
    assert (b.live_readers(), reader.is_deleted) == ([], True)
    domain.run(1)
    assert sorted(a.engine.participants) == sorted([before.prefix, b.guid.prefix]), "nobody said goodbye"
    domain.run(Config().lease_duration)
    assert domain.are_introduced()
    b.restart(goodbye=True)
    domain.run(1)
    assert domain.are_introduced()


def test_a_node_that_is_down_does_nothing() -> None:
    domain = Domain(seed=1)
    a, b = domain.node(), domain.node()
    domain.run(1)
    b.kill()
    sent = domain.network.sent
    a.close()
    assert domain.network.sent > sent, "a goodbye"
    sent = domain.network.sent
    domain.run(1000)
    assert domain.network.sent == sent
    assert (domain.live_nodes(), domain.writers(), domain.readers()) == ([], [], [])


def test_nodes_of_one_host_take_one_index_after_the_other() -> None:
    domain = Domain(seed=1)
    first, second = domain.node(address="10.1.1.1"), domain.node(address="10.1.1.1")
    assert [node.port.locator.port for node in (first, second)] == [7410, 7412]
    assert first.host == second.host
    assert domain.run_until(domain.are_introduced, 1)


def test_different_domains_do_not_meet() -> None:
    domain = Domain(seed=1)
    a, b = domain.node(domain_id=0), domain.node(domain_id=1)
    c, d = domain.node(config=Config(domain_tag="x")), domain.node(config=Config(domain_tag="x"))
    domain.run(5)
    assert domain.are_introduced()
    assert [len(node.engine.participants) for node in (a, b, c, d)] == [0, 0, 1, 1]


def test_all_matched_sees_a_match_that_should_not_be() -> None:
    domain = Domain(seed=1)
    node = domain.node()
    node.writer("Square", RELIABLE)
    reader = domain.node().reader("Square", RELIABLE)
    assert not domain.all_matched()
    domain.run_until(domain.all_matched, 1)
    reader.local.match_changed(reader.guid, 1)
    assert not domain.all_matched()


def test_one_trace_holds_engines_and_network() -> None:
    """What every engine does, and the network, in the order in which it happened."""
    trace = MemorySink()
    domain = Domain(seed=1, trace=trace)
    a, b = domain.node(), domain.node()
    a.writer("Square", RELIABLE)
    domain.run(1)
    b.remark("has heard enough")
    assert [event.participant for event in trace.of(ParticipantCreated)] == [a.guid.prefix, b.guid.prefix]
    assert len(trace.of(EndpointCreated)) == 1
    assert [event.text for event in trace.of(Remark)] == ["b has heard enough"]
    assert len(trace.of(MessageReceived)) == domain.network.delivered
    assert {event.participant for event in trace.of(MessageSent)} == {a.guid.prefix, b.guid.prefix}
    assert [event.now for event in trace] == sorted(event.now for event in trace)


def test_statuses_are_remembered_with_their_time() -> None:
    domain = Domain(seed=1)
    domain.node().writer("Square", RELIABLE)
    node = domain.node()
    reader = node.reader("Square", Qos(history=KeepLast(1)))
    domain.run(1)
    matched = node.statuses_of(SubscriptionMatched)
    assert [status.current_count for status in matched if isinstance(status, SubscriptionMatched)] == [1]
    assert 0 < node.statuses[0][0] < 1
    assert node.statuses[0][1] == reader.guid


def test_a_write_that_would_have_to_wait_is_refused() -> None:
    domain = Domain(seed=1)
    a, b = domain.node(config=Config(unacknowledged_octets=1000)), domain.node()
    writer, _ = a.writer("Square", RELIABLE), b.reader("Square", RELIABLE)
    domain.run_until(domain.all_matched, 1)
    assert writer.write(900) is not None
    assert writer.write(900) is None
    assert writer.refused == 1
    domain.run(1)
    assert writer.write(900) is not None
