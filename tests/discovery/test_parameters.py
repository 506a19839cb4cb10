"""Announcements as parameter lists: octets, defaults, every policy, both byte orders, and what strangers may not do."""

from __future__ import annotations

import contextlib
import math
import struct
from dataclasses import fields, replace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ddsi.discovery.endpoint_parameters import MAX_NAME_LENGTH
from ddsi.discovery.parameter_values import MAX_LOCATORS, MAX_PROPERTIES
from ddsi.discovery.parameters import (
    decode_key,
    decode_participant,
    decode_reader,
    decode_writer,
    encode_key,
    encode_participant,
    encode_reader,
    encode_writer,
    participant_parameters,
    read_participant,
)
from ddsi.discovery.qos_parameters import MAX_PARTITIONS
from ddsi.serialization import MustUnderstandUnknown, ParameterId, ParameterList
from ddsi.structure import qos_policies as p
from ddsi.structure.builtin_entity_ids import BuiltinEndpoints
from ddsi.structure.discovered import (
    ContentFilterProperty,
    DiscoveredParticipantData,
    DiscoveredReaderData,
    DiscoveredWriterData,
)
from ddsi.structure.errors import MalformedMessage
from ddsi.structure.guid import EntityId, Guid, GuidPrefix
from ddsi.structure.locator import Locator, LocatorKind
from ddsi.structure.qos import EndpointQos
from ddsi.structure.vendor import CYCLONE, OPENDDS

PID = ParameterId
PREFIX = GuidPrefix(bytes.fromhex("01dd0102030405060708090a"))
PARTICIPANT = Guid.of(PREFIX, EntityId.PARTICIPANT)
WRITER = Guid.of(PREFIX, b"\x00\x00\x01\x02")
READER = Guid.of(PREFIX, b"\x00\x00\x02\x07")
UNICAST = Locator.udp_v4("127.0.0.1", 7410)
MULTICAST = Locator.udp_v4("239.255.0.1", 7400)
IPV6 = Locator(LocatorKind.UDPV6, 7410, bytes(15) + b"\1")
XCDR1 = p.DataRepresentation(p.DataRepresentationId.XCDR1)


def participant(payload: bytes, *, vendor_id: bytes = CYCLONE) -> DiscoveredParticipantData:
    return decode_participant(payload, source_prefix=PREFIX, vendor_id=vendor_id, protocol_version=(2, 1))


def payload_of(*parameters: tuple[int, str], little_endian: bool = True) -> bytes:
    """A PL_CDR payload with these values, given as hexadecimal octets."""
    made = ParameterList([(pid, bytes.fromhex(value)) for pid, value in parameters], little_endian=little_endian)
    return bytes((0, 3 if little_endian else 2, 0, 0)) + made.encode()


def parameters_in(payload: bytes) -> ParameterList:
    return ParameterList.decode(payload, little_endian=True, start=4)[0]


def string(text: str, *, little_endian: bool = True) -> str:
    octets = text.encode() + b"\0"
    return (struct.pack("<I" if little_endian else ">I", len(octets)) + octets).hex()


# --- participants ----------------------------------------------------------------------------------------

FULL_PARTICIPANT = DiscoveredParticipantData(
    guid=PARTICIPANT,
    vendor_id=b"\x01\xdd",
    protocol_version=(2, 4),
    domain_id=7,
    domain_tag="lab",
    metatraffic_unicast=(UNICAST,),
    metatraffic_multicast=(MULTICAST,),
    default_unicast=(UNICAST, IPV6),
    default_multicast=(MULTICAST,),
    builtin_endpoints=BuiltinEndpoints(0xFC3F),
    builtin_endpoint_qos=1,
    lease_duration=10.0,
    manual_liveliness_count=3,
    entity_name="p",
    user_data=b"abc",
    properties=(("a", p.Property("b", propagate=True)), ("c", p.BinaryProperty(b"d", propagate=True))),
    security_parameters=((0x1005, bytes.fromhex("07000080 3f000080")),),
)
GUID_HEX = "01dd0102030405060708090a 000001c1"
UNICAST_LE = "01000000 f21c0000 000000000000000000000000 7f000001"
UNICAST_BE = "00000001 00001cf2 000000000000000000000000 7f000001"
MULTICAST_LE = "01000000 e81c0000 000000000000000000000000 efff0001"
MULTICAST_BE = "00000001 00001ce8 000000000000000000000000 efff0001"
# One parameter a line, in the order in which they are sent: id, value in little and in big endian.
FULL_PARTICIPANT_OCTETS: list[tuple[int, str, str]] = [
    (0x0015, "02040000", "02040000"),
    (0x0016, "01dd0000", "01dd0000"),
    (0x0050, GUID_HEX, GUID_HEX),
    (0x0058, "3ffc0000", "0000fc3f"),
    (0x0077, "01000000", "00000001"),
    (0x000F, "07000000", "00000007"),
    (0x4014, "04000000 6c616200", "00000004 6c616200"),
    (0x0002, "0a000000 00000000", "0000000a 00000000"),
    (0x0032, UNICAST_LE, UNICAST_BE),
    (0x0033, MULTICAST_LE, MULTICAST_BE),
    (0x0031, UNICAST_LE, UNICAST_BE),
    (0x0031, "02000000 f21c0000 00" + "00" * 14 + "01", "00000002 00001cf2 00" + "00" * 14 + "01"),
    (0x0048, MULTICAST_LE, MULTICAST_BE),
    (0x0034, "03000000", "00000003"),
    (0x0062, "02000000 70000000", "00000002 70000000"),
    (0x002C, "03000000 61626300", "00000003 61626300"),
    (
        0x0059,
        """01000000  02000000 61000000  02000000 62000000
           01000000  02000000 63000000  01000000 64000000""",
        """00000001  00000002 61000000  00000002 62000000
           00000001  00000002 63000000  00000001 64000000""",
    ),
    (0x1005, "07000080 3f000080", "80000007 8000003f"),
]


