"""UdpTransport: the sockets of one participant.  RTPS 2.5 §9.6 (mapping to UDP/IP).

One unicast socket per chosen interface, all on the same port, for builtin and user traffic alike; one socket for the
multicast group of the domain.  Unicast ports are never shared: two sockets on one port would split the traffic.
Interfaces come and go while a participant lives; :meth:`UdpTransport.refresh` follows them.
"""

from __future__ import annotations

import errno
import ipaddress
import socket
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress

from ..config import Config
from ..structure.dataclass import dataclass
from ..structure.errors import ConfigurationError, OutOfResources
from ..structure.locator import Locator, LocatorKind
from .platform import (
    Interface,
    allow_shared_port,
    bind_address_for_group,
    can_gather,
    can_mark,
    enlarge_buffer,
    list_interfaces,
    receive_only_joined_groups,
)

__all__ = ["NetworkChange", "UdpTransport"]

_LOOPBACK_MESSAGE = 65000
_LEAST_MESSAGE = 548  # what every IPv4 host takes (RFC 791), less the headers
_IP_UDP_HEADERS = 28
_JOIN_BELOW = 2048
_MAX_IOV = 512
_EPHEMERAL = 0
_HIGHEST_DSCP = 63

Octets = bytes | bytearray | memoryview


@dataclass(frozen=True, slots=True)
class NetworkChange:
    """What :meth:`UdpTransport.refresh` did: sockets to be read from now on, and those that the caller is to close."""

    opened: list[socket.socket]
    abandoned: list[socket.socket]


