"""The Logging and DataTagging plugin interfaces.

DDS-Security 1.1 §8.6, §8.7; conventions: :mod:`ddsi_security.plugins`.
"""

from __future__ import annotations

from typing import Protocol

from ddsi.structure.dataclass import dataclass
from ddsi.structure.guid import Guid
from ddsi.structure.qos import EndpointQos

from .attributes import DataTags
from .builtin_logging_type import BuiltinLoggingTypeV2, LogLevel

__all__ = ["BuiltinLoggingTypeV2", "DataTagging", "LogLevel", "LogOptions", "Logging", "LoggingListener"]


@dataclass(frozen=True, slots=True, kw_only=True)
class LogOptions:
    """LogOptions (§8.6.2).  ``logging_level``: what is less severe is not logged; ``log_file``: a path, "" for none;
    ``distribute``: publish on the topic DDS:Security:LogTopicV2 as well, by way of the listener."""

    logging_level: LogLevel = LogLevel.ERROR_LEVEL
    log_file: str = ""
    distribute: bool = False


class LoggingListener(Protocol):
    """Hears each event that is to be distributed, and publishes it (§8.6.2).  Implemented by the service."""

    def on_log_message(self, event: BuiltinLoggingTypeV2) -> None:
        """Called within :meth:`Logging.log`; the event is not changed afterwards."""
        ...


class Logging(Protocol):
    """Keeps what a security officer must know.  §8.6.2; called by the service, one object per participant."""

    def set_log_options(self, options: LogOptions) -> None:
        """Instead of those from the properties.  Only before enable_logging; afterwards ConfigurationError."""
        ...

    def get_log_options(self) -> LogOptions:
        """The options in force; the service has a writer only if they say ``distribute``.  Not the OMG's."""
        ...

    def enable_logging(self) -> None:
        """Nothing is logged before, and the options are fixed from now on.

        Raises ConfigurationError for a file that cannot be written.
        """
        ...

    def set_participant(self, participant_guid: Guid, domain_id: int) -> None:
        """Whose events these are, once that is decided: events before go without.  Not the OMG's."""
        ...

    def log(
        self,
        level: LogLevel,
        message: str,
        category: str,
        *,
        plugin_class: str = "",
        plugin_method: str = "",
        entity: Guid | None = None,
    ) -> None:
        """Never raises: a full disk must not stop a participant.

        ``message`` holds no secret; what of it came from the network need not be made safe before.  ``category`` is a
        word for the kind of event (``msgid``).  The other three are not the OMG's parameters but fields of its type:
        the plugin's class id (``DDS:Auth:PKI-DH``), its operation, and the Guid of the entity concerned where it is not
        the participant itself.
        """
        ...

    def set_listener(self, listener: LoggingListener | None) -> None:
        """At most one; None for none.  It hears nothing unless the options say ``distribute``."""
        ...


class DataTagging(Protocol):
    """Ties labels to writers and readers (§8.7), which access control looks at when they are created.

    The OMG describes the plugin without giving it an operation; this one is ours, called when an endpoint is made.
    """

    def get_data_tags(self, qos: EndpointQos) -> DataTags:
        """The tags of an endpoint with this QoS, in order; empty for none."""
        ...
