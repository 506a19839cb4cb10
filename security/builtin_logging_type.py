"""The sample that the logging plugin makes of each event: DDS:Security:LogTopicV2 and its type.

DDS-Security 1.1 §9.6 (BuiltinLoggingType), in the form of 1.2, whose seconds have 64 bits.  On the wire it is XCDR1, as
the OMG's IDL demands.  Its ``structured_data`` is ``map<string, sequence<NameValuePair>>`` there; here it is a sequence
of entries (key, value), whose octets are the same (DDS-XTypes 1.3 §7.4.3.5).
"""

from __future__ import annotations

from enum import IntEnum
from typing import Final

from ddsi.xtypes import idl

__all__ = [
    "FACILITY_SECURITY",
    "LOG_TOPIC_NAME",
    "LOG_TYPE_NAME",
    "BuiltinLoggingTypeV2",
    "LogLevel",
    "NameValuePair",
    "StructuredDataEntry",
    "Timestamp",
]

LOG_TOPIC_NAME: Final = "DDS:Security:LogTopicV2"
LOG_TYPE_NAME: Final = "DDSSecurity::BuiltinLoggingTypeV2"

FACILITY_SECURITY: Final = 10
"""The facility of syslog for security and authorization messages (RFC 5424 §6.2.1)."""


class LogLevel(IntEnum):
    """LoggingLevel (§8.6.2), the severities of syslog (RFC 5424 §6.2.1): less is worse."""

    EMERGENCY_LEVEL = 0
    ALERT_LEVEL = 1
    CRITICAL_LEVEL = 2
    ERROR_LEVEL = 3
    WARNING_LEVEL = 4
    NOTICE_LEVEL = 5
    INFO_LEVEL = 6
    DEBUG_LEVEL = 7


@idl.struct(typename="DDSSecurity::Time_t", extensibility=idl.FINAL)
class Timestamp:
    """Since 1970, UTC.  ``nanosec`` is below 1,000,000,000."""

    sec: idl.int64
    nanosec: idl.uint32


@idl.struct(typename="DDSSecurity::NameValuePair", extensibility=idl.FINAL)
class NameValuePair:
    name: str
    value: str


@idl.struct(typename="DDSSecurity::StructuredDataEntry", extensibility=idl.FINAL)
class StructuredDataEntry:
    """One entry of the map: an SD-ID of syslog (RFC 5424 §6.3) and its parameters."""

    key: str
    pairs: idl.sequence[NameValuePair]


@idl.struct(typename=LOG_TYPE_NAME, extensibility=idl.APPENDABLE)
class BuiltinLoggingTypeV2:
    """One event.  All texts are printable and bounded, whoever supplied them.

    ``structured_data`` has an entry ``DDS`` with the pairs ``guid`` (of the entity concerned), ``domain_id``,
    ``plugin_class`` and ``plugin_method``, as far as they are known.
    """

    facility: idl.octet
    severity: LogLevel
    timestamp: Timestamp
    hostname: str
    hostip: str
    appname: str
    procid: str
    msgid: str
    message: str
    structured_data: idl.sequence[StructuredDataEntry]
