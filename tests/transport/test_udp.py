"""UdpTransport: which interfaces, which ports, who is announced to, and what happens to a datagram."""

from __future__ import annotations

import itertools
import os
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import pytest

from ddsi.config import Config
from ddsi.structure.errors import ConfigurationError
from ddsi.structure.locator import Locator
from ddsi.transport.platform import Interface, can_mark, list_interfaces
from ddsi.transport.udp import UdpTransport, _choose

LOOPBACK = Interface("lo", "127.0.0.1", "255.0.0.0", 65536, is_loopback=True)
ETHERNET = Interface("eth7", "192.0.2.5", "255.255.255.0", 1500, is_loopback=False)  # TEST-NET-1, RFC 5737
SECOND = Interface("eth8", "198.51.100.5", "255.255.255.0", 1500, is_loopback=False)  # TEST-NET-2
_counter = itertools.count()


@pytest.fixture
def domain() -> int:
    return (os.getpid() + next(_counter)) % 100


@contextmanager
def opened(domain: int, **settings: Any) -> Iterator[UdpTransport]:
    transport = UdpTransport(domain, Config(**{"interfaces": ("lo",), **settings}), lambda: [LOOPBACK, ETHERNET])
    try:
        yield transport
    finally:
        transport.close()


# --- interfaces ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["lo", "127.0.0.1"])
def test_an_interface_is_chosen_by_name_or_address(domain: int, name: str) -> None:
    with opened(domain, interfaces=(name,)) as transport:
        assert transport.interfaces == [LOOPBACK]


def test_an_interface_that_is_not_there_is_named_beside_those_that_are(domain: int) -> None:
    with pytest.raises(ConfigurationError, match=r"'wlan9'.*lo \(127\.0\.0\.1\), eth7 \(192\.0\.2\.5\)"):
        UdpTransport(domain, Config(interfaces=("wlan9",)), lambda: [LOOPBACK, ETHERNET])


def test_by_default_all_but_loopback_are_used_and_loopback_when_it_is_alone() -> None:
    assert _choose([LOOPBACK, ETHERNET, SECOND], ()) == [ETHERNET, SECOND]
    assert _choose([LOOPBACK], ()) == [LOOPBACK]


def test_interfaces_are_chosen_in_the_order_given_and_once() -> None:
    chosen = _choose([LOOPBACK, ETHERNET, SECOND], ("eth8", "lo", "198.51.100.5"))
    assert chosen == [SECOND, LOOPBACK]


def test_without_any_interface_there_is_no_transport(domain: int) -> None:
    with pytest.raises(ConfigurationError, match="not even loopback"):
        UdpTransport(domain, Config(), list)


def test_the_platform_knows_its_loopback_interface() -> None:
    (loopback,) = [interface for interface in list_interfaces() if interface.address == "127.0.0.1"]
    assert loopback.is_loopback
    assert loopback.reaches("127.8.9.10")
    assert not loopback.reaches("192.0.2.1")


# --- ports -----------------------------------------------------------------------------------------------


def test_the_first_free_participant_index_is_taken(domain: int) -> None:
    """RTPS 2.5 §9.6.2.3: 7400 + 250 * domain + 10 + 2 * index."""
    with opened(domain) as first, opened(domain) as second:
        assert (first.participant_index, second.participant_index) == (0, 1)
        assert (first.port, second.port) == (7400 + 250 * domain + 10, 7400 + 250 * domain + 12)
        assert first.unicast_locators() == (Locator.udp_v4("127.0.0.1", first.port),)


def test_beyond_the_last_index_any_port_will_do(domain: int) -> None:
    with opened(domain, max_auto_participant_index=0), opened(domain, max_auto_participant_index=0) as late:
        assert late.participant_index is None
        assert late.port > 0


def test_no_index_takes_any_port(domain: int) -> None:
    with opened(domain, participant_index="none") as transport:
        assert transport.participant_index is None
        assert transport.port != 7400 + 250 * domain + 10


