"""The virtual network: who gets which datagram, when, and what the trace says of those that nobody gets."""

from __future__ import annotations

import pytest

from ddsi.simulation import Dice, LinkConditions, Network, SimulationStuck
from ddsi.simulation.network import Port
from ddsi.structure.guid import GuidPrefix
from ddsi.structure.locator import Locator
from ddsi.trace.events import LinkDelayed, LinkDropped, LinkDuplicated
from ddsi.trace.sink import MemorySink

GROUP = Locator.udp_v4("239.255.0.1", 7400)


class Host:
    """A port and what came out of it."""

    def __init__(self, network: Network, number: int, *, port: int = 7410, joins: bool = True) -> None:
        self.locator = Locator.udp_v4(f"10.0.0.{number}", port)
        self.got: list[tuple[float, bytes, Locator]] = []
        self.prefix = GuidPrefix(bytes([number]) * 12)
        self.port = Port(
            self.locator, self.prefix, lambda octets, source: self.got.append((network.now, octets, source))
        )
        network.open(self.port, (GROUP,) if joins else ())

    @property
    def octets(self) -> list[bytes]:
        return [octets for _, octets, _ in self.got]


def network(seed: int = 1, trace: MemorySink | None = None, **conditions: float) -> Network:
    return Network(Dice(seed), LinkConditions(**conditions), trace=trace)  # type: ignore[arg-type]


def test_unicast_reaches_its_port_alone_after_the_delay() -> None:
    net = network(delay=0.25)
    a, b, c = Host(net, 1), Host(net, 2), Host(net, 3)
    net.send(a.port, (b.locator,), b"hello")
    net.run_until(0.2)
    assert b.got == []
    net.run_until(1.0)
    assert b.got == [(0.25, b"hello", a.locator)]
    assert (a.got, c.got, net.now) == ([], [], 1.0)


def test_multicast_reaches_all_members_but_the_sender() -> None:
    net = network()
    a, b, c, outsider = Host(net, 1), Host(net, 2), Host(net, 3), Host(net, 4, joins=False)
    net.send(a.port, (GROUP,), b"all")
    net.run_until(1)
    assert (a.octets, b.octets, c.octets, outsider.octets) == ([], [b"all"], [b"all"], [])


def test_a_chosen_datagram_is_lost_for_one_receiver() -> None:
    trace = MemorySink()
    net = network(trace=trace)
    a, b, c = Host(net, 1), Host(net, 2), Host(net, 3)
    net.loses = lambda sender, receiver, octets: (sender, receiver, octets) == (a.prefix, b.prefix, b"first")
    for octets in (b"first", b"second"):
        net.send(a.port, (GROUP,), octets)
    net.run_until(1)
    assert (b.octets, c.octets) == ([b"second"], [b"first", b"second"])
    (lost,) = (event for event in trace.events if isinstance(event, LinkDropped))
    assert (lost.octets, lost.receiver, lost.reason) == (b"first", b.prefix, "loss")


def test_participants_of_one_host_hear_each_others_multicast() -> None:
    net = network(loss=1.0)
    a, neighbour, other = Host(net, 1), Host(net, 1, port=7412), Host(net, 2)
    net.send(a.port, (GROUP,), b"x")
    net.run_until(1)
    assert (neighbour.octets, other.octets) == ([b"x"], []), "what stays on a host does not meet the weather"


def test_nobody_listens_is_no_error() -> None:
    net = network()
    a, b = Host(net, 1), Host(net, 2)
    net.send(a.port, (Locator.udp_v4("10.0.0.9", 7410),), b"x")
    net.send(a.port, (b.locator,), b"y")
    net.close(b.locator)  # while it is under way
    net.run_until(1)
    assert (b.got, net.dropped["closed"], net.delivered) == ([], 2, 0)


def test_loss_is_about_as_often_as_asked_and_traced() -> None:
    trace = MemorySink()
    net = network(trace=trace, loss=0.3)
    a, b = Host(net, 1), Host(net, 2)
    for number in range(1000):
        net.send(a.port, (b.locator,), bytes([number & 255]))
    net.run_until(1)
    lost = trace.of(LinkDropped)
    assert len(lost) == net.dropped["loss"] == 1000 - len(b.got)
    assert 250 < len(lost) < 350
    assert (lost[0].participant, lost[0].receiver, lost[0].reason) == (a.prefix, b.prefix, "loss")


def test_duplicates_come_twice() -> None:
    trace = MemorySink()
    net = network(trace=trace, duplication=1.0)
    a, b = Host(net, 1), Host(net, 2)
    net.send(a.port, (b.locator,), b"x")
    net.run_until(1)
    assert b.octets == [b"x", b"x"]
    assert [event.copies for event in trace.of(LinkDuplicated)] == [2]


