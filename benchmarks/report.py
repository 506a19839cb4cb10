"""Report: the table as text, and all that was measured as JSON."""

from __future__ import annotations

import math
from collections.abc import Mapping

from .benchmark import Benchmark
from .run import Plan, Report
from .summary import Row, Values

__all__ = ["as_json", "detail_lines", "head_line", "list_lines", "machine_line", "row_line"]

_COLUMNS = "{:<42} {:<10} {:>11} {:>11} {:>8}  {:<13} {:>6} {:>6} {:>11}"


def machine_line(machine: Mapping[str, str]) -> str:
    versions = ", ".join(f"{name} {machine[name]}" for name in ("ddsi", "cyclonedds", "trio"))
    return (
        f"{machine['processor']}, {machine['cores']} cores, {machine['system']}, {machine['python']}; {versions}; "
        f"load {machine['load']} at the start"
    )


def head_line() -> str:
    return _COLUMNS.format("name", "unit", "ours", "peer", "ratio", "of rounds", "±ours", "±peer", "floor").rstrip()


def row_line(row: Row) -> str:
    """``of rounds``: least and greatest ratio of a single round; ``±``: spread of the rounds, of the median."""
    ours, peer, floor = (row.sides.get(column) for column in ("ours", "peer", "floor"))
    return _COLUMNS.format(
        row.figure.name,
        row.figure.unit,
        _value(ours),
        _value(peer),
        "-" if row.ratio is None else f"{row.ratio:.2f}",
        "-" if row.ratio_low is None or row.ratio_high is None else f"{row.ratio_low:.2f}..{row.ratio_high:.2f}",
        _spread(ours),
        _spread(peer),
        _value(floor),
    ).rstrip()


def detail_lines(report: Report) -> list[str]:
    """Medians of what was measured beside the figures."""
    return [
        f"  {name} {column}: "
        + ", ".join(f"{key} {_number(Values(tuple(values)).median)}" for key, values in by_key.items())
        for name, columns in report.details.items()
        for column, by_key in columns.items()
    ]


def list_lines(benchmarks: tuple[Benchmark, ...]) -> list[str]:
    return [f"{benchmark.name:<36} {benchmark.summary}" for benchmark in benchmarks]


def as_json(report: Report, plan: Plan, machine: Mapping[str, str]) -> dict[str, object]:
    return {
        "machine": dict(machine),
        "rounds": plan.rounds,
        "scale": plan.scale,
        "rows": [_row_as_json(row) for row in report.rows],
        "details": report.details,
        "notes": report.notes,
        "failures": report.failures,
    }


def _row_as_json(row: Row) -> dict[str, object]:
    return {
        "name": row.figure.name,
        "unit": row.figure.unit,
        "better": row.figure.better.value,
        "ratio": row.ratio,
        "ratio_of_rounds": [row.ratio_low, row.ratio_high],
        "notes": list(row.notes),
        **{
            column: {"median": side.median, "spread": side.spread, "values": list(side.values)}
            for column, side in row.sides.items()
        },
    }


def _value(side: Values | None) -> str:
    return "-" if side is None else _number(side.median)


def _spread(side: Values | None) -> str:
    return "-" if side is None else f"{side.spread:.0%}"


def _number(value: float) -> str:
    """Four figures that count, and no exponent."""
    if value == 0 or not math.isfinite(value):
        return f"{value:g}"
    decimals = max(3 - math.floor(math.log10(abs(value))), 0)
    return f"{value:,.{decimals}f}"
