"""The two Cryptographic interfaces for keys: CryptoKeyFactory and CryptoKeyExchange.

DDS-Security 1.1 §8.5.1.7, §8.5.1.8; conventions: :mod:`ddsi_security.plugins`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from ddsi.spi import Refused
from ddsi.structure.qos_policies import Properties

from .attributes import EndpointSecurityAttributes, ParticipantSecurityAttributes
from .handles import (
    DatareaderCryptoHandle,
    DatawriterCryptoHandle,
    IdentityHandle,
    ParticipantCryptoHandle,
    PermissionsHandle,
    SharedSecretHandle,
)
from .tokens import CryptoToken

__all__ = ["CryptoKeyExchange", "CryptoKeyFactory"]


class CryptoKeyFactory(Protocol):
    """Makes keys, and knows which belong to whom.  §8.5.1.7; called by the service as entities come and go."""

    def register_local_participant(
        self,
        participant_identity: IdentityHandle,
        participant_permissions: PermissionsHandle,
        participant_properties: Properties,
        participant_security_attributes: ParticipantSecurityAttributes,
    ) -> ParticipantCryptoHandle:
        """§8.5.1.7.1.  Once identity and permissions are validated.  Raises ConfigurationError."""
        ...

    def register_matched_remote_participant(
        self,
        local_participant_crypto_handle: ParticipantCryptoHandle,
        remote_participant_identity: IdentityHandle,
        remote_participant_permissions: PermissionsHandle,
        shared_secret: SharedSecretHandle,
    ) -> ParticipantCryptoHandle:
        """§8.5.1.7.2.  Once the remote is admitted; makes the key-exchange keys of the two."""
        ...

    def register_local_datawriter(
        self,
        local_participant_crypto_handle: ParticipantCryptoHandle,
        datawriter_properties: Properties,
        datawriter_security_attributes: EndpointSecurityAttributes,
    ) -> DatawriterCryptoHandle:
        """§8.5.1.7.3.  A writer whose submessages or payload are protected was created."""
        ...

    def register_matched_remote_datareader(
        self,
        local_datawriter_crypto_handle: DatawriterCryptoHandle,
        remote_participant_crypto_handle: ParticipantCryptoHandle,
        shared_secret: SharedSecretHandle,
        *,
        relay_only: bool,
    ) -> DatareaderCryptoHandle:
        """§8.5.1.7.4.  A remote reader was admitted to that writer."""
        ...

    def register_local_datareader(
        self,
        local_participant_crypto_handle: ParticipantCryptoHandle,
        datareader_properties: Properties,
        datareader_security_attributes: EndpointSecurityAttributes,
    ) -> DatareaderCryptoHandle:
        """§8.5.1.7.5.  A reader whose submessages or payload are protected was created."""
        ...

    def register_matched_remote_datawriter(
        self,
        local_datareader_crypto_handle: DatareaderCryptoHandle,
        remote_participant_crypto_handle: ParticipantCryptoHandle,
        shared_secret: SharedSecretHandle,
    ) -> DatawriterCryptoHandle:
        """§8.5.1.7.6.  A remote writer was admitted to that reader."""
        ...

    def unregister_participant(self, participant_crypto_handle: ParticipantCryptoHandle) -> None:
        """§8.5.1.7.7.  Its keys, and those of all its endpoints, are wiped."""
        ...

    def unregister_datawriter(self, datawriter_crypto_handle: DatawriterCryptoHandle) -> None:
        """§8.5.1.7.8."""
        ...

    def unregister_datareader(self, datareader_crypto_handle: DatareaderCryptoHandle) -> None:
        """§8.5.1.7.9."""
        ...


class CryptoKeyExchange(Protocol):
    """Turns keys into tokens for one peer, and a peer's tokens into keys.  §8.5.1.8; called by the service.

    Setting tokens again replaces them.  Tokens that are malformed, or for other handles, are Refused.
    """

    def create_local_participant_crypto_tokens(
        self,
        local_participant_crypto_handle: ParticipantCryptoHandle,
        remote_participant_crypto_handle: ParticipantCryptoHandle,
    ) -> Sequence[CryptoToken]:
        """§8.5.1.8.1."""
        ...

    def set_remote_participant_crypto_tokens(
        self,
        local_participant_crypto_handle: ParticipantCryptoHandle,
        remote_participant_crypto_handle: ParticipantCryptoHandle,
        remote_participant_tokens: Sequence[CryptoToken],
    ) -> Refused | None:
        """§8.5.1.8.2."""
        ...

    def create_local_datawriter_crypto_tokens(
        self,
        local_datawriter_crypto_handle: DatawriterCryptoHandle,
        remote_datareader_crypto_handle: DatareaderCryptoHandle,
    ) -> Sequence[CryptoToken]:
        """§8.5.1.8.3.  For one of the writer's matched readers."""
        ...

    def set_remote_datawriter_crypto_tokens(
        self,
        local_datareader_crypto_handle: DatareaderCryptoHandle,
        remote_datawriter_crypto_handle: DatawriterCryptoHandle,
        remote_datawriter_tokens: Sequence[CryptoToken],
    ) -> Refused | None:
        """§8.5.1.8.4.  With it the match of the two is complete."""
        ...

    def create_local_datareader_crypto_tokens(
        self,
        local_datareader_crypto_handle: DatareaderCryptoHandle,
        remote_datawriter_crypto_handle: DatawriterCryptoHandle,
    ) -> Sequence[CryptoToken]:
        """§8.5.1.8.5.  For one of the reader's matched writers."""
        ...

    def set_remote_datareader_crypto_tokens(
        self,
        local_datawriter_crypto_handle: DatawriterCryptoHandle,
        remote_datareader_crypto_handle: DatareaderCryptoHandle,
        remote_datareader_tokens: Sequence[CryptoToken],
    ) -> Refused | None:
        """§8.5.1.8.6.  With it the match of the two is complete."""
        ...

    def return_crypto_tokens(self, crypto_tokens: Sequence[CryptoToken]) -> None:
        """§8.5.1.8.7.  They were sent; what can be wiped of them is."""
        ...
