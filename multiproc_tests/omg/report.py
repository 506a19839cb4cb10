"""The results of a run as ``docs/interop/omg.md`` for people and ``omg.json`` for programs."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from dataclasses import asdict
from pathlib import Path

from ..matrix.outcome import Outcome, Verdict
from .cases import CASES, SuiteCase
from .programs import PROGRAMS

__all__ = ["write_report"]

MARKS = {
    Verdict.PASSED: "yes",
    Verdict.FAILED: "**no**",
    Verdict.KNOWN: "no",
    Verdict.NOT_APPLICABLE: "-",
    Verdict.UNAVAILABLE: "not run",
}

INTRODUCTION = """\
# The OMG's interoperability suite, as run

Written by `python -m multiproc_tests.omg` (`make interop`), which plays the cases of the
[suite](https://github.com/omg-dds/dds-rtps) with its numbers of samples and its patience, each on a loopback of its
own (and once more, by itself, if it failed among others); [shape_main](../shape_main.md) has the options. Columns are
*publishers to subscribers*. `-`: one of the programs says that it does not support what the case is about. **no** is a
failure; a plain no is a limit of the other implementation, and is explained below.
"""


def write_report(outcomes: Sequence[Outcome], folder: Path) -> None:
    """Writes both files into the folder, which is made if need be."""
    folder.mkdir(parents=True, exist_ok=True)
    Path(folder, "omg.md").write_text("\n".join(_markdown(outcomes)) + "\n")
    versions = {program.name: {"title": program.title, "version": program.version()} for program in PROGRAMS}
    document = {"programs": versions, "outcomes": [_as_json(outcome) for outcome in outcomes]}
    Path(folder, "omg.json").write_text(json.dumps(document, indent=1) + "\n")


def _as_json(outcome: Outcome) -> dict[str, object]:
    document = asdict(outcome)
    del document["transcript"]  # it has process ids and times in it, and can be had again
    verdict = "not supported" if outcome.verdict is Verdict.NOT_APPLICABLE else outcome.verdict.value
    return {**document, "verdict": verdict, "seconds": round(outcome.seconds, 1)}


def _markdown(outcomes: Sequence[Outcome]) -> Iterable[str]:
    yield INTRODUCTION
    yield "| name | program | version |\n|---|---|---|"
    yield from (f"| {program.name} | {program.title} | {program.version()} |" for program in PROGRAMS)
    pairs = list(dict.fromkeys((outcome.publisher, outcome.subscriber) for outcome in outcomes))
    yield "\n| case | options | expected | " + " | ".join(" to ".join(pair) for pair in pairs) + " |"
    yield "|---" * (len(pairs) + 3) + "|"
    by_place = {(outcome.case, outcome.publisher, outcome.subscriber): outcome for outcome in outcomes}
    for case in CASES:
        played = [by_place.get((case.name, *pair)) for pair in pairs]
        if any(played):
            marks = [MARKS[outcome.verdict if outcome else Verdict.UNAVAILABLE] for outcome in played]
            yield f"| {case} | {_options(case)} | {_expected(case)} | " + " | ".join(marks) + " |"
    for heading, verdict in (("What failed", Verdict.FAILED), ("Known limits of the other", Verdict.KNOWN)):
        chosen = [outcome for outcome in outcomes if outcome.verdict is verdict]
        if chosen:
            yield f"\n## {heading}\n"
        yield from (f"- {entry.case}, {entry.publisher} to {entry.subscriber}: {entry.reason}" for entry in chosen)


def _options(case: SuiteCase) -> str:
    return "<br>".join(f"`{options.removesuffix(' -t Square')}`" for options in case.programs)


def _expected(case: SuiteCase) -> str:
    """The codes; one for all where they are the same."""
    names = list(dict.fromkeys(case.expected))
    return names[0].name if len(names) == 1 else "<br>".join(code.name for code in case.expected)
