"""The inputs that are kept: hostile ones of each known class, and what ought to be said to them.

``corpus/TARGET/NAME`` holds the octets; ``corpus/expected.json`` the verdict for each.  All are made by
``make_corpus.py``, but for those whose name begins with ``found-``, which a fuzzer found.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

__all__ = ["FOLDER", "KeptInput", "kept"]

FOLDER = Path(__file__).with_name("corpus")
EXPECTED = FOLDER / "expected.json"


@dataclass(frozen=True)
class KeptInput:
    """``expected``: "accepted", or the name of a refusal; perhaps with " ~ " and words that its reason must hold."""

    target: str
    name: str
    octets: bytes
    expected: str

    def is_answered_by(self, verdict: str) -> bool:
        name, _, words = self.expected.partition(" ~ ")
        return verdict.partition(":")[0] == name and words.lower() in verdict.lower()

    def __str__(self) -> str:
        return f"{self.target}/{self.name}"


def kept(target: str | None = None) -> Iterator[KeptInput]:
    """All, or those of one target."""
    for name, verdicts in expectations().items():
        if target in (None, name):
            for file, expected in verdicts.items():
                yield KeptInput(name, file, (FOLDER / name / file).read_bytes(), expected)


@cache
def expectations() -> dict[str, dict[str, str]]:
    """Verdicts by target and file name."""
    expected: dict[str, dict[str, str]] = json.loads(EXPECTED.read_text())
    return expected
