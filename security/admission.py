"""Whether a participant that was discovered may join: from its announcement to its keys, and until it has to go.

DDS-Security 1.1 §8.8.2 (discovery and authentication), §8.8.6 (access control), §8.8.8 (key registration).  A refused
participant stays known, with the reason, until it is lost or announces another identity, so that it is neither asked
nor answered again and again.  Who was once authenticated is never taken for unauthenticated under the same Guid.
"""

from __future__ import annotations

import heapq
import itertools
import math
from collections.abc import Callable
from dataclasses import replace
from datetime import datetime, timedelta
from typing import Final

from ddsi.serialization import ParameterId
from ddsi.spi import ADMITTED, PENDING, Admission, Compute, Decided, HookEffect, Refused, Revoked
from ddsi.structure.builtin_entity_ids import BuiltinEndpoints
from ddsi.structure.discovered import DiscoveredParticipantData
from ddsi.structure.guid import Guid

from .access_control_plugin import AccessControl
from .announced import info, participant_refusal, token, vouched
from .authentication_plugin import Authentication, AuthStatusKind, RemoteIdentity
from .generic_message import GenericMessage
from .handles import HandshakeHandle, IdentityHandle, Pending, PermissionsHandle, SharedSecretHandle
from .handshake import Authenticated, Complete, Failed, Handshake, Output, Reported, Send, State, Work
from .key_exchange import KeyExchange
from .loading import Plugins
from .logging_plugin import LogLevel
from .mailbox import Mailbox
from .own_participant import OwnParticipant
from .remote_participant import RemoteParticipant, Standing
from .tokens import NIL, DataHolder
from .waiting_room import WaitingRoom

__all__ = ["MAX_HANDSHAKE_OCTETS", "AdmissionDesk"]

MAX_HANDSHAKE_OCTETS: Final = 1 << 16
"""Of one message; certificate and permissions are in it.  Several of each participant may be kept."""
_MAX_BANNED: Final = 1024
_FORGOTTEN_AFTER_S: Final = 2.0
_SECURE: Final = BuiltinEndpoints.PARTICIPANT_SECURE_WRITER


