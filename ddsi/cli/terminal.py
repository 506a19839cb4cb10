"""Where output goes: what the terminal can do, if it is one, and a screen that is painted over and over.

Plain ANSI (ECMA-48), so that it works without ``rich``; on a pipe or in a file there is neither colour nor cursor.
"""

from __future__ import annotations

import os
import shutil
import sys
from types import TracebackType
from typing import Self

__all__ = ["Screen", "can_print", "is_terminal", "terminal_height", "terminal_width", "uses_colour"]

_ENTER, _LEAVE = "\x1b[?1049h\x1b[?25l", "\x1b[?25h\x1b[?1049l"  # alternate screen; cursor hidden, cursor shown
_HOME, _CLEAR_LINE, _CLEAR_BELOW = "\x1b[H", "\x1b[K", "\x1b[J"
_RESET = "\x1b[0m"
_WIDTH_OF_A_PIPE = 100


def is_terminal() -> bool:
    """Is standard output a terminal that understands more than lines?"""
    return sys.stdout is not None and sys.stdout.isatty() and os.environ.get("TERM", "") not in ("", "dumb")


def uses_colour() -> bool:
    """Colours, unless the user said not to (https://no-color.org)."""
    return is_terminal() and not os.environ.get("NO_COLOR")


def terminal_width() -> int:
    """Characters in a line; of a pipe, 100, unless COLUMNS says otherwise."""
    return shutil.get_terminal_size((_WIDTH_OF_A_PIPE, 24)).columns


def terminal_height() -> int:
    return shutil.get_terminal_size((_WIDTH_OF_A_PIPE, 24)).lines


def can_print(text: str) -> bool:
    """Does the encoding of standard output have these characters?"""
    try:
        text.encode(getattr(sys.stdout, "encoding", None) or "ascii")
    except (UnicodeEncodeError, LookupError):
        return False
    return True


class Screen:
    """The whole terminal for one program; what was there before comes back at the end::

    with Screen() as screen:
        screen.paint(lines)
    """

    def __enter__(self) -> Self:
        self._write(_ENTER)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        # A terminal that went away (BrokenPipeError, EIO) needs no tidying.
        if not isinstance(error, OSError):
            self._write(_RESET + _LEAVE)

    def paint(self, lines: list[str]) -> None:
        """Show these lines from the top.  What has no room is cut, and the last line then says so.

        Each line must fit the width.  They replace what stands there without clearing it first, so nothing flickers.
        """
        height = terminal_height()
        if len(lines) > height:
            lines = [*lines[: height - 1], f"... {len(lines) - height + 1} more lines; make the window higher"]
        painted = "\r\n".join(f"{line}{_RESET}{_CLEAR_LINE}" for line in lines)
        self._write(f"{_HOME}{painted}\r\n{_CLEAR_BELOW}" if len(lines) < height else f"{_HOME}{painted}")

    @staticmethod
    def _write(text: str) -> None:
        sys.stdout.write(text)
        sys.stdout.flush()
