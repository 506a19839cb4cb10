"""PcapngSink: the messages of a trace as a capture file that Wireshark and tshark open.

IETF draft-ietf-opsawg-pcapng: Section Header Block, one Interface Description Block per traced participant, one
Enhanced Packet Block per datagram, all little-endian.  Around each message stand fabricated IP and UDP headers (link
type RAW), as the engine knows no others.  Reading capture files is ``capture_file``'s.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Mapping
from typing import Protocol

from ..structure.guid import GuidPrefix
from ..structure.locator import Locator, LocatorKind
from .event import TraceEvent
from .events import MessageReceived, MessageSent
from .ip_packet import LINKTYPE_RAW, MAX_DATAGRAM_OCTETS, udp_packet

__all__ = [
    "BLOCK_ENHANCED_PACKET",
    "BLOCK_INTERFACE_DESCRIPTION",
    "BLOCK_SECTION_HEADER",
    "BYTE_ORDER_MAGIC",
    "BinarySink",
    "PcapngSink",
]

BLOCK_SECTION_HEADER = 0x0A0D0D0A
BLOCK_INTERFACE_DESCRIPTION = 1
BLOCK_ENHANCED_PACKET = 6
BYTE_ORDER_MAGIC = 0x1A2B3C4D

_OPTION_END, _OPTION_COMMENT = 0, 1
_OPTION_SECTION_APPLICATION = 4
_OPTION_INTERFACE_NAME, _OPTION_INTERFACE_RESOLUTION = 2, 9
_OPTION_PACKET_FLAGS = 2
_INBOUND, _OUTBOUND = 1, 2
_NANOSECONDS = 1_000_000_000
_NO_LIMIT = 0
_SECTION_LENGTH_UNKNOWN = -1

_V4_LOOPBACK = Locator.udp_v4("127.0.0.1", 0)
_V6_LOOPBACK = Locator(LocatorKind.UDPV6, 0, bytes(15) + b"\x01")


class BinarySink(Protocol):
    """The part of a binary stream that is written to."""

    def write(self, octets: bytes, /) -> object: ...


class PcapngSink:
    """Writes MessageSent and MessageReceived as packets; every other event is passed over.

    ``epoch_offset``: seconds to add to an event's ``now`` to get seconds since 1970.  ``addresses``: where each traced
    participant sends from and receives (the engine's events do not tell); the loopback's address without.
    ``each_once``: a message received from a participant that this sink also sees sending is left out, as it stands
    in the file already; with False, a datagram appears where it was sent and once more at each receiver.
    ``skipped_count`` counts datagrams too large for UDP (a simulation may allow them).
    """

    def __init__(
        self,
        stream: BinarySink,
        *,
        epoch_offset: float = 0.0,
        addresses: Mapping[GuidPrefix, Locator] | None = None,
        each_once: bool = True,
    ) -> None:
        self._stream = stream
        # In two parts: as one float, seconds since 1970 in nanoseconds would be a quarter of a microsecond off.
        whole_seconds = math.floor(epoch_offset)
        self._epoch_offset_ns = whole_seconds * _NANOSECONDS + round((epoch_offset - whole_seconds) * _NANOSECONDS)
        self._addresses = dict(addresses or {})
        self._each_once = each_once
        self._interfaces: dict[GuidPrefix, int] = {}
        self._senders: set[bytes] = set()
        self._packet_count = 0
        self.skipped_count = 0
        stream.write(_section_header())

    def __call__(self, event: TraceEvent) -> None:
        if isinstance(event, MessageSent):
            self._senders.add(event.octets[8:20])
            for destination in event.destinations:
                source = self._address(event.participant, like=destination)
                self._packet(event, source, destination, event.octets, _OUTBOUND)
        elif isinstance(event, MessageReceived):
            if self._each_once and event.octets[8:20] in self._senders:
                return
            destination = self._address(event.participant, like=event.source)
            self._packet(event, event.source, destination, event.octets, _INBOUND)

    def _address(self, participant: GuidPrefix, *, like: Locator) -> Locator:
        own = self._addresses.get(participant)
        if own is not None and own.kind == like.kind:
            return own
        return _V6_LOOPBACK if like.kind == LocatorKind.UDPV6 else _V4_LOOPBACK

    def _packet(self, event: TraceEvent, source: Locator, destination: Locator, octets: bytes, direction: int) -> None:
        if len(octets) > MAX_DATAGRAM_OCTETS:
            self.skipped_count += 1
            return
        self._packet_count += 1
        packet = udp_packet(source, destination, octets, identification=self._packet_count)
        timestamp = self._epoch_offset_ns + round(event.now * _NANOSECONDS)
        interface = self._interface(event.participant)
        self._stream.write(_enhanced_packet(interface, timestamp, packet, _packet_flags(direction)))

    def _interface(self, participant: GuidPrefix) -> int:
        """The number of the participant's interface, described in the file when it is first used."""
        number = self._interfaces.get(participant)
        if number is None:
            number = self._interfaces[participant] = len(self._interfaces)
            self._stream.write(_interface_description(str(participant)))
        return number


# Blocks: type, total length, body, total length again; everything padded to four octets.


def _section_header() -> bytes:
    body = struct.pack("<IHHq", BYTE_ORDER_MAGIC, 1, 0, _SECTION_LENGTH_UNKNOWN)
    return _block(BLOCK_SECTION_HEADER, body + _options((_OPTION_SECTION_APPLICATION, b"ddsi")))


def _interface_description(name: str) -> bytes:
    body = struct.pack("<HHI", LINKTYPE_RAW, 0, _NO_LIMIT)
    nanoseconds = bytes((9,))  # a time stamp's unit is 10^-9 s
    options = _options((_OPTION_INTERFACE_NAME, name.encode()), (_OPTION_INTERFACE_RESOLUTION, nanoseconds))
    return _block(BLOCK_INTERFACE_DESCRIPTION, body + options)


def _enhanced_packet(interface: int, timestamp: int, packet: bytes, options: bytes) -> bytes:
    high, low = timestamp >> 32 & 0xFFFFFFFF, timestamp & 0xFFFFFFFF
    body = struct.pack("<IIIII", interface, high, low, len(packet), len(packet)) + _padded(packet)
    return _block(BLOCK_ENHANCED_PACKET, body + options)


def _packet_flags(direction: int) -> bytes:
    return _options((_OPTION_PACKET_FLAGS, direction.to_bytes(4, "little")))


def _options(*options: tuple[int, bytes]) -> bytes:
    parts = [struct.pack("<HH", code, len(value)) + _padded(value) for code, value in options]
    return b"".join((*parts, struct.pack("<HH", _OPTION_END, 0)))


def _block(block_type: int, body: bytes) -> bytes:
    total = struct.pack("<I", len(body) + 12)
    return struct.pack("<I", block_type) + total + body + total


def _padded(octets: bytes) -> bytes:
    return octets + bytes(-len(octets) % 4)
