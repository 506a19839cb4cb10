"""What strangers can make us do and hold: nothing is amplified, every table has its bound, and they are counted."""

from __future__ import annotations

import pytest

from ddsi.config import Config
from ddsi.engine import Participant
from ddsi.messages.data import Data
from ddsi.messages.header import Header
from ddsi.messages.heartbeat import Heartbeat
from ddsi.messages.interpreter import InfoSource
from ddsi.simulation.invariants import is_announcement
from ddsi.structure import builtin_entity_ids as ids
from ddsi.structure.guid import EntityId
from ddsi.structure.locator import Locator
from ddsi.structure.qos import Qos, writer_qos
from ddsi.structure.qos_policies import Reliable
from ddsi.structure.vendor import PROTOCOL_VERSION
from ddsi.trace.reasons import DropReason
from tests.engine.wire import GROUP, OUR_ADDRESS, VENDOR, Stranger, engine, sent

VICTIM = Locator.udp_v4("10.66.66.66", 7410)
RELIABLE = Qos(reliability=Reliable())


def timeouts(participant: Participant, until: float) -> list[tuple[tuple[Locator, ...], bytes]]:
    """Let its clock run; all that it sends meanwhile."""
    out = sent(participant)
    while participant.next_deadline() <= until:
        participant.handle_timeout(participant.next_deadline())
        out += sent(participant)
    return out


# --- no amplification -----------------------------------------------------------------------------------------------


def test_a_host_that_is_only_announced_gets_one_announcement_and_nothing_else() -> None:
    """A stranger announces somebody else's address: no heartbeat, no ACKNACK, no endpoint data goes there."""
    participant = engine()
    stranger = Stranger(address=Locator.udp_v4("10.1.1.1", 7410))
    octets = stranger.spdp(metatraffic_unicast=(VICTIM,), default_unicast=(VICTIM,))
    participant.receive_datagram(octets, stranger.address, 0.0)
    participant.create_writer("Square", "T", writer_qos(RELIABLE), 0.0, is_keyed=False)
    to_victim = [octets for destinations, octets in timeouts(participant, 15.0) if VICTIM in destinations]
    assert len(to_victim) == 1
    assert is_announcement(to_victim[0])


def test_the_same_announcement_again_is_not_answered_again() -> None:
    participant = engine()
    stranger = Stranger(address=Locator.udp_v4("10.1.1.1", 7410))
    for _ in range(100):
        octets = stranger.spdp(metatraffic_unicast=(VICTIM,), default_unicast=(VICTIM,))
        participant.receive_datagram(octets, stranger.address, 0.0)
    assert sum(VICTIM in destinations for destinations, _ in sent(participant)) == 1


def test_invented_participants_get_no_more_announcements_than_they_sent() -> None:
    participant = engine()
    for number in range(300):
        stranger = Stranger(number, address=Locator.udp_v4("10.1.1.1", 7410))
        octets = stranger.spdp(metatraffic_unicast=(VICTIM,) * 16, default_unicast=(VICTIM,) * 16)
        participant.receive_datagram(octets, stranger.address, number * 0.001)
    to_victim = [octets for destinations, octets in timeouts(participant, 15.0) if VICTIM in destinations]
    assert len(to_victim) <= 300
    assert all(is_announcement(octets) for octets in to_victim)


def test_many_addresses_in_one_announcement_get_one_answer() -> None:
    participant = engine()
    stranger = Stranger()
    claimed = tuple(Locator.udp_v4(f"10.66.0.{number}", 7410) for number in range(1, 17))
    participant.receive_datagram(stranger.spdp(metatraffic_unicast=claimed), stranger.address, 0.0)
    assert sum(len(destinations) for destinations, _ in timeouts(participant, 0.05)) == 1


def test_who_spoke_from_any_port_of_its_host_is_talked_to() -> None:
    participant = engine()
    stranger = Stranger()
    participant.receive_datagram(stranger.spdp(), stranger.address._replace(port=40_000), 0.0)
    kinds = {octets[20 + 16] for destinations, octets in sent(participant) if destinations == (stranger.address,)}
    assert len(kinds) > 1, "an announcement, heartbeats and ACKNACKs"


