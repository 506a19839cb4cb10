"""What ``ddsi doctor`` finds about the host: ports of the domain, packet filters, fragments, IPv6, the clock."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from ..config import Config
from ..structure.errors import ConfigurationError
from ..trace.wording import count_text
from ..transport.host_facts import (
    PortHolder,
    fragment_memory,
    has_ipv6_address,
    is_clock_synchronized,
    packet_filter_signs,
    port_holders,
    reassembly_counts,
)
from ..transport.platform import Interface
from ..transport.udp import UdpTransport
from .finding import Finding, Verdict

__all__ = ["host_findings"]

_WANTED_FRAGMENT_MEMORY = 4 << 20
_FRAGMENT_MEMORY_WHERE_SOME_ARE_LOST = 128 << 20
_LOST_FRAGMENTS = 0.01  # so many failures for each that came show that it is no accident
_MOST_NAMED = 8


def host_findings(domain_id: int, config: Config, transport: UdpTransport) -> Iterator[Finding]:
    """``transport``: that of a participant with this configuration."""
    yield _ports(domain_id, config)
    yield _filters()
    yield _fragments(transport.max_message_octets, transport.interfaces)
    if has_ipv6_address():
        text = "this host has IPv6 addresses; participants here listen on IPv4 alone, as most vendors' do by default"
        yield Finding("ipv6", Verdict.OK, text)
    else:
        yield Finding("ipv6", Verdict.OK, "no IPv6 address outside the loopback; IPv4 is what counts")
    yield _clock()


def _ports(domain_id: int, config: Config) -> Finding:
    """Who else is here: each participant with a well-known port is one of the domain's, or in its way."""
    indices = range(config.max_auto_participant_index + 1)
    try:
        by_port = {config.ports.metatraffic_unicast(domain_id, index): index for index in indices}
        group_port = config.ports.metatraffic_multicast(domain_id)
    except ConfigurationError as error:
        return Finding("ports", Verdict.WARNING, " ".join(str(error).split()), "choose a lower domain id")
    held = port_holders([*by_port, group_port])
    unicast = list({one.port: one for one in held if one.port in by_port}.values())
    group = {one.process or "another user's process" for one in held if one.port == group_port}
    here = f"; on the group's port {group_port}: {', '.join(sorted(group)[:_MOST_NAMED])}" if group else ""
    if not unicast:
        return Finding("ports", Verdict.OK, f"none of the {len(by_port)} well-known ports is taken by others{here}")
    texts = [_holder_text(one, by_port[one.port]) for one in unicast[:_MOST_NAMED]]
    more = f" and {len(unicast) - _MOST_NAMED} more" if len(unicast) > _MOST_NAMED else ""
    text = f"{count_text(len(unicast), 'participant index')} taken: {', '.join(texts)}{more}{here}"
    if len(unicast) < len(by_port) - 1:
        return Finding("ports", Verdict.OK, text)
    advice = "raise MaxAutoParticipantIndex on every host that looks for others by unicast, or use another domain"
    return Finding("ports", Verdict.WARNING, text, advice)


def _holder_text(holder: PortHolder, index: int) -> str:
    return f"{index} (port {holder.port}) by {holder.process or 'another user'}"


def _filters() -> Finding:
    signs = packet_filter_signs()
    if signs:
        text = f"packet filters are loaded ({', '.join(signs[:_MOST_NAMED])}): they may drop UDP"
        advice = "if others are not found, let the domain's UDP ports and multicast pass: nft list ruleset, iptables -S"
        return Finding("filter", Verdict.OK, text, advice)
    return Finding("filter", Verdict.OK, "no sign of a packet filter on this host")


def _fragments(largest: int, interfaces: Iterable[Interface]) -> Finding:
    """A datagram larger than the MTU is fragmented by IP, and lost as a whole with any of its fragments.

    Ours are not, unless the configuration says so; what others send to this host may be.
    """
    came, lost = reassembly_counts() or (0, 0)
    if lost > came * _LOST_FRAGMENTS:
        text = f"{came} IP fragments came to this host, and {lost} times they could not be joined to a datagram"
        advice = (
            "find where frames are lost, let the peers send smaller messages, or "
            f"sysctl -w net.ipv4.ipfrag_high_thresh={_FRAGMENT_MEMORY_WHERE_SOME_ARE_LOST} net.ipv4.ipfrag_time=3"
        )
        return Finding("fragments", Verdict.WARNING, text, advice)
    narrow = [one for one in interfaces if not one.is_loopback and 0 < one.mtu - 28 < largest]
    memory = fragment_memory()
    if memory is not None and memory < _WANTED_FRAGMENT_MEMORY and narrow:
        advice = f"sysctl -w net.ipv4.ipfrag_high_thresh={_WANTED_FRAGMENT_MEMORY}"
        text = f"messages up to {largest} octets are fragmented by IP, and only {memory >> 10} KiB are kept for that"
        return Finding("fragments", Verdict.WARNING, text, advice)
    if narrow:
        mtus = ", ".join(f"{one.name} {one.mtu}" for one in narrow)
        text = f"messages may have {largest} octets; where that is above the MTU ({mtus}), IP fragments them"
        return Finding("fragments", Verdict.OK, text)
    return Finding("fragments", Verdict.OK, f"messages of up to {largest} octets go unfragmented")


def _clock() -> Finding:
    is_synchronized = is_clock_synchronized()
    if is_synchronized is None:
        return Finding("clock", Verdict.OK, "the system does not say whether its clock is synchronized")
    if is_synchronized:
        return Finding("clock", Verdict.OK, "the kernel counts its clock as synchronized")
    text = "the kernel does not count its clock as synchronized"
    advice = "run chrony, systemd-timesyncd or ptp4l: lifespan, order by source and certificates go by the clock"
    return Finding("clock", Verdict.WARNING, text, advice)