def test_a_given_index_is_taken_or_refused(domain: int) -> None:
    with opened(domain, participant_index=5) as transport:
        assert transport.participant_index == 5
        with pytest.raises(ConfigurationError, match="index 5"), opened(domain, participant_index=5):
            pass


def test_the_multicast_port_is_shared_by_all_of_a_domain(domain: int) -> None:
    with opened(domain) as first, opened(domain) as second:
        assert first.multicast_locators() == second.multicast_locators()
        assert first.multicast_locators() == (Locator.udp_v4("239.255.0.1", 7400 + 250 * domain),)


def test_without_multicast_there_is_no_multicast_socket(domain: int) -> None:
    with opened(domain, multicast=False) as transport:
        assert transport.multicast is None
        assert transport.multicast_locators() == ()
        assert all(not locator.is_multicast for locator in transport.announce_to())


# --- who is announced to ---------------------------------------------------------------------------------


def test_on_loopback_every_well_known_port_is_announced_to_but_our_own(domain: int) -> None:
    with opened(domain, max_auto_participant_index=3) as transport:
        ports = [locator.port for locator in transport.announce_to() if locator.host == "127.0.0.1"]
    base = 7400 + 250 * domain + 10
    assert ports == [base + 2, base + 4, base + 6]


def test_peers_are_announced_to_at_their_port_or_at_every_index(domain: int) -> None:
    peers = ("192.0.2.9:7777", "192.0.2.10", "239.255.0.7")
    with opened(domain, peers=peers, multicast=False, max_auto_participant_index=1) as transport:
        base = 7400 + 250 * domain
        assert [(locator.host, locator.port) for locator in transport.announce_to()] == [
            ("192.0.2.9", 7777), ("192.0.2.10", base + 10), ("192.0.2.10", base + 12), ("239.255.0.7", base),
        ]  # fmt: skip


def test_a_peer_whose_name_means_nothing_is_an_error(domain: int) -> None:
    with (
        opened(domain, peers=("no-such-host.invalid",)) as transport,
        pytest.raises(ConfigurationError, match="no-such"),
    ):
        transport.announce_to()


def test_messages_are_large_on_loopback_and_as_configured(domain: int) -> None:
    with opened(domain) as transport:
        assert transport.max_message_octets == 65_000
    with opened(domain, max_message_size=1452) as transport:
        assert transport.max_message_octets == 1452


# --- datagrams -------------------------------------------------------------------------------------------


def received(transport: UdpTransport) -> bytes:
    sock = transport.unicast[0]
    sock.settimeout(2)
    try:
        return sock.recv(65536)
    finally:
        sock.setblocking(False)


@pytest.mark.parametrize("sizes", [(1,), (10, 20), (1000, 5000, 3), (1,) * 600, (5,) * 1000])
def test_the_parts_of_a_datagram_arrive_as_one(domain: int, sizes: tuple[int, ...]) -> None:
    parts = [bytes([index & 0xFF]) * size for index, size in enumerate(sizes)]
    with opened(domain) as sender, opened(domain) as receiver:
        assert sender.send(parts, Locator.udp_v4("127.0.0.1", receiver.port))
        assert received(receiver) == b"".join(parts)


def test_multicast_reaches_everybody_on_the_interface(domain: int) -> None:
    with opened(domain) as sender, opened(domain) as receiver:
        (group,) = sender.multicast_locators()
        assert sender.send([b"to all"], group)
        assert receiver.multicast is not None
        receiver.multicast.settimeout(2)
        octets, (host, port) = receiver.multicast.recvfrom(100)
        assert (octets, host, port) == (b"to all", "127.0.0.1", sender.port)


@pytest.mark.parametrize(
    "locator",
    [
        Locator.udp_v4("192.0.2.77", 7400),  # another network: no chosen interface reaches it
        Locator.udp_v4("127.0.0.1", 0),
        Locator.udp_v4("0.0.0.0", 7400),
        Locator(16, 7400, bytes(16)),  # a vendor's own kind
    ],
)
def test_what_cannot_be_reached_is_dropped_and_not_tried_again(domain: int, locator: Locator) -> None:
    class Refusing:
        def sendto(self, *arguments: object) -> None:
            raise AssertionError("something was sent")

        sendmsg = sendto

    with opened(domain) as transport:
        sockets, transport.unicast = transport.unicast, [Refusing()]  # type: ignore[list-item]
        assert transport.send([b"octets"], locator)
        transport.unicast = sockets