def test_an_unknown_multicast_address_is_never_sent_to() -> None:
    """Only the group that we were told is announced to; a stranger cannot name another."""
    participant = engine()
    stranger = Stranger()
    elsewhere = Locator.udp_v4("239.1.2.3", 9999)
    octets = stranger.spdp(metatraffic_multicast=(elsewhere,), default_multicast=(elsewhere,))
    participant.receive_datagram(octets, stranger.address, 0.0)
    destinations = {locator for each, _ in timeouts(participant, 10.0) for locator in each}
    assert destinations == {GROUP, stranger.address}


def test_our_own_announcement_that_comes_back_is_not_a_participant() -> None:
    """Multicast loops back; and somebody may send it back with an INFO_SRC in front."""
    participant = engine()
    ourselves = Stranger()
    ourselves.prefix = participant.guid.prefix
    ourselves.guid = participant.guid
    participant.receive_datagram(ourselves.spdp(), OUR_ADDRESS, 0.0)
    disguised = (
        Header(PROTOCOL_VERSION, VENDOR, Stranger(9).prefix).encode()
        + InfoSource(PROTOCOL_VERSION, VENDOR, participant.guid.prefix).encode()
        + ourselves.spdp()[20:]
    )
    participant.receive_datagram(disguised, VICTIM, 0.0)
    assert participant.participants == {}
    assert participant.drops[DropReason.OWN_MESSAGE] == 2
    assert sent(participant) == []


# --- bounds and eviction --------------------------------------------------------------------------------------------


def test_invented_participants_fill_their_table_and_no_more() -> None:
    participant = engine(config=Config(max_participants=50))
    for number in range(500):
        stranger = Stranger(number)
        participant.receive_datagram(stranger.spdp(), stranger.address, number * 0.0001)
        participant.drain_effects()
    assert len(participant.participants) == 50
    assert participant.drops[DropReason.TABLE_FULL_PARTICIPANTS] == 450
    for behavior in (writer.behavior for writer in participant.local_writers.values()):
        assert len(behavior.readers) <= 50


def test_a_flood_of_participants_displaces_its_own_kind() -> None:
    """Those that have endpoints stay; among the others the longest silent goes, once it has been silent a while."""
    participant = engine(config=Config(max_participants=20))
    friend = Stranger(1000)
    friend.introduce(participant)
    participant.receive_datagram(friend.sedp_writer(), friend.address, 0.0)
    for number in range(400):
        stranger = Stranger(number)
        participant.receive_datagram(stranger.spdp(), stranger.address, number * 0.1)
        participant.drain_effects()
    assert friend.prefix in participant.participants
    assert len(participant.known_writers) == 1
    assert len(participant.participants) == 20
    newest = Stranger(399).prefix
    assert newest in participant.participants, "an honest newcomer gets in too"


def test_a_full_table_is_not_searched_for_every_datagram_of_a_flood() -> None:
    participant = engine(config=Config(max_participants=20))
    searches = 0
    original = participant.discovery._eviction.idle_participant

    def counted(now: float) -> object:
        nonlocal searches
        before = participant.discovery._eviction._nobody_until
        found = original(now)
        searches += found is not None or participant.discovery._eviction._nobody_until != before
        return found

    participant.discovery._eviction.idle_participant = counted  # type: ignore[method-assign,assignment]
    for number in range(2000):
        stranger = Stranger(number)
        participant.receive_datagram(stranger.spdp(), stranger.address, number * 0.0001)
    assert searches <= 2


def _announce(participant: Participant, stranger: Stranger, keys: range, topic: str = "t", now: float = 0.0) -> None:
    for key in keys:
        participant.receive_datagram(stranger.sedp_writer(key, topic), stranger.address, now)
        participant.receive_datagram(stranger.sedp_reader(key, topic), stranger.address, now)
    participant.drain_effects()


