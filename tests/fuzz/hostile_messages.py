"""Hostile datagrams, announcements and samples, for ``make_corpus``."""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator

from ddsi.messages.interpreter import InfoDestination
from ddsi.serialization import ParameterId
from ddsi.xtypes.type_object import TypeIdentifier, encode_identifier
from ddsi.xtypes.type_object.identifiers import MapIdentifier, PrimitiveIdentifier, SequenceIdentifier
from ddsi.xtypes.type_object.kinds import TypeKind
from tests.engine.wire import Stranger, engine

__all__ = ["MESSAGE_MAKERS", "Made"]

Made = tuple[str, bytes, str]
"""Name, octets, verdict."""

HEADER = b"RTPS\2\4\1\x10" + bytes(12)
MALFORMED = "MalformedMessage"
READER, WRITER = b"\0\0\2\4", b"\0\0\1\3"
U32_MAX = b"\xff\xff\xff\xff"
CDR_LE, PL_CDR_LE = b"\0\1\0\0", b"\0\3\0\0"
SENTINEL = b"\1\0\0\0"


def submessage(kind: int, body: bytes, *, flags: int = 1, length: int | None = None) -> bytes:
    return struct.pack("<BBH", kind, flags, len(body) if length is None else length) + body


def parameter(pid: int, value: bytes, *, length: int | None = None) -> bytes:
    return struct.pack("<HH", pid, len(value) if length is None else length) + value


def text(value: bytes, *, length: int | None = None) -> bytes:
    """A CDR string, padded; ``length`` in place of the true one."""
    octets = struct.pack("<I", len(value) + 1 if length is None else length) + value + b"\0"
    return octets + bytes(-len(octets) % 4)


# --- datagrams ----------------------------------------------------------------------------------------------------


def datagrams() -> Iterator[Made]:
    ids = READER + WRITER
    yield "nothing", b"", MALFORMED
    yield "header-cut-off", HEADER[:19], MALFORMED
    yield "not-rtps", b"HTTP" + HEADER[4:], MALFORMED
    yield "version-3", b"RTPS\3\0" + HEADER[6:], MALFORMED
    yield "length-beyond-the-end", HEADER + submessage(0x15, bytes(20), length=0xFFFF), MALFORMED
    yield "length-unaligned", HEADER + submessage(0x01, bytes(3)) + submessage(0x01, bytes(4)), MALFORMED
    yield "data-to-inline-qos-beyond-the-end", HEADER + submessage(0x15, b"\0\0\xfc\xff" + ids + bytes(12)), MALFORMED
    yield "data-number-0", HEADER + submessage(0x15, b"\0\0\x10\0" + ids + bytes(8)), MALFORMED
    yield "data-number-negative", HEADER + submessage(0x15, b"\0\0\x10\0" + ids + b"\xff" * 8), MALFORMED
    number_1 = struct.pack("<iI", 0, 1)
    data = b"\0\0\x10\0" + ids + number_1
    yield "data-key-and-sample", HEADER + submessage(0x15, data + bytes(8), flags=0x0D), MALFORMED
    yield "inline-qos-without-end", HEADER + submessage(0x15, data + parameter(0x70, bytes(16)), flags=3), MALFORMED
    long_parameter = parameter(0x70, bytes(4), length=0xFFFC)
    yield "inline-qos-length-beyond-the-end", HEADER + submessage(0x15, data + long_parameter, flags=3), MALFORMED
    many = parameter(0x8000, b"") * 15_000 + SENTINEL
    yield "inline-qos-of-15000-parameters", HEADER + submessage(0x15, data + many, flags=3), MALFORMED
    fragment = b"\0\0\x1c\0" + ids + number_1
    numbers = struct.pack("<IHHI", 0, 1, 1000, 1000)
    yield "fragment-number-0", HEADER + submessage(0x16, fragment + numbers + bytes(1000)), MALFORMED
    numbers = struct.pack("<IHHI", 1, 1, 0, 1000)
    yield "fragment-size-0", HEADER + submessage(0x16, fragment + numbers + bytes(1000)), MALFORMED
    numbers = struct.pack("<IHHI", 0xFFFFFFFF, 0xFFFF, 0xFFFF, 0xFFFFFFFF)
    yield "fragments-beyond-the-sample", HEADER + submessage(0x16, fragment + numbers + bytes(100)), MALFORMED
    numbers = struct.pack("<IHHI", 1, 0xFFFF, 0xFFFF, 0xFFFFFFFF)
    yield "fragments-that-are-not-there", HEADER + submessage(0x16, fragment + numbers + bytes(100)), MALFORMED
    # A GAP may leave out everything (CVE-2025-64438): well-formed, and to be stored as an interval.
    everything = struct.pack("<iIiII", 0, 1, 0x7FFFFFFF, 0xFFFFFFFF, 0)
    yield "gap-of-everything", HEADER + submessage(0x08, ids + everything), "accepted"
    base_0 = struct.pack("<iIiII", 0, 1, 0, 0, 1) + bytes(4)
    yield "gap-with-base-0", HEADER + submessage(0x08, ids + base_0), MALFORMED
    # Bitmaps: more bits than the protocol has, and more words than are there (CVE-2020-18734).
    too_many = struct.pack("<iII", 0, 1, 257) + bytes(36)
    yield "acknack-of-257-bits", HEADER + submessage(0x06, ids + too_many + bytes(4)), MALFORMED
    yield "acknack-of-4-billion-bits", HEADER + submessage(0x06, ids + struct.pack("<iII", 0, 1, 0xFFFFFFFF)), MALFORMED
    yield (
        "acknack-bitmap-cut-off",
        HEADER + submessage(0x06, ids + struct.pack("<iII", 0, 1, 256) + bytes(8)),
        MALFORMED,
    )
    yield "nack-frag-of-257-bits", HEADER + submessage(0x12, ids + number_1 + struct.pack("<II", 1, 257)), MALFORMED
    backwards = struct.pack("<iIiII", 0, 9, 0, 1, 1)
    yield "heartbeat-backwards", HEADER + submessage(0x07, ids + backwards), MALFORMED
    highest = struct.pack("<iIiII", 0x7FFFFFFF, 0xFFFFFFFF, 0x7FFFFFFF, 0xFFFFFFFF, 1)
    yield "heartbeat-of-the-highest-number", HEADER + submessage(0x07, ids + highest), "accepted"
    yield "info-reply-of-4-billion-locators", HEADER + submessage(0x0F, U32_MAX), MALFORMED
    yield "info-reply-locators-cut-off", HEADER + submessage(0x0F, struct.pack("<I", 2) + bytes(24)), MALFORMED


