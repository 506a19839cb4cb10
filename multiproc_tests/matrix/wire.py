"""The secured submessages of a capture, taken apart as far as can be without keys.  DDS-Security 1.1 §7.3.6, §9.5.2.3.

    RTPS header | SRTPS_PREFIX(CryptoHeader) | SEC_BODY, or submessages in clear  | SRTPS_POSTFIX(CryptoFooter)
                | SEC_PREFIX(CryptoHeader)   | SEC_BODY, or one submessage in clear | SEC_POSTFIX(CryptoFooter) | ...

Written for the tests alone, without a line of ours that could share a mistake with what is tested.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass

__all__ = ["CryptoHeader", "Message", "Submessage", "read_message"]

HEADER_OCTETS = 20
SEC_BODY, SEC_PREFIX, SEC_POSTFIX, SRTPS_PREFIX, SRTPS_POSTFIX = 0x30, 0x31, 0x32, 0x33, 0x34
DATA, DATA_FRAG = 0x15, 0x16

_WRITER_ID_AT = {0x06: 4, 0x07: 4, 0x08: 4, 0x12: 4, 0x13: 4, DATA: 8, DATA_FRAG: 8}
"""Where an ACKNACK, HEARTBEAT, GAP, NACK_FRAG, HEARTBEAT_FRAG, DATA or DATA_FRAG names its writer."""

_LITTLE_ENDIAN, _INLINE_QOS, _DATA, _KEY = 0x01, 0x02, 0x04, 0x08
_SENTINEL = 1
_OCTETS_OF_MAC, _OCTETS_OF_RECEIVER_MAC = 16, 20


@dataclass(frozen=True, slots=True)
class CryptoHeader:
    """``kind``: 1 and 3 sign (AES-GMAC), 2 and 4 encrypt (AES-GCM), 0 neither.  ``key_id`` 0: of the volatile topic."""

    kind: int
    key_id: bytes

    @property
    def is_volatile(self) -> bool:
        return self.key_id == bytes(4)

    @property
    def is_encrypted(self) -> bool:
        return self.kind in (2, 4)

    @property
    def is_signed(self) -> bool:
        return self.kind in (1, 3)


@dataclass(frozen=True, slots=True)
class Submessage:
    """``header`` and ``receiver_macs``: of the SEC_PREFIX and SEC_POSTFIX around it, if it is between two."""

    kind: int
    flags: int
    body: bytes
    header: CryptoHeader | None = None
    receiver_macs: int = 0

    @property
    def writer_id(self) -> bytes | None:
        """Of those that name one, in clear."""
        offset = _WRITER_ID_AT.get(self.kind)
        return None if offset is None else self.body[offset : offset + 4]

    @property
    def payload(self) -> bytes:
        """Of a DATA or DATA_FRAG: what stands behind the inline QoS, or behind the fixed part if there is none.

        Nothing of a DATA that has neither data nor a key, by which Fast DDS disposes.
        """
        if self.kind == DATA and not self.flags & (_DATA | _KEY):
            return b""
        order = "<" if self.flags & _LITTLE_ENDIAN else ">"
        (to_inline_qos,) = struct.unpack_from(order + "H", self.body, 2)
        at = 4 + to_inline_qos
        while self.flags & _INLINE_QOS:
            parameter, length = struct.unpack_from(order + "HH", self.body, at)
            at += 4
            if parameter == _SENTINEL:
                break
            at += length
        return self.body[at:]


@dataclass(frozen=True, slots=True)
class Message:
    """One datagram.  With ``header`` it is protected as a whole, and ``submessages`` are those that are in clear."""

    octets: bytes
    header: CryptoHeader | None
    receiver_macs: int
    submessages: tuple[Submessage, ...]

    @property
    def prefix(self) -> bytes:
        return self.octets[8:HEADER_OCTETS]


def read_message(octets: bytes) -> Message | None:
    """None for what is no RTPS, such as the single octets that Cyclone DDS sends itself when it stops."""
    if octets[:4] != b"RTPS":
        return None
    raw = list(_split(octets))
    header, macs = None, 0
    for kind, _, body in raw:
        if kind == SRTPS_PREFIX:
            header = _crypto_header(body)
        elif kind == SRTPS_POSTFIX:
            macs = _receiver_macs(body)
    return Message(octets, header, macs, tuple(_pair_up(raw)))


def _split(octets: bytes) -> Iterator[tuple[int, int, bytes]]:
    """Submessages as kind, flags, body; a length of 0 of the last one means all that is left."""
    offset = HEADER_OCTETS
    while offset + 4 <= len(octets):
        kind, flags = octets[offset], octets[offset + 1]
        length = int.from_bytes(octets[offset + 2 : offset + 4], "little" if flags & _LITTLE_ENDIAN else "big")
        end = offset + 4 + length if length or kind in (0x01, 0x09) else len(octets)
        yield kind, flags, octets[offset + 4 : end]
        offset = end


def _pair_up(raw: list[tuple[int, int, bytes]]) -> Iterator[Submessage]:
    for at, (kind, flags, body) in enumerate(raw):
        if kind in (SEC_PREFIX, SEC_POSTFIX, SRTPS_PREFIX, SRTPS_POSTFIX):
            continue
        is_wrapped = 0 < at < len(raw) - 1 and raw[at - 1][0] == SEC_PREFIX and raw[at + 1][0] == SEC_POSTFIX
        header = _crypto_header(raw[at - 1][2]) if is_wrapped else None
        macs = _receiver_macs(raw[at + 1][2]) if is_wrapped else 0
        yield Submessage(kind, flags, body, header, macs)


def _crypto_header(body: bytes) -> CryptoHeader:
    return CryptoHeader(int.from_bytes(body[:4], "big"), body[4:8])


def _receiver_macs(footer: bytes) -> int:
    """How many stand behind the common MAC: as a big-endian number before them, checked against the length."""
    count = int.from_bytes(footer[_OCTETS_OF_MAC : _OCTETS_OF_MAC + 4], "big")
    assert len(footer) >= _OCTETS_OF_MAC + 4 + count * _OCTETS_OF_RECEIVER_MAC
    return count