def test_participant_is_written_as_these_octets() -> None:
    octets = bytes.fromhex("00030000")
    for pid, little, _ in FULL_PARTICIPANT_OCTETS:
        octets += struct.pack("<HH", pid, len(bytes.fromhex(little))) + bytes.fromhex(little)
    assert encode_participant(FULL_PARTICIPANT) == octets + bytes.fromhex("01000000")


def test_participant_is_read_in_either_byte_order() -> None:
    little = payload_of(*((pid, value) for pid, value, _ in FULL_PARTICIPANT_OCTETS))
    big = payload_of(*((pid, value) for pid, _, value in FULL_PARTICIPANT_OCTETS), little_endian=False)
    assert participant(little) == participant(big) == FULL_PARTICIPANT


def test_participant_that_says_little_has_the_defaults() -> None:
    assert participant(payload_of((PID.PARTICIPANT_GUID, GUID_HEX))) == DiscoveredParticipantData(
        guid=PARTICIPANT,
        vendor_id=CYCLONE,
        protocol_version=(2, 1),
        builtin_endpoints=BuiltinEndpoints(0x3F),
        lease_duration=100.0,
    )


def test_what_has_no_meaning_is_not_sent() -> None:
    """A tag must be understood, so that an empty one would only frighten; secrets are not for the wire."""
    sent = parameters_in(encode_participant(DiscoveredParticipantData(guid=PARTICIPANT)))
    assert [pid for pid, _ in sent] == [
        PID.PROTOCOL_VERSION,
        PID.VENDORID,
        PID.PARTICIPANT_GUID,
        PID.BUILTIN_ENDPOINT_SET,
        PID.PARTICIPANT_LEASE_DURATION,
    ]


def test_only_propagated_properties_are_sent() -> None:
    data = DiscoveredParticipantData(
        guid=PARTICIPANT,
        properties=(
            ("dds.sec.auth.private_key", p.Property("secret")),
            ("octets", p.BinaryProperty(b"secret")),
            ("name", p.Property("public", propagate=True)),
        ),
    )
    octets = encode_participant(data)
    assert b"secret" not in octets
    assert participant(octets).properties == (("name", p.Property("public", propagate=True)),)
    assert PID.PROPERTY_LIST not in [
        pid for pid, _ in parameters_in(encode_participant(replace(data, properties=data.properties[:2])))
    ]


@pytest.mark.parametrize(
    "name",
    [
        "dds.sec.auth.password",
        "dds.sec.auth.builtin.PKI-DH.private_key",
        "dds.sec.crypto.keysize",
        "org.eclipse.cyclonedds.sec.auth.crl",
        "com.rti.serv.secure.authentication.private_key_file",
    ],
)
@pytest.mark.parametrize("kind", [p.Property, p.BinaryProperty])
def test_what_configures_security_is_not_sent_though_somebody_asks_for_it(
    name: str, kind: type[p.Property | p.BinaryProperty]
) -> None:
    value = p.Property("secret", propagate=True) if kind is p.Property else p.BinaryProperty(b"secret", propagate=True)
    octets = encode_participant(DiscoveredParticipantData(guid=PARTICIPANT, properties=((name, value),)))
    assert b"secret" not in octets
    assert name.encode() not in octets


def test_participant_data_without_encapsulation_in_big_endian() -> None:
    """As the handshake of DDS Security carries it (c.pdata), the plugins' own parameters turned round too."""
    octets = participant_parameters(FULL_PARTICIPANT, little_endian=False).encode()
    made, _ = ParameterList.decode(octets, little_endian=False)
    read = read_participant(made, source_prefix=PREFIX, vendor_id=CYCLONE, protocol_version=(2, 1))
    assert read == FULL_PARTICIPANT


@pytest.mark.parametrize(
    "guid",
    ["01dd0102030405060708090b 000001c1", "01dd0102030405060708090a 000001c2"],
    ids=["another", "no participant"],
)
def test_nobody_speaks_for_others(guid: str) -> None:
    with pytest.raises(MalformedMessage, match="PARTICIPANT_GUID"):
        participant(payload_of((PID.PARTICIPANT_GUID, guid)))


def test_participant_without_guid_is_malformed() -> None:
    with pytest.raises(MalformedMessage, match="PARTICIPANT_GUID: is missing"):
        participant(payload_of((PID.DOMAIN_ID, "00000000")))


def test_properties_of_a_peer_that_knows_only_text() -> None:
    value = "01000000" + "02000000 61000000" + "02000000 62000000"
    read = participant(payload_of((PID.PARTICIPANT_GUID, GUID_HEX), (PID.PROPERTY_LIST, value)))
    assert read.properties == (("a", p.Property("b", propagate=True)),)


