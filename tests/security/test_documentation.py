"""docs/security.md lists what the code knows, no more and no less."""

from __future__ import annotations

import logging
import re
import tomllib
from dataclasses import fields
from pathlib import Path

import pytest

from ddsi.config.environment import load_config
from ddsi.structure.guid import Guid
from ddsi.structure.qos_policies import Properties
from ddsi.structure.security_information import EndpointSecurity, ParticipantSecurity
from ddsi_security import plugins, properties
from ddsi_security.builtin_logging_type import LOG_TOPIC_NAME
from ddsi_security.loading import KINDS
from ddsi_security.logging import LogTopic
from ddsi_security.logging.log_topic import LOGGER_NAME, MAX_EVENTS_PER_SECOND, MAX_MESSAGE_LENGTH, PYTHON_LEVELS
from ddsi_security.logging.options import LEVEL_NAMES
from ddsi_security.plugins import LogLevel

ROOT = Path(__file__).parents[2]
TEXT = (ROOT / "docs/security.md").read_text(encoding="utf-8")
WORDS = " ".join(TEXT.split())


def table(heading: str) -> list[list[list[str]]]:
    """The rows of the table whose first column is so called; of each cell, what stands in backquotes."""
    rows = TEXT[TEXT.index(f"| {heading} |") :].partition("\n\n")[0].splitlines()[2:]
    return [[re.findall(r"`([^`]+)`", cell) for cell in row.strip("|").split("|")] for row in rows]


def code(language: str) -> str:
    (block,) = re.findall(rf"^```{language}\n(.*?)^```$", TEXT, re.DOTALL | re.MULTILINE)
    return str(block)


def test_the_properties_are_those_that_are_known() -> None:
    assert [row[0] for row in table("property")] == [[name] for name in properties._NAMES]


def test_other_spellings_mean_what_the_table_says() -> None:
    spelt = {spelling: row[0][0] for row in table("property") for spelling in row[2]}
    assert spelt == properties._SPELLINGS
    assert {theirs: ours for (ours,), (theirs,) in table("instead of")} == properties._FAST_DDS_PREFIXES


def test_what_is_skipped_is_named() -> None:
    skipped = {name.removeprefix("dds.sec.").partition(".")[2] for name in properties._IGNORED}
    paragraph = TEXT[TEXT.index("What only other stacks understand") :].partition("\n\n")[0]
    assert set(re.findall(r"`([^`]+)`", paragraph)) == skipped


def test_the_fields_that_applications_see_are_those_that_there_are() -> None:
    told: dict[str, set[str]] = {"participants": set(), "endpoints": set()}
    rows = TEXT[TEXT.index("| field | of |") :].partition("\n\n")[0].splitlines()[2:]
    for row in rows:
        names, whose, _ = (cell.strip() for cell in row.strip("|").split("|"))
        for kind in told:
            if whose in (kind, "both"):
                told[kind].update(re.findall(r"`(\w+)`", names))
    assert told["participants"] == {field.name for field in fields(ParticipantSecurity)}
    assert told["endpoints"] == {field.name for field in fields(EndpointSecurity)}


def test_the_program_configures_what_it_says() -> None:
    given = dict(re.findall(r'"(dds\.sec\.[\w.]+)": f"\{enclave\}(/[\w.]+)"', code("python")))
    assert len(given) == 6
    assert properties.security_properties(given) == given


def test_the_kinds_of_plugins_are_those_that_can_be_chosen() -> None:
    start = TEXT.index("| property | builtin |")
    rows = TEXT[start:].partition("\n\n")[0].splitlines()[2:]
    assert [re.findall(r"`([^`]+)`", row) for row in rows] == [
        [kind.property_name, kind.vendor_spelling, kind.entry_point_group, kind.interface.__name__] for kind in KINDS
    ]
    (group,) = tomllib.loads(code("toml"))["project"]["entry-points"]
    assert group in {kind.entry_point_group for kind in KINDS}


def test_the_levels_are_those_that_are_accepted() -> None:
    rows = table("level")
    assert {name: level for (level,), others, _ in rows for name in [level, *others]} == {
        name: level.name for name, level in LEVEL_NAMES.items()
    }
    assert {level: python for (level,), _, (python,) in rows} == {
        level.name: logging.getLevelName(python) for level, python in PYTHON_LEVELS.items()
    }


def test_the_line_of_the_log_is_what_is_written(tmp_path: Path) -> None:
    path = tmp_path / "security.log"
    given: Properties = {
        "dds.sec.log.log_file": str(path),
        "__Hostname": "host",
        "__ProcessName": "app",
        "__Pid": "4711",
    }
    log = LogTopic(given, entropy=bytes, wall_clock=lambda: 1_800_000_000 * 10**9)
    log.set_participant(Guid(bytes.fromhex("010f0000000000010000abcd000001c1")), 0)
    log.enable_logging()
    log.log(
        LogLevel.ERROR_LEVEL,
        "CN=mallory is not on our list",
        "auth",
        plugin_class="DDS:Auth:PKI-DH",
        plugin_method="process_handshake",
    )
    assert f"    {path.read_text()}" in TEXT


def test_the_xml_says_what_the_properties_say(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("DDSI_URI", code("xml"))
    given = re.findall(r'"(dds\.sec\.[\w.]+)": f"\{enclave\}(/[\w.]+)"', code("python"))
    assert dict(load_config(0).security) == {name: f"file:keystore/enclaves/alice{path}" for name, path in given}


def test_names_and_numbers_are_those_of_the_code() -> None:
    for stated in (
        f"`plugin_version = {plugins.PLUGIN_VERSION}`",
        f"the logger `{LOGGER_NAME}`",
        f"the topic `{LOG_TOPIC_NAME}`",
        f"a message has at most {MAX_MESSAGE_LENGTH} characters",
        f"at most {MAX_EVENTS_PER_SECOND} events in a second",
        f"`{LogTopic.__name__}.unwritten_count`",
    ):
        assert stated in WORDS
