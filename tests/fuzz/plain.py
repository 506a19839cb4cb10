"""Targets without security: datagrams, announcements, samples, and a whole engine that hears what strangers say."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from itertools import islice

from ddsi.config import Config
from ddsi.discovery.parameters import decode_participant, decode_reader, decode_writer
from ddsi.discovery.participant_message import ParticipantMessageData
from ddsi.discovery.type_lookup import FoundTypes, decode_reply, decode_request, encode_reply, encode_request
from ddsi.engine import Participant
from ddsi.engine.type_registry import TypeRegistry
from ddsi.messages.receiver import MessageReceiver
from ddsi.messages.submessages import Data
from ddsi.structure import builtin_entity_ids as ids
from ddsi.structure.builtin_topic_data import (
    ParticipantBuiltinTopicData,
    PublicationBuiltinTopicData,
    SubscriptionBuiltinTopicData,
)
from ddsi.structure.cache_change import ChangeKind
from ddsi.structure.errors import MalformedMessage, MalformedSample
from ddsi.structure.guid import EntityId
from ddsi.structure.qos import Qos, reader_qos, writer_qos
from ddsi.structure.qos_policies import KeepAll, Reliable, TransientLocal
from ddsi.structure.vendor import CYCLONE
from ddsi.xtypes import type_support
from ddsi.xtypes.type_object import (
    HashedIdentifier,
    decode_identifier,
    decode_type_information,
    decode_type_object,
)
from tests.captures.capture import PLAIN, load
from tests.discovery.test_type_lookup import REPLIES, REPLY, REQUEST, REQUESTS
from tests.engine.wire import VENDOR, Stranger, engine
from tests.fuzz.target import ACCEPTED, Target, verdict
from tests.xtypes.type_object.vectors import VECTORS as TYPE_OBJECTS
from tests.xtypes.vector_types import TYPES
from tests.xtypes.vectors import VECTORS

__all__ = ["PLAIN_TARGETS"]


# --- datagrams ----------------------------------------------------------------------------------------------------


def datagram(octets: bytes) -> str:
    """Every submessage that can be read can be written."""
    return verdict(lambda: [submessage.encode() for submessage, _ in MessageReceiver(octets)], MalformedMessage)


def captured_datagrams() -> Iterator[bytes]:
    """Three of each vendor's kinds, as different as possible: the first, and two from the middle."""
    for name in PLAIN:
        datagrams = [octets for octets in load(name).datagrams if len(octets) <= 2000]
        yield from {datagrams[0], datagrams[len(datagrams) // 2], datagrams[-len(datagrams) // 3]}


# --- a whole engine -----------------------------------------------------------------------------------------------

RELIABLE = Qos(reliability=Reliable(), history=KeepAll())
HISTORY = RELIABLE | Qos(durability=TransientLocal())
BOUNDS = Config(max_participants=10, max_endpoints=40, max_sample_size=1 << 16, max_defrag_octets=1 << 18)
MOST_DATAGRAMS = 16


def matched_engine() -> tuple[Participant, Stranger]:
    """With a reliable writer and reader that are matched with a stranger's."""
    participant, stranger = engine(config=BOUNDS), Stranger()
    writer = participant.create_writer("Out", "T", writer_qos(HISTORY), 0.0, is_keyed=False)
    participant.create_reader("In", "T", reader_qos(RELIABLE), 0.0, is_keyed=False)
    for kind in (ParticipantBuiltinTopicData, PublicationBuiltinTopicData, SubscriptionBuiltinTopicData):
        participant.builtin_readers.create(kind, 0.0)
    stranger.introduce(participant)
    for octets in (stranger.sedp_writer(1, "In", RELIABLE), stranger.sedp_reader(1, "Out", HISTORY)):
        participant.receive_datagram(octets, stranger.address, 0.0)
    for number in range(3):
        participant.write(writer, ChangeKind.ALIVE, b"\0\1\0\0" + bytes(number * 1000), b"", 0.0)
    participant.drain_effects()
    return participant, stranger


def conversation(octets: bytes) -> str:
    """Datagrams, each up to the next "RTPS", and what the engine does about them in the minute that follows."""
    participant, stranger = matched_engine()
    now = 0.0
    for piece in octets.removeprefix(b"RTPS").split(b"RTPS", MOST_DATAGRAMS):
        now += 0.01
        participant.receive_datagram(b"RTPS" + piece, stranger.address, now)
        participant.drain_effects()
    woken = 0
    while participant.next_deadline() <= 60:
        woken += 1
        assert woken < 5000, "timers without end"
        now = max(now, participant.next_deadline())
        participant.handle_timeout(now)
        participant.drain_effects()
    assert participant.defrag_budget.octets <= BOUNDS.max_defrag_octets
    assert len(participant.participants) <= BOUNDS.max_participants
    return "dropped" if participant.drops.total() else ACCEPTED


def conversations() -> Iterator[bytes]:
    """What real stacks said, in the name of the stranger that is known."""
    prefix = Stranger().prefix
    for name in PLAIN[::3]:
        short = (octets for octets in load(name).datagrams if len(octets) <= 800)
        yield b"".join(octets[:8] + prefix + octets[20:] for octets in islice(short, 5))


# --- announcements ------------------------------------------------------------------------------------------------


def spdp(octets: bytes) -> str:
    prefix = Stranger().prefix
    return verdict(
        lambda: decode_participant(octets, source_prefix=prefix, vendor_id=VENDOR, protocol_version=(2, 4)),
        MalformedMessage,
    )


def sedp_writer(octets: bytes) -> str:
    return verdict(lambda: decode_writer(octets, CYCLONE), MalformedMessage)


def sedp_reader(octets: bytes) -> str:
    return verdict(lambda: decode_reader(octets, CYCLONE), MalformedMessage)


def participant_message(octets: bytes) -> str:
    return verdict(lambda: ParticipantMessageData.decode(octets), MalformedMessage)


def announcements() -> Iterator[bytes]:
    """As captured, but in the name of the stranger."""
    for payload in captured_payloads(ids.SPDP_WRITER):
        at = payload.index(b"\x50\0\x10\0") + 4
        yield payload.replace(payload[at : at + 12], Stranger().prefix)


@cache
def captured_payloads(writer_id: EntityId) -> tuple[bytes, ...]:
    """Of one builtin writer: one of each capture's."""
    found: dict[str, bytes] = {}
    for name in PLAIN:
        for octets in load(name).datagrams:
            for submessage, _ in MessageReceiver(octets):
                if isinstance(submessage, Data) and submessage.writer_id == writer_id and not submessage.is_key:
                    found.setdefault(name, bytes(submessage.serialized_payload))
    return tuple(dict.fromkeys(found.values()))


# --- samples ------------------------------------------------------------------------------------------------------


def sample(octets: bytes) -> str:
    """One of the types, by the first octet; the payload is what follows."""
    supports = [type_support(class_) for class_ in TYPES.values()]
    support = supports[octets[0] % len(supports)] if octets else supports[0]
    payload = octets[1:]
    found = verdict(lambda: support.deserialize(payload), MalformedSample)
    again = verdict(lambda: support.deserialize(memoryview(payload)), MalformedSample)
    assert found.partition(":")[0] == again.partition(":")[0], "there is one reader for each of the two"
    return found


def samples() -> Iterator[bytes]:
    """What a real peer serialised."""
    for vector in VECTORS:
        index = list(TYPES.values()).index(vector.type)
        for kind, octets in vector.octets.items():
            if kind.startswith("xcdr"):
                yield bytes([index]) + octets


# --- types of peers -----------------------------------------------------------------------------------------------


def type_object(octets: bytes) -> str:
    """An identifier, a TypeObject or a TypeInformation, by the first octet, in either byte order."""
    kind = octets[0] if octets else 0
    decode = (decode_identifier, decode_type_object, decode_type_information)[kind // 2 % 3]
    return verdict(lambda: decode(octets[1:], little_endian=not kind & 1), MalformedMessage)


def type_objects() -> Iterator[bytes]:
    """What a real peer made of its types."""
    for vector in TYPE_OBJECTS:
        yield b"\0" + bytes.fromhex(vector["type_identifier_minimal"])
        yield b"\4" + bytes.fromhex(vector["type_information"])
        for kind in "minimal", "complete":
            for octets in vector.get(f"type_objects_{kind}", {}).values():
                yield b"\2" + bytes.fromhex(octets)


def type_lookup(octets: bytes) -> str:
    """A question of the TypeLookup service, or with the first octet odd an answer, whose types are taken."""
    if not octets or not octets[0] & 1:
        return verdict(lambda: decode_request(octets[1:]), MalformedMessage)

    def take() -> None:
        reply = decode_reply(octets[1:])
        for identifier, type_object in reply.result.types if isinstance(reply.result, FoundTypes) else ():
            if isinstance(identifier, HashedIdentifier):
                TypeRegistry().add(bytes(12), identifier, type_object)

    return verdict(take, MalformedMessage)


def lookups() -> Iterator[bytes]:
    """Recorded ones, and what is never recorded: lists of dependencies."""
    yield b"\0" + REQUEST
    yield b"\1" + REPLY
    for request in REQUESTS:
        yield b"\0" + encode_request(request)
    for reply in REPLIES:
        yield b"\1" + encode_reply(reply)


PLAIN_TARGETS = {
    "datagram": Target(datagram, captured_datagrams, 2048, enormous=60_000),
    "conversation": Target(conversation, conversations, 4096, enormous=60_000, good="dropped"),
    "spdp": Target(spdp, announcements, 2048),
    "sedp_writer": Target(sedp_writer, lambda: captured_payloads(ids.SEDP_PUBLICATIONS_WRITER), 2048),
    "sedp_reader": Target(sedp_reader, lambda: captured_payloads(ids.SEDP_SUBSCRIPTIONS_WRITER), 2048),
    "participant_message": Target(participant_message, lambda: captured_payloads(ids.PARTICIPANT_MESSAGE_WRITER), 512),
    "sample": Target(sample, samples, 512),
    "type_object": Target(type_object, type_objects, 1024),
    "type_lookup": Target(type_lookup, lookups, 1024),
}
