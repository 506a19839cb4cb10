"""The Logging and DataTagging plugin interfaces.

DDS-Security 1.1 §8.6, §8.7; conventions: :mod:`ddsi_security.plugins`.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import Protocol

from ddsi.structure.qos_policies import Properties

from .attributes import DataTags

__all__ = ["DataTagging", "LogLevel", "LogOptions", "Logging", "LoggingListener"]


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


@dataclass(frozen=True, slots=True, kw_only=True)
class LogOptions:
    """LogOptions (§8.6.2).  ``distribute``: publish on the topic DDS:Security:LogTopic as well."""

    logging_level: LogLevel = LogLevel.ERROR_LEVEL
    log_file: str = ""
    distribute: bool = False


class LoggingListener(Protocol):
    """Hears each event that is logged, say to publish it (§8.6.2)."""

    def on_log_message(self, level: LogLevel, message: str, category: str) -> None: ...


class Logging(Protocol):
    """Keeps what a security officer must know.  §8.6.2; called by the other plugins and the service."""

    def set_log_options(self, options: LogOptions) -> None:
        """Before enable_logging; afterwards it raises ConfigurationError."""
        ...

    def enable_logging(self) -> None:
        """Nothing is logged before, and the options are fixed from now on.  Raises ConfigurationError."""
        ...

    def log(self, level: LogLevel, message: str, category: str) -> None:
        """Never raises: a full disk must not stop a participant.  ``message`` holds no secret."""
        ...

    def set_listener(self, listener: LoggingListener | None) -> None:
        """At most one; None for none."""
        ...


class DataTagging(Protocol):
    """Ties labels to writers and readers (§8.7), which access control looks at when they are created.

    The OMG describes the plugin without giving it an operation; this one is ours, called when an endpoint is made.
    """

    def get_data_tags(self, endpoint_properties: Properties) -> DataTags:
        """The tags of an endpoint with these properties, in order; empty for none."""
        ...
