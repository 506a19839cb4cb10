"""The AccessControl plugin interface.  DDS-Security 1.1 §8.4.2; conventions: :mod:`ddsi_security.plugins`."""

from __future__ import annotations

from typing import Protocol

from ddsi.spi import Refused
from ddsi.structure.dataclass import dataclass
from ddsi.structure.discovered import DiscoveredParticipantData, DiscoveredReaderData, DiscoveredWriterData
from ddsi.structure.guid import Guid
from ddsi.structure.qos import EndpointQos
from ddsi.structure.qos_policies import Partition, Properties

from .attributes import DataTags, EndpointSecurityAttributes, ParticipantSecurityAttributes, TopicSecurityAttributes
from .authentication_plugin import Authentication
from .handles import IdentityHandle, Pending, PermissionsHandle
from .tokens import AuthenticatedPeerCredentialToken, PermissionsCredentialToken, PermissionsToken

__all__ = ["AccessControl", "AccessControlListener", "ReaderAdmission"]


@dataclass(frozen=True, slots=True)
class ReaderAdmission:
    """A remote reader may match; ``relay_only``: it may pass on what it receives but gets no key to read it."""

    relay_only: bool = False


class AccessControlListener(Protocol):
    """Hears what happens to permissions; implemented by the service.  Called from handle_timeout only (§8.4.2.9.19)."""

    def on_revoke_permissions(self, plugin: AccessControl, handle: PermissionsHandle, ended_at: int) -> None:
        """They expired: close the local participant, or forget the remote one.

        ``ended_at``: since when, in nanoseconds since 1970.
        """
        ...