def test_old_opendds_counts_nanoseconds() -> None:
    lease = (PID.PARTICIPANT_LEASE_DURATION, "05000000 0065cd1d")  # 500 000 000
    payload = payload_of((PID.PARTICIPANT_GUID, GUID_HEX), lease)
    assert participant(payload, vendor_id=OPENDDS).lease_duration == 5.5
    assert participant(payload).lease_duration == pytest.approx(5.1164, abs=1e-4)
    infinite = payload_of((PID.PARTICIPANT_GUID, GUID_HEX), (PID.PARTICIPANT_LEASE_DURATION, "ffffff7f ffffff7f"))
    assert participant(infinite, vendor_id=OPENDDS).lease_duration == math.inf


# --- locators --------------------------------------------------------------------------------------------


def locators_read(*locators: Locator, pid: int = PID.DEFAULT_UNICAST_LOCATOR) -> tuple[Locator, ...]:
    values = [(pid, struct.pack("<iI16s", *locator).hex()) for locator in locators]
    read = participant(payload_of((PID.PARTICIPANT_GUID, GUID_HEX), *values))
    return read.default_unicast + read.default_multicast


@pytest.mark.parametrize(
    "locator",
    [
        Locator(-1, 7400, UNICAST.address),
        Locator(0, 7400, UNICAST.address),
        Locator(LocatorKind.TCPV4, 7400, UNICAST.address),
        Locator(0x1000000, 7400, UNICAST.address),
        Locator.udp_v4("127.0.0.1", 0),
        Locator.udp_v4("127.0.0.1", 65536),
        Locator.udp_v4("0.0.0.0", 7400),
        Locator.udp_v4("255.255.255.255", 7400),
        Locator(LocatorKind.UDPV6, 7400, bytes(16)),
        MULTICAST,
        Locator(LocatorKind.UDPV6, 7400, b"\xff\x02" + bytes(13) + b"\x01"),
    ],
    ids=str,
)
def test_unicast_locator_that_cannot_be_sent_to_is_ignored(locator: Locator) -> None:
    assert locators_read(locator, UNICAST) == (UNICAST,)


@pytest.mark.parametrize("locator", [UNICAST, IPV6, Locator.udp_v4("0.0.0.0", 7400)], ids=str)
def test_multicast_locator_that_names_no_group_is_ignored(locator: Locator) -> None:
    assert locators_read(locator, MULTICAST, pid=PID.DEFAULT_MULTICAST_LOCATOR) == (MULTICAST,)


def test_octets_before_an_ipv4_address_do_not_make_it_another() -> None:
    untidy = UNICAST._replace(address=b"\xee" * 12 + UNICAST.address[12:])
    assert locators_read(untidy, UNICAST) == (UNICAST,)


def test_number_of_locators_is_bounded() -> None:
    many = [Locator.udp_v4("127.0.0.1", port) for port in range(1, MAX_LOCATORS + 20)]
    assert locators_read(*many) == tuple(many[:MAX_LOCATORS])


# --- endpoints -------------------------------------------------------------------------------------------

WRITER_HEX, READER_HEX = WRITER.hex(), READER.hex()
LEAST_WRITER = [(PID.ENDPOINT_GUID, WRITER_HEX), (PID.TOPIC_NAME, string("Square")), (PID.TYPE_NAME, string("Shape"))]
LEAST_READER = [(PID.ENDPOINT_GUID, READER_HEX), *LEAST_WRITER[1:]]


def writer_of(*parameters: tuple[int, str]) -> DiscoveredWriterData:
    return decode_writer(payload_of(*LEAST_WRITER, *parameters), CYCLONE)


def reader_of(*parameters: tuple[int, str], vendor_id: bytes = CYCLONE) -> DiscoveredReaderData:
    return decode_reader(payload_of(*LEAST_READER, *parameters), vendor_id)


def test_writer_that_says_little_has_the_defaults_of_writers() -> None:
    assert writer_of() == DiscoveredWriterData(
        guid=WRITER,
        topic_name="Square",
        type_name="Shape",
        vendor_id=CYCLONE,
        qos=EndpointQos(reliability=p.Reliable(0.1), data_representation=XCDR1),
    )


def test_reader_that_says_little_has_the_defaults_of_readers() -> None:
    assert reader_of() == DiscoveredReaderData(
        guid=READER,
        topic_name="Square",
        type_name="Shape",
        vendor_id=CYCLONE,
        qos=EndpointQos(reliability=p.BestEffort(0.1), data_representation=XCDR1),
    )


