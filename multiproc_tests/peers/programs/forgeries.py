"""What an intruder makes of what he has recorded: altered, spliced and invented messages, and a key for none of them.

Everything here is a stream of octets to be sent; :mod:`.intruder` records, sends and takes orders.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from random import Random

from ddsi.discovery.endpoint_parameters import encode_writer
from ddsi.discovery.parameters import encode_key
from ddsi.discovery.participant_parameters import decode_participant, encode_participant
from ddsi.messages.acknack import AckNack
from ddsi.messages.data import Data
from ddsi.messages.data_frag import DataFrag
from ddsi.messages.gap import Gap
from ddsi.messages.heartbeat import Heartbeat
from ddsi.messages.interpreter import InfoDestination
from ddsi.messages.raw_submessage import SubmessageKind, iterate_submessages
from ddsi.serialization import ParameterId, ParameterList
from ddsi.structure import builtin_entity_ids as ids
from ddsi.structure.discovered import DiscoveredParticipantData, DiscoveredWriterData
from ddsi.structure.errors import MalformedMessage
from ddsi.structure.guid import GUID_UNKNOWN, EntityId, EntityKind, Guid, GuidPrefix
from ddsi.structure.locator import Locator
from ddsi.structure.qos import EndpointQos
from ddsi.structure.sequence_number import NumberSet
from ddsi.structure.vendor import OUR_VENDOR_ID, VendorId
from ddsi_security.authentication.handshake_tokens import Credentials, request_token
from ddsi_security.generic_message import (
    GenericMessage,
    MessageIdentity,
    read_generic_message,
    write_generic_message,
)
from ddsi_security.tokens import DataHolder

__all__ = [
    "Knowledge",
    "altered",
    "forged_announcements",
    "forged_submessages",
    "invented_participants",
    "stolen_handshakes",
]

HUGE = 1 << 40
NOWHERE = (Locator.udp_v4("127.0.0.1", 7999),)
STATELESS = (ids.PARTICIPANT_STATELESS_MESSAGE_READER, ids.PARTICIPANT_STATELESS_MESSAGE_WRITER)
BUILTIN_PAIRS = (
    (ids.SEDP_PUBLICATIONS_WRITER, ids.SEDP_PUBLICATIONS_READER),
    (ids.SEDP_SUBSCRIPTIONS_WRITER, ids.SEDP_SUBSCRIPTIONS_READER),
    (ids.PARTICIPANT_MESSAGE_WRITER, ids.PARTICIPANT_MESSAGE_READER),
    (ids.SEDP_PUBLICATIONS_SECURE_WRITER, ids.SEDP_PUBLICATIONS_SECURE_READER),
    (ids.SEDP_SUBSCRIPTIONS_SECURE_WRITER, ids.SEDP_SUBSCRIPTIONS_SECURE_READER),
    (ids.SPDP_SECURE_WRITER, ids.SPDP_SECURE_READER),
    (ids.PARTICIPANT_MESSAGE_SECURE_WRITER, ids.PARTICIPANT_MESSAGE_SECURE_READER),
    (ids.PARTICIPANT_VOLATILE_MESSAGE_SECURE_WRITER, ids.PARTICIPANT_VOLATILE_MESSAGE_SECURE_READER),
)
USER_WRITERS, USER_READERS = (
    [EntityId.user(number, kind) for number in range(1, 5) for kind in kinds]
    for kinds in (
        (EntityKind.WRITER_WITH_KEY, EntityKind.WRITER_NO_KEY),
        (EntityKind.READER_WITH_KEY, EntityKind.READER_NO_KEY),
    )
)
"""As vendors number them: what an application makes first is among these."""


@dataclass(frozen=True, slots=True)
class Knowledge:
    """All that was recorded; the participants in it; and the handshake messages, put together from their fragments."""

    messages: Sequence[bytes]
    participants: Sequence[DiscoveredParticipantData]
    handshakes: Sequence[GenericMessage]

    @classmethod
    def of(cls, messages: Sequence[bytes]) -> Knowledge:
        participants: dict[Guid, DiscoveredParticipantData] = {}
        handshakes: list[GenericMessage] = []
        fragments: dict[tuple[bytes, int], dict[int, bytes]] = {}
        for message in messages:
            for data in _clear_data(message):
                try:
                    if data.writer_id == ids.SPDP_WRITER and isinstance(data, Data):
                        found = _announced(message, data)
                        participants.setdefault(found.guid, found)
                    elif data.writer_id == STATELESS[1]:
                        payload = _whole(message, data, fragments)
                        if payload is not None:
                            handshakes.append(read_generic_message(payload))
                except MalformedMessage:
                    continue
        return cls(messages, list(participants.values()), handshakes)

    @property
    def victims(self) -> list[DiscoveredParticipantData]:
        """The participants that are ours."""
        return [data for data in self.participants if data.vendor_id == OUR_VENDOR_ID]


def _clear_data(message: bytes) -> Iterator[Data | DataFrag]:
    kinds: dict[int, type[Data] | type[DataFrag]] = {SubmessageKind.DATA: Data, SubmessageKind.DATA_FRAG: DataFrag}
    try:
        for raw in iterate_submessages(memoryview(message), start=20):
            if raw.kind in kinds:
                yield kinds[raw.kind].decode(raw.flags, raw.body)
    except MalformedMessage:
        return


def _announced(message: bytes, data: Data) -> DiscoveredParticipantData:
    prefix = GuidPrefix(message[8:20])
    return decode_participant(
        data.serialized_payload, source_prefix=prefix, vendor_id=VendorId(message[6:8]), protocol_version=(2, 4)
    )


def _whole(message: bytes, data: Data | DataFrag, fragments: dict[tuple[bytes, int], dict[int, bytes]]) -> bytes | None:
    if isinstance(data, Data):
        return bytes(data.serialized_payload)
    parts = fragments.setdefault((message[8:20], data.writer_sn), {})
    parts[data.run_start] = bytes(data.serialized_payload)[: data.run_length]
    joined = b"".join(parts[start] for start in sorted(parts))
    return joined if len(joined) == data.sample_size else None


# --- what was recorded, altered -------------------------------------------------------------------------------------


def altered(messages: Sequence[bytes], dice: Random, count: int) -> Iterator[bytes]:
    """Bits flipped, ends cut off, the beginning of one message before the end of another."""
    for _ in range(count):
        octets = dice.choice(messages)
        match dice.randrange(3):
            case 0:
                changed = bytearray(octets)
                for _ in range(dice.randrange(1, 4)):
                    changed[dice.randrange(len(changed))] ^= 1 << dice.randrange(8)
                yield bytes(changed)
            case 1:
                yield octets[: dice.randrange(len(octets) + 1)]
            case _:
                other = dice.choice(messages)
                at, to = (4 * dice.randrange(5, len(one) // 4 + 1) for one in (octets, other))
                yield octets[:at] + other[to:]


# --- what nobody sent -----------------------------------------------------------------------------------------------


def forged_submessages(sender: DiscoveredParticipantData, receiver: DiscoveredParticipantData) -> Iterator[bytes]:
    """In clear, in the name of the sender: new data, "all before this is gone", "I have all of it"."""
    destination = InfoDestination(receiver.guid.prefix).encode()
    pairs = [*BUILTIN_PAIRS, *((writer, reader) for writer in USER_WRITERS for reader in USER_READERS)]
    for writer, reader in pairs:
        for number in (1, 50, HUGE):
            payload = b"\0\1\0\0" + b"\5\0\0\0FAKE\0\0\0\0" + b"\x42" * 12
            for submessage in (
                Data(reader, writer, number, None, payload).encode(),
                Heartbeat(reader, writer, number, number, number & 0xFFFF).encode(),
                Gap(reader, writer, 1, NumberSet(number + 1)).encode(),
                AckNack(reader, writer, NumberSet(number), 99).encode(),
            ):
                yield _message(sender, destination, submessage)


def forged_announcements(honest: DiscoveredParticipantData, topic: str) -> Iterator[bytes]:
    """SPDP and SEDP in clear: it is elsewhere, it has no security, it is gone; and it has a writer that it has not."""
    for forged in (
        replace(honest, metatraffic_unicast=NOWHERE, default_unicast=NOWHERE),
        replace(honest, security_parameters=()),
        replace(honest, lease_duration=0.01),
        replace(honest, domain_tag="elsewhere"),
    ):
        yield _message(honest, Data(ids.SPDP_READER, ids.SPDP_WRITER, HUGE, None, encode_participant(forged)).encode())
    for entity in USER_WRITERS:
        writer = DiscoveredWriterData(
            guid=Guid.of(honest.guid.prefix, entity), topic_name=topic, type_name="ShapeType", qos=EndpointQos()
        )
        for number in (1, HUGE):
            sample = Data(
                ids.SEDP_PUBLICATIONS_READER, ids.SEDP_PUBLICATIONS_WRITER, number, None, encode_writer(writer)
            )
            yield _message(honest, sample.encode())
        for pid, pair in ((ParameterId.ENDPOINT_GUID, BUILTIN_PAIRS[0]), (ParameterId.ENDPOINT_GUID, BUILTIN_PAIRS[3])):
            yield _goodbye(honest, writer.guid, pid, *pair)
    yield _goodbye(honest, honest.guid, ParameterId.PARTICIPANT_GUID, ids.SPDP_WRITER, ids.SPDP_READER)


def _goodbye(
    honest: DiscoveredParticipantData, guid: Guid, pid: ParameterId, writer: EntityId, reader: EntityId
) -> bytes:
    gone = ParameterList([(ParameterId.KEY_HASH, guid), (ParameterId.STATUS_INFO, b"\0\0\0\3")])
    return _message(honest, Data(reader, writer, HUGE + 1, gone, encode_key(guid, pid), is_key=True).encode())


# --- handshakes -----------------------------------------------------------------------------------------------------


def stolen_handshakes(known: Knowledge, dice: Random) -> Iterator[bytes]:
    """Certificates and permissions cross in clear: his are those of others, and he lacks the private keys."""
    by_source = {data.guid.prefix: data for data in known.participants}
    for seen in known.handshakes:
        honest = by_source.get(seen.message_identity.source_guid.prefix)
        if honest is None or not seen.message_data:
            continue
        for name, _ in seen.message_data[0].binary_properties:
            yield _said(honest, replace(seen, message_data=(_flipped(seen.message_data[0], name),)))
        impostor = _impostor(honest, dice)
        yield _announcement(impostor)
        yield _said(impostor, _taken_over(seen, honest, impostor))
        for final in known.handshakes:
            if final.message_data and final.message_data[0].class_id.endswith("+Final"):
                yield _said(impostor, _taken_over(final, honest, impostor))


def invented_participants(known: Knowledge, dice: Random, count: int) -> Iterator[bytes]:
    """Participants that do not exist: each announces itself and asks for a handshake, with a request that others sent.

    Every second one is made so well that only a private key is missing.
    """
    requests = [
        (seen, data)
        for seen in known.handshakes
        for data in known.participants
        if seen.message_data
        and seen.message_data[0].class_id.endswith("+Req")
        and seen.message_identity.source_guid.prefix == data.guid.prefix
    ]
    for number in range(count):
        request, honest = requests[number % len(requests)]
        stranger = _impostor(honest, dice)
        if number % 2:
            stranger = replace(stranger, guid=Guid.of(GuidPrefix(dice.randbytes(12)), EntityId.PARTICIPANT))
        yield _announcement(stranger)
        yield _said(stranger, _taken_over(request, honest, stranger))


def _flipped(token: DataHolder, name: str) -> DataHolder:
    changed = tuple(
        (key, (bytes((value[0] ^ 1,)) + value[1:] if value else b"x") if key == name else value)
        for key, value in token.binary_properties
    )
    return replace(token, binary_properties=changed)


def _impostor(honest: DiscoveredParticipantData, dice: Random) -> DiscoveredParticipantData:
    """Another participant of the same identity: the first six octets are made of the certificate's subject."""
    prefix = GuidPrefix(honest.guid.prefix[:6] + dice.randbytes(6))
    return replace(honest, guid=Guid.of(prefix, EntityId.PARTICIPANT))


