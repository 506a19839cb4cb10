"""The events: one frozen class per thing that an engine, or the simulated network below it, does.

The engine that emits them is RTPS 2.5 chapter 8; the order here is that of its life: messages, discovery, matching,
data, timers and statuses, security, and last the simulated link.  Arguments come in field order: ``now``,
``participant``, then the event's own.  No field ever holds cryptographic keys or what was decrypted: ``octets`` are
what is on the wire.  ``from_json`` reads back what ``to_json`` wrote.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Self

from ..structure.cache_change import ChangeKind
from ..structure.discovered import DiscoveredEndpointData, DiscoveredParticipantData
from ..structure.guid import Guid, GuidPrefix
from ..structure.locator import Locator
from .event import Category, MalformedTrace, Pairs, TraceEvent
from .qos_text import qos_texts
from .reasons import DropReason, LossReason, RejectReason, SampleLossReason, TypeStep

__all__ = [
    "EVENT_TYPES",
    "Acknowledged",
    "ChangeWritten",
    "Dropped",
    "EndpointChanged",
    "EndpointClosed",
    "EndpointCreated",
    "EndpointDiscovered",
    "EndpointLost",
    "Incompatible",
    "LinkDelayed",
    "LinkDropped",
    "LinkDuplicated",
    "LivelinessChanged",
    "Matched",
    "MessageReceived",
    "MessageSent",
    "ParticipantChanged",
    "ParticipantClosed",
    "ParticipantCreated",
    "ParticipantDiscovered",
    "ParticipantLost",
    "Remark",
    "SampleDelivered",
    "SampleLost",
    "SampleRejected",
    "SecurityEvent",
    "StatusChanged",
    "TimerFired",
    "TopicInconsistent",
    "TypesCompared",
    "Unmatched",
    "from_json",
]


# Messages.


@dataclass(frozen=True, slots=True)
class MessageSent(TraceEvent):
    """A message was handed to the transport, to go to each of the destinations."""

    NAME: ClassVar[str] = "message_sent"
    CATEGORY: ClassVar[Category] = Category.MESSAGE

    destinations: tuple[Locator, ...]
    octets: bytes


@dataclass(frozen=True, slots=True)
class MessageReceived(TraceEvent):
    """A datagram came in; emitted before anything in it is looked at."""

    NAME: ClassVar[str] = "message_received"
    CATEGORY: ClassVar[Category] = Category.MESSAGE

    source: Locator
    octets: bytes


@dataclass(frozen=True, slots=True)
class Dropped(TraceEvent):
    """A datagram, a part of one, or an announcement was not acted upon.

    ``source`` is None for what we drop on the way out, and where only ``remote`` is known: whom it is from.
    """

    NAME: ClassVar[str] = "dropped"
    CATEGORY: ClassVar[Category] = Category.DROP

    reason: DropReason
    source: Locator | None
    detail: str = ""
    remote: Guid | None = None


# Participants and endpoints, ours and discovered ones.


@dataclass(frozen=True, slots=True)
class ParticipantCreated(TraceEvent):
    """Our own participant began; the first event of an engine."""

    NAME: ClassVar[str] = "participant_created"
    CATEGORY: ClassVar[Category] = Category.DISCOVERY

    domain_id: int
    vendor_id: bytes
    entity_name: str = ""


@dataclass(frozen=True, slots=True)
class ParticipantClosed(TraceEvent):
    """Our own participant ended, its goodbye sent; the last event of an engine."""

    NAME: ClassVar[str] = "participant_closed"
    CATEGORY: ClassVar[Category] = Category.DISCOVERY


@dataclass(frozen=True, slots=True)
class _ParticipantAnnounced(TraceEvent):
    remote: Guid
    vendor_id: bytes
    entity_name: str
    lease_duration: float
    locators: tuple[Locator, ...]

    @classmethod
    def of(cls, now: float, participant: GuidPrefix, announced: DiscoveredParticipantData) -> Self:
        """The event for what the participant announced."""
        locators = (
            *announced.metatraffic_unicast,
            *announced.metatraffic_multicast,
            *announced.default_unicast,
            *announced.default_multicast,
        )
        return cls(
            now,
            participant,
            announced.guid,
            announced.vendor_id,
            announced.entity_name,
            announced.lease_duration,
            tuple(dict.fromkeys(locators)),
        )


@dataclass(frozen=True, slots=True)
class ParticipantDiscovered(_ParticipantAnnounced):
    """A participant was heard for the first time (and is no stranger by domain, tag or rights)."""

    NAME: ClassVar[str] = "participant_discovered"
    CATEGORY: ClassVar[Category] = Category.DISCOVERY


@dataclass(frozen=True, slots=True)
class ParticipantChanged(_ParticipantAnnounced):
    """A known participant announces something new: other locators, other user data."""

    NAME: ClassVar[str] = "participant_changed"
    CATEGORY: ClassVar[Category] = Category.DISCOVERY


@dataclass(frozen=True, slots=True)
class ParticipantLost(TraceEvent):
    """A known participant is gone."""

    NAME: ClassVar[str] = "participant_lost"
    CATEGORY: ClassVar[Category] = Category.DISCOVERY

    remote: Guid
    reason: LossReason
    detail: str = ""


@dataclass(frozen=True, slots=True)
class _EndpointAnnounced(TraceEvent):
    """``qos`` holds the policies that are not the default of a silent peer, as texts by their names."""

    endpoint: Guid
    topic_name: str
    type_name: str
    qos: Pairs = ()

    @classmethod
    def of(cls, now: float, participant: GuidPrefix, announced: DiscoveredEndpointData) -> Self:
        """The event for this endpoint's data, as announced by a peer or by ourselves."""
        return cls(
            now,
            participant,
            announced.guid,
            announced.topic_name,
            announced.type_name,
            qos_texts(announced.qos),
        )


