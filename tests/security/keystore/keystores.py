"""Keystores to order, the command in this process at a time of the test's choosing, and openssl as the judge."""

from __future__ import annotations

import subprocess
from datetime import UTC, datetime
from pathlib import Path

import pytest

from ddsi.cli import command_line
from ddsi.cli.command_line import main

__all__ = ["DAY", "NOW", "Shell", "openssl"]

NOW = int(datetime(2026, 7, 1, 12, tzinfo=UTC).timestamp()) * 1_000_000_000
DAY = 86_400 * 1_000_000_000


class Shell:
    """``ddsi`` at a fixed time; ``out`` and ``err`` are what the last command said."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
        self.now = NOW
        self.out = self.err = ""
        self._capsys = capsys
        monkeypatch.setattr(command_line, "wall_clock", lambda: self.now)

    def run(self, *words: object) -> int:
        """The status; that of argparse for what it refuses."""
        self._capsys.readouterr()
        try:
            status = main([str(word) for word in words])
        except SystemExit as ended:
            status = ended.code if isinstance(ended.code, int) else 1
        self.out, self.err = self._capsys.readouterr()
        return status

    def make(self, *words: object) -> str:
        """``ddsi keystore ...``, which must succeed; what it said."""
        assert self.run("keystore", *words) == 0, self.err
        return self.out

    def refused(self, *words: object) -> str:
        """``ddsi keystore ...``, which must be refused in one sentence."""
        assert self.run("keystore", *words) == 2, self.out
        assert self.err.count("\n") == 1
        assert self.out == ""
        return self.err

    def create(self, folder: Path, *words: object) -> Path:
        """A keystore with alice, and with what the words add; her folder."""
        self.make("create", folder, "--identity", "alice", *words)
        return folder / "enclaves" / "alice"


def openssl(*words: object) -> str:
    """What it prints; it must succeed."""
    command = ["openssl", *map(str, words)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 0, f"{' '.join(command)}: {done.stderr}"
    return done.stdout
