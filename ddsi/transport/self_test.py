"""Tries out what a participant will rely on: sockets, their buffers, and datagrams to oneself, also by multicast.

For ``ddsi doctor``.  Not a chapter of the specification.  Everything is sent on the interfaces that the configuration
chooses, to this host's own addresses and to the group of announcements on a port that nobody else listens on.
"""

from __future__ import annotations

import socket
from dataclasses import dataclass
from pathlib import Path

from .platform import Interface, bind_address_for_group, receive_only_joined_groups
from .udp import UdpTransport

__all__ = [
    "KERNEL_RECEIVE_SETTING",
    "SocketBuffers",
    "buffers_of",
    "kernel_receive_limit",
    "multicast_returns",
    "unicast_returns",
]

KERNEL_RECEIVE_SETTING = "net.core.rmem_max"
"""Linux's name for that limit."""
_REPLY_S = 0.5
_TOKEN = b"ddsi self test"  # no RTPS, should anybody read it


@dataclass(frozen=True, slots=True)
class SocketBuffers:
    """SO_RCVBUF and SO_SNDBUF in octets, as the system reports them (Linux says twice what it grants)."""

    receive: int
    send: int


def buffers_of(transport: UdpTransport) -> SocketBuffers:
    """What the sockets of a participant really got."""
    sock = transport.unicast[0]
    return SocketBuffers(
        sock.getsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF), sock.getsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF)
    )


def kernel_receive_limit() -> int | None:
    """The most octets that SO_RCVBUF may be set to without privileges; None where the system does not tell."""
    try:
        return int(Path("/proc/sys", KERNEL_RECEIVE_SETTING.replace(".", "/")).read_text())
    except (OSError, ValueError):
        return None


def unicast_returns(interface: Interface) -> bool:
    """Does a datagram to the interface's own address arrive?  If not, a packet filter stands between."""
    with _socket() as receiver, _socket() as sender:
        try:
            receiver.bind((interface.address, 0))
            sender.bind((interface.address, 0))
            sender.sendto(_TOKEN, receiver.getsockname())
            return _arrives(receiver)
        except OSError:
            return False


def multicast_returns(interface: Interface, group: str) -> bool:
    """Does a datagram that is sent to the group on this interface come back to a member of the group here?"""
    with _socket() as receiver, _socket() as sender:
        try:
            receive_only_joined_groups(receiver)
            receiver.bind((bind_address_for_group(group), 0))
            membership = socket.inet_aton(group) + socket.inet_aton(interface.address)
            receiver.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, membership)
            sender.bind((interface.address, 0))
            sender.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton(interface.address))
            sender.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)  # nobody else needs it
            sender.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_LOOP, 1)
            sender.sendto(_TOKEN, (group, receiver.getsockname()[1]))
            return _arrives(receiver)
        except OSError:
            return False


def _socket() -> socket.socket:
    made = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    made.settimeout(_REPLY_S)
    return made


def _arrives(receiver: socket.socket) -> bool:
    """A few datagrams of others may come first; they do not go on for ever."""
    return any(receiver.recv(2048) == _TOKEN for _ in range(8))
