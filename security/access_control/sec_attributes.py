"""Security attributes as governance decides them: of participants, of user endpoints, and of builtin ones.

DDS-Security 1.1 §9.4.2 (DomainParticipants, Topics, endpoints), §7.4.8 and §8.4.2.4 (builtin topics).
``ddsi_security.attributes`` says what they are; these functions derive them, and nothing else.
"""

from __future__ import annotations

from typing import Final

from ..attributes import EndpointSecurityAttributes, ParticipantSecurityAttributes, TopicSecurityAttributes
from .governance import DomainRule, TopicRule
from .protection import ProtectionKind, endpoint_mask, participant_mask

__all__ = [
    "BUILTIN_TOPICS",
    "builtin_endpoint_attributes",
    "endpoint_attributes",
    "participant_attributes",
    "topic_attributes",
]

_DISCOVERY = frozenset(
    {
        "DCPSParticipantsSecure",
        "DCPSParticipantSecure",  # as OpenDDS spells it; the name does not travel
        "DCPSPublicationsSecure",
        "DCPSSubscriptionsSecure",
        "TypeLookupServiceRequestSecure",  # 1.2
        "TypeLookupServiceReplySecure",
    }
)
_LIVELINESS = "DCPSParticipantMessageSecure"
_VOLATILE = "DCPSParticipantVolatileMessageSecure"
_IN_CLEAR = frozenset(
    {
        "DCPSParticipantStatelessMessage",
        "DCPSParticipant",
        "DCPSPublication",
        "DCPSSubscription",
        "DCPSTopic",
        "DCPSParticipantMessage",
        "TypeLookupServiceRequest",
        "TypeLookupServiceReply",
    }
)
BUILTIN_TOPICS: Final = _DISCOVERY | _IN_CLEAR | {_LIVELINESS, _VOLATILE}
"""Topics whose endpoints come with the participant; rules of documents do not reach them."""


def participant_attributes(rule: DomainRule) -> ParticipantSecurityAttributes:
    """§9.4.2.2."""
    return ParticipantSecurityAttributes(
        allow_unauthenticated_participants=rule.allow_unauthenticated_participants,
        is_access_protected=rule.enable_join_access_control,
        is_rtps_protected=rule.rtps_protection_kind.is_protected,
        is_discovery_protected=rule.discovery_protection_kind.is_protected,
        is_liveliness_protected=rule.liveliness_protection_kind.is_protected,
        plugin_participant_attributes=participant_mask(
            rtps=rule.rtps_protection_kind,
            discovery=rule.discovery_protection_kind,
            liveliness=rule.liveliness_protection_kind,
        ),
    )


def topic_attributes(rule: TopicRule) -> TopicSecurityAttributes:
    """§9.4.2.4."""
    return TopicSecurityAttributes(
        is_read_protected=rule.enable_read_access_control,
        is_write_protected=rule.enable_write_access_control,
        is_discovery_protected=rule.enable_discovery_protection,
        is_liveliness_protected=rule.enable_liveliness_protection,
    )


def endpoint_attributes(rule: TopicRule) -> EndpointSecurityAttributes:
    """§9.4.2.6.  Writers and readers of a topic have the same ones."""
    return EndpointSecurityAttributes(
        is_read_protected=rule.enable_read_access_control,
        is_write_protected=rule.enable_write_access_control,
        is_discovery_protected=rule.enable_discovery_protection,
        is_liveliness_protected=rule.enable_liveliness_protection,
        is_submessage_protected=rule.metadata_protection_kind.is_protected,
        is_payload_protected=rule.data_protection_kind.is_protected,
        is_key_protected=rule.data_protection_kind.is_encrypted,
        plugin_endpoint_attributes=endpoint_mask(
            submessage=rule.metadata_protection_kind, payload=rule.data_protection_kind
        ),
    )


def builtin_endpoint_attributes(rule: DomainRule, topic: str) -> EndpointSecurityAttributes:
    """Of an endpoint of one of :data:`BUILTIN_TOPICS`: protected by submessage only, as the domain rule says."""
    if topic == _VOLATILE:
        kind = ProtectionKind.ENCRYPT  # always: it carries the keys of all others (§9.5.2.1.2)
    elif topic == _LIVELINESS:
        kind = rule.liveliness_protection_kind
    elif topic in _DISCOVERY:
        kind = rule.discovery_protection_kind
    else:
        kind = ProtectionKind.NONE
    return EndpointSecurityAttributes(
        is_submessage_protected=kind.is_protected,
        plugin_endpoint_attributes=endpoint_mask(submessage=kind),
    )
