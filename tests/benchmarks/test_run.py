"""The harness: turn about, failures kept to their row, and an honest exit status."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import pytest

from benchmarks.__main__ import main, select
from benchmarks.benchmark import OURS, PEER, Benchmark, Better, Figure, Side
from benchmarks.rows import BENCHMARKS
from benchmarks.run import Plan, run_all
from benchmarks.session import Session
from benchmarks.worker import WorkerFailed

# Sides of which we know that they are there, whatever is installed.
US = replace(OURS, distribution="trio")
THEM = replace(US, column="peer", module="nobody")


def benchmark(measured: list[str], *, fails: str = "", sides: tuple[Side, ...] = (US, THEM)) -> Benchmark:
    def measure(side: Side, session: Session) -> Mapping[str, float]:
        measured.append(side.column)
        if side.column == fails:
            raise WorkerFailed("it fell over")
        return {"pace": 2.0 if side.column == "ours" else 4.0, "steps": 10.0}

    return Benchmark("pace", "", (Figure("pace", "us", Better.LOWER),), measure, sides)


def test_sides_are_measured_turn_about() -> None:
    measured: list[str] = []
    report = run_all([benchmark(measured)], Plan(rounds=3))
    assert measured == ["ours", "peer"] * 3
    assert report.rows[0].ratio == 2.0
    assert report.details == {"pace": {"ours": {"steps": [10.0] * 3}, "peer": {"steps": [10.0] * 3}}}
    assert report.failures == []


def test_a_failure_stays_in_its_row_and_is_not_repeated() -> None:
    """The side that failed would fail again after a whole deadline; the other goes on, and so do other rows."""
    measured: list[str] = []
    report = run_all([benchmark(measured, fails="peer"), benchmark(measured)], Plan(rounds=2))
    assert measured == ["ours", "peer", "ours", "ours", "peer", "ours", "peer"]
    assert [row.ratio for row in report.rows] == [None, 2.0]
    assert report.rows[0].sides["ours"].values == (2.0, 2.0)
    assert report.failures == ["pace, peer: it fell over"]


def test_a_missing_peer_is_named_and_no_failure() -> None:
    absent = replace(THEM, distribution="no-such-dds", wanted_version="1.0")
    other = replace(THEM, wanted_version="0.0")
    for side in (absent, other):
        measured: list[str] = []
        report = run_all([benchmark(measured, sides=(US, side))], Plan(rounds=1))
        assert measured == ["ours"]
        assert report.failures == []
        assert len(report.notes) == 1
        assert side.distribution in report.notes[0]


def test_a_measurement_without_its_figure_is_a_failure() -> None:
    def measure(side: Side, session: Session) -> Mapping[str, float]:
        return {}

    figures = (Figure("pace", "us", Better.LOWER),)
    report = run_all([Benchmark("pace", "", figures, measure, (US,))], Plan(rounds=1))
    assert report.failures == ["pace, ours: pace did not measure pace"]


def test_names_choose_one_benchmark_or_a_group() -> None:
    names = [found.name for found in BENCHMARKS]
    assert len(set(names)) == len(names)
    chosen, unknown = select(["throughput", "import", "nonsense"], BENCHMARKS)
    assert [found.name for found in chosen] == [
        name for name in names if name.startswith("throughput/") or name == "import"
    ]
    assert unknown == ["nonsense"]


def test_figures_are_named_once() -> None:
    names = [figure.name for found in BENCHMARKS for figure in found.figures]
    assert len(set(names)) == len(names)


def test_an_unknown_name_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["nonsense"]) == 2
    assert "nonsense" in capsys.readouterr().err


def test_list_names_everything(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--list"]) == 0
    assert [line.split()[0] for line in capsys.readouterr().out.splitlines()] == [found.name for found in BENCHMARKS]


def test_the_peer_is_what_the_project_installs() -> None:
    assert (PEER.distribution, PEER.wanted_version) == ("cyclonedds", "11.0.1")