def test_nothing_is_sent_beside_the_chosen_interface(domain: int) -> None:
    """With loopback alone chosen, a peer's announced address elsewhere has no route."""
    with opened(domain) as transport:
        assert transport._route(Locator.udp_v4("198.51.100.7", 7410))[1] == ()


def test_nobody_listening_is_no_error(domain: int) -> None:
    with opened(domain) as transport:
        for _ in range(3):  # the second one meets the ICMP answer to the first
            assert transport.send([b"octets"], Locator.udp_v4("127.0.0.1", 1))


def test_a_full_buffer_says_which_socket_is_blocked(domain: int) -> None:
    class Full:
        def sendto(self, *arguments: object) -> None:
            raise BlockingIOError

    with opened(domain) as transport:
        sockets, full = transport.unicast, Full()
        transport.unicast = [full]  # type: ignore[list-item]
        assert not transport.send([b"octets"], Locator.udp_v4("127.0.0.1", 7410))
        assert transport.blocked is full  # type: ignore[comparison-overlap]
        transport.unicast = sockets


def test_the_tables_of_addresses_are_bounded(domain: int) -> None:
    """Strangers choose source addresses, and peers what they announce."""
    with opened(domain) as transport:
        for port in range(1, 3000):
            transport.locator_of(("127.0.0.1", port))
        assert len(transport._locators) <= 1024
        for port in range(1, 6000):
            transport._route(Locator.udp_v4("127.0.0.1", port))
        assert len(transport._by_locator) <= 4096


# --- interfaces that come and go -------------------------------------------------------------------------

ANOTHER = Interface("lo", "127.0.0.2", "255.0.0.0", 65536, is_loopback=True)


@contextmanager
def moving(domain: int, there: list[Interface], **settings: Any) -> Iterator[UdpTransport]:
    """A transport on a host whose interfaces are what the list holds at the time."""
    transport = UdpTransport(domain, Config(**{"interfaces": ("lo",), **settings}), lambda: list(there))
    try:
        yield transport
    finally:
        transport.close()


def hears_multicast(transport: UdpTransport) -> bool:
    (group,) = transport.multicast_locators()
    assert transport.send([b"to all"], group)
    assert transport.multicast is not None
    transport.multicast.settimeout(2)
    try:
        return transport.multicast.recv(100) == b"to all"
    finally:
        transport.multicast.setblocking(False)


def test_nothing_is_done_when_nothing_has_changed(domain: int) -> None:
    with opened(domain) as transport:
        assert transport.refresh() is None


def test_an_interface_that_returns_is_used_as_before(domain: int) -> None:
    """Meanwhile its socket waits; then it is time to be heard again."""
    there = [LOOPBACK]
    with moving(domain, there) as transport:
        locators, (sock,) = transport.unicast_locators(), transport.unicast
        there.clear()
        assert transport.refresh() is None
        assert transport.unicast_locators() == locators
        there.append(replace(LOOPBACK, index=7))  # as after it was made anew
        change = transport.refresh()
        assert change is not None
        assert (change.opened, change.abandoned) == ([], [])
        assert (transport.unicast_locators(), transport.unicast) == (locators, [sock])
        assert hears_multicast(transport)
        assert transport.refresh() is None


def test_an_address_that_comes_is_used_at_the_same_port(domain: int) -> None:
    there = [LOOPBACK]
    with moving(domain, there) as transport:
        port = transport.port
        there.append(ANOTHER)
        change = transport.refresh()
        assert change is not None
        assert (change.opened, change.abandoned) == ([transport.unicast[1]], [])
        assert transport.unicast_locators() == (Locator.udp_v4("127.0.0.1", port), Locator.udp_v4("127.0.0.2", port))


