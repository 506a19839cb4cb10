"""LogTopic: keeps security events in a file, hands them to Python's logging, and to whoever publishes them.

DDS-Security 1.1 §8.6.2, §9.6 (DDS:Security:LogTopic).  It makes the samples of the topic but has no writer: the service
listens and publishes.  A peer can cause events at will, so their texts are made safe, their length and their number are
bounded, and no failure to keep one reaches the caller.
"""

from __future__ import annotations

import logging
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Final

from ddsi.structure.errors import ConfigurationError
from ddsi.structure.guid import Guid
from ddsi.structure.qos_policies import Properties, Property

from ..builtin_logging_type import (
    FACILITY_SECURITY,
    BuiltinLoggingTypeV2,
    LogLevel,
    NameValuePair,
    StructuredDataEntry,
    Timestamp,
)
from ..logging_plugin import LoggingListener, LogOptions
from ..properties import LOG_FILE
from .line import printable, syslog_line
from .options import options_from

__all__ = ["LOGGER_NAME", "MAX_EVENTS_PER_SECOND", "MAX_MESSAGE_LENGTH", "PYTHON_LEVELS", "LogTopic"]

LOGGER_NAME: Final = "ddsi.security"
MAX_MESSAGE_LENGTH: Final = 1024
"""Characters; a refusal that names document, line and rule takes some hundred."""
_MAX_FIELD_LENGTH: Final = 255
MAX_EVENTS_PER_SECOND: Final = 100
"""Of one level: nobody can fill the disk quickly, nor hide an error behind a flood of notices."""

PYTHON_LEVELS: Final = {
    LogLevel.EMERGENCY_LEVEL: logging.CRITICAL,
    LogLevel.ALERT_LEVEL: logging.CRITICAL,
    LogLevel.CRITICAL_LEVEL: logging.CRITICAL,
    LogLevel.ERROR_LEVEL: logging.ERROR,
    LogLevel.WARNING_LEVEL: logging.WARNING,
    LogLevel.NOTICE_LEVEL: logging.INFO,
    LogLevel.INFO_LEVEL: logging.INFO,
    LogLevel.DEBUG_LEVEL: logging.DEBUG,
}
_BOUND_OF_EACH_LEVEL: Final = Counter(dict.fromkeys(LogLevel, MAX_EVENTS_PER_SECOND))

# Where we run is not ours to find out, but participants announce it, by names that differ: Cyclone DDS, Fast DDS, RTI.
_HOST_PROPERTIES = ("__Hostname", "fastdds.physical_data.host", "dds.sys_info.hostname")
_PROCESS_PROPERTIES = ("__ProcessName", "dds.sys_info.executable_filepath")
_PID_PROPERTIES = ("__Pid", "fastdds.physical_data.process", "dds.sys_info.process_id")


