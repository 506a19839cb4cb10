"""Large samples in secured domains: of many fragments, each opened by itself, nothing gets lost or mixed up."""

from __future__ import annotations

from pathlib import Path

import pytest

from ddsi.simulation import Domain, LinkConditions
from ddsi.structure.cache_change import ChangeKind
from ddsi.structure.guid import Guid
from ddsi.structure.qos import Qos
from ddsi.structure.qos_policies import KeepAll, Reliable

from .keystores import GOVERNANCES, make_identities

RELIABLE = Qos(reliability=Reliable(), history=KeepAll())
ASKED = (Guid(b"whom it answers."), 7)
KEY_HASH = b"sixteen octets.."


@pytest.mark.parametrize("governance", GOVERNANCES)
@pytest.mark.parametrize("loss", [0.0, 0.1])
def test_what_stands_beside_the_first_fragment_outlives_the_others(
    governance: str, loss: float, tmp_path: Path
) -> None:
    """The fragments are opened into one buffer, one after the other."""
    identities = make_identities(tmp_path, governance)
    domain = Domain(1, conditions=LinkConditions(loss=loss))
    here, there = (domain.node(properties=found, max_message_octets=65_507) for found in identities[:2])
    writer, reader = here.writer("Square", RELIABLE), there.reader("Square", RELIABLE)
    assert domain.run_until(lambda: writer.matched_count == 1, 30)
    payload = b"\0\1\0\0" + bytes(number * 7 % 256 for number in range(300_000))
    for _ in range(3):
        here.engine.write(writer.local, ChangeKind.ALIVE, payload, b"", here.now, key_hash=KEY_HASH, related=ASKED)
        here.pump()
    assert domain.run_until(lambda: len(reader.taken) == 3, 30)
    for _, change in reader.taken:
        assert (change.key_hash, change.related) == (KEY_HASH, ASKED)
        assert bytes(change.payload) == payload
