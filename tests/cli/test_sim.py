"""``ddsi sim``: the same seed says the same; what fails says how to have it again."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from ddsi.cli import main
from ddsi.cli.sim_scenarios import RANDOM, SCENARIOS, NamedScenario
from ddsi.simulation import Domain, LinkConditions
from ddsi.structure.vendor import vendor_name


@pytest.mark.parametrize("name", SCENARIOS)
@pytest.mark.parametrize("seed", range(5))
def test_named_scenarios_hold(name: str, seed: int, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["sim", "--scenario", name, "--seed", str(seed)]) == 0
    assert f"seed {seed}, {name}: " in capsys.readouterr().out


def test_named_scenarios_show_what_they_say(capsys: pytest.CaptureFixture[str]) -> None:
    """Each diagram has in it what its scenario is about."""
    signs = {
        "lossy-link": ["lost (loss)", "ACKNACK", "missing {"],
        "late-joiner": ["DATA Square #1", "delivered Square #5"],
        "fragments": ["DATA_FRAG", "delivered Square #1"],
        "instances": ["disposed Square", "unregistered Square"],
        "restart": ["is killed", "lost A"],
    }
    assert set(signs) == set(SCENARIOS)
    for name, wanted in signs.items():
        assert main(["sim", "--scenario", name, "--seed", "5", "--diagram"]) == 0
        shown = capsys.readouterr().out
        assert [sign for sign in wanted if sign not in shown] == [], name


def test_a_seed_makes_its_own_scenario(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["sim", "--seed", "11"]) == 0
    first = capsys.readouterr().out
    assert main(["sim", "--seed", "11"]) == 0
    assert capsys.readouterr().out == first
    assert first.startswith("seed 11: ")


def test_the_plan_of_a_seed(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["sim", "--seed", "11", "--plan"]) == 0
    assert capsys.readouterr().out.startswith("seed 11: ")
    assert main(["sim", "--scenario", "fragments", "--plan"]) == 2


def test_the_trace_can_be_drawn_later(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """What ``--diagram`` shows and what ``ddsi trace`` makes of the file is the same."""
    path = tmp_path / "sim.jsonl"
    assert main(["sim", "--scenario", "fragments", "--seed", "2", "--trace", str(path), "--diagram"]) == 0
    *drawn, outcome = capsys.readouterr().out.splitlines()
    assert outcome.startswith("seed 2, fragments")
    assert main(["trace", str(path)]) == 0
    assert capsys.readouterr().out.splitlines() == drawn


def test_every_second_participant_may_play_a_vendor(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    trace = tmp_path / "trace.jsonl"
    words = ["sim", "--scenario", "lossy-link", "--seed", "3", "--vendor", "fast-dds"]
    assert main([*words, "--trace", str(trace)]) == 0
    created = [json.loads(line) for line in trace.read_text().splitlines() if "participant_created" in line]
    assert [vendor_name(bytes.fromhex(event["vendor_id"])) for event in created] == ["ddsi", "Fast DDS"]
    assert main(["sim", "--seed", "4", "--count", "2", "--vendor", "opendds", "--json"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert json.loads(lines[-1])["replay"] == "ddsi sim --seed 5 --vendor opendds"
    with pytest.raises(SystemExit):
        main(["sim", "--vendor", "nobody"])
    assert "rustdds" in capsys.readouterr().err


def test_json_and_several_seeds(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["sim", "--seed", "3", "--count", "2", "--json"]) == 0
    first, second = (json.loads(line) for line in capsys.readouterr().out.splitlines())
    assert (first["seed"], second["seed"]) == (3, 4)
    assert first["ok"] is True
    assert first["flaws"] == []
    assert first["replay"] == "ddsi sim --seed 3"
    assert first["scenario"] == "random"


def _broken(domain: Domain) -> list[str]:
    domain.node(name="a")
    return ["the moon is not made of cheese"] if domain.seed == 7 else []


def test_a_seed_that_fails_says_how_to_have_it_again(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    broken = NamedScenario("restart", "", LinkConditions(), _broken)
    monkeypatch.setitem(SCENARIOS, "restart", broken)
    assert main(["sim", "--scenario", "restart", "--seed", "6", "--count", "3"]) == 1
    said = capsys.readouterr()
    assert said.err.splitlines() == [
        "ddsi sim: seed 7 failed; replay it: ddsi sim --seed 7 --scenario restart --diagram",
        "  the moon is not made of cheese",
    ]
    assert [line.split()[1] for line in said.out.splitlines()] == ["6,", "8,"]


def test_the_diagram_of_a_failure_is_drawn_too(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(SCENARIOS, "restart", NamedScenario("restart", "", LinkConditions(), _broken))
    assert main(["sim", "--scenario", "restart", "--seed", "7", "--diagram"]) == 1
    assert "participant created" in capsys.readouterr().out


def test_diagrams_are_of_one_seed(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["sim", "--count", "2", "--diagram"]) == 2
    assert capsys.readouterr().err == "ddsi sim: --diagram and --trace are for one seed\n"


def test_list_names_them_all(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["sim", "--list"]) == 0
    assert [line.split()[0] for line in capsys.readouterr().out.splitlines()] == [RANDOM, *SCENARIOS]
