"""Protection kinds of a governance document, and the masks in which the builtin plugin tells peers of them.

DDS-Security 1.1 §9.4.1.2.3 (kinds), §9.4.2.3 (PluginParticipantSecurityAttributesMask), §9.4.2.5
(PluginEndpointSecurityAttributesMask).
"""

from __future__ import annotations

from enum import Enum

from ..attributes import PluginEndpointSecurityAttributesMask, PluginParticipantSecurityAttributesMask

__all__ = ["ProtectionKind", "endpoint_mask", "participant_mask"]


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


def participant_mask(*, rtps: ProtectionKind, discovery: ProtectionKind, liveliness: ProtectionKind) -> int:
    """The plugin's word of a participant (§9.4.2.3)."""
    bit = PluginParticipantSecurityAttributesMask
    return int(
        bit.IS_VALID
        | (bit.IS_RTPS_ENCRYPTED if rtps.is_encrypted else 0)
        | (bit.IS_DISCOVERY_ENCRYPTED if discovery.is_encrypted else 0)
        | (bit.IS_LIVELINESS_ENCRYPTED if liveliness.is_encrypted else 0)
        | (bit.IS_RTPS_ORIGIN_AUTHENTICATED if rtps.is_origin_authenticated else 0)
        | (bit.IS_DISCOVERY_ORIGIN_AUTHENTICATED if discovery.is_origin_authenticated else 0)
        | (bit.IS_LIVELINESS_ORIGIN_AUTHENTICATED if liveliness.is_origin_authenticated else 0)
    )


def endpoint_mask(*, submessage: ProtectionKind, payload: ProtectionKind = ProtectionKind.NONE) -> int:
    """The plugin's word of an endpoint (§9.4.2.5)."""
    bit = PluginEndpointSecurityAttributesMask
    return int(
        bit.IS_VALID
        | (bit.IS_SUBMESSAGE_ENCRYPTED if submessage.is_encrypted else 0)
        | (bit.IS_PAYLOAD_ENCRYPTED if payload.is_encrypted else 0)
        | (bit.IS_SUBMESSAGE_ORIGIN_AUTHENTICATED if submessage.is_origin_authenticated else 0)
    )
