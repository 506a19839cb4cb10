"""Envelopes: a submessage between SEC_PREFIX and SEC_POSTFIX, a message between SRTPS_PREFIX and SRTPS_POSTFIX.

DDS-Security 1.1 §7.3.6.3 to §7.3.6.8 (submessages), §9.5.2.3 to §9.5.2.5 (CryptoHeader, CryptoContent, CryptoFooter).

    0        8        16                32
    +--------+--------+-----------------+
    | PREFIX | flags  | 20              |
    +--------+--------+-----------------+
    | CryptoHeader, 20 octets           |
    +--------+--------+-----------------+  GMAC: in the place of SEC_BODY, what is protected as it was
    | SEC_BODY, flags | length          |
    +--------+--------+-----------------+
    | u32 n, big-endian                 |
    | cipher text, n octets             |
    | padding to a multiple of 4        |
    +--------+--------+-----------------+
    | POSTFIX| flags  | 20 + 20 * count |
    +--------+--------+-----------------+
    | common_mac, 16 octets             |
    | u32 count, big-endian             |
    | count times: key id (4), mac (16) |
    +-----------------------------------+

Flag E is the byte order of these submessage headers alone.  We write little-endian, and every length; others write
big-endian, or 0 as the length of a postfix that ends the message, and all of that is read.

Here is where the parts lie.  :mod:`.sealing` puts things into envelopes, :mod:`.opening` takes them out.
"""

from __future__ import annotations

import struct
from functools import lru_cache
from typing import Final

from ddsi.messages.raw_submessage import SubmessageKind
from ddsi.serialization.cursor import Octets
from ddsi.structure.errors import MalformedMessage

from .transformation import HEADER_LENGTH, KEY_ID_LENGTH, MAC_LENGTH, Protection, TransformationKind

__all__ = [
    "ENVELOPE_KINDS",
    "FOOTER_LENGTH",
    "HEAD",
    "LONGEST_BODY",
    "MAY_BE_EMPTY",
    "MESSAGE",
    "RECEIVER_MAC_LENGTH",
    "SEC_BODY",
    "SUBMESSAGE",
    "Envelope",
    "body_head",
    "message_overhead",
    "read_envelope",
    "read_key_id",
    "receiver_key_ids",
    "submessage_overhead",
    "swapped",
]

FOOTER_LENGTH: Final = MAC_LENGTH + 4
"""Without receiver-specific MACs."""
RECEIVER_MAC_LENGTH: Final = KEY_ID_LENGTH + MAC_LENGTH
LONGEST_BODY: Final = 0xFFFC
"""octetsToNextHeader has 16 bits, and is a multiple of 4."""

HEAD: Final = struct.Struct("<BBH")
_PREFIX_AND_BODY: Final = struct.Struct("<4s4s4s12sBBH4s")
_POSTFIX: Final = struct.Struct("<4s16s4s")
_NO_MACS: Final = bytes(4)
_PREFIX_LENGTH: Final = HEAD.size + HEADER_LENGTH
_BODY_LENGTH: Final = _PREFIX_AND_BODY.size - _PREFIX_LENGTH
"""Of SEC_BODY up to the cipher text."""
_POSTFIX_LENGTH: Final = _POSTFIX.size
"""Without receiver-specific MACs."""
_LONGEST_PADDING: Final = 3

# As plain numbers, which compare quicker.
SEC_BODY: Final = int(SubmessageKind.SEC_BODY)
ENVELOPE_KINDS: Final = frozenset(range(SubmessageKind.SEC_BODY, SubmessageKind.SRTPS_POSTFIX + 1))
MAY_BE_EMPTY: Final = (int(SubmessageKind.PAD), int(SubmessageKind.INFO_TS))

_ENCRYPTED_KINDS: Final = frozenset(kind.to_wire() for kind in TransformationKind if kind.encrypts)

Parts = tuple[bytes, bytes, bytes, int, int, bytes, int, int]
"""CryptoHeader: kind (4 octets), key id, nonce (12), which begins with the session id; where the protected octets begin
and end; CryptoFooter: the common MAC, and where the receiver-specific MACs begin and end.

A plain tuple, as every protected submessage that comes is taken apart so.
"""


class Envelope:
    """The submessage kinds that protected octets lie between."""

    __slots__ = ("name", "postfix", "postfix_head", "prefix", "prefix_head", "prefix_heads")

    def __init__(self, prefix: SubmessageKind, postfix: SubmessageKind) -> None:
        self.name = prefix.name.partition("_")[0]
        self.prefix = int(prefix)
        self.postfix = int(postfix)
        self.prefix_head = HEAD.pack(prefix, 1, HEADER_LENGTH)
        self.prefix_heads = (self.prefix_head, struct.pack(">BBH", prefix, 0, HEADER_LENGTH))
        self.postfix_head = HEAD.pack(postfix, 1, FOOTER_LENGTH)


SUBMESSAGE: Final = Envelope(SubmessageKind.SEC_PREFIX, SubmessageKind.SEC_POSTFIX)
MESSAGE: Final = Envelope(SubmessageKind.SRTPS_PREFIX, SubmessageKind.SRTPS_POSTFIX)


def submessage_overhead(protection: Protection | None, receivers: int) -> int:
    """What an envelope adds at most to a submessage, in octets."""
    if protection is None:
        return 0
    body = _BODY_LENGTH + _LONGEST_PADDING if protection.encrypted else 0
    macs = RECEIVER_MAC_LENGTH * receivers if protection.origin_authenticated else 0
    return _PREFIX_LENGTH + body + _POSTFIX_LENGTH + macs


