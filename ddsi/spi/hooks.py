"""SecurityHooks: the narrow seam between the core and whatever secures it.

DDS-Security 1.1 §8 defines plugins in terms of handles and tokens; this protocol says the same in the core's
own words - Guid, CacheChange, octets - so that no crypto handle crosses.  The core calls it at fixed
moments and never asks whether security is there: :data:`ddsi.spi.PLAINTEXT` answers every hook.

Methods are called from the engine, which is synchronous: they must not block.  What takes milliseconds is
announced as a :class:`Compute` effect and comes back through :meth:`SecurityHooks.computed`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import field
from typing import Protocol

from ..structure.builtin_entity_ids import BuiltinEndpoints
from ..structure.cache_change import CacheChange
from ..structure.dataclass import dataclass
from ..structure.discovered import (
    DiscoveredParticipantData,
    DiscoveredReaderData,
    DiscoveredWriterData,
    Parameter,
)
from ..structure.guid import EntityId, Guid
from ..structure.qos import EndpointQos
from ..structure.qos_policies import Properties
from ..structure.security_information import EndpointSecurity, ParticipantSecurity
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
    "Publish",
    "Revoked",
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
    """What security adds to the SPDP announcement: parameters (tokens, attributes) and builtin endpoints.

    The participant has exactly the secure builtin endpoints that ``builtin_endpoints`` names.  On the secure SPDP topic
    ``protected_parameters`` follow ``parameters`` (DDS-Security 1.1 §7.4.1.6: the identity status token).
    """

    parameters: tuple[Parameter, ...] = ()
    builtin_endpoints: BuiltinEndpoints = BuiltinEndpoints(0)
    protected_parameters: tuple[Parameter, ...] = ()


@dataclass(frozen=True, slots=True)
class ProtectedEndpoint:
    """What security adds to a local endpoint: SEDP parameters, and which builtin topics speak of it (§7.4.8).

    ``discovery_protected``: the secure SEDP topic announces it, and the plain one does not.
    ``liveliness_protected``: its liveliness is asserted on the secure ParticipantMessage topic.
    ``key_protected``: key hashes do not show the key: they are always a digest, and go with every sample, as nobody
    can compute them before decrypting.
    """

    parameters: tuple[Parameter, ...] = ()
    discovery_protected: bool = False
    liveliness_protected: bool = False
    key_protected: bool = False


@dataclass(frozen=True, slots=True)
class SendMessage:
    """Effect: write this generic message with the builtin writer named, to one participant."""

    writer: EntityId
    change: CacheChange


@dataclass(frozen=True, slots=True)
class Publish:
    """Effect: write a sample, serialised already, on a keyless topic, for everybody who may read it (§8.6: the log).

    The writer is made when it is wanted first, with ``qos``, and stays; where security forbids it nothing is written.
    """

    topic_name: str
    type_name: str
    qos: EndpointQos
    payload: bytes = field(repr=False)


@dataclass(frozen=True, slots=True)
class Compute:
    """Effect: run ``job`` in a worker thread and give its result to :meth:`SecurityHooks.computed`.

    ``generation`` tells under which incarnation of ``subject`` it was asked; results for peers gone are dropped.  The
    job does not raise: what goes wrong in it is part of its result.
    """

    subject: Guid
    generation: int
    job: Callable[[], object] = field(repr=False)


@dataclass(frozen=True, slots=True)
class Decided:
    """Effect: what was PENDING about a participant, or about a (local, remote) pair, is decided now.

    Who is admitted already and is admitted once more begins anew.  A participant: it has started again under the same
    Guid, so what we know of its endpoints is void; they are unmatched, and builtin pairs asked about again.
    :meth:`SecurityHooks.remote_participant_lost` is not called, and the topics by which security itself talks
    (ParticipantStatelessMessage, ParticipantVolatileMessageSecure) are left alone.  A pair of these: its numbers are
    void, and what was not acknowledged is dropped, as a peer that was authenticated anew may count from 1 again.
    """

    local: Guid
    remote: Guid
    admission: Admission


@dataclass(frozen=True, slots=True)
class Revoked:
    """Effect: our own identity or permissions have ended.  The participant says why, and closes (§8.3.2.11.7)."""

    reason: str


HookEffect = SendMessage | Publish | Compute | Decided | Revoked


class SecurityHooks(Protocol):
    """One object per local participant.  The order of the methods is the order in which life calls them."""

    # --- lifecycle ---------------------------------------------------------------------------------------

    def local_participant(self, candidate: LocalParticipant) -> Guid:
        """The Guid to use, adjusted to the identity (DDS-Security 1.1 §8.3.2.11.2, validate_local_identity).

        Called once, before anything is sent.  Raises NotAllowedBySecurity or ConfigurationError; nothing is kept then.
        """
        ...

    def announcement(self) -> Announcement:
        """What to add to SPDP; asked whenever the announcement is made anew (§7.4.1.4)."""
        ...

    def announced(self, parameters: bytes) -> None:
        """What SPDP says of us: a big-endian parameter list with its sentinel and without encapsulation header.

        Called after :meth:`announcement`, and whenever it changes; it is the handshake's c.pdata (§9.3.2.5.1).
        """
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
        authentication itself needs (ParticipantStatelessMessage) are, until a :class:`Decided` comes, whose ``local``
        is our participant.  Who is refused once is asked about again when it announces something new.
        """
        ...

    def remote_participant_changed(self, data: DiscoveredParticipantData, now: float) -> Admission: ...

    def remote_participant_lost(self, guid: Guid) -> None: ...

    def admits_announcement(self, data: DiscoveredWriterData | DiscoveredReaderData, *, is_secure: bool) -> bool:
        """A remote endpoint was announced on the secure SEDP topic, or on the plain one: is that where it belongs?"""
        ...

    def match(self, local: Guid, remote: DiscoveredWriterData | DiscoveredReaderData) -> Admission:
        """May the local endpoint match the remote one (§8.4.2.9.10-11, §8.5.1.7.3-6)?  PENDING: keys are under way.

        Asked for pairs of builtin endpoints too, but SPDP's.  Before a participant is admitted only its
        ParticipantStatelessMessage endpoints are asked about.  Asked again of a pair that is pending, was refused, or
        is matched, when one of the two has changed; a matched one stays so unless it is refused.
        """
        ...

    def unmatch(self, local: Guid, remote: Guid) -> None:
        """A pair of the application's endpoints that was admitted, or pending, is one no more.  Builtin pairs end with
        :meth:`remote_participant_lost`.

        Both endpoints may live on, and the two be asked about again: nothing may be protected or opened for the pair
        until it is admitted again.
        """
        ...

    def remote_endpoint_lost(self, guid: Guid) -> None:
        """An endpoint of the application there is gone; its pairs were unmatched before (§8.5.1.7.8-9)."""
        ...

    def local_participant_deleted(self) -> None:
        """Our participant is no more, or could not be made: identity and permissions are returned, keys wiped.

        Called once, when the last message has been protected; nothing is asked afterwards.  §8.5.1.7.7
        (unregister_participant), §8.3.2.11.17 (return_identity_handle).
        """
        ...

    # --- what applications may know ------------------------------------------------------------------------

    def participant_security(self, participant: Guid) -> ParticipantSecurity:
        """What is known of a participant, our own or a remote one that is admitted, for the application to read.

        DDS-Security 1.1 §7.4.1.4, §7.4.1.6.  Of one that is not authenticated, or not known, an empty value.
        """
        ...

    def endpoint_security(self, endpoint: DiscoveredWriterData | DiscoveredReaderData) -> EndpointSecurity:
        """The same of an endpoint, our own or a remote one (§7.4.1.5, §7.4.1.7, §7.4.1.8)."""
        ...

    # --- messages and the clock --------------------------------------------------------------------------

    def receive_message(self, change: CacheChange, now: float) -> Outcome | None:
        """A generic message arrived on the stateless or the volatile secure topic (§7.4.3, §7.4.4).

        Where it is not read, the outcome says why, to be counted: Rejected, or NotForUs.
        """
        ...

    def computed(self, effect: Compute, result: object, now: float) -> None: ...

    def handle_timeout(self, now: float) -> None: ...

    def next_deadline(self) -> float:
        """When :meth:`handle_timeout` is wanted; ``math.inf`` for never."""
        ...

    def drain_effects(self) -> Sequence[HookEffect]: ...

    # --- transform, outwards -----------------------------------------------------------------------------

    def overhead(self, sender: Guid, receivers: tuple[Guid, ...]) -> Overhead:
        """Octets that protection will add; asked before a message is packed."""
        ...

    def encode_payload(self, writer: Guid, payload: Octets) -> Octets:
        """Protect a SerializedPayload, or one run of fragments of it (§8.5.1.9.1)."""
        ...

    def encode_submessage(self, sender: Guid, receivers: tuple[Guid, ...], submessage: Parts) -> Parts:
        """Protect one submessage of a writer or reader; returns the octets to send in its place (§8.5.1.9.2-3).

        Nothing at all, ``()``, when it must not leave: there is no key for anybody.
        """
        ...

    def encode_message(self, receivers: tuple[Guid, ...], message: Parts) -> Parts:
        """Protect a whole RTPS message, given and returned with its header (§8.5.1.9.4).

        ``receivers`` are endpoints or participants; their participants are meant.  ``()``: nothing is to be sent.
        """
        ...

    # --- transform, inwards ------------------------------------------------------------------------------

    def decode_message(self, message: Octets, source: bytes) -> Octets | Outcome:
        """Undo :meth:`encode_message`, for a message whose first submessage is SRTPS_PREFIX (§8.5.1.9.5).

        ``source``: the 12 octets of the sender's prefix.
        """
        ...

    def decode_submessage(self, protected: Octets, source: bytes) -> Octets | Outcome:
        """Undo :meth:`encode_submessage`: SEC_PREFIX to SEC_POSTFIX in, the submessage out (§8.5.1.9.6-8)."""
        ...

    def open_envelope(self, message: memoryview, start: int, end: int, source: bytes) -> tuple[Octets, int] | None:
        """A short way of :meth:`decode_submessage` for envelopes that are like one which that has opened.

        SEC_PREFIX, little-endian, is at ``message[start]``, and the message ends at ``end``.  What comes back is the
        submessage, which is little-endian and has its length, and where the envelope ends.  None, and ``message`` as it
        was: there is no short way for it.
        """
        ...

    def decode_payload(self, writer: Guid, payload: Octets, place: memoryview | None = None) -> Octets | Outcome:
        """Undo :meth:`encode_payload` (§8.5.1.9.9).

        ``place``: where a plain text that is so long belongs.  It may be put there, and then that is what is returned;
        until it is, anything may be written there.
        Empty where nothing but a key hash in clear says that an instance has ended: is that believed, of this writer?
        """
        ...

    def protects_payload(self, writer: Guid) -> bool:
        """Are this remote writer's payloads protected?

        Then a DATA_FRAG may hold a run of plain fragments of a sample that was protected as a whole (OpenDDS does so;
        §8.5.1.9.1 leaves the order open), and its payload may be called non-standard.
        """
        ...

    def opens_after_joining(self, reader: Guid) -> bool:
        """Does this remote reader join fragments before it opens the payload, instead of opening each run (OpenDDS)?

        Then it is sent fragments of the protected sample.  Asked when a writer's receivers change.
        """
        ...

    def admits(self, sender: bytes, protection: int) -> bool:
        """May a submessage of this remote writer or reader (the 16 octets of its Guid) be acted upon, having come so?

        ``protection`` holds flags of :class:`Protection`, as a plain number, which is combined much faster.
        Asked for every submessage of an endpoint that is matched; and for SPDP in clear of a participant that is known,
        whose announcement or goodbye is not heeded when this is False: an authenticated participant speaks of itself
        on the secure topic only (§7.4.1.6).  On the path of every sample: it must be quick.
        """
        ...