# field of EndpointQos, parameter, policy, little-endian octets, big-endian octets
POLICIES: list[tuple[str, ParameterId, Any, str, str]] = [
    ("reliability", PID.RELIABILITY, p.BestEffort(0.1), "01000000 00000000 9a999919", "00000001 00000000 1999999a"),
    ("reliability", PID.RELIABILITY, p.Reliable(math.inf), "02000000 ffffff7f ffffffff", "00000002 7fffffff ffffffff"),
    ("durability", PID.DURABILITY, p.Volatile(), "00000000", "00000000"),
    ("durability", PID.DURABILITY, p.TransientLocal(), "01000000", "00000001"),
    ("durability", PID.DURABILITY, p.Transient(), "02000000", "00000002"),
    ("durability", PID.DURABILITY, p.Persistent(), "03000000", "00000003"),
    ("deadline", PID.DEADLINE, p.Deadline(), "ffffff7f ffffffff", "7fffffff ffffffff"),
    ("deadline", PID.DEADLINE, p.Deadline(1.5), "01000000 00000080", "00000001 80000000"),
    ("latency_budget", PID.LATENCY_BUDGET, p.LatencyBudget(2.0), "02000000 00000000", "00000002 00000000"),
    ("liveliness", PID.LIVELINESS, p.Automatic(), "00000000 ffffff7f ffffffff", "00000000 7fffffff ffffffff"),
    (
        "liveliness",
        PID.LIVELINESS,
        p.ManualByParticipant(3.0),
        "01000000 03000000 00000000",
        "00000001 00000003 00000000",
    ),
    ("liveliness", PID.LIVELINESS, p.ManualByTopic(0.5), "02000000 00000000 00000080", "00000002 00000000 80000000"),
    ("ownership", PID.OWNERSHIP, p.Shared(), "00000000", "00000000"),
    ("ownership", PID.OWNERSHIP, p.Exclusive(), "01000000", "00000001"),
    ("destination_order", PID.DESTINATION_ORDER, p.ByReceptionTimestamp(), "00000000", "00000000"),
    ("destination_order", PID.DESTINATION_ORDER, p.BySourceTimestamp(), "01000000", "00000001"),
    (
        "presentation",
        PID.PRESENTATION,
        p.Presentation(p.AccessScope.GROUP, ordered_access=True),
        "02000000 00010000",
        "00000002 00010000",
    ),
    (
        "presentation",
        PID.PRESENTATION,
        p.Presentation(p.AccessScope.TOPIC, coherent_access=True),
        "01000000 01000000",
        "00000001 01000000",
    ),
    (
        "partition",
        PID.PARTITION,
        p.Partition("a", "x*"),
        "02000000  02000000 61000000  03000000 782a0000",
        "00000002  00000002 61000000  00000003 782a0000",
    ),
    ("partition", PID.PARTITION, p.Partition(""), "01000000 01000000 00000000", "00000001 00000001 00000000"),
    ("user_data", PID.USER_DATA, p.UserData(b"abc"), "03000000 61626300", "00000003 61626300"),
    ("topic_data", PID.TOPIC_DATA, p.TopicData(b"abcd"), "04000000 61626364", "00000004 61626364"),
    ("group_data", PID.GROUP_DATA, p.GroupData(b"\0"), "01000000 00000000", "00000001 00000000"),
    (
        "data_tags",
        PID.DATA_TAGS,
        p.DataTags(("a", "x"), ("b", "")),
        "02000000  02000000 61000000  02000000 78000000  02000000 62000000  01000000 00000000",
        "00000002  00000002 61000000  00000002 78000000  00000002 62000000  00000001 00000000",
    ),
    ("entity_name", PID.ENTITY_NAME, "me", "03000000 6d650000", "00000003 6d650000"),
    ("data_representation", PID.DATA_REPRESENTATION, XCDR1, "01000000 00000000", "00000001 00000000"),
    (
        "data_representation",
        PID.DATA_REPRESENTATION,
        p.DataRepresentation(p.DataRepresentationId.XCDR2, p.DataRepresentationId.XCDR1),
        "02000000 02000000",
        "00000002 00020000",
    ),
    (
        "data_representation",
        PID.DATA_REPRESENTATION,
        p.DataRepresentation(p.DataRepresentationId.XCDR2, p.DataRepresentationId.XML, p.DataRepresentationId.XCDR1),
        "03000000 0200 0100 0000 0000",
        "00000003 0002 0001 0000 0000",
    ),
]
WRITER_POLICIES: list[tuple[str, ParameterId, Any, str, str]] = [
    ("lifespan", PID.LIFESPAN, p.Lifespan(4.0), "04000000 00000000", "00000004 00000000"),
    ("ownership_strength", PID.OWNERSHIP_STRENGTH, p.OwnershipStrength(-2), "feffffff", "fffffffe"),
    ("transport_priority", PID.TRANSPORT_PRIORITY, p.TransportPriority(5), "05000000", "00000005"),
    (
        "durability_service",
        PID.DURABILITY_SERVICE,
        p.DurabilityService(),
        "00000000 00000000  00000000 01000000  ffffffff ffffffff ffffffff",
        "00000000 00000000  00000000 00000001  ffffffff ffffffff ffffffff",
    ),
    (
        "durability_service",
        PID.DURABILITY_SERVICE,
        p.DurabilityService(1.0, p.KeepAll(), 10, 11, 12),
        "01000000 00000000  01000000 01000000  0a000000 0b000000 0c000000",
        "00000001 00000000  00000001 00000001  0000000a 0000000b 0000000c",
    ),
]
READER_POLICIES: list[tuple[str, ParameterId, Any, str, str]] = [
    ("time_based_filter", PID.TIME_BASED_FILTER, p.TimeBasedFilter(0.25), "00000000 00000040", "00000000 40000000"),
    (
        "type_consistency",
        PID.TYPE_CONSISTENCY,
        p.TypeConsistency(0, False, False, False, True, True),
        "0000 0000000101 00",
        "0000 0000000101 00",
    ),
    (
        "type_consistency",
        PID.TYPE_CONSISTENCY,
        p.TypeConsistency(1, False, True, True, True, False),
        "0100 0001010100 00",
        "0001 0001010100 00",
    ),
]


