"""Same seed, same trace, octet for octet: in one process, and in others whose hashes are salted differently."""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys
from pathlib import Path

from ddsi.simulation import Dice
from ddsi.simulation.scenario import Create, Scenario
from ddsi.structure.qos_policies import BestEffort, Reliable
from ddsi.trace.sink import JsonLinesSink

ROOT = Path(__file__).parents[2]
# With restarts, partitions, fragments, filtering writers, slow readers and every kind of weather among them.
SEEDS = (4, 23, 120, 205)


class _Digest:
    """A text stream of which only the hash is kept."""

    def __init__(self) -> None:
        self._hash = hashlib.sha256()

    def write(self, text: str) -> None:
        self._hash.update(text.encode())

    def hexdigest(self) -> str:
        return self._hash.hexdigest()


def trace_digest(seed: int) -> str:
    stream = _Digest()
    Scenario.from_seed(seed).run(JsonLinesSink(stream))
    return stream.hexdigest()


def _digests_in_another_process(hash_seed: str) -> list[str]:
    program = (
        "import sys; sys.path.insert(0, 'tests/simulation'); import test_determinism as t\n"
        "for seed in t.SEEDS: print(t.trace_digest(seed))"
    )
    environment = {**os.environ, "PYTHONHASHSEED": hash_seed, "PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-c", program]
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout.split()


def test_same_seed_same_trace_octet_for_octet() -> None:
    """Whatever the order of sets and hashes may be in a process: the trace does not know it."""
    here = [trace_digest(seed) for seed in SEEDS]
    assert len(set(here)) == len(SEEDS)
    assert _digests_in_another_process("1") == here
    assert _digests_in_another_process("4242") == here


def test_tracing_changes_nothing() -> None:
    """A run that is watched is the same run."""
    for seed in SEEDS[:2]:
        stream = _Digest()
        assert Scenario.from_seed(seed).run() == Scenario.from_seed(seed).run(JsonLinesSink(stream))


def test_dice_are_the_same_on_every_python() -> None:
    """Random.random() and getrandbits() are promised to be stable; these numbers were drawn with Python 3.11."""
    dice = Dice(42)
    assert [dice.below(1000) for _ in range(6)] == [639, 25, 275, 223, 736, 676]
    assert dice.octets(6).hex() == "8b9de465e150"
    assert dice.fork().below(1000) == 470
    assert dice.pick("abcdef") == "c"


def test_what_is_off_draws_nothing() -> None:
    """A feature with probability 0 leaves the rest of the run as it was."""
    one, other = Dice(7), Dice(7)
    assert not one.chance(0.0)
    assert one.chance(1.0)
    assert one.between(0.25, 0.25) == 0.25
    assert one.below(1 << 20) == other.below(1 << 20)


def test_plans_follow_from_the_seed_alone() -> None:
    assert Scenario.from_seed(5) == Scenario.from_seed(5)
    assert Scenario.from_seed(5) != Scenario.from_seed(6)


def test_seeds_cover_every_kind_of_step_and_weather() -> None:
    plans = [Scenario.from_seed(seed) for seed in range(200)]
    kinds = {type(step).__name__ for plan in plans for step in plan.steps}
    assert kinds == {"Create", "Cut", "Delete", "End", "Restart", "Take", "Wait", "Write"}
    assert any(plan.conditions.loss > 0.2 for plan in plans)
    assert any(plan.conditions.reordering and not plan.conditions.loss for plan in plans)
    assert any(plan.conditions.duplication for plan in plans)
    assert any(plan.conditions.delay >= 0.1 for plan in plans)
    assert any(not plan.multicast for plan in plans)
    assert any(len(set(plan.hosts)) < len(plan.hosts) for plan in plans)


def test_seeds_cover_every_kind_of_endpoint() -> None:
    plans = [Scenario.from_seed(seed) for seed in range(200)]
    created = [[step.endpoint for step in plan.steps if isinstance(step, Create)] for plan in plans]
    filtered = [{plan.is_writer for plan in plans if plan.is_filtered} for plans in created]
    assert filtered.count({True, False}) > 20, "a filtering writer and somebody to read it"
    endpoints = [plan for plans in created for plan in plans]
    assert any(not plan.takes and plan.qos.reliability == Reliable() for plan in endpoints)
    assert any(not plan.takes and plan.qos.reliability == BestEffort() for plan in endpoints)
    assert any(plan.is_writer and plan.qos.lifespan is not None for plan in endpoints)
    assert any(plan.is_keyed for plan in endpoints)
    assert any(plan.qos.partition is not None for plan in endpoints)
