"""The Cryptographic interface for octets: CryptoTransform.

DDS-Security 1.1 §8.5.1.9; conventions: :mod:`ddsi_security.plugins`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from enum import Enum
from typing import Final, Protocol, runtime_checkable

from ddsi.spi import Octets, Outcome, Overhead, Parts, Refused
from ddsi.structure.dataclass import dataclass

from .handles import DatareaderCryptoHandle, DatawriterCryptoHandle, ParticipantCryptoHandle

__all__ = [
    "SHORT_WAYS",
    "CryptoTransform",
    "OpensAlike",
    "SealsAlike",
    "SecureSubmessage",
    "SecureSubmessageCategory",
]

SHORT_WAYS: Final = {
    "message_sealer": ("encode_rtps_message",),
    "submessage_sealer": ("encode_datawriter_submessage", "encode_datareader_submessage"),
    "payload_sealer": ("encode_serialized_payload",),
    "message_opener": ("decode_rtps_message",),
    "submessage_opener": ("preprocess_secure_submsg", "decode_datawriter_submessage", "decode_datareader_submessage"),
    "payload_opener": ("decode_serialized_payload",),
}
"""What :class:`SealsAlike` and :class:`OpensAlike` offer, and which operations of the OMG's each stands for.

Who extends a plugin that has them and overrides such an operation overrides its short way too; to return None is
enough.
"""


class SecureSubmessageCategory(Enum):
    """SecureSubmessageCategory_t (§8.5.1.9.6): who sent a protected submessage."""

    INFO_SUBMESSAGE = "nobody in particular"
    DATAWRITER_SUBMESSAGE = "a writer"
    DATAREADER_SUBMESSAGE = "a reader"


@dataclass(frozen=True, slots=True)
class SecureSubmessage:
    """What can be told of a protected submessage before it is decoded: which decoder it needs, with which keys.

    Of a writer's submessage, ``datawriter`` sent it and ``datareader`` receives it; of a reader's the other way round.
    Of INFO_SUBMESSAGE both are the sender's, which protects the submessages of both with one key: either decoder, given
    the two, opens it.
    """

    category: SecureSubmessageCategory
    datawriter: DatawriterCryptoHandle | None = None
    datareader: DatareaderCryptoHandle | None = None


class CryptoTransform(Protocol):
    """Protects what is sent and opens what is received.  §8.5.1.9; called by the service for each message.

    Encoders take and return octets in parts, as they go to the socket: large ones are not copied that need not be.  A
    refusal means that nothing is sent.  They encode for all receivers at once: the OMG's ``..._list_index`` has no part
    here.
    Decoders return the plain octets, or why there are none: not for us, no keys, rejected.  They may write into the
    octets that they are given, where these can be written to, and return parts of them: nobody reads them again.
    """

    def overhead(
        self,
        sender: ParticipantCryptoHandle | DatawriterCryptoHandle | DatareaderCryptoHandle,
        receivers: int,
    ) -> Overhead:
        """How many octets the encoders below add at most.  Asked before a message is packed.  Not the OMG's.

        Of an endpoint: to its payloads and submessages; of a participant: to its messages.
        """
        ...

    def encode_serialized_payload(
        self,
        extra_inline_qos: bytearray,
        plain_buffer: Octets,
        sending_datawriter_crypto: DatawriterCryptoHandle,
    ) -> Parts | Refused:
        """§8.5.1.9.1.  A whole SerializedPayload, or one run of its fragments.

        ``extra_inline_qos`` is empty and must stay so.  The OMG lets a plugin add parameters there that tell the reader
        how to decode; the builtin plugin has none (§9.5.3.3), and here nobody would carry them.  They belong in the
        payload.
        """
        ...

    def encode_datawriter_submessage(
        self,
        plain_rtps_submessage: Parts,
        sending_datawriter_crypto: DatawriterCryptoHandle,
        receiving_datareader_crypto_list: Sequence[DatareaderCryptoHandle],
    ) -> Parts | Refused:
        """§8.5.1.9.2.  A writer's submessage with its header in, SEC_PREFIX to SEC_POSTFIX out."""
        ...

    def encode_datareader_submessage(
        self,
        plain_rtps_submessage: Parts,
        sending_datareader_crypto: DatareaderCryptoHandle,
        receiving_datawriter_crypto_list: Sequence[DatawriterCryptoHandle],
    ) -> Parts | Refused:
        """§8.5.1.9.3.  A reader's submessage with its header in, SEC_PREFIX to SEC_POSTFIX out."""
        ...

    def encode_rtps_message(
        self,
        plain_rtps_message: Parts,
        sending_participant_crypto: ParticipantCryptoHandle,
        receiving_participant_crypto_list: Sequence[ParticipantCryptoHandle],
    ) -> Parts | Refused:
        """§8.5.1.9.4.  A message with its RTPS header, in and out."""
        ...

    def decode_rtps_message(
        self,
        encoded_rtps_message: Octets,
        receiving_participant_crypto: ParticipantCryptoHandle,
        sending_participant_crypto: ParticipantCryptoHandle,
    ) -> Octets | Outcome:
        """§8.5.1.9.5.  A message whose first submessage is SRTPS_PREFIX; without it again, with its RTPS header."""
        ...

    def preprocess_secure_submsg(
        self,
        encoded_rtps_submessage: Octets,
        receiving_participant_crypto: ParticipantCryptoHandle,
        sending_participant_crypto: ParticipantCryptoHandle,
    ) -> SecureSubmessage | Outcome:
        """§8.5.1.9.6.  Beginning with SEC_PREFIX, whose key identifier tells."""
        ...

    def decode_datawriter_submessage(
        self,
        encoded_rtps_submessage: Octets,
        receiving_datareader_crypto: DatareaderCryptoHandle,
        sending_datawriter_crypto: DatawriterCryptoHandle,
    ) -> Octets | Outcome:
        """§8.5.1.9.7.  SEC_PREFIX to SEC_POSTFIX in, one submessage out."""
        ...

    def decode_datareader_submessage(
        self,
        encoded_rtps_submessage: Octets,
        receiving_datawriter_crypto: DatawriterCryptoHandle,
        sending_datareader_crypto: DatareaderCryptoHandle,
    ) -> Octets | Outcome:
        """§8.5.1.9.8.  SEC_PREFIX to SEC_POSTFIX in, one submessage out."""
        ...

    def decode_serialized_payload(
        self,
        encoded_buffer: Octets,
        inline_qos: Octets,
        receiving_datareader_crypto: DatareaderCryptoHandle,
        sending_datawriter_crypto: DatawriterCryptoHandle,
    ) -> Octets | Outcome:
        """§8.5.1.9.9.  A whole payload, or one run of fragments, as it was encoded.  ``inline_qos`` is always empty."""
        ...


