"""SecurityHooks: the narrow seam between the core and whatever secures it.

DDS-Security 1.1 §8 defines plugins in terms of handles and tokens; this protocol says the same in the core's
own words - Guid, CacheChange, octets - so that no crypto handle crosses.  The core calls it at fixed
moments and never asks whether security is there: :data:`ddsi.spi.PLAINTEXT` answers every hook.

Methods are called from the engine, which is synchronous: they must not block.  What takes milliseconds is
announced as a :class:`Compute` effect and comes back through :meth:`SecurityHooks.computed`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Protocol

from ..structure.builtin_entity_ids import BuiltinEndpoints
from ..structure.cache_change import CacheChange
from ..structure.discovered import (
    DiscoveredParticipantData,
    DiscoveredReaderData,
    DiscoveredWriterData,
    Parameter,
)
from ..structure.guid import EntityId, Guid, GuidPrefix
from ..structure.qos_policies import Properties
from .outcomes import Admission, Outcome, Overhead

__all__ = [
    "Announcement",
    "Compute",
    "Decided",
    "HookEffect",
    "LocalParticipant",
    "Octets",
    "Parts",
    "ProtectedEndpoint",
    "SecurityHooks",
    "SendMessage",
]

Octets = bytes | bytearray | memoryview
Parts = Sequence[Octets]
"""Octets in several buffers, as they will be given to the socket: nothing is joined that need not be."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LocalParticipant:
    """A participant about to be created: what it would like to be, and the properties that configure security."""

    guid: Guid
    domain_id: int
    domain_tag: str
    properties: Properties = field(repr=False)


@dataclass(frozen=True, slots=True)
class Announcement:
    """What security adds to the SPDP announcement: parameters (tokens, attributes) and builtin endpoints."""

    parameters: tuple[Parameter, ...] = ()
    builtin_endpoints: BuiltinEndpoints = BuiltinEndpoints(0)


@dataclass(frozen=True, slots=True)
class ProtectedEndpoint:
    """What security adds to a local endpoint: SEDP parameters, and which SEDP announces it (the secure one?)."""

    parameters: tuple[Parameter, ...] = ()
    discovery_protected: bool = False
    liveliness_protected: bool = False


@dataclass(frozen=True, slots=True)
class SendMessage:
    """Effect: write this generic message with the builtin writer named, to one participant."""

    writer: EntityId
    change: CacheChange


@dataclass(frozen=True, slots=True)
class Compute:
    """Effect: run ``job`` in a worker thread and give its result to :meth:`SecurityHooks.computed`.

    ``generation`` tells under which incarnation of ``subject`` it was asked; results for peers gone are dropped.
    """

    subject: Guid
    generation: int
    job: Callable[[], object] = field(repr=False)


@dataclass(frozen=True, slots=True)
class Decided:
    """Effect: what was PENDING about a participant, or about a (local, remote) pair, is decided now."""

    local: Guid
    remote: Guid
    admission: Admission


HookEffect = SendMessage | Compute | Decided


class SecurityHooks(Protocol):
    """One object per local participant.  The order of the methods is the order in which life calls them."""

    # --- lifecycle ---------------------------------------------------------------------------------------

    def local_participant(self, candidate: LocalParticipant) -> Guid:
        """The Guid to use, adjusted to the identity (DDS-Security 1.1 §8.3.2.11.2, validate_local_identity).

        Called once, before anything is sent.  Raises NotAllowedBySecurity or ConfigurationError.
        """
        ...

    def announcement(self) -> Announcement:
        """What to add to SPDP; asked whenever the announcement is made anew (§7.4.1.4)."""
        ...

    def local_writer(self, data: DiscoveredWriterData) -> ProtectedEndpoint:
        """A writer is to be created (§8.4.2.9.4, check_create_datawriter).  Raises NotAllowedBySecurity."""
        ...

    def local_reader(self, data: DiscoveredReaderData) -> ProtectedEndpoint:
        """A reader is to be created (§8.4.2.9.5, check_create_datareader).  Raises NotAllowedBySecurity."""
        ...

    def local_endpoint_changed(self, data: DiscoveredWriterData | DiscoveredReaderData) -> ProtectedEndpoint:
        """Its QoS (the partition, say) is to change: rights are checked again.  Raises NotAllowedBySecurity."""
        ...

    def local_endpoint_deleted(self, guid: Guid) -> None: ...

    def remote_participant(self, data: DiscoveredParticipantData, now: float) -> Admission:
        """A participant was discovered (§8.3.2.11.3, validate_remote_identity).

        PENDING while it is authenticated: its endpoints are not matched, and only the builtin endpoints that
        authentication itself needs are, until a :class:`Decided` comes.
        """
        ...

    def remote_participant_changed(self, data: DiscoveredParticipantData, now: float) -> Admission: ...

    def remote_participant_lost(self, guid: Guid) -> None: ...

    def match(self, local: Guid, remote: DiscoveredWriterData | DiscoveredReaderData) -> Admission:
        """May the local endpoint match the remote one (§8.4.2.9.10-11, §8.5.1.7.3-6)?  PENDING: keys are under way."""
        ...

    def unmatch(self, local: Guid, remote: Guid) -> None: ...

    # --- messages and the clock --------------------------------------------------------------------------

    def receive_message(self, change: CacheChange, now: float) -> None:
        """A generic message arrived on the stateless or the volatile secure topic (§7.4.3, §7.4.4)."""
        ...

    def computed(self, effect: Compute, result: object, now: float) -> None: ...

    def handle_timeout(self, now: float) -> None: ...

    def next_deadline(self) -> float:
        """When :meth:`handle_timeout` is wanted; ``math.inf`` for never."""
        ...

    def drain_effects(self) -> Sequence[HookEffect]: ...

    # --- transform, outwards -----------------------------------------------------------------------------

    def overhead(self, sender: Guid, receivers: Sequence[Guid]) -> Overhead:
        """Octets that protection will add; asked before a message is packed."""
        ...

    def encode_payload(self, writer: Guid, payload: Octets) -> Octets:
        """Protect a SerializedPayload, or one run of fragments of it (§8.5.1.9.1)."""
        ...

    def encode_submessage(self, sender: Guid, receivers: Sequence[Guid], submessage: Parts) -> Parts:
        """Protect one submessage of a writer or reader; returns the octets to send in its place (§8.5.1.9.2-3)."""
        ...

    def encode_message(self, receivers: Sequence[Guid], message: Parts) -> Parts:
        """Protect a whole RTPS message, given and returned with its header (§8.5.1.9.4).

        ``receivers`` are endpoints or participants; their participants are meant."""
        ...

    # --- transform, inwards ------------------------------------------------------------------------------

    def decode_message(self, message: Octets, source: GuidPrefix) -> Octets | Outcome:
        """Undo :meth:`encode_message`, for a message whose first submessage is SRTPS_PREFIX (§8.5.1.9.5)."""
        ...

    def decode_submessage(self, protected: Octets, source: GuidPrefix) -> Octets | Outcome:
        """Undo :meth:`encode_submessage`: SEC_PREFIX to SEC_POSTFIX in, the submessage out (§8.5.1.9.6-8)."""
        ...

    def decode_payload(self, writer: Guid, payload: Octets) -> Octets | Outcome:
        """Undo :meth:`encode_payload` (§8.5.1.9.9)."""
        ...

    def admits_clear_message(self, source: bytes) -> bool:
        """May a message of this participant (12 octets) come without message protection?"""
        ...

    def admits_clear_submessage(self, sender: bytes) -> bool:
        """May a submessage of this endpoint (16 octets) come without submessage protection?"""
        ...
