"""Medians, spreads and ratios are what the table claims."""

from __future__ import annotations

import pytest

from benchmarks.benchmark import Better, Figure
from benchmarks.report import head_line, row_line
from benchmarks.summary import summarise

SAMPLES = Figure("throughput/shape", "samples/s", Better.HIGHER)
TIME = Figure("round-trip/median", "us", Better.LOWER)


def test_ratio_is_above_one_when_we_are_better_whichever_way_is_good() -> None:
    faster = summarise(SAMPLES, {"ours": [300.0], "peer": [100.0]})
    quicker = summarise(TIME, {"ours": [100.0], "peer": [300.0]})
    assert faster.ratio == quicker.ratio == pytest.approx(3.0)
    assert summarise(TIME, {"ours": [200.0], "peer": [100.0]}).ratio == pytest.approx(0.5)


def test_spread_and_ratios_of_rounds_show_how_steady_it_was() -> None:
    row = summarise(SAMPLES, {"ours": [90.0, 100.0, 120.0], "peer": [100.0, 50.0, 40.0]})
    assert row.sides["ours"].median == 100.0
    assert row.sides["ours"].spread == pytest.approx(0.3)
    assert row.ratio == pytest.approx(2.0)
    assert row.ratio_low == pytest.approx(0.9)
    assert row.ratio_high == pytest.approx(3.0)


def test_a_side_that_was_not_measured_leaves_a_dash_and_no_ratio() -> None:
    row = summarise(TIME, {"ours": [123.4], "peer": []})
    assert row.ratio is None
    assert row_line(row).split() == ["round-trip/median", "us", "123.4", "-", "-", "-", "0%", "-", "-"]


def test_columns_stand_under_their_names() -> None:
    row = summarise(TIME, {"ours": [1.0], "peer": [2.0], "floor": [0.5]})
    head, line = head_line(), row_line(row)
    for name, value in {"ours": "1.000", "peer": "2.000", "ratio": "2.00 ", "floor": "0.5000"}.items():
        assert head.index(name) + len(name) == line.index(f" {value}") + 1 + len(value.strip())
