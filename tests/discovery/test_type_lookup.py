"""The messages of the TypeLookup service: as Cyclone DDS 11.0.1 sends them, both ways, and as nobody should."""

from __future__ import annotations

import pytest

from ddsi.discovery.type_lookup import (
    FoundDependencies,
    FoundTypes,
    GetDependencies,
    GetTypes,
    TypeLookupReply,
    TypeLookupRequest,
    decode_reply,
    decode_request,
    encode_reply,
    encode_request,
    instance_name,
)
from ddsi.structure.errors import MalformedMessage
from ddsi.structure.guid import Guid
from ddsi.xtypes.type_object import HashIdentifier, decode_type_object, encode_type_object, equivalence_hash
from ddsi.xtypes.type_object.identifiers import PrimitiveIdentifier, SequenceIdentifier, StringIdentifier
from ddsi.xtypes.type_object.information import SizedIdentifier
from ddsi.xtypes.type_object.kinds import MINIMAL, TypeKind

# Recorded between two processes of Cyclone DDS 11.0.1: a reader of {key int32 k; sequence<Point> p} asks for the type
# of a writer that has a string more.
REQUEST = bytes.fromhex(
    "00070001"  # CDR2_LE, one octet of padding
    "0110cff54fc39c1073ad6846000300c3"  # who asks: its request writer
    "0000000001000000"  # its first request
    "31000000" + b"dds.builtin.TOS.011039f7dd5fb83db31cf725000001c1\0".hex() + "000000"
    "23000000d3528201"  # DHEADER, getTypes
    "1b0000006560535c13000000"  # DHEADER, type_ids, DHEADER
    "01000000f150ebb00f2395af1aa3e2648032d100"
)
REPLY = bytes.fromhex(
    "00070000"
    "0110cff54fc39c1073ad6846000300c30000000001000000"  # the request that it answers
    "00000000"  # no remote exception
    "94000000d3528201"  # DHEADER, getTypes
    "8c00000000000000"  # DHEADER, RETCODE_OK
    "84000000d14a805270000000"  # DHEADER, types, DHEADER
    "01000000f150ebb00f2395af1aa3e2648032d100"
    "58000000f151020001000000000000004800000003000000"  # the TypeObject
    "0b000000000000002100048ce4b16b00"
    "1e00000001000000010080f1010000f116e6316671235e4499abccc0093683878c910000"
    "0c0000000200000001007000ea9f91b2"
    "77658e5b0400000000000000"  # complete_to_minimal, none
)
SERVER = Guid(bytes.fromhex("011039f7dd5fb83db31cf725000001c1"))
ASKER = Guid(bytes.fromhex("0110cff54fc39c1073ad6846000300c3"))
WANTED = HashIdentifier(MINIMAL, bytes.fromhex("50ebb00f2395af1aa3e2648032d1"))
POINT = HashIdentifier(MINIMAL, bytes.fromhex("16e6316671235e4499abccc00936"))
CONTINUED = b"\0\0\1\0"

REQUESTS = [
    TypeLookupRequest((ASKER, 1), instance_name(SERVER), GetTypes((WANTED,))),
    TypeLookupRequest((ASKER, 1 << 33), "", GetTypes(())),
    TypeLookupRequest((ASKER, 2), "x", GetDependencies((WANTED, POINT), CONTINUED)),
    TypeLookupRequest((ASKER, 3), instance_name(SERVER), GetDependencies((SequenceIdentifier(StringIdentifier(7)),))),
]
_OBJECT = bytes(decode_reply(REPLY).result.types[0][1])  # type: ignore[union-attr]
REPLIES = [
    TypeLookupReply((ASKER, 1), FoundTypes(((WANTED, _OBJECT),))),
    TypeLookupReply((ASKER, 2), FoundTypes((), ((POINT, WANTED),))),
    TypeLookupReply((ASKER, 3), FoundDependencies((SizedIdentifier(POINT, 55),), CONTINUED)),
    TypeLookupReply((ASKER, 4), FoundDependencies(())),
]


