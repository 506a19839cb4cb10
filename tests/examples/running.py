"""Runs the programs of ``examples/`` and of the README as a user would: each in a process of its own, on loopback."""

from __future__ import annotations

import itertools
import os
import subprocess
import sys
from pathlib import Path

__all__ = ["EXAMPLES", "ROOT", "environment", "output_of"]

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "examples"
_SECONDS = 30
_counter = itertools.count()


def environment() -> dict[str, str]:
    """Loopback alone, and a domain tag that nobody else on this host has: the programs all live in domain 0."""
    tag = f"example-{os.getpid()}-{next(_counter)}"
    uri = (
        '<DDSI><Domain><General><Interfaces><NetworkInterface name="lo"/></Interfaces></General>'
        f"<Discovery><Tag>{tag}</Tag></Discovery></Domain></DDSI>"
    )
    return {**os.environ, "DDSI_URI": uri, "PYTHONPATH": str(ROOT), "PYTHONIOENCODING": "utf-8"}


def output_of(program: Path, *arguments: str, folder: Path | None = None) -> list[str]:
    """The lines that the program prints, run in ``folder``.  It must end by itself, quietly, with status 0."""
    done = subprocess.run(
        [sys.executable, str(program), *arguments],
        env=environment(),
        cwd=folder,
        capture_output=True,
        text=True,
        encoding="utf-8",
        timeout=_SECONDS,
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, ""), done.stderr
    return done.stdout.splitlines()
