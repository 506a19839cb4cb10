"""IPv4, IPv6 and UDP headers: put around a message for a capture file, and taken off what a capture file holds.

RFC 791, RFC 8200, RFC 768, RFC 1071 (the checksum).  Only what a capture needs: this never goes on a wire.  Reading
is of untrusted octets: whatever is not a whole UDP datagram gives None, and nothing is raised.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

from ..structure.locator import Locator, LocatorKind
from .ip_fragments import IpFragment, IpReassembler

__all__ = ["LINKTYPE_RAW", "MAX_DATAGRAM_OCTETS", "udp_datagram_of_frame", "udp_packet"]

MAX_DATAGRAM_OCTETS = 65507
"""What fits an IPv4 packet beside both headers; IPv6 would take 20 more."""

_UDP = 17
_TTL = 64
_IPV4 = struct.Struct(">BBHHHBBH4s4s")
_IPV6 = struct.Struct(">IHBB16s16s")
_UDP_HEADER = struct.Struct(">HHHH")
_LOOPBACK_V4 = b"\x7f\x00\x00\x01"
_LOOPBACK_V6 = bytes(15) + b"\x01"


def udp_packet(source: Locator, destination: Locator, octets: bytes, *, identification: int = 0) -> bytes:
    """An IP packet that carries ``octets`` from source to destination, lengths and checksums filled in.

    IPv6 where the destination is UDPv6, else IPv4.  An address that is of another kind (shared memory, simulation)
    becomes that of the loopback, so that a protocol analyser has something to show.  Raises ValueError for more than
    MAX_DATAGRAM_OCTETS.
    """
    if len(octets) > MAX_DATAGRAM_OCTETS:
        raise ValueError(f"a UDP datagram holds {MAX_DATAGRAM_OCTETS} octets, not {len(octets)}")
    is_v6 = destination.kind == LocatorKind.UDPV6
    kind, loopback = (LocatorKind.UDPV6, _LOOPBACK_V6) if is_v6 else (LocatorKind.UDPV4, _LOOPBACK_V4)
    start = 0 if is_v6 else 12
    source_ip = source.address[start:] if source.kind == kind else loopback
    destination_ip = destination.address[start:] if destination.kind == kind else loopback
    udp = _udp(source_ip, destination_ip, source.port & 0xFFFF, destination.port & 0xFFFF, octets)
    if is_v6:
        return _IPV6.pack(6 << 28, len(udp), _UDP, _TTL, source_ip, destination_ip) + udp
    total = _IPV4.size + len(udp)
    blank = _IPV4.pack(0x45, 0, total, identification & 0xFFFF, 0, _TTL, _UDP, 0, source_ip, destination_ip)
    return blank[:10] + _checksum(blank).to_bytes(2, "big") + blank[12:] + udp


def _udp(source_ip: bytes, destination_ip: bytes, source_port: int, destination_port: int, octets: bytes) -> bytes:
    length = _UDP_HEADER.size + len(octets)
    pseudo_header = source_ip + destination_ip + struct.pack(">IHBB", length, 0, 0, _UDP)
    blank = _UDP_HEADER.pack(source_port, destination_port, length, 0)
    # 0 would mean that there is no checksum: RFC 768 sends its other form, all ones.
    checksum = _checksum(pseudo_header + blank + octets) or 0xFFFF
    return blank[:6] + checksum.to_bytes(2, "big") + octets


def _checksum(octets: bytes) -> int:
    """The complement of the one's-complement sum of all 16-bit words.  RFC 1071."""
    even = octets if len(octets) % 2 == 0 else octets + b"\x00"
    # The words are the digits of one number to the base 2^16, and 2^16 is 1 modulo 2^16 - 1: the remainder is the
    # digits' sum with its carries added back.  Only the two zeros differ, and a sum of nothing but zeros has no header.
    return 0xFFFF - (int.from_bytes(even, "big") % 0xFFFF or 0xFFFF)


# Reading.

LINKTYPE_NULL, LINKTYPE_ETHERNET, LINKTYPE_RAW, LINKTYPE_LOOP = 0, 1, 101, 108
LINKTYPE_LINUX_SLL, LINKTYPE_IPV4, LINKTYPE_IPV6, LINKTYPE_LINUX_SLL2 = 113, 228, 229, 276
# Octets of each link layer's header; for those with an EtherType, where it stands.
_LINK_HEADER_OCTETS = {
    LINKTYPE_NULL: 4,
    LINKTYPE_ETHERNET: 14,
    LINKTYPE_RAW: 0,
    LINKTYPE_LOOP: 4,
    LINKTYPE_LINUX_SLL: 16,
    LINKTYPE_IPV4: 0,
    LINKTYPE_IPV6: 0,
    LINKTYPE_LINUX_SLL2: 20,
}
_ETHERTYPE_OFFSET = {LINKTYPE_ETHERNET: 12, LINKTYPE_LINUX_SLL: 14, LINKTYPE_LINUX_SLL2: 0}
_ETHERTYPE_IP = frozenset({0x0800, 0x86DD})
_ETHERTYPE_VLAN = frozenset({0x8100, 0x88A8})
_MAX_VLAN_TAGS = 2
_MAX_EXTENSION_HEADERS = 8
_HOP_BY_HOP, _ROUTING, _FRAGMENT, _DESTINATION_OPTIONS = 0, 43, 44, 60


