"""Protection kinds of a governance document, and the masks in which the builtin plugin tells peers of them.

DDS-Security 1.1 §9.4.1.2.3 (kinds), §9.4.2.3 (PluginParticipantSecurityAttributesMask), §9.4.2.5
(PluginEndpointSecurityAttributesMask).
"""

from __future__ import annotations

from enum import Enum, IntFlag

__all__ = ["PluginEndpointMask", "PluginParticipantMask", "ProtectionKind"]


class ProtectionKind(Enum):
    """What is done to protect something; the values are the words of the documents."""

    NONE = "NONE"
    SIGN = "SIGN"
    ENCRYPT = "ENCRYPT"
    SIGN_WITH_ORIGIN_AUTHENTICATION = "SIGN_WITH_ORIGIN_AUTHENTICATION"
    ENCRYPT_WITH_ORIGIN_AUTHENTICATION = "ENCRYPT_WITH_ORIGIN_AUTHENTICATION"

    @property
    def is_protected(self) -> bool:
        return self is not ProtectionKind.NONE

    @property
    def is_encrypted(self) -> bool:
        return self in (ProtectionKind.ENCRYPT, ProtectionKind.ENCRYPT_WITH_ORIGIN_AUTHENTICATION)

    @property
    def is_origin_authenticated(self) -> bool:
        """Does each receiver get a code of its own, so that no other receiver can have made it?"""
        return self.value.endswith("_WITH_ORIGIN_AUTHENTICATION")


class PluginParticipantMask(IntFlag):
    """§9.4.2.3; the second word of PARTICIPANT_SECURITY_INFO."""

    IS_RTPS_ENCRYPTED = 1 << 0
    IS_DISCOVERY_ENCRYPTED = 1 << 1
    IS_LIVELINESS_ENCRYPTED = 1 << 2
    IS_RTPS_ORIGIN_AUTHENTICATED = 1 << 3
    IS_DISCOVERY_ORIGIN_AUTHENTICATED = 1 << 4
    IS_LIVELINESS_ORIGIN_AUTHENTICATED = 1 << 5
    IS_VALID = 1 << 31

    @classmethod
    def of(
        cls, *, rtps: ProtectionKind, discovery: ProtectionKind, liveliness: ProtectionKind
    ) -> PluginParticipantMask:
        return (
            cls.IS_VALID
            | (cls.IS_RTPS_ENCRYPTED if rtps.is_encrypted else 0)
            | (cls.IS_DISCOVERY_ENCRYPTED if discovery.is_encrypted else 0)
            | (cls.IS_LIVELINESS_ENCRYPTED if liveliness.is_encrypted else 0)
            | (cls.IS_RTPS_ORIGIN_AUTHENTICATED if rtps.is_origin_authenticated else 0)
            | (cls.IS_DISCOVERY_ORIGIN_AUTHENTICATED if discovery.is_origin_authenticated else 0)
            | (cls.IS_LIVELINESS_ORIGIN_AUTHENTICATED if liveliness.is_origin_authenticated else 0)
        )


class PluginEndpointMask(IntFlag):
    """§9.4.2.5; the second word of ENDPOINT_SECURITY_INFO."""

    IS_SUBMESSAGE_ENCRYPTED = 1 << 0
    IS_PAYLOAD_ENCRYPTED = 1 << 1
    IS_SUBMESSAGE_ORIGIN_AUTHENTICATED = 1 << 2
    IS_VALID = 1 << 31

    @classmethod
    def of(cls, *, submessage: ProtectionKind, payload: ProtectionKind = ProtectionKind.NONE) -> PluginEndpointMask:
        return (
            cls.IS_VALID
            | (cls.IS_SUBMESSAGE_ENCRYPTED if submessage.is_encrypted else 0)
            | (cls.IS_PAYLOAD_ENCRYPTED if payload.is_encrypted else 0)
            | (cls.IS_SUBMESSAGE_ORIGIN_AUTHENTICATED if submessage.is_origin_authenticated else 0)
        )
