"""The parameters of DDS Security, carried unread: only their byte order is settled here.

DDS-Security 1.1 §7.4.1.  ``DiscoveredParticipantData.security_parameters`` holds little-endian octets.  Every stack
announces in little endian; for a peer that does not, the values are rewritten here, so that the plugins meet one form.
So they are where we write a big-endian list ourselves: in the authentication handshake (§9.3.2.5.1, c.pdata).
"""

from __future__ import annotations

from ..serialization.cursor import Octets, Reader, Writer
from ..serialization.parameter_id import ParameterId

__all__ = ["to_big_endian", "to_little_endian"]

_MAX_ELEMENTS = 256
"""Properties in one value."""

_DATA_HOLDERS = (ParameterId.IDENTITY_TOKEN, ParameterId.PERMISSIONS_TOKEN, ParameterId.IDENTITY_STATUS_TOKEN)


def to_little_endian(pid: int, value: Octets, *, little_endian: bool) -> bytes:
    """The value's octets in little endian; a big-endian value that does not parse is malformed."""
    return bytes(value) if little_endian else _swapped(pid, value, to_little_endian=True)


def to_big_endian(pid: int, value: Octets) -> bytes:
    """A little-endian value's octets in big endian; one that does not parse is malformed."""
    return _swapped(pid, value, to_little_endian=False)


def _swapped(pid: int, value: Octets, *, to_little_endian: bool) -> bytes:
    """Two shapes occur: DataHolder (string, properties of text, properties of octets), and uint32s."""
    reader, writer = Reader(value, little_endian=not to_little_endian), Writer(little_endian=to_little_endian)
    if pid in _DATA_HOLDERS:
        writer.string(reader.string())
        _swap_texts(reader, writer)
        _swap_octets(reader, writer)
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
