"""AesGcmGmacTransform: protects what is sent, and opens what is received.

DDS-Security 1.1 §9.5.3.3 (CryptoTransform); the operations are those of §8.5.1.9.  Which octets and which keys is
decided here; what is done with them in :mod:`.payload` and :mod:`.envelope`.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence
from typing import Final, cast

from ddsi.spi import NoKeys, Octets, Outcome, Overhead, Parts, Refused, Rejected
from ddsi.structure.errors import MalformedMessage

from ..crypto_transform_plugin import SecureSubmessage, SecureSubmessageCategory
from ..handles import DatareaderCryptoHandle, DatawriterCryptoHandle, ParticipantCryptoHandle
from . import envelope, openers, opening, payload, sealers, sealing
from .crypto_handles import (
    NO_KEY,
    LocalParticipant,
    LocalReader,
    LocalWriter,
    RemoteParticipant,
    RemoteReader,
    RemoteWriter,
)
from .session_keys import ReceiverKey, SendingKey
from .transformation import NO_KEY_ID

__all__ = ["AesGcmGmacTransform"]

_NO_RECEIVER: Final = Refused("its origin is to be authenticated, and there is no receiver that could")


class AesGcmGmacTransform:
    """CryptoTransform (§9.5.3.3)."""

    def overhead(
        self,
        sender: ParticipantCryptoHandle | DatawriterCryptoHandle | DatareaderCryptoHandle,
        receivers: int,
    ) -> Overhead:
        """Of a participant: of its messages.  Of an endpoint: of its submessages and payloads, not of the message."""
        if isinstance(sender, LocalParticipant):
            return Overhead(message=envelope.message_overhead(sender.protection, receivers))
        assert isinstance(sender, LocalWriter | LocalReader)
        return Overhead(
            payload=payload.overhead(sender.payload) if isinstance(sender, LocalWriter) else 0,
            submessage=envelope.submessage_overhead(sender.submessage, receivers),
        )

    # --- outwards --------------------------------------------------------------------------------------------

    def encode_serialized_payload(
        self,
        extra_inline_qos: bytearray,
        plain_buffer: Octets,
        sending_datawriter_crypto: DatawriterCryptoHandle,
    ) -> Parts | Refused:
        """§8.5.1.9.1.  Padded to a multiple of 4 where it is none; no inline QoS is added."""
        assert isinstance(sending_datawriter_crypto, LocalWriter)
        writer = sending_datawriter_crypto
        if writer.payload_key is None:
            return NO_KEY
        return payload.encode_payload(plain_buffer, writer.payload_key, writer.participant.rooms)

    def encode_datawriter_submessage(
        self,
        plain_rtps_submessage: Parts,
        sending_datawriter_crypto: DatawriterCryptoHandle,
        receiving_datareader_crypto_list: Sequence[DatareaderCryptoHandle],
    ) -> Parts | Refused:
        """§8.5.1.9.2.  Of the volatile writer: for one reader, as each has a key of its own."""
        assert isinstance(sending_datawriter_crypto, LocalWriter)
        return _encode_submessage(plain_rtps_submessage, sending_datawriter_crypto, receiving_datareader_crypto_list)

    def encode_datareader_submessage(
        self,
        plain_rtps_submessage: Parts,
        sending_datareader_crypto: DatareaderCryptoHandle,
        receiving_datawriter_crypto_list: Sequence[DatawriterCryptoHandle],
    ) -> Parts | Refused:
        """§8.5.1.9.3.  Of the volatile reader: for one writer, as each has a key of its own."""
        assert isinstance(sending_datareader_crypto, LocalReader)
        return _encode_submessage(plain_rtps_submessage, sending_datareader_crypto, receiving_datawriter_crypto_list)

    def encode_rtps_message(
        self,
        plain_rtps_message: Parts,
        sending_participant_crypto: ParticipantCryptoHandle,
        receiving_participant_crypto_list: Sequence[ParticipantCryptoHandle],
    ) -> Parts | Refused:
        """§8.5.1.9.4."""
        assert isinstance(sending_participant_crypto, LocalParticipant)
        key, protection = sending_participant_crypto.key, sending_participant_crypto.protection
        if key is None or protection is None:
            return NO_KEY
        receivers: Sequence[ReceiverKey] = ()
        if protection.origin_authenticated:
            receivers = _receiver_keys(receiving_participant_crypto_list)
            if not receivers:
                return _NO_RECEIVER
        return sealing.seal_message(plain_rtps_message, key, receivers)

    def message_sealer(
        self,
        sending_participant_crypto: ParticipantCryptoHandle,
        receiving_participant_crypto_list: Sequence[ParticipantCryptoHandle],
    ) -> Callable[[Parts], Parts | Refused] | None:
        """Not the OMG's: :class:`~ddsi_security.crypto_transform_plugin.SealsAlike`."""
        assert isinstance(sending_participant_crypto, LocalParticipant)
        key, protection = sending_participant_crypto.key, sending_participant_crypto.protection
        if key is None or protection is None or protection.origin_authenticated:
            return None
        return sealers.message_sealer(key, sending_participant_crypto.rooms)

    def submessage_sealer(
        self,
        sending_crypto: DatawriterCryptoHandle | DatareaderCryptoHandle,
        receiving_crypto_list: Sequence[DatareaderCryptoHandle | DatawriterCryptoHandle],
    ) -> Callable[[Parts], Parts | Refused] | None:
        """Not the OMG's: :class:`~ddsi_security.crypto_transform_plugin.SealsAlike`."""
        sender = sending_crypto
        assert isinstance(sender, LocalWriter | LocalReader)
        key, protection = sender.submessage_key, sender.submessage
        if sender.is_volatile or key is None or protection is None or protection.origin_authenticated:
            return None
        return sealers.submessage_sealer(key, sender.participant.rooms)

    def payload_sealer(
        self, sending_datawriter_crypto: DatawriterCryptoHandle
    ) -> Callable[[Octets], Octets | Refused] | None:
        """Not the OMG's: :class:`~ddsi_security.crypto_transform_plugin.SealsAlike`."""
        writer = sending_datawriter_crypto
        assert isinstance(writer, LocalWriter)
        key = writer.payload_key
        return None if key is None else sealers.payload_sealer(key, writer.participant.rooms)

    # --- inwards ---------------------------------------------------------------------------------------------

    def decode_rtps_message(
        self,
        encoded_rtps_message: Octets,
        receiving_participant_crypto: ParticipantCryptoHandle,
        sending_participant_crypto: ParticipantCryptoHandle,
    ) -> Octets | Outcome:
        """§8.5.1.9.5.  The header of what is returned was authenticated, by the INFO_SRC that came protected."""
        assert isinstance(sending_participant_crypto, RemoteParticipant)
        remote = sending_participant_crypto
        return opening.open_message(encoded_rtps_message, remote.ring, remote.local.protection)

    def preprocess_secure_submsg(
        self,
        encoded_rtps_submessage: Octets,
        receiving_participant_crypto: ParticipantCryptoHandle,
        sending_participant_crypto: ParticipantCryptoHandle,
    ) -> SecureSubmessage | Outcome:
        """§8.5.1.9.6.  Where several local endpoints have the key, the one that it bears a MAC for.

        Key id 0 is that of the pairwise key, under which both volatile endpoints of the sender write: it is
        INFO_SUBMESSAGE with the handles of both, and either decoder opens it.
        """
        assert isinstance(sending_participant_crypto, RemoteParticipant)
        remote = sending_participant_crypto
        if encoded_rtps_submessage[:4] == envelope.SUBMESSAGE.prefix_head:  # the short way of nearly all
            found = remote.senders.get(bytes(encoded_rtps_submessage[8:12]))
            if found is not None and len(found) == 1:
                return found[0].whose
        try:
            key_id = envelope.read_key_id(envelope.SUBMESSAGE, encoded_rtps_submessage, 0)
            if key_id == NO_KEY_ID:
                return _volatile(remote)
            senders = remote.senders.get(key_id)
            if senders is None:
                return NoKeys(key_id)
            sender = senders[0] if len(senders) == 1 else _addressed(senders, key_id, encoded_rtps_submessage)
        except MalformedMessage as error:
            return Rejected(str(error))
        except struct.error:
            return Rejected("the octets end within the envelope")
        return sender.whose

    def decode_datawriter_submessage(
        self,
        encoded_rtps_submessage: Octets,
        receiving_datareader_crypto: DatareaderCryptoHandle,
        sending_datawriter_crypto: DatawriterCryptoHandle,
    ) -> Octets | Outcome:
        """§8.5.1.9.7.  The sender's handle is that of the pair, and knows its reader."""
        sender = sending_datawriter_crypto
        assert isinstance(sender, RemoteWriter)
        return opening.open_submessage(encoded_rtps_submessage, sender.ring, sender.reader.submessage)

    def decode_datareader_submessage(
        self,
        encoded_rtps_submessage: Octets,
        receiving_datawriter_crypto: DatawriterCryptoHandle,
        sending_datareader_crypto: DatareaderCryptoHandle,
    ) -> Octets | Outcome:
        """§8.5.1.9.8.  The sender's handle is that of the pair, and knows its writer."""
        sender = sending_datareader_crypto
        assert isinstance(sender, RemoteReader)
        return opening.open_submessage(encoded_rtps_submessage, sender.ring, sender.writer.submessage)

    def message_opener(
        self, encoded_rtps_message: Octets, sending_participant_crypto: ParticipantCryptoHandle
    ) -> Callable[[Octets], Octets | None] | None:
        """Not the OMG's: :class:`~ddsi_security.crypto_transform_plugin.OpensAlike`."""
        remote = sending_participant_crypto
        assert isinstance(remote, RemoteParticipant)
        opener = openers.message_opener(encoded_rtps_message, remote.ring, remote.local.protection)
        return None if opener is None else opener.open

    def submessage_opener(
        self,
        encoded_rtps_submessage: Octets,
        sending_crypto: DatawriterCryptoHandle | DatareaderCryptoHandle,
        entity_id: bytes,
    ) -> Callable[[memoryview, int, int], tuple[Octets, int] | None] | None:
        """Not the OMG's: :class:`~ddsi_security.crypto_transform_plugin.OpensAlike`."""
        sender = sending_crypto
        assert isinstance(sender, RemoteWriter | RemoteReader)
        expected = sender.reader.submessage if isinstance(sender, RemoteWriter) else sender.writer.submessage
        opener = openers.submessage_opener(encoded_rtps_submessage, sender.ring, expected, entity_id)
        return None if opener is None else opener.open

    def payload_opener(
        self, encoded_buffer: Octets, sending_datawriter_crypto: DatawriterCryptoHandle
    ) -> Callable[[Octets, memoryview | None], Octets | None] | None:
        """Not the OMG's: :class:`~ddsi_security.crypto_transform_plugin.OpensAlike`."""
        sender = sending_datawriter_crypto
        assert isinstance(sender, RemoteWriter)
        opener = openers.payload_opener(encoded_buffer, sender.payload_ring, sender.reader.payload)
        return None if opener is None else opener.open

    def decode_serialized_payload(
        self,
        encoded_buffer: Octets,
        inline_qos: Octets,
        receiving_datareader_crypto: DatareaderCryptoHandle,
        sending_datawriter_crypto: DatawriterCryptoHandle,
    ) -> Octets | Outcome:
        """§8.5.1.9.9.  The sender's handle is that of the pair, and knows its reader."""
        sender = sending_datawriter_crypto
        assert isinstance(sender, RemoteWriter)
        return payload.decode_payload(encoded_buffer, sender.payload_ring, sender.reader.payload)


