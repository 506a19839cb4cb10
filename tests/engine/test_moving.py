"""A network that changes under a participant: where it is reached, how large its messages are, and who is told."""

from __future__ import annotations

from ddsi.engine import Participant
from ddsi.structure.cache_change import ChangeKind
from ddsi.structure.locator import Locator
from ddsi.structure.qos import Qos, writer_qos
from ddsi.structure.qos_policies import KeepAll, Reliable

from . import wire

RELIABLE = Qos(reliability=Reliable(), history=KeepAll())
NEW_ADDRESS = Locator.udp_v4("10.0.0.99", 7410)
NEW_GROUP = Locator.udp_v4("239.255.0.1", 7650)


def move(engine: Participant, now: float, *, max_message_octets: int = 1452) -> None:
    engine.network_changed(
        unicast=(NEW_ADDRESS,),
        multicast=(NEW_GROUP,),
        announce_to=(NEW_GROUP,),
        max_message_octets=max_message_octets,
        now=now,
    )


def test_who_is_reached_elsewhere_says_so_to_all_and_at_once() -> None:
    engine, stranger = wire.engine(), wire.Stranger()
    stranger.introduce(engine)
    move(engine, 100.0)
    engine.handle_timeout(100.0)
    announced = [(destinations, octets) for destinations, octets in wire.sent(engine) if NEW_ADDRESS.address in octets]
    assert {locator for destinations, _ in announced for locator in destinations} >= {NEW_GROUP, stranger.address}
    assert engine.discovery.data.metatraffic_unicast == engine.discovery.data.default_unicast == (NEW_ADDRESS,)


def test_who_is_reached_elsewhere_announces_as_at_the_start() -> None:
    """Nobody knows when others can hear us: a switch, or their own interface, may take a while."""
    engine = wire.engine()
    engine.handle_timeout(60.0)
    now = 100.0
    move(engine, now)
    moments: list[float] = []
    while (now := engine.next_deadline()) < 103.0:
        engine.handle_timeout(now)
        if any(NEW_GROUP in destinations for destinations, _ in wire.sent(engine)):
            moments.append(now)
    assert len(moments) == 5  # at once, and 0.1, 0.3, 0.7 and 1.5 seconds later


def test_messages_fit_the_interfaces_that_are_there_now() -> None:
    engine, stranger = wire.engine(), wire.Stranger()
    writer = engine.create_writer("Square", "T", writer_qos(RELIABLE), 0.0, is_keyed=False)
    stranger.introduce(engine)
    engine.receive_datagram(stranger.sedp_reader(qos=RELIABLE), stranger.address, 1.0)
    for octets in 9000, 600:
        move(engine, 2.0, max_message_octets=octets)
        engine.drain_effects()
        engine.write(writer, ChangeKind.ALIVE, bytes(20_000), b"", 2.0)
        sizes = [len(datagram) for destinations, datagram in wire.sent(engine) if stranger.address in destinations]
        assert octets - 200 < max(sizes) <= octets


def test_one_that_moves_is_followed_with_all_matches() -> None:
    """It speaks from its new address, and announces it; nothing ends."""
    engine, stranger = wire.engine(), wire.Stranger()
    writer = engine.create_writer("Square", "T", writer_qos(RELIABLE), 0.0, is_keyed=False)
    stranger.introduce(engine)
    engine.receive_datagram(stranger.sedp_reader(qos=RELIABLE), stranger.address, 1.0)
    engine.drain_effects()
    moved = wire.Stranger(address=NEW_ADDRESS)
    engine.receive_datagram(moved.spdp(), NEW_ADDRESS, 2.0)
    engine.drain_effects()
    engine.write(writer, ChangeKind.ALIVE, bytes(20), b"", 3.0)
    assert [destinations for destinations, _ in wire.sent(engine)] == [(NEW_ADDRESS,)]
