"""Rows of every theme run on our side, with hardly any samples.  No figure is looked at: speed is not tested."""

from __future__ import annotations

import json
import shutil
from importlib import util
from pathlib import Path

import pytest

import ddsi
from benchmarks.__main__ import main
from benchmarks.benchmark import PEER, SECURED_PEER, Benchmark
from benchmarks.rows import BENCHMARKS
from benchmarks.session import Session
from benchmarks.sides import ours_codec
from benchmarks.sides.cyclone_secured import FIRST_SAMPLE

# One or two of each theme; the others differ from them in size alone.
LEFT_OUT = {
    f"{role}/{size}" for role in ("serialise", "deserialise", "throughput") for size in ("1KiB", "16KiB", "64KiB")
} | {"deserialise/shape", "serialise/1MiB"}
LEFT_OUT |= {f"{role}/{name}" for role in ("serialise", "deserialise") for name in ("structs", "named-structs")}
LEFT_OUT |= {benchmark.name for benchmark in BENCHMARKS if benchmark.name.startswith(("protect/", "secured/"))} - {
    "protect/payload/encrypt/64B",
    "protect/submessage/sign/63KiB",
    "protect/message/encrypt-origin/1KiB",
    "secured/round-trip/payload",
    "secured/throughput/64KiB/all",
    "secured/first-sample",
}
LEFT_OUT |= {"filters/1", "filters/32", "discovery/10", "discovery/50", "discovery/200"}
ROWS = [benchmark for benchmark in BENCHMARKS if benchmark.name not in LEFT_OUT]

has_secured_peer = (
    all(shutil.which(program) for program in SECURED_PEER.programs) and Path(FIRST_SAMPLE.header).exists()
)
has_peer = pytest.mark.skipif(util.find_spec("cyclonedds") is None, reason="cyclonedds is not installed")


@pytest.mark.slow
@pytest.mark.parametrize("benchmark", ROWS, ids=lambda found: found.name)
def test_rows_measure_us(benchmark: Benchmark) -> None:
    with Session(scale=0.002, deadline_s=120) as session:
        measured = benchmark.measure(benchmark.sides[0], session)
    # What protection adds may be less than what the machine's moods do.
    assert all(measured[figure.name] > 0 for figure in benchmark.figures if figure.unit != "us/layer")


@pytest.mark.slow
@pytest.mark.peers
@has_peer
@pytest.mark.parametrize("name", ["throughput/1KiB", "round-trip", "matched"])
def test_rows_measure_the_peer(name: str) -> None:
    benchmark = next(found for found in BENCHMARKS if found.name == name)
    with Session(scale=0.002, deadline_s=120) as session:
        measured = benchmark.measure(PEER, session)
    assert all(measured[figure.name] > 0 for figure in benchmark.figures)


@pytest.mark.slow
@pytest.mark.peers
@pytest.mark.skipif(not has_secured_peer, reason="the secured peer cannot be built here")
def test_the_secured_peer_has_its_first_sample() -> None:
    benchmark = next(found for found in BENCHMARKS if found.name == "secured/first-sample")
    with Session(scale=1, deadline_s=60) as session:
        assert benchmark.measure(SECURED_PEER, session)["secured/first-sample"] > 0


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
@pytest.mark.parametrize("name", ours_codec.SAMPLES)
def test_both_sides_write_the_same_octets(name: str) -> None:
    """Else the comparison would be of different work."""
    from benchmarks.sides import cyclone_codec

    mine = ddsi.serialize(ours_codec.SAMPLES[name](), representation=ours_codec.representation_of(name))
    theirs = bytes(cyclone_codec.SAMPLES[name]().serialize())
    assert mine == theirs
