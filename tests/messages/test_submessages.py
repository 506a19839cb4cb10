"""Every submessage as octets: one table, both byte orders, both directions; what is cut short; what is not valid."""

from __future__ import annotations

import dataclasses

import pytest

from ddsi.messages.submessages import (
    AckNack,
    Data,
    DataFrag,
    Gap,
    GapGroupInfo,
    HeaderExtension,
    Heartbeat,
    HeartbeatFrag,
    HeartbeatGroupInfo,
    InfoDestination,
    InfoReply,
    InfoReplyIp4,
    InfoSource,
    InfoTimestamp,
    NackFrag,
    Opaque,
    Pad,
    Submessage,
    SubmessageKind,
    Unknown,
    decode_submessage,
    iterate_submessages,
)
from ddsi.serialization import ParameterId, ParameterList
from ddsi.structure.errors import MalformedMessage
from ddsi.structure.guid import EntityId, GuidPrefix
from ddsi.structure.locator import Locator
from ddsi.structure.sequence_number import NumberSet

READER = EntityId(b"\x00\x00\x01\x07")
WRITER = EntityId(b"\x00\x00\x02\x02")
PREFIX = GuidPrefix(bytes(range(1, 13)))
UNICAST = Locator.udp_v4("127.0.0.1", 7410)
MULTICAST = Locator.udp_v4("239.255.0.1", 7400)


def status_info(*, little_endian: bool) -> ParameterList:
    return ParameterList([(ParameterId.STATUS_INFO, b"\0\0\0\3")], little_endian=little_endian)


