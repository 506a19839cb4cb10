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
_GAP = 3
"""Characters that rich puts between two columns."""


def shown(text: str, limit: int = _MAX_CELL) -> str:
    """A cell's text made safe for a terminal; ``-`` for none."""
    return printable(text, limit=limit) or _NO_VALUE


@dataclass(slots=True)
class Table:
    """Rows of texts below a title and heads.

    Columns named in ``numeric`` stand to the right; those in ``dispensable`` are left out one by one, the first first,
    where a terminal is too narrow for all.
    """

    title: str
    columns: tuple[str, ...]
    numeric: frozenset[str] = frozenset()
    dispensable: tuple[str, ...] = ()
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
        widths = self._widths()
        return [self.title, *("  " + self._plain_row(row, widths) for row in (self.columns, *self.rows))]

    def _widths(self) -> list[int]:
        body = [self.columns, *self.rows]
        return [max(len(row[index]) for row in body) for index in range(len(self.columns))]

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

        hidden = self._hidden(terminal_width())
        title = f"{self.title} (no room for {', '.join(hidden)})" if hidden else self.title
        table = RichTable(
            title=Text(title), title_justify="left", title_style="bold", box=box.SIMPLE_HEAD, show_edge=False
        )
        for column in self.columns:
            if column not in hidden:
                table.add_column(column, justify="right" if column in self.numeric else "left", overflow="fold")
        for row in self.rows:
            cells = zip(self.columns, row, strict=True)
            table.add_row(*(Text(cell) for column, cell in cells if column not in hidden))
        console = Console(
            file=io.StringIO(), width=terminal_width(), force_terminal=True, no_color=not uses_colour(), highlight=False
        )
        console.print(table)
        assert isinstance(console.file, io.StringIO)
        return [line.rstrip() for line in console.file.getvalue().splitlines()]

    def _hidden(self, width: int) -> list[str]:
        """Columns to leave out so that the others fit the width, as far as that goes."""
        needed = dict(zip(self.columns, self._widths(), strict=True))
        hidden: list[str] = []
        for column in self.dispensable:
            if sum(needed.values()) + _GAP * len(needed) <= width:
                break
            del needed[column]
            hidden.append(column)
        return hidden