@pytest.mark.parametrize(("name", "pid", "policy", "little", "big"), POLICIES + WRITER_POLICIES)
def test_policy_of_a_writer(name: str, pid: ParameterId, policy: object, little: str, big: str) -> None:
    changed: dict[str, Any] = {name: policy}
    expected = replace(writer_of(), qos=replace(writer_of().qos, **changed))
    assert decode_writer(payload_of(*LEAST_WRITER, (pid, little)), CYCLONE) == expected
    assert decode_writer(big_endian(WRITER, (pid, big)), CYCLONE) == expected
    assert bytes(parameters_in(encode_writer(expected)).get(pid) or b"") == bytes.fromhex(little)


@pytest.mark.parametrize(("name", "pid", "policy", "little", "big"), POLICIES + READER_POLICIES)
def test_policy_of_a_reader(name: str, pid: ParameterId, policy: object, little: str, big: str) -> None:
    changed: dict[str, Any] = {name: policy}
    expected = replace(reader_of(), qos=replace(reader_of().qos, **changed))
    assert decode_reader(payload_of(*LEAST_READER, (pid, little)), CYCLONE) == expected
    assert decode_reader(big_endian(READER, (pid, big)), CYCLONE) == expected
    assert bytes(parameters_in(encode_reader(expected)).get(pid) or b"") == bytes.fromhex(little)


def big_endian(guid: Guid, *parameters: tuple[int, str]) -> bytes:
    least = [
        (PID.ENDPOINT_GUID, guid.hex()),
        (PID.TOPIC_NAME, string("Square", little_endian=False)),
        (PID.TYPE_NAME, string("Shape", little_endian=False)),
    ]
    return payload_of(*least, *parameters, little_endian=False)


def test_every_policy_that_peers_compare_is_in_the_tables() -> None:
    tested = {row[0] for row in POLICIES + WRITER_POLICIES + READER_POLICIES}
    local = {"history", "resource_limits", "writer_data_lifecycle", "reader_data_lifecycle", "properties"}
    assert tested | local == {item.name for item in fields(EndpointQos)}


def test_policies_are_sent_even_where_they_are_the_default() -> None:
    common = [
        PID.ENDPOINT_GUID,
        PID.PARTICIPANT_GUID,
        PID.PROTOCOL_VERSION,
        PID.VENDORID,
        PID.TOPIC_NAME,
        PID.TYPE_NAME,
        PID.RELIABILITY,
        PID.DURABILITY,
        PID.DEADLINE,
        PID.LATENCY_BUDGET,
        PID.LIVELINESS,
        PID.OWNERSHIP,
        PID.DESTINATION_ORDER,
        PID.PRESENTATION,
    ]
    writer = DiscoveredWriterData(guid=WRITER, topic_name="T", type_name="U", qos=EndpointQos())
    reader = DiscoveredReaderData(guid=READER, topic_name="T", type_name="U", qos=EndpointQos())
    assert [pid for pid, _ in parameters_in(encode_writer(writer))] == [
        *common,
        PID.LIFESPAN,
        PID.OWNERSHIP_STRENGTH,
        PID.DURABILITY_SERVICE,
    ]
    assert [pid for pid, _ in parameters_in(encode_reader(reader))] == [*common, PID.TIME_BASED_FILTER]


def test_endpoint_with_everything_round_trips() -> None:
    common: dict[str, Any] = {
        "topic_name": "Größe",
        "type_name": "a::B",
        "vendor_id": b"\x01\xdd",
        "unicast": (UNICAST, IPV6),
        "multicast": (MULTICAST,),
        "type_information": bytes(range(96)),
        "security_parameters": ((0x1004, bytes(8)), (0x1013, bytes(4))),
        "qos": replace(
            EndpointQos(),
            data_representation=XCDR1,
            properties={
                "a": p.Property("b", propagate=True),
                "c": p.BinaryProperty(b"d", propagate=True),
            },
        ),
    }
    writer = DiscoveredWriterData(guid=WRITER, max_serialized_size=1000, **common)
    assert decode_writer(encode_writer(writer), CYCLONE) == writer
    content_filter = ContentFilterProperty(
        content_filtered_topic_name="Filtered",
        related_topic_name="Größe",
        filter_class_name="DDSSQL",
        filter_expression="x > %0",
        expression_parameters=("1", ""),
    )
    reader = DiscoveredReaderData(guid=READER, content_filter=content_filter, **common)
    assert decode_reader(encode_reader(reader), CYCLONE) == reader


def test_nothing_is_sent_that_a_peer_might_choke_on() -> None:
    """No parameter of a vendor's own, none that must be understood, and never EXPECTS_INLINE_QOS."""
    reader = DiscoveredReaderData(
        guid=READER,
        topic_name="T",
        type_name="U",
        expects_inline_qos=True,
        qos=replace(EndpointQos(), history=p.KeepAll()),
    )
    for payload in (encode_reader(reader), encode_participant(replace(FULL_PARTICIPANT, domain_tag=""))):
        pids = [pid for pid, _ in parameters_in(payload)]
        assert max(pids) < 0x4000
        assert not {PID.EXPECTS_INLINE_QOS, PID.HISTORY, PID.RESOURCE_LIMITS} & set(pids)


