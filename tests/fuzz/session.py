"""An authenticated session whose keys follow from a seed: Alice writes, Bob reads, and every datagram was recorded.

Made twice it is the same, octet for octet, so that inputs which were cut from it keep their meaning.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from random import Random

from ddsi.engine import Compute, Participant, SendDatagram
from ddsi.simulation import Domain, Node
from ddsi.spi import SecurityHooks, load_hooks
from ddsi.structure.locator import Locator
from ddsi.structure.qos import Qos
from ddsi.structure.qos_policies import KeepAll, Reliable, TransientLocal
from tests.security.seam import DOMAIN, NOW_NS, properties_of

__all__ = ["Ear", "Session", "recorded"]

QOS = Qos(reliability=Reliable(), history=KeepAll(), durability=TransientLocal())
SAMPLES = (10, 100, 3000)  # octets; the last one travels in fragments


@dataclass
class Session:
    alice: Node
    bob: Node
    of_alice: tuple[bytes, ...]
    """All that Alice sent, the first announcement first."""

    @classmethod
    def make(cls, *, until: int | None = None) -> Session:
        """From the first announcement to the last acknowledgment; or ``until`` so many datagrams were sent."""
        domain = Domain(3)
        said: list[tuple[bytes, bytes]] = []
        domain.network.watch = lambda owner, octets: said.append((owner, octets))
        alice, bob = (_node(domain, name) for name in ("alice", "bob"))
        writer = alice.writer("Square", QOS)
        bob.reader("Square", QOS)
        if until is None:
            assert domain.run_until(domain.all_matched, 5)
            for size in SAMPLES:
                writer.write(size)
            domain.run(0.5)
        else:
            domain.run_until(lambda: len(said) >= until, 5)
        return cls(alice, bob, tuple(octets for owner, octets in said if owner == alice.guid.prefix))


def _node(domain: Domain, name: str) -> Node:
    properties = properties_of(name)

    def hooks() -> SecurityHooks:
        return load_hooks(properties, entropy=Random(name).randbytes, wall_clock=lambda: NOW_NS)

    return domain.node(name=name, domain_id=DOMAIN, properties={**properties}, make_hooks=hooks)


@cache
def recorded() -> tuple[bytes, ...]:
    """What Alice sent in a whole session."""
    return Session.make().of_alice


class Ear:
    """An engine that hears datagrams, acts upon them, and lets time pass.  ``sent``: octets, by destination."""

    def __init__(self, engine: Participant) -> None:
        self.engine = engine
        self.now = engine.now
        self.sent: dict[Locator, int] = {}

    def hear(self, octets: bytes, source: Locator, *, after: float = 0.001) -> None:
        """One datagram, ``after`` so many seconds; timers that are due by then run first."""
        self.wait(after)
        self.engine.receive_datagram(octets, source, self.now)
        self._act()

    def wait(self, seconds: float) -> None:
        """Let timers run.  They must not keep the engine busy."""
        until, woken = self.now + seconds, 0
        while (due := self.engine.next_deadline()) <= until:
            woken += 1
            assert woken < 5000 * math.ceil(seconds), "timers without end"
            self.now = max(self.now, due)
            self.engine.handle_timeout(self.now)
            self._act()
        self.now = max(self.now, until)

    def _act(self) -> None:
        while effects := self.engine.drain_effects():
            for effect in effects:
                if isinstance(effect, Compute):
                    effect.computed(effect.job(), self.now)
                elif isinstance(effect, SendDatagram):
                    size = sum(map(len, effect.parts))
                    for destination in effect.destinations:
                        self.sent[destination] = self.sent.get(destination, 0) + size
