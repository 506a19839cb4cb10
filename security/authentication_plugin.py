"""The Authentication plugin interface.  DDS-Security 1.1 §8.3.2; conventions: :mod:`ddsi_security.plugins`."""

from __future__ import annotations

from enum import Enum, IntEnum
from typing import Protocol

from ddsi.spi import Refused
from ddsi.structure.dataclass import dataclass
from ddsi.structure.guid import Guid
from ddsi.structure.qos_policies import Properties
from ddsi.structure.vendor import VendorId

from .handles import HandshakeHandle, IdentityHandle, Pending, SharedSecretHandle
from .tokens import (
    AuthenticatedPeerCredentialToken,
    AuthRequestMessageToken,
    HandshakeMessageToken,
    IdentityStatusToken,
    IdentityToken,
    PermissionsCredentialToken,
    PermissionsToken,
)

__all__ = [
    "AuthStatusKind",
    "Authentication",
    "AuthenticationListener",
    "HandshakeStep",
    "LocalIdentity",
    "RemoteIdentity",
    "ValidationResult",
]


class ValidationResult(Enum):
    """ValidationResult_t (§8.3.2.11.1).  VALIDATION_FAILED is :class:`Refused`, PENDING_RETRY is :class:`Pending`."""

    OK = "the peer is authenticated"
    OK_FINAL_MESSAGE = "the peer is authenticated; one more message is to be sent to it"
    PENDING_HANDSHAKE_REQUEST = "we begin: call begin_handshake_request"
    PENDING_HANDSHAKE_MESSAGE = "wait for the peer's next message"


@dataclass(frozen=True, slots=True)
class LocalIdentity:
    """Who we are: the Guid to be used is bound to the certificate (§8.3.2.11.2)."""

    handle: IdentityHandle
    adjusted_participant_guid: Guid


@dataclass(frozen=True, slots=True)
class RemoteIdentity:
    """Who a peer says it is.  ``auth_request_token`` is to be sent to it unless it is NIL (§8.3.2.11.3)."""

    result: ValidationResult
    handle: IdentityHandle
    auth_request_token: AuthRequestMessageToken


@dataclass(frozen=True, slots=True)
class HandshakeStep:
    """Where a handshake stands.  ``message`` is to be sent to the peer, None for nothing."""

    result: ValidationResult
    handle: HandshakeHandle
    message: HandshakeMessageToken | None = None


class AuthStatusKind(IntEnum):
    """What about an identity changed (§8.3.2.11.12)."""

    IDENTITY_STATUS = 1


class AuthenticationListener(Protocol):
    """Hears what happens to identities; implemented by the service.  Called from handle_timeout only (§8.3.2.11.12)."""

    def on_revoke_identity(self, plugin: Authentication, handle: IdentityHandle, ended_at: int) -> None:
        """The identity expired or was revoked: close the local participant, or forget the remote one.

        ``ended_at``: since when, in nanoseconds since 1970.
        """
        ...

    def on_status_changed(self, plugin: Authentication, handle: IdentityHandle, status_kind: AuthStatusKind) -> None:
        """The identity status token is another one now: announce it anew."""
        ...


