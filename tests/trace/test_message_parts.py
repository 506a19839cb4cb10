"""Whole messages in words: grouped by destination, INFO_* folded, envelopes as one phrase, broken ones described."""

from hypothesis import given
from hypothesis import strategies as st

from ddsi.messages.acknack import AckNack
from ddsi.messages.data import Data
from ddsi.messages.header import Header
from ddsi.messages.heartbeat import Heartbeat
from ddsi.messages.interpreter import InfoDestination, InfoTimestamp, Pad
from ddsi.messages.opaque import Opaque, Unknown
from ddsi.messages.submessages import Submessage
from ddsi.structure import builtin_entity_ids as ids
from ddsi.structure.guid import EntityId, GuidPrefix
from ddsi.structure.sequence_number import NumberSet
from ddsi.trace.describe import Describer
from ddsi.trace.message_parts import message_parts
from tests.trace.samples import READER, WRITER, A, B

HEADER = Header((2, 4), b"\x01\xdd", A).encode()
C = GuidPrefix(bytes.fromhex("01dd0000000000000000000c"))
DATA = Data(EntityId.UNKNOWN, WRITER.entity_id, 3, None, b"\x00\x01\x00\x00abcd")
HEARTBEAT = Heartbeat(EntityId.UNKNOWN, WRITER.entity_id, 1, 3, 2)
TIME = InfoTimestamp(1 << 32)
SEC_BODY, SEC_PREFIX, SEC_POSTFIX, SRTPS_PREFIX, SRTPS_POSTFIX = range(0x30, 0x35)


def parts(*submessages: Submessage, receiver: GuidPrefix = GuidPrefix.UNKNOWN) -> list[tuple[GuidPrefix, list[str]]]:
    octets = HEADER + b"".join(submessage.encode() for submessage in submessages)
    described = message_parts(octets, Describer(), receiver=receiver)
    assert described.source == A
    return [(part.destination, part.texts) for part in described.parts]


def envelope(kind: int, transformation: int, key_id: int) -> Opaque:
    return Opaque(kind, 0, transformation.to_bytes(4, "big") + key_id.to_bytes(4, "big") + bytes(12))


def test_info_submessages_are_folded_into_what_they_serve() -> None:
    assert parts(TIME, DATA, HEARTBEAT) == [
        (GuidPrefix.UNKNOWN, ["DATA writer 1 #3", "HEARTBEAT writer 1 1..3 count 2"])
    ]


def test_each_destination_gets_its_part() -> None:
    assert parts(DATA, InfoDestination(B), HEARTBEAT, TIME, DATA, InfoDestination(C), HEARTBEAT) == [
        (GuidPrefix.UNKNOWN, ["DATA writer 1 #3"]),
        (B, ["HEARTBEAT writer 1 1..3 count 2", "DATA writer 1 #3"]),
        (C, ["HEARTBEAT writer 1 1..3 count 2"]),
    ]


def test_a_message_of_info_submessages_alone_says_them() -> None:
    assert parts(InfoDestination(B), TIME) == [
        (GuidPrefix.UNKNOWN, ["INFO_DST B, INFO_TS 1970-01-01T00:00:01.000000Z"])
    ]
    assert parts() == [(GuidPrefix.UNKNOWN, ["nothing"])]


def test_an_answer_without_info_dst_is_for_its_receiver() -> None:
    """Then the writer's name is the receiver's."""
    describer = Describer()
    describer.names.learn_submessage(_sedp())
    acknack = AckNack(READER.entity_id, WRITER.entity_id, NumberSet(4), 1)
    octets = Header((2, 4), b"\x01\xdd", B).encode() + acknack.encode()
    assert message_parts(octets, describer).parts[0].texts == ["ACKNACK writer 1 base 4 count 1"]
    assert message_parts(octets, describer, receiver=A).parts[0].texts == ["ACKNACK Square base 4 count 1"]


