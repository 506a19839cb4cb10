"""``Qos``, what a user asks for, and ``EndpointQos``, what a writer or reader then has.

DDS 1.4 §2.2.3.  A :class:`Qos` holds the policies that somebody set and None for all others; an
:class:`EndpointQos` holds every policy that is announced or acted upon, the OMG's defaults filled in.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field, fields, replace
from types import MappingProxyType
from typing import TYPE_CHECKING

from . import qos_policies as p
from .dataclass import dataclass
from .errors import BadParameter, InconsistentPolicy
from .keywords import refuse_unknown_keywords

__all__ = ["EndpointQos", "Qos", "reader_qos", "writer_qos"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Qos:
    """Quality of service, one value for every kind of entity; what is None was not set.

    ``a | b`` holds what either has, and b's where both have it; properties are merged one by one.
    """

    reliability: p.Reliability | None = None
    durability: p.Durability | None = None
    history: p.History | None = None
    resource_limits: p.ResourceLimits | None = None
    durability_service: p.DurabilityService | None = None
    deadline: p.Deadline | None = None
    latency_budget: p.LatencyBudget | None = None
    lifespan: p.Lifespan | None = None
    time_based_filter: p.TimeBasedFilter | None = None
    liveliness: p.Liveliness | None = None
    ownership: p.Ownership | None = None
    ownership_strength: p.OwnershipStrength | None = None
    destination_order: p.DestinationOrder | None = None
    presentation: p.Presentation | None = None
    partition: p.Partition | None = None
    user_data: p.UserData | None = None
    topic_data: p.TopicData | None = None
    group_data: p.GroupData | None = None
    data_tags: p.DataTags | None = None
    transport_priority: p.TransportPriority | None = None
    entity_factory: p.EntityFactory | None = None
    writer_data_lifecycle: p.WriterDataLifecycle | None = None
    reader_data_lifecycle: p.ReaderDataLifecycle | None = None
    data_representation: p.DataRepresentation | None = None
    type_consistency: p.TypeConsistency | None = None
    entity_name: str | None = None
    properties: p.Properties = field(default_factory=lambda: MappingProxyType({}))

    if not TYPE_CHECKING:  # type checkers know the names

        def __new__(cls, *positional, **given):
            if positional or not given.keys() <= cls.__dataclass_fields__.keys():
                refuse_unknown_keywords("Qos", cls.__dataclass_fields__, given, len(positional))
            return object.__new__(cls)

    def __post_init__(self) -> None:
        if not isinstance(self.properties, Mapping):
            raise BadParameter(f"Qos(properties=...) takes a dict, not a {type(self.properties).__name__}")
        for item in fields(self):
            value = getattr(self, item.name)
            allowed = _ALLOWED.get(item.name)
            if value is not None and allowed and not isinstance(value, allowed):
                names = " or ".join(f"{kind.__name__}(...)" for kind in allowed)
                raise BadParameter(f"Qos({item.name}=...) takes {names}, not {value!r}")
        for name, value in self.properties.items():
            if not isinstance(name, str) or not isinstance(value, (str, p.Property, p.BinaryProperty)):
                raise BadParameter(
                    f"property {name!r} is a str, a Property or a BinaryProperty, not {type(value).__name__}"
                )

    def __or__(self, other: Qos) -> Qos:
        if not isinstance(other, Qos):
            return NotImplemented
        given = {
            item.name: getattr(other, item.name)
            for item in fields(other)
            if item.name != "properties" and getattr(other, item.name) is not None
        }
        return replace(self, **given, properties={**self.properties, **other.properties})

    def __repr__(self) -> str:
        given = [
            f"{item.name}={getattr(self, item.name)!r}"
            for item in fields(self)
            if item.name != "properties" and getattr(self, item.name) is not None
        ]
        if self.properties:  # names only: a value may be a secret
            given.append(f"properties=<{', '.join(sorted(self.properties))}>")
        return f"Qos({', '.join(given)})"


_ALLOWED: dict[str, tuple[type, ...]] = {
    "reliability": (p.Reliable, p.BestEffort),
    "durability": (p.Volatile, p.TransientLocal, p.Transient, p.Persistent),
    "history": (p.KeepLast, p.KeepAll),
    "resource_limits": (p.ResourceLimits,),
    "durability_service": (p.DurabilityService,),
    "deadline": (p.Deadline,),
    "latency_budget": (p.LatencyBudget,),
    "lifespan": (p.Lifespan,),
    "time_based_filter": (p.TimeBasedFilter,),
    "liveliness": (p.Automatic, p.ManualByParticipant, p.ManualByTopic),
    "ownership": (p.Shared, p.Exclusive),
    "ownership_strength": (p.OwnershipStrength,),
    "destination_order": (p.ByReceptionTimestamp, p.BySourceTimestamp),
    "presentation": (p.Presentation,),
    "partition": (p.Partition,),
    "user_data": (p.UserData,),
    "topic_data": (p.TopicData,),
    "group_data": (p.GroupData,),
    "data_tags": (p.DataTags,),
    "transport_priority": (p.TransportPriority,),
    "entity_factory": (p.EntityFactory,),
    "writer_data_lifecycle": (p.WriterDataLifecycle,),
    "reader_data_lifecycle": (p.ReaderDataLifecycle,),
    "data_representation": (p.DataRepresentation,),
    "type_consistency": (p.TypeConsistency,),
    "entity_name": (str,),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class EndpointQos:
    """Every policy of one DataWriter or DataReader; the defaults are those for a peer that announces nothing.

    RTPS 2.5 §9.6.3 (a parameter that is absent has its policy's default), DDS 1.4 §2.2.3.
    """

    reliability: p.Reliability = p.BestEffort()
    durability: p.Durability = p.Volatile()
    history: p.History = p.KeepLast(1)
    resource_limits: p.ResourceLimits = p.ResourceLimits()
    durability_service: p.DurabilityService = p.DurabilityService()
    deadline: p.Deadline = p.Deadline()
    latency_budget: p.LatencyBudget = p.LatencyBudget()
    lifespan: p.Lifespan = p.Lifespan()
    time_based_filter: p.TimeBasedFilter = p.TimeBasedFilter()
    liveliness: p.Liveliness = p.Automatic()
    ownership: p.Ownership = p.Shared()
    ownership_strength: p.OwnershipStrength = p.OwnershipStrength()
    destination_order: p.DestinationOrder = p.ByReceptionTimestamp()
    presentation: p.Presentation = p.Presentation()
    partition: p.Partition = p.Partition()
    user_data: p.UserData = p.UserData()
    topic_data: p.TopicData = p.TopicData()
    group_data: p.GroupData = p.GroupData()
    data_tags: p.DataTags = p.DataTags()
    transport_priority: p.TransportPriority = p.TransportPriority()
    writer_data_lifecycle: p.WriterDataLifecycle = p.WriterDataLifecycle()
    reader_data_lifecycle: p.ReaderDataLifecycle = p.ReaderDataLifecycle()
    data_representation: p.DataRepresentation = p.DataRepresentation()
    type_consistency: p.TypeConsistency = p.TypeConsistency()
    entity_name: str = ""
    properties: p.Properties = field(default_factory=lambda: MappingProxyType({}))

    @property
    def is_reliable(self) -> bool:
        return self.reliability.KIND == p.Reliable.KIND

    @property
    def is_transient_local(self) -> bool:
        """Does the writer keep history for late joiners?  The kinds beyond it do so too (DDS 1.4 §2.2.3.4)."""
        return self.durability.KIND >= p.TransientLocal.KIND


def writer_qos(qos: Qos) -> EndpointQos:
    """All policies of a DataWriter: as asked, else the OMG's default for writers (reliable)."""
    return _resolve(qos, EndpointQos(reliability=p.Reliable()))


def reader_qos(qos: Qos) -> EndpointQos:
    """All policies of a DataReader: as asked, else the OMG's default for readers (best effort)."""
    return _resolve(qos, EndpointQos(reliability=p.BestEffort()))


def _resolve(qos: Qos, default: EndpointQos) -> EndpointQos:
    given = {
        item.name: getattr(qos, item.name) for item in fields(default) if getattr(qos, item.name, None) is not None
    }
    resolved = replace(default, **given)
    _check_consistency(resolved)
    return resolved


def _check_consistency(qos: EndpointQos) -> None:
    """DDS 1.4 §2.2.3: the combinations of policies that it calls inconsistent."""
    limits = qos.resource_limits
    unlimited = p.LENGTH_UNLIMITED
    if isinstance(qos.history, p.KeepLast) and unlimited != limits.max_samples_per_instance < qos.history.depth:
        raise InconsistentPolicy(
            f"history keeps {qos.history.depth} samples of an instance, but resource_limits allows only "
            f"max_samples_per_instance={limits.max_samples_per_instance}; raise the limit or lower the depth"
        )
    if unlimited != limits.max_samples < limits.max_samples_per_instance:
        raise InconsistentPolicy(
            f"resource_limits: max_samples={limits.max_samples} is below "
            f"max_samples_per_instance={limits.max_samples_per_instance}"
        )
    if qos.deadline.period < qos.time_based_filter.minimum_separation:
        raise InconsistentPolicy(
            f"deadline.period={qos.deadline.period} is shorter than "
            f"time_based_filter.minimum_separation={qos.time_based_filter.minimum_separation}: it could never be met"
        )