class Authentication(Protocol):
    """Proves who a participant is, and agrees on a secret with each peer.  §8.3.2.11; called by the service."""

    def validate_local_identity(
        self, domain_id: int, participant_properties: Properties, candidate_participant_guid: Guid
    ) -> LocalIdentity | Pending[LocalIdentity]:
        """§8.3.2.11.2.  First of all calls, before the participant announces itself.

        Raises ConfigurationError for material that is missing, damaged, expired or does not belong together.
        """
        ...

    def validate_remote_identity(
        self,
        remote_auth_request_token: AuthRequestMessageToken,
        local_identity_handle: IdentityHandle,
        remote_identity_token: IdentityToken,
        remote_participant_guid: Guid,
        *,
        remote_vendor_id: VendorId | None = None,
    ) -> RemoteIdentity | Refused | Pending[RemoteIdentity | Refused]:
        """§8.3.2.11.3.  A participant was discovered that announces an identity token.

        ``remote_auth_request_token`` is NIL if none has come.  The lower Guid of the two begins the handshake.  Another
        call for the same participant gives another handle, by which it is authenticated anew.  ``remote_vendor_id`` is
        that of the RTPS header, None if it is not known: not the OMG's, but vendors differ in what octets they take,
        and the prefix of a secured participant's Guid does not tell the vendor.
        """
        ...

    def begin_handshake_request(
        self,
        initiator_identity_handle: IdentityHandle,
        replier_identity_handle: IdentityHandle,
        serialized_local_participant_data: bytes,
    ) -> HandshakeStep | Refused | Pending[HandshakeStep | Refused]:
        """§8.3.2.11.4.  After PENDING_HANDSHAKE_REQUEST; we are the initiator, and the step has a message.

        The participant data is the SPDP parameter list, big-endian, without an encapsulation header.
        """
        ...

    def begin_handshake_reply(
        self,
        handshake_message_in: HandshakeMessageToken,
        initiator_identity_handle: IdentityHandle,
        replier_identity_handle: IdentityHandle,
        serialized_local_participant_data: bytes,
    ) -> HandshakeStep | Refused | Pending[HandshakeStep | Refused]:
        """§8.3.2.11.5.  The peer's request came while we waited; we are the replier, and the step has a message."""
        ...

    def process_handshake(
        self, handshake_message_in: HandshakeMessageToken, handshake_handle: HandshakeHandle
    ) -> HandshakeStep | Refused | Pending[HandshakeStep | Refused]:
        """§8.3.2.11.6.  Each further message.  Refused leaves the handshake as it was: anybody can send one.

        The handle of the step takes the place of the one given, which may then be returned.  A message that comes again
        gives the same step again: so a repeated Request, Reply or Final is answered as it was before.
        """
        ...

    def get_shared_secret(self, handshake_handle: HandshakeHandle) -> SharedSecretHandle:
        """§8.3.2.11.7.  Once the handshake is OK or OK_FINAL_MESSAGE; the key factory wants it.

        With this call or :meth:`get_authenticated_peer_credential_token` the remote identity counts as proven: it has a
        subject name then, and its expiry is watched.
        """
        ...

    def get_authenticated_peer_credential_token(
        self, handshake_handle: HandshakeHandle
    ) -> AuthenticatedPeerCredentialToken:
        """§8.3.2.11.8.  Once the handshake is OK or OK_FINAL_MESSAGE; access control validates permissions with it."""
        ...

    def get_subject_name(self, handle: IdentityHandle) -> str:
        """The subject of the certificate, as RFC 4514 text; of a remote one, once its handshake is OK.

        Access control finds the grant by it.  Not the OMG's, which lets access control read the property
        ``dds.cert.sn`` of the identity token: vendors write that text in forms that cannot be compared.
        """
        ...

    def get_identity_token(self, handle: IdentityHandle) -> IdentityToken:
        """§8.3.2.11.9.  What the participant announces in the clear."""
        ...

    def get_identity_status_token(self, handle: IdentityHandle) -> IdentityStatusToken:
        """§8.3.2.11.10.  What it announces on the secure discovery topic only; NIL for nothing."""
        ...

    def set_permissions_credential_and_token(
        self,
        handle: IdentityHandle,
        permissions_credential_token: PermissionsCredentialToken,
        permissions_token: PermissionsToken,
    ) -> None:
        """§8.3.2.11.11.  From access control, before the first handshake, which sends the credential along."""
        ...

    def set_listener(self, listener: AuthenticationListener | None) -> None:
        """§8.3.2.11.12.  At most one; None for none."""
        ...

    def return_handshake_handle(self, handshake_handle: HandshakeHandle) -> None:
        """§8.3.2.11.16.  The handshake is over, well or not: wipe its secrets."""
        ...

    def return_identity_handle(self, identity_handle: IdentityHandle) -> None:
        """§8.3.2.11.17.  The participant, local or remote, is gone."""
        ...

    def return_sharedsecret_handle(self, sharedsecret_handle: SharedSecretHandle) -> None:
        """§8.3.2.11.18.  The remote participant is gone: wipe the secret."""
        ...

    def next_deadline(self) -> int | None:
        """When :meth:`handle_timeout` is wanted, in nanoseconds of the wall clock; None for never.  Not the OMG's."""
        ...

    def handle_timeout(self) -> None:
        """Tell the listener of what has expired.  Not the OMG's, whose plugins have threads of their own."""
        ...
