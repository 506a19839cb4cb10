"""Generic messages out and in: numbered and addressed when they leave, and read no further than needed when they come.

DDS-Security 1.1 §7.4.3, §7.4.4.  Anybody can write to the stateless topic, and Fast DDS sends each key message to
everybody; so the route, at fixed places, is read first, and the rest only of what is for us and of somebody known.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from ddsi.spi import HookEffect, NotForUs, Outcome, Rejected, SendMessage
from ddsi.structure.builtin_entity_ids import (
    PARTICIPANT_STATELESS_MESSAGE_WRITER,
    PARTICIPANT_VOLATILE_MESSAGE_SECURE_WRITER,
)
from ddsi.structure.cache_change import CacheChange, ChangeKind
from ddsi.structure.errors import MalformedMessage
from ddsi.structure.guid import GUID_UNKNOWN, EntityId, Guid

from .generic_message import GenericMessage, MessageIdentity, peek_route, read_generic_message, write_generic_message
from .handshake import Send
from .remote_participant import RemoteParticipant
from .tokens import CryptoToken

__all__ = ["Mailbox"]


class Mailbox:
    """Of one participant.  ``effects`` takes what is to be written."""

    def __init__(self, guid: Guid, effects: list[HookEffect]) -> None:
        self._guid = guid
        self._effects = effects
        self._numbers: Counter[EntityId] = Counter()

    # --- out ---------------------------------------------------------------------------------------------

    def post_handshake(self, remote: RemoteParticipant, send: Send) -> None:
        """A token of the handshake, on the stateless topic.  Sent again, it is the same message under a new number."""
        change = self._post(
            PARTICIPANT_STATELESS_MESSAGE_WRITER,
            GenericMessage(
                message_identity=self._identity(PARTICIPANT_STATELESS_MESSAGE_WRITER),
                related_message_identity=send.related,
                destination_participant_guid=remote.guid,
                message_class_id=send.message_class_id,
                message_data=(send.token,),
            ),
        )
        remote.posted = (send, change)

    def complete_handshake(self, remote: RemoteParticipant, send: Send) -> None:
        """The same once more, for the engine to send its fragments under their number, unless another came between."""
        if remote.posted is not None and remote.posted[0] is send:
            self._effects.append(SendMessage(PARTICIPANT_STATELESS_MESSAGE_WRITER, remote.posted[1]))

    def post_keys(
        self,
        remote: RemoteParticipant,
        message_class_id: str,
        tokens: Sequence[CryptoToken],
        *,
        destination_endpoint: Guid = GUID_UNKNOWN,
        source_endpoint: Guid = GUID_UNKNOWN,
    ) -> None:
        """Keys, on the volatile secure topic."""
        self._post(
            PARTICIPANT_VOLATILE_MESSAGE_SECURE_WRITER,
            GenericMessage(
                message_identity=self._identity(PARTICIPANT_VOLATILE_MESSAGE_SECURE_WRITER),
                destination_participant_guid=remote.guid,
                destination_endpoint_guid=destination_endpoint,
                source_endpoint_guid=source_endpoint,
                message_class_id=message_class_id,
                message_data=tuple(tokens),
            ),
        )

    def _identity(self, writer_id: EntityId) -> MessageIdentity:
        self._numbers[writer_id] += 1
        return MessageIdentity(Guid.of(self._guid.prefix, writer_id), self._numbers[writer_id])

    def _post(self, writer_id: EntityId, message: GenericMessage) -> CacheChange:
        change = CacheChange(
            ChangeKind.ALIVE,
            message.message_identity.source_guid,
            message.message_identity.sequence_number,
            write_generic_message(message),
            destination=message.destination_participant_guid,
        )
        self._effects.append(SendMessage(writer_id, change))
        return change

    # --- in ----------------------------------------------------------------------------------------------

    def open(self, change: CacheChange) -> GenericMessage | Outcome:
        """The message, if it is for us and of whom it says; else why it is not read."""
        try:
            source, destination = peek_route(change.payload)
            if destination not in (self._guid, GUID_UNKNOWN):
                return NotForUs()  # Fast DDS shows everybody all keys, each under the key shared with him
            # Only the prefix: the entity is another one with nearly every vendor.
            if source[:12] != change.writer_guid[:12]:
                return Rejected(f"a message of {source}, which is not its sender")
            return read_generic_message(change.payload)
        except MalformedMessage as error:
            return Rejected(f"a message of security is malformed: {error}")
