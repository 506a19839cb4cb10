"""More pairs of endpoints at once than fit into what is kept for them: all match, though it takes longer.

The bounds are made small here, so that few endpoints do.  DDS-Security 1.1 §8.8.9.
"""

from __future__ import annotations

import pytest

from ddsi.behavior import filtering_writer
from ddsi.simulation import Domain, LinkConditions
from ddsi.structure.qos import Qos
from ddsi.structure.qos_policies import KeepAll, Properties, Reliable
from ddsi_security import key_exchange

from .keystores import make_identities

PAIRS = 60
BOUND = 12
RELIABLE = Qos(reliability=Reliable(), history=KeepAll())


@pytest.fixture(scope="module")
def identities(tmp_path_factory: pytest.TempPathFactory) -> list[Properties]:
    return make_identities(tmp_path_factory.mktemp("keystore"), "encrypt")[:2]


def crowded(identities: list[Properties], seed: int, loss: float) -> Domain:
    domain = Domain(seed, conditions=LinkConditions(loss=loss, delay=0.01, jitter=0.005))
    alice, bob = (domain.node(properties=properties) for properties in identities)
    for number in range(PAIRS):
        alice.writer(f"topic {number}", RELIABLE)
        bob.reader(f"topic {number}", RELIABLE)
    return domain


@pytest.mark.parametrize("loss", [0.0, 0.1])
def test_more_keys_than_one_peer_may_leave_unacknowledged_arrive(
    identities: list[Properties], monkeypatch: pytest.MonkeyPatch, loss: float
) -> None:
    """It acknowledges them as they come, and is not given up for what is still under way."""
    monkeypatch.setattr(filtering_writer, "MAX_CHANGES_PER_DESTINATION", BOUND)
    domain = crowded(identities, 1, loss)
    assert domain.run_until(domain.all_matched, 10.0)


@pytest.mark.parametrize("seed", range(4))
def test_keys_that_came_before_their_endpoint_and_were_forgotten_are_asked_for(
    identities: list[Properties], monkeypatch: pytest.MonkeyPatch, seed: int
) -> None:
    monkeypatch.setattr(key_exchange, "MAX_EARLY_KEYS", 2)
    domain = crowded(identities, seed, 0.2)
    assert domain.run_until(domain.all_matched, 40.0)