def conversations() -> Iterator[Made]:
    """To an engine, by a peer that it is matched with."""
    stranger, ours = Stranger(), engine()
    for_ours = InfoDestination(ours.guid.prefix).encode()
    theirs = stranger.endpoint(1, is_writer=True).entity_id, stranger.endpoint(1, is_writer=False).entity_id
    writer_to_us, reader_to_us = b"\0\0\2\4" + theirs[0], theirs[1] + b"\0\0\1\3"

    def said(*submessages: bytes) -> bytes:
        return stranger.message(for_ours, *submessages)

    yield "nothing", b"", "dropped"
    everything = struct.pack("<iIiII", 0, 1, 0x7FFFFFFF, 0xFFFFFFFF, 0)
    yield "gap-of-everything", said(submessage(0x08, writer_to_us + everything)), "dropped"
    far = struct.pack("<iIiII", 0x7FFFFFFE, 1, 0x7FFFFFFE, 9, 7)
    yield "heartbeat-far-ahead", said(submessage(0x07, writer_to_us + far)), "dropped"
    wide = struct.pack("<iIiII", 0, 1, 0x7FFFFFFE, 9, 7)
    yield "heartbeat-of-everything", said(submessage(0x07, writer_to_us + wide)), "dropped"
    asks = [struct.pack("<iII8II", 0, 1, 256, *[0xFFFFFFFF] * 8, count) for count in range(1, 14)]
    yield "acknacks-for-all", b"".join(said(submessage(0x06, reader_to_us + ask)) for ask in asks), "accepted"
    beyond = struct.pack("<iIII", 0x7FFFFFFF, 0xFFFFFFFF, 0, 1)
    yield "acknack-of-what-was-never-written", said(submessage(0x06, reader_to_us + beyond)), "dropped"
    fragment = b"\0\0\x1c\0" + writer_to_us + struct.pack("<iI", 0, 1)
    huge = struct.pack("<IHHI", 1, 1, 100, 0xFFFFFFFF) + bytes(100)
    yield "fragment-of-4-gigabytes", said(submessage(0x16, fragment + huge)), "dropped"
    sizes = [struct.pack("<IHHI", 1, 1, 100, size) + bytes(100) for size in (200, 60_000, 300, 200)]
    changing = b"".join(said(submessage(0x16, fragment + size)) for size in sizes)
    yield "fragments-that-change-their-mind", changing, "dropped"