def test_peer_may_tell_what_is_its_own_business() -> None:
    qos = writer_of((PID.HISTORY, "01000000 00000000"), (PID.RESOURCE_LIMITS, "0a000000 00000000 ffffffff")).qos
    assert (qos.history, qos.resource_limits) == (p.KeepAll(), p.ResourceLimits(max_samples=10))
    assert writer_of((PID.HISTORY, "00000000 00000000")).qos.history == p.KeepLast(1)


def test_expects_inline_qos_is_read() -> None:
    assert reader_of((PID.EXPECTS_INLINE_QOS, "01000000")).expects_inline_qos
    assert not reader_of((PID.EXPECTS_INLINE_QOS, "00000000")).expects_inline_qos


def test_type_information_of_a_big_endian_list_is_left() -> None:
    assert writer_of((PID.TYPE_INFORMATION, "01020304")).type_information == b"\1\2\3\4"
    assert decode_writer(big_endian(WRITER, (PID.TYPE_INFORMATION, "01020304")), CYCLONE).type_information == b""


# octets as sent, vendor, what they mean
TYPE_CONSISTENCY: list[tuple[str, bytes, p.TypeConsistency]] = [
    ("0000 0000", CYCLONE, p.TypeConsistency(0, False, False, False, True, False)),
    ("0100 0000", CYCLONE, p.TypeConsistency()),
    ("0200 0000", CYCLONE, p.TypeConsistency()),
    ("0100 0000", OPENDDS, p.TypeConsistency(0, False, False, False, True, False)),
    ("0200 0000", OPENDDS, p.TypeConsistency()),
    # Where coercion is not allowed, only the last option has a meaning.
    ("0000 01 01 01 00 01 00", CYCLONE, p.TypeConsistency(0, False, False, False, True, True)),
    ("0200 00 01 01 01 01 00", OPENDDS, p.TypeConsistency(1, False, True, True, True, True)),
]


@pytest.mark.parametrize(("octets", "vendor_id", "policy"), TYPE_CONSISTENCY)
def test_type_consistency_in_each_vendors_numbers(octets: str, vendor_id: bytes, policy: p.TypeConsistency) -> None:
    assert reader_of((PID.TYPE_CONSISTENCY, octets), vendor_id=vendor_id).qos.type_consistency == policy


def test_vendor_is_the_one_that_the_list_names() -> None:
    read = reader_of((PID.VENDORID, "0103 0000"), (PID.TYPE_CONSISTENCY, "0200 0000"))
    assert read.vendor_id == OPENDDS
    assert read.qos.type_consistency.kind == p.TypeConsistency.ALLOW_TYPE_COERCION


def test_unknown_representations_are_left_out() -> None:
    ids = reader_of((PID.DATA_REPRESENTATION, "03000000 0700 0200 feff 0000")).qos.data_representation.ids
    assert ids == (p.DataRepresentationId.XCDR2,)
    assert reader_of((PID.DATA_REPRESENTATION, "00000000")).qos.data_representation == XCDR1
    with pytest.raises(MalformedMessage, match="none of the representations"):
        reader_of((PID.DATA_REPRESENTATION, "01000000 0700 0000"))


def test_first_of_a_repeated_parameter_counts() -> None:
    assert writer_of((PID.TOPIC_NAME, string("Circle"))).topic_name == "Square"


# What no announcement may hold: parameter, octets.
REFUSED: list[tuple[ParameterId, str]] = [
    (PID.RELIABILITY, "00000000 00000000 00000000"),
    (PID.RELIABILITY, "03000000 00000000 00000000"),
    (PID.RELIABILITY, "02000000 ffffffff 00000000"),
    (PID.RELIABILITY, "02000000 00000000"),
    (PID.DURABILITY, "04000000"),
    (PID.LIVELINESS, "03000000 00000000 00000000"),
    (PID.OWNERSHIP, "02000000"),
    (PID.DESTINATION_ORDER, "02000000"),
    (PID.PRESENTATION, "03000000 00000000"),
    (PID.PRESENTATION, "00000000 02000000"),
    (PID.DEADLINE, "ffffffff 00000000"),
    (PID.PARTITION, "02000000 01000000 00000000"),
    (PID.PARTITION, "ffffffff"),
    (PID.PARTITION, struct.pack("<I", MAX_PARTITIONS + 1).hex() + "01000000 00000000" * (MAX_PARTITIONS + 1)),
    (PID.PROPERTY_LIST, struct.pack("<I", MAX_PROPERTIES + 1).hex() + "01000000 00000000" * 2 * (MAX_PROPERTIES + 1)),
    (PID.DATA_REPRESENTATION, "ffff0000"),
    (PID.USER_DATA, "05000000 61626364"),
    (PID.UNICAST_LOCATOR, "01000000 f21c0000"),
    (PID.ENTITY_NAME, "04000000 61626364"),
    (PID.VENDORID, ""),
]


