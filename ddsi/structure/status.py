"""The communication statuses, as the typed events that an application receives.

DDS 1.4 §2.2.4.1 (Communication Status).  Each event holds the totals and what changed since the event
before; the value of a status, what changed since it was read last.  ``handle`` of a remote entity is its Guid.
"""

from __future__ import annotations

from enum import StrEnum

from .dataclass import dataclass
from .guid import GUID_UNKNOWN, Guid

__all__ = [
    "DataAvailable",
    "DataOnReaders",
    "Incompatibility",
    "InconsistentTopic",
    "LivelinessChanged",
    "LivelinessLost",
    "OfferedDeadlineMissed",
    "OfferedIncompatibleQos",
    "PublicationMatched",
    "RequestedDeadlineMissed",
    "RequestedIncompatibleQos",
    "SampleLost",
    "SampleRejected",
    "SampleRejectedKind",
    "SecurityRefused",
    "SecurityRevoked",
    "Status",
    "SubscriptionMatched",
]


class SampleRejectedKind(StrEnum):
    """Which of a reader's resource limits refused a sample.  DDS 1.4 §2.2.4.1 (SampleRejectedStatusKind)."""

    NOT_REJECTED = "not_rejected"
    INSTANCES_LIMIT = "instances_limit"
    SAMPLES_LIMIT = "samples_limit"
    SAMPLES_PER_INSTANCE_LIMIT = "samples_per_instance_limit"


@dataclass(frozen=True, slots=True, kw_only=True)
class Incompatibility:
    """Why a policy of two endpoints does not fit: its name, and what either side wants, as readable text."""

    policy: str
    policy_id: int
    offered: str
    requested: str

    def __str__(self) -> str:
        return f"{self.policy}: offered {self.offered}, requested {self.requested}"


@dataclass(frozen=True, slots=True, kw_only=True)
class DataAvailable:
    """There is something in a reader that came after it was looked into last."""

    is_available: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class DataOnReaders:
    """There is such a thing in a reader of the subscriber."""

    is_available: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class PublicationMatched:
    """A writer gained or lost a matched reader."""

    total_count: int = 0
    total_count_change: int = 0
    current_count: int = 0
    current_count_change: int = 0
    last_subscription_handle: Guid = GUID_UNKNOWN


@dataclass(frozen=True, slots=True, kw_only=True)
class SubscriptionMatched:
    """A reader gained or lost a matched writer."""

    total_count: int = 0
    total_count_change: int = 0
    current_count: int = 0
    current_count_change: int = 0
    last_publication_handle: Guid = GUID_UNKNOWN


@dataclass(frozen=True, slots=True, kw_only=True)
class OfferedIncompatibleQos:
    """A reader of the writer's topic asks for more than the writer offers."""

    total_count: int = 0
    total_count_change: int = 0
    last_policy_id: int = 0
    incompatibilities: tuple[Incompatibility, ...] = ()
    last_subscription_handle: Guid = GUID_UNKNOWN


@dataclass(frozen=True, slots=True, kw_only=True)
class RequestedIncompatibleQos:
    """A writer of the reader's topic offers less than the reader asks for."""

    total_count: int = 0
    total_count_change: int = 0
    last_policy_id: int = 0
    incompatibilities: tuple[Incompatibility, ...] = ()
    last_publication_handle: Guid = GUID_UNKNOWN


@dataclass(frozen=True, slots=True, kw_only=True)
class LivelinessLost:
    """A writer of manual liveliness did not assert it in time."""

    total_count: int = 0
    total_count_change: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class LivelinessChanged:
    """A matched writer is now alive, or is no longer."""

    alive_count: int = 0
    alive_count_change: int = 0
    not_alive_count: int = 0
    not_alive_count_change: int = 0
    last_publication_handle: Guid = GUID_UNKNOWN


@dataclass(frozen=True, slots=True, kw_only=True)
class OfferedDeadlineMissed:
    """A writer did not write an instance within its deadline."""

    total_count: int = 0
    total_count_change: int = 0
    last_instance_handle: bytes = b""


@dataclass(frozen=True, slots=True, kw_only=True)
class RequestedDeadlineMissed:
    """A reader did not receive an instance within its deadline."""

    total_count: int = 0
    total_count_change: int = 0
    last_instance_handle: bytes = b""


@dataclass(frozen=True, slots=True, kw_only=True)
class SampleLost:
    """Samples will never be delivered; ``reason`` in words."""

    total_count: int = 0
    total_count_change: int = 0
    reason: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class SampleRejected:
    """A reader's resource limit refused a sample; ``reason`` is the limit's name, ``last_reason`` the OMG's kind.

    A best-effort sample is lost by that.  A reliable one counts once and is offered again when there is room.
    """

    total_count: int = 0
    total_count_change: int = 0
    last_reason: SampleRejectedKind = SampleRejectedKind.NOT_REJECTED
    last_instance_handle: bytes = b""
    reason: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class InconsistentTopic:
    """A peer uses the topic's name with another type.

    ``reason``: what is between the types, the member's path first; empty where their names tell.
    """

    total_count: int = 0
    total_count_change: int = 0
    remote_type_name: str = ""
    reason: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class SecurityRefused:
    """A remote participant or endpoint was refused by security; ``reason`` in words, for people here only."""

    remote: Guid = GUID_UNKNOWN
    reason: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class SecurityRevoked:
    """The participant's own identity or permissions have ended: it closes.  DDS-Security 1.1 §8.3.2.11.7.

    Whatever is asked of it or its entities afterwards raises NotAllowedBySecurity with this ``reason``.
    """

    reason: str = ""


Status = (
    DataAvailable
    | DataOnReaders
    | PublicationMatched
    | SubscriptionMatched
    | OfferedIncompatibleQos
    | RequestedIncompatibleQos
    | LivelinessLost
    | LivelinessChanged
    | OfferedDeadlineMissed
    | RequestedDeadlineMissed
    | SampleLost
    | SampleRejected
    | InconsistentTopic
    | SecurityRefused
    | SecurityRevoked
)