class AccessControl(Protocol):
    """Says what a participant may do, and how its data is protected.  §8.4.2.9; called by the service.

    Each ``check_`` returns None when it is allowed.  What is refused names document, rule and missing right.
    """

    def validate_local_permissions(
        self,
        auth_plugin: Authentication,
        identity: IdentityHandle,
        domain_id: int,
        participant_properties: Properties,
        *,
        domain_tag: str = "",
    ) -> PermissionsHandle | Pending[PermissionsHandle]:
        """§8.4.2.9.1.  After validate_local_identity.  Raises ConfigurationError for documents that cannot be used.

        ``domain_tag``, which 1.1 lacks, holds for all checks by the handle: rules of 1.2 may be for tags.
        """
        ...

    def validate_remote_permissions(
        self,
        auth_plugin: Authentication,
        local_identity_handle: IdentityHandle,
        remote_identity_handle: IdentityHandle,
        remote_permissions_token: PermissionsToken,
        remote_credential_token: AuthenticatedPeerCredentialToken,
    ) -> PermissionsHandle | Refused | Pending[PermissionsHandle | Refused]:
        """§8.4.2.9.2.  Once the peer is authenticated."""
        ...

    def check_create_participant(
        self, permissions_handle: PermissionsHandle, domain_id: int, participant_properties: Properties
    ) -> Refused | None:
        """§8.4.2.9.3.  Refused: creating the participant raises NotAllowedBySecurity."""
        ...

    def check_create_datawriter(
        self,
        permissions_handle: PermissionsHandle,
        domain_id: int,
        topic_name: str,
        qos: EndpointQos,
        partition: Partition,
        data_tag: DataTags,
    ) -> Refused | None:
        """§8.4.2.9.4.  Also when the partition of the publisher is to change."""
        ...

    def check_create_datareader(
        self,
        permissions_handle: PermissionsHandle,
        domain_id: int,
        topic_name: str,
        qos: EndpointQos,
        partition: Partition,
        data_tag: DataTags,
    ) -> Refused | None:
        """§8.4.2.9.5.  Also when the partition of the subscriber is to change."""
        ...

    def check_create_topic(
        self, permissions_handle: PermissionsHandle, domain_id: int, topic_name: str, qos: EndpointQos
    ) -> Refused | None:
        """§8.4.2.9.6."""
        ...

    def check_local_datawriter_register_instance(
        self, permissions_handle: PermissionsHandle, writer: Guid, key: bytes
    ) -> Refused | None:
        """§8.4.2.9.7.  ``key`` is the serialised key.  The builtin plugin allows it always, as all known ones do."""
        ...

    def check_local_datawriter_dispose_instance(
        self, permissions_handle: PermissionsHandle, writer: Guid, key: bytes
    ) -> Refused | None:
        """§8.4.2.9.8.  As register."""
        ...

    def check_remote_participant(
        self, permissions_handle: PermissionsHandle, domain_id: int, participant_data: DiscoveredParticipantData
    ) -> Refused | None:
        """§8.4.2.9.9.  Refused: no key is exchanged with it, and none of its endpoints matches."""
        ...

    def check_remote_datawriter(
        self, permissions_handle: PermissionsHandle, domain_id: int, publication_data: DiscoveredWriterData
    ) -> Refused | None:
        """§8.4.2.9.10.  Before a local reader matches it.  By the local governance and the remote permissions."""
        ...

    def check_remote_datareader(
        self, permissions_handle: PermissionsHandle, domain_id: int, subscription_data: DiscoveredReaderData
    ) -> ReaderAdmission | Refused:
        """§8.4.2.9.11.  Before a local writer matches it."""
        ...

    def check_remote_topic(
        self, permissions_handle: PermissionsHandle, domain_id: int, topic_name: str
    ) -> Refused | None:
        """§8.4.2.9.12.  Before the first endpoint of the remote participant on this topic is matched."""
        ...

    def check_local_datawriter_match(
        self,
        writer_permissions_handle: PermissionsHandle,
        reader_permissions_handle: PermissionsHandle,
        publication_data: DiscoveredWriterData,
        subscription_data: DiscoveredReaderData,
    ) -> Refused | None:
        """§8.4.2.9.13.  A local writer and a reader, both admitted so far."""
        ...

    def check_local_datareader_match(
        self,
        reader_permissions_handle: PermissionsHandle,
        writer_permissions_handle: PermissionsHandle,
        subscription_data: DiscoveredReaderData,
        publication_data: DiscoveredWriterData,
    ) -> Refused | None:
        """§8.4.2.9.14.  A local reader and a writer, both admitted so far."""
        ...

    def check_remote_datawriter_register_instance(
        self, permissions_handle: PermissionsHandle, reader: Guid, publication: Guid, key: bytes
    ) -> Refused | None:
        """§8.4.2.9.15.  Refused: the sample is dropped."""
        ...

    def check_remote_datawriter_dispose_instance(
        self, permissions_handle: PermissionsHandle, reader: Guid, publication: Guid, key: bytes
    ) -> Refused | None:
        """§8.4.2.9.16.  Refused: the dispose is dropped."""
        ...

    def get_permissions_token(self, handle: PermissionsHandle) -> PermissionsToken:
        """§8.4.2.9.17.  What the participant announces."""
        ...

    def get_permissions_credential_token(self, handle: PermissionsHandle) -> PermissionsCredentialToken:
        """§8.4.2.9.18.  What the handshake sends; for set_permissions_credential_and_token."""
        ...

    def set_listener(self, listener: AccessControlListener | None) -> None:
        """§8.4.2.9.19.  At most one; None for none."""
        ...

    def get_participant_sec_attributes(self, permissions_handle: PermissionsHandle) -> ParticipantSecurityAttributes:
        """§8.4.2.9.22."""
        ...

    def get_topic_sec_attributes(
        self, permissions_handle: PermissionsHandle, topic_name: str
    ) -> TopicSecurityAttributes:
        """§8.4.2.9.23.  Asked for topics of peers too: what governance has no rule for is protected in every way."""
        ...

    def get_datawriter_sec_attributes(
        self, permissions_handle: PermissionsHandle, topic_name: str, partition: Partition, data_tag: DataTags
    ) -> EndpointSecurityAttributes:
        """§8.4.2.9.24.  Builtin writers too, by the topics' names.  Raises NotAllowedBySecurity where no rule is."""
        ...

    def get_datareader_sec_attributes(
        self, permissions_handle: PermissionsHandle, topic_name: str, partition: Partition, data_tag: DataTags
    ) -> EndpointSecurityAttributes:
        """§8.4.2.9.25.  Builtin readers too, by the topics' names.  Raises NotAllowedBySecurity where no rule is."""
        ...

    def return_permissions_handle(self, handle: PermissionsHandle) -> None:
        """The participant, local or remote, is gone.  Not in the interface of 1.1, which lacks it."""
        ...

    def next_deadline(self) -> int | None:
        """As :meth:`Authentication.next_deadline`."""
        ...

    def handle_timeout(self) -> None:
        """As :meth:`Authentication.handle_timeout`."""
        ...