def _sedp() -> Data:
    topic = b"\x05\x00\x0c\x00\x07\x00\x00\x00Square\x00\x00"
    payload = b"\x00\x03\x00\x00" + b"\x5a\x00\x10\x00" + WRITER + topic + b"\x01\x00\x00\x00"
    return Data(EntityId.UNKNOWN, ids.SEDP_PUBLICATIONS_WRITER, 1, None, payload)


def test_envelopes_are_one_phrase() -> None:
    body = Opaque(SEC_BODY, 0, bytes(64))
    postfix, message_postfix = Opaque(SEC_POSTFIX, 0, bytes(20)), Opaque(SRTPS_POSTFIX, 0, bytes(20))
    encrypted = (envelope(SEC_PREFIX, 4, 0x1A2B3C4D), body, postfix)
    signed = (envelope(SEC_PREFIX, 3, 0x1A2B3C4D), DATA, postfix)
    assert parts(*encrypted) == [(GuidPrefix.UNKNOWN, ["protected AES256_GCM key 1a2b3c4d[64 octets]"])]
    assert parts(*signed) == [(GuidPrefix.UNKNOWN, ["protected AES256_GMAC key 1a2b3c4d[DATA writer 1 #3]"])]
    assert parts(envelope(SEC_PREFIX, 2, 0), body, postfix) == [
        (GuidPrefix.UNKNOWN, ["protected AES128_GCM Kx key[64 octets]"])
    ]
    ((destination, (text,)),) = parts(
        envelope(SRTPS_PREFIX, 1, 5), InfoDestination(B), *encrypted, HEARTBEAT, message_postfix
    )
    assert destination == B
    inside = "protected AES256_GCM key 1a2b3c4d[64 octets], HEARTBEAT writer 1 1..3 count 2"
    assert text == f"protected message AES128_GMAC key 00000005[{inside}]"


def test_an_envelope_that_is_never_closed_says_so() -> None:
    assert parts(envelope(SEC_PREFIX, 4, 7), DATA) == [
        (GuidPrefix.UNKNOWN, ["protected AES256_GCM key 00000007[DATA writer 1 #3] without its end"])
    ]
    assert parts(Opaque(SEC_POSTFIX, 0, bytes(4)), DATA) == [
        (GuidPrefix.UNKNOWN, ["SEC_POSTFIX 4 octets", "DATA writer 1 #3"])
    ]


def test_broken_messages_are_described_as_far_as_they_go() -> None:
    octets = HEADER + DATA.encode() + b"\x07\x01\xff\x00abc"
    (part,) = message_parts(octets, Describer()).parts
    assert part.texts == ["DATA writer 1 #3", "malformed HEARTBEAT at octet 52: 255 octets announced, 3 are left"]
    nothing = message_parts(b"\x00", Describer())
    assert nothing.source == GuidPrefix.UNKNOWN
    assert nothing.parts[0].texts == ["1 octet, not an RTPS message"]


def test_a_flood_of_submessages_is_cut() -> None:
    ((_, texts),) = parts(*[Pad(0)] * 1000)
    assert texts[-2:] == ["PAD 0 octets", "and 976 more"]
    assert len(texts) == 25
    ((_, (text,)),) = parts(*[envelope(SEC_PREFIX, 4, 7)] * 1000)
    assert len(text) < 3000


kinds = st.sampled_from([0, 1, 6, 7, 8, 9, 12, 13, 14, 15, 18, 19, 21, 22, 0x30, 0x31, 0x32, 0x33, 0x34, 0x80])
noise = st.builds(
    lambda kind, flags, body: Unknown(kind, flags, body).encode(), kinds, st.integers(0, 255), st.binary(max_size=80)
)


@given(st.lists(noise, max_size=8), st.binary(max_size=8))
def test_noise_never_raises(submessages: list[bytes], tail: bytes) -> None:
    described = message_parts(HEADER + b"".join(submessages) + tail, Describer(), receiver=B)
    assert described.parts
    assert all(text.isprintable() for part in described.parts for text in part.texts)
