"""Rules on files as such: is it there, and who may read or change it?"""

from __future__ import annotations

import os
import stat
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from .finding import Finding, Rule, Severity

__all__ = ["RULES", "check_key_mode", "check_writable", "missing"]

FILE_MISSING: Final = Rule("file-missing", Severity.ERROR, "a file that every participant needs is not there")
KEY_EXPOSED: Final = Rule("key-exposed", Severity.ERROR, "others than its owner may read a private key")
FILE_WRITABLE: Final = Rule("file-writable", Severity.WARNING, "others than its owner may replace what is trusted")
RULES: Final = (FILE_MISSING, KEY_EXPOSED, FILE_WRITABLE)

# Only where the modes of files mean something.
_HAS_MODES: Final = hasattr(os, "geteuid")


def missing(path: Path, what: str, remedy: str) -> Finding:
    return FILE_MISSING.at(path, f"{what} is not there", remedy=remedy)


def check_key_mode(path: Path) -> Iterator[Finding]:
    """A private key is for its owner alone."""
    mode = _mode(path)
    if mode & (stat.S_IRWXG | stat.S_IRWXO):
        who = "everybody" if mode & stat.S_IRWXO else "its group"
        yield KEY_EXPOSED.at(
            path,
            f"the private key is open to {who} (mode {mode:04o})",
            remedy=f"chmod 600 {path}; if others had access to this machine, make it anew",
        )


def check_writable(path: Path) -> Iterator[Finding]:
    """Whoever can replace an authority's certificate or a document decides who is trusted."""
    mode = _mode(path)
    if mode & stat.S_IWOTH:
        yield FILE_WRITABLE.at(path, f"everybody may replace its content (mode {mode:04o})", remedy=f"chmod o-w {path}")


def _mode(path: Path) -> int:
    return stat.S_IMODE(path.stat().st_mode) if _HAS_MODES else 0
