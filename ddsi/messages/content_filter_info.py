"""ContentFilterInfo_t: what a writer says of a sample and the filters of its readers.  RTPS 2.5 §9.6.4.2.

The value of PID_CONTENT_FILTER_INFO, inline QoS.  A result is a bit, the first in the highest of the first word; it is
set where the sample passed the filter with the signature of the same place.  Signatures are octets, never swapped.

    | count of words | words, 32 results each | count of signatures | signatures, 16 octets each |
"""

from __future__ import annotations

from collections.abc import Mapping

from ..serialization.cursor import Octets, Reader, Writer

__all__ = ["MAX_FILTERS", "decode_content_filter_info", "encode_content_filter_info"]

MAX_FILTERS = 256
"""Of whose results one sample may tell."""
_SIGNATURE_OCTETS = 16


def encode_content_filter_info(verdicts: Mapping[bytes, bool], *, little_endian: bool = True) -> bytes:
    """``verdicts``: by signature, did the sample pass?"""
    writer = Writer(little_endian=little_endian)
    words = [0] * (-(-len(verdicts) // 32))
    for place, passed in enumerate(verdicts.values()):
        words[place // 32] |= passed << (31 - place % 32)
    writer.sequence_length(len(words))
    for word in words:
        writer.u32(word)
    writer.sequence_length(len(verdicts))
    return writer.getvalue() + b"".join(verdicts)


def decode_content_filter_info(octets: Octets, *, little_endian: bool) -> dict[bytes, bool]:
    """By signature, did the sample pass?  A signature without a result is left out.  Raises MalformedMessage."""
    reader = Reader(octets, little_endian=little_endian)
    words = [reader.u32() for _ in range(reader.sequence_length(most=MAX_FILTERS))]
    verdicts: dict[bytes, bool] = {}
    for place in range(reader.sequence_length(most=MAX_FILTERS)):
        signature = bytes(reader.octets(_SIGNATURE_OCTETS))
        if place < 32 * len(words):
            verdicts[signature] = bool(words[place // 32] >> (31 - place % 32) & 1)
    return verdicts