# submessage, little-endian octets, big-endian octets
SUBMESSAGES: list[tuple[Submessage, str, str]] = [
    (
        AckNack(READER, WRITER, NumberSet.of(12, [13, 15]), 7, final=True),
        """06 03 1c00  00000107 00000202
           00000000 0c000000 04000000 00000050
           07000000""",
        """06 02 001c  00000107 00000202
           00000000 0000000c 00000004 50000000
           00000007""",
    ),
    (  # the preemptive form of Fast DDS
        AckNack(READER, WRITER, NumberSet(0), 1),
        "06 01 1800  00000107 00000202  00000000 00000000 00000000  01000000",
        "06 00 0018  00000107 00000202  00000000 00000000 00000000  00000001",
    ),
    (
        NackFrag(READER, WRITER, 3, NumberSet.of(2, [2, 3]), 9),
        "12 01 2000  00000107 00000202  00000000 03000000  02000000 02000000 000000c0  09000000",
        "12 00 0020  00000107 00000202  00000000 00000003  00000002 00000002 c0000000  00000009",
    ),
    (
        Heartbeat(READER, WRITER, 1, 5, 3, final=True),
        "07 03 1c00  00000107 00000202  00000000 01000000  00000000 05000000  03000000",
        "07 02 001c  00000107 00000202  00000000 00000001  00000000 00000005  00000003",
    ),
    (  # nothing to offer: lastSN = firstSN - 1
        Heartbeat(EntityId.UNKNOWN, WRITER, 1, 0, 0xFFFFFFFF, liveliness=True),
        "07 05 1c00  00000000 00000202  00000000 01000000  00000000 00000000  ffffffff",
        "07 04 001c  00000000 00000202  00000000 00000001  00000000 00000000  ffffffff",
    ),
    (
        Heartbeat(READER, WRITER, 1, 2, 3, group_info=HeartbeatGroupInfo(9, 8, 7, b"abcd", b"efgh")),
        """07 09 3c00  00000107 00000202  00000000 01000000  00000000 02000000  03000000
           00000000 09000000  00000000 08000000  00000000 07000000  61626364 65666768""",
        """07 08 003c  00000107 00000202  00000000 00000001  00000000 00000002  00000003
           00000000 00000009  00000000 00000008  00000000 00000007  61626364 65666768""",
    ),
    (
        HeartbeatFrag(READER, WRITER, 0x1_0000_0002, 17, 4),
        "13 01 1800  00000107 00000202  01000000 02000000  11000000 04000000",
        "13 00 0018  00000107 00000202  00000001 00000002  00000011 00000004",
    ),
    (
        Gap(READER, WRITER, 3, NumberSet.of(6, [7])),
        "08 01 2000  00000107 00000202  00000000 03000000  00000000 06000000 02000000 00000040",
        "08 00 0020  00000107 00000202  00000000 00000003  00000000 00000006 00000002 40000000",
    ),
    (
        Gap(READER, WRITER, 3, NumberSet(6), GapGroupInfo(1, 2), filtered_count=5),
        """08 07 3000  00000107 00000202  00000000 03000000  00000000 06000000 00000000
           00000000 01000000  00000000 02000000  05000000""",
        """08 06 0030  00000107 00000202  00000000 00000003  00000000 00000006 00000000
           00000000 00000001  00000000 00000002  00000005""",
    ),
    (
        Gap(READER, WRITER, 3, NumberSet(6), filtered_count=0),
        "08 05 2000  00000107 00000202  00000000 03000000  00000000 06000000 00000000  00000000",
        "08 04 0020  00000107 00000202  00000000 00000003  00000000 00000006 00000000  00000000",
    ),
    (InfoTimestamp(0x5F00000080000000), "09 01 0800  0000005f 00000080", "09 00 0008  5f000000 80000000"),
    (InfoTimestamp(None), "09 03 0000", "09 02 0000"),
    (
        InfoSource((2, 4), b"\x01\x10", PREFIX),
        "0c 01 1400  00000000  02 04 0110  0102030405060708090a0b0c",
        "0c 00 0014  00000000  02 04 0110  0102030405060708090a0b0c",
    ),
    (InfoDestination(PREFIX), "0e 01 0c00  0102030405060708090a0b0c", "0e 00 000c  0102030405060708090a0b0c"),
    (
        InfoReply((UNICAST,)),
        "0f 01 1c00  01000000  01000000 f21c0000 000000000000000000000000 7f000001",
        "0f 00 001c  00000001  00000001 00001cf2 000000000000000000000000 7f000001",
    ),
    (
        InfoReply((), (MULTICAST,)),
        "0f 03 2000  00000000  01000000  01000000 e81c0000 000000000000000000000000 efff0001",
        "0f 02 0020  00000000  00000001  00000001 00001ce8 000000000000000000000000 efff0001",
    ),
    (  # the address is a number, and so in the submessage's byte order
        InfoReplyIp4(UNICAST, MULTICAST),
        "0d 03 1000  0100007f f21c0000  0100ffef e81c0000",
        "0d 02 0010  7f000001 00001cf2  efff0001 00001ce8",
    ),
    (InfoReplyIp4(UNICAST), "0d 01 0800  0100007f f21c0000", "0d 00 0008  7f000001 00001cf2"),
    (Pad(), "01 01 0000", "01 00 0000"),
    (Pad(8), "01 01 0800  0000000000000000", "01 00 0008  0000000000000000"),
    (
        Data(READER, WRITER, 5, serialized_payload=bytes.fromhex("00010000 01020304")),
        "15 05 1c00  0000 1000  00000107 00000202  00000000 05000000  00010000 01020304",
        "15 04 001c  0000 0010  00000107 00000202  00000000 00000005  00010000 01020304",
    ),
    (
        Data(READER, WRITER, 5, serialized_payload=bytes.fromhex("00010000 01020304"), non_standard_payload=True),
        "15 15 1c00  0000 1000  00000107 00000202  00000000 05000000  00010000 01020304",
        "15 14 001c  0000 0010  00000107 00000202  00000000 00000005  00010000 01020304",
    ),
    (
        DataFrag(READER, WRITER, 5, 2, 1, 8, 20, serialized_payload=b"fragment"),
        """16 01 2800  0000 1c00  00000107 00000202  00000000 05000000
           02000000 0100 0800 14000000  667261676d656e74""",
        """16 00 0028  0000 001c  00000107 00000202  00000000 00000005
           00000002 0001 0008 00000014  667261676d656e74""",
    ),
    (  # the last fragment is shorter than the others
        DataFrag(READER, WRITER, 5, 2, 2, 8, 20, serialized_payload=b"fragments 2.", is_key=True),
        """16 05 2c00  0000 1c00  00000107 00000202  00000000 05000000
           02000000 0200 0800 14000000  667261676d656e747320322e""",
        """16 04 002c  0000 001c  00000107 00000202  00000000 00000005
           00000002 0002 0008 00000014  667261676d656e747320322e""",
    ),
    (
        DataFrag(READER, WRITER, 5, 1, 1, 4, 4, serialized_payload=b"abcd", non_standard_payload=True),
        "16 09 2400  0000 1c00  00000107 00000202  00000000 05000000  01000000 0100 0400 04000000  61626364",
        "16 08 0024  0000 001c  00000107 00000202  00000000 00000005  00000001 0001 0004 00000004  61626364",
    ),
]
# Those with inline QoS, whose list has the submessage's byte order: submessage in that order, its octets.
WITH_INLINE_QOS: list[tuple[bool, Submessage, str]] = [
    (
        little_endian,
        submessage(status_info(little_endian=little_endian)),
        little if little_endian else big,
    )
    for submessage, little, big in (
        (  # a dispose in the form that everybody takes
            lambda qos: Data(READER, WRITER, 5, qos, bytes.fromhex("00010000 01020304"), is_key=True),
            """15 0b 2800  0000 1000  00000107 00000202  00000000 05000000
               7100 0400 00000003  0100 0000  00010000 01020304""",
            """15 0a 0028  0000 0010  00000107 00000202  00000000 00000005
               0071 0004 00000003  0001 0000  00010000 01020304""",
        ),
        (  # a dispose that has no payload
            lambda qos: Data(READER, WRITER, 5, qos),
            "15 03 2000  0000 1000  00000107 00000202  00000000 05000000  7100 0400 00000003  0100 0000",
            "15 02 0020  0000 0010  00000107 00000202  00000000 00000005  0071 0004 00000003  0001 0000",
        ),
        (
            lambda qos: DataFrag(READER, WRITER, 5, 1, 1, 4, 8, qos, b"abcd"),
            """16 03 3000  0000 1c00  00000107 00000202  00000000 05000000
               01000000 0100 0400 08000000  7100 0400 00000003  0100 0000  61626364""",
            """16 02 0030  0000 001c  00000107 00000202  00000000 00000005
               00000001 0001 0004 00000008  0071 0004 00000003  0001 0000  61626364""",
        ),
    )
    for little_endian in (True, False)
]
CASES = [
    *((True, submessage, little) for submessage, little, _ in SUBMESSAGES),
    *((False, submessage, big) for submessage, _, big in SUBMESSAGES),
    *WITH_INLINE_QOS,
]


