"""Fuzz one target, or each in turn, guided by coverage: what ``python -m tests.fuzz TARGET SECONDS`` runs.

Coverage-guided, with atheris (libFuzzer): inputs that reach new code are kept in ``.fuzz/TARGET``, where the next run
begins.  One that raises what the target does not promise, takes more than ten seconds or more than a gibibyte of memory
is written to ``.fuzz/found`` and ends the run.  See ``docs/fuzzing.md``.
"""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import atheris

# What is imported inside is instrumented: coverage of our code is what guides the search.
with atheris.instrument_imports(include=["ddsi", "ddsi_security"]):  # pyright: ignore[reportAttributeAccessIssue]
    from tests.fuzz.corpus import kept
    from tests.fuzz.target import Target
    from tests.fuzz.targets import TARGETS

KEPT = Path(".fuzz")
SECONDS_FOR_ONE_INPUT = 10
MEBIBYTES = 1024


def fuzz(name: str, seconds: int) -> None:
    """Does not return: libFuzzer ends the process."""
    target = TARGETS[name]
    folder, found = KEPT / name, KEPT / "found"
    folder.mkdir(parents=True, exist_ok=True)
    found.mkdir(exist_ok=True)
    for number, octets in enumerate([*(entry.octets for entry in kept(name)), *target.seeds()]):
        (folder / f"seed-{number}").write_bytes(octets[: target.most_octets])
    words = folder.with_suffix(".words")
    words.write_text("".join(f'"{word}"\n' for word in _words(target)))
    options = [
        *([f"-dict={words}"] if target.is_text else []),
        f"-max_total_time={seconds}",
        f"-max_len={target.most_octets}",
        f"-timeout={SECONDS_FOR_ONE_INPUT}",
        f"-rss_limit_mb={MEBIBYTES}",
        f"-artifact_prefix={found}/{name}-",
        "-print_final_stats=1",
        str(folder),
    ]

    def one_input(octets: bytes) -> None:
        target.run(octets)

    atheris.Setup([sys.argv[0], *options], one_input)
    atheris.Fuzz()


def _words(target: Target) -> list[str]:
    """Those of its seeds, and tags."""
    text = b"\n".join(target.seeds()).decode("latin-1")
    return sorted(set(re.findall(r"</?[a-z_]+>|[A-Za-z][A-Za-z_/-]{2,40}", text)))


def fuzz_all(seconds: int) -> None:
    """Each in a process of its own; the names of those that found something are the exit status's text."""
    command = [sys.executable, "-m", "tests.fuzz"]
    codes = {name: subprocess.run([*command, name, f"{seconds}"], check=False).returncode for name in TARGETS}
    sys.exit(", ".join(name for name, code in codes.items() if code) or None)


def main(name: str = "", seconds: str = "0") -> None:
    if name == "all":
        fuzz_all(int(seconds))
    elif name in TARGETS:
        fuzz(name, int(seconds))
    else:
        sys.exit(f"there is no target {name!r}; there are all, {', '.join(TARGETS)}")
