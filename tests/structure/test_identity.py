"""GuidPrefix, EntityId, Guid, Locator, vendors: they are octets, and print as people know them."""

from __future__ import annotations

import pytest

from ddsi.structure.builtin_entity_ids import SEDP_PUBLICATIONS_READER, SEDP_PUBLICATIONS_WRITER, SPDP_WRITER
from ddsi.structure.guid import GUID_UNKNOWN, EntityId, EntityKind, Guid, GuidPrefix
from ddsi.structure.locator import Locator, LocatorKind
from ddsi.structure.vendor import CYCLONE, OUR_VENDOR_ID, vendor_name

PREFIX = GuidPrefix(bytes.fromhex("0110aabbccddeeff00112233"))


@pytest.mark.parametrize(("octets_type", "length"), [(GuidPrefix, 12), (EntityId, 4), (Guid, 16)])
def test_each_has_its_length(octets_type: type[GuidPrefix], length: int) -> None:
    assert len(octets_type(bytes(length))) == length
    for wrong in (0, length - 1, length + 1):
        with pytest.raises(ValueError, match=f"has {length} octets, not {wrong}"):
            octets_type(bytes(wrong))


def test_they_are_the_octets_and_found_by_a_slice_of_a_datagram() -> None:
    guid = Guid.of(PREFIX, EntityId.PARTICIPANT)
    datagram = memoryview(b"....." + guid + b"...")
    assert {guid: "here"}[bytes(datagram[5:21])] == "here"  # type: ignore[index]
    assert hash(guid) == hash(bytes(guid))
    assert guid == bytes(guid)


def test_a_guid_is_a_prefix_and_an_entity_id() -> None:
    entity_id = EntityId.user(0x123456, EntityKind.WRITER_WITH_KEY)
    guid = Guid.of(PREFIX, entity_id)
    assert (guid.prefix, guid.entity_id) == (PREFIX, entity_id)
    assert isinstance(guid.prefix, GuidPrefix)
    assert guid.participant == Guid.of(PREFIX, EntityId.PARTICIPANT)
    assert GUID_UNKNOWN.prefix == GuidPrefix.UNKNOWN
    assert bytes(entity_id) == b"\x12\x34\x56\x02"


def test_they_print_as_people_know_them() -> None:
    guid = Guid.of(PREFIX, EntityId.PARTICIPANT)
    assert str(PREFIX) == "0110aabb:ccddeeff:00112233"
    assert str(guid) == "0110aabb:ccddeeff:00112233:000001c1"
    assert str(EntityId.PARTICIPANT) == "000001c1"
    assert repr(guid) == "Guid(0110aabb:ccddeeff:00112233:000001c1)"


@pytest.mark.parametrize(
    ("entity_id", "builtin", "writer", "reader", "keyed"),
    [
        (EntityId.user(1, EntityKind.WRITER_WITH_KEY), False, True, False, True),
        (EntityId.user(1, EntityKind.WRITER_NO_KEY), False, True, False, False),
        (EntityId.user(1, EntityKind.READER_WITH_KEY), False, False, True, True),
        (EntityId.user(1, EntityKind.READER_NO_KEY), False, False, True, False),
        (EntityId.PARTICIPANT, True, False, False, False),
        (SPDP_WRITER, True, True, False, True),
        (SEDP_PUBLICATIONS_WRITER, True, True, False, True),
        (SEDP_PUBLICATIONS_READER, True, False, True, True),
        (EntityId(b"\0\0\1\x43"), False, True, False, False),  # a vendor's own (40): neither user nor builtin
        (EntityId.UNKNOWN, False, False, False, False),
        (EntityId(b"\0\0\1\x3f"), False, False, False, False),  # a kind that nobody has defined
    ],
)
def test_the_last_octet_tells_the_kind(
    entity_id: EntityId, builtin: bool, writer: bool, reader: bool, keyed: bool
) -> None:
    found = (entity_id.is_builtin, entity_id.is_writer, entity_id.is_reader, entity_id.is_keyed)
    assert found == (builtin, writer, reader, keyed)


# --- locators -------------------------------------------------------------------------------------------------------


def test_an_ipv4_locator_has_its_address_in_the_last_four_octets() -> None:
    locator = Locator.udp_v4("10.1.2.3", 7410)
    assert (locator.kind, locator.port, locator.address) == (LocatorKind.UDPV4, 7410, bytes(12) + b"\x0a\1\2\3")
    assert (locator.host, str(locator)) == ("10.1.2.3", "udpv4/10.1.2.3:7410")
    with pytest.raises(ValueError, match="999"):
        Locator.udp_v4("10.1.2.999", 1)


@pytest.mark.parametrize(
    ("locator", "text"),
    [
        (Locator(LocatorKind.UDPV6, 7400, bytes(15) + b"\1"), "udpv6/[::1]:7400"),
        (Locator(LocatorKind.TCPV4, 1, bytes(16)), f"tcpv4/{bytes(16).hex()}:1"),
        (Locator(16, 1, bytes(16)), f"kind16/{bytes(16).hex()}:1"),
    ],
)
def test_other_kinds_print_too(locator: Locator, text: str) -> None:
    assert str(locator) == text


@pytest.mark.parametrize(
    ("address", "multicast", "loopback", "unspecified"),
    [
        ("127.0.0.1", False, True, False),
        ("127.255.0.9", False, True, False),
        ("10.0.0.1", False, False, False),
        ("223.255.255.255", False, False, False),
        ("224.0.0.1", True, False, False),
        ("239.255.0.1", True, False, False),
        ("240.0.0.1", False, False, False),
        ("0.0.0.0", False, False, True),
    ],
)
def test_what_an_address_is(address: str, multicast: bool, loopback: bool, unspecified: bool) -> None:
    locator = Locator.udp_v4(address, 1)
    assert (locator.is_multicast, locator.is_loopback, locator.is_unspecified) == (multicast, loopback, unspecified)


def test_multicast_of_ipv6() -> None:
    assert Locator(LocatorKind.UDPV6, 1, b"\xff\x02" + bytes(14)).is_multicast
    assert not Locator(LocatorKind.UDPV6, 1, b"\xfe\x80" + bytes(14)).is_multicast


# --- vendors --------------------------------------------------------------------------------------------------------


def test_vendors_have_names() -> None:
    assert vendor_name(CYCLONE) == "Cyclone DDS"
    assert vendor_name(b"\x77\x01") == "vendor 77.01"
    assert vendor_name(OUR_VENDOR_ID) == "ddsi"


def test_our_vendor_id_is_nobody_elses() -> None:
    """With another's, peers would apply that vendor's private rules to us."""
    assigned = {b"\x01" + bytes((number,)) for number in range(1, 0x21)}
    assert OUR_VENDOR_ID not in assigned
