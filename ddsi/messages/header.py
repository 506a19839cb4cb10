"""The header of an RTPS message: who sent it, in which dialect.  RTPS 2.5 §8.3.3.1, §8.3.6, §9.4.4."""

from __future__ import annotations

from ..serialization.cursor import Octets
from ..structure.dataclass import dataclass
from ..structure.errors import MalformedMessage
from ..structure.guid import GuidPrefix
from ..structure.vendor import VendorId

__all__ = ["HEADER_LENGTH", "Header"]

HEADER_LENGTH = 20
_MAGIC = b"RTPS"
_MAJOR_VERSION = 2


@dataclass(frozen=True, slots=True)
class Header:
    """The first 20 octets of every message; nothing in it has a byte order.

    0        8        16       24       32
    +--------+--------+--------+--------+
    | 'R'    | 'T'    | 'P'    | 'S'    |
    +--------+--------+--------+--------+
    | major  | minor  | vendorId        |
    +--------+--------+--------+--------+
    | guidPrefix, 12 octets             |
    +-----------------------------------+
    """

    protocol_version: tuple[int, int]
    vendor_id: VendorId
    guid_prefix: GuidPrefix

    def encode(self) -> bytes:
        return _MAGIC + bytes(self.protocol_version) + self.vendor_id + self.guid_prefix

    @classmethod
    def decode(cls, datagram: Octets) -> Header:
        """Read the header at the start of ``datagram``.

        Malformed, and the datagram to be dropped in silence: under 20 octets, not "RTPS", another major
        version than 2 (RTPS 2.5 §8.3.6.3).  A higher minor version is understood as the one we know.
        """
        octets = bytes(datagram[:HEADER_LENGTH])
        if len(octets) < HEADER_LENGTH or octets[:4] != _MAGIC:
            raise MalformedMessage("not an RTPS message", element="Header", offset=0)
        if octets[4] != _MAJOR_VERSION:
            raise MalformedMessage(f"RTPS version {octets[4]}.{octets[5]}", element="Header", offset=4)
        return cls((octets[4], octets[5]), octets[6:8], GuidPrefix(octets[8:20]))
