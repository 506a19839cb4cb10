"""``python -m multiproc_tests.interop``: every case with every pair of peers; writes ``docs/interop/``.

``--ours`` leaves out the pairs of which neither is ours, ``--case`` and ``--peer`` choose; a run that chooses prints
its results, and writes them where ``--output`` says.  The exit status is the number of unexpected failures, at most
100.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence
from fnmatch import fnmatchcase
from pathlib import Path

import trio

from .framework import Unavailable
from .matrix import ALL_CASES, Case, Outcome, Verdict, find_case, run_case
from .matrix.report import write_report
from .peers.catalogue import OURS, PEERS
from .peers.peer import Peer

__all__ = ["main"]

RESULTS = Path(__file__).resolve().parents[1] / "docs" / "interop"


def main(words: Sequence[str] | None = None) -> int:
    arguments = _parse(words)
    peers = [peer for peer in PEERS if not arguments.peer or peer.name in arguments.peer]
    cases = _chosen(arguments.case)
    pairs = [(a, b) for a in peers for b in peers if not arguments.ours or OURS in (a, b)]
    for peer in peers:
        _announce(peer)
    outcomes = trio.run(_run_all, cases, pairs, arguments)
    if arguments.output is not None or not (arguments.peer or arguments.case or arguments.ours):
        folder = arguments.output or RESULTS
        write_report(outcomes, peers, folder)
        print(f"written: {folder}")
    failures = [outcome for outcome in outcomes if outcome.verdict is Verdict.FAILED]
    for outcome in failures:
        print(f"\n{outcome.case}, {outcome.publisher} to {outcome.subscriber}: {outcome.reason}\n{outcome.transcript}")
    counts = {verdict: sum(outcome.verdict is verdict for outcome in outcomes) for verdict in Verdict}
    print(", ".join(f"{count} {verdict.value}" for verdict, count in counts.items() if count))
    missing = counts[Verdict.UNAVAILABLE] if os.environ.get("DDSI_REQUIRE_PEERS") == "1" else 0
    return min(100, len(failures) + missing)


def _chosen(patterns: Sequence[str]) -> list[Case]:
    """All cases, or those that the patterns name.  A pattern that names none is an error."""
    if not patterns:
        return list(ALL_CASES)
    found = {pattern: [case for case in ALL_CASES if fnmatchcase(case.name, pattern)] for pattern in patterns}
    for pattern, cases in found.items():
        if not cases:
            find_case(pattern)
    return [case for case in ALL_CASES if any(case in cases for cases in found.values())]


def _parse(words: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m multiproc_tests.interop", description=__doc__)
    parser.add_argument(
        "--case",
        action="append",
        default=[],
        metavar="NAME",
        help="only this, or all that a pattern fits; may be repeated",
    )
    parser.add_argument("--peer", action="append", default=[], metavar="NAME", help="only between these peers")
    parser.add_argument("--ours", action="store_true", help="only pairs with ours in them")
    parser.add_argument("--jobs", type=int, default=2, help="cases played at a time (default: 2)")
    parser.add_argument("--output", type=Path, help="folder of the results (default: docs/interop, for a whole run)")
    parser.add_argument("--captures", type=Path, metavar="FOLDER", help="keep a capture of each case there")
    parser.add_argument("-v", "--verbose", action="store_true", help="the transcripts of known limits too")
    return parser.parse_args(words)


def _announce(peer: Peer) -> None:
    try:
        peer.locate()
    except Unavailable as error:
        print(f"{peer.name:10} unavailable: {error}")
    else:
        print(f"{peer.name:10} {peer.title} {peer.version()}")


async def _run_all(
    cases: Sequence[Case], pairs: Sequence[tuple[Peer, Peer]], arguments: argparse.Namespace
) -> list[Outcome]:
    outcomes: dict[tuple[int, int], Outcome] = {}
    places = trio.CapacityLimiter(arguments.jobs)

    async def run_one(key: tuple[int, int], case: Case, publisher: Peer, subscriber: Peer) -> None:
        async with places:
            outcome = outcomes[key] = await run_case(case, publisher, subscriber, captures=arguments.captures)
        if outcome.verdict is not Verdict.NOT_APPLICABLE:
            names = f"{outcome.case:20} {outcome.publisher:>10} to {outcome.subscriber:10}"
            print(f"{names} {outcome.verdict.value:12} {outcome.seconds:5.1f} s  {outcome.reason}", flush=True)
        if arguments.verbose and outcome.verdict is Verdict.KNOWN:
            print(outcome.transcript)

    async with trio.open_nursery() as nursery:
        for row, case in enumerate(cases):
            for column, (publisher, subscriber) in enumerate(pairs):
                nursery.start_soon(run_one, (row, column), case, publisher, subscriber)
    return [outcome for _, outcome in sorted(outcomes.items())]


if __name__ == "__main__":
    sys.exit(main())
