"""What other vendors announce: each participant and endpoint in the captures, as their JSON files describe them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import pytest

from ddsi.discovery.parameters import (
    decode_key,
    decode_participant,
    decode_reader,
    decode_writer,
    encode_participant,
    encode_reader,
    encode_writer,
)
from ddsi.discovery.participant_message import AUTOMATIC_LIVELINESS_UPDATE, ParticipantMessageData
from ddsi.messages.receiver import MessageReceiver, ReceiverState
from ddsi.messages.submessages import Data
from ddsi.serialization import ParameterId
from ddsi.structure import qos_policies as p
from ddsi.structure.builtin_entity_ids import (
    PARTICIPANT_MESSAGE_WRITER,
    SEDP_PUBLICATIONS_WRITER,
    SEDP_SUBSCRIPTIONS_WRITER,
    SPDP_WRITER,
    BuiltinEndpoints,
)
from ddsi.structure.discovered import DiscoveredEndpointData, DiscoveredParticipantData
from ddsi.structure.guid import EntityId, Guid
from ddsi.structure.vendor import CYCLONE, FAST_DDS
from tests.captures.capture import PLAIN, SECURED, load

DUST_DDS = b"\x01\x14"
SEDP = {SEDP_PUBLICATIONS_WRITER: decode_writer, SEDP_SUBSCRIPTIONS_WRITER: decode_reader}
KEY_IDS = {
    SPDP_WRITER: ParameterId.PARTICIPANT_GUID,
    SEDP_PUBLICATIONS_WRITER: ParameterId.ENDPOINT_GUID,
    SEDP_SUBSCRIPTIONS_WRITER: ParameterId.ENDPOINT_GUID,
}


def changes(name: str, writer_id: EntityId) -> Iterator[tuple[Data, ReceiverState]]:
    """The DATA of one builtin writer, whichever participant sent it."""
    for datagram in load(name).datagrams:
        for submessage, state in MessageReceiver(datagram):
            if isinstance(submessage, Data) and submessage.writer_id == writer_id:
                yield submessage, state


def is_alive(data: Data) -> bool:
    return bool(data.serialized_payload) and not data.is_key


def participants(name: str) -> Iterator[DiscoveredParticipantData]:
    for data, state in changes(name, SPDP_WRITER):
        if is_alive(data):
            yield decode_participant(
                data.serialized_payload,
                source_prefix=state.source_guid_prefix,
                vendor_id=state.source_vendor_id,
                protocol_version=state.source_version,
            )


def endpoints(name: str, writer_id: EntityId) -> Iterator[DiscoveredEndpointData]:
    for data, state in changes(name, writer_id):
        if is_alive(data):
            yield SEDP[writer_id](data.serialized_payload, state.source_vendor_id)


@pytest.mark.parametrize("name", PLAIN + SECURED)
def test_participants_are_those_of_the_run(name: str) -> None:
    facts = load(name).facts
    found = {
        (data.guid.hex(), data.vendor_id.hex(), "{}.{}".format(*data.protocol_version)) for data in participants(name)
    }
    assert found == {(peer["guid"], peer["vendor_id"], peer["rtps"]) for peer in facts["guids"]}


@pytest.mark.parametrize("name", PLAIN)
def test_participants_say_how_to_reach_them(name: str) -> None:
    everyone = BuiltinEndpoints(0x3F)
    for data in participants(name):
        assert data.domain_id in (None, load(name).facts["domain"])
        assert data.builtin_endpoints & everyone == everyone
        assert 0 < data.lease_duration <= 100
        assert data.metatraffic_unicast
        assert data.default_unicast
        assert {locator.host for locator in data.metatraffic_unicast + data.default_unicast} == {"127.0.0.1"}
        # Domain 1's well-known port.  Fast DDS, given an interface by its address, leaves the group unsaid.
        assert {(locator.host, locator.port) for locator in data.metatraffic_multicast} <= {("239.255.0.1", 7650)}
        assert bool(data.metatraffic_multicast) == ("unicast" not in name and data.vendor_id != FAST_DDS)


@pytest.mark.parametrize("name", PLAIN)
@pytest.mark.parametrize("writer_id", SEDP, ids=["publications", "subscriptions"])
def test_endpoints_are_those_of_the_run(name: str, writer_id: EntityId) -> None:
    facts = load(name).facts
    found = {data.guid: data for data in endpoints(name, writer_id)}
    role = "publisher" if writer_id == SEDP_PUBLICATIONS_WRITER else "subscriber"
    # Some programs do not print their Guid; then it is one of the participants that were seen.
    printed = [peer["guid"] for peer in facts["peers"] if peer["role"] == role]
    assert len(found) == len(printed)
    owners = {data.guid.participant.hex() for data in found.values()}
    assert owners <= {peer["guid"] for peer in facts["guids"]}
    assert None in printed or owners == set(printed)

    representation = 2 if name.endswith("xcdr2") else 0
    for data in found.values():
        assert (data.topic_name, data.type_name) == (facts["topic"], facts["type"])
        assert data.is_keyed == (facts["type"] == "ShapeType")
        assert data.qos.is_reliable != name.endswith("best-effort")
        assert isinstance(data.qos.durability, p.TransientLocal)
        assert representation in data.qos.data_representation.ids
        assert (data.qos.partition, data.qos.ownership) == (p.Partition(), p.Shared())
        assert data.qos.deadline == p.Deadline()
        assert data.qos.liveliness == p.Automatic()
        if data.vendor_id == CYCLONE:
            assert isinstance(data.qos.history, p.KeepAll), "it tells, though nobody needs to know"
            assert len(data.type_information) == 100


@pytest.mark.parametrize("name", PLAIN)
def test_announcements_survive_being_announced_by_us(name: str) -> None:
    """What we understood is what we would say, but for policies that are the endpoint's own business."""
    for participant in participants(name):
        again = decode_participant(
            encode_participant(participant),
            source_prefix=participant.guid.prefix,
            vendor_id=b"\0\0",
            protocol_version=(2, 1),
        )
        assert again == participant
    for writer_id in SEDP:
        for endpoint in endpoints(name, writer_id):
            told = replace(endpoint.qos, history=p.KeepLast(1), resource_limits=p.ResourceLimits())
            expected = replace(endpoint, qos=told)
            payload = encode_writer(expected) if writer_id == SEDP_PUBLICATIONS_WRITER else encode_reader(expected)  # type: ignore[arg-type]
            assert SEDP[writer_id](payload, b"\0\0") == expected


