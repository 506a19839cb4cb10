"""``python -m benchmarks [--json FILE] [--list] [--rounds N] [NAME ...]``

The status is 0 when all was measured, 1 when something failed (the other rows are there all the same), 2 when it was
called wrongly.  A peer that is not installed is no failure.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path

from .benchmark import Benchmark
from .machine import describe_machine
from .report import as_json, detail_lines, head_line, list_lines, machine_line, row_line
from .rows import BENCHMARKS
from .run import Plan, run_all
from .summary import Row


def main(arguments: Sequence[str] | None = None) -> int:
    options = _parser().parse_args(arguments)
    if options.list:
        print("\n".join(list_lines(BENCHMARKS)))
        return 0
    chosen, unknown = select(options.names, BENCHMARKS)
    if unknown:
        print(f"there is no benchmark {', '.join(unknown)}; --list names them", file=sys.stderr)
        return 2
    machine = describe_machine()
    plan = Plan(rounds=options.rounds, scale=options.scale, deadline_s=options.deadline)
    print(machine_line(machine))
    print(head_line(), flush=True)
    report = run_all(chosen, plan, on_row=_print_row)
    if options.details:
        print("\n".join(detail_lines(report)))
    for note in report.notes:
        print(f"note: {note}")
    for failure in report.failures:
        print(f"FAILED: {failure}", file=sys.stderr)
    if options.json is not None:
        text = json.dumps(as_json(report, plan, machine), indent=2)
        options.json.write_text(text + "\n", encoding="utf-8")
    return 1 if report.failures else 0


def select(names: Sequence[str], benchmarks: Sequence[Benchmark]) -> tuple[list[Benchmark], list[str]]:
    """The benchmarks of these names, or below one of them (``throughput`` for ``throughput/shape``); none: all.

    Returns them in their own order, and the names that fit nothing.
    """
    if not names:
        return list(benchmarks), []

    def fits(benchmark: Benchmark, name: str) -> bool:
        return benchmark.name == name or benchmark.name.startswith(name.rstrip("/") + "/")

    unknown = [name for name in names if not any(fits(benchmark, name) for benchmark in benchmarks)]
    return [benchmark for benchmark in benchmarks if any(fits(benchmark, name) for name in names)], unknown


def _print_row(row: Row) -> None:
    print(row_line(row), flush=True)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description="This stack beside the C-backed binding.")
    parser.add_argument("names", nargs="*", metavar="NAME", help="benchmarks, or the first part of their names; all")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write everything that was measured there")
    parser.add_argument("--list", action="store_true", help="name the benchmarks and end")
    parser.add_argument("--rounds", type=_positive, default=5, metavar="N", help="measure each side N times (5)")
    parser.add_argument("--scale", type=float, default=1.0, help="multiply the numbers of samples (1)")
    parser.add_argument("--deadline", type=float, default=60.0, metavar="S", help="seconds for one measurement (60)")
    parser.add_argument("--details", action="store_true", help="print what else was measured, processor time foremost")
    return parser


def _positive(text: str) -> int:
    number = int(text)
    if number < 1:
        raise argparse.ArgumentTypeError("at least 1")
    return number


if __name__ == "__main__":
    sys.exit(main())