def test_invented_endpoints_fill_their_table_and_no_more() -> None:
    participant = engine(config=Config(max_endpoints=100))
    stranger = Stranger()
    stranger.introduce(participant)
    _announce(participant, stranger, range(1, 200))
    assert len(participant.known_writers) + len(participant.known_readers) == 100
    assert participant.drops[DropReason.TABLE_FULL_ENDPOINTS] == 298
    assert participant.participants[stranger.prefix].endpoint_count == 100


def test_who_announced_most_gives_way_to_others() -> None:
    """And the endpoints that we work with go last."""
    participant = engine(config=Config(max_endpoints=100))
    writer = participant.create_writer("Square", "T", writer_qos(RELIABLE), 0.0, is_keyed=False)
    greedy, modest = Stranger(1), Stranger(2)
    greedy.introduce(participant)
    modest.introduce(participant)
    participant.receive_datagram(greedy.sedp_reader(1, "Square"), greedy.address, 0.0)
    _announce(participant, greedy, range(2, 200))
    _announce(participant, modest, range(1, 10))
    counts = [participant.participants[stranger.prefix].endpoint_count for stranger in (greedy, modest)]
    assert counts == [82, 18]
    assert len(participant.known_writers) + len(participant.known_readers) == 100
    assert list(writer.behavior.readers) == [greedy.endpoint(1, is_writer=False)]
    _announce(participant, modest, range(10, 200))
    counts = [participant.participants[stranger.prefix].endpoint_count for stranger in (greedy, modest)]
    assert sum(counts) == 100
    assert abs(counts[0] - counts[1]) <= 2, "each has its share"


def test_endpoints_of_others_cannot_be_announced() -> None:
    participant = engine()
    stranger, other = Stranger(1), Stranger(2)
    stranger.introduce(participant)
    other.introduce(participant)
    octets = stranger.sedp_writer(of=other.endpoint(1, is_writer=True))
    participant.receive_datagram(octets, stranger.address, 0.0)
    assert len(participant.known_writers) == 0
    assert participant.drops[DropReason.MALFORMED_DISCOVERY_DATA] == 1


def test_a_goodbye_is_believed_of_its_own_sender_only() -> None:
    participant = engine()
    one, other = Stranger(1), Stranger(2)
    one.introduce(participant)
    other.introduce(participant)
    forged = Header(PROTOCOL_VERSION, VENDOR, one.prefix).encode() + other.goodbye()[20:]
    participant.receive_datagram(forged, one.address, 1.0)
    assert len(participant.participants) == 2
    participant.receive_datagram(other.goodbye(), other.address, 1.0)
    assert list(participant.participants) == [one.prefix]


def test_what_is_announced_again_and_again_takes_no_more_room() -> None:
    participant = engine()
    stranger = Stranger()
    stranger.introduce(participant)
    for number in range(200):
        participant.receive_datagram(stranger.spdp(entity_name=str(number)), stranger.address, 1.0)
        participant.receive_datagram(stranger.sedp_writer(1, f"topic {number}"), stranger.address, 1.0)
    assert len(participant.participants) == 1
    assert participant.participants[stranger.prefix].endpoint_count == 1
    assert [data.topic_name for data in participant.known_writers.all()] == ["topic 199"]
    assert participant.known_writers.of_topic("topic 3") == []


def test_a_thousand_participants_that_come_and_go_leave_nothing_behind() -> None:
    participant = engine()
    writer = participant.create_writer("Square", "T", writer_qos(RELIABLE), 0.0, is_keyed=False)
    for number in range(300):
        now = number * 0.01
        stranger = Stranger(number)
        stranger.introduce(participant, now)
        participant.receive_datagram(stranger.sedp_reader(1, "Square"), stranger.address, now)
        participant.receive_datagram(stranger.sedp_writer(2, "Square"), stranger.address, now)
        participant.receive_datagram(stranger.goodbye(), stranger.address, now)
        participant.drain_effects()
    assert participant.participants == {}
    assert participant.remote_writers == {}
    assert (len(participant.known_writers), len(participant.known_readers)) == (0, 0)
    assert writer.behavior.readers == {}
    assert writer.matched.total_count == 300
    assert participant.matchmaker.refusals == {}
    assert participant.defrag_budget._members == {}
    timers = participant.alarms._timers
    timeouts(participant, 10.0)
    assert len(timers) < 20
    assert len(timers._heap) < 200