class LogTopic:
    """Implements :class:`ddsi_security.plugins.Logging`.

    ``unwritten_count`` is how many events the file, the listener or a handler of Python's logging would not take,
    ``suppressed_count`` how many were too many in their second.
    """

    plugin_version: Final = 1

    def __init__(
        self, properties: Properties, *, entropy: Callable[[int], bytes], wall_clock: Callable[[], int]
    ) -> None:
        """Raises ConfigurationError for a ``dds.sec.log.*`` property that cannot be meant."""
        self._options = options_from(properties)
        self._wall_clock = wall_clock
        self._hostname = _first_of(properties, _HOST_PROPERTIES)
        self._appname = _first_of(properties, _PROCESS_PROPERTIES)
        self._procid = _first_of(properties, _PID_PROPERTIES)
        self._listener: LoggingListener | None = None
        self._is_enabled = False
        self._participant: Guid | None = None
        self._domain_id: int | None = None
        self._second = 0
        self._logged_in_second: Counter[LogLevel] = Counter()
        self.unwritten_count = 0
        self.suppressed_count = 0

    def set_log_options(self, options: LogOptions) -> None:
        if self._is_enabled:
            raise ConfigurationError("the options of security logging are fixed once it is enabled: set them before")
        self._options = options

    def get_log_options(self) -> LogOptions:
        return self._options

    def enable_logging(self) -> None:
        if self._options.log_file:
            try:
                self._append("")
            except (OSError, ValueError) as error:
                reason = getattr(error, "strerror", None) or error
                raise ConfigurationError(
                    f"property {LOG_FILE}: cannot write to {self._options.log_file!r}: {reason}"
                ) from error
        self._is_enabled = True

    def set_participant(self, participant_guid: Guid, domain_id: int) -> None:
        self._participant, self._domain_id = participant_guid, domain_id

    def set_listener(self, listener: LoggingListener | None) -> None:
        self._listener = listener

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
        if not self._is_enabled or level > self._options.logging_level:
            return
        now = self._wall_clock()
        if self._is_one_too_many(level, now):
            return
        concerned = entity or self._participant
        self._keep(
            now,
            level,
            message,
            category,
            guid=_guid_text(concerned) if concerned else "",
            domain_id="" if self._domain_id is None else str(self._domain_id),
            plugin_class=plugin_class,
            plugin_method=plugin_method,
        )

    # --- bounds ------------------------------------------------------------------------------------------

    def _is_one_too_many(self, level: LogLevel, now: int) -> bool:
        second = now // 1_000_000_000
        if second != self._second:
            suppressed = sum((self._logged_in_second - _BOUND_OF_EACH_LEVEL).values())
            self._second = second
            self._logged_in_second.clear()
            if suppressed:
                # Said at whatever level is logged: what is missing in a log must not look as if it never was.
                text = f"{suppressed} events of one second were not logged, as there were too many"
                self._keep(now, LogLevel.WARNING_LEVEL, text, "logging")
        self._logged_in_second[level] += 1
        is_one_too_many = self._logged_in_second[level] > MAX_EVENTS_PER_SECOND
        self.suppressed_count += is_one_too_many
        return is_one_too_many

    # --- where events go ---------------------------------------------------------------------------------

    def _keep(self, now: int, level: LogLevel, message: str, category: str, **pairs: str) -> None:
        event = BuiltinLoggingTypeV2(
            facility=FACILITY_SECURITY,
            severity=level,
            timestamp=Timestamp(*divmod(now, 1_000_000_000)),
            hostname=self._hostname,
            hostip="",
            appname=self._appname,
            procid=self._procid,
            msgid=printable(category, _MAX_FIELD_LENGTH),
            message=printable(message, MAX_MESSAGE_LENGTH),
            structured_data=[
                StructuredDataEntry(
                    "DDS",
                    [NameValuePair(name, printable(text, _MAX_FIELD_LENGTH)) for name, text in pairs.items() if text],
                )
            ],
        )
        for sink in (self._write_line, self._tell_python, self._tell_listener):
            # Whatever goes wrong in a disk, in a handler or in a listener: the participant goes on, and it is counted.
            try:
                sink(event)
            except Exception:
                self.unwritten_count += 1

    def _write_line(self, event: BuiltinLoggingTypeV2) -> None:
        if self._options.log_file:
            self._append(syslog_line(event) + "\n")

    def _append(self, text: str) -> None:
        # Opened for each line: so others may rotate the file, nothing stays in a buffer, and nothing needs closing.
        with Path(self._options.log_file).open("ab") as file:
            file.write(text.encode())

    def _tell_python(self, event: BuiltinLoggingTypeV2) -> None:
        where = ", ".join(f"{pair.name} {pair.value}" for entry in event.structured_data for pair in entry.pairs)
        text = f"{event.message} ({where})" if where else event.message
        logging.getLogger(LOGGER_NAME).log(PYTHON_LEVELS[event.severity], "%s", text, extra={"security_event": event})

    def _tell_listener(self, event: BuiltinLoggingTypeV2) -> None:
        if self._listener is not None and self._options.distribute:
            self._listener.on_log_message(event)


def _first_of(properties: Properties, names: tuple[str, ...]) -> str:
    for name in names:
        value = properties.get(name)
        text = value.value if isinstance(value, Property) else value
        if isinstance(text, str):
            return printable(text, _MAX_FIELD_LENGTH)
    return ""


def _guid_text(guid: Guid) -> str:
    """As DDS-Security 1.2 writes it: four groups of eight digits."""
    return ".".join(guid[start : start + 4].hex().upper() for start in range(0, 16, 4))