def test_an_address_that_goes_is_announced_no_more(domain: int) -> None:
    there = [LOOPBACK, ANOTHER]
    with moving(domain, there) as transport:
        port, (_, second) = transport.port, transport.unicast
        there.remove(ANOTHER)
        change = transport.refresh()
        assert change is not None
        assert (change.opened, change.abandoned) == ([], [second])
        assert transport.unicast_locators() == (Locator.udp_v4("127.0.0.1", port),)
        assert hears_multicast(transport)
        second.close()


def test_a_host_that_moves_is_reached_at_its_new_address(domain: int) -> None:
    there = [LOOPBACK]
    with moving(domain, there) as transport, opened(domain) as other:
        there[:] = [ANOTHER]
        change = transport.refresh()
        assert change is not None
        for sock in change.abandoned:
            sock.close()
        (here,) = transport.unicast_locators()
        assert here.host == "127.0.0.2"
        assert other.send([b"moved?"], here)
        assert received(transport) == b"moved?"


def test_where_somebody_took_our_port_another_one_is_announced(domain: int) -> None:
    there = [LOOPBACK]
    with moving(domain, there) as transport, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as squatter:
        squatter.bind(("127.0.0.2", transport.port))
        there.append(ANOTHER)
        assert transport.refresh() is not None
        first, second = transport.unicast_locators()
        assert second.port not in (0, first.port)


def test_a_host_that_loses_its_network_talks_to_itself_until_it_returns(domain: int) -> None:
    """The rule of the start holds at any time: all but loopback, or loopback when it is alone."""
    wireless = Interface("wlan0", "127.0.0.2", "255.255.255.0", 1500, is_loopback=False)
    there = [LOOPBACK, wireless]
    with moving(domain, there, interfaces=()) as transport:
        assert (transport.interfaces, transport.max_message_octets) == ([wireless], 1472)
        for now_there, octets in ([LOOPBACK], 65_000), ([LOOPBACK, wireless], 1472):
            there[:] = now_there
            change = transport.refresh()
            assert change is not None
            for sock in change.abandoned:
                sock.close()
            assert (transport.interfaces, transport.max_message_octets) == ([now_there[-1]], octets)


def test_multicast_begins_where_the_first_interface_had_none(domain: int) -> None:
    there = [LOOPBACK]
    with moving(domain, there, multicast_address="239.255.0.9") as transport:
        assert transport.multicast is not None
        transport.multicast.close()
        transport.multicast = None
        there.append(ANOTHER)
        change = transport.refresh()
        assert change is not None
        assert transport.multicast in change.opened


def test_names_of_peers_are_looked_up_once(domain: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """A name server that went with the network must not hold up what is still there."""
    with opened(domain, peers=("localhost",)) as transport:
        before = transport.announce_to()
        monkeypatch.setattr(socket, "gethostbyname", None)
        assert transport.announce_to() == before


def test_closing_closes_every_socket(domain: int) -> None:
    with opened(domain) as transport:
        sockets = transport.sockets()
        assert len(sockets) == 2
    assert all(sock.fileno() == -1 for sock in sockets)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as again:
        again.bind(("127.0.0.1", 7400 + 250 * domain + 10))


# --- priority --------------------------------------------------------------------------------------------


@pytest.mark.skipif(not can_mark, reason="this system cannot mark single datagrams")
@pytest.mark.parametrize(("priority", "dscp"), [(0, 0), (-4, 0), (10, 10), (63, 63), (1000, 63)])
def test_a_transport_priority_is_the_datagrams_dscp(domain: int, priority: int, dscp: int) -> None:
    """DDS 1.4 §2.2.3.15, RFC 2474."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as receiver, opened(domain) as transport:
        receiver.bind(("127.0.0.1", 0))
        receiver.settimeout(5)
        receiver.setsockopt(socket.IPPROTO_IP, socket.IP_RECVTOS, 1)
        locator = Locator.udp_v4("127.0.0.1", receiver.getsockname()[1])
        assert transport.send_marked([b"two ", b"parts"], locator, priority)
        octets, ancillary, _, _ = receiver.recvmsg(100, 100)
        assert octets == b"two parts"
        ((_, _, service),) = ancillary
        assert service[0] >> 2 == dscp
