"""Rows of every theme run on our side, with hardly any samples.  No figure is looked at: speed is not tested."""

from __future__ import annotations

import json
from importlib import util
from pathlib import Path

import pytest

import ddsi
from benchmarks.__main__ import main
from benchmarks.benchmark import FLOOR, OURS, PEER, Benchmark
from benchmarks.rows import BENCHMARKS
from benchmarks.session import Session
from benchmarks.sides import ours

# One or two of each theme; the others differ from them in size alone.
LEFT_OUT = {
    f"{role}/{size}" for role in ("serialise", "deserialise", "throughput") for size in ("1KiB", "16KiB", "64KiB")
} | {"deserialise/shape", "serialise/1MiB"}
LEFT_OUT |= {benchmark.name for benchmark in BENCHMARKS if benchmark.name.startswith("protect/")} - {
    "protect/payload/encrypt/64B",
    "protect/submessage/sign/63KiB",
    "protect/message/encrypt-origin/1KiB",
}
ROWS = [benchmark for benchmark in BENCHMARKS if benchmark.name not in LEFT_OUT]

has_peer = pytest.mark.skipif(util.find_spec("cyclonedds") is None, reason="cyclonedds is not installed")


@pytest.mark.slow
@pytest.mark.parametrize("benchmark", ROWS, ids=lambda found: found.name)
def test_rows_measure_us(benchmark: Benchmark) -> None:
    side = OURS if OURS in benchmark.sides else FLOOR
    with Session(scale=0.002, deadline_s=30) as session:
        measured = benchmark.measure(side, session)
    assert all(measured[figure.name] > 0 for figure in benchmark.figures)


@pytest.mark.slow
@pytest.mark.peers
@has_peer
@pytest.mark.parametrize("name", ["throughput/1KiB", "round-trip", "matched"])
def test_rows_measure_the_peer(name: str) -> None:
    benchmark = next(found for found in BENCHMARKS if found.name == name)
    with Session(scale=0.002, deadline_s=30) as session:
        measured = benchmark.measure(PEER, session)
    assert all(measured[figure.name] > 0 for figure in benchmark.figures)


@pytest.mark.slow
def test_a_run_is_written_as_json(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "figures.json"
    assert main(["serialise/shape", "--rounds", "2", "--scale", "0.001", "--json", str(file)]) == 0
    written = json.loads(file.read_text(encoding="utf-8"))
    assert [row["name"] for row in written["rows"]] == ["serialise/shape"]
    assert len(written["rows"][0]["ours"]["values"]) == 2
    assert written["rounds"] == 2
    assert "serialise/shape" in capsys.readouterr().out


@pytest.mark.peers
@has_peer
@pytest.mark.parametrize("octets", [0, 5, 1024])
def test_both_sides_write_the_same_octets(octets: int) -> None:
    """Else the comparison would be of different work."""
    from benchmarks.sides import cyclone

    mine = ddsi.serialize(ours.maker_of(octets)(7), representation=ddsi.XCDR1)
    theirs = bytes(cyclone.maker_of(octets)(7).serialize())
    # The options octet holds the number of padding octets at the end, which only we set (RTPS 2.5 §10.2).
    assert mine[:3] + mine[4:] == theirs[:3] + theirs[4:]
