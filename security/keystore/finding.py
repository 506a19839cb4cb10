"""What ``ddsi keystore check`` finds: which rule, where, how bad, and what to do about it."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

__all__ = ["Finding", "Rule", "Severity"]


class Severity(StrEnum):
    ERROR = "error"
    """A participant will not work with it, or it protects nothing."""
    WARNING = "warning"
    """Vendors disagree about it, it will stop working, or it cannot be meant."""
    NOTE = "note"
    """Worth knowing; nothing to be done where it is meant."""


@dataclass(frozen=True, slots=True)
class Rule:
    """Something to look for.  ``id`` is for ``--ignore``, ``summary`` for lists of rules."""

    id: str
    severity: Severity
    summary: str

    def at(self, path: Path, text: str, *, remedy: str, line: int = 1) -> Finding:
        """It was found there."""
        return Finding(self, path, max(line, 1), text, remedy)


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing that is wrong.  ``line`` counts from 1; where the whole file is meant, it is 1."""

    rule: Rule
    path: Path
    line: int
    text: str
    remedy: str

    def as_json(self) -> dict[str, str | int]:
        return {
            "file": str(self.path),
            "line": self.line,
            "rule": self.rule.id,
            "severity": str(self.rule.severity),
            "text": self.text,
            "remedy": self.remedy,
        }

    def __str__(self) -> str:
        return f"{self.path}:{self.line}: {self.rule.severity}: {self.text} [{self.rule.id}]\n    remedy: {self.remedy}"
