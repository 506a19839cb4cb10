"""docs/dcps.md against the code: every policy, status and condition has its line, and what the lines name exists."""

from __future__ import annotations

import ast
import re
from functools import lru_cache
from pathlib import Path
from typing import get_args

import pytest

import ddsi
from ddsi.dcps import conditions
from ddsi.structure import status
from ddsi.structure.qos_changes import CHANGEABLE
from ddsi.structure.qos_concerns import QosOwner, unused_policies
from tests.structure.test_qos_concerns import EVERYTHING

ROOT = Path(__file__).parents[2]
TEXT = (ROOT / "docs/dcps.md").read_text(encoding="utf-8")


def rows(title: str) -> list[list[str]]:
    """The lines of the table under this heading, cell by cell, the first two lines left out."""
    section = TEXT.split(f"\n## {title}\n")[1].split("\n## ")[0]
    lines = [line for line in section.splitlines() if line.startswith("|")]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines[2:]]


def names(cell: str) -> list[str]:
    return re.findall(r"`([^`]+)`", cell)


ALL_ROWS = [
    row for title in ("Policies", "Statuses", "Conditions", "Filters and wait sets", "Entities") for row in rows(title)
]


@lru_cache
def functions_of(path: Path) -> frozenset[str]:
    nodes = ast.walk(ast.parse(path.read_text(encoding="utf-8")))
    return frozenset(node.name for node in nodes if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef))


def test_every_policy_has_its_line() -> None:
    assert sorted(names(row[0])[0] for row in rows("Policies")) == sorted(ddsi.Qos.__dataclass_fields__)


def test_the_column_of_changes_is_that_of_the_code() -> None:
    assert {names(row[0])[0] for row in rows("Policies") if row[1] == "yes"} == CHANGEABLE
    assert {row[1] for row in rows("Policies")} == {"yes", "-"}


@pytest.mark.parametrize(("owner", "other"), [("writers", "reader"), ("readers", "writer")])
def test_the_policies_of_writers_alone_and_of_readers_alone_are_those_of_the_code(owner: str, other: QosOwner) -> None:
    (line,) = [line for line in TEXT.splitlines() if line.startswith(f"- Of {owner} alone: ")]
    assert {*names(line), "entity_factory"} == set(unused_policies(EVERYTHING, other))


def test_every_status_has_its_line_and_its_entities() -> None:
    entities: dict[str, type[ddsi.Entity]] = {
        "participant": ddsi.DomainParticipant, "subscriber": ddsi.Subscriber, "topic": ddsi.Topic,
        "writer": ddsi.DataWriter, "reader": ddsi.DataReader,
    }  # fmt: skip
    documented = {names(row[0])[0]: row[1].split(", ") for row in rows("Statuses")}
    assert documented.keys() == {kind.__name__ for kind in get_args(status.Status)}
    for name, kinds in documented.items():
        holders = [word for word, kind in entities.items() if name in [known.__name__ for known in kind.STATUSES]]
        assert sorted(kinds) == sorted(holders), name


def test_every_condition_has_its_line() -> None:
    assert {names(row[0])[0] for row in rows("Conditions")} == set(conditions.__all__) - {"Condition"}


@pytest.mark.parametrize("row", rows("Entities"), ids=lambda row: row[0])
def test_every_operation_is_one(row: list[str]) -> None:
    kinds = (ddsi.DomainParticipant, ddsi.Publisher, ddsi.Subscriber, ddsi.DataWriter, ddsi.DataReader)
    for name in names(row[0]):
        assert any(callable(getattr(kind, name, None)) for kind in kinds), name


@pytest.mark.parametrize("row", ALL_ROWS, ids=lambda row: row[0])
def test_what_a_line_names_exists(row: list[str]) -> None:
    code, shown = names(row[-2]), names(row[-1])
    assert code
    assert shown
    for path in code:
        assert (ROOT / "ddsi" / path).is_file()
    for place in shown:
        path, _, test = place.partition("::")
        assert (ROOT / "tests" / path).is_file()
        if test:
            assert test in functions_of(ROOT / "tests" / path)
