"""Every submessage in words."""

import pytest

from ddsi.messages.acknack import AckNack, NackFrag
from ddsi.messages.data import Data
from ddsi.messages.data_frag import DataFrag
from ddsi.messages.gap import Gap
from ddsi.messages.heartbeat import Heartbeat, HeartbeatFrag
from ddsi.messages.interpreter import (
    InfoDestination,
    InfoReply,
    InfoReplyIp4,
    InfoSource,
    InfoTimestamp,
    Pad,
)
from ddsi.messages.opaque import HeaderExtension, Opaque, Unknown
from ddsi.messages.submessages import Submessage
from ddsi.serialization.cursor import Octets
from ddsi.serialization.parameter_list import ParameterList
from ddsi.structure import builtin_entity_ids as ids
from ddsi.structure.guid import EntityId, Guid
from ddsi.structure.locator import Locator
from ddsi.structure.sequence_number import NumberSet
from ddsi.trace.describe import Describer
from ddsi.trace.events import EndpointDiscovered
from ddsi.trace.names import Names
from tests.trace.samples import READER, WRITER, A, B

W, R = WRITER.entity_id, READER.entity_id
NOBODY = EntityId.UNKNOWN
STRANGE_WRITER = EntityId(bytes.fromhex("00abcd03"))
PAYLOAD = b"\x00\x01\x00\x00\x05\x00\x00\x00BLUE\x00\x00\x00\x00"
HERE = Locator.udp_v4("127.0.0.1", 7410)


def status(value: int) -> ParameterList:
    return ParameterList([(0x71, bytes((0, 0, 0, value)))])


def sedp_payload(guid: Guid, topic_name: str, type_name: str) -> bytes:
    def string(text: str) -> bytes:
        octets = text.encode() + b"\0"
        return len(octets).to_bytes(4, "little") + octets

    parameters = ParameterList([(0x5A, guid), (0x05, string(topic_name)), (0x07, string(type_name))])
    return b"\x00\x03\x00\x00" + parameters.encode()


TABLE: list[tuple[Submessage, str]] = [
    (Data(NOBODY, W, 3, None, PAYLOAD), "DATA Square #3"),
    (Data(R, W, 3, None, PAYLOAD), "DATA Square #3 -> reader 1"),
    (Data(NOBODY, STRANGE_WRITER, 3, None, PAYLOAD), "DATA writer abcd #3"),
    (Data(NOBODY, W, 4, status(1), PAYLOAD, True), "DATA Square #4 dispose"),
    (Data(NOBODY, W, 4, status(2), PAYLOAD, True), "DATA Square #4 unregister"),
    (Data(NOBODY, W, 4, status(3)), "DATA Square #4 dispose and unregister"),
    (Data(NOBODY, W, 4, status(4)), "DATA Square #4 filtered out"),
    (Data(NOBODY, W, 4, status(0), PAYLOAD, True), "DATA Square #4 key only"),
    (Data(NOBODY, W, 4), "DATA Square #4 no payload"),
    (Data(ids.SPDP_READER, ids.SPDP_WRITER, 1, None, PAYLOAD), "DATA SPDP #1"),
    (
        Data(NOBODY, ids.SEDP_PUBLICATIONS_WRITER, 2, None, sedp_payload(WRITER, "Square", "ShapeType")),
        "DATA SEDP pub #2: Square (ShapeType)",
    ),
    (
        Data(NOBODY, ids.SEDP_PUBLICATIONS_WRITER, 3, status(3), sedp_payload(WRITER, "", ""), True),
        "DATA SEDP pub #3 dispose and unregister: Square@A",
    ),
    (
        Data(NOBODY, ids.PARTICIPANT_MESSAGE_WRITER, 1, None, b"\0\1\0\0" + A + b"\0\0\0\1" + bytes(4)),
        "DATA ParticipantMessage #1: automatic liveliness",
    ),
    (
        Data(NOBODY, ids.PARTICIPANT_MESSAGE_WRITER, 2, None, b"\0\1\0\0" + A + b"\0\0\0\2" + bytes(4)),
        "DATA ParticipantMessage #2: manual liveliness",
    ),
    (DataFrag(NOBODY, W, 7, 3, 1, 1000, 11001, None, bytes(1000)), "DATA_FRAG Square #7 3/12 of 11001 octets"),
    (DataFrag(R, W, 7, 3, 4, 1000, 12000), "DATA_FRAG Square #7 3..6/12 of 12000 octets -> reader 1"),
    (Heartbeat(NOBODY, W, 1, 5, 2), "HEARTBEAT Square 1..5 count 2"),
    (Heartbeat(R, W, 5, 5, 3, final=True), "HEARTBEAT Square 5..5 count 3 final -> reader 1"),
    (Heartbeat(NOBODY, W, 6, 5, 4, True, True), "HEARTBEAT Square empty, next 6 count 4 final liveliness"),
    (HeartbeatFrag(NOBODY, W, 7, 12, 1), "HEARTBEAT_FRAG Square #7 fragments 1..12 count 1"),
    (Gap(NOBODY, W, 3, NumberSet(6)), "GAP Square 3..5"),
    (Gap(NOBODY, W, 3, NumberSet.of(4, [6, 8, 9])), "GAP Square 3 and {6,8..9}"),
    (Gap(R, W, 3, NumberSet.of(3, [4])), "GAP Square {4} -> reader 1"),
    (Gap(NOBODY, W, 3, NumberSet(3)), "GAP Square nothing"),
    (InfoTimestamp(1_700_000_000 << 32 | 1 << 31), "INFO_TS 2023-11-14T22:13:20.500000Z"),
    (InfoTimestamp((1 << 64) - 1), "INFO_TS 2106-02-07T06:28:15.999999Z"),
    (InfoTimestamp(None), "INFO_TS none"),
    (InfoDestination(B), "INFO_DST B"),
    (InfoDestination(type(B).UNKNOWN), "INFO_DST everybody"),
    (InfoSource((2, 3), b"\x01\x0f", B), "INFO_SRC B (Fast DDS, RTPS 2.3)"),
    (InfoReply((HERE,), (HERE,)), "INFO_REPLY udpv4/127.0.0.1:7410, udpv4/127.0.0.1:7410"),
    (InfoReplyIp4(HERE), "INFO_REPLY_IP4 udpv4/127.0.0.1:7410"),
    (Pad(1), "PAD 1 octet"),
    (HeaderExtension(1, bytes(8)), "HEADER_EXTENSION 8 octets"),
    (Opaque(0x31, 0, bytes(20)), "SEC_PREFIX 20 octets"),
    (Unknown(0x80, 1, bytes(56)), "vendor's own 80 (56 octets)"),
    (Unknown(0x44, 1, bytes(4)), "unknown submessage 44 (4 octets)"),
]