def _encode_submessage(
    submessage: Parts, sender: LocalWriter | LocalReader, receivers: Sequence[object]
) -> Parts | Refused:
    if sender.is_volatile:
        return _encode_volatile(submessage, receivers)
    key, protection = sender.submessage_key, sender.submessage
    if key is None or protection is None:
        return NO_KEY
    receiver_keys: Sequence[ReceiverKey] = ()
    if protection.origin_authenticated:
        receiver_keys = _receiver_keys(receivers)
        if not receiver_keys:
            return _NO_RECEIVER
    return sealing.seal_submessage(submessage, key, receiver_keys)


def _encode_volatile(submessage: Parts, receivers: Sequence[object]) -> Parts | Refused:
    if len(receivers) != 1:
        return Refused(f"a volatile submessage is for one receiver, not for {len(receivers)}")
    receiver = receivers[0]
    assert isinstance(receiver, RemoteReader | RemoteWriter)
    key: SendingKey | None = receiver.participant.exchange_key
    return NO_KEY if key is None else sealing.seal_submessage(submessage, key, ())


def _receiver_keys(receivers: Sequence[object]) -> list[ReceiverKey]:
    known = cast("Sequence[RemoteParticipant | RemoteReader | RemoteWriter]", receivers)
    return [key for receiver in known if (key := receiver.receiver_key) is not None]


def _volatile(remote: RemoteParticipant) -> SecureSubmessage | Outcome:
    writer, reader = remote.volatile_writer, remote.volatile_reader
    if writer is None or reader is None:
        return NoKeys(NO_KEY_ID)
    return SecureSubmessage(SecureSubmessageCategory.INFO_SUBMESSAGE, writer, reader)


def _addressed(
    senders: Sequence[RemoteWriter | RemoteReader], key_id: bytes, octets: Octets
) -> RemoteWriter | RemoteReader:
    """Of the pairs that have this key, the one whose receiver-specific key a MAC was made with; else the first."""
    pairs = [(sender, key) for sender in senders for key in sender.ring.by_id.get(key_id, ())]
    if any(key.receiver_key_id != NO_KEY_ID for _, key in pairs):
        addressed = envelope.receiver_key_ids(octets)
        for sender, key in pairs:
            if key.receiver_key_id in addressed:
                return sender
    return senders[0]
