"""DATA: one change, whole.  RTPS 2.5 §8.3.8.2, §9.4.5."""

from __future__ import annotations

import struct
from dataclasses import field
from enum import IntFlag

from ..serialization.cursor import Octets, Reader
from ..serialization.encapsulation import HEADER_LENGTH as ENCAPSULATION_LENGTH
from ..serialization.parameter_list import ParameterList
from ..structure.dataclass import dataclass
from ..structure.guid import EntityId
from .raw_submessage import LITTLE_ENDIAN, SubmessageKind

__all__ = ["Data", "DataFlag"]


class DataFlag(IntFlag):
    LITTLE_ENDIAN = 0x01
    INLINE_QOS = 0x02
    DATA = 0x04
    KEY = 0x08
    NON_STANDARD_PAYLOAD = 0x10


_INLINE_QOS = int(DataFlag.INLINE_QOS)
_DATA = int(DataFlag.DATA)
_KEY = int(DataFlag.KEY)
_NON_STANDARD_PAYLOAD = int(DataFlag.NON_STANDARD_PAYLOAD)

# With the submessage header.
_HEAD = {True: struct.Struct("<BBHHH4s4siI"), False: struct.Struct(">BBHHH4s4siI")}
_HEAD_LENGTH = 20
_OCTETS_TO_INLINE_QOS = 16


@dataclass(frozen=True, slots=True)
class Data:
    """A change of the writer's: a sample, or what became of an instance.

        0        8        16       24       32
        +--------+--------+--------+--------+
        | 0x15   |X X X N K D Q E | length
        +--------+--------+--------+--------+
        | extraFlags 0    | octetsToInlineQos 16
        +--------+--------+--------+--------+
        | readerId                          |
        | writerId                          |
        | writerSN, high then low         8 |
        +-----------------------------------+
        | inlineQos, a ParameterList ...    |   only if Q
        | serializedPayload ...             |   only if D or K
        +-----------------------------------+

    ``serialized_payload`` begins with its encapsulation header.  It is the sample (D), with ``is_key`` the key alone
    (K), or empty when there is none: then ``inline_qos`` names the instance.  As the submessage is padded, up
    to three octets may follow what the writer serialised.  ``non_standard_payload`` (N): not CDR.
    """

    reader_id: EntityId
    writer_id: EntityId
    writer_sn: int
    inline_qos: ParameterList | None = None
    serialized_payload: Octets = field(default=b"", repr=False)
    is_key: bool = False
    non_standard_payload: bool = False

    def encode(self, *, little_endian: bool = True) -> bytes:
        """The octets; ValueError if ``inline_qos`` is in the other byte order."""
        flags = LITTLE_ENDIAN if little_endian else 0
        qos = b""
        if self.inline_qos is not None:
            flags |= _INLINE_QOS
            qos = encode_inline_qos(self.inline_qos, little_endian=little_endian)
        payload = self.serialized_payload
        if payload:
            flags |= _KEY if self.is_key else _DATA
        if self.non_standard_payload:
            flags |= _NON_STANDARD_PAYLOAD
        padding = -len(payload) % 4
        head = _HEAD[little_endian].pack(
            SubmessageKind.DATA,
            flags,
            _HEAD_LENGTH + len(qos) + len(payload) + padding,
            0,
            _OCTETS_TO_INLINE_QOS,
            self.reader_id,
            self.writer_id,
            self.writer_sn >> 32,
            self.writer_sn & 0xFFFFFFFF,
        )
        return b"".join((head, qos, payload, bytes(padding)))

    @classmethod
    def decode(cls, flags: int, body: Octets) -> Data:
        """The payload is a view of ``body``.  RTPS 2.5 §8.3.8.2.3.

        Malformed: a sequence number below 1, D and K together, a payload with no room for its encapsulation header.
        """
        little_endian = bool(flags & LITTLE_ENDIAN)
        reader = Reader(body, little_endian=little_endian)
        reader.skip(2)
        rest = inline_qos_position(reader, _OCTETS_TO_INLINE_QOS)
        reader_id, writer_id, writer_sn = reader.entity_id(), reader.entity_id(), reader.sequence_number()
        if writer_sn < 1:
            raise reader.malformed(f"no change has the number {writer_sn}")
        reader.skip(rest - reader.position)
        inline_qos = None
        if flags & _INLINE_QOS:
            inline_qos, length = ParameterList.decode(body, little_endian=little_endian, start=rest)
            reader.skip(length)
        payload: Octets = b""
        if flags & (_DATA | _KEY):
            if flags & _DATA and flags & _KEY:
                raise reader.malformed("a payload cannot be a sample and a key")
            if reader.remaining < ENCAPSULATION_LENGTH:
                raise reader.malformed(f"a payload of {reader.remaining} octets")
            payload = reader.octets(reader.remaining)
        is_key, non_standard_payload = bool(flags & _KEY), bool(flags & _NON_STANDARD_PAYLOAD)
        return cls(reader_id, writer_id, writer_sn, inline_qos, payload, is_key, non_standard_payload)


def encode_inline_qos(inline_qos: ParameterList, *, little_endian: bool) -> bytes:
    """The list's octets; its values must be in the byte order of the submessage that it goes into."""
    if inline_qos.little_endian != little_endian:
        raise ValueError("inline QoS has the byte order of its submessage")
    return inline_qos.encode()


def inline_qos_position(reader: Reader, least: int) -> int:
    """Read octetsToInlineQos and return the position that it points to, counted from the body's start.

    It counts from behind itself.  The value is used, not the constant that everybody sends today, so that
    fields which a later version may put in front of the inline QoS are skipped.
    """
    octets_to_inline_qos = reader.u16()
    if octets_to_inline_qos % 4 or not least <= octets_to_inline_qos <= reader.remaining:
        raise reader.malformed(f"octetsToInlineQos is {octets_to_inline_qos}, {reader.remaining} octets are left")
    return reader.position + octets_to_inline_qos