@dataclass(frozen=True, slots=True)
class EndpointCreated(_EndpointAnnounced):
    """Our own writer or reader began."""

    NAME: ClassVar[str] = "endpoint_created"
    CATEGORY: ClassVar[Category] = Category.DISCOVERY


@dataclass(frozen=True, slots=True)
class EndpointClosed(TraceEvent):
    """Our own writer or reader ended."""

    NAME: ClassVar[str] = "endpoint_closed"
    CATEGORY: ClassVar[Category] = Category.DISCOVERY

    endpoint: Guid


@dataclass(frozen=True, slots=True)
class EndpointDiscovered(_EndpointAnnounced):
    """A remote writer or reader was announced for the first time."""

    NAME: ClassVar[str] = "endpoint_discovered"
    CATEGORY: ClassVar[Category] = Category.DISCOVERY


@dataclass(frozen=True, slots=True)
class EndpointChanged(_EndpointAnnounced):
    """A known remote writer or reader announces other data."""

    NAME: ClassVar[str] = "endpoint_changed"
    CATEGORY: ClassVar[Category] = Category.DISCOVERY


@dataclass(frozen=True, slots=True)
class EndpointLost(TraceEvent):
    """A remote writer or reader is gone."""

    NAME: ClassVar[str] = "endpoint_lost"
    CATEGORY: ClassVar[Category] = Category.DISCOVERY

    endpoint: Guid
    reason: LossReason
    detail: str = ""


# Matching.


@dataclass(frozen=True, slots=True)
class Matched(TraceEvent):
    """A local endpoint and another one (remote, or in the same participant) may now talk."""

    NAME: ClassVar[str] = "matched"
    CATEGORY: ClassVar[Category] = Category.MATCHING

    local: Guid
    remote: Guid
    topic_name: str


@dataclass(frozen=True, slots=True)
class Unmatched(TraceEvent):
    """A match ended."""

    NAME: ClassVar[str] = "unmatched"
    CATEGORY: ClassVar[Category] = Category.MATCHING

    local: Guid
    remote: Guid
    topic_name: str
    reason: LossReason


@dataclass(frozen=True, slots=True)
class Incompatible(TraceEvent):
    """Two endpoints of one topic do not match because of one policy (one event for each such policy)."""

    NAME: ClassVar[str] = "incompatible"
    CATEGORY: ClassVar[Category] = Category.MATCHING

    local: Guid
    remote: Guid
    topic_name: str
    policy: str
    offered: str
    requested: str


@dataclass(frozen=True, slots=True)
class TypesCompared(TraceEvent):
    """The types of two endpoints are not plainly the same: they wait for more, or match all the same."""

    NAME: ClassVar[str] = "types_compared"
    CATEGORY: ClassVar[Category] = Category.MATCHING

    local: Guid
    remote: Guid
    topic_name: str
    step: TypeStep
    detail: str = ""


@dataclass(frozen=True, slots=True)
class TopicInconsistent(TraceEvent):
    """Two endpoints agree on the topic's name, but their types cannot be assigned."""

    NAME: ClassVar[str] = "topic_inconsistent"
    CATEGORY: ClassVar[Category] = Category.MATCHING

    local: Guid
    remote: Guid
    topic_name: str
    local_type: str
    remote_type: str


# Data.


@dataclass(frozen=True, slots=True)
class ChangeWritten(TraceEvent):
    """A change entered a writer's history cache; ``payload_octets`` counts its serialized payload."""

    NAME: ClassVar[str] = "change_written"
    CATEGORY: ClassVar[Category] = Category.DATA

    writer: Guid
    sequence_number: int
    kind: ChangeKind
    payload_octets: int


@dataclass(frozen=True, slots=True)
class SampleDelivered(TraceEvent):
    """A change entered a reader's history cache, where the application finds it."""

    NAME: ClassVar[str] = "sample_delivered"
    CATEGORY: ClassVar[Category] = Category.DATA

    reader: Guid
    writer: Guid
    sequence_number: int


@dataclass(frozen=True, slots=True)
class SampleLost(TraceEvent):
    """The changes ``first`` to ``last``, both inclusive, will never reach this reader."""

    NAME: ClassVar[str] = "sample_lost"
    CATEGORY: ClassVar[Category] = Category.DATA

    reader: Guid
    writer: Guid
    first: int
    last: int
    reason: SampleLossReason
    detail: str = ""


