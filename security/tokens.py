"""DataHolder: the shape of every token that plugins exchange.  DDS-Security 1.1 §7.2.3 (DataHolder), §7.2.4 (Token).

Values only.  A token that names a protocol, a certificate or a key is a DataHolder with a class id of its own; which
properties it has, the plugin says whose it is.  The core carries tokens without reading them.
"""

from __future__ import annotations

from dataclasses import dataclass, field

__all__ = [
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
]


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
