"""Locator_t: an address that datagrams can be sent to.  RTPS 2.5 §9.3.2.4, §8.2.4.4."""

from __future__ import annotations

import ipaddress
from enum import IntEnum
from typing import NamedTuple

__all__ = ["Locator", "LocatorKind"]


class LocatorKind(IntEnum):
    INVALID = -1
    RESERVED = 0
    UDPV4 = 1
    UDPV6 = 2
    TCPV4 = 4
    TCPV6 = 8


class Locator(NamedTuple):
    """``kind`` (int32), ``port`` (uint32), ``address`` (16 octets; for UDPv4 the last four).

    A NamedTuple, as locators are dictionary keys on the way of every datagram.
    """

    kind: int
    port: int
    address: bytes

    @classmethod
    def udp_v4(cls, address: str, port: int) -> Locator:
        return cls(LocatorKind.UDPV4, port, bytes(12) + ipaddress.IPv4Address(address).packed)

    @property
    def host(self) -> str:
        """The address as text: ``127.0.0.1`` for UDPv4, ``::1`` for UDPv6, hexadecimal for all others."""
        if self.kind == LocatorKind.UDPV4:
            return str(ipaddress.IPv4Address(self.address[12:]))
        if self.kind == LocatorKind.UDPV6:
            return str(ipaddress.IPv6Address(self.address))
        return self.address.hex()

    @property
    def is_multicast(self) -> bool:
        if self.kind == LocatorKind.UDPV4:
            return 224 <= self.address[12] < 240
        return self.kind == LocatorKind.UDPV6 and self.address[0] == 0xFF

    @property
    def is_loopback(self) -> bool:
        return self.kind == LocatorKind.UDPV4 and self.address[12] == 127

    @property
    def is_unspecified(self) -> bool:
        return not any(self.address)

    def __str__(self) -> str:
        try:
            kind = LocatorKind(self.kind).name.lower()
        except ValueError:
            kind = f"kind{self.kind}"
        host = f"[{self.host}]" if self.kind == LocatorKind.UDPV6 else self.host
        return f"{kind}/{host}:{self.port}"
