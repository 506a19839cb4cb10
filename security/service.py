"""SecurityHooks over the plugins: what the core asks in its own words, answered by them.  DDS-Security 1.1 §8.8.

The parts, in the order in which a peer meets them: :mod:`.own_participant` (who we are), :mod:`.handshake` (who it is),
:mod:`.admission` (whether it may join), :mod:`.key_exchange` (its keys and ours), :mod:`.protection` (every octet after
that).  Here they are joined.  :data:`load` is what the core finds under the entry point group ``ddsi.security``.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Final, Protocol

from ddsi.serialization import ParameterId
from ddsi.spi import (
    ADMITTED,
    PENDING,
    Admission,
    Announcement,
    Compute,
    Decided,
    HookEffect,
    LocalParticipant,
    Octets,
    Outcome,
    Overhead,
    Parts,
    ProtectedEndpoint,
    Publish,
    Refused,
    Rejected,
)
from ddsi.structure import builtin_entity_ids as ids
from ddsi.structure.cache_change import CacheChange
from ddsi.structure.discovered import DiscoveredParticipantData, DiscoveredReaderData, DiscoveredWriterData
from ddsi.structure.errors import ConfigurationError
from ddsi.structure.guid import Guid, GuidPrefix
from ddsi.structure.qos import EndpointQos
from ddsi.structure.qos_policies import DataRepresentationId, KeepLast, Properties, Reliable, TransientLocal
from ddsi.structure.security_information import EndpointSecurity, ParticipantSecurity
from ddsi.xtypes import serialize

from .admission import MAX_HANDSHAKE_OCTETS, AdmissionDesk
from .announced import endpoint_info, endpoint_refusal, info
from .builtin_logging_type import LOG_TOPIC_NAME, LOG_TYPE_NAME, BuiltinLoggingTypeV2
from .handshake import State
from .key_exchange import KeyExchange
from .loading import Plugins, load_plugins
from .local_endpoint import SECURE_BUILTIN, LocalEndpoint
from .logging_plugin import LogLevel
from .mailbox import Mailbox
from .own_participant import OwnParticipant
from .properties import HANDSHAKE_LIMIT, security_properties
from .protection import Protection
from .remote_participant import RemoteParticipant, Standing
from .security_information import SecurityInformation
from .waiting_room import MAX_HANDSHAKES

__all__ = ["SecurityService", "load"]

_STATELESS: Final = (ids.PARTICIPANT_STATELESS_MESSAGE_WRITER, ids.PARTICIPANT_STATELESS_MESSAGE_READER)
_LOG_QOS: Final = EndpointQos(reliability=Reliable(), durability=TransientLocal(), history=KeepLast(100))
"""Who looks later sees what happened before; the OMG leaves it open (§9.6)."""
_WALL_CLOCK_CHECK_S: Final = 300.0
"""A wall clock may be set: what expires by it is looked at this often, whatever it said before (Cyclone DDS)."""


class SecurityService:
    """Implements :class:`ddsi.spi.SecurityHooks` for one participant."""

    def __init__(
        self,
        plugins: Plugins,
        *,
        entropy: Callable[[int], bytes],
        wall_clock: Callable[[], int],
        max_handshakes: int = MAX_HANDSHAKES,
    ) -> None:
        self._plugins = plugins
        self._max_handshakes = max_handshakes
        self._entropy = entropy
        self._wall_clock = wall_clock
        self._now = 0.0
        self._effects: list[HookEffect] = []
        self._remotes: dict[bytes, RemoteParticipant] = {}
        self._wall_due = 0.0  # in engine seconds
        self._deadline = math.inf

    # --- ourselves ---------------------------------------------------------------------------------------

    def local_participant(self, candidate: LocalParticipant) -> Guid:
        plugins = self._plugins
        plugins.logging.set_listener(self)
        plugins.logging.enable_logging()
        own = self._own = OwnParticipant(plugins, candidate)
        plugins.logging.set_participant(own.guid, own.domain_id)
        self._mailbox = Mailbox(own.guid, self._effects)
        self._keys = KeyExchange(
            plugins.cryptographic,
            own.crypto,
            is_rtps_protected=own.attributes.is_rtps_protected,
            outbox=self._mailbox.post_keys,
            decide=lambda local, remote, admission: self._effects.append(Decided(local, remote, admission)),
        )
        protection = self._protection = Protection(
            plugins.cryptographic, own.crypto, own.attributes, own.endpoints, self._remotes, self._keys
        )
        self._desk = AdmissionDesk(
            plugins, own, self._remotes, self._keys, self._mailbox, self._effects,
            max_handshakes=self._max_handshakes,
            jitter=lambda: int.from_bytes(self._entropy(4), "big") / 0xFFFFFFFF,
            changed=self._changed,
        )  # fmt: skip
        self._information = SecurityInformation(plugins, own, self._remotes)
        # On the path of every message: not through here.
        self.overhead = protection.overhead
        self.encode_payload = protection.encode_payload
        self.encode_submessage = protection.encode_submessage
        self.encode_message = protection.encode_message
        self.decode_message = protection.decode_message
        self.decode_submessage = protection.decode_submessage
        self.open_envelope = protection.open_envelope
        self.decode_payload = protection.decode_payload
        self.protects_payload = protection.protects_payload
        self.opens_after_joining = protection.opens_after_joining
        self.admits = protection.admits
        return own.guid

    def announcement(self) -> Announcement:
        return self._own.announcement()

    def announced(self, parameters: bytes) -> None:
        self._desk.announced(parameters)

    def local_writer(self, data: DiscoveredWriterData) -> ProtectedEndpoint:
        self._protection.changed()
        return self._own.writer_created(data)

    def local_reader(self, data: DiscoveredReaderData) -> ProtectedEndpoint:
        self._protection.changed()
        return self._own.reader_created(data)

    def local_endpoint_changed(self, data: DiscoveredWriterData | DiscoveredReaderData) -> ProtectedEndpoint:
        self._protection.changed()
        return self._own.endpoint_changed(data)

    def local_endpoint_deleted(self, guid: Guid) -> None:
        endpoint = self._own.endpoints.pop(guid, None)
        if endpoint is not None:
            self._keys.endpoint_deleted(endpoint)
            self._protection.changed()

    def local_participant_deleted(self) -> None:
        self._desk.close()
        for endpoint in self._own.endpoints.values():
            self._keys.endpoint_deleted(endpoint)
        self._own.close()
        self._protection.changed()
        self._plugins.logging.set_listener(None)
        self._effects.clear()
        self._deadline = self._wall_due = math.inf

    def on_log_message(self, event: BuiltinLoggingTypeV2) -> None:
        """The logging plugin wants an event published (§8.6.2)."""
        payload = serialize(event, representation=DataRepresentationId.XCDR1)
        self._effects.append(Publish(LOG_TOPIC_NAME, LOG_TYPE_NAME, _LOG_QOS, payload))

    # --- others ------------------------------------------------------------------------------------------

    def remote_participant(self, data: DiscoveredParticipantData, now: float) -> Admission:
        self._now = now
        admission = self._desk.discovered(data, now)
        self._rearm()
        return admission

    def remote_participant_changed(self, data: DiscoveredParticipantData, now: float) -> Admission:
        self._now = now
        admission = self._desk.changed(data, now)
        self._rearm()
        return admission

    def remote_participant_lost(self, guid: Guid) -> None:
        self._desk.lost(guid, self._now)
        self._rearm()

    def admits_announcement(self, data: DiscoveredWriterData | DiscoveredReaderData, *, is_secure: bool) -> bool:
        attributes = self._plugins.access_control.get_topic_sec_attributes(self._own.permissions, data.topic_name)
        return attributes.is_discovery_protected == is_secure

    def match(self, local: Guid, remote: DiscoveredWriterData | DiscoveredReaderData) -> Admission:
        participant = self._remotes.get(remote.guid.prefix)
        if participant is None:
            return Refused("its participant is not known")
        if remote.guid.entity_id in _STATELESS:
            return ADMITTED
        endpoint = self._own.endpoints[local]
        is_builtin = local.entity_id.is_builtin
        if participant.standing is Standing.UNAUTHENTICATED:
            if endpoint.guid.entity_id in SECURE_BUILTIN:
                return PENDING  # for ever: whatever it claims to have, it has no key, and need not be told
            refusal = None if is_builtin else _protected_refusal(endpoint, remote)
            return refusal or ADMITTED
        if participant.standing is not Standing.ADMITTED:
            return Refused(participant.reason or "its participant is not authenticated")
        relay_only = False
        if not is_builtin:
            permitted = self._permitted(endpoint, participant, remote)
            if isinstance(permitted, Refused):
                return permitted
            relay_only = permitted
        admission = self._keys.match(endpoint, remote.guid, participant, self._now, relay_only=relay_only)
        self._protection.changed()
        if local.entity_id == ids.PARTICIPANT_VOLATILE_MESSAGE_SECURE_WRITER:
            self._keys.send_participant_keys(participant)
        self._rearm()
        return admission

    def _permitted(
        self,
        endpoint: LocalEndpoint,
        participant: RemoteParticipant,
        remote: DiscoveredWriterData | DiscoveredReaderData,
    ) -> Refused | bool:
        """By our governance and the peer's permissions; whether it may only relay, or why nothing at all."""
        access, permissions, domain_id = self._plugins.access_control, participant.permissions, self._own.domain_id
        assert permissions is not None
        difference = endpoint_refusal(
            endpoint_info(endpoint.attributes), info(remote.security_parameters, ParameterId.ENDPOINT_SECURITY_INFO)
        )
        if difference:
            return Refused(f"governance protects topic {remote.topic_name!r} otherwise there: {difference}")
        refusal = access.check_remote_topic(permissions, domain_id, remote.topic_name)
        if refusal is not None:
            return refusal
        if isinstance(remote, DiscoveredWriterData):
            return access.check_remote_datawriter(permissions, domain_id, remote) or False
        admission = access.check_remote_datareader(permissions, domain_id, remote)
        return admission if isinstance(admission, Refused) else admission.relay_only

    def unmatch(self, local: Guid, remote: Guid) -> None:
        self._keys.unmatch(local, remote)
        self._protection.changed()

    def remote_endpoint_lost(self, guid: Guid) -> None:
        if guid in self._keys.by_remote:
            self._keys.remote_endpoint_lost(guid)
            self._protection.changed()

    def participant_security(self, participant: Guid) -> ParticipantSecurity:
        return self._information.participant(participant)

    def endpoint_security(self, endpoint: DiscoveredWriterData | DiscoveredReaderData) -> EndpointSecurity:
        return self._information.endpoint(endpoint)

    # --- messages and the clock --------------------------------------------------------------------------

    def receive_message(self, change: CacheChange, now: float) -> Outcome | None:
        self._now = now
        remote = self._remotes.get(change.writer_guid.prefix)
        if remote is None:
            return Rejected(f"a message of {change.writer_guid.participant}, which is not known")
        is_handshake = change.writer_guid.entity_id == ids.PARTICIPANT_STATELESS_MESSAGE_WRITER
        if is_handshake and len(change.payload) > MAX_HANDSHAKE_OCTETS:
            self._desk.too_large(remote, len(change.payload))
            return Rejected(f"a handshake message of {len(change.payload)} octets")
        message = self._mailbox.open(change)
        if isinstance(message, Outcome):
            return message
        if is_handshake:
            self._desk.receive(remote, message, now)
        elif remote.standing is Standing.ADMITTED:
            self._desk.confirmed(remote)
            refusal = self._keys.receive(remote, message, now)
            self._protection.changed()
            if refusal is not None:
                text = f"a key message of {remote.guid}: {refusal.reason}"
                self._plugins.logging.log(LogLevel.WARNING_LEVEL, text, "key exchange", entity=remote.guid)
        self._rearm()
        return None

    def computed(self, effect: Compute, result: object, now: float) -> None:
        self._now = now
        self._desk.computed(effect, result, now)
        self._rearm()

    def handle_timeout(self, now: float) -> None:
        self._now = now
        if now >= self._wall_due:
            self._plugins.authentication.handle_timeout()
            self._plugins.access_control.handle_timeout()
        self._desk.handle_timeout(now)
        self._keys.handle_timeout(now)
        self._rearm()

    def next_deadline(self) -> float:
        return self._deadline

    def drain_effects(self) -> Sequence[HookEffect]:
        if not self._effects:
            return ()
        effects = list(self._effects)
        self._effects.clear()
        return effects

    def _changed(self) -> None:
        """Somebody was admitted, or has to go."""
        self._protection.changed()

    def _rearm(self) -> None:
        wall = [
            due
            for due in (self._plugins.authentication.next_deadline(), self._plugins.access_control.next_deadline())
            if due is not None
        ]
        self._wall_due = math.inf
        if wall:
            until = (min(wall) - self._wall_clock()) / 1e9
            self._wall_due = self._now + min(max(until, 0.0), _WALL_CLOCK_CHECK_S)
        self._deadline = min(self._wall_due, self._desk.next_deadline(), self._keys.next_deadline())

    def handshake_state(self, remote: GuidPrefix) -> State | None:
        """Where the handshake with this peer stands, for those who show it; None where there is none."""
        participant = self._remotes.get(remote)
        return None if participant is None or participant.handshake is None else participant.handshake.state

    # --- octets: bound to Protection once there is a participant -------------------------------------------

    overhead: Callable[[Guid, tuple[Guid, ...]], Overhead]
    encode_payload: Callable[[Guid, Octets], Octets]
    encode_submessage: Callable[[Guid, tuple[Guid, ...], Parts], Parts]
    encode_message: Callable[[tuple[Guid, ...], Parts], Parts]
    decode_message: Callable[[Octets, GuidPrefix], Octets | Outcome]
    decode_submessage: Callable[[Octets, GuidPrefix], Octets | Outcome]
    open_envelope: Callable[[memoryview, int, int, GuidPrefix], tuple[Octets, int] | None]
    decode_payload: _DecodesPayload
    protects_payload: Callable[[Guid], bool]
    opens_after_joining: Callable[[Guid], bool]
    admits: Callable[[bytes, int], bool]