def test_jitter_alone_keeps_the_order() -> None:
    net = network(jitter=0.05)
    a, b = Host(net, 1), Host(net, 2)
    sent = [bytes([number]) for number in range(100)]
    for octets in sent:
        net.send(a.port, (b.locator,), octets)
        net.run_until(net.now + 0.001)
    net.run_until(1)
    assert b.octets == sent


def test_reordering_lets_later_ones_overtake() -> None:
    trace = MemorySink()
    net = network(trace=trace, reordering=0.2, reordering_delay=0.01)
    a, b = Host(net, 1), Host(net, 2)
    sent = [bytes([number]) for number in range(100)]
    for octets in sent:
        net.send(a.port, (b.locator,), octets)
        net.run_until(net.now + 0.001)
    net.run_until(1)
    assert b.octets != sent
    assert sorted(b.octets) == sent
    assert 5 < len(trace.of(LinkDelayed)) < 40
    held_back = {event.octets for event in trace.of(LinkDelayed)}
    assert [octets for octets in b.octets if octets not in held_back] == [o for o in sent if o not in held_back]


def test_what_is_larger_than_the_mtu_is_dropped() -> None:
    trace = MemorySink()
    net = network(trace=trace, mtu=100)
    a, b = Host(net, 1), Host(net, 2)
    net.send(a.port, (b.locator,), bytes(100))
    net.send(a.port, (b.locator,), bytes(101))
    net.run_until(1)
    assert [len(octets) for octets in b.octets] == [100]
    assert [event.reason for event in trace.of(LinkDropped)] == ["mtu"]


def test_a_partition_separates_its_sides_until_it_heals() -> None:
    net = network()
    a, b, c, d = (Host(net, number) for number in (1, 2, 3, 4))
    net.partition([a.locator.address, b.locator.address], [c.locator.address])
    net.send(a.port, (GROUP,), b"1")
    net.send(d.port, (GROUP,), b"2")
    net.run_until(1)
    assert (b.octets, c.octets, d.octets) == ([b"1"], [], [])
    assert net.dropped["partition"] == 5
    net.heal()
    net.send(a.port, (GROUP,), b"3")
    net.run_until(2)
    assert (c.octets, d.octets) == ([b"3"], [b"3"])


def test_an_unplugged_host_still_hears_itself() -> None:
    net = network()
    a, neighbour, b = Host(net, 1), Host(net, 1, port=7412), Host(net, 2)
    net.unplug(a.locator.address)
    net.send(a.port, (GROUP,), b"1")
    net.send(b.port, (a.locator,), b"2")
    net.run_until(1)
    assert (neighbour.octets, a.octets, b.octets) == ([b"1"], [], [])
    net.plug(a.locator.address)
    net.send(a.port, (GROUP,), b"3")
    net.run_until(2)
    assert b.octets == [b"3"]


def test_a_link_may_be_bad_in_one_direction() -> None:
    net = network()
    a, b = Host(net, 1), Host(net, 2)
    net.set_link(a.locator.address, b.locator.address, LinkConditions(loss=1.0))
    net.send(a.port, (b.locator,), b"there")
    net.send(b.port, (a.locator,), b"back")
    net.run_until(1)
    assert (b.octets, a.octets) == ([], [b"back"])


def test_equal_times_are_served_in_the_order_of_asking() -> None:
    net = network()
    done: list[int] = []
    for number in range(5):
        net.at(1.0, lambda number=number: done.append(number))  # type: ignore[misc]
    net.at(0.5, lambda: done.append(-1))
    net.run_until(2)
    assert done == [-1, 0, 1, 2, 3, 4]


def test_a_condition_ends_the_run_at_its_moment() -> None:
    net = network()
    net.at(1.0, lambda: None)
    net.at(3.0, lambda: None)
    assert net.run_until(10, lambda: net.now >= 1)
    assert net.now == 1.0
    assert not net.run_until(5, lambda: False)
    assert net.now == 5


def test_machines_that_talk_without_end_are_found_out() -> None:
    net = network(delay=0.0)
    a, b = Host(net, 1), Host(net, 2)
    a.port.receive = lambda octets, source: net.send(a.port, (source,), octets)
    b.port.receive = lambda octets, source: net.send(b.port, (source,), octets)
    net.send(a.port, (b.locator,), b"ping")
    with pytest.raises(SimulationStuck, match="events at"):
        net.run_until(1)


@pytest.mark.parametrize("wrong", [{"loss": 1.5}, {"duplication": -0.1}, {"delay": -1.0}, {"mtu": -1}])
def test_conditions_that_cannot_be_are_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(ValueError, match=r"probability|below 0"):
        LinkConditions(**wrong)  # type: ignore[arg-type]
