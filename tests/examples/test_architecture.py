"""docs/architecture.md speaks of code that exists: files, rooms, classes, methods, settings, and its numbers hold."""

from __future__ import annotations

import ast
import re
from functools import lru_cache
from pathlib import Path

import pytest

from ddsi.behavior import schedules, send_window
from ddsi.config import Config
from ddsi.engine.alarms import Timer
from tests.examples.running import ROOT

TEXT = (ROOT / "docs/architecture.md").read_text(encoding="utf-8")
NAMES = sorted(set(re.findall(r"`([^`\n]+)`", TEXT)))
SOURCES = sorted([*(ROOT / "ddsi").rglob("*.py"), *(ROOT / "security").rglob("*.py")])


@lru_cache
def members() -> dict[str, set[str]]:
    """What each class of the project defines: methods, fields, slots."""
    found: dict[str, set[str]] = {}
    for path in SOURCES:
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ClassDef):
                found.setdefault(node.name, set()).update(_defined_in(node))
    return found


def _defined_in(node: ast.ClassDef) -> set[str]:
    names = set()
    for child in ast.walk(node):
        if isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef):
            names.add(child.name)
        elif isinstance(child, ast.AnnAssign) and isinstance(child.target, ast.Name):
            names.add(child.target.id)
        elif isinstance(child, ast.Attribute) and isinstance(child.value, ast.Name) and child.value.id == "self":
            names.add(child.attr)
    return names


@pytest.mark.parametrize("name", [name for name in NAMES if re.fullmatch(r"[\w/]+\.(py|md)", name)])
def test_the_files_that_it_names_exist(name: str) -> None:
    if "/" in name:
        assert (ROOT / "ddsi" / name).exists() or (ROOT / name).exists()
    else:
        assert [path for path in SOURCES if path.name == name]


@pytest.mark.parametrize("name", [name for name in NAMES if re.fullmatch(r"[A-Z]\w+\.[a-z_]\w+", name)])
def test_the_methods_and_fields_that_it_names_exist(name: str) -> None:
    owner, _, member = name.partition(".")
    assert member in members()[owner]


def test_the_tables_of_rooms_and_of_timers_are_complete() -> None:
    rooms = {path.parent.name for path in (ROOT / "ddsi").glob("*/__init__.py")}
    assert rooms <= set(re.findall(r"^\| `(\w+)` \|", TEXT, re.MULTILINE))
    assert len(Timer) == 14  # "What it waits for" lists them


def test_its_numbers_are_those_of_the_code() -> None:
    default = Config()
    for stated in (
        f"`Config.max_participants` ({default.max_participants})",
        f"`max_endpoints` ({default.max_endpoints:,})",
        f"`max_instances` ({default.max_instances:,})",
        f"`reader_octets` ({default.reader_octets >> 20} MiB)",
        f"`max_reorder_samples` ({default.max_reorder_samples})",
        f"`max_sample_size` ({default.max_sample_size >> 20} MiB)",
        f"`max_defrag_octets` ({default.max_defrag_octets >> 20} MiB)",
        f"`Config.unacknowledged_octets` ({default.unacknowledged_octets >> 20} MiB)",
        f"{schedules.HEARTBEAT_PERIOD_MIN * 1000:.0f} ms after a write",
        f"{schedules.HEARTBEAT_PERIOD_MAX:.0f} s at most",
        f"after {schedules.NACK_DELAY * 1000:.0f} ms, as a little reordering",
        f"{schedules.NACK_REPEAT_FIRST * 1000:.0f} ms until known, {schedules.NACK_REPEAT_MIN * 1000:.0f} ms at least",
        f"doubling in vain to {schedules.NACK_REPEAT_MAX:.0f} s",
        f"at once, {schedules.PREEMPTIVE_MIN * 1000:.0f} ms, doubling to {schedules.PREEMPTIVE_MAX:.0f} s",
        f"twice within {schedules.NACK_RESPONSE_SUPPRESSION * 1000:.0f} ms",
        f"{send_window._INITIAL_OCTETS >> 10} KiB at first",
        f"{send_window._MAXIMUM_OCTETS >> 20} MiB at most",
        f"not below {send_window._MINIMUM_OCTETS >> 10} KiB",
    ):
        assert stated in TEXT


def test_documents_have_no_lines_that_end_in_spaces() -> None:
    for path in (ROOT / "docs").glob("*.md"):
        assert not re.search(r"[ \t]+$", Path(path).read_text(encoding="utf-8"), re.MULTILINE), path.name