def message_overhead(protection: Protection | None, receivers: int) -> int:
    """What an envelope adds at most to a message, in octets: an INFO_SRC comes in addition."""
    return submessage_overhead(protection, receivers) + (HEAD.size + 20 if protection is not None else 0)


# Few lengths are in use at a time, and to look one up is quicker than to pack it.
@lru_cache(maxsize=256)
def body_head(length: int) -> bytes:
    """SEC_BODY up to the cipher text, which has so many octets."""
    return HEAD.pack(SEC_BODY, 1, 4 + length + (-length & 3)) + length.to_bytes(4, "big")


# --- reading: untrusted.  Raises MalformedMessage, and struct.error where the octets end before the envelope does.


def read_key_id(envelope: Envelope, octets: Octets, at: int) -> bytes:
    """The key id in the CryptoHeader of the prefix at ``octets[at]``."""
    if bytes(octets[at : at + HEAD.size]) not in envelope.prefix_heads or len(octets) < at + _PREFIX_LENGTH:
        raise MalformedMessage(f"no {envelope.name}_PREFIX", element="envelope", offset=at)
    return bytes(octets[at + 8 : at + 12])


def read_envelope(envelope: Envelope, octets: Octets, at: int) -> Parts:
    """The parts of the envelope that begins at ``octets[at]``; whether it is encrypted its own kind says."""
    head, kind_octets, key_id, nonce, kind, flags, length, count = _PREFIX_AND_BODY.unpack_from(octets, at)
    if head not in envelope.prefix_heads:
        raise MalformedMessage(f"no {envelope.name}_PREFIX", element="envelope", offset=at)
    content_at = at + _PREFIX_LENGTH
    if kind_octets in _ENCRYPTED_KINDS:
        postfix_at = content_at + 4 + (length if flags & 1 else swapped(length))
        content_at += _BODY_LENGTH
        content_end = content_at + int.from_bytes(count, "big")
        if kind != SEC_BODY or not 0 <= postfix_at - content_end <= _LONGEST_PADDING:
            raise MalformedMessage("no SEC_BODY with as much as it says", element="envelope", offset=content_at)
    else:
        content_end = postfix_at = _find_postfix(envelope, octets, content_at)
    head, mac, count = _POSTFIX.unpack_from(octets, postfix_at)
    if head == envelope.postfix_head and count == _NO_MACS:
        macs_at = postfix_at + _POSTFIX_LENGTH
        return kind_octets, key_id, nonce, content_at, content_end, mac, macs_at, macs_at
    macs_length, is_last = _macs_length(envelope.postfix, head, count)
    macs_at = postfix_at + _POSTFIX_LENGTH
    end = macs_at + macs_length
    if macs_length < 0 or end > len(octets) or (is_last and end != len(octets)):
        reason = f"no {envelope.name}_POSTFIX with as many MACs as it says"
        raise MalformedMessage(reason, element="envelope", offset=postfix_at)
    return kind_octets, key_id, nonce, content_at, content_end, mac, macs_at, end


def receiver_key_ids(octets: Octets) -> frozenset[bytes]:
    """Whom the submessage in this envelope bears MACs for."""
    *_, macs_at, end = read_envelope(SUBMESSAGE, octets, 0)
    return frozenset(bytes(octets[at : at + KEY_ID_LENGTH]) for at in range(macs_at, end, RECEIVER_MAC_LENGTH))


# Postfixes are much alike: to look one up is quicker than to take it apart.
@lru_cache(maxsize=256)
def _macs_length(kind: int, head: bytes, count: bytes) -> tuple[int, bool]:
    """Octets of the receiver-specific MACs, by the postfix's head and its count; below 0 if these do not agree.

    And whether it is the last submessage of all, as a length of 0 says.
    """
    found, flags, length = HEAD.unpack(head)
    macs_length = int.from_bytes(count, "big") * RECEIVER_MAC_LENGTH
    if not flags & 1:
        length = swapped(length)
    if found != kind or length not in (0, FOOTER_LENGTH + macs_length):
        return -1, False
    return macs_length, length == 0


def swapped(length: int) -> int:
    """A length of 16 bits that was read in the wrong byte order."""
    return length >> 8 | (length & 0xFF) << 8


def _find_postfix(envelope: Envelope, octets: Octets, at: int) -> int:
    """Where the postfix begins that ends the submessages in clear from ``octets[at]`` on.

    A message nearly always ends so, and to look there first spares the walk.  Who was misled would find that the MAC,
    which covers all up to the postfix, is wrong.
    """
    last = len(octets) - _POSTFIX_LENGTH
    if (
        envelope is MESSAGE
        and last >= at
        and octets[last : last + HEAD.size] == envelope.postfix_head
        and octets[-4:] == _NO_MACS
    ):
        return last
    while True:
        kind, flags, length = HEAD.unpack_from(octets, at)
        if kind == envelope.postfix:
            return at
        # A length of 0 says "to the end of the message", where no postfix can follow.
        if kind == envelope.prefix or (length == 0 and kind not in MAY_BE_EMPTY):
            raise MalformedMessage(f"no {envelope.name}_POSTFIX", element="envelope", offset=at)
        at += 4 + (length if flags & 1 else swapped(length))
