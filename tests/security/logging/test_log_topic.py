"""The logging plugin: what is kept, where, and that nothing of it can hurt the participant."""

from __future__ import annotations

import logging
import re
from pathlib import Path

import pytest

from ddsi.structure.errors import ConfigurationError
from ddsi.structure.guid import Guid
from ddsi.structure.qos_policies import Properties, Property
from ddsi_security.builtin_logging_type import BuiltinLoggingTypeV2
from ddsi_security.logging import LogTopic
from ddsi_security.logging.log_topic import MAX_EVENTS_PER_SECOND, MAX_MESSAGE_LENGTH
from ddsi_security.plugins import Logging, LogLevel, LogOptions

SECOND = 1_000_000_000
GUID = Guid(bytes.fromhex("010f0000 00000001 0000abcd 000001c1"))


class Listener:
    def __init__(self) -> None:
        self.events: list[BuiltinLoggingTypeV2] = []

    def on_log_message(self, event: BuiltinLoggingTypeV2) -> None:
        self.events.append(event)


class Clock:
    now = 1_800_000_000 * SECOND

    def __call__(self) -> int:
        return self.now


def plugin(properties: Properties | None = None, clock: Clock | None = None) -> LogTopic:
    return LogTopic(properties or {}, entropy=bytes, wall_clock=clock or Clock())


def enabled(properties: Properties, clock: Clock | None = None) -> tuple[LogTopic, Listener]:
    """A plugin at work, and who hears what it distributes."""
    log, listener = plugin({**properties, "dds.sec.log.distribute": "true"}, clock), Listener()
    log.set_listener(listener)
    log.enable_logging()
    return log, listener


def test_it_is_a_plugin() -> None:
    log: Logging = plugin()
    assert log.get_log_options() == LogOptions()


# --- options ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("given", "level"),
    [
        ("EMERGENCY_LEVEL", LogLevel.EMERGENCY_LEVEL),
        ("ALERT", LogLevel.ALERT_LEVEL),
        ("WARNING_LEVEL", LogLevel.WARNING_LEVEL),
        ("INFO_LEVEL", LogLevel.INFO_LEVEL),
        ("INFORMATIONAL_LEVEL", LogLevel.INFO_LEVEL),
        ("debug", LogLevel.DEBUG_LEVEL),
    ],
)
def test_levels_have_the_names_of_the_omg_and_of_fast_dds(given: str, level: LogLevel) -> None:
    assert plugin({"dds.sec.log.log_level": given}).get_log_options().logging_level is level


def test_the_options_come_in_everybody_s_spelling() -> None:
    prefix = "dds.sec.log.builtin.DDS_LogTopic."
    given = {f"{prefix}logging_level": "NOTICE_LEVEL", f"{prefix}log_file": "file:///a/b", f"{prefix}distribute": "1"}
    assert plugin(given).get_log_options() == LogOptions(
        logging_level=LogLevel.NOTICE_LEVEL, log_file="/a/b", distribute=True
    )


@pytest.mark.parametrize(
    ("name", "value", "complaint"),
    [
        ("log_level", "WARN_LEVEL", r"log_level is 'WARN_LEVEL', which is no level: did you mean WARNING_LEVEL\?"),
        ("log_level", "7", "known are EMERGENCY_LEVEL, "),
        ("distribute", "yes", "distribute is 'yes': write true or false"),
    ],
)
def test_what_cannot_be_meant_is_refused(name: str, value: str, complaint: str) -> None:
    with pytest.raises(ConfigurationError, match=complaint):
        plugin({f"dds.sec.log.{name}": value})


def test_a_file_that_cannot_be_written_is_refused_when_logging_is_enabled(tmp_path: Path) -> None:
    log = plugin({"dds.sec.log.log_file": str(tmp_path / "absent" / "security.log")})
    with pytest.raises(ConfigurationError, match=r"log_file: cannot write to .*absent.*No such file"):
        log.enable_logging()


def test_the_options_are_fixed_once_it_is_enabled() -> None:
    log = plugin()
    log.set_log_options(LogOptions(logging_level=LogLevel.DEBUG_LEVEL))
    log.enable_logging()
    with pytest.raises(ConfigurationError, match="fixed"):
        log.set_log_options(LogOptions())
    assert log.get_log_options().logging_level is LogLevel.DEBUG_LEVEL


# --- events ----------------------------------------------------------------------------------------------


def test_nothing_is_logged_before_it_is_enabled() -> None:
    log, listener = plugin({"dds.sec.log.distribute": "true"}), Listener()
    log.set_listener(listener)
    log.log(LogLevel.EMERGENCY_LEVEL, "x", "auth")
    assert listener.events == []


def test_what_is_less_severe_than_the_level_is_not_logged() -> None:
    log, listener = enabled({"dds.sec.log.log_level": "WARNING_LEVEL"})
    for level in LogLevel:
        log.log(level, level.name, "auth")
    assert [event.message for event in listener.events] == [level.name for level in LogLevel if level <= 4]


