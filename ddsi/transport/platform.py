"""What differs between Linux, macOS and Windows, in one place: interfaces, socket options, and their names.

Nothing else in ``ddsi`` asks which platform it runs on.
"""

from __future__ import annotations

import ipaddress
import socket
import struct
import sys

from ..structure.dataclass import dataclass

__all__ = [
    "Interface",
    "allow_shared_port",
    "bind_address_for_group",
    "can_gather",
    "can_mark",
    "enlarge_buffer",
    "list_interfaces",
    "open_network_events",
    "receive_only_joined_groups",
    "resolve",
]

_ETHERNET_MTU = 1500
_LOOPBACK_MTU = 65536
_IFF_UP, _IFF_LOOPBACK = 0x1, 0x8
_BUFFER_WANTED = 4 << 20


can_gather = hasattr(socket.socket, "sendmsg")
can_mark = can_gather and sys.platform == "linux"
"""Can a datagram be given a DSCP of its own?  (ip(7): IP_TOS as a control message.)"""
"""Can one datagram be sent from several buffers?  Not on Windows."""


@dataclass(frozen=True, slots=True)
class Interface:
    """A network interface with an IPv4 address.  ``mtu`` in octets, as far as the platform tells it.

    ``index``: the system's number for it, another one when an interface of the same name is made anew; 0 if not told.
    """

    name: str
    address: str
    netmask: str
    mtu: int
    is_loopback: bool
    index: int = 0

    def reaches(self, address: str) -> bool:
        """Is the address in this interface's own network?"""
        network = ipaddress.IPv4Network((self.address, self.netmask), strict=False)
        return ipaddress.IPv4Address(address) in network


def list_interfaces() -> list[Interface]:
    """Every interface that is up and has an IPv4 address; loopback first."""
    found = _from_getaddrinfo() if sys.platform == "win32" else _from_ioctl()
    return sorted(found, key=lambda interface: not interface.is_loopback)


if sys.platform != "win32":
    import fcntl

    # (SIOCGIFADDR, SIOCGIFNETMASK, SIOCGIFFLAGS, SIOCGIFMTU) and where a sockaddr keeps its four octets.
    _REQUESTS = (
        (0x8915, 0x891B, 0x8913, 0x8921)
        if sys.platform == "linux"
        else (0xC0206921, 0xC0206925, 0xC0206911, 0xC0206933)
    )

    def _from_ioctl() -> list[Interface]:
        interfaces = []
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            for index, name in socket.if_nameindex():
                interface = _interface(probe, name, index)
                if interface is not None:
                    interfaces.append(interface)
        return interfaces

    def _interface(probe: socket.socket, name: str, index: int) -> Interface | None:
        request = struct.pack("256s", name.encode()[:15])

        def ask(code: int) -> bytes:
            return fcntl.ioctl(probe.fileno(), code, request)

        get_address, get_netmask, get_flags, get_mtu = _REQUESTS
        try:
            (flags,) = struct.unpack_from("H", ask(get_flags), 16)
            if not flags & _IFF_UP:
                return None
            address = socket.inet_ntoa(ask(get_address)[20:24])
            netmask = socket.inet_ntoa(ask(get_netmask)[20:24])
            (mtu,) = struct.unpack_from("i", ask(get_mtu), 16)
        except OSError:  # it has no IPv4 address, or went away while we asked
            return None
        return Interface(name, address, netmask, mtu, bool(flags & _IFF_LOOPBACK), index)

else:

    def _from_ioctl() -> list[Interface]:
        raise AssertionError("there is no ioctl on Windows")


def _from_getaddrinfo() -> list[Interface]:
    """Windows: the addresses of this host; masks and MTUs are not told without further libraries."""
    interfaces = [Interface("loopback", "127.0.0.1", "255.0.0.0", _LOOPBACK_MTU, is_loopback=True)]
    for *_, address in socket.getaddrinfo(socket.gethostname(), None, socket.AF_INET, socket.SOCK_DGRAM):
        host = str(address[0])
        if not host.startswith("127."):
            interfaces.append(Interface(host, host, "255.255.255.0", _ETHERNET_MTU, is_loopback=False))
    return interfaces


def open_network_events() -> socket.socket | None:
    """A socket that becomes readable when an interface or an IPv4 address comes or goes; None: look now and then.

    Linux: rtnetlink(7), the groups RTMGRP_LINK and RTMGRP_IPV4_IFADDR.  Some sandboxes have none of it.
    """
    if sys.platform != "linux":
        return None
    try:
        sock = socket.socket(socket.AF_NETLINK, socket.SOCK_RAW | socket.SOCK_NONBLOCK, socket.NETLINK_ROUTE)
    except OSError:
        return None
    try:
        sock.bind((0, 0x1 | 0x10))
    except OSError:
        sock.close()
        return None
    return sock


def allow_shared_port(sock: socket.socket) -> None:
    """Let several processes listen on one multicast port.  BSD and macOS want SO_REUSEPORT for that too."""
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    if sys.platform not in ("linux", "win32") and hasattr(socket, "SO_REUSEPORT"):
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEPORT, 1)


def receive_only_joined_groups(sock: socket.socket) -> None:
    """Linux gives a socket the multicast that *any* process joined, unless told otherwise."""
    if sys.platform == "linux":
        sock.setsockopt(socket.IPPROTO_IP, 49, 0)  # IP_MULTICAST_ALL


def enlarge_buffer(sock: socket.socket, option: int, wanted: int | None) -> int:
    """Set SO_RCVBUF or SO_SNDBUF; None: as much as the system allows, up to 4 MiB.  Returns what it became.

    Linux silently caps at net.core.rmem_max (and reports twice the value); others refuse, so ask for less.
    """
    size = wanted or _BUFFER_WANTED
    while size >= 1 << 16:
        try:
            sock.setsockopt(socket.SOL_SOCKET, option, size)
            break
        except OSError:
            size //= 2
    return sock.getsockopt(socket.SOL_SOCKET, option)


def bind_address_for_group(group: str) -> str:
    """Where to bind a multicast socket: to the group, so that other traffic to the port stays away; Windows cannot."""
    return "" if sys.platform == "win32" else group


def resolve(host: str) -> str | None:
    """The host's first IPv4 address; None if it has none, or nobody knows it."""
    try:
        return socket.gethostbyname(host)
    except (OSError, UnicodeError):
        return None
