"""The QoS policies: one small frozen class each, with the OMG's names and defaults.

DDS 1.4 §2.2.3 (Supported QoS), DDS-XTypes 1.3 §7.6.3 (data representation, type consistency),
DDS-Security 1.1 §7.2.1 (properties).  Durations are seconds: int, float, ``math.inf`` for infinite.
Where a policy has kinds, each kind is a class (``Reliable``, ``BestEffort``) with the wire's number in
``KIND``; a higher number offers more, which is what request and offer are compared by.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import field
from enum import IntEnum
from typing import ClassVar

from .dataclass import dataclass
from .errors import BadParameter

__all__ = [
    "LENGTH_UNLIMITED",
    "AccessScope",
    "Automatic",
    "BestEffort",
    "BinaryProperty",
    "ByReceptionTimestamp",
    "BySourceTimestamp",
    "DataRepresentation",
    "DataRepresentationId",
    "DataTags",
    "Deadline",
    "DestinationOrder",
    "Durability",
    "DurabilityService",
    "EntityFactory",
    "Exclusive",
    "GroupData",
    "History",
    "KeepAll",
    "KeepLast",
    "LatencyBudget",
    "Lifespan",
    "Liveliness",
    "ManualByParticipant",
    "ManualByTopic",
    "Ownership",
    "OwnershipStrength",
    "Partition",
    "Persistent",
    "Presentation",
    "Properties",
    "Property",
    "ReaderDataLifecycle",
    "Reliability",
    "Reliable",
    "ResourceLimits",
    "Shared",
    "TimeBasedFilter",
    "TopicData",
    "Transient",
    "TransientLocal",
    "TransportPriority",
    "TypeConsistency",
    "UserData",
    "Volatile",
    "WriterDataLifecycle",
    "propagated",
]

LENGTH_UNLIMITED = -1
"""No bound, in :class:`ResourceLimits`."""


def _check_duration(policy: str, name: str, seconds: float) -> None:
    if not isinstance(seconds, (int, float)) or math.isnan(seconds) or seconds < 0:
        raise BadParameter(f"{policy}.{name} is a duration in seconds, 0 or more (math.inf for ever), not {seconds!r}")


def _check_octets(policy: str, value: object) -> None:
    if not isinstance(value, bytes):
        raise BadParameter(f"{policy}.value is bytes, not {type(value).__name__}")


# --- reliability -----------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class BestEffort:
    """Samples may be lost."""

    KIND: ClassVar[int] = 1
    max_blocking_time: float = 0.1


@dataclass(frozen=True, slots=True)
class Reliable:
    """Every sample in the history arrives; ``write`` waits at most ``max_blocking_time`` seconds for room."""

    KIND: ClassVar[int] = 2
    max_blocking_time: float = 0.1

    def __post_init__(self) -> None:
        _check_duration("Reliable", "max_blocking_time", self.max_blocking_time)


Reliability = Reliable | BestEffort

# --- history and limits ----------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class KeepLast:
    """The latest ``depth`` samples of each instance."""

    KIND: ClassVar[int] = 0
    depth: int = 1

    def __post_init__(self) -> None:
        if not isinstance(self.depth, int) or self.depth < 1:
            raise BadParameter(f"KeepLast.depth is a number of samples, 1 or more, not {self.depth!r}")


@dataclass(frozen=True, slots=True)
class KeepAll:
    """All samples, as far as :class:`ResourceLimits` allows."""

    KIND: ClassVar[int] = 1


History = KeepLast | KeepAll


@dataclass(frozen=True, slots=True)
class ResourceLimits:
    """How much an entity may hold; -1 (``LENGTH_UNLIMITED``) for no limit."""

    max_samples: int = LENGTH_UNLIMITED
    max_instances: int = LENGTH_UNLIMITED
    max_samples_per_instance: int = LENGTH_UNLIMITED

    def __post_init__(self) -> None:
        for name in ("max_samples", "max_instances", "max_samples_per_instance"):
            value = getattr(self, name)
            if not isinstance(value, int) or (value < 1 and value != LENGTH_UNLIMITED):
                raise BadParameter(f"ResourceLimits.{name} is 1 or more, or -1 for no limit, not {value!r}")


# --- durability ------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Volatile:
    """Only readers that are matched when a sample is written get it."""

    KIND: ClassVar[int] = 0


@dataclass(frozen=True, slots=True)
class TransientLocal:
    """The writer keeps its history for readers that come later."""

    KIND: ClassVar[int] = 1


@dataclass(frozen=True, slots=True)
class Transient:
    """A persistence service, if there is one, keeps the history beyond the writer's life."""

    KIND: ClassVar[int] = 2


