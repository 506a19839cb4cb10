"""``ddsi doctor``: is this host fit for DDS, and if not, what to do.

It looks at the versions, the configuration, the interfaces, the sockets, multicast and buffers, as a participant with
this configuration would meet them, and at the ports, filters and the clock of the host.  Nothing is sent on an
interface that the configuration does not choose.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from collections.abc import Iterator
from importlib import metadata

from ..config import Config
from ..config.environment import ENVIRONMENT_VARIABLE, load_config
from ..structure.errors import ConfigurationError, DdsError
from ..trace.wording import count_text
from ..transport.platform import Interface, list_interfaces
from ..transport.self_test import (
    KERNEL_RECEIVE_SETTING,
    buffers_of,
    kernel_receive_limit,
    multicast_returns,
    unicast_returns,
)
from ..transport.udp import UdpTransport
from .arguments import add_domain, add_json, seconds
from .doctor_host import host_findings
from .doctor_peers import peer_findings
from .exit_status import ExitStatus
from .finding import Finding, Verdict
from .runner import run as run_async
from .terminal import uses_colour

__all__ = ["SUMMARY", "Finding", "Verdict", "add_arguments", "examine", "run"]

SUMMARY = "check interfaces, sockets, multicast, buffers and configuration"

_CYCLONE_VARIABLE = "CYCLONEDDS_URI"
_WANTED_BUFFER = 1 << 20
"""A sample of a MiB in fragments arrives in one burst."""
_OPTIONAL = ("rich", "cryptography", "lxml", "numpy")
_COLOURS = {"ok": "\x1b[32m", "warning": "\x1b[33m", "fault": "\x1b[31m"}
_RESET = "\x1b[0m"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_domain(parser)
    parser.add_argument(
        "--peer", action="append", default=[], metavar="HOST", help="does a participant there answer?  Repeatable"
    )
    parser.add_argument("--time", type=seconds, metavar="SECONDS", help="how long to wait for a peer (default: 2)")
    add_json(parser)


def run(arguments: argparse.Namespace) -> int:
    findings = []
    for finding in examine(arguments.domain):
        findings.append(finding)
        if not arguments.json:
            _print(finding)
    if arguments.peer and not any(finding.verdict is Verdict.FAULT for finding in findings):
        run_async(lambda: _examine_peers(arguments, findings))
    faults = sum(finding.verdict is Verdict.FAULT for finding in findings)
    warnings = sum(finding.verdict is Verdict.WARNING for finding in findings)
    if arguments.json:
        form = {
            "domain_id": arguments.domain,
            "faults": faults,
            "warnings": warnings,
            "findings": [
                {"subject": one.subject, "verdict": str(one.verdict), "text": one.text, "advice": one.advice}
                for one in findings
            ],
        }
        print(json.dumps(form, indent=2))
    else:
        print(f"{count_text(faults, 'fault')}, {count_text(warnings, 'warning')}.")
    return ExitStatus.NOT_AS_HOPED if faults else ExitStatus.OK


async def _examine_peers(arguments: argparse.Namespace, findings: list[Finding]) -> int:
    config = load_config(arguments.domain)
    transport = UdpTransport(arguments.domain, config)
    interfaces = tuple(transport.interfaces)
    transport.close()
    async for finding in peer_findings(arguments.domain, config, interfaces, arguments.peer, arguments.time):
        findings.append(finding)
        if not arguments.json:
            _print(finding)
    return ExitStatus.OK


def _print(finding: Finding) -> None:
    start, end = (_COLOURS[finding.verdict], _RESET) if uses_colour() else ("", "")
    print(f"{start}{finding.verdict:<8}{end} {finding.subject}: {finding.text}")
    if finding.advice:
        print(f"{'':<9}advice: {finding.advice}")


def examine(domain_id: int) -> Iterator[Finding]:
    """Everything that can be looked at, in the order in which it matters."""
    yield from _versions()
    try:
        config = load_config(domain_id)
    except ConfigurationError as error:
        advice = f"correct {ENVIRONMENT_VARIABLE}; every participant here would refuse to start"
        yield Finding("configuration", Verdict.FAULT, " ".join(str(error).split()), advice)
        return
    yield from _configuration(config)
    yield from _interfaces()
    try:
        transport = UdpTransport(domain_id, config)
    except DdsError as error:
        yield Finding("sockets", Verdict.FAULT, " ".join(str(error).split()), "change interfaces or participant index")
        return
    try:
        yield from _sockets(transport, domain_id)
        for interface in transport.interfaces:
            yield from _datagrams(interface, config, transport)
        yield from _buffers(transport)
        yield from host_findings(domain_id, config, transport)
    finally:
        transport.close()


def _versions() -> Iterator[Finding]:
    python = ".".join(map(str, sys.version_info[:3]))
    present = [f"{name} {version}" for name in ("ddsi", "trio", *_OPTIONAL) if (version := _version(name))]
    missing = [name for name in _OPTIONAL if not _version(name)]
    without = f"; without {', '.join(missing)}" if missing else ""
    yield Finding("versions", Verdict.OK, f"Python {python}, {', '.join(present)}{without}")


def _version(name: str) -> str:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return ""


def _configuration(config: Config) -> Iterator[Finding]:
    if os.environ.get(ENVIRONMENT_VARIABLE, "").strip():
        yield Finding("configuration", Verdict.OK, f"{ENVIRONMENT_VARIABLE} is understood: {config!r}")
    else:
        yield Finding("configuration", Verdict.OK, f"{ENVIRONMENT_VARIABLE} is not set: the defaults hold")
        if os.environ.get(_CYCLONE_VARIABLE, "").strip():
            advice = f"if both shall use the same settings, set {ENVIRONMENT_VARIABLE}=${_CYCLONE_VARIABLE}"
            yield Finding("configuration", Verdict.WARNING, f"{_CYCLONE_VARIABLE} is set, but not read by ddsi", advice)
    for warning in config.config_warnings:
        yield Finding("configuration", Verdict.WARNING, " ".join(warning.split()))


def _interfaces() -> Iterator[Finding]:
    found = list_interfaces()
    for interface in found:
        kind = "loopback" if interface.is_loopback else f"netmask {interface.netmask}"
        yield Finding("interface", Verdict.OK, f"{interface.name}: {interface.address}, {kind}, MTU {interface.mtu}")
    if not found:
        yield Finding("interface", Verdict.FAULT, "no interface with an IPv4 address is up", "ip link set lo up")


def _sockets(transport: UdpTransport, domain_id: int) -> Iterator[Finding]:
    names = ", ".join(interface.name for interface in transport.interfaces)
    where = f"a participant of domain {domain_id} would use {names}, port {transport.port}"
    if transport.participant_index is None:
        advice = "raise MaxAutoParticipantIndex here and at those that look for participants by unicast"
        yield Finding("sockets", Verdict.WARNING, f"{where}; all well-known ports of the domain are taken", advice)
    else:
        yield Finding("sockets", Verdict.OK, f"{where} (participant index {transport.participant_index})")
    if transport.is_loopback_only:
        yield Finding("reach", Verdict.OK, "only participants on this host are met: only the loopback is chosen")


def _datagrams(interface: Interface, config: Config, transport: UdpTransport) -> Iterator[Finding]:
    if unicast_returns(interface):
        yield Finding("unicast", Verdict.OK, f"a datagram to {interface.address} arrives")
    else:
        advice = "look for a packet filter (nft list ruleset, iptables -S)"
        yield Finding("unicast", Verdict.FAULT, f"a datagram to {interface.address}, sent from here, is lost", advice)
    group = config.multicast_address
    if not transport.uses_multicast:
        yield Finding("multicast", Verdict.OK, "switched off by the configuration: peers must be named")
    elif multicast_returns(interface, group):
        yield Finding("multicast", Verdict.OK, f"a datagram to {group} on {interface.name} comes back")
    elif interface.is_loopback or config.peers:
        text = f"does not work on {interface.name}; others are looked for by unicast at their well-known ports"
        yield Finding("multicast", Verdict.WARNING, text, f"ip link set {interface.name} multicast on")
    else:
        advice = f"ip link set {interface.name} multicast on; or name the others under Discovery/Peers"
        yield Finding("multicast", Verdict.FAULT, f"{group} does not work on {interface.name}", advice)


def _buffers(transport: UdpTransport) -> Iterator[Finding]:
    buffers = buffers_of(transport)
    text = f"{buffers.receive >> 10} KiB to receive, {buffers.send >> 10} KiB to send, by the system's count"
    limit = kernel_receive_limit()
    if limit is None or limit >= _WANTED_BUFFER:
        yield Finding("buffers", Verdict.OK, text)
    else:
        setting = f"{KERNEL_RECEIVE_SETTING}={4 * _WANTED_BUFFER}"
        advice = f"sysctl -w {setting} (large samples come in bursts; what finds no room must be sent again)"
        yield Finding("buffers", Verdict.WARNING, f"{text}; {KERNEL_RECEIVE_SETTING} is only {limit}", advice)
