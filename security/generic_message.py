"""ParticipantGenericMessage: what the stateless and the volatile secure topic carry.  DDS-Security 1.1 §7.4.3, §7.4.4.

Octets only, in plain CDR behind an encapsulation header; what the messages mean, ``handshake`` and ``key_exchange``
know.  All that is read is untrusted: on the stateless topic anybody can write.
"""

from __future__ import annotations

from dataclasses import field
from typing import Final

from ddsi.serialization import Octets, Reader, Writer
from ddsi.structure.dataclass import dataclass
from ddsi.structure.errors import MalformedMessage
from ddsi.structure.guid import GUID_UNKNOWN, Guid

from .tokens import DataHolder, read_data_holder, write_data_holder

__all__ = [
    "AUTH",
    "AUTH_REQUEST",
    "DATAREADER_CRYPTO_TOKENS",
    "DATAWRITER_CRYPTO_TOKENS",
    "NO_MESSAGE",
    "PARTICIPANT_CRYPTO_TOKENS",
    "GenericMessage",
    "MessageIdentity",
    "peek_route",
    "read_generic_message",
    "write_generic_message",
]

AUTH_REQUEST: Final = "dds.sec.auth_request"
AUTH: Final = "dds.sec.auth"
PARTICIPANT_CRYPTO_TOKENS: Final = "dds.sec.participant_crypto_tokens"
DATAWRITER_CRYPTO_TOKENS: Final = "dds.sec.datawriter_crypto_tokens"
DATAREADER_CRYPTO_TOKENS: Final = "dds.sec.datareader_crypto_tokens"

_LITTLE_ENDIAN, _BIG_ENDIAN = b"\x00\x01", b"\x00\x00"
_HEADER_OCTETS = 4
_MAX_TOKENS = 8
"""Two are the most that any known message holds: a writer's submessage key and its payload key."""


@dataclass(frozen=True, slots=True)
class MessageIdentity:
    """Who wrote a message, and which of its messages it is (§7.4.3.3).  Sequence numbers begin at 1; 0 for none."""

    source_guid: Guid
    sequence_number: int


NO_MESSAGE: Final = MessageIdentity(GUID_UNKNOWN, 0)


@dataclass(frozen=True, slots=True, kw_only=True)
class GenericMessage:
    """ParticipantGenericMessage (§7.4.3.3), members in the order of the wire.

    ====================================== =======
    message_identity                       16 + 8
    related_message_identity               16 + 8
    destination_participant_guid           16
    destination_endpoint_guid              16
    source_endpoint_guid                   16
    message_class_id                       string
    message_data                           sequence of DataHolder
    ====================================== =======
    """

    message_identity: MessageIdentity
    related_message_identity: MessageIdentity = NO_MESSAGE
    destination_participant_guid: Guid
    destination_endpoint_guid: Guid = GUID_UNKNOWN
    source_endpoint_guid: Guid = GUID_UNKNOWN
    message_class_id: str
    message_data: tuple[DataHolder, ...] = field(repr=False)


def write_generic_message(message: GenericMessage) -> bytes:
    """The serialised payload, encapsulated as little-endian CDR."""
    writer = Writer(little_endian=True)
    for identity in (message.message_identity, message.related_message_identity):
        writer.guid(identity.source_guid)
        writer.u64(identity.sequence_number)
    writer.guid(message.destination_participant_guid)
    writer.guid(message.destination_endpoint_guid)
    writer.guid(message.source_endpoint_guid)
    writer.string(message.message_class_id)
    writer.sequence_length(len(message.message_data))
    for holder in message.message_data:
        write_data_holder(writer, holder)
    return _LITTLE_ENDIAN + bytes(2) + writer.getvalue()


def read_generic_message(payload: Octets) -> GenericMessage:
    """The mirror of :func:`write_generic_message`, in either byte order.  Raises MalformedMessage."""
    reader = _body(payload)
    identities = []
    for _ in range(2):
        source_guid = reader.guid()
        identities.append(MessageIdentity(source_guid, reader.u64()))
    destination_participant, destination_endpoint, source_endpoint = (reader.guid() for _ in range(3))
    message_class_id = reader.string()
    count = reader.sequence_length(most=_MAX_TOKENS)
    return GenericMessage(
        message_identity=identities[0],
        related_message_identity=identities[1],
        destination_participant_guid=destination_participant,
        destination_endpoint_guid=destination_endpoint,
        source_endpoint_guid=source_endpoint,
        message_class_id=message_class_id,
        message_data=tuple(_next_data_holder(reader) for _ in range(count)),
    )


def peek_route(payload: Octets) -> tuple[Guid, Guid]:
    """The source of the message and the participant it is for, at their fixed places; nothing else is read.

    To be asked first: most of what is wrong, or not for us, is recognised at this price.  Raises MalformedMessage.
    """
    reader = _body(payload)
    source = reader.guid()
    reader.skip(8 + 16 + 8)
    return source, reader.guid()


def _body(payload: Octets) -> Reader:
    header = bytes(payload[:_HEADER_OCTETS])
    if len(header) < _HEADER_OCTETS or header[:2] not in (_LITTLE_ENDIAN, _BIG_ENDIAN):
        raise MalformedMessage(f"a generic message is plain CDR, not encapsulation {header[:2].hex() or 'nothing'}")
    return Reader(payload, little_endian=header[:2] == _LITTLE_ENDIAN, start=_HEADER_OCTETS)


def _next_data_holder(reader: Reader) -> DataHolder:
    reader.align(4)
    return read_data_holder(reader)
