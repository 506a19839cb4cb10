"""What the operating system says of this host: who holds UDP ports, packet filters, fragments, IPv6, the clock.

For ``ddsi doctor``.  Not a chapter of the specification.  It is read from Linux's ``/proc`` and from the C library;
only :func:`probe_port` sends something.  Where the system does not tell, the answer is None or empty.
"""

from __future__ import annotations

import ctypes
import os
import socket
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

from ..structure.dataclass import dataclass

__all__ = [
    "PortHolder",
    "fragment_memory",
    "has_ipv6_address",
    "is_clock_synchronized",
    "packet_filter_signs",
    "port_holders",
    "probe_port",
    "reassembly_counts",
    "source_towards",
]

_PROC = Path("/proc")
_MOST_DESCRIPTORS = 200_000
_TIMEX_OCTETS = 512
_TIME_ERROR = 5
_PROBE = b"ddsi self test"  # no RTPS
_REPLY_S = 0.3


@dataclass(frozen=True, slots=True)
class PortHolder:
    """``process``: ``name (pid)``, empty where it is another user's, about whom the system does not tell us."""

    port: int
    address: str
    process: str


def port_holders(ports: Iterable[int]) -> list[PortHolder]:
    """Who else listens on these UDP ports of IPv4, in the order of the ports; not this process."""
    wanted = set(ports)
    found: dict[str, tuple[int, str]] = {}
    with suppress(OSError, ValueError, IndexError):
        for line in (_PROC / "net/udp").read_text().splitlines()[1:]:
            words = line.split()
            address, port = words[1].split(":")
            if int(port, 16) in wanted:
                found[words[9]] = int(port, 16), socket.inet_ntoa(bytes.fromhex(address)[::-1])
    processes = _processes_of(set(found)) if found else {}
    own = f"({os.getpid()})"
    holders = [
        PortHolder(port, address, processes.get(inode, ""))
        for inode, (port, address) in found.items()
        if not processes.get(inode, "").endswith(own)
    ]
    return sorted(holders, key=lambda one: (one.port, one.address))


def _processes_of(inodes: set[str]) -> dict[str, str]:
    """Socket's inode to ``name (pid)``; of other users' processes nothing is told."""
    found: dict[str, str] = {}
    descriptors = (path for path in _PROC.glob("[0-9]*/fd/[0-9]*"))
    for _, path in zip(range(_MOST_DESCRIPTORS), _tolerant(descriptors), strict=False):
        with suppress(OSError):
            target = os.readlink(path)
            if target.startswith("socket:[") and target[8:-1] in inodes:
                process = path.parents[1]
                found[target[8:-1]] = f"{(process / 'comm').read_text().strip()} ({process.name})"
    return found


def _tolerant(paths: Iterable[Path]) -> Iterable[Path]:
    """Processes may end while we look."""
    walking = iter(paths)
    while True:
        try:
            yield next(walking)
        except StopIteration:
            return
        except OSError:
            continue


def packet_filter_signs() -> list[str]:
    """Tables of packet filters that are loaded here, which is not yet a rule that drops something."""
    signs = []
    for name in ("ip_tables_names", "ip6_tables_names"):
        with suppress(OSError):
            signs += [f"{name.partition('_')[0]}tables {table}" for table in (_PROC / "net" / name).read_text().split()]
    with suppress(OSError):
        if any(line.startswith("nf_tables ") for line in (_PROC / "modules").read_text().splitlines()):
            signs.append("nf_tables")
    return signs


def fragment_memory() -> int | None:
    """How many octets of incomplete IPv4 datagrams the system keeps (net.ipv4.ipfrag_high_thresh)."""
    try:
        return int((_PROC / "sys/net/ipv4/ipfrag_high_thresh").read_text())
    except (OSError, ValueError):
        return None


def reassembly_counts() -> tuple[int, int] | None:
    """How many IPv4 fragments have come to this host, and how many could not be joined (ReasmReqds, ReasmFails)."""
    try:
        names, values = ((_PROC / "net/snmp").read_text().splitlines())[:2]
        counts = dict(zip(names.split(), values.split(), strict=True))
        return int(counts["ReasmReqds"]), int(counts["ReasmFails"])
    except (OSError, ValueError, KeyError):
        return None


def has_ipv6_address() -> bool | None:
    """Has an interface other than the loopback an IPv6 address?"""
    try:
        lines = (_PROC / "net/if_inet6").read_text().splitlines()
    except OSError:
        return None
    return any(not line.split()[-1].startswith("lo") for line in lines if line.split())


def is_clock_synchronized() -> bool | None:
    """Does the kernel count its clock as synchronized (NTP, PTP)?"""
    try:
        timex = ctypes.create_string_buffer(_TIMEX_OCTETS)  # modes 0: it is read, and nothing is set
        state = ctypes.CDLL(None).adjtimex(timex)
    except (OSError, AttributeError, TypeError):
        return None
    return None if state < 0 else state != _TIME_ERROR


def source_towards(address: str) -> str | None:
    """The address of ours from which the system would send there; None if there is no route.  Nothing is sent."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sock:
        try:
            sock.connect((address, 9))
        except OSError:
            return None
        return str(sock.getsockname()[0])


def probe_port(source: str, address: str, port: int) -> bool | None:
    """Send one small datagram from ``source``: False if the host answers that nobody listens there; None if it says
    nothing, as one with a listener or with a packet filter does."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sock:
        sock.settimeout(_REPLY_S)
        try:
            sock.bind((source, 0))
            sock.connect((address, port))
            sock.send(_PROBE)
            sock.recv(1)
        except ConnectionRefusedError:
            return False
        except OSError:
            return None
    return None
