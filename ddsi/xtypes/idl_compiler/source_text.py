"""Places in IDL text, and what is said of them: errors and warnings with file, line, column and a caret.

    shapes.idl:3:12: expected ';' after the member, found '}'
        int32 x }
                ^

It reads no files and knows no grammar.
"""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import field

from ...structure.dataclass import dataclass
from ...structure.errors import BadParameter

__all__ = ["IdlError", "IdlWarning", "Place", "SourceText"]

_WIDEST_EXCERPT = 160


@dataclass(eq=False, slots=True)
class SourceText:
    """One file, or the text given in place of one."""

    name: str
    text: str
    _line_starts: list[int] = field(default_factory=list)

    def line_and_column(self, offset: int) -> tuple[int, int]:
        """Both from 1; a tab is one column."""
        if not self._line_starts:
            self._line_starts = [0, *(index + 1 for index, character in enumerate(self.text) if character == "\n")]
        line = bisect_right(self._line_starts, offset)
        return line, offset - self._line_starts[line - 1] + 1

    def line_at(self, offset: int) -> str:
        start = self.text.rfind("\n", 0, offset) + 1
        end = self.text.find("\n", offset)
        return self.text[start : end if end >= 0 else len(self.text)].rstrip("\r")


@dataclass(eq=False, slots=True)
class Place:
    """Where a token begins."""

    source: SourceText
    offset: int

    @property
    def line(self) -> int:
        return self.source.line_and_column(self.offset)[0]

    @property
    def column(self) -> int:
        return self.source.line_and_column(self.offset)[1]

    def __str__(self) -> str:
        line, column = self.source.line_and_column(self.offset)
        return f"{self.source.name}:{line}:{column}"

    def excerpt(self) -> str:
        """The line, and a caret below the place."""
        text, column = self.source.line_at(self.offset), self.column
        if len(text) > _WIDEST_EXCERPT:  # generated files have such lines
            first = max(0, column - _WIDEST_EXCERPT // 2)
            text, column = text[first : first + _WIDEST_EXCERPT], column - first
        margin = "".join("\t" if character == "\t" else " " for character in text[: column - 1])
        return f"    {text}\n    {margin}^"


class IdlError(BadParameter):
    """IDL that cannot be understood, or says what cannot be.  ``str()`` has place, reason, line and caret.

    ``file``, ``line`` and ``column`` (both from 1) tell where, ``reason`` what is wrong or was expected.
    """

    def __init__(self, place: Place, reason: str) -> None:
        self.place = place
        self.file: str = place.source.name
        self.line, self.column = place.source.line_and_column(place.offset)
        self.reason = reason
        super().__init__(f"{place}: {reason}\n{place.excerpt()}")


@dataclass(frozen=True, slots=True)
class IdlWarning:
    """Something that was left out: an unknown annotation, a construct that is no data type."""

    place: Place
    reason: str

    def __str__(self) -> str:
        return f"{self.place}: {self.reason}"
