"""Large samples in secured domains: of many fragments, each opened by itself, nothing gets lost or mixed up."""

from __future__ import annotations

from pathlib import Path

import pytest

from ddsi.engine import SendDatagram
from ddsi.simulation import Domain, LinkConditions
from ddsi.structure.cache_change import ChangeKind
from ddsi.structure.guid import Guid
from ddsi.structure.qos import Qos
from ddsi.structure.qos_policies import KeepAll, Reliable
from ddsi.trace.reasons import DropReason

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


@pytest.mark.parametrize(
    ("octets", "order"), [(75_000, (0, 1)), (75_000, (1, 0)), (100_000, (2, 1, 0)), (100_000, (1, 2, 0))]
)
def test_what_was_altered_spoils_nothing_that_is_here_or_comes_later(
    octets: int, order: tuple[int, ...], tmp_path: Path
) -> None:
    """Fragments are decrypted to where they belong, before it is known whether they are genuine."""
    identities = make_identities(tmp_path, "payload")
    domain = Domain(1)
    here, there = (domain.node(properties=found, max_message_octets=40_000) for found in identities[:2])
    writer, reader = here.writer("Square", RELIABLE), there.reader("Square", RELIABLE)
    assert domain.run_until(lambda: writer.matched_count == reader.matched_count == 1, 30)
    payload = b"\0\1\0\0" + bytes(number * 7 % 256 for number in range(octets))
    here.engine.write(writer.local, ChangeKind.ALIVE, payload, b"", here.now)
    sent = [b"".join(effect.parts) for effect in here.engine.drain_effects() if isinstance(effect, SendDatagram)]
    fragments = [datagram for datagram in sent if len(datagram) > 15_000]
    assert len(fragments) == len(order), [len(datagram) for datagram in sent]
    for index in order:
        altered = bytearray(fragments[index])
        altered[len(altered) // 2] ^= 1
        for datagram in (altered, bytearray(fragments[index]), altered):
            there.engine.receive_datagram(memoryview(datagram), here.port.locator, there.now)
    ((_, change),) = reader.history.take()
    assert bytes(change.payload) == payload
    assert there.engine.drops[DropReason.REJECTED_BY_SECURITY] >= len(fragments)
