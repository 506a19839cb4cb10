"""The results of a whole run as a table for people and as JSON for programs."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from dataclasses import asdict
from pathlib import Path

from ..peers.catalogue import OURS
from ..peers.peer import Peer
from .cases import CASES
from .outcome import Outcome, Verdict

__all__ = ["write_report"]

MARKS = {
    Verdict.PASSED: "yes",
    Verdict.FAILED: "**no**",
    Verdict.KNOWN: "no",
    Verdict.NOT_APPLICABLE: "",
    Verdict.UNAVAILABLE: "not run",
}

INTRODUCTION = """\
# Interoperability, as run

Written by `python -m multiproc_tests.interop` (`make interop`), which plays every case with every pair on a loopback
of its own. Columns are *publisher to subscriber*. An empty cell: one of the two cannot do that at all (keys, XCDR2,
...). **no** is a failure; a plain no is a limit of an implementation of others, and is explained below.
"""


def write_report(outcomes: Sequence[Outcome], peers: Sequence[Peer], folder: Path) -> None:
    """Writes ``results.md`` and ``results.json`` into the folder, which is made if need be."""
    folder.mkdir(parents=True, exist_ok=True)
    versions = {peer.name: {"title": peer.title, "version": peer.version()} for peer in peers}
    document = {"peers": versions, "outcomes": [_as_json(outcome) for outcome in outcomes]}
    Path(folder, "results.json").write_text(json.dumps(document, indent=1) + "\n")
    Path(folder, "results.md").write_text("\n".join(_markdown(outcomes, peers)) + "\n")


def _as_json(outcome: Outcome) -> dict[str, object]:
    document = asdict(outcome)
    del document["transcript"]  # it has process ids and times in it, and can be had again
    return {**document, "verdict": outcome.verdict.value, "seconds": round(outcome.seconds, 1)}


def _markdown(outcomes: Sequence[Outcome], peers: Sequence[Peer]) -> Iterable[str]:
    yield INTRODUCTION
    yield "| name | implementation | version |\n|---|---|---|"
    yield from (f"| {peer.name} | {peer.title} | {peer.version()} |" for peer in peers)
    pairs = list(dict.fromkeys((outcome.publisher, outcome.subscriber) for outcome in outcomes))
    yield "\n## Ours with everybody\n"
    yield from _table(outcomes, [pair for pair in pairs if OURS.name in pair])
    yield "\n## The others among themselves\n"
    yield from _table(outcomes, [pair for pair in pairs if OURS.name not in pair])
    yield "\n## The cases\n"
    yield from (f"- **{case.name}**: {case.claim}." for case in CASES)
    yield from _reasons("What failed", outcomes, Verdict.FAILED)
    yield from _reasons("Known limits of the others", outcomes, Verdict.KNOWN)


def _table(outcomes: Sequence[Outcome], pairs: Sequence[tuple[str, str]]) -> Iterable[str]:
    by_place = {(outcome.case, outcome.publisher, outcome.subscriber): outcome for outcome in outcomes}
    yield "| case | " + " | ".join(f"{publisher} to {subscriber}" for publisher, subscriber in pairs) + " |"
    yield "|---" * (len(pairs) + 1) + "|"
    for case in dict.fromkeys(outcome.case for outcome in outcomes):
        yield f"| {case} | " + " | ".join(MARKS[by_place[case, *pair].verdict] for pair in pairs) + " |"


def _reasons(heading: str, outcomes: Sequence[Outcome], verdict: Verdict) -> Iterable[str]:
    chosen = [outcome for outcome in outcomes if outcome.verdict is verdict]
    if chosen:
        yield f"\n## {heading}\n"
    for outcome in chosen:
        yield f"- {outcome.case}, {outcome.publisher} to {outcome.subscriber}: {outcome.reason}"
