"""Nothing is amplified: what strangers say, and what they get for it, in octets, plain and secured.

DDS leaves it open.  The rule (docs/architecture.md, "No amplification"): a host that is announced and has not itself
spoken gets at most one SPDP for each SPDP received, and nothing else.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

import pytest

from ddsi.engine import Participant
from ddsi.messages.acknack import AckNack, NackFrag
from ddsi.messages.data import Data
from ddsi.messages.data_frag import DataFrag
from ddsi.messages.gap import Gap
from ddsi.messages.heartbeat import Heartbeat, HeartbeatFrag
from ddsi.simulation.invariants import is_announcement
from ddsi.structure import builtin_entity_ids as ids
from ddsi.structure.guid import EntityId, GuidPrefix
from ddsi.structure.locator import Locator
from ddsi.structure.qos import Qos, writer_qos
from ddsi.structure.qos_policies import KeepAll, Reliable
from ddsi.structure.sequence_number import NumberSet
from tests.engine.wire import Stranger, engine, sent
from tests.fuzz.session import Session

VICTIM = Locator.udp_v4("10.66.66.66", 7410)
ATTACKER = Locator.udp_v4("10.1.1.1", 7410)
FACTOR = 40
_LEASE = b"\x02\x00\x08\x00"
REQUESTS_FACTOR = 1200
"""Where we begin: a request with its certificate and permissions is ten times an announcement, and is repeated."""
"""Octets sent for an octet of a first announcement, at most, to a host that it came from and that says no more."""


def plain() -> Participant:
    participant = engine()
    participant.create_writer(
        "Square", "T", writer_qos(Qos(reliability=Reliable(), history=KeepAll())), 0.0, is_keyed=False
    )
    return participant


def secured() -> Participant:
    """One that has a peer already, and is authenticated by nobody else."""
    return Session.make().bob.engine


class Ledger:
    """Hears datagrams from a host, lets time pass, and keeps account of what goes where."""

    def __init__(self, participant: Participant) -> None:
        self.participant = participant
        self.now = participant.now
        self.received = 0
        self.sent: list[tuple[Locator, bytes]] = []
        sent(participant)

    def hear(self, octets: bytes, source: Locator = ATTACKER) -> None:
        self.wait(0.001)
        self.received += len(octets)
        self.participant.receive_datagram(octets, source, self.now)
        self._note()

    def wait(self, seconds: float) -> None:
        until = self.now + seconds
        while self.participant.next_deadline() <= until:
            self.now = max(self.now, self.participant.next_deadline())
            self.participant.handle_timeout(self.now)
            self._note()
        self.now = until

    def _note(self) -> None:
        for destinations, octets in sent(self.participant):
            self.sent += [(destination, octets) for destination in destinations]

    def to(self, *hosts: Locator) -> list[bytes]:
        return [octets for destination, octets in self.sent if destination.address in [host.address for host in hosts]]


# --- what they say --------------------------------------------------------------------------------------------------

BUILTIN_WRITERS = (
    ids.SEDP_PUBLICATIONS_WRITER,
    ids.SEDP_SUBSCRIPTIONS_WRITER,
    ids.PARTICIPANT_STATELESS_MESSAGE_WRITER,
)
BUILTIN_READERS = (ids.SEDP_PUBLICATIONS_READER, ids.SEDP_SUBSCRIPTIONS_READER, ids.PARTICIPANT_MESSAGE_READER)
ALL_BITS = (1 << 256) - 1


def questions(stranger: Stranger) -> Iterator[bytes]:
    """Whatever an engine might answer: each names its endpoints, known by their well-known ids, and asks for all."""
    for count in range(1, 20):
        for writer_id, reader_id in zip(BUILTIN_WRITERS, BUILTIN_READERS, strict=True):
            for said in (
                Heartbeat(EntityId.UNKNOWN, writer_id, 1, 1000, count),
                Gap(EntityId.UNKNOWN, writer_id, 1, NumberSet(500, 256, ALL_BITS)),
                HeartbeatFrag(EntityId.UNKNOWN, writer_id, 3, 1000, count),
                AckNack(reader_id, EntityId(bytes(reader_id[:3]) + b"\xc2"), NumberSet(1, 256, ALL_BITS), count),
                NackFrag(reader_id, EntityId(bytes(reader_id[:3]) + b"\xc2"), 1, NumberSet(1, 256, ALL_BITS), count),
                Data(EntityId.UNKNOWN, writer_id, count, None, b"\0\1\0\0" + bytes(40)),
                DataFrag(EntityId.UNKNOWN, writer_id, count, 1, 1, 100, 5000, None, bytes(100)),
            ):
                yield stranger.message(said.encode())


def handshakes(stranger: Stranger) -> Iterator[bytes]:
    """What Alice said before she was authenticated, in the stranger's name: her tokens are no secret."""
    for octets in Session.make().of_alice[:12]:
        yield octets[:8] + stranger.prefix + octets[20:]