def test_a_participant_that_is_ignored_stays_so() -> None:
    participant = engine()
    stranger = Stranger()
    stranger.introduce(participant)
    participant.discovery.ignore(stranger.guid, 1.0)
    assert participant.participants == {}
    participant.receive_datagram(stranger.spdp(), stranger.address, 2.0)
    assert participant.participants == {}
    assert participant.drops[DropReason.IGNORED] == 1


@pytest.mark.parametrize(
    ("octets", "reason"),
    [
        (b"", DropReason.NOT_RTPS),
        (b"RTPS", DropReason.NOT_RTPS),
        (b"\0" * 100, DropReason.NOT_RTPS),
        (b"RTPX\2\5" + bytes(50), DropReason.NOT_RTPS),
        (b"RTPS\1\0" + b"\1\x55" + b"p" * 12, DropReason.UNSUPPORTED_VERSION),
        (Stranger().message(b"\x15\x05\x08\0" + bytes(8)), DropReason.MALFORMED_MESSAGE),
        (Stranger().message(Data(EntityId.UNKNOWN, ids.SPDP_WRITER, 1, None, b"\0\3\0\0").encode()),
         DropReason.MALFORMED_DISCOVERY_DATA),
        (Stranger().message(Data(EntityId.UNKNOWN, EntityId(b"\0\0\1\3"), 1, None, b"\0\1\0\0").encode()),
         DropReason.UNKNOWN_PARTICIPANT),
        (Stranger().spdp(domain_id=7), DropReason.WRONG_DOMAIN),
        (Stranger().spdp(domain_tag="x"), DropReason.DOMAIN_TAG),
    ],
)  # fmt: skip
def test_what_is_dropped_is_counted_by_its_reason(octets: bytes, reason: DropReason) -> None:
    participant = engine()
    participant.receive_datagram(octets, Stranger().address, 0.0)
    assert participant.drops == {reason: 1}
    assert sent(participant) == []
    assert participant.participants == {}


def test_what_stands_before_the_broken_submessage_is_processed() -> None:
    """RTPS 2.5 §8.3.4.1: the rest of the message is dropped, not what was fine."""
    participant = engine()
    stranger = Stranger()
    participant.receive_datagram(stranger.spdp() + b"\x07\x01\x04\0" + bytes(4), stranger.address, 0.0)
    assert list(participant.participants) == [stranger.prefix]
    assert participant.drops == {DropReason.MALFORMED_MESSAGE: 1}


def test_submessages_for_others_are_skipped() -> None:
    participant = engine()
    stranger = Stranger()
    octets = stranger.directed(Stranger(5).prefix, stranger.spdp()[20:])
    participant.receive_datagram(octets, stranger.address, 0.0)
    assert participant.participants == {}
    octets = stranger.directed(participant.guid.prefix, stranger.spdp()[20:])
    participant.receive_datagram(octets, stranger.address, 0.0)
    assert list(participant.participants) == [stranger.prefix]


def test_heartbeats_for_all_readers_of_a_stranger_are_not_answered_before_it_is_known() -> None:
    participant = engine()
    stranger = Stranger()
    beat = Heartbeat(EntityId.UNKNOWN, ids.SEDP_PUBLICATIONS_WRITER, 1, 5, 1).encode()
    participant.receive_datagram(stranger.message(beat), stranger.address, 0.0)
    assert sent(participant) == []
    assert participant.drops == {DropReason.UNKNOWN_PARTICIPANT: 1}


def test_what_a_known_participant_says_by_a_writer_it_never_announced_is_counted_so() -> None:
    participant = engine()
    stranger = Stranger()
    participant.receive_datagram(
        stranger.directed(participant.guid.prefix, stranger.spdp()[20:]), stranger.address, 0.0
    )
    beat = Heartbeat(EntityId.UNKNOWN, EntityId(b"\0\0\1\2"), 1, 5, 1).encode()
    participant.receive_datagram(stranger.message(beat), stranger.address, 0.0)
    assert participant.drops == {DropReason.UNKNOWN_WRITER: 1}
