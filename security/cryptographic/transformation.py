"""How octets are transformed: the kinds of the plugin, the protection that attributes ask for, and the CryptoHeader.

DDS-Security 1.1 §9.5.2.1 (transformation kinds), §9.5.2.3 (CryptoHeader).  Values only: keys are in
:mod:`.key_material`, what they do to octets in :mod:`.payload`, :mod:`.sealing` and :mod:`.opening`.
"""

from __future__ import annotations

from enum import IntEnum
from typing import Final

from ddsi.structure.dataclass import dataclass

from ..attributes import (
    EndpointSecurityAttributes,
    ParticipantSecurityAttributes,
    PluginEndpointSecurityAttributesMask,
    PluginParticipantSecurityAttributesMask,
)

__all__ = [
    "HEADER_LENGTH",
    "KEY_ID_LENGTH",
    "MAC_LENGTH",
    "NO_KEY_ID",
    "Protection",
    "TransformationKind",
    "participant_protection",
    "payload_protection",
    "submessage_protection",
]

KEY_ID_LENGTH: Final = 4
NO_KEY_ID: Final = bytes(KEY_ID_LENGTH)
"""Of no key, and of the pairwise key of the volatile endpoints, which needs none."""

MAC_LENGTH: Final = 16

HEADER_LENGTH: Final = 20
"""CryptoHeader (§9.5.2.3): nothing in it has a byte order of its own, and its last 12 octets are the nonce.

0        8        16       24       32
+--------+--------+--------+--------+
| transformation_kind               |
+-----------------------------------+
| transformation_key_id             |
+-----------------------------------+
| session_id                        |
+-----------------------------------+
| initialization_vector_suffix,     |
| 8 octets                          |
+-----------------------------------+
"""


class TransformationKind(IntEnum):
    """CryptoTransformKind (§9.5.2.1.1).  On the wire four octets, of which 1.1 wants the first three to be zero.

    1.2 counts revisions of a key in those three; as we make none, a kind with a revision is an unknown kind.
    GMAC signs, GCM encrypts and signs.
    """

    NONE = 0
    AES128_GMAC = 1
    AES128_GCM = 2
    AES256_GMAC = 3
    AES256_GCM = 4

    @property
    def key_length(self) -> int:
        """Octets of a key, and of the salt: 16, 32, or 0 for NONE."""
        return (0, 16, 16, 32, 32)[self]

    @property
    def encrypts(self) -> bool:
        return self in (TransformationKind.AES128_GCM, TransformationKind.AES256_GCM)

    def to_wire(self) -> bytes:
        return self.to_bytes(4, "big")


@dataclass(frozen=True, slots=True)
class Protection:
    """SIGN or ENCRYPT, perhaps WITH_ORIGIN_AUTHENTICATION (§9.4.1.2.3, ProtectionKind).  None stands for NONE."""

    encrypted: bool
    origin_authenticated: bool = False

    def kind(self, key_bits: int) -> TransformationKind:
        """The kind of a key that protects so; ``key_bits`` is 128 or 256."""
        if key_bits == 128:
            return TransformationKind.AES128_GCM if self.encrypted else TransformationKind.AES128_GMAC
        return TransformationKind.AES256_GCM if self.encrypted else TransformationKind.AES256_GMAC


def participant_protection(attributes: ParticipantSecurityAttributes) -> Protection | None:
    """Of whole messages."""
    if not attributes.is_rtps_protected:
        return None
    bit = PluginParticipantSecurityAttributesMask
    mask = attributes.plugin_participant_attributes
    return Protection(bool(mask & bit.IS_RTPS_ENCRYPTED), bool(mask & bit.IS_RTPS_ORIGIN_AUTHENTICATED))


def submessage_protection(attributes: EndpointSecurityAttributes) -> Protection | None:
    if not attributes.is_submessage_protected:
        return None
    bit = PluginEndpointSecurityAttributesMask
    mask = attributes.plugin_endpoint_attributes
    return Protection(bool(mask & bit.IS_SUBMESSAGE_ENCRYPTED), bool(mask & bit.IS_SUBMESSAGE_ORIGIN_AUTHENTICATED))


def payload_protection(attributes: EndpointSecurityAttributes) -> Protection | None:
    """Of payloads, which never bear a receiver's MAC: they are stored once and sent to whoever asks."""
    if not attributes.is_payload_protected:
        return None
    mask = attributes.plugin_endpoint_attributes
    return Protection(bool(mask & PluginEndpointSecurityAttributesMask.IS_PAYLOAD_ENCRYPTED))