class UdpTransport:
    """Opened at once by the constructor; :meth:`close` closes all.  Raises ConfigurationError, OutOfResources."""

    def __init__(
        self, domain_id: int, config: Config, interfaces: Callable[[], list[Interface]] = list_interfaces
    ) -> None:
        self._list_interfaces = interfaces
        self.interfaces = _choose(interfaces(), config.interfaces)
        self._is_cut_off = False  # none of the interfaces that we may use is there
        self.uses_multicast = config.multicast is not False
        self._config = config
        self._domain_id = domain_id
        self.unicast: list[socket.socket] = []
        self.multicast: socket.socket | None = None
        self.blocked: socket.socket | None = None  # whose buffer was full at the last :meth:`send` that failed
        self.participant_index: int | None = None
        self._by_locator: dict[Locator, tuple[tuple[str, int], Sequence[socket.socket]]] = {}
        self._locators: dict[tuple[str, int], Locator] = {}
        self._peers: dict[str, list[Locator]] = {}
        try:
            self._open_unicast()
            if self.uses_multicast:
                self._open_multicast()
        except BaseException:
            self.close()
            raise

    # --- what the participant announces ------------------------------------------------------------------

    @property
    def port(self) -> int:
        return int(self.unicast[0].getsockname()[1])

    @property
    def is_loopback_only(self) -> bool:
        return all(interface.is_loopback for interface in self.interfaces)

    @property
    def max_message_octets(self) -> int:
        """The largest UDP payload to send: whole datagrams on loopback, elsewhere what fits a frame.

        A datagram of several frames is lost when one of them is; at 10 % loss, of those of ten frames a third arrives.
        """
        if self._config.max_message_size is not None:
            return self._config.max_message_size
        mtu = min(interface.mtu for interface in self.interfaces)
        return min(_LOOPBACK_MESSAGE, max(mtu - _IP_UDP_HEADERS, _LEAST_MESSAGE))

    def unicast_locators(self) -> tuple[Locator, ...]:
        """Where this participant can be reached; loopback only when there is nothing else."""
        return tuple(Locator.udp_v4(*sock.getsockname()) for sock in self.unicast)

    def multicast_locators(self) -> tuple[Locator, ...]:
        if self.multicast is None:
            return ()
        port = self._config.ports.metatraffic_multicast(self._domain_id)
        return (Locator.udp_v4(self._config.multicast_address, port),)

    def announce_to(self) -> tuple[Locator, ...]:
        """Where SPDP goes: the group, configured peers, and on loopback everybody's well-known ports."""
        destinations = list(self.multicast_locators())
        peers = self._config.peers
        if not peers and any(interface.is_loopback for interface in self.interfaces):
            peers = ("127.0.0.1",)
        for peer in peers:
            if peer not in self._peers:  # asked once: a name server that is out of reach must not hold us up later
                self._peers[peer] = self._peer_locators(peer)
            destinations.extend(self._peers[peer])
        own = set(self.unicast_locators())
        return tuple(locator for locator in dict.fromkeys(destinations) if locator not in own)

    def _peer_locators(self, peer: str) -> list[Locator]:
        host, colon, port = peer.rpartition(":")
        try:
            if colon:
                return [Locator.udp_v4(socket.gethostbyname(host), int(port))]
            address = socket.gethostbyname(peer)
        except OSError as error:
            raise ConfigurationError(f"peer {peer!r} cannot be resolved to an IPv4 address: {error}") from error
        if ipaddress.IPv4Address(address).is_multicast:
            return [Locator.udp_v4(address, self._config.ports.metatraffic_multicast(self._domain_id))]
        indices = range(self._config.max_auto_participant_index + 1)
        return [Locator.udp_v4(address, self._config.ports.metatraffic_unicast(self._domain_id, i)) for i in indices]

    # --- opening -----------------------------------------------------------------------------------------

    def _open_unicast(self) -> None:
        """Probe the well-known ports in order (RTPS 2.5 §9.6.2.3); when all are taken, any port will do.

        Peers learn the true port by SPDP; only those that know us by unicast alone need the well-known one.
        """
        index = self._config.participant_index
        if isinstance(index, int):
            if not self._bind_all(self._config.ports.metatraffic_unicast(self._domain_id, index)):
                raise ConfigurationError(
                    f"participant index {index} of domain {self._domain_id} is taken; choose another or 'auto'"
                )
            self.participant_index = index
            return
        if index == "auto":
            for candidate in range(self._config.max_auto_participant_index + 1):
                if self._bind_all(self._config.ports.metatraffic_unicast(self._domain_id, candidate)):
                    self.participant_index = candidate
                    return
        if not self._bind_all(_EPHEMERAL):
            raise OutOfResources("no UDP port is free")

    def _bind_all(self, port: int) -> bool:
        """One socket per interface on this port, or none at all."""
        opened: list[socket.socket] = []
        for interface in self.interfaces:
            try:
                sock = self._bind(interface, port)
            except OSError as error:
                for other in opened:
                    other.close()
                if error.errno in (errno.EADDRINUSE, errno.EACCES):
                    return False
                raise ConfigurationError(f"cannot listen on {interface.address}:{port}: {error}") from error
            opened.append(sock)
            port = sock.getsockname()[1]
        self.unicast = opened
        return True

    def _bind(self, interface: Interface, port: int) -> socket.socket:
        sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            sock.setblocking(False)
            sock.bind((interface.address, port))
            self._set_options(sock, interface)
        except BaseException:
            sock.close()
            raise
        return sock

    def _set_options(self, sock: socket.socket, interface: Interface) -> None:
        enlarge_buffer(sock, socket.SO_RCVBUF, self._config.receive_buffer_size)
        enlarge_buffer(sock, socket.SO_SNDBUF, self._config.send_buffer_size)
        sock.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton(interface.address))
        sock.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, self._config.multicast_ttl)
        sock.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_LOOP, 1)

    def _open_multicast(self) -> None:
        """Join the group on every chosen interface.  One that cannot is left out, as loopback often cannot."""
        sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.multicast = sock
        sock.setblocking(False)
        allow_shared_port(sock)
        receive_only_joined_groups(sock)
        group = self._config.multicast_address
        port = self._config.ports.metatraffic_multicast(self._domain_id)
        try:
            sock.bind((bind_address_for_group(group), port))
        except OSError as error:
            raise OutOfResources(
                f"cannot listen on {group}:{port} ({error}): another program holds the port for itself; stop it, use "
                "another domain, or do without multicast: Config(multicast=False, peers=...)"
            ) from error
        enlarge_buffer(sock, socket.SO_RCVBUF, self._config.receive_buffer_size)
        if not self._join(sock):
            sock.close()
            self.multicast = None

    def _join(self, sock: socket.socket) -> int:
        """Become a member of the group on every interface; returns on how many."""
        joined = 0
        for interface in self.interfaces:
            with suppress(OSError):
                sock.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, self._membership(interface))
                joined += 1
        return joined

    def _leave(self, sock: socket.socket, interface: Interface) -> None:
        with suppress(OSError):
            sock.setsockopt(socket.IPPROTO_IP, socket.IP_DROP_MEMBERSHIP, self._membership(interface))

    def _membership(self, interface: Interface) -> bytes:
        return socket.inet_aton(self._config.multicast_address) + socket.inet_aton(interface.address)

    # --- interfaces that come and go ---------------------------------------------------------------------

    def refresh(self) -> NetworkChange | None:
        """Look at the interfaces again and follow them; None when there is nothing to do or nobody to tell.

        While none of ours is there everything stays as it is: the one that went is the likeliest to return, and then
        its socket, bound to the same address, works as before.  What we announce is said again then, and the group
        joined anew, as a switch on the way may have forgotten both.
        """
        try:
            present = _choose(self._list_interfaces(), self._config.interfaces, is_patient=True)
        except OSError:
            return None
        if not present:
            self._is_cut_off = True
            return None
        if present == self.interfaces and not self._is_cut_off:
            return None
        self._is_cut_off = False
        return self._move_to(present)

    def _move_to(self, present: list[Interface]) -> NetworkChange | None:
        # By address, to which the socket is bound: the interface that bears it may be another one than before.
        before = {interface.address: sock for interface, sock in zip(self.interfaces, self.unicast, strict=True)}
        after: list[tuple[Interface, socket.socket]] = []
        opened: list[socket.socket] = []
        for interface in present:
            kept = before.get(interface.address)
            sock = self._rebind(interface) if kept is None else self._point_again(kept, interface)
            if sock is not None:
                after.append((interface, sock))
                opened.extend([sock] if kept is None else [])
        if not after:  # it went again while we looked
            self._is_cut_off = True
            return None
        for interface in self.interfaces:
            if self.multicast is not None:
                self._leave(self.multicast, interface)
        self.interfaces, self.unicast = [interface for interface, _ in after], [sock for _, sock in after]
        self._by_locator.clear()
        self.blocked = None
        if self.multicast is not None:
            self._join(self.multicast)
        elif self.uses_multicast:
            with suppress(OutOfResources):
                self._open_multicast()
            opened.extend([self.multicast] if self.multicast is not None else [])
        return NetworkChange(opened, [sock for sock in before.values() if sock not in self.unicast])

    def _rebind(self, interface: Interface) -> socket.socket | None:
        """On our port, so that whoever knew the address finds us there again; on any other if somebody took it."""
        for port in (self.port, _EPHEMERAL):
            with suppress(OSError):
                return self._bind(interface, port)
        return None

    def _point_again(self, sock: socket.socket, interface: Interface) -> socket.socket | None:
        """Its multicast leaves through the interface that bears the address now."""
        with suppress(OSError):
            self._set_options(sock, interface)
            return sock
        return None

    # --- in and out --------------------------------------------------------------------------------------

    def locator_of(self, address: tuple[str, int]) -> Locator:
        """The source of a datagram as a Locator; the latest few are remembered."""
        locator = self._locators.get(address)
        if locator is None:
            if len(self._locators) >= 1024:
                self._locators.clear()
            locator = self._locators[address] = Locator.udp_v4(*address)
        return locator

    def send(self, parts: Sequence[Octets], locator: Locator) -> bool:
        """Send one datagram; False when the system's buffer is full and it must be tried again.

        What the network refuses (nobody there, no route) is gone: reliable writers repair, announcements repeat.
        """
        route = self._by_locator.get(locator)
        if route is None:
            route = self._route(locator)
        address, sockets = route
        for sock in sockets:
            try:
                if len(parts) == 1:
                    sock.sendto(parts[0], address)
                elif not can_gather or len(parts) > _MAX_IOV or sum(map(len, parts)) < _JOIN_BELOW:
                    sock.sendto(b"".join(parts), address)
                else:
                    sock.sendmsg(parts, (), 0, address)
            except BlockingIOError:
                self.blocked = sock
                return False
            except OSError:
                continue
        return True

    def send_marked(self, parts: Sequence[Octets], locator: Locator, priority: int) -> bool:
        """As :meth:`send`, with ``priority`` as the datagram's DSCP (RFC 2474): 1 to 63; more is 63, less than 1 none.

        DDS 1.4 §2.2.3.15 (TRANSPORT_PRIORITY).  What the network makes of it is its own affair.
        """
        if priority < 1 or not can_mark:
            return self.send(parts, locator)
        mark = (min(priority, _HIGHEST_DSCP) << 2).to_bytes(4, sys.byteorder)
        address, sockets = self._by_locator.get(locator) or self._route(locator)
        for sock in sockets:
            try:
                sock.sendmsg([b"".join(parts)], [(socket.IPPROTO_IP, socket.IP_TOS, mark)], 0, address)
            except BlockingIOError:
                self.blocked = sock
                return False
            except OSError:
                continue
        return True

    def _route(self, locator: Locator) -> tuple[tuple[str, int], Sequence[socket.socket]]:
        """Which sockets a locator is sent through: multicast on every interface, unicast on the one that reaches it."""
        if len(self._by_locator) >= 4096:
            self._by_locator.clear()
        sockets: Sequence[socket.socket] = ()
        if locator.kind == LocatorKind.UDPV4 and 0 < locator.port <= 65535 and not locator.is_unspecified:
            sockets = self.unicast if locator.is_multicast else self._socket_towards(locator)
        route = self._by_locator[locator] = ((locator.host, locator.port), sockets)
        return route

    def _socket_towards(self, locator: Locator) -> Sequence[socket.socket]:
        for interface, sock in zip(self.interfaces, self.unicast, strict=True):
            if interface.reaches(locator.host):
                return (sock,)
        outward = [
            sock for interface, sock in zip(self.interfaces, self.unicast, strict=True) if not interface.is_loopback
        ]
        if locator.is_loopback:
            return ()  # another host's loopback, or ours without an interface there: it cannot be reached
        return tuple(outward[:1])

    def sockets(self) -> list[socket.socket]:
        """All that are read from."""
        return self.unicast if self.multicast is None else [*self.unicast, self.multicast]

    def close(self) -> None:
        for sock in self.sockets():
            sock.close()


def _choose(available: list[Interface], wanted: tuple[str, ...], *, is_patient: bool = False) -> list[Interface]:
    """The interfaces named, by name or address; none named: all but loopback, or loopback when it is alone.

    ``is_patient``: those that are not there may come back, so that they are no error.
    """
    if not wanted:
        outward = [interface for interface in available if not interface.is_loopback]
        chosen = outward or available
    else:
        chosen = []
        for name in wanted:
            found = [interface for interface in available if name in (interface.name, interface.address)]
            if not found and not is_patient:
                names = ", ".join(f"{interface.name} ({interface.address})" for interface in available) or "none"
                raise ConfigurationError(
                    f"there is no interface {name!r} that is up and has an IPv4 address; there are: {names}"
                )
            chosen.extend(interface for interface in found if interface not in chosen)
    if not chosen and not is_patient:
        raise ConfigurationError("no network interface is up, not even loopback")
    return chosen