@pytest.mark.parametrize(("pid", "octets"), REFUSED)
def test_value_that_cannot_be_meant_spoils_the_announcement(pid: ParameterId, octets: str) -> None:
    with pytest.raises(MalformedMessage) as caught:
        writer_of((pid, octets))
    assert caught.value.element == pid.name


@pytest.mark.parametrize("octets", ["0300 0000", "0000 02 00 00 00 00 00", ""])
def test_type_consistency_that_cannot_be_meant(octets: str) -> None:
    with pytest.raises(MalformedMessage):
        reader_of((PID.TYPE_CONSISTENCY, octets))


@pytest.mark.parametrize("missing", [PID.ENDPOINT_GUID, PID.TOPIC_NAME, PID.TYPE_NAME])
def test_endpoint_without_identity_is_malformed(missing: ParameterId) -> None:
    with pytest.raises(MalformedMessage, match=f"{missing.name}: is missing"):
        decode_writer(payload_of(*(row for row in LEAST_WRITER if row[0] != missing)), CYCLONE)
    with pytest.raises(MalformedMessage, match=f"{missing.name}: is missing"):
        decode_reader(payload_of(*(row for row in LEAST_READER if row[0] != missing)), CYCLONE)


@pytest.mark.parametrize("entity_id", ["00000107", "000001c1", "000003c2", "00000142", "00000000"])
def test_only_an_applications_writer_is_announced_as_a_writer(entity_id: str) -> None:
    """A builtin writer's id, above all, would take the place of the real one."""
    with pytest.raises(MalformedMessage, match="ENDPOINT_GUID"):
        decode_writer(payload_of((PID.ENDPOINT_GUID, PREFIX.hex() + entity_id), *LEAST_WRITER[1:]), CYCLONE)


@pytest.mark.parametrize("entity_id", ["00000102", "000001c1", "000003c7", "00000147", "00000000"])
def test_only_an_applications_reader_is_announced_as_a_reader(entity_id: str) -> None:
    with pytest.raises(MalformedMessage, match="ENDPOINT_GUID"):
        decode_reader(payload_of((PID.ENDPOINT_GUID, PREFIX.hex() + entity_id), *LEAST_READER[1:]), CYCLONE)


def test_name_beyond_all_measure_is_malformed() -> None:
    longest = "x" * MAX_NAME_LENGTH
    least = [(PID.ENDPOINT_GUID, WRITER_HEX), (PID.TYPE_NAME, string("Shape"))]
    assert decode_writer(payload_of((PID.TOPIC_NAME, string(longest)), *least), CYCLONE).topic_name == longest
    with pytest.raises(MalformedMessage, match="TOPIC_NAME"):
        decode_writer(payload_of((PID.TOPIC_NAME, string(longest + "x")), *least), CYCLONE)


# --- what holds for all ----------------------------------------------------------------------------------


@pytest.mark.parametrize("pid", [0x4015, 0x5001, 0xC001])
def test_unknown_parameter_that_must_be_understood_spoils_the_announcement(pid: int) -> None:
    with pytest.raises(MustUnderstandUnknown):
        writer_of((pid, "00000000"))
    with pytest.raises(MustUnderstandUnknown):
        participant(payload_of((PID.PARTICIPANT_GUID, GUID_HEX), (pid, "00000000")))


@pytest.mark.parametrize("pid", [0x3000, 0x1020, 0x8005, 0xB001])
def test_unknown_parameter_does_no_harm(pid: int) -> None:
    assert writer_of((pid, "deadbeef")) == writer_of()


@pytest.mark.parametrize("header", ["", "0003", "00000000", "00010000", "00070000", "000b0000", "00040000"])
def test_payload_that_is_no_parameter_list_is_malformed(header: str) -> None:
    octets = bytes.fromhex(header) + payload_of(*LEAST_WRITER)[4:]
    with pytest.raises(MalformedMessage):
        decode_writer(octets if len(header) == 8 else bytes.fromhex(header), CYCLONE)


def test_payload_that_is_cut_short_is_malformed() -> None:
    whole = encode_participant(FULL_PARTICIPANT)
    for length in range(len(whole)):
        with pytest.raises(MalformedMessage):
            participant(whole[:length])


# parameter, little-endian octets, big-endian octets
SECURITY: list[tuple[int, str, str]] = [
    (
        PID.IDENTITY_TOKEN,
        """02000000 61000000  01000000 02000000 62000000 02000000 63000000
           01000000 02000000 64000000 01000000 65000000""",
        """00000002 61000000  00000001 00000002 62000000 00000002 63000000
           00000001 00000002 64000000 00000001 65000000""",
    ),
    (PID.PERMISSIONS_TOKEN, "02000000 61000000 00000000 00000000", "00000002 61000000 00000000 00000000"),
    (PID.ENDPOINT_SECURITY_INFO, "01000080 02000080", "80000001 80000002"),
    (PID.ENDPOINT_SYMMETRIC_CIPHER_ALGO, "01000000", "00000001"),
]


@pytest.mark.parametrize(("pid", "little", "big"), SECURITY)
def test_security_parameters_are_kept_as_little_endian_octets(pid: int, little: str, big: str) -> None:
    kept = ((pid, bytes.fromhex(little)),)
    assert writer_of((pid, little)).security_parameters == kept
    assert decode_writer(big_endian(WRITER, (pid, big)), CYCLONE).security_parameters == kept


