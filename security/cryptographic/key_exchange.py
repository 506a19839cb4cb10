"""AesGcmGmacKeyExchange: our keys as tokens for one peer, and a peer's tokens as keys.

DDS-Security 1.1 §9.5.3.2 (CryptoKeyExchange); the operations are those of §8.5.1.8.

How many tokens there are: a participant has one, of kind NONE where its messages are not protected; a writer one for
each of its protections, submessages before payload; a reader one.  Of a writer's tokens that came, the first is of its
submessages and the last of its payload, as a writer may use one key for both.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from ddsi.spi import Refused
from ddsi.structure.errors import MalformedMessage

from ..handles import DatareaderCryptoHandle, DatawriterCryptoHandle, ParticipantCryptoHandle
from ..tokens import CryptoToken
from .crypto_handles import (
    LocalParticipant,
    LocalReader,
    LocalWriter,
    RemoteParticipant,
    RemoteReader,
    RemoteWriter,
)
from .key_material import NO_KEY_MATERIAL, KeyMaterial
from .received_keys import KeyRing
from .session_keys import ReceiverKey, SendingKey
from .transformation import Protection, TransformationKind

__all__ = ["AesGcmGmacKeyExchange"]

_MOST_TOKENS: Final = 2
_VOLATILE: Final = Refused("the volatile endpoints have the pairwise key, and take no tokens")


class AesGcmGmacKeyExchange:
    """CryptoKeyExchange (§9.5.3.2)."""

    # --- participants ----------------------------------------------------------------------------------------

    def create_local_participant_crypto_tokens(
        self,
        local_participant_crypto_handle: ParticipantCryptoHandle,
        remote_participant_crypto_handle: ParticipantCryptoHandle,
    ) -> Sequence[CryptoToken]:
        """§8.5.1.8.1."""
        local, remote = local_participant_crypto_handle, remote_participant_crypto_handle
        assert isinstance(local, LocalParticipant)
        assert isinstance(remote, RemoteParticipant)
        if local.key is None:
            return (NO_KEY_MATERIAL.to_token(),)
        return (_token(local.key, remote.receiver_key),)

    def set_remote_participant_crypto_tokens(
        self,
        local_participant_crypto_handle: ParticipantCryptoHandle,
        remote_participant_crypto_handle: ParticipantCryptoHandle,
        remote_participant_tokens: Sequence[CryptoToken],
    ) -> Refused | None:
        """§8.5.1.8.2.  None at all will do where messages are not protected; keys that nobody asked for are taken."""
        local, remote = local_participant_crypto_handle, remote_participant_crypto_handle
        assert isinstance(local, LocalParticipant)
        assert isinstance(remote, RemoteParticipant)
        if len(remote_participant_tokens) > 1:
            return Refused(f"a participant with {len(remote_participant_tokens)} tokens; it has one")
        materials = _materials(remote_participant_tokens)
        if isinstance(materials, Refused):
            return materials
        material = materials[0] if materials else NO_KEY_MATERIAL
        refused = _objection(material, local.protection, "message")
        if refused is None:
            remote.ring.replace(material)
        return refused

    # --- writers ---------------------------------------------------------------------------------------------

    def create_local_datawriter_crypto_tokens(
        self,
        local_datawriter_crypto_handle: DatawriterCryptoHandle,
        remote_datareader_crypto_handle: DatareaderCryptoHandle,
    ) -> Sequence[CryptoToken]:
        """§8.5.1.8.3."""
        writer, reader = local_datawriter_crypto_handle, remote_datareader_crypto_handle
        assert isinstance(writer, LocalWriter)
        assert isinstance(reader, RemoteReader)
        tokens = []
        if writer.submessage_key is not None:
            tokens.append(_token(writer.submessage_key, reader.receiver_key))
        if writer.payload_key is not None and not reader.relay_only:
            tokens.append(_token(writer.payload_key, None))
        return tokens

    def set_remote_datawriter_crypto_tokens(
        self,
        local_datareader_crypto_handle: DatareaderCryptoHandle,
        remote_datawriter_crypto_handle: DatawriterCryptoHandle,
        remote_datawriter_tokens: Sequence[CryptoToken],
    ) -> Refused | None:
        """§8.5.1.8.4."""
        reader, writer = local_datareader_crypto_handle, remote_datawriter_crypto_handle
        assert isinstance(reader, LocalReader)
        assert isinstance(writer, RemoteWriter)
        if reader.is_volatile:
            return _VOLATILE if remote_datawriter_tokens else None
        materials = _materials(remote_datawriter_tokens)
        if isinstance(materials, Refused):
            return materials
        first = materials[0] if materials else NO_KEY_MATERIAL
        last = materials[-1] if materials else NO_KEY_MATERIAL
        refused = _objection(first, reader.submessage, "submessage") or _objection(last, reader.payload, "payload")
        if refused is None:
            writer.payload_ring.replace(last)
            _replace(writer, writer.ring, first)
        return refused

    # --- readers ---------------------------------------------------------------------------------------------

    def create_local_datareader_crypto_tokens(
        self,
        local_datareader_crypto_handle: DatareaderCryptoHandle,
        remote_datawriter_crypto_handle: DatawriterCryptoHandle,
    ) -> Sequence[CryptoToken]:
        """§8.5.1.8.5.

        A reader whose writers protect payloads only has nothing to say.  It sends the kind NONE all the same: Fast DDS
        waits for a token of every reader that is protected in any way, and Cyclone DDS does not mind.
        """
        reader, writer = local_datareader_crypto_handle, remote_datawriter_crypto_handle
        assert isinstance(reader, LocalReader)
        assert isinstance(writer, RemoteWriter)
        if reader.submessage_key is not None:
            return (_token(reader.submessage_key, writer.receiver_key),)
        return (NO_KEY_MATERIAL.to_token(),) if reader.payload is not None else ()

    def set_remote_datareader_crypto_tokens(
        self,
        local_datawriter_crypto_handle: DatawriterCryptoHandle,
        remote_datareader_crypto_handle: DatareaderCryptoHandle,
        remote_datareader_tokens: Sequence[CryptoToken],
    ) -> Refused | None:
        """§8.5.1.8.6.  None at all will do where submessages are not protected."""
        writer, reader = local_datawriter_crypto_handle, remote_datareader_crypto_handle
        assert isinstance(writer, LocalWriter)
        assert isinstance(reader, RemoteReader)
        if writer.is_volatile:
            return _VOLATILE if remote_datareader_tokens else None
        materials = _materials(remote_datareader_tokens)
        if isinstance(materials, Refused):
            return materials
        material = materials[0] if materials else NO_KEY_MATERIAL
        refused = _objection(material, writer.submessage, "submessage")
        if refused is None:
            _replace(reader, reader.ring, material)
        return refused

    def return_crypto_tokens(self, crypto_tokens: Sequence[CryptoToken]) -> None:
        """§8.5.1.8.7.  Their octets are ``bytes``, which cannot be wiped; dropping them is all that can be done."""


def _token(key: SendingKey, receiver_key: ReceiverKey | None) -> CryptoToken:
    material = key.material if receiver_key is None else receiver_key.token_material(key)
    return material.to_token()


def _materials(tokens: Sequence[CryptoToken]) -> list[KeyMaterial] | Refused:
    """What a peer's tokens hold; untrusted."""
    if len(tokens) > _MOST_TOKENS:
        return Refused(f"{len(tokens)} tokens for one endpoint; there are {_MOST_TOKENS} at most")
    try:
        return [KeyMaterial.from_token(token) for token in tokens]
    except MalformedMessage as error:
        return Refused(f"a token of no use: {error}")


def _objection(material: KeyMaterial, protection: Protection | None, what: str) -> Refused | None:
    """Why this key cannot be that of ``what``, which we expect to be protected so."""
    if protection is None:
        return None
    if material.kind is TransformationKind.NONE:
        return Refused(f"the {what} protection is on, and the peer sent no key for it")
    if material.kind.encrypts is not protection.encrypted:
        due = "encrypts" if protection.encrypted else "signs"
        return Refused(f"the {what} protection {due}, and the peer's key has kind {material.kind.name}")
    if protection.origin_authenticated and not material.master_receiver_specific_key:
        return Refused(f"the {what} protection authenticates the origin, and the peer sent no receiver-specific key")
    return None


def _replace(sender: RemoteWriter | RemoteReader, ring: KeyRing, material: KeyMaterial) -> None:
    ring.replace(material)
    sender.participant.index(sender, ring.by_id)