@pytest.mark.parametrize("name", PLAIN)
def test_goodbyes_name_who_leaves(name: str) -> None:
    """Cyclone by the key in the payload, Fast DDS by the key hash alone."""
    announced = {data.guid for data in participants(name)}
    announced |= {data.guid for writer_id in SEDP for data in endpoints(name, writer_id)}
    gone: set[Guid] = set()
    for writer_id, pid in KEY_IDS.items():
        for data, state in changes(name, writer_id):
            if is_alive(data):
                continue
            assert data.inline_qos is not None
            status = data.inline_qos.get(ParameterId.STATUS_INFO)
            assert status is not None
            assert bytes(status) in (b"\0\0\0\1", b"\0\0\0\3")
            assert bool(data.serialized_payload) != (state.source_vendor_id == FAST_DDS)
            key_hash = data.inline_qos.get(ParameterId.KEY_HASH) or b""
            guid = decode_key(data.serialized_payload, pid, key_hash=key_hash)
            assert guid.prefix == state.source_guid_prefix
            gone.add(guid)
    assert gone <= announced
    # The programs with Dust DDS were ended without a word.
    vendors = {data.vendor_id for data in participants(name)}
    assert bool(gone) == (vendors != {DUST_DDS})


@pytest.mark.parametrize("name", PLAIN)
def test_participant_messages_come_from_who_they_speak_of(name: str) -> None:
    for data, state in changes(name, PARTICIPANT_MESSAGE_WRITER):
        if is_alive(data):
            message = ParticipantMessageData.decode(data.serialized_payload)
            assert (message.prefix, message.kind) == (state.source_guid_prefix, AUTOMATIC_LIVELINESS_UPDATE)


@pytest.mark.parametrize("name", SECURED)
def test_secured_participants_carry_their_tokens(name: str) -> None:
    found = list(participants(name))
    assert found
    for data in found:
        tokens = dict(data.security_parameters)
        assert tokens[ParameterId.IDENTITY_TOKEN].startswith(b"\x14\0\0\0DDS:Auth:PKI-DH:1.0\0")
        assert tokens[ParameterId.PERMISSIONS_TOKEN].startswith(b"\x1b\0\0\0DDS:Access:Permissions:1.0\0")
        assert len(tokens[ParameterId.PARTICIPANT_SECURITY_INFO]) == 8
        assert BuiltinEndpoints.PARTICIPANT_SECURE_WRITER in data.builtin_endpoints
