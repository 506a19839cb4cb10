"""What ``ddsi doctor --peer HOST`` finds: does a participant on that host answer, and if not, why perhaps not?"""

from __future__ import annotations

from collections.abc import AsyncIterator
from dataclasses import replace

from ..config import Config
from ..dcps import DomainParticipant
from ..structure.errors import ConfigurationError, DdsError
from ..structure.qos import Qos
from ..trace.wording import count_text
from ..transport.host_facts import probe_port, source_towards
from ..transport.platform import Interface, resolve
from .finding import Finding, Verdict
from .listening import listen

__all__ = ["peer_findings"]


async def peer_findings(
    domain_id: int, config: Config, interfaces: tuple[Interface, ...], hosts: list[str], duration: float | None
) -> AsyncIterator[Finding]:
    """One for each host.  Nothing is sent to one that is not reached by the chosen ``interfaces``."""
    for host in hosts:
        address = resolve(host)
        if address is None:
            yield Finding("peer", Verdict.FAULT, f"{host}: there is no IPv4 address of that name", "name an address")
            continue
        source = source_towards(address)
        chosen = [one for one in interfaces if one.address == source or (one.is_loopback and one.reaches(address))]
        if not chosen:
            by = f"would leave from {source}" if source is not None else "has no route"
            names = ", ".join(one.name for one in interfaces)
            advice = "choose that interface too under General/Interfaces, or mend the route (ip route get)"
            yield Finding("peer", Verdict.FAULT, f"{host}: {by}; the configuration chooses {names} alone", advice)
            continue
        yield await _of_host(domain_id, config, chosen[0], host, address, duration)


async def _of_host(
    domain_id: int, config: Config, interface: Interface, host: str, address: str, duration: float | None
) -> Finding:
    try:
        settings = replace(config, peers=(*config.peers, address))
        async with DomainParticipant(domain_id, qos=Qos(entity_name="ddsi doctor"), config=settings) as participant:
            await listen(participant, duration)
            answered = [
                data
                for data in participant.discovered_participants()
                if any(one.host == address for one in (*data.metatraffic_unicast, *data.default_unicast))
            ]
    except DdsError as error:
        return Finding("peer", Verdict.FAULT, f"{host}: {' '.join(str(error).split())}")
    if answered:
        return Finding(
            "peer", Verdict.OK, f"{host}: {count_text(len(answered), 'participant')} of domain {domain_id} answered"
        )
    try:
        port = config.ports.metatraffic_unicast(domain_id, 0)
    except ConfigurationError as error:
        return Finding("peer", Verdict.FAULT, f"{host}: {' '.join(str(error).split())}")
    if probe_port(interface.address, address, port) is False:
        text = f"{host}: the host answers, but nobody listens on port {port}"
        advice = f"start a participant of domain {domain_id} there, and compare domain ids"
    else:
        text = f"{host}: no participant of domain {domain_id} answered, nor did the host"
        advice = f"is it up (ping)? Does a packet filter there or here drop UDP to port {port} and above?"
    return Finding("peer", Verdict.FAULT, text, advice)