@dataclass(frozen=True, slots=True)
class Persistent:
    """A persistence service, if there is one, keeps the history beyond the writer's life and its own."""

    KIND: ClassVar[int] = 3


Durability = Volatile | TransientLocal | Transient | Persistent


@dataclass(frozen=True, slots=True)
class DurabilityService:
    """What a durability service keeps for a topic."""

    service_cleanup_delay: float = 0.0
    history: History = KeepLast(1)
    max_samples: int = LENGTH_UNLIMITED
    max_instances: int = LENGTH_UNLIMITED
    max_samples_per_instance: int = LENGTH_UNLIMITED

    def __post_init__(self) -> None:
        _check_duration("DurabilityService", "service_cleanup_delay", self.service_cleanup_delay)


# --- time ------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Deadline:
    """Each instance is written, or expected, at least once a ``period`` (seconds)."""

    period: float = math.inf

    def __post_init__(self) -> None:
        _check_duration("Deadline", "period", self.period)


@dataclass(frozen=True, slots=True)
class LatencyBudget:
    """A hint how long (seconds) a sample may take."""

    duration: float = 0.0

    def __post_init__(self) -> None:
        _check_duration("LatencyBudget", "duration", self.duration)


@dataclass(frozen=True, slots=True)
class Lifespan:
    """A sample is worth nothing ``duration`` seconds after it was written."""

    duration: float = math.inf

    def __post_init__(self) -> None:
        _check_duration("Lifespan", "duration", self.duration)


@dataclass(frozen=True, slots=True)
class TimeBasedFilter:
    """At most one sample of an instance in ``minimum_separation`` seconds."""

    minimum_separation: float = 0.0

    def __post_init__(self) -> None:
        _check_duration("TimeBasedFilter", "minimum_separation", self.minimum_separation)


# --- liveliness ------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Automatic:
    """The writer is alive while its participant is."""

    KIND: ClassVar[int] = 0
    lease_duration: float = math.inf

    def __post_init__(self) -> None:
        _check_duration("Automatic", "lease_duration", self.lease_duration)


@dataclass(frozen=True, slots=True)
class ManualByParticipant:
    """The application asserts the liveliness of all such writers of a participant at once."""

    KIND: ClassVar[int] = 1
    lease_duration: float = math.inf

    def __post_init__(self) -> None:
        _check_duration("ManualByParticipant", "lease_duration", self.lease_duration)


@dataclass(frozen=True, slots=True)
class ManualByTopic:
    """The application asserts the liveliness of this very writer."""

    KIND: ClassVar[int] = 2
    lease_duration: float = math.inf

    def __post_init__(self) -> None:
        _check_duration("ManualByTopic", "lease_duration", self.lease_duration)


Liveliness = Automatic | ManualByParticipant | ManualByTopic

# --- ownership and order ---------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Shared:
    """Any number of writers may update an instance."""

    KIND: ClassVar[int] = 0


@dataclass(frozen=True, slots=True)
class Exclusive:
    """Only the strongest living writer of an instance is heard."""

    KIND: ClassVar[int] = 1


Ownership = Shared | Exclusive


@dataclass(frozen=True, slots=True)
class OwnershipStrength:
    value: int = 0

    def __post_init__(self) -> None:
        if not isinstance(self.value, int) or not -(1 << 31) <= self.value < 1 << 31:
            raise BadParameter(f"OwnershipStrength.value is an int32, not {self.value!r}")


@dataclass(frozen=True, slots=True)
class ByReceptionTimestamp:
    KIND: ClassVar[int] = 0


@dataclass(frozen=True, slots=True)
class BySourceTimestamp:
    KIND: ClassVar[int] = 1


DestinationOrder = ByReceptionTimestamp | BySourceTimestamp


class AccessScope(IntEnum):
    INSTANCE = 0
    TOPIC = 1
    GROUP = 2


@dataclass(frozen=True, slots=True)
class Presentation:
    """Which changes are seen together (``coherent_access``) and in one order (``ordered_access``)."""

    access_scope: AccessScope = AccessScope.INSTANCE
    coherent_access: bool = False
    ordered_access: bool = False


@dataclass(frozen=True, slots=True)
class Partition:
    """Writers and readers match only if a name of one fits a name of the other; ``*`` and ``?`` are wildcards."""

    names: tuple[str, ...] = ()

    def __init__(self, *names: str) -> None:
        for name in names:
            if not isinstance(name, str):
                raise BadParameter(f"a partition's name is a str, not {name!r}; write Partition('a', 'b')")
        object.__setattr__(self, "names", names)