def decode(octets: bytes | bytearray) -> Submessage:
    """The one submessage that ``octets`` are."""
    (raw,) = iterate_submessages(octets, start=0)
    return decode_submessage(raw)


def decode_hex(octets: str) -> Submessage:
    return decode(bytes.fromhex(octets))


@pytest.mark.parametrize(("little_endian", "submessage", "octets"), CASES)
def test_submessage_reads_and_writes_as_these_octets(
    *, little_endian: bool, submessage: Submessage, octets: str
) -> None:
    assert submessage.encode(little_endian=little_endian) == bytes.fromhex(octets)
    assert decode_hex(octets) == submessage


@pytest.mark.parametrize(("little_endian", "submessage", "octets"), CASES)
def test_submessage_that_is_cut_short_is_malformed(*, little_endian: bool, submessage: Submessage, octets: str) -> None:
    """Whether the datagram ends too early or the length field says less: it is seen, and nothing else is raised."""
    (raw,) = iterate_submessages(bytes.fromhex(octets), start=0)
    assert raw.little_endian is little_endian
    length = len(raw.body)
    if isinstance(submessage, Pad) or submessage == InfoTimestamp(None):
        length = 0  # any body will do
    elif isinstance(submessage, Data) and submessage.serialized_payload:
        length -= len(submessage.serialized_payload) - 4  # as long as the encapsulation header is there
    for cut in range(length):
        with pytest.raises(MalformedMessage):
            decode_submessage(raw._replace(body=raw.body[:cut]))
    for cut in range(4, len(raw.body)):
        with pytest.raises(MalformedMessage):
            decode(bytes.fromhex(octets)[: 4 + cut])


@pytest.mark.parametrize(("little_endian", "submessage", "octets"), CASES)
def test_fields_that_a_later_version_appends_are_skipped(
    *, little_endian: bool, submessage: Submessage, octets: str
) -> None:
    if isinstance(submessage, (Data, DataFrag, Pad)) or submessage == InfoTimestamp(None):
        return  # their bodies reach to the end
    whole = bytes.fromhex(octets)
    length = len(whole) - 4 + 8
    longer = whole[:2] + length.to_bytes(2, "little" if little_endian else "big") + whole[4:] + b"\xee" * 8
    assert decode(longer) == submessage


def test_every_kind_of_the_protocol_is_in_the_table() -> None:
    tested = {bytes.fromhex(octets)[0] for _, _, octets in CASES}
    assert {kind for kind in SubmessageKind if kind < SubmessageKind.SEC_BODY} - tested == {
        SubmessageKind.HEADER_EXTENSION
    }


