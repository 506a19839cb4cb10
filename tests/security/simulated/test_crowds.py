"""Crowds of strangers that want to be authenticated and never answer, or answer nonsense: honest ones get through.

What a stranger costs before authentication is bounded: handshakes that go on at once, what is kept of each, what is
sent to it, and how long an honest newcomer waits behind all of them.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from random import Random
from typing import cast

import pytest

from ddsi.discovery.parameters import encode_participant
from ddsi.messages.data import Data
from ddsi.simulation import Domain, Node
from ddsi.simulation.link import LinkConditions
from ddsi.simulation.network import Port
from ddsi.structure import builtin_entity_ids as ids
from ddsi.structure.guid import EntityId, Guid, GuidPrefix
from ddsi.structure.locator import Locator
from ddsi.structure.qos_policies import Properties
from ddsi_security.generic_message import AUTH, GenericMessage, MessageIdentity, write_generic_message
from ddsi_security.handshake import Handshake
from ddsi_security.service import SecurityService
from ddsi_security.tokens import DataHolder
from ddsi_security.waiting_room import MAX_HANDSHAKES, TURN_S

from .keystores import make_identities

CROWD = 2000  # twice as many as the table of participants holds


@pytest.fixture(scope="module")
def identities(tmp_path_factory: pytest.TempPathFactory) -> list[Properties]:
    return make_identities(tmp_path_factory.mktemp("keystore"), "encrypt")


class Crowd:
    """Strangers behind one address, who announce themselves to Bob in one second and receive what he sends them."""

    def __init__(self, identities: Sequence[Properties], *, low: bool, seed: int = 1) -> None:
        """``low``: their Guids are the lower ones, so that they would have to begin."""
        self.dice = Random(seed)
        self.identities = identities
        self.domain = Domain(seed)
        self.bob: Node = self.domain.node(properties=identities[1])
        self.told = 0  # how many datagrams with handshake messages
        self.port = Port(Locator.udp_v4("10.9.9.9", 7999), GuidPrefix(b"\x66" * 12), self._receive)
        self.domain.network.open(self.port)
        self.most_seated = 0
        first = b"\0" if low else b"\xff"
        self.strangers = [GuidPrefix(first + self.dice.randbytes(11)) for _ in range(CROWD)]

    def _receive(self, octets: bytes, source: Locator) -> None:
        self.told += bytes(ids.PARTICIPANT_STATELESS_MESSAGE_WRITER) in octets

    def send(self, prefix: GuidPrefix, data: Data) -> None:
        message = b"RTPS\x02\x04\x01\xdd" + prefix + data.encode()
        self.domain.network.send(self.port, [self.bob.port.locator], message)

    def announce(self, *, seconds: float = 1.0) -> None:
        where = (self.port.locator,)
        for prefix in self.strangers:
            stranger = replace(
                self.bob.engine.discovery.data,
                guid=Guid.of(prefix, EntityId.PARTICIPANT),
                metatraffic_unicast=where,
                default_unicast=where,
            )
            self.send(prefix, Data(ids.SPDP_READER, ids.SPDP_WRITER, 1, None, encode_participant(stranger)))
            self.run(seconds / CROWD)

    def speak(self) -> None:
        """Everybody says something in the shape of a request; in it is nothing that a certificate could be."""
        for number, prefix in enumerate(self.strangers):
            message = GenericMessage(
                message_identity=MessageIdentity(Guid.of(prefix, ids.PARTICIPANT_STATELESS_MESSAGE_WRITER), number),
                destination_participant_guid=self.bob.guid,
                message_class_id=AUTH,
                message_data=(DataHolder("DDS:Auth:PKI-DH:1.0+Req", (), (("c.id", self.dice.randbytes(500)),)),),
            )
            payload = write_generic_message(message)
            reader, writer = ids.PARTICIPANT_STATELESS_MESSAGE_READER, ids.PARTICIPANT_STATELESS_MESSAGE_WRITER
            self.send(prefix, Data(reader, writer, number + 1, None, payload))

    def run(self, seconds: float) -> None:
        self.domain.run(seconds)
        self.most_seated = max(self.most_seated, len(self.hooks._desk._room._seats))

    @property
    def hooks(self) -> SecurityService:
        return cast(SecurityService, self.bob.engine.hooks)

    def time_until_admitted(self, newcomer: Node, limit: float) -> float:
        """How many seconds pass until Bob and the newcomer have admitted each other."""
        begun = self.domain.now
        assert self.domain.run_until(lambda: are_introduced(self.bob, newcomer), limit), "they never are"
        return self.domain.now - begun

    def is_bounded(self) -> bool:
        most = self.bob.engine.config.max_participants
        room = self.hooks._desk._room
        return (
            self.most_seated <= MAX_HANDSHAKES
            and len(self.hooks._remotes) <= most
            and room.waiting_count <= most
            and len(self.hooks._desk._jobs) <= MAX_HANDSHAKES
            and len(self.hooks._desk._timers) <= 4 * most
            and all(len(handshake._exchanges) <= 1 for handshake in self._waiting_handshakes())
        )

    def _waiting_handshakes(self) -> Iterator[Handshake]:
        for remote in self.hooks._remotes.values():
            if remote.handshake is not None and not self.hooks._desk._room.is_seated(remote.guid):
                yield remote.handshake


def are_introduced(first: Node, second: Node) -> bool:
    pairs = ((first, second), (second, first))
    return all(
        (proxy := one.engine.participants.get(other.guid.prefix)) is not None and proxy.is_admitted
        for one, other in pairs
    )


@pytest.mark.parametrize("low", [False, True])
def test_a_silent_crowd_does_not_delay_an_honest_pair(identities: list[Properties], low: bool) -> None:
    """Who speaks has a seat as soon as the next turn is over."""
    crowd = Crowd(identities, low=low)
    crowd.announce()
    alice = crowd.domain.node(properties=identities[0])
    assert crowd.time_until_admitted(alice, 30.0) <= 2 * TURN_S
    carol = crowd.domain.node(properties=identities[2])
    assert crowd.time_until_admitted(carol, 30.0) <= 2 * TURN_S
    assert crowd.is_bounded()


@pytest.mark.slow
def test_a_crowd_that_talks_nonsense_delays_it_by_a_bounded_time(identities: list[Properties]) -> None:
    crowd = Crowd(identities, low=True)
    crowd.announce()
    crowd.speak()
    crowd.run(0.1)
    alice = crowd.domain.node(properties=identities[0])
    table = crowd.bob.engine.config.max_participants
    assert crowd.time_until_admitted(alice, 60.0) <= 2 * TURN_S * table / MAX_HANDSHAKES
    assert crowd.is_bounded()


@pytest.mark.slow
def test_what_a_silent_crowd_is_sent_is_bounded(identities: list[Properties]) -> None:
    """A stranger that only announced itself, perhaps in the name of a third, must not bring a flood upon it."""
    crowd = Crowd(identities, low=False)
    crowd.announce()
    crowd.told = 0
    crowd.run(8.0)
    times_said_in_a_turn, datagrams = 5, 4
    assert 0 < crowd.told <= (8.0 / TURN_S + 1) * MAX_HANDSHAKES * times_said_in_a_turn * datagrams
    assert crowd.is_bounded()


def test_with_fewer_seats_fewer_go_on_at_once(identities: list[Properties]) -> None:
    few = [dict(properties, **{"dds.sec.auth.max_handshakes": "2"}) for properties in identities]
    crowd = Crowd(few, low=False)
    crowd.strangers = crowd.strangers[:50]
    crowd.announce(seconds=0.1)
    crowd.run(1.0)
    assert crowd.most_seated == 2
    assert crowd.time_until_admitted(crowd.domain.node(properties=few[0]), 30.0) <= 2 * TURN_S


def test_honest_ones_with_a_seat_each_do_not_wait_for_each_other_in_a_circle(identities: list[Properties]) -> None:
    """Each may have given its seat to one whose own is taken: what is said meanwhile is kept, and turns end.

    A tenth of all messages is lost, and an answer takes a tenth of a second.
    """
    domain = Domain(6, conditions=LinkConditions(loss=0.1, delay=0.05, jitter=0.02))
    single = [dict(properties, **{"dds.sec.auth.max_handshakes": "1"}) for properties in identities]
    nodes = [domain.node(properties=properties) for properties in 2 * single]
    pairs = [(first, second) for first in nodes for second in nodes if first is not second]
    assert domain.run_until(lambda: all(are_introduced(*pair) for pair in pairs), 60.0)
