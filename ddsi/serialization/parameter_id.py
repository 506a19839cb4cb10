"""The ids of parameters: RTPS 2.5 §9.6.4, DDS-XTypes 1.3 §7.6.3, DDS-Security 1.1 §7.4.1.

The two high bits are part of the id and say how a receiver that does not know it behaves:
:data:`VENDOR_SPECIFIC` and :data:`MUST_UNDERSTAND`.  Ids are compared whole: 0x4005 is not TOPIC_NAME.
"""

from __future__ import annotations

from enum import IntEnum

__all__ = ["MUST_UNDERSTAND", "SECURITY_PARAMETER_IDS", "VENDOR_SPECIFIC", "ParameterId", "parameter_name"]

VENDOR_SPECIFIC = 0x8000
"""Has a meaning only for the sender's own vendor; all others skip it."""
MUST_UNDERSTAND = 0x4000
"""A receiver that does not know it must not use any of the list."""
SECURITY_PARAMETER_IDS = range(0x1001, 0x1015)
"""Carried for the security plugins, which alone know what is inside (DDS-Security 1.1 §7.4.1, 1.2 §7.5.1)."""


class ParameterId(IntEnum):
    """The parameters of the specifications, with the type of the value in plain CDR."""

    PAD = 0x0000
    SENTINEL = 0x0001
    PARTICIPANT_LEASE_DURATION = 0x0002  # Duration_t
    TIME_BASED_FILTER = 0x0004  # Duration_t
    TOPIC_NAME = 0x0005  # string
    OWNERSHIP_STRENGTH = 0x0006  # int32
    TYPE_NAME = 0x0007  # string
    METATRAFFIC_MULTICAST_IPADDRESS = 0x000B  # obsolete
    DEFAULT_UNICAST_IPADDRESS = 0x000C  # obsolete
    METATRAFFIC_UNICAST_PORT = 0x000D  # obsolete
    DEFAULT_UNICAST_PORT = 0x000E  # obsolete
    DOMAIN_ID = 0x000F  # uint32
    PROTOCOL_VERSION = 0x0015  # octet major, octet minor
    VENDORID = 0x0016  # octet[2]
    RELIABILITY = 0x001A  # uint32 kind, Duration_t max_blocking_time
    LIVELINESS = 0x001B  # uint32 kind, Duration_t lease_duration
    DURABILITY = 0x001D  # uint32 kind
    DURABILITY_SERVICE = 0x001E  # Duration_t, uint32 history kind, int32 depth, 3 x int32 limits
    OWNERSHIP = 0x001F  # uint32 kind
    PRESENTATION = 0x0021  # uint32 access scope, boolean coherent, boolean ordered
    DEADLINE = 0x0023  # Duration_t
    DESTINATION_ORDER = 0x0025  # uint32 kind
    LATENCY_BUDGET = 0x0027  # Duration_t
    PARTITION = 0x0029  # sequence<string>
    LIFESPAN = 0x002B  # Duration_t
    USER_DATA = 0x002C  # sequence<octet>
    GROUP_DATA = 0x002D  # sequence<octet>
    TOPIC_DATA = 0x002E  # sequence<octet>
    UNICAST_LOCATOR = 0x002F  # Locator_t, repeated
    MULTICAST_LOCATOR = 0x0030  # Locator_t, repeated
    DEFAULT_UNICAST_LOCATOR = 0x0031  # Locator_t, repeated
    METATRAFFIC_UNICAST_LOCATOR = 0x0032  # Locator_t, repeated
    METATRAFFIC_MULTICAST_LOCATOR = 0x0033  # Locator_t, repeated
    PARTICIPANT_MANUAL_LIVELINESS_COUNT = 0x0034  # int32
    CONTENT_FILTER_PROPERTY = 0x0035  # 4 x string, sequence<string>
    HISTORY = 0x0040  # uint32 kind, int32 depth
    RESOURCE_LIMITS = 0x0041  # 3 x int32
    EXPECTS_INLINE_QOS = 0x0043  # boolean
    PARTICIPANT_BUILTIN_ENDPOINTS = 0x0044  # uint32; obsolete
    METATRAFFIC_UNICAST_IPADDRESS = 0x0045  # obsolete
    METATRAFFIC_MULTICAST_PORT = 0x0046  # obsolete
    DEFAULT_MULTICAST_LOCATOR = 0x0048  # Locator_t, repeated
    TRANSPORT_PRIORITY = 0x0049  # int32
    PARTICIPANT_GUID = 0x0050  # Guid
    PARTICIPANT_ENTITYID = 0x0051  # EntityId; obsolete
    GROUP_GUID = 0x0052  # Guid
    GROUP_ENTITYID = 0x0053  # EntityId
    CONTENT_FILTER_INFO = 0x0055  # sequence<int32>, sequence<int32[4]>
    COHERENT_SET = 0x0056  # SequenceNumber
    DIRECTED_WRITE = 0x0057  # Guid, repeated
    BUILTIN_ENDPOINT_SET = 0x0058  # uint32
    PROPERTY_LIST = 0x0059  # sequence<(string, string)>, optionally sequence<(string, sequence<octet>)>
    ENDPOINT_GUID = 0x005A  # Guid
    TYPE_MAX_SIZE_SERIALIZED = 0x0060  # uint32
    ORIGINAL_WRITER_INFO = 0x0061  # Guid, SequenceNumber, ParameterList
    ENTITY_NAME = 0x0062  # string
    GROUP_COHERENT_SET = 0x0063  # SequenceNumber
    GROUP_SEQ_NUM = 0x0064  # SequenceNumber
    WRITER_GROUP_INFO = 0x0065  # GroupDigest
    SECURE_WRITER_GROUP_INFO = 0x0066  # GroupDigest
    TYPE_IDV1 = 0x0069  # XTypes 1.0; not read
    KEY_HASH = 0x0070  # octet[16]
    STATUS_INFO = 0x0071  # octet[4], never swapped
    TYPE_OBJECTV1 = 0x0072  # XTypes 1.0; not read
    DATA_REPRESENTATION = 0x0073  # sequence<int16>
    TYPE_CONSISTENCY = 0x0074  # uint16 kind, 5 x boolean
    TYPE_INFORMATION = 0x0075  # TypeInformation in XCDR2, without encapsulation header
    BUILTIN_ENDPOINT_QOS = 0x0077  # uint32
    SERVICE_INSTANCE_NAME = 0x0080  # string; DDS-RPC 1.0
    RELATED_ENTITY_GUID = 0x0081  # Guid; DDS-RPC
    TOPIC_ALIASES = 0x0082  # sequence<string>; DDS-RPC
    RELATED_SAMPLE_IDENTITY = 0x0083  # Guid, SequenceNumber; DDS-RPC
    IDENTITY_TOKEN = 0x1001  # DataHolder
    PERMISSIONS_TOKEN = 0x1002  # DataHolder
    DATA_TAGS = 0x1003  # sequence<(string, string)>
    ENDPOINT_SECURITY_INFO = 0x1004  # 2 x uint32
    PARTICIPANT_SECURITY_INFO = 0x1005  # 2 x uint32
    IDENTITY_STATUS_TOKEN = 0x1006  # DataHolder
    AVAILABLE_EXTENDED_BUILTIN_ENDPOINTS = 0x1007  # uint32; DDS-Security 1.2
    PARTICIPANT_DIGITAL_SIGNATURE_ALGO = 0x1010  # 4 x uint32; DDS-Security 1.2
    PARTICIPANT_KEY_ESTABLISHMENT_ALGO = 0x1011  # 2 x uint32; DDS-Security 1.2
    PARTICIPANT_SYMMETRIC_CIPHER_ALGO = 0x1012  # 4 x uint32; DDS-Security 1.2
    ENDPOINT_SYMMETRIC_CIPHER_ALGO = 0x1013  # uint32; DDS-Security 1.2
    DOMAIN_TAG = 0x4014  # string; must be understood


def parameter_name(pid: int) -> str:
    """``TOPIC_NAME``, or the number in hexadecimal for an id that is not in the table."""
    try:
        return ParameterId(pid).name
    except ValueError:
        return f"{pid:04x}"