@dataclass(frozen=True, slots=True)
class UdpDatagram:
    source: Locator
    destination: Locator
    octets: bytes


def udp_datagram_of_frame(link_type: int, frame: bytes, reassembler: IpReassembler) -> UdpDatagram | None:
    """The UDP datagram in a captured frame; None if it holds none, or not (yet) a whole one.

    The parts of a fragmented packet are kept by ``reassembler`` until the last is there.
    """
    packet = _ip_packet(link_type, frame)
    if not packet:
        return None
    version = packet[0] >> 4
    if version == 4:
        return _udp_in_ipv4(packet, reassembler)
    return _udp_in_ipv6(packet, reassembler) if version == 6 else None


def _ip_packet(link_type: int, frame: bytes) -> bytes:
    """What the link layer carries, if that is IP; else nothing."""
    start = _LINK_HEADER_OCTETS.get(link_type)
    if start is None or len(frame) <= start:
        return b""
    at = _ETHERTYPE_OFFSET.get(link_type)
    if at is None:
        return frame[start:]
    ethertype = int.from_bytes(frame[at : at + 2], "big")
    for _ in range(_MAX_VLAN_TAGS):
        if ethertype not in _ETHERTYPE_VLAN:
            break
        ethertype = int.from_bytes(frame[start + 2 : start + 4], "big")
        start += 4
    return frame[start:] if ethertype in _ETHERTYPE_IP else b""


def _udp_in_ipv4(packet: bytes, reassembler: IpReassembler) -> UdpDatagram | None:
    header_octets = (packet[0] & 0x0F) * 4
    if header_octets < _IPV4.size or len(packet) < header_octets:
        return None
    _, _, total, identification, fragment, _, protocol, _, source_ip, destination_ip = _IPV4.unpack_from(packet)
    if protocol != _UDP or not header_octets <= total <= len(packet):
        return None
    body: bytes | None = packet[header_octets:total]
    if fragment & 0x3FFF:
        key = source_ip + destination_ip + identification.to_bytes(4, "big")
        body = reassembler.add(
            key, IpFragment((fragment & 0x1FFF) * 8, packet[header_octets:total], bool(fragment & 0x2000))
        )
    return _udp_body(LocatorKind.UDPV4, bytes(12) + source_ip, bytes(12) + destination_ip, body)


def _udp_in_ipv6(packet: bytes, reassembler: IpReassembler) -> UdpDatagram | None:
    if len(packet) < _IPV6.size:
        return None
    _, length, next_header, _, source_ip, destination_ip = _IPV6.unpack_from(packet)
    if len(packet) < _IPV6.size + length:
        return None
    body: bytes | None = packet[_IPV6.size : _IPV6.size + length]
    for _ in range(_MAX_EXTENSION_HEADERS):
        if body is None or next_header == _UDP or len(body) < 8:
            break
        if next_header == _FRAGMENT:
            next_header, word = body[0], int.from_bytes(body[2:4], "big")
            key = source_ip + destination_ip + body[4:8]
            body = reassembler.add(key, IpFragment(word & 0xFFF8, body[8:], bool(word & 1)))
        elif next_header in (_HOP_BY_HOP, _ROUTING, _DESTINATION_OPTIONS):
            next_header, body = body[0], body[8 + body[1] * 8 :]
        else:
            return None
    return _udp_body(LocatorKind.UDPV6, source_ip, destination_ip, body) if next_header == _UDP else None


def _udp_body(kind: LocatorKind, source: bytes, destination: bytes, body: bytes | None) -> UdpDatagram | None:
    """The datagram in what an IP packet carries.  Checksums are not looked at: on a loopback nobody fills them in."""
    if body is None or len(body) < _UDP_HEADER.size:
        return None
    source_port, destination_port, length, _ = _UDP_HEADER.unpack_from(body)
    if not _UDP_HEADER.size <= length <= len(body):
        return None
    return UdpDatagram(
        Locator(kind, source_port, source),
        Locator(kind, destination_port, destination),
        body[_UDP_HEADER.size : length],
    )
