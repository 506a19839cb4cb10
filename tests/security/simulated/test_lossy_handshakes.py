"""Handshakes whose messages travel in many fragments over links that lose a quarter of them.

Best effort repairs nothing, so a message of eight fragments comes whole once in fourteen times.  If nothing but
repetitions helped, half of these lives would take half a minute, and the longest two.
"""

from __future__ import annotations

import pytest

from ddsi.behavior.stateless_reader import StatelessReader
from ddsi.behavior.writer_proxy import WriterProxy
from ddsi.simulation import Domain
from ddsi.simulation.link import LinkConditions
from ddsi.structure.cache_change import CacheChange
from ddsi.structure.qos_policies import Properties
from ddsi_security import handshake
from ddsi_security.handshake import TRANSITIONS, Event, State

from .keystores import make_identities

SEEDS = range(24)
LOSS, SMALL_MESSAGE = 0.28, 600


@pytest.fixture(scope="module")
def identities(tmp_path_factory: pytest.TempPathFactory) -> list[Properties]:
    return make_identities(tmp_path_factory.mktemp("keystore"), "encrypt")


def times(identities: list[Properties], *, restarts: bool = False) -> list[float]:
    """Of each seed how many seconds it takes until both have admitted each other, in ascending order; 100 at most."""
    found = []
    for seed in SEEDS:
        domain = Domain(seed, conditions=LinkConditions(loss=LOSS))
        for properties in identities[:2]:
            domain.node(properties=properties, max_message_octets=SMALL_MESSAGE)
        if restarts:
            domain.run(0.1 + 0.2 * (seed // 2 % 6))
            domain.nodes[seed % 2].restart()
        begun = domain.now
        assert domain.run_until(lambda domain=domain: _are_admitted(domain), 100.0), f"seed {seed}"  # type: ignore[misc]
        found.append(domain.now - begun)
    return sorted(found)


def _are_admitted(domain: Domain) -> bool:
    first, second = domain.nodes
    return all(
        (proxy := node.engine.participants.get(other.guid.prefix)) is not None and proxy.is_admitted
        for node, other in ((first, second), (second, first))
    )


@pytest.mark.parametrize("restarts", [False, True])
def test_fragments_of_two_times_make_up_one_message(restarts: bool, identities: list[Properties]) -> None:
    found = times(identities, restarts=restarts)
    assert found[len(found) // 2] < 3.0
    assert found[-1] < 20.0


def test_peers_that_repeat_only_when_they_are_repeated_to_and_pass_on_no_number_twice_are_not_held_up(
    identities: list[Properties], monkeypatch: pytest.MonkeyPatch
) -> None:
    """As Fast DDS: where its reply was lost it must hear the request again, and under a new number."""
    repeated = (State.AWAIT_FINAL, Event.TIMEOUT)
    others = {case: found for case, found in TRANSITIONS.items() if case != repeated}
    monkeypatch.setattr(handshake, "TRANSITIONS", others)
    passed: dict[WriterProxy, int] = {}

    def receive_data(self: StatelessReader, proxy: WriterProxy, change: CacheChange, now: float) -> int:
        if change.sequence_number > passed.get(proxy, 0):
            passed[proxy] = change.sequence_number
            self.history.add(change, now)
        return 0

    def fragment_received(self: StatelessReader, proxy: WriterProxy, number: int, now: float) -> bool:
        return number > passed.get(proxy, 0)

    monkeypatch.setattr(StatelessReader, "receive_data", receive_data)
    monkeypatch.setattr(StatelessReader, "fragment_received", fragment_received)
    found = times(identities)
    assert passed
    assert found[len(found) // 2] < 5.0