# --- announcements ------------------------------------------------------------------------------------------------


def spdp() -> Iterator[Made]:
    guid = parameter(ParameterId.PARTICIPANT_GUID, Stranger().guid)
    vendor = parameter(ParameterId.VENDORID, b"\1\x55\0\0") + parameter(ParameterId.PROTOCOL_VERSION, b"\2\4\0\0")
    # Domain id, then any default_unicast locator would do; these are the members that every announcement has.
    endpoints = parameter(ParameterId.BUILTIN_ENDPOINT_SET, b"\x3f\x0c\0\0")
    alive = PL_CDR_LE + guid + vendor + endpoints

    yield "least", alive + SENTINEL, "accepted"
    yield "nothing", b"", MALFORMED
    yield "not-a-parameter-list", CDR_LE + guid + SENTINEL, MALFORMED
    yield "without-guid", PL_CDR_LE + vendor + endpoints + SENTINEL, MALFORMED
    yield "guid-of-somebody-else", alive.replace(Stranger().prefix, bytes(12)) + SENTINEL, MALFORMED
    yield "without-end", alive, MALFORMED
    yield "length-beyond-the-end", alive + parameter(0x59, bytes(4), length=0xFFFC), MALFORMED
    yield "length-unaligned", alive + parameter(0x59, bytes(4), length=3) + SENTINEL, MALFORMED
    yield "guid-of-3-octets", PL_CDR_LE + parameter(ParameterId.PARTICIPANT_GUID, bytes(4)) + SENTINEL, MALFORMED
    user_data = parameter(ParameterId.USER_DATA, U32_MAX + bytes(8))
    yield "user-data-of-4-gigabytes", alive + user_data + SENTINEL, MALFORMED
    name = parameter(ParameterId.ENTITY_NAME, text(b"name", length=0xFFFFFFF0))
    yield "name-of-4-gigabytes", alive + name + SENTINEL, MALFORMED
    name = parameter(ParameterId.ENTITY_NAME, text(b"", length=0))
    yield "name-of-length-0", alive + name + SENTINEL, "accepted"
    properties = parameter(ParameterId.PROPERTY_LIST, U32_MAX + bytes(8))
    yield "properties-4-billion", alive + properties + SENTINEL, MALFORMED
    lease = parameter(ParameterId.PARTICIPANT_LEASE_DURATION, struct.pack("<iI", -1, 0))
    yield "lease-negative", alive + lease + SENTINEL, MALFORMED
    locator = parameter(0x0032, struct.pack("<iI16s", 1, 7410, b"\0" * 12 + b"\x7f\0\0\1"))
    yield "locators-2000", alive + locator * 2000 + SENTINEL, MALFORMED
    # Carried unread: what is in a token is the security plugins' affair (see data_holder), in little endian.
    token = parameter(ParameterId.IDENTITY_TOKEN, text(b"DDS:Auth:PKI-DH:1.0", length=0x7FFFFFFF))
    yield "identity-token-length-2-gigabytes", alive + token + SENTINEL, "accepted"
    big = struct.pack(">HH", ParameterId.IDENTITY_TOKEN, 8) + b"\x7f\xff\xff\xff" + bytes(4)
    guid_big = struct.pack(">HH", ParameterId.PARTICIPANT_GUID, 16) + Stranger().guid
    yield "identity-token-big-endian-length-2-gigabytes", b"\0\2\0\0" + guid_big + big + b"\0\1\0\0", MALFORMED


def sedp() -> Iterator[Made]:
    endpoint = parameter(ParameterId.ENDPOINT_GUID, Stranger().prefix + b"\0\0\1\2")
    type_name = parameter(ParameterId.TYPE_NAME, text(b"ShapeType"))
    names = parameter(ParameterId.TOPIC_NAME, text(b"Square")) + type_name
    announced = PL_CDR_LE + endpoint + names

    yield "without-guid", PL_CDR_LE + names + SENTINEL, MALFORMED
    yield "without-topic", PL_CDR_LE + endpoint + SENTINEL, MALFORMED
    topic = parameter(ParameterId.TOPIC_NAME, text(b"T" * 5000))
    yield "topic-of-5000-characters", PL_CDR_LE + endpoint + topic + type_name + SENTINEL, MALFORMED
    topic = parameter(ParameterId.TOPIC_NAME, text(b"\xff\xfe\xfd"))
    yield "topic-that-is-not-utf-8", PL_CDR_LE + endpoint + topic + type_name + SENTINEL, MALFORMED
    partition = parameter(ParameterId.PARTITION, U32_MAX + bytes(4))
    yield "partitions-4-billion", announced + partition + SENTINEL, MALFORMED
    reliability = parameter(ParameterId.RELIABILITY, struct.pack("<IiI", 77, 0, 0))
    yield "reliability-of-kind-77", announced + reliability + SENTINEL, MALFORMED
    deadline = parameter(ParameterId.DEADLINE, struct.pack("<iI", -1, 0))
    yield "deadline-negative", announced + deadline + SENTINEL, MALFORMED


