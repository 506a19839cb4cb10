"""Tables: aligned, safe, and no wider than the terminal."""

from __future__ import annotations

import re
import sys

import pytest

from ddsi.cli import tables
from ddsi.cli.tables import Table, shown


def _table() -> Table:
    table = Table("Things: 2", ("NAME", "COUNT", "REMARK"), frozenset({"COUNT"}), ("REMARK",))
    table.add("a", 5, "")
    table.add("longer", 12345, "yes")
    return table


def test_plain_columns_are_aligned() -> None:
    assert _table().plain_lines() == [
        "Things: 2",
        "  NAME    COUNT  REMARK",
        "  a           5  -",
        "  longer  12345  yes",
    ]


def test_a_pipe_gets_plain_text() -> None:
    """pytest captures the output: it is no terminal."""
    assert _table().lines() == _table().plain_lines()


def test_what_would_move_the_cursor_is_replaced() -> None:
    table = Table("T", ("NAME",))
    table.add("\x1b[2Jevil\r\nname\x9b")
    assert table.plain_lines()[2] == "  ?[2Jevil??name?"
    assert len(shown("x" * 5000)) == 400


def _on_terminal(monkeypatch: pytest.MonkeyPatch, width: int) -> None:
    monkeypatch.setattr(tables, "is_terminal", lambda: True)
    monkeypatch.setattr(tables, "uses_colour", lambda: False)
    monkeypatch.setattr(tables, "terminal_width", lambda: width)


def test_a_terminal_gets_a_table_of_rich(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("rich")
    _on_terminal(monkeypatch, 60)
    text = re.sub(r"\x1b\[[0-9;]*m", "", "\n".join(_table().lines()))
    assert "─" in text
    assert "longer" in text
    assert "REMARK" in text


def test_brackets_are_no_markup(monkeypatch: pytest.MonkeyPatch) -> None:
    """A topic may be called ``[bold]``."""
    pytest.importorskip("rich")
    _on_terminal(monkeypatch, 60)
    table = Table("T", ("NAME",))
    table.add("[bold]x[/bold]")
    assert any("[bold]x[/bold]" in line for line in table.lines())


def test_dispensable_columns_give_way(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("rich")
    _on_terminal(monkeypatch, 22)
    lines = [re.sub(r"\x1b\[[0-9;]*m", "", line) for line in _table().lines()]
    assert not any("REMARK" in line and "room" not in line for line in lines[2:])
    assert any("longer" in line and "12345" in line for line in lines)
    assert all(len(line) <= 22 for line in lines)
    assert "no room for REMARK" in " ".join(" ".join(lines).split())


def test_without_rich_a_terminal_gets_plain_text(monkeypatch: pytest.MonkeyPatch) -> None:
    _on_terminal(monkeypatch, 60)
    monkeypatch.setitem(sys.modules, "rich", None)
    monkeypatch.setitem(sys.modules, "rich.console", None)
    assert _table().lines() == _table().plain_lines()
