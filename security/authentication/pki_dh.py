"""PkiDhAuthentication: the builtin plugin DDS:Auth:PKI-DH.  DDS-Security 1.1 §9.3.

The operations of the interface over ``identity_material`` (who we are), ``peer`` (who they are) and ``handshake``.
It neither sends, nor repeats, nor gives up: that is the service's; it recognises what comes twice.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, TypeVar

from ddsi.spi import Refused
from ddsi.structure.errors import PreconditionNotMet
from ddsi.structure.guid import Guid
from ddsi.structure.qos_policies import Properties
from ddsi.structure.vendor import VendorId

from ..authentication_plugin import (
    AuthenticationListener,
    HandshakeStep,
    LocalIdentity,
    RemoteIdentity,
    ValidationResult,
)
from ..handles import HandshakeHandle, IdentityHandle, Pending, SharedSecretHandle
from ..properties import security_properties
from ..tokens import (
    NIL,
    AuthenticatedPeerCredentialToken,
    AuthRequestMessageToken,
    DataHolder,
    HandshakeMessageToken,
    IdentityStatusToken,
    IdentityToken,
    PermissionsCredentialToken,
    PermissionsToken,
)
from .adjusted_guid import adjusted_guid
from .expiry import ExpiryWatch
from .handshake import Authenticated, Handshake, ReplySent, RequestSent, answer_request, begin
from .handshake_tokens import (
    CHALLENGE_OCTETS,
    CLASS_ID,
    MessageKind,
    auth_request_token,
    class_id_suffix,
    future_challenge,
    message_kind,
)
from .identities import LocalIdentityHandle, RemoteIdentityHandle
from .identity_material import IdentityMaterial, read_identity_material
from .not_trusted import NotTrusted

__all__ = ["PkiDhAuthentication"]

_Kept = TypeVar("_Kept")
_Step = HandshakeStep | Refused | Pending[HandshakeStep | Refused]


class PkiDhAuthentication:
    """Proves identities by certificates and agrees on secrets by Diffie-Hellman.  Implements ``Authentication``.

    Handles of another plugin, or calls out of turn, raise PreconditionNotMet; over what a peer sent nothing is raised.
    Messages that come again: given to ``process_handshake`` with the handle that they led to, a Request gets the same
    Reply, a Reply the same Final, and a Final OK.
    """

    plugin_version: Final = 1

    def __init__(
        self, properties: Properties, *, entropy: Callable[[int], bytes], wall_clock: Callable[[], int]
    ) -> None:
        """``properties`` are read when the local identity is validated, which is given them again."""
        self._entropy: Final = entropy
        self._wall_clock: Final = wall_clock
        self._listener: AuthenticationListener | None = None
        self._expiries: Final = ExpiryWatch()

    # --- identities -------------------------------------------------------------------------------------------

    def validate_local_identity(
        self, domain_id: int, participant_properties: Properties, candidate_participant_guid: Guid
    ) -> LocalIdentity:
        """Reads files, or asks a hardware token; at once, as nothing else can go on without an identity."""
        material = read_identity_material(security_properties(participant_properties), self._wall_clock())
        guid = adjusted_guid(material.certificate.subject_der, candidate_participant_guid)
        handle = LocalIdentityHandle(guid, material, _identity_token(material))
        self._expiries.watch(handle, handle.valid_until)
        return LocalIdentity(handle, guid)

    def validate_remote_identity(
        self,
        remote_auth_request_token: AuthRequestMessageToken,
        local_identity_handle: IdentityHandle,
        remote_identity_token: IdentityToken,
        remote_participant_guid: Guid,
        *,
        remote_vendor_id: VendorId | None = None,
    ) -> RemoteIdentity | Refused:
        """Each call gives a handle of its own, with a challenge of its own: a peer may authenticate anew."""
        local = _kept(LocalIdentityHandle, local_identity_handle)
        try:
            if class_id_suffix(remote_identity_token.class_id).startswith("+"):
                raise NotTrusted("its identity token is another token")
            received = None if remote_auth_request_token == NIL else future_challenge(remote_auth_request_token)
        except NotTrusted as error:
            return Refused(str(error))
        if remote_participant_guid == local.guid:
            return Refused("it bears our own Guid")
        promised = self._entropy(CHALLENGE_OCTETS) if received is None else None
        remote = RemoteIdentityHandle(
            local,
            remote_participant_guid,
            remote_identity_token,
            remote_vendor_id,
            our_challenge=promised,
            its_challenge=received,
        )
        local.add(remote)
        request = NIL if promised is None else auth_request_token(promised)
        result = (
            ValidationResult.PENDING_HANDSHAKE_REQUEST
            if local.guid < remote.guid
            else ValidationResult.PENDING_HANDSHAKE_MESSAGE
        )
        return RemoteIdentity(result, remote, request)

    # --- the handshake ----------------------------------------------------------------------------------------

    def begin_handshake_request(
        self,
        initiator_identity_handle: IdentityHandle,
        replier_identity_handle: IdentityHandle,
        serialized_local_participant_data: bytes,
    ) -> HandshakeStep:
        local, remote = _pair(initiator_identity_handle, replier_identity_handle)
        if local.guid > remote.guid:
            raise PreconditionNotMet("the participant with the lower Guid begins the handshake, and that is the peer")
        return _step(begin(remote, bytes(serialized_local_participant_data), self._entropy))

    def begin_handshake_reply(
        self,
        handshake_message_in: HandshakeMessageToken,
        initiator_identity_handle: IdentityHandle,
        replier_identity_handle: IdentityHandle,
        serialized_local_participant_data: bytes,
    ) -> _Step:
        local, remote = _pair(replier_identity_handle, initiator_identity_handle)
        if local.guid < remote.guid:
            raise PreconditionNotMet("the participant with the lower Guid begins the handshake, and that is ours")

        def prepare() -> Callable[[], Handshake]:
            if message_kind(handshake_message_in) is not MessageKind.REQUEST:
                raise NotTrusted("a handshake begins with a Request")
            data = bytes(serialized_local_participant_data)
            return answer_request(remote, handshake_message_in, data, self._entropy, self._wall_clock())

        return _in_two_halves(prepare)

    def process_handshake(
        self, handshake_message_in: HandshakeMessageToken, handshake_handle: HandshakeHandle
    ) -> _Step:
        handshake = _kept(Handshake, handshake_handle)
        if handshake.received == handshake_message_in:
            return _step(handshake)

        def prepare() -> Callable[[], Handshake]:
            match handshake, message_kind(handshake_message_in):
                case RequestSent(), MessageKind.REPLY:
                    return handshake.on_reply(handshake_message_in, self._wall_clock())
                case ReplySent(), MessageKind.FINAL:
                    return handshake.on_final(handshake_message_in)
                case _, kind:
                    raise NotTrusted(f"a {kind.name} is not what {type(handshake).__name__} waits for")

        return _in_two_halves(prepare)

    def get_shared_secret(self, handshake_handle: HandshakeHandle) -> SharedSecretHandle:
        handshake = self._adopted(handshake_handle)
        values, remote = handshake.values, handshake.remote
        if not handshake.secret:
            raise PreconditionNotMet("the handshake was returned")
        return SharedSecretHandle(
            values.challenge1, values.challenge2, handshake.secret, is_replier=remote.local.guid > remote.guid
        )

    def get_authenticated_peer_credential_token(
        self, handshake_handle: HandshakeHandle
    ) -> AuthenticatedPeerCredentialToken:
        """``c.id``, ``c.perm`` and ``c.pdata`` of the peer, as binary properties.

        The NULs that Cyclone DDS and OpenDDS put behind ``c.perm`` are gone here, and only here: hashes cover them.
        ``c.pdata`` is not the OMG's: what the peer announced in the clear can be compared with what it vouched for.
        """
        theirs = self._adopted(handshake_handle).peer.credentials
        properties = (("c.id", theirs.c_id), ("c.perm", theirs.c_perm.rstrip(b"\0")), ("c.pdata", theirs.c_pdata))
        return DataHolder(CLASS_ID, (), properties)

    def _adopted(self, handshake_handle: HandshakeHandle) -> Authenticated:
        """The handshake, if it is done.  Here, not in the job that ended it, the remote identity learns who it is."""
        handshake = _kept(Handshake, handshake_handle)
        if not isinstance(handshake, Authenticated):
            raise PreconditionNotMet("the handshake is not done yet")
        remote = handshake.remote
        if remote.peer is None:
            remote.peer = handshake.peer
            self._expiries.watch(remote, handshake.peer.valid_until)
        return handshake

    # --- what identities hold ---------------------------------------------------------------------------------

    def get_subject_name(self, handle: IdentityHandle) -> str:
        if isinstance(handle, LocalIdentityHandle):
            return handle.certificate.subject
        peer = _kept(RemoteIdentityHandle, handle).peer
        if peer is None:
            raise PreconditionNotMet("the remote participant is not authenticated: nobody knows who it is")
        return peer.certificate.subject

    def get_identity_token(self, handle: IdentityHandle) -> IdentityToken:
        return _kept(LocalIdentityHandle, handle).identity_token

    def get_identity_status_token(self, handle: IdentityHandle) -> IdentityStatusToken:
        """NIL: there is no OCSP here (§9.3.2.2)."""
        _kept(LocalIdentityHandle, handle)
        return NIL

    def set_permissions_credential_and_token(
        self,
        handle: IdentityHandle,
        permissions_credential_token: PermissionsCredentialToken,
        permissions_token: PermissionsToken,
    ) -> None:
        """The document is ``dds.perm.cert``, as text or as octets.  The token itself is announced, not sent here."""
        document = permissions_credential_token.binary_property("dds.perm.cert")
        if document is None:
            document = (permissions_credential_token.property("dds.perm.cert") or "").encode()
        _kept(LocalIdentityHandle, handle).credential = document

    # --- ends -------------------------------------------------------------------------------------------------

    def set_listener(self, listener: AuthenticationListener | None) -> None:
        self._listener = listener

    def return_handshake_handle(self, handshake_handle: HandshakeHandle) -> None:
        _kept(Handshake, handshake_handle).wipe()

    def return_identity_handle(self, identity_handle: IdentityHandle) -> None:
        self._expiries.forget(identity_handle)
        if isinstance(identity_handle, LocalIdentityHandle):
            identity_handle.key.close()
            return
        remote = _kept(RemoteIdentityHandle, identity_handle)
        remote.local.discard(remote)

    def return_sharedsecret_handle(self, sharedsecret_handle: SharedSecretHandle) -> None:
        sharedsecret_handle.wipe()

    def next_deadline(self) -> int | None:
        """When the first certificate that matters expires: ours, that of an authenticated peer, or of their CAs."""
        return self._expiries.next()

    def handle_timeout(self) -> None:
        now = self._wall_clock()
        while (expired := self._expiries.pop(now)) is not None:
            if self._listener is not None:
                self._listener.on_revoke_identity(self, *expired)


def _identity_token(material: IdentityMaterial) -> IdentityToken:
    """No subject names: vendors write them in forms that do not compare, and OpenDDS compares them (§9.3.2.1)."""
    algorithms = (
        ("dds.cert.algo", material.certificate.algorithm.token_name),
        ("dds.ca.algo", material.authority.algorithm.token_name),
    )
    return DataHolder(CLASS_ID, algorithms)


def _in_two_halves(prepare: Callable[[], Callable[[], Handshake]]) -> _Step:
    """The first half at once, as most of what is forged fails there; the second as a job."""
    try:
        finish = prepare()
    except NotTrusted as error:
        return Refused(str(error))

    def job() -> HandshakeStep | Refused:
        try:
            return _step(finish())
        except NotTrusted as error:
            return Refused(str(error))

    return Pending(job)


def _step(handshake: Handshake) -> HandshakeStep:
    match handshake:
        case Authenticated(sent=None):
            return HandshakeStep(ValidationResult.OK, handshake)
        case Authenticated():
            return HandshakeStep(ValidationResult.OK_FINAL_MESSAGE, handshake, handshake.sent)
        case _:
            return HandshakeStep(ValidationResult.PENDING_HANDSHAKE_MESSAGE, handshake, handshake.sent)


def _pair(local: IdentityHandle, remote: IdentityHandle) -> tuple[LocalIdentityHandle, RemoteIdentityHandle]:
    ours, theirs = _kept(LocalIdentityHandle, local), _kept(RemoteIdentityHandle, remote)
    if theirs.local is not ours:
        raise PreconditionNotMet("the remote identity was validated for another local one")
    return ours, theirs


def _kept(kind: type[_Kept], handle: object) -> _Kept:
    if not isinstance(handle, kind):
        raise PreconditionNotMet(f"{handle!r} is no {kind.__name__} of this plugin")
    return handle