INVALID: list[tuple[str, str]] = [
    ("ACKNACK from 0 with bits", "06 01 1c00 00000107 00000202 00000000 00000000 01000000 00000080 07000000"),
    ("ACKNACK below 0", "06 01 1800 00000107 00000202 ffffffff 00000000 00000000 07000000"),
    ("ACKNACK of 257 bits", "06 01 3c00 00000107 00000202 00000000 01000000 01010000" + "00" * 40),
    ("HEARTBEAT from 0", "07 01 1c00 00000107 00000202 00000000 00000000 00000000 05000000 03000000"),
    ("HEARTBEAT to first - 2", "07 01 1c00 00000107 00000202 00000000 05000000 00000000 03000000 03000000"),
    ("GAP from 0", "08 01 1c00 00000107 00000202 00000000 00000000 00000000 06000000 00000000"),
    ("GAP to 0", "08 01 1c00 00000107 00000202 00000000 01000000 00000000 00000000 00000000"),
    ("HEARTBEAT_FRAG of change 0", "13 01 1800 00000107 00000202 00000000 00000000 11000000 04000000"),
    ("HEARTBEAT_FRAG of no fragment", "13 01 1800 00000107 00000202 00000000 01000000 00000000 04000000"),
    ("NACK_FRAG of change 0", "12 01 2000 00000107 00000202 00000000 00000000 02000000 01000000 00000080 09000000"),
    ("NACK_FRAG from 0", "12 01 2000 00000107 00000202 00000000 01000000 00000000 01000000 00000080 09000000"),
    ("NACK_FRAG of no bits", "12 01 1c00 00000107 00000202 00000000 01000000 02000000 00000000 09000000"),
    ("INFO_REPLY of 2^32-1 locators", "0f 01 1c00 ffffffff 01000000 f21c0000 000000000000000000000000 7f000001"),
    ("DATA 0", "15 05 1800 0000 1000 00000107 00000202 00000000 00000000 00010000"),
    ("DATA with D and K", "15 0d 1800 0000 1000 00000107 00000202 00000000 01000000 00010000"),
    ("DATA with D and no payload", "15 05 1400 0000 1000 00000107 00000202 00000000 01000000"),
    ("DATA with K and no payload", "15 09 1400 0000 1000 00000107 00000202 00000000 01000000"),
    ("DATA whose inline QoS has no end", "15 03 1c00 0000 1000 00000107 00000202 00000000 01000000 7100 0400 00000001"),
    ("DATA whose inline QoS begins in its head", "15 01 1400 0000 0c00 00000107 00000202 00000000 01000000"),
    ("DATA whose inline QoS begins unaligned", "15 01 1800 0000 1200 00000107 00000202 00000000 01000000 00000000"),
    ("DATA whose inline QoS begins beyond it", "15 01 1400 0000 1400 00000107 00000202 00000000 01000000"),
    *(
        (f"DATA_FRAG {what}", f"16 01 2400 0000 1c00 00000107 00000202 00000000 {numbers} 61626364")
        for what, numbers in (
            ("of change 0", "00000000 01000000 0100 0400 04000000"),
            ("from 0", "01000000 00000000 0100 0400 04000000"),
            ("of no fragments", "01000000 01000000 0000 0400 04000000"),
            ("of empty fragments", "01000000 01000000 0100 0000 04000000"),
            ("of an empty sample", "01000000 01000000 0100 0400 00000000"),
            ("beyond the sample", "01000000 02000000 0100 0400 04000000"),
            ("that ends beyond the sample", "01000000 01000000 0200 0400 04000000"),
            ("that is not all there", "01000000 01000000 0100 0500 05000000"),
            ("that is far away", "01000000 ffffffff ffff ffff ffffffff"),
        )
    ),
]


@pytest.mark.parametrize(("what", "octets"), INVALID, ids=[what for what, _ in INVALID])
def test_invalid_submessage_is_malformed(what: str, octets: str) -> None:
    with pytest.raises(MalformedMessage) as caught:
        decode_hex(octets)
    assert caught.value.element == what.split()[0]


def test_error_says_which_submessage_and_where_in_the_datagram() -> None:
    datagram = bytes(20) + bytes.fromhex("01 01 0400 00000000" + "09 01 0400 00000000")
    *_, raw = iterate_submessages(datagram)
    with pytest.raises(MalformedMessage) as caught:
        decode_submessage(raw)
    assert (caught.value.element, caught.value.offset) == ("INFO_TS", 20 + 8 + 4)