@pytest.mark.parametrize("make", [plain, secured])
def test_who_never_announced_himself_gets_nothing(make: Callable[[], Participant]) -> None:
    ledger = Ledger(make())
    for said in (questions, handshakes):
        for octets in said(Stranger(77)):
            if not is_announcement(octets):
                ledger.hear(octets)
    ledger.wait(10)
    assert ledger.to(ATTACKER) == []


@pytest.mark.parametrize("make", [plain, secured])
def test_a_host_that_is_only_announced_gets_an_announcement_for_each_and_nothing_else(
    make: Callable[[], Participant],
) -> None:
    """Whatever is said in the name of the participant that announces it, handshakes too."""
    ledger = Ledger(make())
    announcements = 0
    for number in range(1, 6):
        stranger = Stranger(number)
        spdp = stranger.spdp(metatraffic_unicast=(VICTIM,), default_unicast=(VICTIM,), lease_duration=60.0)
        if make is secured:
            spdp = _with_tokens(stranger)
        for _ in range(3):
            ledger.hear(spdp)
            announcements += 1
        for said in (questions, handshakes):
            for octets in said(stranger):
                if not is_announcement(octets):
                    ledger.hear(octets)
    ledger.wait(30)
    assert all(is_announcement(octets) for octets in ledger.to(VICTIM))
    assert 0 < len(ledger.to(VICTIM)) <= announcements
    assert ledger.to(ATTACKER) == [], "it has announced nothing of its own"
    others = {destination.host for destination, _ in ledger.sent if not destination.is_multicast} - {VICTIM.host}
    assert others <= {"10.0.0.1"}, "its true peer"


def _with_tokens(stranger: Stranger) -> bytes:
    """Alice's announcement, her tokens in it, with the stranger's name and the victim's address."""
    alice = Session.make().alice
    octets = Session.make().of_alice[0]
    assert is_announcement(octets)
    mine, addresses = GuidPrefix(octets[8:20]), (alice.port.locator, alice._user_port.locator)
    octets = octets.replace(mine, stranger.prefix)
    for locator in addresses:
        octets = octets.replace(locator.address, VICTIM.address)
    return octets


@pytest.mark.parametrize("make", [plain, secured])
def test_who_has_spoken_gets_a_few_times_what_he_said(make: Callable[[], Participant]) -> None:
    """From an address that he may have forged: that much stays possible until his lease is over, and no more."""
    ledger = Ledger(make())
    for number in range(1, 6):
        stranger = Stranger(number, address=VICTIM)
        spdp = stranger.spdp(lease_duration=math.inf) if make is plain else _with_tokens(stranger)
        ledger.hear(spdp, VICTIM)
    ledger.wait(1000)
    alone = sum(map(len, ledger.to(VICTIM))) / ledger.received
    assert 0 < alone < FACTOR
    for number in range(1, 6):
        for said in (questions, handshakes):
            for octets in said(Stranger(number)):
                ledger.hear(octets, VICTIM)
    ledger.wait(120)
    assert sum(map(len, ledger.to(VICTIM))) < ledger.received


def test_who_has_spoken_and_is_asked_to_authenticate_gets_some_requests() -> None:
    """Of two participants the one with the lower Guid begins, and a stranger says which Guid he has."""
    ledger = Ledger(secured())
    stranger = Stranger(1, address=VICTIM)
    stranger.prefix = GuidPrefix(b"\xff" * 12)
    said = _with_tokens(stranger)
    lease = said.index(_LEASE) + len(_LEASE)
    ledger.hear(said[:lease] + b"\xff\xff\xff\x7f" + said[lease + 4 :], VICTIM)
    ledger.wait(100)
    in_time = sum(map(len, ledger.to(VICTIM)))
    assert ledger.received < in_time < REQUESTS_FACTOR * ledger.received
    ledger.wait(900)
    assert sum(map(len, ledger.to(VICTIM))) < in_time * 1.2, "it is given up"
