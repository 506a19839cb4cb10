"""The scenarios that ``ddsi sim`` knows by name: small ones that show one mechanism each, as a teacher would.

Every one is a function of a domain whose seed and weather are set; what must hold afterwards is checked by the
simulation's invariants, and by what the scenario itself claims.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from ..simulation import Domain, LinkConditions
from ..simulation.endpoints import NodeReader
from ..structure.cache_change import ChangeKind
from ..structure.qos import Qos
from ..structure.qos_policies import KeepAll, Reliable, TransientLocal

__all__ = ["RANDOM", "SCENARIOS", "NamedScenario"]

RANDOM = "random"
"""The scenario that is a seed's own; ``ddsi.simulation.scenario`` makes it."""

_DISCOVERY_S = 10.0
_ARRIVAL_S = 30.0
_RELIABLE = Qos(reliability=Reliable(), history=KeepAll())
_LASTING = _RELIABLE | Qos(durability=TransientLocal())


@dataclass(frozen=True, slots=True)
class NamedScenario:
    """``play`` lives through it and returns what did not come true, in words."""

    name: str
    summary: str
    conditions: LinkConditions
    play: Callable[[Domain], list[str]]


def _lossy_link(domain: Domain) -> list[str]:
    writer = domain.node(name="writer").writer(qos=_RELIABLE)
    reader = domain.node(name="reader").reader(qos=_RELIABLE)
    flaws = _matched(domain)
    for _ in range(10):
        writer.write()
        domain.run(0.05)
    return flaws + _received(domain, reader, 10)


def _late_joiner(domain: Domain) -> list[str]:
    writer = domain.node(name="writer").writer(qos=_LASTING)
    for _ in range(5):
        writer.write()
    domain.run(2.0)
    reader = domain.node(name="late reader").reader(qos=_LASTING)
    return _matched(domain) + _received(domain, reader, 5)


def _fragments(domain: Domain) -> list[str]:
    writer = domain.node(name="writer").writer(qos=_RELIABLE)
    reader = domain.node(name="reader").reader(qos=_RELIABLE)
    flaws = _matched(domain)
    writer.write(size=10_000)
    return flaws + _received(domain, reader, 1)


def _instances(domain: Domain) -> list[str]:
    writer = domain.node(name="writer").writer(qos=_RELIABLE, keyed=True)
    reader = domain.node(name="reader").reader(qos=_RELIABLE, keyed=True)
    flaws = _matched(domain)
    for key in (1, 2):
        writer.write(key=key)
    writer.end(ChangeKind.NOT_ALIVE_DISPOSED, key=1)
    writer.end(ChangeKind.NOT_ALIVE_UNREGISTERED, key=2)
    return flaws + _received(domain, reader, 4)


def _restart(domain: Domain) -> list[str]:
    node = domain.node(name="writer")
    node.writer(qos=_LASTING)
    reader = domain.node(name="reader").reader(qos=_LASTING)
    flaws = _matched(domain)
    node.restart()
    writer = node.writer(qos=_LASTING)
    writer.write()
    return flaws + _received(domain, reader, 1)


def _matched(domain: Domain) -> list[str]:
    if domain.run_until(domain.all_matched, _DISCOVERY_S):
        return []
    return [f"not everybody is matched after {_DISCOVERY_S:g} s"]


def _received(domain: Domain, reader: NodeReader, count: int) -> list[str]:
    if domain.run_until(lambda: len(reader.taken) >= count, _ARRIVAL_S):
        return []
    return [f"the reader has {len(reader.taken)} of {count} changes after {_ARRIVAL_S:g} s"]


SCENARIOS = {
    scenario.name: scenario
    for scenario in (
        NamedScenario(
            "lossy-link", "a third of all datagrams is lost; HEARTBEAT and ACKNACK repair it",
            LinkConditions(loss=0.33), _lossy_link,
        ),
        NamedScenario(
            "late-joiner", "a reader comes after all was written, and gets the transient-local history",
            LinkConditions(), _late_joiner,
        ),
        NamedScenario(
            "fragments", "a sample larger than a datagram travels in DATA_FRAGs, some of which are lost",
            LinkConditions(loss=0.2), _fragments,
        ),
        NamedScenario(
            "instances", "two instances come to their end: one is disposed, one unregistered",
            LinkConditions(), _instances,
        ),
        NamedScenario(
            "restart", "the writer's process is killed and comes back as another participant",
            LinkConditions(loss=0.05), _restart,
        ),
    )
}  # fmt: skip
