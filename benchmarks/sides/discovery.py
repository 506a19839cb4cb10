"""Discovery: a simulated domain whose participants all start within a second, until each knows all the others.

The engines are those of real runs; network and clock are simulated, so datagrams and octets are the same each time.
"""

from __future__ import annotations

import time

from ddsi.simulation import Domain
from ddsi.structure.guid import GuidPrefix

from .protocol import play

_SETTLE_S = 5.0
"""Simulated: acknowledgments and late announcements count too."""
_START_S = 1.0


def discover(participants: int) -> dict[str, float]:
    """Each has a writer of its own topic and reads its neighbour's; all figures for each participant.

    Returns ``datagrams`` that it sent (to a group of many, one), ``octets`` in these, ``received`` datagrams and the
    processor time ``us``.
    """
    domain = Domain(seed=1)
    sent = octets_sent = 0

    def watch(sender: GuidPrefix, octets: bytes) -> None:
        nonlocal sent, octets_sent
        sent += 1
        octets_sent += len(octets)

    domain.network.watch = watch
    start = time.process_time()
    for number in range(participants):
        node = domain.node()
        node.writer(f"topic {number}")
        node.reader(f"topic {(number + 1) % participants}")
        domain.run(_START_S / participants)
    domain.run(_SETTLE_S)
    seconds = time.process_time() - start
    if not all(writer.matched_count == 1 for writer in domain.writers()) or not domain.are_introduced():
        raise RuntimeError("not all were matched")
    return {
        "datagrams": sent / participants,
        "octets": octets_sent / participants,
        "received": domain.network.delivered / participants,
        "us": seconds / participants * 1e6,
    }


if __name__ == "__main__":
    play({"discover": discover})