def sedp_reader() -> Iterator[Made]:
    """As a writer's; a reader may have a content filter as well."""
    yield from sedp()
    endpoint = parameter(ParameterId.ENDPOINT_GUID, Stranger().prefix + b"\0\0\1\7")
    names = parameter(ParameterId.TOPIC_NAME, text(b"Square")) + parameter(ParameterId.TYPE_NAME, text(b"ShapeType"))
    content_filter = parameter(0x35, text(b"") + text(b"") + text(b"") + text(b"") + U32_MAX)
    yield "content-filter-of-4-billion-parameters", PL_CDR_LE + endpoint + names + content_filter + SENTINEL, MALFORMED


def participant_messages() -> Iterator[Made]:
    yield "data-of-4-gigabytes", CDR_LE + Stranger().prefix + b"\0\0\0\1" + U32_MAX, MALFORMED
    yield "cut-off", CDR_LE + Stranger().prefix, MALFORMED
    yield "said-to-be-a-parameter-list", PL_CDR_LE + bytes(24), "accepted"


def samples() -> Iterator[Made]:
    """Of ShapeType, the first of the types."""
    first = b"\0"
    yield "nothing", b"", "MalformedSample"
    yield "string-of-4-gigabytes", first + CDR_LE + U32_MAX + b"BLUE", "MalformedSample"
    yield "string-of-length-0", first + CDR_LE + bytes(16), "accepted"
    yield "string-cut-off", first + CDR_LE + struct.pack("<I", 5) + b"BL", "MalformedSample"
    yield "string-not-terminated", first + CDR_LE + struct.pack("<I", 4) + b"BLUE" + bytes(12), "MalformedSample"
    yield "unknown-representation", first + b"\x77\x77\0\0" + bytes(20), "MalformedSample"
    longer = first + b"\0\x09\0\0" + struct.pack("<I", 0xFFFFFFFF) + text(b"BLUE") + bytes(12)
    yield "delimiter-of-4-gigabytes", longer, "MalformedSample"


# --- types of peers -----------------------------------------------------------------------------------------------


def type_objects() -> Iterator[Made]:
    """The first octet says what follows: 0 an identifier, 2 a TypeObject, 4 a TypeInformation; 1 more: big endian."""

    def framed(body: bytes, length: int | None = None) -> bytes:
        return struct.pack("<I", len(body) if length is None else length) + body

    def struct_object(members: bytes) -> bytes:
        return b"\2" + framed(b"\xf1\x51\1\0" + framed(bytes(4)) + framed(members))

    sequence: TypeIdentifier = PrimitiveIdentifier(TypeKind.INT32)
    map_ = sequence
    for _ in range(150):
        sequence, map_ = SequenceIdentifier(sequence), MapIdentifier(map_, PrimitiveIdentifier(TypeKind.INT32))
    yield "nothing", b"", MALFORMED
    yield "nested-sequences", b"\0" + encode_identifier(sequence), MALFORMED + " ~ deeper"
    yield "nested-map-keys", b"\0" + encode_identifier(map_), MALFORMED + " ~ deeper"
    yield "array-of-4294967295-dimensions", b"\0\x91\xf3\1\0" + U32_MAX, MALFORMED + " ~ sequence of 4294967295"
    yield "array-of-70000-dimensions", b"\0\x90\xf3\1\0" + struct.pack("<I", 70_000), MALFORMED + " ~ no type has"
    yield "component-index-0", b"\0\xb0\0\0\0" + framed(b"\xf1" + bytes(23)), MALFORMED + " ~ type 0"
    yield "component-of-a-primitive", b"\0\xb0\0\0\0" + framed(b"\4" + bytes(23)), MALFORMED + " ~ component"
    yield "unknown-identifier-of-2-gibibytes", b"\0\xc7\0\0\0" + struct.pack("<I", 1 << 31), MALFORMED
    yield "object-without-kind", b"\2" + framed(b"\xf3\x51"), MALFORMED + " ~ kind 0xf3"
    yield "object-of-an-annotation", b"\2" + framed(b"\xf1\x50"), MALFORMED + " ~ kind 0x50"
    yield "object-longer-than-all", b"\2" + framed(b"\xf1\x51", 0xFFFFFFFC), MALFORMED
    yield "members-beyond-the-end", struct_object(struct.pack("<I", 65_535) + bytes(24)), MALFORMED + " ~ 65535"
    yield "members-of-no-octets", struct_object(struct.pack("<I", 200) + bytes(1600)), MALFORMED
    yield "member-longer-than-its-sequence", struct_object(struct.pack("<II", 1, 999) + bytes(24)), MALFORMED
    alias = b"\xf2\x30\0\0" + framed(bytes(4) + framed(b"A\x1b[31m\0")[:12] + bytes(1)) + bytes(3) + framed(bytes(5))
    yield "name-with-escapes", b"\2" + framed(alias), MALFORMED + " ~ name"
    yield "information-empty", b"\4" + framed(b""), "accepted"
    yield "information-endless", b"\4" + framed(b"\1\x10\0\x40" * 200), MALFORMED
    skipped = struct.pack("<II", 7 << 28 | 5, 1 << 30)
    yield "information-with-a-member-of-8-gibibytes", b"\4" + framed(skipped), MALFORMED
    many = bytes(4) + struct.pack("<i", 100) + framed(struct.pack("<I", 100) + bytes(64))
    half = framed(framed(framed(bytes(8)) + many))
    yield "dependencies-beyond-the-end", b"\4" + framed(b"\1\x10\0\x40" + half), MALFORMED


