"""Random lives of secured domains: the invariants of the plain ones, and that nobody without keys learns or repeats.

Each seed has one governance, so that all ways of protecting meet all weathers.
"""

from __future__ import annotations

import itertools
from pathlib import Path

import pytest

from ddsi.simulation import Domain
from ddsi.simulation.scenario import Scenario
from ddsi.structure.qos import Qos
from ddsi.structure.qos_policies import KeepAll, Properties, Reliable, TransientLocal
from ddsi.trace.reasons import LossReason

from .keystores import GOVERNANCES, make_identities
from .watch import Watch

SEEDS = 320
SHARD = 16
RELIABLE = Qos(reliability=Reliable(), history=KeepAll(), durability=TransientLocal())
HIDES_PAYLOAD = [
    name
    for name, draft in GOVERNANCES.items()
    if any("ENCRYPT" in kind for kind in (draft.rtps, draft.metadata, draft.data))
]
HIDES_TOPICS = [name for name, draft in GOVERNANCES.items() if "ENCRYPT" in draft.discovery]


@pytest.fixture(scope="module")
def identities(tmp_path_factory: pytest.TempPathFactory) -> dict[str, list[Properties]]:
    folder: Path = tmp_path_factory.mktemp("keystores")
    return {name: make_identities(folder / name, name) for name in GOVERNANCES}


@pytest.mark.parametrize(
    "start",
    [pytest.param(start, marks=[pytest.mark.slow] if start else []) for start in range(0, SEEDS, SHARD)],
)
def test_every_invariant_holds_for_every_seed(start: int, identities: dict[str, list[Properties]]) -> None:
    for seed, governance in zip(range(start, start + SHARD), itertools.cycle(GOVERNANCES), strict=False):
        watch = Watch()
        Scenario.from_seed(seed).run(watch, properties=identities[governance])
        assert watch.nonces or governance in ("nothing", "payload") or len(watch.sent) < 50
        assert not watch.repeated, f"seed {seed}, {governance}"
        if governance in HIDES_TOPICS:
            for topic in (b"Square", b"Circle", b"Triangle"):
                assert not watch.holds(topic), f"seed {seed}, {governance}: {topic!r} is read by anybody"


def secured_pair(identities: list[Properties], watch: Watch, *, seed: int = 1) -> Domain:
    domain = Domain(seed, trace=watch)
    for properties in identities[:2]:
        domain.node(properties=properties)
    return domain


@pytest.mark.parametrize("governance", GOVERNANCES)
@pytest.mark.parametrize("size", [100, 30_000])
def test_samples_arrive_and_are_read_by_nobody_else(
    governance: str, size: int, identities: dict[str, list[Properties]]
) -> None:
    watch = Watch()
    domain = secured_pair(identities[governance], watch)
    writer = domain.nodes[0].writer("Square", RELIABLE)
    reader = domain.nodes[1].reader("Square", RELIABLE)
    written = [writer.write(size) for _ in range(10)]
    assert domain.run_until(lambda: len(reader.taken) == 10, 10.0)
    late = domain.nodes[1].reader("Square", RELIABLE)
    assert domain.run_until(lambda: len(late.taken) == 10, 10.0), "a late joiner gets what is kept"
    payloads = [bytes(change.payload) for change in written if change is not None]
    for payload, (_, received) in zip(payloads, reader.taken, strict=True):
        assert bytes(received.payload)[: len(payload)] == payload  # what follows is padding
    for payload in payloads:
        assert watch.holds(payload[40:80]) is (governance not in HIDES_PAYLOAD)


@pytest.mark.parametrize("governance", ["encrypt", "payload"])
def test_a_restart_of_either_side_is_forgiven(governance: str, identities: dict[str, list[Properties]]) -> None:
    domain = secured_pair(identities[governance], Watch())
    for restarted, other in ((0, 1), (1, 0)):
        domain.run_until(domain.are_introduced, 5.0)
        domain.nodes[restarted].restart()
        writer = domain.nodes[restarted].writer("Square", RELIABLE)
        reader = domain.nodes[other].reader("Square", RELIABLE)
        change = writer.write(100)
        assert change is not None
        assert domain.run_until(lambda reader=reader: len(reader.taken) >= 1, 10.0)  # type: ignore[misc]


@pytest.mark.parametrize("governance", [name for name in GOVERNANCES if name != "nothing"])
@pytest.mark.parametrize("who", ["reader", "writer"])
def test_who_forgot_the_other_finds_it_again_and_gets_nothing_twice(
    who: str, governance: str, identities: dict[str, list[Properties]]
) -> None:
    """A lease runs out on one side only; to the other it looks as if its peer had started again."""
    domain = secured_pair(identities[governance], Watch())
    first, second = domain.nodes
    writer = first.writer("Square", RELIABLE)
    reader = second.reader("Square", RELIABLE)
    writer.write(100)
    assert domain.run_until(lambda: len(reader.taken) == 1, 5.0)
    forgets, forgotten = (second, first) if who == "reader" else (first, second)
    forgets.engine.discovery.participant_lost(forgotten.guid, LossReason.LEASE_EXPIRED, domain.now)
    forgets.pump()
    assert not forgets.engine.participants
    writer.write(100)
    domain.run(10.0)
    assert [change.sequence_number for info, change in reader.taken if info.valid_data] == [1, 2]


def test_the_same_seed_gives_the_same_life(identities: dict[str, list[Properties]]) -> None:
    """Keys, challenges, nonces and signatures follow from the seed too."""
    lives = []
    for _ in range(2):
        recording = Watch()
        Scenario.from_seed(6).run(recording, properties=identities["encrypt"])
        lives.append(recording.sent)
    assert lives[0] == lives[1]