def _taken_over(
    seen: GenericMessage, honest: DiscoveredParticipantData, thief: DiscoveredParticipantData
) -> GenericMessage:
    """For whomever it may concern, from the thief.  A request fits together for his Guid, as nobody signs requests."""
    token = seen.message_data[0]
    if token.class_id.endswith("+Req"):
        credentials = Credentials.of(token)
        credentials = replace(credentials, c_pdata=credentials.c_pdata.replace(bytes(honest.guid), bytes(thief.guid)))
        dh1, challenge1 = (token.binary_property(name) or b"" for name in ("dh1", "challenge1"))
        token = request_token(credentials, dh1=dh1, challenge1=challenge1)
    return replace(
        seen,
        message_identity=MessageIdentity(Guid.of(thief.guid.prefix, STATELESS[1]), 1),
        destination_participant_guid=GUID_UNKNOWN,
        message_data=(token,),
    )


# --- messages -------------------------------------------------------------------------------------------------------


def _announcement(data: DiscoveredParticipantData) -> bytes:
    moved = replace(data, metatraffic_unicast=NOWHERE, default_unicast=NOWHERE)
    return _message(data, Data(ids.SPDP_READER, ids.SPDP_WRITER, 1, None, encode_participant(moved)).encode())


def _said(sender: DiscoveredParticipantData, message: GenericMessage) -> bytes:
    payload = write_generic_message(message)
    return _message(sender, Data(*STATELESS, HUGE + message.message_identity.sequence_number, None, payload).encode())


def _message(sender: DiscoveredParticipantData, *submessages: bytes) -> bytes:
    return b"RTPS\x02\x04" + bytes(sender.vendor_id) + bytes(sender.guid.prefix) + b"".join(submessages)
