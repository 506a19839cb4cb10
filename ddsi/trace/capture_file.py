"""Reads pcap and pcapng files into UDP datagrams, in the order of the file.

The classic libpcap format (micro- and nanoseconds, both byte orders) and IETF draft-ietf-opsawg-pcapng (several
sections, interfaces, resolutions).  The file is untrusted: every length is bounded before it is believed, and what
breaks the format raises MalformedMessage with the offset.  Frames that hold no whole UDP datagram are passed over.
Writing is ``pcapng``'s.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Protocol

from ..structure.errors import MalformedMessage
from ..structure.guid import GuidPrefix
from ..structure.locator import Locator
from .events import MessageSent
from .ip_fragments import IpReassembler
from .ip_packet import udp_datagram_of_frame
from .pcapng import (
    BLOCK_ENHANCED_PACKET,
    BLOCK_INTERFACE_DESCRIPTION,
    BLOCK_SECTION_HEADER,
    BYTE_ORDER_MAGIC,
)

__all__ = ["BinarySource", "CapturedDatagram", "captured_messages", "read_capture"]

_NANOSECONDS = 1_000_000_000
# A frame of a loopback holds 64 KiB and its headers; blocks of names or secrets are larger, and skipped.
_MAX_FRAME_OCTETS = 1 << 18
_MAX_BLOCK_OCTETS = 1 << 24
_MAX_INTERFACES = 1 << 12

_BLOCK_SIMPLE_PACKET = 3
_OPTION_END, _OPTION_RESOLUTION, _OPTION_OFFSET = 0, 9, 14
_PCAP_MAGICS = {
    b"\xa1\xb2\xc3\xd4": (">", 1000),
    b"\xd4\xc3\xb2\xa1": ("<", 1000),
    b"\xa1\xb2\x3c\x4d": (">", 1),
    b"\x4d\x3c\xb2\xa1": ("<", 1),
}
"""First four octets: the byte order, and nanoseconds per unit of the fraction."""


class BinarySource(Protocol):
    """The part of a binary stream that is read."""

    def read(self, count: int, /) -> bytes: ...


@dataclass(frozen=True, slots=True)
class CapturedDatagram:
    """``time_ns``: nanoseconds since 1970, or since whatever the file counts from."""

    time_ns: int
    source: Locator
    destination: Locator
    octets: bytes


@dataclass(frozen=True, slots=True)
class _Frame:
    time_ns: int
    link_type: int
    octets: bytes


def read_capture(stream: BinarySource) -> Iterator[CapturedDatagram]:
    """Every UDP datagram of a pcap or pcapng file, read from the stream as they are asked for.

    Raises MalformedMessage where the file breaks its format or ends within a packet.
    """
    source = _Source(stream)
    magic = source.take(4, "magic number")
    if magic in _PCAP_MAGICS:
        frames = _pcap_frames(source, *_PCAP_MAGICS[magic])
    elif magic == BLOCK_SECTION_HEADER.to_bytes(4, "big"):
        frames = _PcapngReader(source).frames()
    else:
        raise MalformedMessage("neither pcap nor pcapng", element="magic number", offset=0)
    reassembler = IpReassembler()
    for frame in frames:
        datagram = udp_datagram_of_frame(frame.link_type, frame.octets, reassembler)
        if datagram is not None:
            yield CapturedDatagram(frame.time_ns, datagram.source, datagram.destination, datagram.octets)


def captured_messages(datagrams: Iterable[CapturedDatagram]) -> Iterator[MessageSent]:
    """The RTPS messages among the datagrams, as sent by whom their header names.

    ``now`` counts from the file's first datagram.
    """
    start_ns: int | None = None
    for datagram in datagrams:
        start_ns = datagram.time_ns if start_ns is None else start_ns
        if datagram.octets[:4] == b"RTPS" and len(datagram.octets) >= 20:
            now = (datagram.time_ns - start_ns) / _NANOSECONDS
            yield MessageSent(now, GuidPrefix(datagram.octets[8:20]), (datagram.destination,), datagram.octets)


class _Source:
    """A stream that knows where it is and never gives less than it was asked for."""

    def __init__(self, stream: BinarySource) -> None:
        self._stream = stream
        self.offset = 0

    def take(self, count: int, element: str) -> bytes:
        octets = self.take_or_end(count, element)
        if len(octets) < count:
            raise MalformedMessage(f"{count} octets wanted, the file ends", element=element, offset=self.offset)
        return octets

    def take_or_end(self, count: int, element: str) -> bytes:
        """As ``take``, but nothing at all where the file ends right here."""
        parts: list[bytes] = []
        missing = count
        while missing and (part := self._stream.read(missing)):
            parts.append(part)
            missing -= len(part)
        octets = b"".join(parts)
        if octets and missing:
            raise MalformedMessage(f"{count} octets wanted, the file ends", element=element, offset=self.offset)
        self.offset += len(octets)
        return octets


def _pcap_frames(source: _Source, order: str, unit_ns: int) -> Iterator[_Frame]:
    """The file's header (24 octets) and its packets: seconds, fraction, captured and original length, octets."""
    header = source.take(20, "pcap header")
    link_type = struct.unpack(order + "HHiIII", header)[5] & 0xFFFF
    packet = struct.Struct(order + "IIII")
    while fields := source.take_or_end(packet.size, "packet header"):
        seconds, fraction, captured, original = packet.unpack(fields)
        if captured > _MAX_FRAME_OCTETS:
            raise MalformedMessage(f"a frame of {captured} octets", element="packet", offset=source.offset)
        frame = source.take(captured, "packet")
        if captured == original:
            yield _Frame(seconds * _NANOSECONDS + fraction * unit_ns, link_type, frame)