# --- data carried along ----------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class UserData:
    value: bytes = b""

    def __post_init__(self) -> None:
        _check_octets("UserData", self.value)


@dataclass(frozen=True, slots=True)
class TopicData:
    value: bytes = b""

    def __post_init__(self) -> None:
        _check_octets("TopicData", self.value)


@dataclass(frozen=True, slots=True)
class GroupData:
    value: bytes = b""

    def __post_init__(self) -> None:
        _check_octets("GroupData", self.value)


@dataclass(frozen=True, slots=True)
class DataTags:
    """What an endpoint's data are, in words that permissions may ask for: ``DataTags(("classification", "secret"))``.

    DDS-Security 1.1 §7.2.5 (DataTagQosPolicy).  Announced, and checked when endpoints are made and discovered; nothing
    compares them with the data.  An endpoint keeps those that it was made with.
    """

    tags: tuple[tuple[str, str], ...] = ()

    def __init__(self, *tags: tuple[str, str]) -> None:
        for tag in tags:
            if not isinstance(tag, tuple) or len(tag) != 2 or not all(isinstance(text, str) for text in tag):
                raise BadParameter(f"a data tag is a pair of str, name and value, not {tag!r}")
            if not tag[0]:
                raise BadParameter(f"the data tag {tag!r} has no name")
        object.__setattr__(self, "tags", tags)


@dataclass(frozen=True, slots=True)
class TransportPriority:
    value: int = 0


@dataclass(frozen=True, slots=True)
class EntityFactory:
    autoenable_created_entities: bool = True


@dataclass(frozen=True, slots=True)
class WriterDataLifecycle:
    """Does unregistering an instance also dispose it?"""

    autodispose_unregistered_instances: bool = True


@dataclass(frozen=True, slots=True)
class ReaderDataLifecycle:
    """Seconds after which a reader forgets instances without writers, and disposed ones."""

    autopurge_nowriter_samples_delay: float = math.inf
    autopurge_disposed_samples_delay: float = math.inf

    def __post_init__(self) -> None:
        _check_duration(
            "ReaderDataLifecycle", "autopurge_nowriter_samples_delay", self.autopurge_nowriter_samples_delay
        )
        _check_duration(
            "ReaderDataLifecycle", "autopurge_disposed_samples_delay", self.autopurge_disposed_samples_delay
        )


# --- types -----------------------------------------------------------------------------------------------


class DataRepresentationId(IntEnum):
    XCDR1 = 0
    XML = 1
    XCDR2 = 2


@dataclass(frozen=True, slots=True)
class DataRepresentation:
    """The encodings that a writer offers (it uses the first) or a reader understands.

    None at all, ``DataRepresentation()``, leaves the choice to the type.
    """

    ids: tuple[DataRepresentationId, ...] = ()

    def __init__(self, *ids: int) -> None:
        try:
            object.__setattr__(self, "ids", tuple(DataRepresentationId(value) for value in ids))
        except ValueError:
            raise BadParameter(f"a data representation is XCDR1 or XCDR2, not {ids!r}") from None


@dataclass(frozen=True, slots=True)
class TypeConsistency:
    """How far a reader's type may differ from the writer's (DDS-XTypes 1.3 §7.6.3.4)."""

    DISALLOW_TYPE_COERCION: ClassVar[int] = 0
    ALLOW_TYPE_COERCION: ClassVar[int] = 1
    kind: int = 1
    ignore_sequence_bounds: bool = True
    ignore_string_bounds: bool = True
    ignore_member_names: bool = False
    prevent_type_widening: bool = False
    force_type_validation: bool = False


# --- properties ------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Property:
    """A named text; sent to other participants only if ``propagate``, and never where its name configures security."""

    value: str = field(repr=False)
    propagate: bool = False


@dataclass(frozen=True, slots=True)
class BinaryProperty:
    """Named octets; sent as a :class:`Property` is."""

    value: bytes = field(repr=False)
    propagate: bool = False


Properties = Mapping[str, str | Property | BinaryProperty]

_NEVER_PROPAGATED = ("dds.sec.", "org.eclipse.cyclonedds.sec.", "com.rti.serv.secure.")


def propagated(
    properties: Iterable[tuple[str, str | Property | BinaryProperty]],
) -> Iterator[tuple[str, Property | BinaryProperty]]:
    """Those that are sent to other participants.  A plain str is not: that is how configuration is given.

    What configures security (DDS-Security 1.1 §9.3.1, and what other stacks call it) is not either, whatever was said
    of it: keys and passwords are among it.
    """
    for name, value in properties:
        if isinstance(value, Property | BinaryProperty) and value.propagate and not name.startswith(_NEVER_PROPAGATED):
            yield name, value
