"""SPDP says the same again and again: that is noticed by its octets, and only what is new is read."""

from __future__ import annotations

from dataclasses import replace

from ddsi.simulation import Domain, Node
from ddsi.structure.guid import GuidPrefix
from ddsi.trace.reasons import LossReason
from tests.engine.steps import steps_of


def announcement_of(domain: Domain, node: Node) -> bytes:
    """What it multicasts when nothing else is to be said."""
    heard: list[bytes] = []

    def watch(sender: GuidPrefix, octets: bytes) -> None:
        if sender == node.guid.prefix:
            heard.append(octets)

    domain.network.watch = watch
    domain.run(30)
    domain.network.watch = None
    assert heard[-1] == heard[-2]
    return heard[-1]


def hear(listener: Node, node: Node, octets: bytes) -> int:
    return steps_of(lambda: listener.engine.receive_datagram(octets, node.port.locator, listener.now))


def test_the_same_again_is_not_read() -> None:
    domain = Domain()
    node, listener, newcomer = domain.node(), domain.node(), domain.node()
    octets = announcement_of(domain, node)
    again = hear(listener, node, octets)
    newcomer.engine.discovery.participant_lost(node.guid, LossReason.GOODBYE, domain.now)
    first = hear(newcomer, node, octets)
    assert again * 5 < first


def test_a_changed_announcement_is_read_and_so_is_the_return_to_the_former() -> None:
    domain = Domain()
    node, listener = domain.node(), domain.node()
    before = announcement_of(domain, node)
    discovery = node.engine.discovery
    discovery.announce_change(replace(discovery.data, user_data=b"changed"), domain.now)
    node.pump()
    domain.run(1)
    assert listener.engine.participants[node.guid.prefix].data.user_data == b"changed"
    hear(listener, node, before)
    assert listener.engine.participants[node.guid.prefix].data.user_data == b""


def test_the_same_from_another_vendor_is_read() -> None:
    """What the message's header says counts where the announcement itself says nothing."""
    domain = Domain()
    node, listener = domain.node(), domain.node()
    octets = announcement_of(domain, node)
    again = hear(listener, node, octets)
    assert hear(listener, node, octets[:6] + b"\x01\x10" + octets[8:]) > again * 2


def test_a_lease_is_renewed_by_the_same_again() -> None:
    domain = Domain()
    node, listener = domain.node(), domain.node()
    octets = announcement_of(domain, node)
    lease = listener.engine.participants[node.guid.prefix].data.lease_duration
    node.kill()
    domain.run(lease * 0.6)
    hear(listener, node, octets)
    domain.run(lease * 0.6)
    assert node.guid.prefix in listener.engine.participants
    domain.run(lease)
    assert node.guid.prefix not in listener.engine.participants
