"""ParticipantGenericMessage for display: what crosses the stateless and the volatile secure topic, by names and sizes.

DDS-Security 1.1 §7.4.3, §7.4.4 (the topics), §7.2.3 (DataHolder).  Nothing here acts on a message, and no value of it
is kept: of tokens, which may be keys, only the names of their properties and how many octets each has.
"""

from __future__ import annotations

from dataclasses import dataclass

from ..messages.data import Data
from ..serialization.cursor import Octets, Reader
from ..structure import builtin_entity_ids as ids
from ..structure.errors import MalformedMessage
from ..structure.guid import Guid

__all__ = ["GenericMessageOutline", "TokenOutline", "generic_message_in", "generic_message_outline"]

_WRITERS = frozenset({ids.PARTICIPANT_STATELESS_MESSAGE_WRITER, ids.PARTICIPANT_VOLATILE_MESSAGE_SECURE_WRITER})
_HEADER_OCTETS = 4
_ENCAPSULATIONS = {b"\x00\x00": False, b"\x00\x01": True}
_MAX_TOKENS = 8
_MAX_PROPERTIES = 64


@dataclass(frozen=True, slots=True)
class TokenOutline:
    """A DataHolder: its class id, and each property's name with its size in octets, in the order of the wire."""

    class_id: str
    sizes: tuple[tuple[str, int], ...]


@dataclass(frozen=True, slots=True)
class GenericMessageOutline:
    """``fingerprint``: two messages with the same one say the same, whatever their numbers (it is not the octets)."""

    class_id: str
    destination_endpoint: Guid
    source_endpoint: Guid
    tokens: tuple[TokenOutline, ...]
    octets: int
    fingerprint: int

    @property
    def kind(self) -> str:
        """What the message is, in a word: ``auth-request``, ``request``, ``writer-tokens``; its class id if unknown."""
        if self.class_id == "dds.sec.auth" and self.tokens:
            step = self.tokens[0].class_id.rpartition("+")[2]
            return _STEPS.get(step, self.class_id)
        return _KINDS.get(self.class_id, self.class_id)


_STEPS = {"Req": "request", "Reply": "reply", "Final": "final"}
_KINDS = {
    "dds.sec.auth_request": "auth-request",
    "dds.sec.participant_crypto_tokens": "participant-tokens",
    "dds.sec.datawriter_crypto_tokens": "writer-tokens",
    "dds.sec.datareader_crypto_tokens": "reader-tokens",
}


def generic_message_in(data: Data) -> GenericMessageOutline | None:
    """What this DATA carries; None if it is of another topic, or cannot be read (it may be encrypted)."""
    return generic_message_outline(data.serialized_payload) if data.writer_id in _WRITERS else None


def generic_message_outline(payload: Octets) -> GenericMessageOutline | None:
    """The same of a payload that is known to be of one of the two topics."""
    try:
        return _outline(payload)
    except MalformedMessage:
        return None


def _outline(payload: Octets) -> GenericMessageOutline:
    little_endian = _ENCAPSULATIONS.get(bytes(payload[:2]))
    if little_endian is None:
        raise MalformedMessage("a generic message is plain CDR")
    reader = Reader(payload, little_endian=little_endian, start=_HEADER_OCTETS)
    reader.skip(2 * (16 + 8) + 16)  # both message identities, and the participant that it is for
    destination_endpoint, source_endpoint = reader.guid(), reader.guid()
    class_id = reader.string()
    fingerprint = hash(bytes(payload[reader.position :]))
    tokens = tuple(_token(reader) for _ in range(reader.sequence_length(most=_MAX_TOKENS)))
    return GenericMessageOutline(class_id, destination_endpoint, source_endpoint, tokens, len(payload), fingerprint)


def _token(reader: Reader) -> TokenOutline:
    reader.align(4)
    class_id = reader.string()
    sizes = []
    for _ in range(reader.sequence_length(most=_MAX_PROPERTIES)):
        name = reader.string()
        sizes.append((name, len(reader.string().encode())))
    if reader.remaining >= 4:  # version 1.0 has no binary properties
        for _ in range(reader.sequence_length(most=_MAX_PROPERTIES)):
            name = reader.string()
            sizes.append((name, len(reader.octet_sequence())))
    return TokenOutline(class_id, tuple(sizes))