def test_an_event_says_who_when_and_where() -> None:
    properties: Properties = {
        "__Hostname": "host",
        "__ProcessName": Property("pilot"),
        "dds.sys_info.process_id": "4711",
    }
    log, listener = enabled(properties)
    log.log(LogLevel.ERROR_LEVEL, "first", "auth")
    log.set_participant(GUID, 7)
    log.log(LogLevel.ERROR_LEVEL, "second", "auth", plugin_class="DDS:Auth:PKI-DH", plugin_method="process_handshake")
    log.log(LogLevel.ERROR_LEVEL, "third", "access", entity=Guid(bytes(15) + b"\x02"))
    told = [{pair.name: pair.value for pair in event.structured_data[0].pairs} for event in listener.events]
    assert told == [
        {},
        {
            "guid": "010F0000.00000001.0000ABCD.000001C1",
            "domain_id": "7",
            "plugin_class": "DDS:Auth:PKI-DH",
            "plugin_method": "process_handshake",
        },
        {"guid": "00000000.00000000.00000000.00000002", "domain_id": "7"},
    ]
    event = listener.events[1]
    assert (event.hostname, event.appname, event.procid, event.msgid) == ("host", "pilot", "4711", "auth")
    assert (event.facility, event.severity, event.timestamp.sec) == (10, LogLevel.ERROR_LEVEL, 1_800_000_000)


def test_only_what_is_to_be_distributed_reaches_the_listener() -> None:
    log, listener = plugin(), Listener()
    log.set_listener(listener)
    log.enable_logging()
    log.log(LogLevel.ERROR_LEVEL, "x", "auth")
    assert listener.events == []


def test_the_file_grows_by_a_line_each_which_is_there_at_once(tmp_path: Path) -> None:
    path = tmp_path / "security.log"
    path.write_text("from an earlier run\n")
    log, _ = enabled({"dds.sec.log.log_file": f"file:{path}"})
    log.log(LogLevel.ERROR_LEVEL, "certificate\nexpired", "auth")
    assert len(path.read_text().splitlines()) == 2
    log.log(LogLevel.ALERT_LEVEL, "key\u2028revoked", "auth")
    assert path.read_text(encoding="utf-8").splitlines() == [
        "from an earlier run",
        r"<83>1 2027-01-15T08:00:00.000000Z - - - auth [DDS] certificate\nexpired",
        r"<81>1 2027-01-15T08:00:00.000000Z - - - auth [DDS] key\u2028revoked",
    ]


def test_a_file_that_was_rotated_is_begun_anew(tmp_path: Path) -> None:
    path = tmp_path / "security.log"
    log, _ = enabled({"dds.sec.log.log_file": str(path)})
    log.log(LogLevel.ERROR_LEVEL, "one", "auth")
    path.rename(tmp_path / "security.log.1")
    log.log(LogLevel.ERROR_LEVEL, "two", "auth")
    assert path.read_text().endswith(" two\n")


def test_python_s_logging_gets_each_event_at_its_own_level(caplog: pytest.LogCaptureFixture) -> None:
    log, listener = enabled({"dds.sec.log.log_level": "DEBUG_LEVEL"})
    log.set_participant(GUID, 0)
    with caplog.at_level(logging.DEBUG, "ddsi.security"):
        for level in LogLevel:
            log.log(level, "100% %s", "auth")
    assert [record.levelname for record in caplog.records] == (
        ["CRITICAL"] * 3 + ["ERROR", "WARNING", "INFO", "INFO", "DEBUG"]
    )
    assert caplog.records[0].getMessage() == "100% %s (guid 010F0000.00000001.0000ABCD.000001C1, domain_id 0)"
    assert caplog.records[0].__dict__["security_event"] is listener.events[0]


# --- what goes wrong -------------------------------------------------------------------------------------


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no device that is always full")
def test_a_full_disk_is_counted_and_the_others_still_hear() -> None:
    log, listener = plugin({"dds.sec.log.distribute": "true"}), Listener()
    log.set_log_options(LogOptions(log_file="/dev/full", distribute=True))
    log.set_listener(listener)
    log.enable_logging()
    log.log(LogLevel.ERROR_LEVEL, "x", "auth")
    assert log.unwritten_count == 1
    assert len(listener.events) == 1


def test_a_listener_that_fails_is_counted() -> None:
    class Failing:
        def on_log_message(self, event: BuiltinLoggingTypeV2) -> None:
            raise ValueError("no writer")

    log, _ = enabled({})
    log.set_listener(Failing())
    log.log(LogLevel.ERROR_LEVEL, "x", "auth")
    assert log.unwritten_count == 1


def test_a_message_is_bounded() -> None:
    log, listener = enabled({})
    log.log(LogLevel.ERROR_LEVEL, "x" * 1_000_000, "y" * 1_000_000, plugin_method="z" * 1_000_000)
    (event,) = listener.events
    assert len(event.message) == MAX_MESSAGE_LENGTH
    assert sum(len(pair.value) for pair in event.structured_data[0].pairs) + len(event.msgid) < 1000


def test_a_flood_is_bounded_said_and_hides_nothing_worse() -> None:
    clock = Clock()
    log, listener = enabled({"dds.sec.log.log_level": "NOTICE_LEVEL"}, clock)
    for _ in range(MAX_EVENTS_PER_SECOND + 50):
        log.log(LogLevel.NOTICE_LEVEL, "flood", "crypto")
    log.log(LogLevel.ERROR_LEVEL, "break-in", "crypto")
    assert [event.message for event in listener.events] == ["flood"] * MAX_EVENTS_PER_SECOND + ["break-in"]
    assert log.suppressed_count == 50
    clock.now += SECOND
    log.log(LogLevel.NOTICE_LEVEL, "calm", "crypto")
    log.log(LogLevel.NOTICE_LEVEL, "calm", "crypto")
    assert [event.message for event in listener.events[-3:-1]] == [
        "50 events of one second were not logged, as there were too many",
        "calm",
    ]


def test_no_secret_of_the_properties_is_in_a_repr() -> None:
    log = plugin({"dds.sec.auth.password": "hunter2"})
    assert not re.search("hunter2", repr(vars(log)))
