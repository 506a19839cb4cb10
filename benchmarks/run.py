"""Run: every benchmark on every side, turn about, for several rounds.  What fails is kept to its side of its row."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from importlib import metadata

from .benchmark import Benchmark, Side
from .session import Session
from .summary import Row, summarise
from .worker import WorkerFailed

__all__ = ["Plan", "Report", "run_all"]

_LONG_DEADLINE_S = 1800.0


@dataclass(frozen=True, slots=True)
class Plan:
    """``rounds``: how often each side is measured.  ``scale`` and ``deadline_s``: see Session."""

    rounds: int = 5
    scale: float = 1.0
    deadline_s: float = 60.0


@dataclass(slots=True)
class Report:
    """``details``: per benchmark and column, what was measured beside the figures, a value a round."""

    rows: list[Row] = field(default_factory=list)
    details: dict[str, dict[str, dict[str, list[float]]]] = field(default_factory=dict)
    failures: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


def run_all(benchmarks: Sequence[Benchmark], plan: Plan, *, on_row: Callable[[Row], None] = lambda row: None) -> Report:
    """Measure them in order.  ``on_row`` is told of each row as soon as it stands."""
    report = Report()
    for benchmark in benchmarks:
        for row in _run(benchmark, plan, report):
            report.rows.append(row)
            on_row(row)
    return report


def _run(benchmark: Benchmark, plan: Plan, report: Report) -> list[Row]:
    measured: dict[str, list[dict[str, float]]] = {}
    notes: list[str] = []
    sides: list[Side] = []
    for side in benchmark.sides:
        note = _absence(side)
        if note is None:
            sides.append(side)
            measured[side.column] = []
        else:
            notes.append(note)
            if note not in report.notes:
                report.notes.append(note)
    deadline_s = max(plan.deadline_s, _LONG_DEADLINE_S) if benchmark.is_long else plan.deadline_s
    for _ in range(1 if benchmark.is_long else plan.rounds):
        for side in list(sides):
            try:
                with Session(scale=plan.scale, deadline_s=deadline_s) as session:
                    values = dict(benchmark.measure(side, session))
                _check_complete(benchmark, values)
            except WorkerFailed as error:
                # It would most likely fail in every round, each time after the whole deadline.
                sides.remove(side)
                failure = f"{benchmark.name}, {side.column}: {error}"
                report.failures.append(failure)
                notes.append(failure)
            else:
                measured[side.column].append(values)
    _keep_details(benchmark, measured, report)
    return [
        summarise(
            figure,
            {column: [values[figure.name] for values in rounds] for column, rounds in measured.items()},
            tuple(notes),
        )
        for figure in benchmark.figures
    ]


def _absence(side: Side) -> str | None:
    """Why a side cannot be measured; None if it can."""
    missing = [program for program in side.programs if shutil.which(program) is None]
    if missing:
        return f"{side.module.rpartition('.')[2]} needs {' and '.join(missing)}; its column stays empty"
    if not side.distribution:
        return None
    try:
        version = metadata.version(side.distribution)
    except metadata.PackageNotFoundError:
        return f"{side.distribution} {side.wanted_version} is not installed; its column stays empty".replace("  ", " ")
    if side.wanted_version and version != side.wanted_version:
        return f"{side.distribution} is {version}, and the comparison is with {side.wanted_version}; left out"
    return None


def _check_complete(benchmark: Benchmark, values: dict[str, float]) -> None:
    missing = [figure.name for figure in benchmark.figures if figure.name not in values]
    if missing:
        raise WorkerFailed(f"{benchmark.name} did not measure {', '.join(missing)}")


def _keep_details(benchmark: Benchmark, measured: dict[str, list[dict[str, float]]], report: Report) -> None:
    names = {figure.name for figure in benchmark.figures}
    details: dict[str, dict[str, list[float]]] = {}
    for column, rounds in measured.items():
        for values in rounds:
            for name, value in values.items():
                if name not in names:
                    details.setdefault(column, {}).setdefault(name, []).append(value)
    if details:
        report.details[benchmark.name] = details
