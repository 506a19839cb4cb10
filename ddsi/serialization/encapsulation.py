"""The four octets before every serialised payload: which encoding, which byte order, how much padding.

RTPS 2.5 §10.2 (Identifying the payload's encapsulation), DDS-XTypes 1.3 §7.6.3.1.2.  The identifier itself
is big endian whatever follows; the low two bits of the options are the number of octets (0 to 3) that
were appended to reach a multiple of 4.  What is inside the payload is not looked at here.
"""

from __future__ import annotations

from enum import IntEnum
from typing import NamedTuple

from ..structure.errors import MalformedMessage
from .cursor import Octets

__all__ = ["HEADER_LENGTH", "Encapsulation", "EncapsulationHeader", "decode_encapsulation", "encode_encapsulation"]

HEADER_LENGTH = 4
_PADDING_BITS = 0x0003


class Encapsulation(IntEnum):
    """RepresentationIdentifier; the low bit is the byte order.  XML (0004, 0005) is not supported."""

    CDR_BE = 0x0000
    CDR_LE = 0x0001
    PL_CDR_BE = 0x0002
    PL_CDR_LE = 0x0003
    CDR2_BE = 0x0006
    CDR2_LE = 0x0007
    D_CDR2_BE = 0x0008
    D_CDR2_LE = 0x0009
    PL_CDR2_BE = 0x000A
    PL_CDR2_LE = 0x000B

    @property
    def little_endian(self) -> bool:
        return bool(self & 1)

    @property
    def xcdr_version(self) -> int:
        """1 or 2."""
        return 1 if self < Encapsulation.CDR2_BE else 2


class EncapsulationHeader(NamedTuple):
    """The header as read; ``options`` are all 16 bits, ``padding`` the low two of them."""

    encapsulation: Encapsulation
    options: int

    @property
    def padding(self) -> int:
        """Octets at the end of the payload that are no part of the sample, 0 to 3, if the writer set it."""
        return self.options & _PADDING_BITS


_KINDS = {int(kind): kind for kind in Encapsulation}


def encode_encapsulation(encapsulation: Encapsulation, *, padding: int = 0) -> bytes:
    """The header's four octets; ``padding`` is 0 to 3."""
    if not 0 <= padding <= _PADDING_BITS:
        raise ValueError(f"0 to 3 octets pad a payload to a multiple of 4, not {padding}")
    return bytes((0, encapsulation, 0, padding))


def decode_encapsulation(payload: Octets) -> EncapsulationHeader:
    """Read the header from the first four octets of ``payload``; an unknown identifier is malformed."""
    if len(payload) < HEADER_LENGTH:
        reason = f"a payload of {len(payload)} octets has no room for its encapsulation header"
        raise MalformedMessage(reason, element="encapsulation", offset=0)
    identifier = payload[0] << 8 | payload[1]
    encapsulation = _KINDS.get(identifier)
    if encapsulation is None:
        raise MalformedMessage(f"unknown representation {identifier:04x}", element="encapsulation", offset=0)
    return EncapsulationHeader(encapsulation, payload[2] << 8 | payload[3])
