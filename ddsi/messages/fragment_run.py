"""What a receiver needs of a DATA_FRAG, taken out with as few steps as can be.  RTPS 2.5 §8.3.8.3, §9.4.5.

A large sample comes in many of them.  Little-endian ones with no inline QoS, or with a key hash alone, are read here;
:class:`~ddsi.messages.data_frag.DataFrag` reads all others, and says what is wrong with those that are malformed.
"""

from __future__ import annotations

import struct

from ..serialization.parameter_list import ParameterList
from .data_frag import DataFrag, DataFragFlag
from .fast import key_hash_alone

__all__ = ["FragmentRun"]

_BODY = struct.Struct("<HH4s4siIIHHI")
_USUAL_INLINE_QOS_AT = 28
"""octetsToInlineQos, which counts from behind itself, when nothing unknown stands before it."""
_KEY_HASH_QOS = 24
"""Octets of an inline QoS that holds a key hash alone."""
_LITTLE_ENDIAN = int(DataFragFlag.LITTLE_ENDIAN)
_INLINE_QOS = int(DataFragFlag.INLINE_QOS)
_KEY = int(DataFragFlag.KEY)
_NON_STANDARD_PAYLOAD = int(DataFragFlag.NON_STANDARD_PAYLOAD)


class FragmentRun:
    """``count`` fragments from number ``first`` on, counted from 1, of a sample of ``sample_size`` octets.

    ``length``: how many octets of the sample they are; ``payload`` holds so many at least.  ``key_hash``: all that the
    inline QoS held; ``inline_qos``: what it held if it held anything else.
    """

    __slots__ = (
        "count",
        "first",
        "fragment_size",
        "inline_qos",
        "is_key",
        "key_hash",
        "length",
        "non_standard_payload",
        "payload",
        "reader_id",
        "sample_size",
        "writer_id",
        "writer_sn",
    )

    def __init__(self, flags: int, body: memoryview) -> None:
        """Of a submessage with these ``flags``; MalformedMessage as of :meth:`DataFrag.decode`."""
        octets = len(body)
        if not flags & _LITTLE_ENDIAN or octets < _BODY.size:
            self._take(DataFrag.decode(flags, body))
            return
        _, inline_qos_at, reader_id, writer_id, high, low, first, count, size, sample_size = _BODY.unpack_from(body)
        start = (first - 1) * size
        end = start + count * size
        is_beyond = end - size >= sample_size
        if end > sample_size:
            end = sample_size
        payload_at, key_hash = _BODY.size, b""
        if flags & _INLINE_QOS:
            key_hash = key_hash_alone(body, 0, octets, _BODY.size)
            payload_at = payload_at + _KEY_HASH_QOS if key_hash else octets
        number = high << 32 | low
        if (
            inline_qos_at != _USUAL_INLINE_QOS_AT or is_beyond or number < 1 or not (first and count and size)
            or octets - payload_at < end - start
        ):  # fmt: skip
            self._take(DataFrag.decode(flags, body))
            return
        self.reader_id: bytes = reader_id
        self.writer_id: bytes = writer_id
        self.writer_sn: int = number
        self.first: int = first
        self.count: int = count
        self.fragment_size: int = size
        self.sample_size: int = sample_size
        self.length: int = end - start
        self.payload = body[payload_at:]
        self.key_hash = key_hash
        self.inline_qos: ParameterList | None = None
        self.is_key = bool(flags & _KEY)
        self.non_standard_payload = bool(flags & _NON_STANDARD_PAYLOAD)

    def _take(self, data: DataFrag) -> None:
        """The general form."""
        self.reader_id = data.reader_id
        self.writer_id = data.writer_id
        self.writer_sn = data.writer_sn
        self.first = data.fragment_starting_num
        self.count = data.fragments_in_submessage
        self.fragment_size = data.fragment_size
        self.sample_size = data.sample_size
        self.length = data.run_length
        self.payload = memoryview(data.serialized_payload)
        self.key_hash = b""
        self.inline_qos = data.inline_qos
        self.is_key = data.is_key
        self.non_standard_payload = data.non_standard_payload
