"""The results of a whole run as a table for people and as JSON for programs."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from dataclasses import asdict
from pathlib import Path

from ..peers.catalogue import OURS
from ..peers.peer import Peer
from .cases import CASES, Case
from .outcome import Outcome, Verdict
from .refusals import REFUSAL_CASES
from .secured import SECURED_CASES

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


SECURED_INTRODUCTION = """\
# Secured interoperability, as run

Written by `python -m multiproc_tests.interop` (`make interop`). Columns are *publisher to subscriber*. The publisher
of a case is alice, whose GUID is the lower one and who begins the handshake; in a case called *reversed* the subscriber
is. **yes** means that every sample arrived and was acknowledged, and that a capture of the run shows what the
governance asks for: the kinds of transformation that it names at each level, a MAC for each receiver where the origin
is authenticated, nothing of users' endpoints and of discovery in clear that should not be, and no sample that could be
read where anything encrypts it. In the cases called *refused*, **yes** means that nothing arrived and that each side
said why, where it has words for it. **no** is a failure; a plain no is a limit of an implementation of others, and is
explained below.
"""


def write_report(outcomes: Sequence[Outcome], peers: Sequence[Peer], folder: Path) -> None:
    """Writes ``results`` and ``secured``, each as ``.md`` and ``.json``, into the folder, which is made if need be.

    Of which cases there are no outcomes, nothing is written.
    """
    folder.mkdir(parents=True, exist_ok=True)
    for name, introduction, cases in (
        ("results", INTRODUCTION, CASES),
        ("secured", SECURED_INTRODUCTION, (*SECURED_CASES, *REFUSAL_CASES)),
    ):
        names = {case.name for case in cases}
        chosen = [outcome for outcome in outcomes if outcome.case in names]
        played = [outcome for outcome in chosen if outcome.verdict is not Verdict.NOT_APPLICABLE]
        present = {peer for outcome in played for peer in (outcome.publisher, outcome.subscriber)}
        who = [peer for peer in peers if peer.name in present]
        if played:
            versions = {peer.name: {"title": peer.title, "version": peer.version()} for peer in who}
            document = {"peers": versions, "outcomes": [_as_json(outcome) for outcome in played]}
            Path(folder, f"{name}.json").write_text(json.dumps(document, indent=1) + "\n")
            lines = _markdown(introduction, cases, chosen, who)
            Path(folder, f"{name}.md").write_text("\n".join(lines) + "\n")


def _as_json(outcome: Outcome) -> dict[str, object]:
    document = asdict(outcome)
    del document["transcript"]  # it has process ids and times in it, and can be had again
    return {**document, "verdict": outcome.verdict.value, "seconds": round(outcome.seconds, 1)}


def _markdown(
    introduction: str, cases: Sequence[Case], outcomes: Sequence[Outcome], peers: Sequence[Peer]
) -> Iterable[str]:
    yield introduction
    yield "| name | implementation | version |\n|---|---|---|"
    yield from (f"| {peer.name} | {peer.title} | {peer.version()} |" for peer in peers)
    pairs = list(
        dict.fromkeys(
            (outcome.publisher, outcome.subscriber)
            for outcome in outcomes
            if outcome.verdict is not Verdict.NOT_APPLICABLE
        )
    )
    yield "\n## Ours with everybody\n"
    yield from _table(outcomes, [pair for pair in pairs if OURS.name in pair])
    if foreign := [pair for pair in pairs if OURS.name not in pair]:
        yield "\n## The others among themselves\n"
        yield from _table(outcomes, foreign)
        yield from _in_their_place(outcomes)
    yield "\n## The cases\n"
    yield from (f"- **{case.name}**: {case.claim}." for case in cases if not case.name.endswith("-reversed"))
    yield from _reasons("What failed", outcomes, Verdict.FAILED)
    yield from _reasons("Known limits of the others", outcomes, Verdict.KNOWN)


def _in_their_place(outcomes: Sequence[Outcome]) -> Iterable[str]:
    """Is what two of the others manage, or one with itself, managed with ours in the place of either?"""
    passed = {(o.case, o.publisher, o.subscriber) for o in outcomes if o.verdict is Verdict.PASSED}
    managed = [one for one in passed if OURS.name not in one[1:]]
    replaced = {one for case, pub, sub in managed for one in ((case, pub, OURS.name), (case, OURS.name, sub))}
    lacking = sorted(replaced - passed)
    yield (
        f"\nThe others manage {len(managed)} of these. With ours in the place of the one or of the other, that makes "
        f"{len(replaced)} different plays, of which {len(replaced) - len(lacking)} pass."
    )
    yield from (f"- {case}, {publisher} to {subscriber}: not with ours." for case, publisher, subscriber in lacking)


def _table(outcomes: Sequence[Outcome], pairs: Sequence[tuple[str, str]]) -> Iterable[str]:
    by_place = {(outcome.case, outcome.publisher, outcome.subscriber): outcome for outcome in outcomes}
    yield "| case | " + " | ".join(f"{publisher} to {subscriber}" for publisher, subscriber in pairs) + " |"
    yield "|---" * (len(pairs) + 1) + "|"
    for case in dict.fromkeys(outcome.case for outcome in outcomes):
        played = [by_place.get((case, *pair)) for pair in pairs]
        if any(outcome is not None and outcome.verdict is not Verdict.NOT_APPLICABLE for outcome in played):
            marks = [MARKS[outcome.verdict if outcome else Verdict.UNAVAILABLE] for outcome in played]
            yield f"| {case} | " + " | ".join(marks) + " |"


def _reasons(heading: str, outcomes: Sequence[Outcome], verdict: Verdict) -> Iterable[str]:
    """Each reason once for each pair, with the cases that it holds for."""
    cases: dict[tuple[str, str, str], list[str]] = {}
    for outcome in outcomes:
        if outcome.verdict is verdict:
            cases.setdefault((outcome.publisher, outcome.subscriber, outcome.reason), []).append(outcome.case)
    if cases:
        yield f"\n## {heading}\n"
    for (publisher, subscriber, reason), names in cases.items():
        yield f"- {publisher} to {subscriber}: {reason}. In {', '.join(names)}"