@runtime_checkable
class SealsAlike(Protocol):
    """What a CryptoTransform may offer besides, to make the path of every sample shorter.  Not the OMG's."""

    def message_sealer(
        self,
        sending_participant_crypto: ParticipantCryptoHandle,
        receiving_participant_crypto_list: Sequence[ParticipantCryptoHandle],
    ) -> Callable[[Parts], Parts | Refused] | None:
        """Does what encoding with these handles does.

        It is used until keys or endpoints come or go.  None: there is no short way.
        """
        ...

    def submessage_sealer(
        self,
        sending_crypto: DatawriterCryptoHandle | DatareaderCryptoHandle,
        receiving_crypto_list: Sequence[DatareaderCryptoHandle | DatawriterCryptoHandle],
    ) -> Callable[[Parts], Parts | Refused] | None:
        """The same for the submessages of a writer or a reader."""
        ...

    def payload_sealer(
        self, sending_datawriter_crypto: DatawriterCryptoHandle
    ) -> Callable[[Octets], Octets | Refused] | None:
        """The same for a writer's payloads, in one part."""
        ...


@runtime_checkable
class OpensAlike(Protocol):
    """What a CryptoTransform may offer besides, to make the path of every sample shorter.  Not the OMG's."""

    def message_opener(
        self, encoded_rtps_message: Octets, sending_participant_crypto: ParticipantCryptoHandle
    ) -> Callable[[Octets], Octets | None] | None:
        """A short way for messages with the same 16 octets behind their header as this one, which was just decoded.

        It opens what decoding with the same handles would open, or returns None, and leaves the octets as they were;
        then they are decoded.  It is used until keys or endpoints come or go.  None: there is no short way.
        """
        ...

    def submessage_opener(
        self,
        encoded_rtps_submessage: Octets,
        sending_crypto: DatawriterCryptoHandle | DatareaderCryptoHandle,
        entity_id: bytes,
    ) -> Callable[[memoryview, int, int], tuple[Octets, int] | None] | None:
        """The same for submessages that begin with the same 16 octets, and name the sender's ``entity_id``.

        They are opened where they lie, by the message, where SEC_PREFIX begins and where the message ends; with what
        is opened comes where SEC_POSTFIX ends.
        """
        ...

    def payload_opener(
        self, encoded_buffer: Octets, sending_datawriter_crypto: DatawriterCryptoHandle
    ) -> Callable[[Octets, memoryview | None], Octets | None] | None:
        """The same for payloads that begin with the same 12 octets; a large one goes to the place given, if it fits."""
        ...