@dataclass(frozen=True, slots=True)
class _Interface:
    link_type: int
    snap_octets: int
    numerator: int
    denominator: int
    offset_ns: int

    def time_ns(self, units: int) -> int:
        return self.offset_ns + units * self.numerator // self.denominator


class _PcapngReader:
    """Blocks one after the other.  The byte order is a section's own, and so are its interfaces."""

    def __init__(self, source: _Source) -> None:
        self._source = source
        self._order = "<"
        self._interfaces: list[_Interface] = []

    def frames(self) -> Iterator[_Frame]:
        self._section()
        while block_type_octets := self._source.take_or_end(4, "block type"):
            # The type of a section header reads the same in both byte orders.
            if block_type_octets == BLOCK_SECTION_HEADER.to_bytes(4, "big"):
                self._section()
                continue
            (block_type,) = self._unpack("I", block_type_octets)
            body = self._body(self._source.take(4, "block length"))
            if block_type == BLOCK_INTERFACE_DESCRIPTION:
                self._add_interface(body)
            elif block_type == BLOCK_ENHANCED_PACKET:
                yield from self._enhanced_packet(body)
            elif block_type == _BLOCK_SIMPLE_PACKET:
                yield from self._simple_packet(body)

    def _section(self) -> None:
        """What follows the block type of a section header; it forgets all interfaces."""
        length = self._source.take(4, "section length")
        magic = self._source.take(4, "byte-order magic")
        orders = {BYTE_ORDER_MAGIC.to_bytes(4, "little"): "<", BYTE_ORDER_MAGIC.to_bytes(4, "big"): ">"}
        if magic not in orders:
            raise self._malformed("no byte-order magic", "section header")
        self._order = orders[magic]
        body = self._body(length, already_read=4)
        if len(body) < 12 or self._unpack("H", body[:2])[0] != 1:
            raise self._malformed("not version 1", "section header")
        self._interfaces = []

    def _body(self, length_octets: bytes, *, already_read: int = 0) -> bytes:
        """The rest of a block after its length field, without the length that stands there once more."""
        (total,) = self._unpack("I", length_octets)
        if total % 4 or not 12 + already_read <= total <= _MAX_BLOCK_OCTETS:
            raise self._malformed(f"a block of {total} octets", "block length")
        body = self._source.take(total - 12 - already_read, "block")
        if self._source.take(4, "block length") != length_octets:
            raise self._malformed("the two lengths of a block differ", "block length")
        return body

    def _add_interface(self, body: bytes) -> None:
        if len(body) < 8 or len(self._interfaces) >= _MAX_INTERFACES:
            raise self._malformed("too short, or too many", "interface description")
        link_type, _, snap_octets = self._unpack("HHI", body[:8])
        numerator, denominator, offset_ns = 1000, 1, 0
        for code, value in self._options(body[8:]):
            if code == _OPTION_RESOLUTION and len(value) == 1:
                base, exponent = (2, value[0] & 0x7F) if value[0] & 0x80 else (10, value[0])
                numerator, denominator = _NANOSECONDS, base ** min(exponent, 128)
            elif code == _OPTION_OFFSET and len(value) == 8:
                offset_ns = self._unpack("q", value)[0] * _NANOSECONDS
        self._interfaces.append(_Interface(link_type, snap_octets, numerator, denominator, offset_ns))

    def _options(self, octets: bytes) -> Iterator[tuple[int, bytes]]:
        at = 0
        while at + 4 <= len(octets):
            code, length = self._unpack("HH", octets[at : at + 4])
            if code == _OPTION_END:
                return
            if at + 4 + length > len(octets):
                raise self._malformed("reaches beyond its block", "option")
            yield code, octets[at + 4 : at + 4 + length]
            at += 4 + length + -length % 4

    def _enhanced_packet(self, body: bytes) -> Iterator[_Frame]:
        if len(body) < 20:
            raise self._malformed("too short", "enhanced packet")
        number, high, low, captured, original = self._unpack("IIIII", body[:20])
        if number >= len(self._interfaces):
            raise self._malformed(f"interface {number} is not described", "enhanced packet")
        if captured > len(body) - 20:
            raise self._malformed("reaches beyond its block", "enhanced packet")
        interface = self._interfaces[number]
        if captured == original:
            yield _Frame(interface.time_ns(high << 32 | low), interface.link_type, body[20 : 20 + captured])

    def _simple_packet(self, body: bytes) -> Iterator[_Frame]:
        """A packet of the first interface without a time; cut where the interface says."""
        if len(body) < 4 or not self._interfaces:
            raise self._malformed("too short, or of no interface", "simple packet")
        (original,) = self._unpack("I", body[:4])
        if original <= len(body) - 4:
            yield _Frame(0, self._interfaces[0].link_type, body[4 : 4 + original])

    def _unpack(self, fields: str, octets: bytes) -> tuple[int, ...]:
        return struct.unpack(self._order + fields, octets)

    def _malformed(self, reason: str, element: str) -> MalformedMessage:
        return MalformedMessage(reason, element=element, offset=self._source.offset)
