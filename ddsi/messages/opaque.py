"""Submessages whose inside is not read here: those of DDS Security, the HeaderExtension, and unknown ones.

DDS-Security 1.1 §7.3.6 (envelopes), RTPS 2.5 §8.3.7 (HeaderExtension).  Their flags and octets are kept as they came,
so that who understands them (the security plugins), or prints them, has them unchanged.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass, field

from ..serialization.cursor import Octets
from .raw_submessage import LITTLE_ENDIAN, SubmessageKind

__all__ = ["HeaderExtension", "Opaque", "Unknown"]

_HEAD = {True: struct.Struct("<BBH"), False: struct.Struct(">BBH")}


def _encode(kind: int, flags: int, body: Octets) -> bytes:
    # The flag E, which is part of the flags, rules: a body that cannot be read cannot be swapped either.
    padding = -len(body) % 4
    head = _HEAD[bool(flags & LITTLE_ENDIAN)].pack(kind, flags, len(body) + padding)
    return b"".join((head, body, bytes(padding)))


@dataclass(frozen=True, slots=True)
class Opaque:
    """An envelope of DDS Security: SEC_PREFIX, SEC_BODY, SEC_POSTFIX, SRTPS_PREFIX or SRTPS_POSTFIX."""

    kind: int
    flags: int
    body: Octets = field(repr=False)

    def encode(self, *, little_endian: bool = True) -> bytes:
        """As it came: the byte order is that of ``flags``, whatever is asked for."""
        return _encode(self.kind, self.flags, self.body)


@dataclass(frozen=True, slots=True)
class Unknown:
    """A submessage of a later version, or (from 0x80 on) of some vendor; it is skipped (RTPS 2.5 §8.3.4.1)."""

    kind: int
    flags: int
    body: Octets = field(repr=False)

    @property
    def is_vendor_specific(self) -> bool:
        return self.kind >= 0x80

    def encode(self, *, little_endian: bool = True) -> bytes:
        """As it came: the byte order is that of ``flags``, whatever is asked for."""
        return _encode(self.kind, self.flags, self.body)


@dataclass(frozen=True, slots=True)
class HeaderExtension:
    """More about the message as a whole (RTPS 2.5 §8.3.7); received and skipped.

    Never sent: what it can carry is optional, and receivers of earlier versions gain nothing from it.
    """

    flags: int
    body: Octets = field(repr=False)

    def encode(self, *, little_endian: bool = True) -> bytes:
        """As it came: the byte order is that of ``flags``, whatever is asked for."""
        return _encode(SubmessageKind.HEADER_EXTENSION, self.flags, self.body)

    @classmethod
    def decode(cls, flags: int, body: Octets) -> HeaderExtension:
        return cls(flags, body)
