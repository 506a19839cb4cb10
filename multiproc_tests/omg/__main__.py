"""``python -m multiproc_tests.omg``: the suite's cases, ours with ours and with the other, both ways round.

Without a choice everything is played and ``docs/interop/omg.md`` is written.  What failed is played once more at the
end, by itself.  The exit status is the number of unexpected failures, at most 100.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence
from fnmatch import fnmatchcase
from pathlib import Path

import trio

from ..matrix.outcome import Outcome, Verdict
from .cases import CASES, SuiteCase, find_case
from .play import FULL, QUICK, run_case
from .programs import OURS, PROGRAMS, ShapeMain
from .report import write_report

RESULTS = Path(__file__).resolve().parents[2] / "docs" / "interop"


def main(words: Sequence[str] | None = None) -> int:
    """Play, print, write; returns the exit status."""
    arguments = _parse(words)
    cases = _chosen(arguments.case)
    pairs = [(a, b) for a in PROGRAMS for b in PROGRAMS if OURS in (a, b) or arguments.all]
    if arguments.pair:
        pairs = [pair for pair in pairs if f"{pair[0]}-{pair[1]}" in arguments.pair]
    outcomes = trio.run(_run_all, cases, pairs, arguments)
    is_whole = not (arguments.case or arguments.pair or arguments.quick)
    if arguments.output is not None or is_whole:
        write_report(outcomes, arguments.output or RESULTS)
    failures = [outcome for outcome in outcomes if _failed(outcome)]
    for outcome in failures:
        print(f"\n{outcome.case}, {outcome.publisher} to {outcome.subscriber}: {outcome.reason}\n{outcome.transcript}")
    counts = {verdict: sum(outcome.verdict is verdict for outcome in outcomes) for verdict in Verdict}
    print(", ".join(f"{count} {verdict.value}" for verdict, count in counts.items() if count))
    missing = counts[Verdict.UNAVAILABLE] if os.environ.get("DDSI_REQUIRE_PEERS") == "1" else 0
    return min(100, len(failures) + missing)


def _parse(words: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m multiproc_tests.omg", description=__doc__)
    parser.add_argument("--case", action="append", default=[], metavar="NAME", help="only this, or what a pattern fits")
    parser.add_argument("--pair", action="append", default=[], metavar="PUB-SUB", help="only these, as in ddsi-cyclone")
    parser.add_argument("--all", action="store_true", help="the other with itself too")
    parser.add_argument("--quick", action="store_true", help="fewer samples, less patience")
    parser.add_argument("--jobs", type=int, default=4, help="cases played at a time (default: 4; they mostly wait)")
    parser.add_argument("--output", type=Path, help="folder of the results (default: docs/interop, for a whole run)")
    return parser.parse_args(words)


def _chosen(patterns: Sequence[str]) -> list[SuiteCase]:
    for pattern in patterns:
        if not any(fnmatchcase(case.name, pattern) for case in CASES):
            find_case(pattern)
    return [case for case in CASES if not patterns or any(fnmatchcase(case.name, pattern) for pattern in patterns)]


async def _run_all(
    cases: Sequence[SuiteCase], pairs: Sequence[tuple[ShapeMain, ShapeMain]], arguments: argparse.Namespace
) -> list[Outcome]:
    plays = [(case, *pair) for case in cases for pair in pairs]
    outcomes: dict[int, Outcome] = {}
    waiting = iter(list(enumerate(plays)))
    effort = QUICK if arguments.quick else FULL

    async def play_what_waits() -> None:
        for number, (case, publisher, subscriber) in waiting:
            outcome = outcomes[number] = await run_case(case, publisher, subscriber, effort)
            names = f"{outcome.case:22} {outcome.publisher:>8} to {outcome.subscriber:8}"
            print(f"{names} {outcome.verdict.value:14} {outcome.seconds:6.1f} s  {outcome.reason}", flush=True)

    async with trio.open_nursery() as nursery:
        for _ in range(arguments.jobs):
            nursery.start_soon(play_what_waits)
    # Once more, one at a time: a case that counts milliseconds fails when the machine has too much else to do.
    waiting = iter([(number, plays[number]) for number, outcome in sorted(outcomes.items()) if _failed(outcome)])
    await play_what_waits()
    return [outcome for _, outcome in sorted(outcomes.items())]


def _failed(outcome: Outcome) -> bool:
    return outcome.verdict is Verdict.FAILED


if __name__ == "__main__":
    sys.exit(main())
