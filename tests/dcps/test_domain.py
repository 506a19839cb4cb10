"""Many participants: in one process, in several domains, under tags, ignored, and more than there are ports for."""

from __future__ import annotations

from contextlib import AsyncExitStack

import pytest
import trio

import ddsi
from tests.dcps.running import RELIABLE, Shape, config, eventually, in_trio, pair


@in_trio
async def test_three_participants_all_hear_each_other(domain: int) -> None:
    async with AsyncExitStack() as stack:
        participants = [await stack.enter_async_context(ddsi.DomainParticipant(domain)) for _ in range(3)]
        topics = [ddsi.Topic(participant, "Square", Shape) for participant in participants]
        writers = [ddsi.DataWriter(p, t, RELIABLE) for p, t in zip(participants, topics, strict=True)]
        readers = [ddsi.DataReader(p, t, RELIABLE) for p, t in zip(participants, topics, strict=True)]
        for writer, reader in zip(writers, readers, strict=True):
            await writer.wait_for_matched(3, timeout=5)
            await reader.wait_for_matched(3, timeout=5)
        for number in range(50):
            for index, writer in enumerate(writers):
                await writer.write(Shape(f"{index}", number))
        for writer in writers:
            await writer.wait_for_acknowledgments(timeout=5)
        for reader in readers:
            samples = reader.take()
            for index in range(3):
                assert [s.data.x for s in samples if s.data.color == f"{index}"] == list(range(50))
        assert all(len(participant.discovered_participants()) == 2 for participant in participants)


@in_trio
async def test_domains_do_not_meet(domain: int) -> None:
    async with (
        ddsi.DomainParticipant(domain) as one,
        ddsi.DomainParticipant(domain + 1) as other,
        ddsi.DomainParticipant(domain) as witness,
    ):
        await eventually(one.discovered_participants)
        assert [peer.guid for peer in one.discovered_participants()] == [witness.guid]
        assert other.discovered_participants() == []


@in_trio
async def test_domain_tags_do_not_meet(domain: int) -> None:
    async with (
        ddsi.DomainParticipant(domain, config=config(domain_tag="red")) as red,
        ddsi.DomainParticipant(domain, config=config(domain_tag="blue")) as blue,
    ):
        await eventually(lambda: blue.drop_counts()["domain_tag"] and red.drop_counts()["domain_tag"])
        assert red.discovered_participants() == blue.discovered_participants() == []


@in_trio
async def test_unicast_alone_is_enough(domain: int) -> None:
    async with pair(domain, multicast=False) as p:
        await p.writer.write(Shape("RED"))
        assert (await anext(p.reader)).data.color == "RED"
        (seen,) = p.here.discovered_participants()
        assert seen.metatraffic_multicast == ()


@in_trio
async def test_more_participants_than_well_known_ports_still_meet(domain: int) -> None:
    """Those that got no index take any port, and announce it."""
    async with AsyncExitStack() as stack:
        several = [
            await stack.enter_async_context(
                ddsi.DomainParticipant(domain, config=config(max_auto_participant_index=1, multicast=False))
            )
            for _ in range(4)
        ]
        for participant in several[:3]:
            await eventually(lambda seen=participant.discovered_participants: len(seen()) >= 2)  # type: ignore[misc]


@in_trio
async def test_a_participant_index_that_is_taken_is_an_error_that_says_so(domain: int) -> None:
    chosen = config(participant_index=3)
    async with ddsi.DomainParticipant(domain, config=chosen):
        with pytest.raises(ddsi.ConfigurationError, match=f"participant index 3 of domain {domain} is taken"):
            async with ddsi.DomainParticipant(domain, config=chosen):
                raise AssertionError("it was entered")


@in_trio
async def test_an_ignored_participant_is_as_if_it_were_not_there(domain: int) -> None:
    async with pair(domain) as p:
        p.there.ignore_participant(p.here.guid)
        assert p.reader.matched_publications() == []
        assert p.there.discovered_participants() == []
        await trio.sleep(0.05)
        await p.writer.write(Shape("RED"))
        await trio.sleep(0.02)
        assert [sample for sample in p.reader.take() if sample.info.valid_data] == []
        assert p.there.discovered_participants() == []


@in_trio
async def test_discovered_endpoints_tell_topic_type_and_policies(domain: int) -> None:
    async with pair(domain) as p:
        await eventually(lambda: p.there.discovered_publications() and p.here.discovered_subscriptions())
        (publication,) = p.there.discovered_publications()
        (subscription,) = p.here.discovered_subscriptions()
    assert (publication.guid, subscription.guid) == (p.writer.guid, p.reader.guid)
    assert (publication.topic_name, publication.type_name) == ("Square", "Shape")
    assert publication.qos.reliability.max_blocking_time == pytest.approx(0.1)
    assert publication.qos.is_reliable
    assert subscription.qos.is_reliable


@in_trio
async def test_a_peer_that_falls_silent_is_forgotten_after_its_lease(domain: int) -> None:
    async with (
        ddsi.DomainParticipant(domain) as peer,
        ddsi.DomainParticipant(domain, config=config(lease_duration=0.5)) as silent,
    ):
        await eventually(peer.discovered_participants)
        transport = silent._pump.transport  # type: ignore[union-attr]
        transport.send = lambda parts, locator: True  # type: ignore[method-assign]
        before = trio.current_time()
        await eventually(lambda: not peer.discovered_participants())
        assert 0.2 < trio.current_time() - before < 2


@in_trio
async def test_a_second_life_is_a_new_participant(domain: int) -> None:
    """Closed and made anew, as a program that restarts: peers match the new one at once."""
    guids = set()
    async with ddsi.DomainParticipant(domain) as peer:
        writer = ddsi.DataWriter(peer, ddsi.Topic(peer, "Square", Shape), RELIABLE)
        for number in range(5):
            async with ddsi.DomainParticipant(domain) as participant:
                guids.add(participant.guid)
                reader = ddsi.DataReader(participant, ddsi.Topic(participant, "Square", Shape), RELIABLE)
                await writer.wait_for_matched(timeout=5)
                await writer.write(Shape("RED", number))
                assert (await anext(reader)).data.x == number
            await eventually(lambda: writer.status(ddsi.PublicationMatched).current_count == 0)
    assert len(guids) == 5


@in_trio
async def test_what_is_sent_to_nobody_or_by_strangers_is_counted_by_reason(domain: int) -> None:
    async with ddsi.DomainParticipant(domain) as participant:
        sender = trio.socket.socket(trio.socket.AF_INET, trio.socket.SOCK_DGRAM)
        with sender:
            address = participant._pump.transport.unicast[0].getsockname()  # type: ignore[union-attr]
            for octets in (b"", b"no RTPS at all.........", b"RTPS\x09\x09\x01\x01" + bytes(12), b"RTPS" + bytes(3)):
                await sender.sendto(octets, address)
            await eventually(lambda: participant.drop_counts()["not_rtps"] >= 3)
        assert participant.drop_counts()["unsupported_version"] == 1
