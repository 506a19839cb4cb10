"""DataHolder: the shape of every token that plugins exchange, and its octets.

DDS-Security 1.1 §7.2.3 (DataHolder), §7.2.4 (Token), §7.3.2 (its CDR).  A token that names a protocol, a certificate
or a key is a DataHolder with a class id of its own; which properties it has, the plugin says whose it is.  The core
carries tokens without reading them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field
from typing import Final

from ddsi.serialization import Reader, Writer
from ddsi.structure.dataclass import dataclass

__all__ = [
    "MAX_PROPERTIES",
    "NIL",
    "AuthRequestMessageToken",
    "AuthenticatedPeerCredentialToken",
    "CryptoToken",
    "DataHolder",
    "HandshakeMessageToken",
    "IdentityStatusToken",
    "IdentityToken",
    "PermissionsCredentialToken",
    "PermissionsToken",
    "Token",
    "read_data_holder",
    "serialize_binary_properties",
    "write_data_holder",
]

MAX_PROPERTIES: Final = 64
"""No known token has more than twelve; a count from the network above this is malformed."""


@dataclass(frozen=True, slots=True)
class DataHolder:
    """A class id, and named texts and octets in the order of the wire, which signatures cover.

    All of it is sent: what the OMG marks with ``propagate`` false has no place here.  Names may repeat on the wire;
    the first counts.  The octets may be keys, so no repr shows them.
    """

    class_id: str = ""
    properties: tuple[tuple[str, str], ...] = ()
    binary_properties: tuple[tuple[str, bytes], ...] = field(default=(), repr=False)

    def property(self, name: str) -> str | None:
        return next((value for key, value in self.properties if key == name), None)

    def binary_property(self, name: str) -> bytes | None:
        return next((value for key, value in self.binary_properties if key == name), None)

    def __repr__(self) -> str:
        names = [name for name, _ in self.properties + self.binary_properties]
        return f"<DataHolder {self.class_id or 'nil'}{': ' if names else ''}{', '.join(names)}>"


NIL = DataHolder()
"""TokenNIL, which stands where there is no token."""

# The OMG names them apart and gives all of them one shape.
Token = DataHolder
IdentityToken = DataHolder
IdentityStatusToken = DataHolder
AuthRequestMessageToken = DataHolder
HandshakeMessageToken = DataHolder
AuthenticatedPeerCredentialToken = DataHolder
PermissionsToken = DataHolder
PermissionsCredentialToken = DataHolder
CryptoToken = DataHolder


def write_data_holder(writer: Writer, holder: DataHolder) -> None:
    """As plain CDR: class id, properties, binary properties, each sequence with its count (§7.3.2)."""
    writer.string(holder.class_id)
    writer.sequence_length(len(holder.properties))
    for name, text in holder.properties:
        writer.string(name)
        writer.string(text)
    _write_binary_properties(writer, holder.binary_properties)


def read_data_holder(reader: Reader) -> DataHolder:
    """The mirror of :func:`write_data_holder`; untrusted.  Raises MalformedMessage and nothing else.

    A peer of version 1.0 ends behind the properties: octets that are missing altogether are no binary properties.
    """
    class_id = reader.string()
    properties = []
    for _ in range(reader.sequence_length(most=MAX_PROPERTIES)):
        name = reader.string()
        properties.append((name, reader.string()))
    binary_properties = []
    if reader.remaining >= 4:
        for _ in range(reader.sequence_length(most=MAX_PROPERTIES)):
            name = reader.string()
            binary_properties.append((name, bytes(reader.octet_sequence())))
    return DataHolder(class_id, tuple(properties), tuple(binary_properties))


def serialize_binary_properties(properties: Sequence[tuple[str, bytes]]) -> bytes:
    """A BinaryPropertySeq in big-endian CDR without encapsulation: what hashes and signatures cover (§9.3.2.5.1).

    Nothing follows the octets of the last property, no padding either.
    """
    writer = Writer(little_endian=False)
    _write_binary_properties(writer, properties)
    return writer.getvalue()


def _write_binary_properties(writer: Writer, properties: Sequence[tuple[str, bytes]]) -> None:
    writer.sequence_length(len(properties))
    for name, octets in properties:
        writer.string(name)
        writer.octet_sequence(octets)
