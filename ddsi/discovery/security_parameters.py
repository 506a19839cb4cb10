"""The parameters of DDS Security, carried unread: only their byte order is settled here.

DDS-Security 1.1 §7.4.1.  ``DiscoveredParticipantData.security_parameters`` holds little-endian octets.  Every stack
announces in little endian; for a peer that does not, the values are rewritten here, so that the plugins meet one form.
"""

from __future__ import annotations

from ..serialization.cursor import Octets, Reader, Writer
from ..serialization.parameter_id import ParameterId

__all__ = ["to_little_endian"]

_MAX_ELEMENTS = 256
"""Properties or tags in one value."""

_DATA_HOLDERS = (ParameterId.IDENTITY_TOKEN, ParameterId.PERMISSIONS_TOKEN, ParameterId.IDENTITY_STATUS_TOKEN)


def to_little_endian(pid: int, value: Octets, *, little_endian: bool) -> bytes:
    """The value's octets in little endian; a big-endian value that does not parse is malformed.

    Three shapes occur: DataHolder (string, properties of text, properties of octets), a sequence of tags
    (string, string), and uint32s.
    """
    if little_endian:
        return bytes(value)
    reader, writer = Reader(value, little_endian=False), Writer(little_endian=True)
    if pid in _DATA_HOLDERS:
        writer.string(reader.string())
        _swap_texts(reader, writer)
        _swap_octets(reader, writer)
    elif pid == ParameterId.DATA_TAGS:
        _swap_texts(reader, writer)
    else:
        for _ in range(reader.remaining // 4):
            writer.u32(reader.u32())
    writer.align(4)
    return writer.getvalue()


def _swap_texts(reader: Reader, writer: Writer) -> None:
    count = reader.sequence_length(most=_MAX_ELEMENTS)
    writer.sequence_length(count)
    for _ in range(2 * count):
        writer.string(reader.string())


def _swap_octets(reader: Reader, writer: Writer) -> None:
    count = reader.sequence_length(most=_MAX_ELEMENTS)
    writer.sequence_length(count)
    for _ in range(count):
        writer.string(reader.string())
        writer.octet_sequence(reader.octet_sequence())