def test_a_request_is_what_cyclone_dds_sends() -> None:
    assert decode_request(REQUEST) == REQUESTS[0]
    assert encode_request(REQUESTS[0]) == REQUEST


def test_a_reply_is_what_cyclone_dds_sends() -> None:
    assert decode_reply(REPLY) == REPLIES[0]
    assert encode_reply(REPLIES[0]) == REPLY


def test_the_octets_of_a_type_object_are_those_that_are_hashed() -> None:
    assert equivalence_hash(_OBJECT) == WANTED.hash
    assert encode_type_object(decode_type_object(_OBJECT)) == _OBJECT


@pytest.mark.parametrize("request_", REQUESTS)
def test_requests_come_back(request_: TypeLookupRequest) -> None:
    assert decode_request(encode_request(request_)) == request_


@pytest.mark.parametrize("reply", REPLIES)
def test_replies_come_back(reply: TypeLookupReply) -> None:
    assert decode_reply(encode_reply(reply)) == reply


def test_a_length_before_the_dheader_is_taken_too() -> None:
    """Length code 4 says the length once more; which of the two is used, writers choose."""
    begin = REQUEST.index(bytes.fromhex("23000000d3528201"))
    longer = REQUEST[:begin] + bytes.fromhex(
        "27000000d35282011f0000006560534c170000001300000001000000f150ebb00f2395af1aa3e2648032d100"
    )
    assert decode_request(longer) == REQUESTS[0]


def test_members_of_later_versions_are_skipped() -> None:
    begin = REQUEST.index(bytes.fromhex("23000000d3528201"))
    longer = REQUEST[:begin] + bytes.fromhex(
        "33000000d35282012b00000001000020aabbccdd0200000000000000"
        "6560535c1300000001000000f150ebb00f2395af1aa3e2648032d100"
    )  # fmt: skip
    assert decode_request(longer) == REQUESTS[0]


def test_a_reply_that_refuses_has_no_result() -> None:
    exception = bytearray(REPLY)
    exception[28] = 1
    assert decode_reply(exception) == TypeLookupReply((ASKER, 1), None)
    failed = bytearray(REPLY)
    failed[44] = 1  # return code
    assert decode_reply(failed) == TypeLookupReply((ASKER, 1), None)
    other = bytearray(REPLY)
    other[36] ^= 1  # operation
    assert decode_reply(other) == TypeLookupReply((ASKER, 1), None)


@pytest.mark.parametrize("at", range(len(REQUEST) - 1))
def test_every_prefix_of_a_request_is_malformed(at: int) -> None:
    with pytest.raises(MalformedMessage):
        decode_request(REQUEST[:at])


@pytest.mark.parametrize("at", range(len(REPLY)))
def test_every_prefix_of_a_reply_is_malformed(at: int) -> None:
    with pytest.raises(MalformedMessage):
        decode_reply(REPLY[:at])


@pytest.mark.parametrize(
    ("octets", "reason"),
    [
        (b"\0\1" + REQUEST[2:], "in CDR_LE"),
        (REQUEST.replace(bytes.fromhex("d3528201"), bytes.fromhex("d3528202")), "operation"),
        (REQUEST.replace(bytes.fromhex("1300000001000000"), bytes.fromhex("13000000ffff0000")), "65535 elements"),
        (REQUEST.replace(bytes.fromhex("6560535c"), bytes.fromhex("6560532c")), "length code 2"),
    ],
)
def test_what_is_no_request_is_malformed(octets: bytes, reason: str) -> None:
    with pytest.raises(MalformedMessage, match=reason):
        decode_request(octets)


def test_a_continuation_point_is_bounded() -> None:
    request = TypeLookupRequest((ASKER, 1), "", GetDependencies((PrimitiveIdentifier(TypeKind.INT32),), bytes(33)))
    with pytest.raises(MalformedMessage, match="33 octets"):
        decode_request(encode_request(request))