# Answers go from reader to writer: here from B to A.
ANSWERS: list[tuple[Submessage, str]] = [
    (AckNack(R, W, NumberSet.of(4, [4, 6]), 1), "ACKNACK Square base 4 missing {4,6} count 1"),
    (AckNack(R, W, NumberSet(6), 2, final=True), "ACKNACK Square base 6 count 2 final"),
    (
        AckNack(ids.SEDP_PUBLICATIONS_READER, ids.SEDP_PUBLICATIONS_WRITER, NumberSet(0), 1),
        "ACKNACK SEDP pub base 0 count 1",
    ),
    (NackFrag(R, W, 7, NumberSet.of(1, [1, 2, 3, 9]), 1), "NACK_FRAG Square #7 missing fragments {1..3,9} count 1"),
    (AckNack(R, STRANGE_WRITER, NumberSet(1), 1), "ACKNACK Square base 1 count 1"),
]


def names() -> Names:
    known = Names()
    known.learn_event(EndpointDiscovered(0.0, A, WRITER, "Square", "ShapeType"))
    known.learn_event(EndpointDiscovered(0.0, B, READER, "Square", "ShapeType"))
    return known


@pytest.mark.parametrize(("submessage", "text"), TABLE, ids=[text for _, text in TABLE])
def test_what_a_writer_sends(submessage: Submessage, text: str) -> None:
    assert Describer(names()).submessage(submessage, source=A, destination=B) == text


@pytest.mark.parametrize(("submessage", "text"), ANSWERS, ids=[text for _, text in ANSWERS])
def test_what_a_reader_answers(submessage: Submessage, text: str) -> None:
    assert Describer(names()).submessage(submessage, source=B, destination=A) == text


def test_every_kind_of_submessage_has_words() -> None:
    described = {type(submessage) for submessage, _ in (*TABLE, *ANSWERS)}
    assert described == set(Submessage.__args__)


def test_without_names_entities_keep_their_numbers() -> None:
    assert Describer().submessage(Heartbeat(R, W, 1, 5, 2)) == "HEARTBEAT writer 1 1..5 count 2 -> reader 1"


def test_a_long_set_is_cut() -> None:
    acknack = AckNack(R, W, NumberSet.of(2, range(2, 200, 2)), 1)
    text = Describer(names()).submessage(acknack, source=B, destination=A)
    assert text == "ACKNACK Square base 2 missing {2,4,6,8,10,12,14,16,and 91 more} count 1"


def test_sample_text_says_what_is_in_a_users_payload_only() -> None:
    asked: list[Guid] = []

    def colour(writer: Guid, payload: Octets) -> str:
        asked.append(writer)
        return bytes(payload[8:12]).decode()

    describer = Describer(names(), colour)
    assert describer.submessage(Data(NOBODY, W, 3, None, PAYLOAD), source=A) == "DATA Square BLUE #3"
    assert describer.submessage(Data(NOBODY, W, 4), source=A) == "DATA Square #4 no payload"
    assert describer.submessage(Data(NOBODY, ids.SPDP_WRITER, 1, None, PAYLOAD), source=A) == "DATA SPDP #1"
    assert asked == [WRITER]


def test_foreign_text_cannot_reach_the_terminal_as_control_characters() -> None:
    evil = Data(NOBODY, ids.SEDP_PUBLICATIONS_WRITER, 1, None, sedp_payload(WRITER, "a\x1b[2Jb\u202ec", "x" * 500))
    text = Describer().submessage(evil, source=A)
    assert text == f"DATA SEDP pub #1: a?[2Jb?c ({'x' * 47}…)"
