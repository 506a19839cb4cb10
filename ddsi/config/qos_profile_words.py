"""The elements of QoS profile files, by dialect and entity, and which setting of which policy each one is.

OMG DDS-XML 1.0 §7.3.2 (QoS building block), DDS 1.4 §2.2.3.  RTI Connext has the OMG's names and more; Fast DDS has
its own.  A setting is named ``policy.member`` here, the same for all dialects.  Three kinds of names are known: those
with a meaning here, groups of names, and those that steer only the inside of the product that they are for: these are
skipped, and told.  All others are mistakes.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from ddsi.structure import qos_policies as p

from . import qos_profile_values as values
from .xml_document import Element

__all__ = ["FAST", "OMG", "SKIPPED", "Leaf", "Members", "Skipped", "Word"]


@dataclass(frozen=True, slots=True)
class Leaf:
    """An element that is one setting.  ``is_secret``: its value may not be shown."""

    setting: str
    read: Callable[[Element], object]
    is_secret: bool = False


@dataclass(frozen=True, slots=True)
class Members:
    """``<element>`` children, each of which has these names: a sequence of structures.  ``element``: their name."""

    setting: str
    words: Mapping[str, Leaf]
    element: str = "element"


@dataclass(frozen=True, slots=True)
class Skipped:
    """Known, and of no meaning to anybody but the product that it is for."""


SKIPPED = Skipped()
Word = Leaf | Members | Skipped | Mapping[str, "Word"]


def _skipped(names: str) -> dict[str, Word]:
    return dict.fromkeys(names.split(), SKIPPED)


# --- literals ------------------------------------------------------------------------------------------------

_DURABILITY = values.literal(
    {"VOLATILE": p.Volatile, "TRANSIENT_LOCAL": p.TransientLocal, "TRANSIENT": p.Transient, "PERSISTENT": p.Persistent},
    "_DURABILITY_QOS",
)
_RELIABILITY = values.literal({"BEST_EFFORT": p.BestEffort, "RELIABLE": p.Reliable}, "_RELIABILITY_QOS")
_HISTORY = values.literal({"KEEP_LAST": p.KeepLast, "KEEP_ALL": p.KeepAll}, "_HISTORY_QOS")
_LIVELINESS = values.literal(
    {
        "AUTOMATIC": p.Automatic,
        "MANUAL_BY_PARTICIPANT": p.ManualByParticipant,
        "MANUAL_BY_TOPIC": p.ManualByTopic,
    },
    "_LIVELINESS_QOS",
)
_OWNERSHIP = values.literal({"SHARED": p.Shared, "EXCLUSIVE": p.Exclusive}, "_OWNERSHIP_QOS")
_ORDER = values.literal(
    {"BY_RECEPTION_TIMESTAMP": p.ByReceptionTimestamp, "BY_SOURCE_TIMESTAMP": p.BySourceTimestamp},
    "_DESTINATIONORDER_QOS",
)
_SCOPE = values.literal(
    {"INSTANCE": p.AccessScope.INSTANCE, "TOPIC": p.AccessScope.TOPIC, "GROUP": p.AccessScope.GROUP},
    "_PRESENTATION_QOS",
)
_REPRESENTATION = values.literal(
    {
        "XCDR": p.DataRepresentationId.XCDR1,
        "XCDR1": p.DataRepresentationId.XCDR1,
        "XML": p.DataRepresentationId.XML,
        "XCDR2": p.DataRepresentationId.XCDR2,
    },
    "_DATA_REPRESENTATION",
)
_COERCION = values.literal(
    {
        "DISALLOW_TYPE_COERCION": p.TypeConsistency.DISALLOW_TYPE_COERCION,
        "ALLOW_TYPE_COERCION": p.TypeConsistency.ALLOW_TYPE_COERCION,
    }
)

# --- policies, in the OMG's names and RTI's --------------------------------------------------------------------


def _limits(policy: str, read: Callable[[Element], object] = values.count) -> dict[str, Word]:
    names = ("max_samples", "max_instances", "max_samples_per_instance")
    return {name: Leaf(f"{policy}.{name}", read) for name in names}


def _pairs(setting: str, *, value_is_secret: bool) -> Members:
    words = {
        "name": Leaf("name", values.text),
        "value": Leaf("value", values.text, is_secret=value_is_secret),
        "propagate": Leaf("propagate", values.boolean),
    }
    return Members(setting, words)


_ENTITY_FACTORY: Word = {
    "autoenable_created_entities": Leaf("entity_factory.autoenable_created_entities", values.boolean)
}
_USER_DATA: Word = {"value": Leaf("user_data.value", values.octets)}
_PROPERTY: Word = {
    "value": _pairs("property.value", value_is_secret=True),
    "binary_value": Members(
        "property.binary_value",
        {
            "name": Leaf("name", values.text),
            "value": Leaf("value", values.octets, is_secret=True),
            "propagate": Leaf("propagate", values.boolean),
        },
    ),
}
_DATA_TAGS: Word = {
    "tags": Members("data_tags.tags", {"name": Leaf("name", values.text), "value": Leaf("value", values.text)})
}
_NAME: Word = {"name": Leaf("entity_name.name", values.text), **_skipped("role_name")}
_GROUP: dict[str, Word] = {
    "presentation": {
        "access_scope": Leaf("presentation.access_scope", _SCOPE),
        "coherent_access": Leaf("presentation.coherent_access", values.boolean),
        "ordered_access": Leaf("presentation.ordered_access", values.boolean),
        **_skipped("drop_incomplete_coherent_set"),
    },
    "partition": {"name": Members("partition.name", {"": Leaf("", values.text)})},
    "group_data": {"value": Leaf("group_data.value", values.octets)},
    "entity_factory": _ENTITY_FACTORY,
    **_skipped("exclusive_area"),
}
_ENDPOINT: dict[str, Word] = {
    "durability": {
        "kind": Leaf("durability.kind", _DURABILITY),
        **_skipped("direct_communication writer_depth storage_settings"),
    },
    "deadline": {"period": Leaf("deadline.period", values.duration)},
    "latency_budget": {"duration": Leaf("latency_budget.duration", values.duration)},
    "liveliness": {
        "kind": Leaf("liveliness.kind", _LIVELINESS),
        "lease_duration": Leaf("liveliness.lease_duration", values.duration),
        **_skipped("assertions_per_lease_duration"),
    },
    "reliability": {
        "kind": Leaf("reliability.kind", _RELIABILITY),
        "max_blocking_time": Leaf("reliability.max_blocking_time", values.duration),
        **_skipped("acknowledgment_kind instance_state_consistency_kind"),
    },
    "destination_order": {
        "kind": Leaf("destination_order.kind", _ORDER),
        **_skipped("scope source_timestamp_tolerance"),
    },
    "history": {
        "kind": Leaf("history.kind", _HISTORY),
        "depth": Leaf("history.depth", values.integer),
        **_skipped("refilter"),
    },
    "resource_limits": {
        **_limits("resource_limits"),
        **_skipped("initial_samples initial_instances instance_hash_buckets"),
    },
    "ownership": {"kind": Leaf("ownership.kind", _OWNERSHIP)},
    "representation": {
        "value": Members("data_representation.value", {"": Leaf("", _REPRESENTATION)}),
        **_skipped("compression_settings"),
    },
}
_ENDPOINT["data_representation"] = _ENDPOINT["representation"]
_SERVICE: Word = {
    "service_cleanup_delay": Leaf("durability_service.service_cleanup_delay", values.duration),
    "history_kind": Leaf("durability_service.history_kind", _HISTORY),
    "history_depth": Leaf("durability_service.history_depth", values.integer),
    **_limits("durability_service"),
}
_TRANSPORT_PRIORITY: Word = {"value": Leaf("transport_priority.value", values.integer)}
_LIFESPAN: Word = {"duration": Leaf("lifespan.duration", values.duration)}
_INSIDE_RTI = "protocol availability service type_support unicast transport_selection"

OMG: dict[str, Mapping[str, Word]] = {
    "participant": {
        "user_data": _USER_DATA,
        "entity_factory": _ENTITY_FACTORY,
        "property": _PROPERTY,
        "participant_name": _NAME,
        **_skipped(
            "transport_builtin default_unicast multicast_mapping discovery discovery_config resource_limits event "
            "receiver_pool database wire_protocol service monitoring type_support partition exclusive_area"
        ),
    },
    "publisher": {**_GROUP, "publisher_name": _NAME, **_skipped("asynchronous_publisher")},
    "subscriber": {**_GROUP, "subscriber_name": _NAME},
    "topic": {
        **_ENDPOINT,
        "topic_data": {"value": Leaf("topic_data.value", values.octets)},
        "durability_service": _SERVICE,
        "transport_priority": _TRANSPORT_PRIORITY,
        "lifespan": _LIFESPAN,
        **_skipped("protocol"),
    },
    "writer": {
        **_ENDPOINT,
        "durability_service": _SERVICE,
        "transport_priority": _TRANSPORT_PRIORITY,
        "lifespan": _LIFESPAN,
        "user_data": _USER_DATA,
        "ownership_strength": {"value": Leaf("ownership_strength.value", values.integer)},
        "writer_data_lifecycle": {
            "autodispose_unregistered_instances": Leaf(
                "writer_data_lifecycle.autodispose_unregistered_instances", values.boolean
            ),
            **_skipped("autopurge_unregistered_instances_delay autopurge_disposed_instances_delay"),
        },
        "property": _PROPERTY,
        "data_tags": _DATA_TAGS,
        "publication_name": _NAME,
        **_skipped(
            f"{_INSIDE_RTI} rtps_reliable_writer writer_resource_limits publish_mode batch multi_channel encapsulation "
            "topic_query_dispatch transfer_mode"
        ),
    },
    "reader": {
        **_ENDPOINT,
        "user_data": _USER_DATA,
        "time_based_filter": {"minimum_separation": Leaf("time_based_filter.minimum_separation", values.duration)},
        "reader_data_lifecycle": {
            "autopurge_nowriter_samples_delay": Leaf(
                "reader_data_lifecycle.autopurge_nowriter_samples_delay", values.duration
            ),
            "autopurge_disposed_samples_delay": Leaf(
                "reader_data_lifecycle.autopurge_disposed_samples_delay", values.duration
            ),
            **_skipped("autopurge_disposed_instances_delay autopurge_nowriter_instances_delay"),
        },
        "type_consistency": {
            "kind": Leaf("type_consistency.kind", _COERCION),
            **{
                name: Leaf(f"type_consistency.{name}", values.boolean)
                for name in (
                    "ignore_sequence_bounds",
                    "ignore_string_bounds",
                    "ignore_member_names",
                    "prevent_type_widening",
                    "force_type_validation",
                )
            },
            **_skipped("ignore_enum_literal_names"),
        },
        "property": _PROPERTY,
        "data_tags": _DATA_TAGS,
        "subscription_name": _NAME,
        **_skipped(f"{_INSIDE_RTI} rtps_reliable_reader reader_resource_limits multicast transport_priority"),
    },
}
"""By entity, what may stand in ``<datawriter_qos>`` and its like."""

# --- Fast DDS --------------------------------------------------------------------------------------------------

_FAST_PROPERTIES: Word = {
    "properties": Members("property.value", _pairs("", value_is_secret=True).words, element="property"),
}
_FAST_TOPIC: dict[str, Word] = {
    "historyQos": {"kind": Leaf("history.kind", _HISTORY), "depth": Leaf("history.depth", values.integer)},
    "resourceLimitsQos": {
        **_limits("resource_limits", values.count_or_zero),
        **_skipped("allocated_samples extra_samples"),
    },
    **_skipped("name dataType kind"),
}
_FAST_QOS: dict[str, Word] = {
    "durability": {"kind": Leaf("durability.kind", _DURABILITY)},
    "durabilityService": {
        "service_cleanup_delay": Leaf("durability_service.service_cleanup_delay", values.duration),
        "history_kind": Leaf("durability_service.history_kind", _HISTORY),
        "history_depth": Leaf("durability_service.history_depth", values.integer),
        **_limits("durability_service", values.count_or_zero),
    },
    "deadline": {"period": Leaf("deadline.period", values.duration)},
    "latencyBudget": {"duration": Leaf("latency_budget.duration", values.duration)},
    "liveliness": {
        "kind": Leaf("liveliness.kind", _LIVELINESS),
        "lease_duration": Leaf("liveliness.lease_duration", values.duration),
        **_skipped("announcement_period"),
    },
    "reliability": {
        "kind": Leaf("reliability.kind", _RELIABILITY),
        "max_blocking_time": Leaf("reliability.max_blocking_time", values.duration),
    },
    "destination_order": {"kind": Leaf("destination_order.kind", _ORDER)},
    "lifespan": _LIFESPAN,
    "ownership": {"kind": Leaf("ownership.kind", _OWNERSHIP)},
    "partition": {"names": Members("partition.name", {"": Leaf("", values.text)}, element="name")},
    "presentation": {
        "access_scope": Leaf("presentation.access_scope", _SCOPE),
        "coherent_access": Leaf("presentation.coherent_access", values.boolean),
        "ordered_access": Leaf("presentation.ordered_access", values.boolean),
    },
    "userData": {"value": Leaf("user_data.value", values.octets_in_dotted_hex)},
    "topicData": {"value": Leaf("topic_data.value", values.octets_in_dotted_hex)},
    "groupData": {"value": Leaf("group_data.value", values.octets_in_dotted_hex)},
    **_skipped("disablePositiveAcks data_sharing"),
}
_FAST_ENDPOINT: dict[str, Word] = {
    "topic": _FAST_TOPIC,
    "propertiesPolicy": _FAST_PROPERTIES,
    **_skipped(
        "unicastLocatorList multicastLocatorList remoteLocatorList external_unicast_locators times "
        "ignore_non_matching_locators historyMemoryPolicy userDefinedID entityID matchedPublishersAllocation "
        "matchedSubscribersAllocation throughputController"
    ),
}

FAST: dict[str, Mapping[str, Word]] = {
    "participant": {
        "rtps": {
            "name": Leaf("entity_name.name", values.text),
            "userData": {"value": Leaf("user_data.value", values.octets_in_dotted_hex)},
            "propertiesPolicy": _FAST_PROPERTIES,
            **_skipped(
                "builtin port allocation prefix participantID sendSocketBufferSize listenSocketBufferSize "
                "defaultUnicastLocatorList defaultMulticastLocatorList default_external_unicast_locators "
                "ignore_non_matching_locators userTransports useBuiltinTransports throughputController "
                "flow_controller_descriptor_list netmask_filter netmaskFilter easy_mode_ip builtinTransports "
                "builtin_controllers_sender_thread timed_events_thread discovery_server_thread "
                "typelookup_service_thread builtin_transports_reception_threads security_log_thread"
            ),
        },
        **_skipped("domainId"),
    },
    "topic": _FAST_TOPIC,
    "writer": {
        **_FAST_ENDPOINT,
        "qos": {
            **_FAST_QOS,
            "ownershipStrength": {"value": Leaf("ownership_strength.value", values.integer)},
            "transport_priority": Leaf("transport_priority.value", values.integer),
            **_skipped("publishMode disable_heartbeat_piggyback timeBasedFilter"),
        },
    },
    "reader": {
        **_FAST_ENDPOINT,
        "qos": {
            **_FAST_QOS,
            "timeBasedFilter": {"minimum_separation": Leaf("time_based_filter.minimum_separation", values.duration)},
        },
        **_skipped("expects_inline_qos expectsInlineQos"),
    },
}
"""By entity, what may stand in ``<data_writer>`` and its like.  There are no profiles of publishers and subscribers
in the DDS sense: those of these names are writers and readers."""
