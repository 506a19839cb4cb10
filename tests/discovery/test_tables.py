"""EndpointRegistry and ParticipantProxy: what is known of others, and where they may be sent something."""

from __future__ import annotations

import math

import pytest

from ddsi.discovery.endpoint_registry import EndpointRegistry
from ddsi.discovery.participant_proxy import ParticipantProxy
from ddsi.structure.discovered import DiscoveredParticipantData, DiscoveredReaderData
from ddsi.structure.guid import EntityId, EntityKind, Guid, GuidPrefix
from ddsi.structure.locator import Locator, LocatorKind
from ddsi.structure.qos import EndpointQos

META, USER = Locator.udp_v4("10.0.0.2", 7410), Locator.udp_v4("10.0.0.2", 7411)
ELSEWHERE = Locator.udp_v4("10.0.0.3", 7410)


def endpoint(participant: int, key: int, topic: str = "t") -> DiscoveredReaderData:
    guid = Guid.of(bytes((participant,)) * 12, EntityId.user(key, EntityKind.READER_NO_KEY))
    return DiscoveredReaderData(guid=guid, topic_name=topic, type_name="T", qos=EndpointQos())


def test_endpoints_are_found_by_guid_topic_and_participant() -> None:
    registry: EndpointRegistry[DiscoveredReaderData] = EndpointRegistry()
    first, second, third = endpoint(1, 1), endpoint(1, 2, "u"), endpoint(2, 1)
    for data in (first, second, third):
        assert registry.put(data) is None
    assert registry.get(second.guid) is second
    assert registry.of_topic("t") == [first, third]
    assert registry.of_participant(GuidPrefix(b"\1" * 12)) == [first, second]
    assert list(registry.all()) == [first, second, third]
    assert (len(registry), registry.of_topic("nothing"), registry.of_participant(GuidPrefix.UNKNOWN)) == (3, [], [])


def test_an_endpoint_announced_anew_replaces_itself() -> None:
    registry: EndpointRegistry[DiscoveredReaderData] = EndpointRegistry()
    before, after = endpoint(1, 1, "t"), endpoint(1, 1, "u")
    registry.put(before)
    assert registry.put(after) is before
    assert (registry.of_topic("t"), registry.of_topic("u"), len(registry)) == ([], [after], 1)


def test_what_is_removed_leaves_nothing_behind() -> None:
    registry: EndpointRegistry[DiscoveredReaderData] = EndpointRegistry()
    data = endpoint(1, 1)
    registry.put(data)
    assert registry.remove(data.guid) is data
    assert registry.remove(data.guid) is None
    assert (registry._by_guid, registry._by_topic, registry._by_prefix) == ({}, {}, {})


# --- ParticipantProxy -----------------------------------------------------------------------------------------------


def proxy(
    *, lease: float = 10.0, metatraffic: tuple[Locator, ...] = (META,), user: tuple[Locator, ...] = (USER,)
) -> ParticipantProxy:
    guid = Guid.of(b"\2" * 12, EntityId.PARTICIPANT)
    data = DiscoveredParticipantData(
        guid=guid, lease_duration=lease, metatraffic_unicast=metatraffic, default_unicast=user
    )
    return ParticipantProxy(data, now=5.0)


def test_a_lease_counts_from_when_it_was_last_heard() -> None:
    participant = proxy()
    assert participant.lease_due == 15.0
    participant.last_heard = 8.0
    assert participant.lease_due == 18.0
    without_end = proxy(lease=math.inf)
    assert without_end.lease_due == 105.0, "so long as it has said no more than hello"
    without_end.endpoint_count = 1
    assert without_end.lease_due == math.inf


def test_nothing_is_sent_to_a_host_that_is_only_claimed() -> None:
    """Or a stranger could point our traffic at somebody else.  Any port of a host that spoke will do."""
    participant = proxy()
    assert (participant.metatraffic, participant.user_traffic(())) == ((), ())
    assert participant.heard_from(META._replace(port=50_000))
    assert (participant.metatraffic, participant.user_traffic(())) == ((META,), (USER,))
    participant.endpoint_announced((ELSEWHERE,))
    assert participant.user_traffic((ELSEWHERE,)) == ()
    assert participant.heard_from(ELSEWHERE)
    assert participant.user_traffic((ELSEWHERE,)) == (ELSEWHERE,)
    assert not participant.heard_from(ELSEWHERE._replace(port=1)), "no news"


@pytest.mark.parametrize(
    ("announced", "expected"),
    [
        ((META, ELSEWHERE), (META,)),
        ((ELSEWHERE, META), (META,)),  # the first that can be reached
        ((ELSEWHERE,), ()),
        ((META._replace(kind=16), META), (META,)),  # shared memory of another vendor's
        ((META._replace(kind=LocatorKind.TCPV4),), ()),
    ],
)
def test_the_first_reachable_address_is_used(announced: tuple[Locator, ...], expected: tuple[Locator, ...]) -> None:
    participant = proxy(metatraffic=announced)
    participant.heard_from(META)
    assert participant.metatraffic == expected


def test_where_no_special_address_is_announced_the_general_one_serves() -> None:
    only_user, only_meta = proxy(metatraffic=()), proxy(user=())
    for participant in (only_user, only_meta):
        participant.heard_from(META)
    assert only_user.metatraffic == (USER,)
    assert only_meta.user_traffic(()) == (META,)


def test_hosts_are_bounded_and_none_that_is_announced_is_forgotten() -> None:
    """Anybody can send a datagram with somebody else's prefix; that must not make us forget where it lives."""
    participant = proxy()
    participant.heard_from(META)
    for number in range(100):
        participant.heard_from(Locator.udp_v4(f"10.9.9.{number}", 1))
    assert participant.metatraffic == (META,)
    assert len(participant._hosts) <= 8


def test_a_host_that_an_endpoint_announced_is_not_forgotten_either() -> None:
    participant = proxy()
    participant.endpoint_announced((ELSEWHERE,))
    participant.heard_from(ELSEWHERE)
    for number in range(100):
        participant.heard_from(Locator.udp_v4(f"10.9.9.{number}", 1))
    assert participant.user_traffic((ELSEWHERE,)) == (ELSEWHERE,)


def test_a_true_host_that_speaks_after_all_forged_ones_is_heard() -> None:
    participant = proxy()
    for number in range(100):
        assert not participant.heard_from(Locator.udp_v4(f"10.9.9.{number}", 1)), "nobody announced it: no news"
    assert participant.heard_from(META)
    assert participant.metatraffic == (META,)


def test_a_host_that_is_announced_after_it_spoke_is_known() -> None:
    participant = proxy()
    participant.heard_from(ELSEWHERE)
    assert participant.user_traffic((ELSEWHERE,)) == (ELSEWHERE,)