@dataclass(frozen=True, slots=True)
class SampleRejected(TraceEvent):
    """A reader's resource limits refused a change; a reliable writer will offer it again."""

    NAME: ClassVar[str] = "sample_rejected"
    CATEGORY: ClassVar[Category] = Category.DATA

    reader: Guid
    writer: Guid
    sequence_number: int
    reason: RejectReason


@dataclass(frozen=True, slots=True)
class Acknowledged(TraceEvent):
    """A matched reader has all of a local writer's changes up to ``sequence_number`` (inclusive); it rose."""

    NAME: ClassVar[str] = "acknowledged"
    CATEGORY: ClassVar[Category] = Category.DATA

    writer: Guid
    reader: Guid
    sequence_number: int


# Time and statuses.


@dataclass(frozen=True, slots=True)
class TimerFired(TraceEvent):
    """A deadline passed and its timer was served; ``deadline`` in the seconds of ``now``."""

    NAME: ClassVar[str] = "timer_fired"
    CATEGORY: ClassVar[Category] = Category.TIMER

    timer: str
    deadline: float


@dataclass(frozen=True, slots=True)
class LivelinessChanged(TraceEvent):
    """A matched writer is (no longer) alive in the eyes of a local reader."""

    NAME: ClassVar[str] = "liveliness_changed"
    CATEGORY: ClassVar[Category] = Category.STATUS

    reader: Guid
    writer: Guid
    alive: bool


@dataclass(frozen=True, slots=True)
class StatusChanged(TraceEvent):
    """A communication status of a local entity changed; ``detail`` in words (DDS 1.4 §2.2.4.1)."""

    NAME: ClassVar[str] = "status_changed"
    CATEGORY: ClassVar[Category] = Category.STATUS

    entity: Guid
    status: str
    detail: str = ""


# Security.


@dataclass(frozen=True, slots=True)
class SecurityEvent(TraceEvent):
    """Something that the security plugins did: ``what`` in one stable word, ``detail`` for people; never a secret."""

    NAME: ClassVar[str] = "security_event"
    CATEGORY: ClassVar[Category] = Category.SECURITY

    remote: Guid | None
    what: str
    detail: str = ""


# The simulated link.  ``participant`` is the sender's prefix; ``octets`` are those of its MessageSent.


@dataclass(frozen=True, slots=True)
class LinkDropped(TraceEvent):
    """The network lost a datagram on its way to one destination; ``reason`` in a word: loss, partition, mtu."""

    NAME: ClassVar[str] = "link_dropped"
    CATEGORY: ClassVar[Category] = Category.LINK

    destination: Locator
    octets: bytes
    reason: str = "loss"
    receiver: GuidPrefix | None = None


@dataclass(frozen=True, slots=True)
class LinkDelayed(TraceEvent):
    """The network holds a datagram back for ``delay`` seconds more than it usually does."""

    NAME: ClassVar[str] = "link_delayed"
    CATEGORY: ClassVar[Category] = Category.LINK

    destination: Locator
    octets: bytes
    delay: float
    receiver: GuidPrefix | None = None


@dataclass(frozen=True, slots=True)
class LinkDuplicated(TraceEvent):
    """The network will deliver a datagram ``copies`` times in all."""

    NAME: ClassVar[str] = "link_duplicated"
    CATEGORY: ClassVar[Category] = Category.LINK

    destination: Locator
    octets: bytes
    copies: int
    receiver: GuidPrefix | None = None


@dataclass(frozen=True, slots=True)
class Remark(TraceEvent):
    """A line that a test, a simulation or an application puts into the trace: "B restarts"."""

    NAME: ClassVar[str] = "remark"
    CATEGORY: ClassVar[Category] = Category.REMARK

    text: str


EVENT_TYPES: dict[str, type[TraceEvent]] = {
    event_type.NAME: event_type
    for event_type in (
        MessageSent,
        MessageReceived,
        Dropped,
        ParticipantCreated,
        ParticipantClosed,
        ParticipantDiscovered,
        ParticipantChanged,
        ParticipantLost,
        EndpointCreated,
        EndpointClosed,
        EndpointDiscovered,
        EndpointChanged,
        EndpointLost,
        Matched,
        Unmatched,
        Incompatible,
        TypesCompared,
        TopicInconsistent,
        ChangeWritten,
        SampleDelivered,
        SampleLost,
        SampleRejected,
        Acknowledged,
        TimerFired,
        LivelinessChanged,
        StatusChanged,
        SecurityEvent,
        LinkDropped,
        LinkDelayed,
        LinkDuplicated,
        Remark,
    )
}


def from_json(form: Mapping[str, object]) -> TraceEvent:
    """The event that ``to_json`` turned into ``form``.  Raises MalformedTrace for anything else."""
    name = form.get("event")
    event_type = EVENT_TYPES.get(name) if isinstance(name, str) else None
    if event_type is None:
        raise MalformedTrace(f"no event is called {name!r:.80}")
    return event_type.from_fields(form)
