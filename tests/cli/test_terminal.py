"""The screen that is painted over and over, and what standard output is taken for."""

from __future__ import annotations

import io
import sys

import pytest

from ddsi.cli import terminal
from ddsi.cli.terminal import Screen, can_print, is_terminal, uses_colour


class _Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def _on_terminal(monkeypatch: pytest.MonkeyPatch) -> _Terminal:
    """In the test itself, not in a fixture: pytest changes the standard output in between."""
    stream = _Terminal()
    monkeypatch.setattr(sys, "stdout", stream)
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.delenv("NO_COLOR", raising=False)
    return stream


def test_what_was_there_comes_back(monkeypatch: pytest.MonkeyPatch) -> None:
    output = _on_terminal(monkeypatch)
    with Screen() as screen:
        screen.paint(["one"])
    text = output.getvalue()
    assert text.startswith("\x1b[?1049h\x1b[?25l")
    assert text.endswith("\x1b[?25h\x1b[?1049l")


def test_it_comes_back_after_an_error_too(monkeypatch: pytest.MonkeyPatch) -> None:
    output = _on_terminal(monkeypatch)
    with pytest.raises(ValueError, match="x"), Screen():
        raise ValueError("x")
    assert output.getvalue().endswith("\x1b[?1049l")


def test_more_lines_than_there_is_room_for_are_cut(monkeypatch: pytest.MonkeyPatch) -> None:
    output = _on_terminal(monkeypatch)
    monkeypatch.setattr(terminal, "terminal_height", lambda: 4)
    Screen().paint([str(number) for number in range(10)])
    text = output.getvalue()
    assert "2\x1b[0m" in text
    assert "3\x1b[0m" not in text
    assert "... 7 more lines" in text
    assert text.count("\r\n") == 3


def test_every_line_covers_what_stood_there_before(monkeypatch: pytest.MonkeyPatch) -> None:
    output = _on_terminal(monkeypatch)
    Screen().paint(["a", "b"])
    assert output.getvalue() == "\x1b[Ha\x1b[0m\x1b[K\r\nb\x1b[0m\x1b[K\r\n\x1b[J"


def test_terminals_and_others(monkeypatch: pytest.MonkeyPatch) -> None:
    _on_terminal(monkeypatch)
    assert is_terminal()
    assert uses_colour()
    monkeypatch.setenv("NO_COLOR", "1")
    assert is_terminal()
    assert not uses_colour()
    monkeypatch.setenv("TERM", "dumb")
    assert not is_terminal()
    monkeypatch.setattr(sys, "stdout", None)
    assert not is_terminal()


def test_encodings(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(io.BytesIO(), encoding="ascii"))
    assert not can_print("├")
    assert can_print("+")
    monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(io.BytesIO(), encoding="utf-8"))
    assert can_print("├")
