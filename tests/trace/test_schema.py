"""The written schema and the code say the same."""

import re
from dataclasses import MISSING, fields
from pathlib import Path

import pytest

from ddsi.trace.event import SCHEMA_NAME, SCHEMA_VERSION, Category
from ddsi.trace.events import EVENT_TYPES
from ddsi.trace.reasons import DropReason, LossReason, RejectReason, SampleLossReason, SecurityStep, TypeStep

SCHEMA = (Path(__file__).parents[2] / "docs" / "trace.md").read_text(encoding="utf-8")


def section(title: str, *, level: str = "###") -> str:
    """The text below a heading, up to the next one of its level or above."""
    found = re.search(
        rf"^{level} {re.escape(title)}\n(.*?)(?=^#{{1,{len(level)}}} |\Z)", SCHEMA, re.DOTALL | re.MULTILINE
    )
    assert found is not None, title
    return found.group(1)


def rows(text: str) -> list[list[str]]:
    return [line.strip("| ").split(" | ") for line in text.splitlines() if line.startswith("| `")]


def test_every_event_stands_in_the_schema_with_its_fields_in_order() -> None:
    written = {name.strip("`"): cells[0] for name, *cells in rows(section("Events", level="##"))}
    expected = {}
    for name, event_type in EVENT_TYPES.items():
        own = fields(event_type)[2:]
        expected[name] = [(field.name, "" if field.default is MISSING else "?") for field in own]
    assert {name: re.findall(r"`(\w+)`(\??)", cell) for name, cell in written.items()} == expected


def test_every_event_stands_under_its_category() -> None:
    for category in Category:
        (title,) = re.findall(rf"^### (.* \(category `{category}`\))$", SCHEMA, re.MULTILINE)
        names = [name.strip("`") for name, *_ in rows(section(title))]
        assert names == [name for name, event_type in EVENT_TYPES.items() if event_type.CATEGORY is category]


@pytest.mark.parametrize(
    ("title", "reasons"),
    [
        ("Why something was dropped", DropReason),
        ("Why somebody is gone", LossReason),
        ("Why samples are lost", SampleLossReason),
        ("Why a sample was rejected", RejectReason),
        ("What security decided", SecurityStep),
        ("What became of types that are not plainly the same", TypeStep),
    ],
)
def test_every_reason_stands_in_the_schema(title: str, reasons: type[DropReason]) -> None:
    assert [name.strip("`") for name, _ in rows(section(title))] == [reason.value for reason in reasons]


def test_the_version_is_the_one_that_is_written() -> None:
    assert f'{{"schema":"{SCHEMA_NAME}","version":{SCHEMA_VERSION},' in SCHEMA


def test_the_example_program_runs(capsys: pytest.CaptureFixture[str]) -> None:
    (program,) = re.findall(r"```python\n(.*?)```", SCHEMA, re.DOTALL)
    exec(compile(program, "docs/trace.md", "exec"), {})
    assert capsys.readouterr().out.endswith("    0.000000  ●     hello\n")
