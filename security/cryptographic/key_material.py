"""KeyMaterial: a master key with all that belongs to it, as it travels in a CryptoToken.

DDS-Security 1.1 §9.5.2.1 (CryptoToken), §9.5.2.1.1 (KeyMaterial_AES_GCM_GMAC).  No key here touches data: session
keys are derived from it (:mod:`.session_keys`).
"""

from __future__ import annotations

import hashlib
import hmac
from dataclasses import field, replace
from typing import Final

from ddsi.serialization.cursor import Octets, Reader, Writer
from ddsi.structure.dataclass import dataclass
from ddsi.structure.errors import MalformedMessage

from ..handles import SharedSecretHandle
from ..tokens import CryptoToken
from .transformation import KEY_ID_LENGTH, NO_KEY_ID, TransformationKind

__all__ = ["NO_KEY_MATERIAL", "TOKEN_CLASS_ID", "KeyMaterial", "exchange_key_material"]

TOKEN_CLASS_ID: Final = "DDS:Crypto:AES_GCM_GMAC"
_PROPERTY: Final = "dds.cryp.keymat"

# The kind NONE as Cyclone DDS sends it, and a form that Fast DDS knows; what follows the kind means nothing.
_NONE_LENGTHS: Final = (24, 44)


@dataclass(slots=True)
class KeyMaterial:
    """KeyMaterial_AES_GCM_GMAC: big-endian CDR without encapsulation header (§9.5.2.1.1).

    +-----------------------------------+
    | transformation_kind, 4 octets     |
    +-----------------------------------+
    | length n (u32), 16 or 32          |
    | master_salt, n octets             |
    +-----------------------------------+
    | sender_key_id, 4 octets           |
    +-----------------------------------+
    | length n (u32)                    |
    | master_sender_key, n octets       |
    +-----------------------------------+
    | receiver_specific_key_id          |  0: none
    +-----------------------------------+
    | length 0 or n (u32)               |
    | master_receiver_specific_key      |
    +-----------------------------------+

    So 56 or 72 octets with keys of 128 bits, 88 or 120 with keys of 256.  The keys are bytearrays, which can be wiped.
    """

    kind: TransformationKind
    master_salt: bytearray = field(repr=False)
    sender_key_id: bytes
    master_sender_key: bytearray = field(repr=False)
    receiver_specific_key_id: bytes = NO_KEY_ID
    master_receiver_specific_key: bytearray = field(default_factory=bytearray, repr=False)

    def encode(self) -> bytes:
        writer = Writer(little_endian=False)
        writer.octets(self.kind.to_wire())
        writer.octet_sequence(self.master_salt)
        writer.octets(self.sender_key_id)
        writer.octet_sequence(self.master_sender_key)
        writer.octets(self.receiver_specific_key_id)
        writer.octet_sequence(self.master_receiver_specific_key)
        return writer.getvalue()

    @classmethod
    def decode(cls, octets: Octets) -> KeyMaterial:
        """The mirror of :meth:`encode`; untrusted.  Raises MalformedMessage.

        Stricter than the stacks of others: lengths that do not fit the kind, keys of zeros and octets behind the end
        are refused, as nobody sends them who means well.
        """
        reader = Reader(octets, little_endian=False)
        number = reader.u32()
        if number not in TransformationKind._value2member_map_:
            raise reader.malformed(f"transformation kind {number:08x} is unknown")
        kind = TransformationKind(number)
        if kind is TransformationKind.NONE:
            if len(octets) not in _NONE_LENGTHS:
                raise reader.malformed(f"key material of kind NONE with {len(octets)} octets")
            return NO_KEY_MATERIAL
        material = cls(
            kind,
            _secret(reader, kind, "master_salt"),
            _key_id(reader),
            _secret(reader, kind, "master_sender_key"),
            _key_id(reader),
        )
        if material.sender_key_id == NO_KEY_ID:
            raise reader.malformed("the sender's key has no id")
        if material.receiver_specific_key_id != NO_KEY_ID:
            material.master_receiver_specific_key = _secret(reader, kind, "master_receiver_specific_key")
        elif reader.u32() != 0:
            raise reader.malformed("a receiver-specific key has no id")
        if reader.remaining:
            raise reader.malformed(f"{reader.remaining} octets follow the key material")
        return material

    def to_token(self) -> CryptoToken:
        return CryptoToken(TOKEN_CLASS_ID, (), ((_PROPERTY, self.encode()),))

    @classmethod
    def from_token(cls, token: CryptoToken) -> KeyMaterial:
        """The mirror of :meth:`to_token`; untrusted.  Raises MalformedMessage."""
        octets = token.binary_property(_PROPERTY)
        if token.class_id != TOKEN_CLASS_ID or octets is None:
            raise MalformedMessage(f"no {_PROPERTY} of class {TOKEN_CLASS_ID}", element="CryptoToken")
        return cls.decode(octets)

    def for_receiver(self, key_id: bytes, key: bytearray) -> KeyMaterial:
        """The same with the key that one receiver alone is told."""
        return replace(self, receiver_specific_key_id=key_id, master_receiver_specific_key=key)

    def copy(self) -> KeyMaterial:
        """Another one with octets of its own, which are wiped by themselves."""
        return replace(
            self,
            master_salt=self.master_salt.copy(),
            master_sender_key=self.master_sender_key.copy(),
            master_receiver_specific_key=self.master_receiver_specific_key.copy(),
        )

    def wipe(self) -> None:
        for secret in (self.master_salt, self.master_sender_key, self.master_receiver_specific_key):
            secret[:] = bytes(len(secret))


NO_KEY_MATERIAL: Final = KeyMaterial(TransformationKind.NONE, bytearray(), NO_KEY_ID, bytearray())
"""What is sent where nothing is protected: 24 octets, all zero."""


def exchange_key_material(secret: SharedSecretHandle) -> KeyMaterial:
    """The pairwise key of the volatile endpoints, the same on both sides (§9.5.2.1.2, Kx).

        master_salt       = HMAC(SHA256(challenge1 || "keyexchange salt" || challenge2), shared secret)
        master_sender_key = HMAC(SHA256(challenge2 || "key exchange key" || challenge1), shared secret)

    HMAC with SHA-256; the hash is its key.
    """
    assert secret.shared_secret, "a shared secret that was wiped"
    first, second = secret.challenge1, secret.challenge2
    salt_key = hashlib.sha256(first + b"keyexchange salt" + second).digest()
    sender_key = hashlib.sha256(second + b"key exchange key" + first).digest()
    return KeyMaterial(
        TransformationKind.AES256_GCM,
        bytearray(hmac.digest(salt_key, secret.shared_secret, "sha256")),
        NO_KEY_ID,
        bytearray(hmac.digest(sender_key, secret.shared_secret, "sha256")),
    )


def _key_id(reader: Reader) -> bytes:
    return bytes(reader.octets(KEY_ID_LENGTH))


def _secret(reader: Reader, kind: TransformationKind, name: str) -> bytearray:
    secret = bytearray(reader.octet_sequence())
    if len(secret) != kind.key_length:
        raise reader.malformed(f"{name} of {len(secret)} octets in key material of kind {kind.name}")
    if not any(secret):
        raise reader.malformed(f"{name} is all zero")
    return secret
