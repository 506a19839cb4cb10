"""Security attributes: how a participant, a topic and an endpoint are to be protected.

DDS-Security 1.1 §8.4.2.4 to §8.4.2.8.  Access control decides them, the cryptographic plugin and the core act on
them, and two masks of 32 bits tell them to other participants: one whose bits stand here, and one of the plugin's own.
"""

from __future__ import annotations

from enum import IntFlag

from ddsi.structure.dataclass import dataclass

__all__ = [
    "DataTags",
    "EndpointSecurityAttributes",
    "EndpointSecurityAttributesMask",
    "ParticipantSecurityAttributes",
    "ParticipantSecurityAttributesMask",
    "PluginEndpointSecurityAttributesMask",
    "PluginParticipantSecurityAttributesMask",
    "TopicSecurityAttributes",
]

DataTags = tuple[tuple[str, str], ...]
"""Names and values that an application ties to a writer or reader (DDS-Security 1.1 §7.2.5)."""


class ParticipantSecurityAttributesMask(IntFlag):
    """§8.4.2.5.  What of a participant's attributes others must know, and must have alike."""

    IS_RTPS_PROTECTED = 1 << 0
    IS_DISCOVERY_PROTECTED = 1 << 1
    IS_LIVELINESS_PROTECTED = 1 << 2
    IS_VALID = 1 << 31


class EndpointSecurityAttributesMask(IntFlag):
    """§8.4.2.8.  What of an endpoint's attributes others must know, and must have alike."""

    IS_READ_PROTECTED = 1 << 0
    IS_WRITE_PROTECTED = 1 << 1
    IS_DISCOVERY_PROTECTED = 1 << 2
    IS_SUBMESSAGE_PROTECTED = 1 << 3
    IS_PAYLOAD_PROTECTED = 1 << 4
    IS_KEY_PROTECTED = 1 << 5
    IS_LIVELINESS_PROTECTED = 1 << 6
    IS_VALID = 1 << 31


class PluginParticipantSecurityAttributesMask(IntFlag):
    """§9.4.2.3.  The builtin plugins' word in PARTICIPANT_SECURITY_INFO: access control says it, cryptography acts."""

    IS_RTPS_ENCRYPTED = 1 << 0
    IS_DISCOVERY_ENCRYPTED = 1 << 1
    IS_LIVELINESS_ENCRYPTED = 1 << 2
    IS_RTPS_ORIGIN_AUTHENTICATED = 1 << 3
    IS_DISCOVERY_ORIGIN_AUTHENTICATED = 1 << 4
    IS_LIVELINESS_ORIGIN_AUTHENTICATED = 1 << 5
    IS_VALID = 1 << 31


class PluginEndpointSecurityAttributesMask(IntFlag):
    """§9.4.2.5.  The builtin plugins' own word in ENDPOINT_SECURITY_INFO."""

    IS_SUBMESSAGE_ENCRYPTED = 1 << 0
    IS_PAYLOAD_ENCRYPTED = 1 << 1
    IS_SUBMESSAGE_ORIGIN_AUTHENTICATED = 1 << 2
    IS_VALID = 1 << 31


@dataclass(frozen=True, slots=True, kw_only=True)
class ParticipantSecurityAttributes:
    """§8.4.2.4.  ``plugin_participant_attributes`` is the plugin's mask; 0 where it has none."""

    allow_unauthenticated_participants: bool = False
    is_access_protected: bool = False
    is_rtps_protected: bool = False
    is_discovery_protected: bool = False
    is_liveliness_protected: bool = False
    plugin_participant_attributes: int = 0
    ac_participant_properties: tuple[tuple[str, str], ...] = ()

    @property
    def mask(self) -> ParticipantSecurityAttributesMask:
        bit = ParticipantSecurityAttributesMask
        return (
            bit.IS_VALID
            | (bit.IS_RTPS_PROTECTED if self.is_rtps_protected else 0)
            | (bit.IS_DISCOVERY_PROTECTED if self.is_discovery_protected else 0)
            | (bit.IS_LIVELINESS_PROTECTED if self.is_liveliness_protected else 0)
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class TopicSecurityAttributes:
    """§8.4.2.6."""

    is_read_protected: bool = False
    is_write_protected: bool = False
    is_discovery_protected: bool = False
    is_liveliness_protected: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class EndpointSecurityAttributes(TopicSecurityAttributes):
    """§8.4.2.7.  ``plugin_endpoint_attributes`` is the plugin's mask; 0 where it has none."""

    is_submessage_protected: bool = False
    is_payload_protected: bool = False
    is_key_protected: bool = False
    plugin_endpoint_attributes: int = 0
    ac_endpoint_properties: tuple[tuple[str, str], ...] = ()

    @property
    def mask(self) -> EndpointSecurityAttributesMask:
        bit = EndpointSecurityAttributesMask
        return (
            bit.IS_VALID
            | (bit.IS_READ_PROTECTED if self.is_read_protected else 0)
            | (bit.IS_WRITE_PROTECTED if self.is_write_protected else 0)
            | (bit.IS_DISCOVERY_PROTECTED if self.is_discovery_protected else 0)
            | (bit.IS_SUBMESSAGE_PROTECTED if self.is_submessage_protected else 0)
            | (bit.IS_PAYLOAD_PROTECTED if self.is_payload_protected else 0)
            | (bit.IS_KEY_PROTECTED if self.is_key_protected else 0)
            | (bit.IS_LIVELINESS_PROTECTED if self.is_liveliness_protected else 0)
        )