def _protected_refusal(endpoint: LocalEndpoint, remote: DiscoveredWriterData | DiscoveredReaderData) -> Refused | None:
    """Who has no identity meets only topics that nothing protects (§8.8.2.1)."""
    attributes = endpoint.attributes
    is_controlled = (
        attributes.is_write_protected if isinstance(remote, DiscoveredWriterData) else attributes.is_read_protected
    )
    if is_controlled or endpoint.handle is not None or attributes.is_discovery_protected:
        return Refused(f"topic {endpoint.topic_name!r} is protected, and its participant is not authenticated")
    return None


def _max_handshakes(properties: Properties) -> int:
    """How many handshakes go on at once.  Raises ConfigurationError."""
    value = security_properties(properties).get(HANDSHAKE_LIMIT, str(MAX_HANDSHAKES))
    if not (value.isascii() and value.isdecimal() and 0 < len(value) < 7 and int(value)):
        raise ConfigurationError(f"property {HANDSHAKE_LIMIT} is {value!r}: give a whole number from 1 to 999999")
    return int(value)


class _DecodesPayload(Protocol):
    def __call__(self, writer: Guid, payload: Octets, place: memoryview | None = None) -> Octets | Outcome: ...


class _Factory:
    """Makes the SecurityHooks of one participant from its properties.  Implements ``ddsi.spi.loader.HooksFactory``."""

    # The version of the seam that this package is written for, not whichever the installed core happens to have.
    spi_version: Final = 1

    def __call__(
        self, properties: Properties, *, entropy: Callable[[int], bytes], wall_clock: Callable[[], int]
    ) -> SecurityService:
        plugins = load_plugins(properties, entropy=entropy, wall_clock=wall_clock)
        return SecurityService(
            plugins, entropy=entropy, wall_clock=wall_clock, max_handshakes=_max_handshakes(properties)
        )


load = _Factory()
