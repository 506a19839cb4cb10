"""Short forms for what makes up nearly all traffic: DATA and HEARTBEAT, little-endian, and SEC_ envelopes around one.

RTPS 2.5 §9.4.5.3, §9.4.5.6; DDS-Security 1.1 §7.3.6.3.  The classes in ``submessages`` and ``iterate_submessages`` are
the general form; a test holds both against each other.
"""

from __future__ import annotations

import struct

from ..serialization.cursor import Octets
from .raw_submessage import SubmessageKind

__all__ = [
    "DATA_BODY",
    "SENDER_AT",
    "SUBMESSAGE_HEAD",
    "data_frag_head",
    "data_head",
    "data_head_with_key_hash",
    "envelope_end",
    "heartbeat",
    "key_hash_alone",
    "timestamp",
]

_TIMESTAMP = struct.Struct("<BBHII")
_DATA_HEAD = struct.Struct("<BBHHH4s4siI")
_DATA_FRAG_HEAD = struct.Struct("<BBHHH4s4siIIHHI")
_DATA_HEAD_WITH_KEY_HASH = struct.Struct("<BBHHH4s4siIHH16sI")
_KEY_HASH_QOS = struct.Struct("<HH16sI")
_KEY_HASH, _SENTINEL = 0x0070, 0x0001
_HEARTBEAT = struct.Struct("<BBH4s4siIiII")

_SEC_POSTFIX = int(SubmessageKind.SEC_POSTFIX)

SUBMESSAGE_HEAD = struct.Struct("<BBH")
"""kind, flags, octetsToNextHeader."""
DATA_BODY = struct.Struct("<HH4s4siI")
"""extraFlags, octetsToInlineQos, readerId, writerId, writerSN (high, low)."""

SENDER_AT = {
    int(SubmessageKind.DATA): 12,
    int(SubmessageKind.DATA_FRAG): 12,
    int(SubmessageKind.HEARTBEAT): 8,
    int(SubmessageKind.HEARTBEAT_FRAG): 8,
    int(SubmessageKind.GAP): 8,
    int(SubmessageKind.ACKNACK): 4,
    int(SubmessageKind.NACK_FRAG): 4,
}
"""Where in a submessage, its header included, the id of the entity stands that sent it."""


def timestamp(ticks: int) -> bytes:
    """INFO_TS, 12 octets."""
    return _TIMESTAMP.pack(0x09, 0x01, 8, ticks >> 32, ticks & 0xFFFFFFFF)


def data_head(reader_id: bytes, writer_id: bytes, sequence_number: int, payload_octets: int) -> bytes:
    """The 24 octets of a DATA submessage before its payload of this length (a multiple of 4, with padding)."""
    return _DATA_HEAD.pack(
        0x15, 0x05, 20 + payload_octets if payload_octets < 65516 else 0, 0, 16, reader_id, writer_id,
        sequence_number >> 32, sequence_number & 0xFFFFFFFF,
    )  # fmt: skip


def data_head_with_key_hash(
    reader_id: bytes, writer_id: bytes, sequence_number: int, key_hash: bytes, payload_octets: int
) -> bytes:
    """The same with an inline QoS that holds a key hash (16 octets) and nothing else: 48 octets."""
    return _DATA_HEAD_WITH_KEY_HASH.pack(
        0x15, 0x07, 44 + payload_octets if payload_octets < 65492 else 0, 0, 16, reader_id, writer_id,
        sequence_number >> 32, sequence_number & 0xFFFFFFFF, _KEY_HASH, 16, key_hash, _SENTINEL,
    )  # fmt: skip


def data_frag_head(
    reader_id: bytes, writer_id: bytes, sequence_number: int, first: int, count: int, fragment_size: int,
    sample_size: int, key_hash: bytes, payload_octets: int,
) -> bytes:  # fmt: skip
    """The 36 octets of a DATA_FRAG before its payload, and 24 of an inline QoS that holds ``key_hash`` if it is not
    empty."""
    qos = _KEY_HASH_QOS.pack(_KEY_HASH, 16, key_hash, _SENTINEL) if key_hash else b""
    return _DATA_FRAG_HEAD.pack(
        0x16, 0x03 if key_hash else 0x01, 32 + len(qos) + payload_octets, 0, 28, reader_id, writer_id,
        sequence_number >> 32, sequence_number & 0xFFFFFFFF, first, count, fragment_size, sample_size,
    ) + qos  # fmt: skip


def key_hash_alone(octets: Octets, start: int, end: int, fixed: int = 20) -> bytes:
    """The key hash in the inline QoS of the body at ``octets[start:end]``; empty if that holds anything else.

    ``fixed``: octets of the body before its inline QoS, as a rule: 20 in DATA, 32 in DATA_FRAG.
    """
    if end - start < fixed + 24 or octets[start + 2] != fixed - 4 or octets[start + 3]:
        return b""
    parameter, length, key_hash, sentinel = _KEY_HASH_QOS.unpack_from(octets, start + fixed)
    return key_hash if parameter == _KEY_HASH and length == 16 and sentinel == _SENTINEL else b""


def envelope_end(octets: Octets, start: int, end: int) -> int:
    """Where the envelope ends whose SEC_PREFIX is at ``octets[start]``, if it is all little-endian and holds one
    submessage, with its length; else 0.
    """
    if end - start < 32:
        return 0
    kind, flags, length = SUBMESSAGE_HEAD.unpack_from(octets, start + 24)
    postfix: int = start + 28 + length
    if kind == _SEC_POSTFIX or not flags & 1 or not length or length & 3 or end - postfix < 4:
        return 0
    kind, flags, length = SUBMESSAGE_HEAD.unpack_from(octets, postfix)
    if kind != _SEC_POSTFIX or not flags & 1 or not length or length & 3 or end - postfix < 4 + length:
        return 0
    past: int = postfix + 4 + length
    return past


def heartbeat(reader_id: bytes, writer_id: bytes, first: int, last: int, count: int, *, final: bool) -> bytes:
    """HEARTBEAT, 32 octets."""
    return _HEARTBEAT.pack(
        0x07, 0x03 if final else 0x01, 28, reader_id, writer_id,
        first >> 32, first & 0xFFFFFFFF, last >> 32, last & 0xFFFFFFFF, count & 0xFFFFFFFF,
    )  # fmt: skip