def test_octets_to_inline_qos_is_honoured() -> None:
    """Eight octets that a later version put before the inline QoS are skipped, and the payload is what follows."""
    data = decode_hex(
        "15 07 2c00  0000 1800  00000107 00000202  00000000 05000000  eeeeeeee eeeeeeee"
        "7100 0400 00000003  0100 0000  00010000"
    )
    assert data == Data(READER, WRITER, 5, status_info(little_endian=True), bytes.fromhex("00010000"))
    data_frag = decode_hex(
        "16 01 2800  0000 2000  00000107 00000202  00000000 0500000001000000 0100 0400 04000000  eeeeeeee  61626364"
    )
    assert data_frag == DataFrag(READER, WRITER, 5, 1, 1, 4, 4, serialized_payload=b"abcd")


def test_gap_whose_list_begins_below_it_is_valid() -> None:
    """Then only the members of the list are irrelevant."""
    gap = decode_hex("08 01 2000  00000107 00000202  00000000 09000000  00000000 06000000 02000000 000000c0")
    assert gap == Gap(READER, WRITER, 9, NumberSet.of(6, [6, 7]))


def test_payloads_are_padded_and_views() -> None:
    """What follows a payload of 5 octets is padding that only its reader can tell from the sample."""
    octets = bytearray(Data(READER, WRITER, 1, serialized_payload=b"\0\1\0\0A").encode())
    assert len(octets) == 4 + 20 + 8
    data = decode(octets)
    assert isinstance(data, Data)
    assert data.serialized_payload == b"\0\1\0\0A\0\0\0"
    octets[28] = ord("B")
    assert data.serialized_payload[4] == ord("B")


def test_run_of_fragments_knows_its_place_in_the_sample() -> None:
    run = DataFrag(
        READER, WRITER, 1, fragment_starting_num=3, fragments_in_submessage=2, fragment_size=100, sample_size=350
    )
    assert (run.run_start, run.run_length, run.last_fragment_num) == (200, 150, 4)
    run = dataclasses.replace(run, fragment_starting_num=1)
    assert (run.run_start, run.run_length, run.last_fragment_num) == (0, 200, 2)


def test_protected_run_may_be_longer_than_its_fragments() -> None:
    octets = DataFrag(READER, WRITER, 1, 1, 1, 4, 4, serialized_payload=b"much longer.").encode()
    data_frag = decode(octets)
    assert isinstance(data_frag, DataFrag)
    assert (bytes(data_frag.serialized_payload), data_frag.run_length) == (b"much longer.", 4)


def test_inline_qos_in_the_other_byte_order_is_refused() -> None:
    with pytest.raises(ValueError, match="byte order"):
        Data(READER, WRITER, 1, status_info(little_endian=False)).encode()


ENVELOPES = [kind for kind in SubmessageKind if kind >= SubmessageKind.SEC_BODY]


@pytest.mark.parametrize("kind", ENVELOPES)
def test_security_envelopes_keep_their_octets(kind: SubmessageKind) -> None:
    for flags, length in ((0x01, "0400"), (0x00, "0004"), (0xF0, "0004")):
        octets = bytes((kind, flags)) + bytes.fromhex(length + "01020304")
        opaque = decode(octets)
        assert opaque == Opaque(kind, flags, b"\1\2\3\4")
        assert opaque.encode() == opaque.encode(little_endian=False) == octets


@pytest.mark.parametrize(("kind", "is_vendor_specific"), [(0x02, False), (0x7F, False), (0x80, True), (0xFF, True)])
def test_unknown_kinds_keep_their_octets(kind: int, *, is_vendor_specific: bool) -> None:
    octets = bytes((kind, 0x81, 4, 0)) + b"abcd"
    unknown = decode(octets)
    assert unknown == Unknown(kind, 0x81, b"abcd")
    assert isinstance(unknown, Unknown)
    assert unknown.is_vendor_specific is is_vendor_specific
    assert unknown.encode() == octets


def test_header_extension_is_received_unread() -> None:
    octets = bytes.fromhex("00 07 0c00 40000000 0000005f 00000080")
    extension = decode(octets)
    assert extension == HeaderExtension(0x07, octets[4:])
    assert extension.encode() == octets


def test_payloads_do_not_appear_in_reprs() -> None:
    assert "secret" not in repr(Data(READER, WRITER, 1, serialized_payload=b"secret"))
    assert "secret" not in repr(Opaque(SubmessageKind.SEC_BODY, 1, b"secret"))
