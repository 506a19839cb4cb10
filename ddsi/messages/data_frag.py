"""DATA_FRAG: a run of fragments of a change that is too large for one message.  RTPS 2.5 §8.3.8.3, §9.4.5."""

from __future__ import annotations

import struct
from dataclasses import field
from enum import IntFlag

from ..serialization.cursor import Octets
from ..serialization.parameter_list import ParameterList
from ..structure.dataclass import dataclass
from ..structure.errors import MalformedMessage
from ..structure.guid import EntityId
from .data import encode_inline_qos
from .raw_submessage import LITTLE_ENDIAN, SubmessageKind

__all__ = ["DataFrag", "DataFragFlag"]


class DataFragFlag(IntFlag):
    """Not the bits of DATA: K is 0x04 here."""

    LITTLE_ENDIAN = 0x01
    INLINE_QOS = 0x02
    KEY = 0x04
    NON_STANDARD_PAYLOAD = 0x08


_INLINE_QOS = int(DataFragFlag.INLINE_QOS)
_KEY = int(DataFragFlag.KEY)
_NON_STANDARD_PAYLOAD = int(DataFragFlag.NON_STANDARD_PAYLOAD)

# With the submessage header.
_HEAD = {True: struct.Struct("<BBHHH4s4siIIHHI"), False: struct.Struct(">BBHHH4s4siIIHHI")}
_HEAD_LENGTH = 32
_OCTETS_TO_INLINE_QOS = 28
_BODY = {True: struct.Struct("<HH4s4siIIHHI"), False: struct.Struct(">HH4s4siIIHHI")}
_BODY_LENGTH = 32
_TO_INLINE_QOS_END = 4
"""octetsToInlineQos counts from behind itself."""


@dataclass(frozen=True, slots=True)
class DataFrag:
    """``fragments_in_submessage`` fragments from ``fragment_starting_num`` on, counted from 1.

        0        8        16       24       32
        +--------+--------+--------+--------+
        | 0x16   |X X X X N K Q E | length
        +--------+--------+--------+--------+
        | extraFlags 0    | octetsToInlineQos 28
        +--------+--------+--------+--------+
        | readerId                          |
        | writerId                          |
        | writerSN, high then low         8 |
        | fragmentStartingNum               |
        | fragmentsInSubm.| fragmentSize    |
        | sampleSize                        |
        +-----------------------------------+
        | inlineQos, a ParameterList ...    |   only if Q
        | serializedPayload ...             |
        +-----------------------------------+

    The sample of ``sample_size`` octets, encapsulation header included, is cut into pieces of ``fragment_size``; the
    last may be shorter.  ``serialized_payload`` holds at least :attr:`run_length` octets: more when the
    submessage was padded, or when security made the run longer (DDS-Security 1.1 §8.5.1.9.1).
    """

    reader_id: EntityId
    writer_id: EntityId
    writer_sn: int
    fragment_starting_num: int
    fragments_in_submessage: int
    fragment_size: int
    sample_size: int
    inline_qos: ParameterList | None = None
    serialized_payload: Octets = field(default=b"", repr=False)
    is_key: bool = False
    non_standard_payload: bool = False

    @property
    def last_fragment_num(self) -> int:
        """The last fragment of the run, inclusive."""
        return self.fragment_starting_num + self.fragments_in_submessage - 1

    @property
    def run_start(self) -> int:
        """Where in the sample the run begins, in octets."""
        return (self.fragment_starting_num - 1) * self.fragment_size

    @property
    def run_length(self) -> int:
        """How many octets of the sample the run holds."""
        return min(self.last_fragment_num * self.fragment_size, self.sample_size) - self.run_start

    def encode(self, *, little_endian: bool = True) -> bytes:
        """The octets; ValueError if ``inline_qos`` is in the other byte order."""
        payload = self.serialized_payload
        padding = -len(payload) % 4
        head = self.encode_head(len(payload) + padding, little_endian=little_endian)
        return b"".join((head, payload, bytes(padding)))

    def encode_head(self, payload_octets: int, *, little_endian: bool = True) -> bytes:
        """All but the payload, which the caller sends behind it without copying; ``payload_octets`` with padding."""
        flags = LITTLE_ENDIAN if little_endian else 0
        qos = b""
        if self.inline_qos is not None:
            flags |= _INLINE_QOS
            qos = encode_inline_qos(self.inline_qos, little_endian=little_endian)
        if self.is_key:
            flags |= _KEY
        if self.non_standard_payload:
            flags |= _NON_STANDARD_PAYLOAD
        head = _HEAD[little_endian].pack(
            SubmessageKind.DATA_FRAG,
            flags,
            _HEAD_LENGTH + len(qos) + payload_octets,
            0,
            _OCTETS_TO_INLINE_QOS,
            self.reader_id,
            self.writer_id,
            self.writer_sn >> 32,
            self.writer_sn & 0xFFFFFFFF,
            self.fragment_starting_num,
            self.fragments_in_submessage,
            self.fragment_size,
            self.sample_size,
        )
        return head + qos

    @classmethod
    def decode(cls, flags: int, body: Octets) -> DataFrag:
        """The payload is a view of ``body``.  RTPS 2.5 §8.3.8.3.3.

        Malformed: a number below 1, a run that begins or ends beyond the sample, a run that is not all there.
        """
        little_endian, view = bool(flags & LITTLE_ENDIAN), memoryview(body)
        if len(view) < _BODY_LENGTH:
            raise _malformed(f"{len(view)} octets", 0)
        unpack = _BODY[little_endian].unpack_from
        _, to_inline_qos, reader_id, writer_id, high, low, starting_num, count, size, sample_size = unpack(view)
        writer_sn, rest = high << 32 | low, _TO_INLINE_QOS_END + to_inline_qos
        if to_inline_qos % 4 or not _BODY_LENGTH <= rest <= len(view):
            reason = f"octetsToInlineQos is {to_inline_qos}, {len(view) - _TO_INLINE_QOS_END} octets are left"
            raise _malformed(reason, _TO_INLINE_QOS_END)
        if writer_sn < 1 or not (starting_num and count and size):
            raise _malformed(f"no change {writer_sn} has {count} fragments of {size} octets from {starting_num} on")
        if (starting_num + count - 2) * size >= sample_size:
            raise _malformed(f"fragment {starting_num + count - 1} of {size} octets is beyond {sample_size}")
        inline_qos = None
        if flags & _INLINE_QOS:
            inline_qos, length = ParameterList.decode(view, little_endian=little_endian, start=rest)
            rest += length
        end = (starting_num + count - 1) * size
        run_length = (end if end < sample_size else sample_size) - (starting_num - 1) * size
        payload = view[rest:]
        if len(payload) < run_length:
            raise _malformed(f"{len(payload)} octets of {run_length} are there", rest)
        return cls(
            EntityId(reader_id),
            EntityId(writer_id),
            writer_sn,
            starting_num,
            count,
            size,
            sample_size,
            inline_qos,
            payload,
            bool(flags & _KEY),
            bool(flags & _NON_STANDARD_PAYLOAD),
        )


def _malformed(reason: str, offset: int = _BODY_LENGTH) -> MalformedMessage:
    return MalformedMessage(reason, element="DATA_FRAG", offset=offset)