def type_lookups() -> Iterator[Made]:
    """The first octet says which: 0 a question, 1 an answer."""
    head = b"\0\7\0\0" + bytes(24)

    def framed(body: bytes, length: int | None = None) -> bytes:
        return struct.pack("<I", len(body) if length is None else length) + body

    def question(members: bytes, operation: int = 0x018252D3) -> bytes:
        return b"\0" + head + struct.pack("<I", 1) + bytes(4) + framed(struct.pack("<I", operation) + framed(members))

    def answer(members: bytes) -> bytes:
        return b"\1" + head + bytes(4) + framed(struct.pack("<I", 0x018252D3) + framed(bytes(4) + framed(members)))

    ids, types, point = (struct.pack("<I", 5 << 28 | member) for member in (0x0C536065, 0x02804AD1, 0x0508E3D2))
    yield "nothing", b"", MALFORMED
    yield "question-of-nothing", question(b""), "accepted"
    yield "question-of-no-operation", question(b"", 7), MALFORMED + " ~ operation"
    yield "question-in-plain-cdr", b"\0\0\1\0\0" + bytes(60), MALFORMED + " ~ CDR_LE"
    yield "identifiers-beyond-the-end", question(ids + framed(struct.pack("<I", 60_000) + bytes(99))), MALFORMED
    yield "identifiers-of-4-gigabytes", question(ids + framed(U32_MAX, 0xFFFFFFFC)), MALFORMED
    yield "identifiers-by-the-thousand", question(ids + framed(struct.pack("<I", 40_000) + b"\4" * 40_000)), "accepted"
    yield "continuation-of-100-octets", question(point + framed(bytes(100))), MALFORMED + " ~ 100 octets"
    yield "name-of-300-octets", b"\0" + head + framed(b"x" * 300 + b"\0"), MALFORMED + " ~ 300 characters"
    yield "members-without-end", question(struct.pack("<I", 1 << 28) * 500), MALFORMED
    hashed = b"\xf1" + bytes(15)
    yield (
        "a-type-that-is-another",
        answer(types + framed(struct.pack("<I", 1) + hashed + framed(b"\xf1\x51" + bytes(42)))),
        MALFORMED,
    )
    yield (
        "a-type-longer-than-all",
        answer(types + framed(struct.pack("<I", 1) + hashed + framed(b"", 0x7FFFFFFC))),
        MALFORMED,
    )
    yield "types-beyond-the-end", answer(types + framed(struct.pack("<I", 65_536) + bytes(24))), MALFORMED
    yield "an-exception", b"\1" + head + bytes([1, 0, 0, 0]), "accepted"


MESSAGE_MAKERS: dict[str, Callable[[], Iterator[Made]]] = {
    "datagram": datagrams,
    "conversation": conversations,
    "spdp": spdp,
    "sedp_writer": sedp,
    "sedp_reader": sedp_reader,
    "participant_message": participant_messages,
    "sample": samples,
    "type_object": type_objects,
    "type_lookup": type_lookups,
}
