"""A DDS implementation as the tests see it: what it can do, how its program is started, and where it is kept.

Every program gets its network from the environment and the address option alone, so that none can reach an interface
that is not the namespace's.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import Literal

from ..framework import Namespace, Process, Scenario
from .options import Options

__all__ = ["Ability", "Peer", "Role", "network_environment"]

Role = Literal["pub", "sub"]
ROOT = Path(__file__).resolve().parents[2]

MAX_PARTICIPANT_INDEX = 9
"""How many participants on one address unicast discovery looks for, less one."""


class Ability(Enum):
    """What not every peer can do; a case names those it needs."""

    KEYS = "keyed topics"
    XCDR2 = "XCDR2"
    APPENDABLE_XCDR1 = "appendable types in XCDR1"
    APPENDABLE_XCDR2 = "appendable types in XCDR2"
    UNICAST = "discovery without multicast"
    LARGE = "samples of a MiB"
    PARTITIONS = "partitions"
    SECURITY = "DDS Security"


@dataclass(frozen=True, slots=True, kw_only=True)
class Peer:
    """One implementation.  ``locate`` returns the command of its program, or raises Unavailable with the reason."""

    name: str
    title: str
    abilities: frozenset[Ability]
    locate: Callable[[], list[str]]
    version: Callable[[], str]

    def __str__(self) -> str:
        return self.name

    async def start(
        self, stage: Scenario, role: Role, options: Options, *, host: Namespace, others: Sequence[Namespace] = ()
    ) -> Process:
        """Starts the program in that role; ``others`` are the hosts that unicast discovery looks at besides its own."""
        addresses = dict.fromkeys([host.address, *(other.address for other in others)])
        unicast = list(addresses) if options.unicast else None
        environment = network_environment(host.interface, unicast, lease_s=options.lease_s)
        command = [*self.locate(), *options.arguments(), "-a", host.address, role]
        return await stage.start(f"{role} {self.name}", command, namespace=host, environment=environment, folder=ROOT)


def network_environment(
    interface: str, unicast_addresses: Sequence[str] | None = None, *, lease_s: int | None = None
) -> dict[str, str]:
    """CYCLONEDDS_URI and DDSI_URI: this one interface; with addresses, unicast discovery of these alone."""
    general = f'<Interfaces><NetworkInterface name="{interface}"/></Interfaces>'
    discovery = f"<LeaseDuration>{lease_s}s</LeaseDuration>" if lease_s is not None else ""
    if unicast_addresses is not None:
        general += "<AllowMulticast>false</AllowMulticast>"
        peers = "".join(f'<Peer Address="{address}"/>' for address in unicast_addresses)
        discovery += (
            "<ParticipantIndex>auto</ParticipantIndex>"
            f"<MaxAutoParticipantIndex>{MAX_PARTICIPANT_INDEX}</MaxAutoParticipantIndex>"
            f"<Peers>{peers}</Peers>"
        )
    domain = f"<Domain><General>{general}</General><Discovery>{discovery}</Discovery></Domain>"
    return {"CYCLONEDDS_URI": f"<CycloneDDS>{domain}</CycloneDDS>", "DDSI_URI": f"<DDSI>{domain}</DDSI>"}
