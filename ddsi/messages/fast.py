"""Short forms for what makes up nearly all traffic: DATA and HEARTBEAT, little-endian, without inline QoS.

RTPS 2.5 §9.4.5.3, §9.4.5.6.  The classes in ``submessages`` are the general form; a test holds both against each other.
"""

from __future__ import annotations

import struct

__all__ = ["DATA_BODY", "SUBMESSAGE_HEAD", "data_head", "heartbeat", "timestamp"]

_TIMESTAMP = struct.Struct("<BBHII")
_DATA_HEAD = struct.Struct("<BBHHH4s4siI")
_HEARTBEAT = struct.Struct("<BBH4s4siIiII")

SUBMESSAGE_HEAD = struct.Struct("<BBH")
"""kind, flags, octetsToNextHeader."""
DATA_BODY = struct.Struct("<HH4s4siI")
"""extraFlags, octetsToInlineQos, readerId, writerId, writerSN (high, low)."""


def timestamp(ticks: int) -> bytes:
    """INFO_TS, 12 octets."""
    return _TIMESTAMP.pack(0x09, 0x01, 8, ticks >> 32, ticks & 0xFFFFFFFF)


def data_head(reader_id: bytes, writer_id: bytes, sequence_number: int, payload_octets: int) -> bytes:
    """The 24 octets of a DATA submessage before its payload of this length (a multiple of 4, with padding)."""
    return _DATA_HEAD.pack(
        0x15, 0x05, 20 + payload_octets if payload_octets < 65516 else 0, 0, 16, reader_id, writer_id,
        sequence_number >> 32, sequence_number & 0xFFFFFFFF,
    )  # fmt: skip


def heartbeat(reader_id: bytes, writer_id: bytes, first: int, last: int, count: int, *, final: bool) -> bytes:
    """HEARTBEAT, 32 octets."""
    return _HEARTBEAT.pack(
        0x07, 0x03 if final else 0x01, 28, reader_id, writer_id,
        first >> 32, first & 0xFFFFFFFF, last >> 32, last & 0xFFFFFFFF, count & 0xFFFFFFFF,
    )  # fmt: skip
