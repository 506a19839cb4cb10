"""``ddsi bench``: the benchmarks of the source tree, ``python -m benchmarks``, from wherever one stands.

They are no part of what is installed, as they need the peer that they compare with, and programs for it.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
from pathlib import Path

from .exit_status import CommandError

__all__ = ["SUMMARY", "add_arguments", "run"]

SUMMARY = "measure this stack beside the C-backed Python binding, and print ratios"

_SOURCES = Path(__file__).parents[2]


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("names", nargs="*", metavar="NAME", help="benchmarks, or the first part of their names; all")
    parser.add_argument("--list", action="store_true", help="name the benchmarks and end")
    parser.add_argument("--rounds", metavar="N", help="measure each side N times (5)")
    parser.add_argument("--scale", metavar="X", help="multiply the numbers of samples (1)")
    parser.add_argument("--deadline", metavar="S", help="seconds for one measurement (60)")
    parser.add_argument("--details", action="store_true", help="print what else was measured, processor time foremost")
    parser.add_argument("--json", metavar="FILE", help="write everything that was measured there")


def run(arguments: argparse.Namespace) -> int:
    if not (_SOURCES / "benchmarks" / "__main__.py").is_file():
        raise CommandError("the benchmarks are in the source tree, not in what pip installs; run `make bench` there")
    words = [f"--{name}" for name in ("list", "details") if getattr(arguments, name)]
    for name in ("rounds", "scale", "deadline", "json"):
        if (value := getattr(arguments, name)) is not None:
            words.append(f"--{name}={value}")
    path = os.pathsep.join(filter(None, (str(_SOURCES), os.environ.get("PYTHONPATH"))))
    command = [sys.executable, "-m", "benchmarks", *words, "--", *arguments.names]
    return subprocess.run(command, env={**os.environ, "PYTHONPATH": path}, check=False).returncode