@pytest.mark.parametrize(("pid", "little", "big"), SECURITY)
def test_security_parameters_are_turned_round_for_a_big_endian_list(pid: int, little: str, big: str) -> None:
    data = DiscoveredParticipantData(guid=PARTICIPANT, security_parameters=((pid, bytes.fromhex(little)),))
    assert participant_parameters(data, little_endian=False).get(pid) == bytes.fromhex(big)
    assert participant_parameters(data).get(pid) == bytes.fromhex(little)


@pytest.mark.parametrize("octets", ["00000002 6100", "ffffffff", "00000002 61000000 ffffffff 00000000"])
def test_big_endian_token_that_does_not_parse_is_malformed(octets: str) -> None:
    with pytest.raises(MalformedMessage):
        decode_writer(big_endian(WRITER, (PID.IDENTITY_TOKEN, octets)), CYCLONE)


# --- disposes --------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("guid", "pid"), [(PARTICIPANT, PID.PARTICIPANT_GUID), (WRITER, PID.ENDPOINT_GUID)])
def test_key_of_a_dispose(guid: Guid, pid: ParameterId) -> None:
    octets = bytes.fromhex("00030000" + f"{pid:02x}00 1000") + guid + bytes.fromhex("01000000")
    assert encode_key(guid, pid) == octets
    assert decode_key(octets, pid) == guid
    assert decode_key(payload_of((pid, guid.hex()), little_endian=False), pid) == guid
    assert decode_key(payload_of((PID.KEY_HASH, guid.hex())), pid) == guid
    for length in range(len(octets)):
        with pytest.raises(MalformedMessage):
            decode_key(octets[:length], pid)


def test_key_of_a_dispose_without_payload_is_its_hash() -> None:
    assert decode_key(b"", PID.ENDPOINT_GUID, key_hash=WRITER) == WRITER
    with pytest.raises(MalformedMessage):
        decode_key(b"", PID.ENDPOINT_GUID, key_hash=WRITER[:15])
    with pytest.raises(MalformedMessage):
        decode_key(b"", PID.ENDPOINT_GUID)


# --- any octets ------------------------------------------------------------------------------------------

known_pids = st.sampled_from([int(pid) for pid in ParameterId if pid > 1])
lists = st.lists(st.tuples(known_pids, st.binary(max_size=40)), max_size=12)


@given(lists, st.booleans())
def test_any_values_are_an_announcement_or_malformed(parameters: list[tuple[int, bytes]], little_endian: bool) -> None:
    least = [(pid, bytes.fromhex(value)) for pid, value in LEAST_WRITER]
    made = ParameterList([*parameters, *least, (PID.PARTICIPANT_GUID, PARTICIPANT)], little_endian=little_endian)
    payload = bytes((0, 3 if little_endian else 2, 0, 0)) + made.encode()
    for decode in (
        participant,
        lambda octets: decode_writer(octets, CYCLONE),
        lambda octets: decode_reader(octets, OPENDDS),
    ):
        with contextlib.suppress(MalformedMessage):
            decode(payload)


names = st.text(min_size=0, max_size=12)
durations = st.sampled_from([0.0, 0.001, 0.1, 1.5, 100.0, math.inf])
qos_values = st.builds(
    EndpointQos,
    reliability=st.builds(p.Reliable, durations) | st.builds(p.BestEffort, durations),
    durability=st.sampled_from([p.Volatile(), p.TransientLocal(), p.Transient(), p.Persistent()]),
    deadline=st.builds(p.Deadline, durations),
    latency_budget=st.builds(p.LatencyBudget, durations),
    liveliness=st.builds(p.Automatic, durations) | st.builds(p.ManualByTopic, durations),
    ownership=st.sampled_from([p.Shared(), p.Exclusive()]),
    destination_order=st.sampled_from([p.ByReceptionTimestamp(), p.BySourceTimestamp()]),
    presentation=st.builds(p.Presentation, st.sampled_from(p.AccessScope), st.booleans(), st.booleans()),
    partition=st.lists(names, max_size=3).map(lambda parts: p.Partition(*parts)),
    user_data=st.binary(max_size=9).map(p.UserData),
    topic_data=st.binary(max_size=9).map(p.TopicData),
    group_data=st.binary(max_size=9).map(p.GroupData),
    data_tags=st.lists(st.tuples(names.filter(bool), names), max_size=3).map(lambda tags: p.DataTags(*tags)),
    data_representation=st.lists(st.sampled_from(p.DataRepresentationId), min_size=1, unique=True).map(
        lambda ids: p.DataRepresentation(*ids)
    ),
    entity_name=names,
)


@given(qos_values, names, st.builds(p.TimeBasedFilter, durations), st.builds(p.Lifespan, durations))
def test_endpoints_round_trip(qos: EndpointQos, name: str, separation: p.TimeBasedFilter, lifespan: p.Lifespan) -> None:
    writer = DiscoveredWriterData(guid=WRITER, topic_name=name, type_name=name, qos=replace(qos, lifespan=lifespan))
    assert decode_writer(encode_writer(writer), CYCLONE) == writer
    reader = DiscoveredReaderData(
        guid=READER, topic_name=name, type_name=name, qos=replace(qos, time_based_filter=separation)
    )
    assert decode_reader(encode_reader(reader), CYCLONE) == reader
