"""Tables for people: by ``rich`` on a terminal where it is installed, else as aligned text.

Cells may come from the network; what would move a cursor is replaced.
"""

from __future__ import annotations

import io
from dataclasses import dataclass, field

from ..trace.wording import printable
from .terminal import is_terminal, terminal_width, uses_colour

__all__ = ["Table", "shown"]

_MAX_CELL = 400
_NO_VALUE = "-"


def shown(text: str, limit: int = _MAX_CELL) -> str:
    """A cell's text made safe for a terminal; ``-`` for none."""
    return printable(text, limit=limit) or _NO_VALUE


@dataclass(slots=True)
class Table:
    """Rows of texts below a title and heads.  Columns named in ``numeric`` stand to the right."""

    title: str
    columns: tuple[str, ...]
    numeric: frozenset[str] = frozenset()
    rows: list[tuple[str, ...]] = field(default_factory=list)

    def add(self, *cells: object) -> None:
        """One row, a cell for each column."""
        assert len(cells) == len(self.columns)
        self.rows.append(tuple(shown(str(cell)) for cell in cells))

    def lines(self) -> list[str]:
        """The table as it suits standard output."""
        if is_terminal():
            try:
                return self._rich_lines()
            except ImportError:
                pass
        return self.plain_lines()

    def plain_lines(self) -> list[str]:
        """Title, heads and rows in columns two blanks apart; a line is as long as it must be."""
        body = [self.columns, *self.rows]
        widths = [max(len(row[index]) for row in body) for index in range(len(self.columns))]
        return [self.title, *("  " + self._plain_row(row, widths) for row in body)]

    def _plain_row(self, row: tuple[str, ...], widths: list[int]) -> str:
        cells = (
            cell.rjust(width) if column in self.numeric else cell.ljust(width)
            for column, cell, width in zip(self.columns, row, widths, strict=True)
        )
        return "  ".join(cells).rstrip()

    def _rich_lines(self) -> list[str]:
        from rich import box
        from rich.console import Console
        from rich.table import Table as RichTable
        from rich.text import Text

        table = RichTable(title=Text(self.title), title_justify="left", title_style="bold", box=box.SIMPLE_HEAD)
        for column in self.columns:
            table.add_column(column, justify="right" if column in self.numeric else "left", overflow="fold")
        for row in self.rows:
            table.add_row(*(Text(cell) for cell in row))
        console = Console(
            file=io.StringIO(), width=terminal_width(), force_terminal=True, no_color=not uses_colour(), highlight=False
        )
        console.print(table)
        assert isinstance(console.file, io.StringIO)
        return [line.rstrip() for line in console.file.getvalue().splitlines()]
