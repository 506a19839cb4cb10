"""Where a message's submessages begin and end.  RTPS 2.5 §8.3.3.3, §9.4.5.1 (SubmessageHeader).

What is inside a submessage is not looked at here.
"""

from __future__ import annotations

from collections.abc import Iterator
from enum import IntEnum
from typing import NamedTuple

from ..serialization.cursor import Octets
from ..structure.errors import MalformedMessage
from .header import HEADER_LENGTH

__all__ = [
    "LITTLE_ENDIAN",
    "SUBMESSAGE_HEADER_LENGTH",
    "RawSubmessage",
    "SubmessageKind",
    "iterate_submessages",
    "submessage_name",
]

SUBMESSAGE_HEADER_LENGTH = 4
LITTLE_ENDIAN = 0x01
"""The flag E, bit 0 of every submessage's flags."""


class SubmessageKind(IntEnum):
    """SubmessageKind, RTPS 2.5 §9.4.5.1.1 and DDS-Security 1.1 §7.3.6; from 0x80 on the numbers are the vendors'."""

    HEADER_EXTENSION = 0x00
    PAD = 0x01
    ACKNACK = 0x06
    HEARTBEAT = 0x07
    GAP = 0x08
    INFO_TS = 0x09
    INFO_SRC = 0x0C
    INFO_REPLY_IP4 = 0x0D
    INFO_DST = 0x0E
    INFO_REPLY = 0x0F
    NACK_FRAG = 0x12
    HEARTBEAT_FRAG = 0x13
    DATA = 0x15
    DATA_FRAG = 0x16
    SEC_BODY = 0x30
    SEC_PREFIX = 0x31
    SEC_POSTFIX = 0x32
    SRTPS_PREFIX = 0x33
    SRTPS_POSTFIX = 0x34


class RawSubmessage(NamedTuple):
    """A submessage as it lies in the message: ``body`` is a view, ``offset`` where its header begins."""

    kind: int
    flags: int
    body: memoryview
    offset: int

    @property
    def little_endian(self) -> bool:
        return bool(self.flags & LITTLE_ENDIAN)

    @property
    def end(self) -> int:
        """The first octet behind the body: ``octets[offset:end]`` is the submessage with its header."""
        return self.offset + SUBMESSAGE_HEADER_LENGTH + len(self.body)


def iterate_submessages(octets: Octets, *, start: int = HEADER_LENGTH) -> Iterator[RawSubmessage]:
    """The submessages of ``octets[start:]``, in order, each found only when it is asked for.

        0        8        16                32
        +--------+--------+--------+--------+
        | kind   | flags  | octetsToNextHeader
        +--------+--------+--------+--------+
        | body ...

    A length of 0 means "to the end of the message", but for PAD and INFO_TS, which may be empty
    (RTPS 2.5 §9.4.5.1.3).  Raises MalformedMessage at a submessage that is longer than what is left, or whose
    length is no multiple of 4 although another submessage follows; what was given out before stays valid.
    One to three octets at the very end are padding of the last submessage.
    """
    view = memoryview(octets)
    end = len(view)
    position = start
    while end - position >= SUBMESSAGE_HEADER_LENGTH:
        kind, flags = view[position], view[position + 1]
        if flags & LITTLE_ENDIAN:
            length = view[position + 2] | view[position + 3] << 8
        else:
            length = view[position + 2] << 8 | view[position + 3]
        body_start = position + SUBMESSAGE_HEADER_LENGTH
        if length == 0 and kind != SubmessageKind.PAD and kind != SubmessageKind.INFO_TS:
            length = end - body_start
        body_end = body_start + length
        if body_end > end:
            reason = f"{length} octets announced, {end - body_start} are left"
            raise MalformedMessage(reason, element=submessage_name(kind), offset=position)
        if length % 4 and end - body_end >= SUBMESSAGE_HEADER_LENGTH:
            reason = f"a length of {length} leaves the next submessage unaligned"
            raise MalformedMessage(reason, element=submessage_name(kind), offset=position)
        yield RawSubmessage(kind, flags, view[body_start:body_end], position)
        position = body_end


def submessage_name(kind: int) -> str:
    """``HEARTBEAT``, or the number in hexadecimal for a kind that is not in the table."""
    try:
        return SubmessageKind(kind).name
    except ValueError:
        return f"submessage {kind:02x}"