class AdmissionDesk:
    """Authenticates and admits the peers of one participant.  It is the listener of both plugins."""

    def __init__(
        self,
        plugins: Plugins,
        own: OwnParticipant,
        remotes: dict[bytes, RemoteParticipant],
        keys: KeyExchange,
        mailbox: Mailbox,
        effects: list[HookEffect],
        *,
        max_handshakes: int,
        jitter: Callable[[], float],
        changed: Callable[[], None],
    ) -> None:
        self._plugins = plugins
        self._own = own
        self._remotes = remotes
        self._keys = keys
        self._mailbox = mailbox
        self._effects = effects
        self._jitter = jitter
        self._changed = changed
        self._participant_data = b""
        self._jobs: dict[int, tuple[Guid, Callable[[object, float], None]]] = {}
        self._generation = 0
        self._timers: list[tuple[float, int, RemoteParticipant]] = []
        self._timer_numbers = itertools.count()
        self._banned: dict[Guid, str] = {}
        self._room = WaitingRoom(max_handshakes)
        plugins.authentication.set_listener(self)
        plugins.access_control.set_listener(self)

    def announced(self, parameters: bytes) -> None:
        """What the handshake says of us, under our signature."""
        self._participant_data = parameters

    # --- they come ---------------------------------------------------------------------------------------

    def discovered(self, data: DiscoveredParticipantData, now: float) -> Admission:
        remote = self._remotes[data.guid.prefix] = RemoteParticipant(data, Standing.PENDING)
        if data.guid in self._banned:
            return self._refused_at_once(remote, self._banned[data.guid])
        identity_token = token(data.security_parameters, ParameterId.IDENTITY_TOKEN)
        # An identity without the secure SPDP topic, or the topic without it, is no secured participant (Cyclone DDS).
        if identity_token == NIL or _SECURE not in data.builtin_endpoints:
            return self._unauthenticated(remote, "it announces no identity")
        difference = participant_refusal(
            self._own.info, info(data.security_parameters, ParameterId.PARTICIPANT_SECURITY_INFO)
        )
        if difference:
            return self._unauthenticated(remote, f"its governance protects participants otherwise: {difference}")
        remote.handshake = self._handshake(remote, identity_token)
        self._room.enter(remote.guid)
        self._call_next(now)
        return self._answer(remote)

    def changed(self, data: DiscoveredParticipantData, now: float) -> Admission:
        """It announces something else.  Another identity, before it was admitted, is another participant."""
        remote = self._remotes.get(data.guid.prefix)
        if remote is None:
            return self.discovered(data, now)
        before, remote.data = remote.data, data
        if remote.standing is not Standing.ADMITTED and before.security_parameters != data.security_parameters:
            self.lost(data.guid, now)
            return self.discovered(data, now)
        return self._answer(remote)

    def lost(self, guid: Guid, now: float) -> None:
        """Nothing of it stays."""
        remote = self._remotes.pop(guid.prefix, None)
        if remote is None:
            return
        self._release(remote)
        for generation in [number for number, (subject, _) in self._jobs.items() if subject == guid]:
            del self._jobs[generation]
        self._changed()
        self._call_next(now)

    def close(self) -> None:
        """Our participant is no more: all are forgotten, and whoever waits is called no more."""
        for remote in self._remotes.values():
            self._release(remote)
        self._remotes.clear()
        self._jobs.clear()
        self._timers.clear()
        self._plugins.authentication.set_listener(None)
        self._plugins.access_control.set_listener(None)

    def _handshake(self, remote: RemoteParticipant, identity_token: DataHolder) -> Handshake:
        authentication, own = self._plugins.authentication, self._own

        def validate(
            auth_request: DataHolder,
        ) -> RemoteIdentity | Refused | Pending[RemoteIdentity | Refused]:
            return authentication.validate_remote_identity(
                auth_request, own.identity, identity_token, remote.guid, remote_vendor_id=remote.data.vendor_id
            )

        return Handshake(
            authentication,
            own.identity,
            validate=validate,
            participant_data=lambda: self._participant_data,
            jitter=self._jitter,
        )

    def _unauthenticated(self, remote: RemoteParticipant, reason: str) -> Admission:
        if not self._own.attributes.allow_unauthenticated_participants:
            return self._refused_at_once(remote, f"{reason}, and governance admits only authenticated participants")
        remote.standing = Standing.UNAUTHENTICATED
        self._changed()
        return ADMITTED

    def _refused_at_once(self, remote: RemoteParticipant, reason: str) -> Refused:
        remote.standing, remote.reason = Standing.REFUSED, reason
        self._log(LogLevel.WARNING_LEVEL, f"participant {remote.guid} is refused: {reason}", "refused", remote.guid)
        return Refused(reason)

    @staticmethod
    def _answer(remote: RemoteParticipant) -> Admission:
        if remote.standing is Standing.REFUSED:
            return Refused(remote.reason)
        return PENDING if remote.standing is Standing.PENDING else ADMITTED

    # --- the handshake -----------------------------------------------------------------------------------

    def receive(self, remote: RemoteParticipant, message: GenericMessage, now: float) -> None:
        """A message of the stateless topic."""
        if remote.handshake is None:
            return
        if remote.renewal is None and remote.handshake.is_begun_anew_by(message):
            if not self._has_forgotten_us(remote, now):
                return
            identity_token = token(remote.data.security_parameters, ParameterId.IDENTITY_TOKEN)
            remote.renewal = self._handshake(remote, identity_token)
            self._room.enter(remote.guid)
        settled, unfinished = remote.handshake, remote.unfinished
        if unfinished is not None:
            if self._room.spoke(remote.guid):
                remote.said = message
            else:
                self._act(remote, unfinished, unfinished.receive(message, now), now)
        if unfinished is not settled and not settled.is_begun_anew_by(message):
            self._act(remote, settled, settled.receive(message, now), now)
        self._call_next(now)

    def too_large(self, remote: RemoteParticipant, octets: int) -> None:
        """A message of the stateless topic, which was not read."""
        self._report(
            remote,
            f"a handshake message has {octets} octets, more than {MAX_HANDSHAKE_OCTETS}: is a document so large?",
        )

    def _call_next(self, now: float) -> None:
        """Whoever waits takes the seats that are free, and those of others whose turn is over."""
        for _ in range(self._room.waiting_count):
            rested = self._room.end_turn(now)
            if rested is not None and (unfinished := self._remotes[rested.prefix].unfinished) is not None:
                unfinished.pause()
            called = self._room.seat_next(now)
            if called is None:
                return
            remote = self._remotes[called.prefix]
            if (unfinished := remote.unfinished) is None:
                self._room.leave(called)
                continue
            said, remote.said = remote.said, None
            self._act(remote, unfinished, unfinished.resume(now), now)
            if said is not None and unfinished is remote.unfinished:
                self._act(remote, unfinished, unfinished.receive(said, now), now)

    @staticmethod
    def _has_forgotten_us(remote: RemoteParticipant, now: float) -> bool:
        """Somebody says so in its name.  It is not so while anything comes that only its keys can have made.

        Who believed at once could be made to tear apart, as often as a stranger likes, what is matched and in use.  Who
        has really forgotten asks again and again.
        """
        if remote.renewal_asked is None or remote.renewal_asked[1] != remote.opened:
            remote.renewal_asked = (now, remote.opened)
        return now - remote.renewal_asked[0] >= _FORGOTTEN_AFTER_S

    def confirmed(self, remote: RemoteParticipant) -> None:
        """It wrote something under the secret that the two share."""
        if remote.handshake is not None:
            remote.handshake.confirm()
            self._arm(remote)

    def computed(self, effect: Compute, result: object, now: float) -> None:
        _, proceed = self._jobs.pop(effect.generation, (None, None))
        if proceed is not None:
            proceed(result, now)
        self._call_next(now)

    def handle_timeout(self, now: float) -> None:
        while self._next_timer() <= now:
            _, _, remote = heapq.heappop(self._timers)
            remote.due = math.inf
            for handshake in (remote.handshake, remote.renewal):
                if handshake is None or handshake.next_deadline() > now:
                    continue
                if handshake.state is State.FAILED:  # it may try again, when it has its turn
                    handshake.pause()
                    self._room.enter(remote.guid)
                else:
                    self._act(remote, handshake, handshake.handle_timeout(now), now)
            self._arm(remote)
        self._call_next(now)

    def next_deadline(self) -> float:
        return min(self._next_timer(), self._room.next_deadline())

    def _next_timer(self) -> float:
        """Of all handshakes.  A crowd of strangers makes many, so nothing here takes longer the more there are."""
        timers = self._timers
        while timers:
            due, _, remote = timers[0]
            if due == remote.due and self._remotes.get(remote.guid.prefix) is remote:
                return due
            heapq.heappop(timers)  # it has another deadline by now, or is gone
        return math.inf

    def _arm(self, remote: RemoteParticipant) -> None:
        due = min(
            handshake.next_deadline() if handshake is not None else math.inf
            for handshake in (remote.handshake, remote.renewal)
        )
        if due != remote.due:
            remote.due = due
            if due != math.inf:
                heapq.heappush(self._timers, (due, next(self._timer_numbers), remote))

    def _act(self, remote: RemoteParticipant, handshake: Handshake, outputs: list[Output], now: float) -> None:
        for output in outputs:
            match output:
                case Send():
                    self._mailbox.post_handshake(remote, output)
                case Complete(send):
                    self._mailbox.complete_handshake(remote, send)
                case Work(job):
                    self._compute(remote, job, lambda result, now: self._worked(remote, handshake, result, now))
                case Authenticated(handle):
                    self._authenticated(remote, handshake, handle, now)
                case Reported(reason):
                    self._report(remote, reason)
                case Failed() if handshake is remote.renewal:
                    handshake.close()
                    remote.renewal = None
                case Failed(reason, _):
                    self._failed(remote, reason)
        if remote.unfinished is None or remote.unfinished.state is State.FAILED:
            self._room.leave(remote.guid)
        self._arm(remote)

    def _worked(self, remote: RemoteParticipant, handshake: Handshake, result: object, now: float) -> None:
        if handshake in (remote.handshake, remote.renewal):  # else it was overtaken
            self._act(remote, handshake, handshake.worked(result, now), now)

    def _compute(
        self, remote: RemoteParticipant, job: Callable[[], object], proceed: Callable[[object, float], None]
    ) -> None:
        self._generation += 1
        self._jobs[self._generation] = (remote.guid, proceed)
        self._effects.append(Compute(remote.guid, self._generation, _guarded(job)))

    def _report(self, remote: RemoteParticipant, reason: str) -> None:
        """Said once for each new reason: what a stranger sends must not fill the log."""
        if reason != remote.reason:
            remote.reason = reason
            self._log(
                LogLevel.WARNING_LEVEL, f"authentication of {remote.guid}: {reason}", "authentication", remote.guid
            )
            if remote.standing is Standing.PENDING:  # who was admitted is not refused for what others say in its name
                self._effects.append(Decided(self._own.guid, remote.guid, Refused(reason)))

    def _failed(self, remote: RemoteParticipant, reason: str) -> None:
        if remote.standing is Standing.PENDING and self._own.attributes.allow_unauthenticated_participants:
            self._log(
                LogLevel.NOTICE_LEVEL,
                f"{remote.guid} is taken as unauthenticated: {reason}",
                "authentication",
                remote.guid,
            )
            remote.standing, remote.handshake = Standing.UNAUTHENTICATED, None
            self._changed()
            self._effects.append(Decided(self._own.guid, remote.guid, ADMITTED))
        else:
            self._report(remote, reason)

    # --- permissions and keys ----------------------------------------------------------------------------

    def _authenticated(
        self, remote: RemoteParticipant, handshake: Handshake, handle: HandshakeHandle, now: float
    ) -> None:
        """The peer is who it says; what may it do?  After a renewal too, as its permissions may be others now."""
        authentication = self._plugins.authentication
        assert handshake.remote_identity is not None
        credential = authentication.get_authenticated_peer_credential_token(handle)
        remote.vouched = vouched(remote.data.security_parameters, credential.binary_property("c.pdata") or b"")
        difference = participant_refusal(self._own.info, info(remote.vouched, ParameterId.PARTICIPANT_SECURITY_INFO))
        if difference:
            self._refuse(remote, f"its governance protects participants otherwise: {difference}")
            return
        shared_secret = authentication.get_shared_secret(handle)
        result = self._plugins.access_control.validate_remote_permissions(
            authentication,
            self._own.identity,
            handshake.remote_identity,
            token(remote.vouched, ParameterId.PERMISSIONS_TOKEN),
            credential,
        )
        self._permitted(remote, handshake, shared_secret, result, now)

    def _permitted(
        self,
        remote: RemoteParticipant,
        handshake: Handshake,
        shared_secret: SharedSecretHandle,
        result: object,
        now: float,
    ) -> None:
        if handshake not in (remote.handshake, remote.renewal):
            self._plugins.authentication.return_sharedsecret_handle(shared_secret)
            return
        match result:
            case Pending(job):
                self._compute(
                    remote, job, lambda result, now: self._permitted(remote, handshake, shared_secret, result, now)
                )
            case Refused(reason):
                self._plugins.authentication.return_sharedsecret_handle(shared_secret)
                self._refuse(remote, reason)
            case PermissionsHandle():
                refusal = self._plugins.access_control.check_remote_participant(
                    result, self._own.domain_id, remote.data
                )
                if refusal is not None:
                    self._plugins.authentication.return_sharedsecret_handle(shared_secret)
                    self._plugins.access_control.return_permissions_handle(result)
                    self._refuse(remote, refusal.reason)
                else:
                    self._admit(remote, handshake, shared_secret, result, now)

    def _admit(
        self,
        remote: RemoteParticipant,
        handshake: Handshake,
        shared_secret: SharedSecretHandle,
        permissions: PermissionsHandle,
        now: float,
    ) -> None:
        assert handshake.remote_identity is not None
        crypto = self._plugins.cryptographic.register_matched_remote_participant(
            self._own.crypto, handshake.remote_identity, permissions, shared_secret
        )
        subject = self._plugins.authentication.get_subject_name(handshake.remote_identity)
        if remote.standing is Standing.ADMITTED:
            self._keys.forget(remote)
            self._return_credentials(remote)
            remote.renewal_asked = None
            if handshake is remote.renewal:
                if remote.handshake is not None:
                    remote.handshake.close()
                remote.handshake, remote.renewal = handshake, None
            self._log(
                LogLevel.NOTICE_LEVEL, f"{remote.guid}, {subject}, authenticated anew", "authenticated", remote.guid
            )
        else:
            self._log(
                LogLevel.INFO_LEVEL,
                f"participant {remote.guid} is {subject}, authenticated",
                "authenticated",
                remote.guid,
            )
        remote.crypto, remote.shared_secret, remote.permissions = crypto, shared_secret, permissions
        remote.data = replace(remote.data, security_parameters=remote.vouched)
        if remote.standing is Standing.ADMITTED:
            volatile = [endpoint for endpoint in self._own.endpoints.values() if endpoint.is_volatile]
            self._keys.begin_anew(remote, volatile, now)
        remote.standing, remote.reason = Standing.ADMITTED, ""
        self._changed()
        self._effects.append(Decided(self._own.guid, remote.guid, ADMITTED))

    def _refuse(self, remote: RemoteParticipant, reason: str) -> None:
        """It may not join, or not any longer; and it will not be asked again under this Guid."""
        self._log(LogLevel.WARNING_LEVEL, f"participant {remote.guid} is refused: {reason}", "refused", remote.guid)
        self._ban(remote.guid, reason)
        self._release(remote)
        remote.standing, remote.reason = Standing.REFUSED, reason
        self._changed()
        self._effects.append(Decided(self._own.guid, remote.guid, Refused(reason)))

    def _ban(self, guid: Guid, reason: str) -> None:
        while len(self._banned) >= _MAX_BANNED:
            del self._banned[next(iter(self._banned))]
        self._banned[guid] = reason

    def _release(self, remote: RemoteParticipant) -> None:
        """Wipe what can be wiped; the key that the two share goes last of the keys."""
        self._keys.forget(remote)
        self._return_credentials(remote)
        for handshake in (remote.handshake, remote.renewal):
            if handshake is not None:
                handshake.close()
        remote.handshake = remote.renewal = remote.said = remote.posted = None
        self._room.leave(remote.guid)

    def _return_credentials(self, remote: RemoteParticipant) -> None:
        """What the plugins gave us when it authenticated."""
        if remote.permissions is not None:
            self._plugins.access_control.return_permissions_handle(remote.permissions)
            remote.permissions = None
        if remote.shared_secret is not None:
            self._plugins.authentication.return_sharedsecret_handle(remote.shared_secret)
            remote.shared_secret = None

    # --- what ends while it is used ----------------------------------------------------------------------

    def on_revoke_identity(self, plugin: Authentication, handle: IdentityHandle, ended_at: int) -> None:
        what = f"the identity certificate ended at {_utc(ended_at)}"
        self._revoked(what, lambda remote: _identity_of(remote) is handle, is_ours=handle is self._own.identity)

    def on_status_changed(self, plugin: Authentication, handle: IdentityHandle, status_kind: AuthStatusKind) -> None:
        """The status token goes with the next announcement."""

    def on_revoke_permissions(self, plugin: AccessControl, handle: PermissionsHandle, ended_at: int) -> None:
        what = f"the permissions ended at {_utc(ended_at)}"
        self._revoked(what, lambda remote: remote.permissions is handle, is_ours=handle is self._own.permissions)

    def _revoked(self, what: str, concerns: Callable[[RemoteParticipant], bool], *, is_ours: bool) -> None:
        if is_ours:
            reason = f"{what}: renew what has ended, and create the participant anew"
            self._log(LogLevel.CRITICAL_LEVEL, reason, "revoked")
            self._effects.append(Revoked(reason))
            return
        for remote in list(self._remotes.values()):
            if concerns(remote):
                self._refuse(remote, what)

    def _log(self, level: LogLevel, text: str, category: str, entity: Guid | None = None) -> None:
        self._plugins.logging.log(level, text, category, entity=entity)


def _utc(nanoseconds: int) -> str:
    """A time since 1970, to the second."""
    return (datetime(1970, 1, 1) + timedelta(seconds=nanoseconds // 10**9)).isoformat() + "Z"


def _identity_of(remote: RemoteParticipant) -> IdentityHandle | None:
    return remote.handshake.remote_identity if remote.handshake is not None else None


def _guarded(job: Callable[[], object]) -> Callable[[], object]:
    """A plugin that fails must not take the participant with it: its failure is a refusal."""

    def run() -> object:
        try:
            return job()
        except Exception as error:
            return Refused(f"the plugin failed: {type(error).__name__}: {error}")

    return run
