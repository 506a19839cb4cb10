"""AesGcmGmacKeyFactory: makes the keys of local entities, and a place for those of remote ones.

DDS-Security 1.1 §9.5.3.1 (CryptoKeyFactory); the operations are those of §8.5.1.7.  Tokens: :mod:`.key_exchange`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from ddsi.structure.errors import ConfigurationError
from ddsi.structure.qos_policies import Properties, Property

from ..attributes import EndpointSecurityAttributes, ParticipantSecurityAttributes
from ..handles import (
    DatareaderCryptoHandle,
    DatawriterCryptoHandle,
    IdentityHandle,
    ParticipantCryptoHandle,
    PermissionsHandle,
    SharedSecretHandle,
)
from ..properties import BUILTIN_ENDPOINT_NAME, KEY_SIZE, MAX_BLOCKS_PER_SESSION, security_properties
from .crypto_handles import (
    VOLATILE_PROTECTION,
    LocalParticipant,
    LocalReader,
    LocalWriter,
    RemoteParticipant,
    RemoteReader,
    RemoteWriter,
)
from .key_material import KeyMaterial, exchange_key_material
from .received_keys import KeyRing
from .session_keys import DEFAULT_MAX_BLOCKS, LARGEST_MAX_BLOCKS, ReceiverKey, SendingKey
from .transformation import Protection, participant_protection, payload_protection, submessage_protection

__all__ = ["AesGcmGmacKeyFactory"]

_DEFAULT_KEY_BITS: Final = 256
_VOLATILE_WRITER: Final = "BuiltinParticipantVolatileMessageSecureWriter"
_VOLATILE_READER: Final = "BuiltinParticipantVolatileMessageSecureReader"


class AesGcmGmacKeyFactory:
    """CryptoKeyFactory (§9.5.3.1).

    Endpoints of one participant may have keys of either size; what a peer sends, its tokens tell, not its participant.
    """

    def __init__(
        self, properties: Properties, *, entropy: Callable[[int], bytes], wall_clock: Callable[[], int]
    ) -> None:
        """``properties``: the participant's; looked at when it is registered.  Raises ConfigurationError."""
        _key_size_and_blocks(properties, _DEFAULT_KEY_BITS, DEFAULT_MAX_BLOCKS)
        self._entropy = entropy
        self._wall_clock = wall_clock

    # --- registering -----------------------------------------------------------------------------------------

    def register_local_participant(
        self,
        participant_identity: IdentityHandle,
        participant_permissions: PermissionsHandle,
        participant_properties: Properties,
        participant_security_attributes: ParticipantSecurityAttributes,
    ) -> LocalParticipant:
        """§8.5.1.7.1.  Properties KEY_SIZE (128 or 256) and MAX_BLOCKS_PER_SESSION; they hold for its endpoints too."""
        key_bits, max_blocks = _key_size_and_blocks(participant_properties, _DEFAULT_KEY_BITS, DEFAULT_MAX_BLOCKS)
        local = LocalParticipant(
            participant_protection(participant_security_attributes),
            key_bits=key_bits,
            max_blocks=max_blocks,
            first_key_id=int.from_bytes(self._entropy(4), "big"),
        )
        if local.protection is not None:
            local.key = self._new_key(local, local.protection, key_bits, max_blocks)
        return local

    def register_matched_remote_participant(
        self,
        local_participant_crypto_handle: ParticipantCryptoHandle,
        remote_participant_identity: IdentityHandle,
        remote_participant_permissions: PermissionsHandle,
        shared_secret: SharedSecretHandle,
    ) -> RemoteParticipant:
        """§8.5.1.7.2.  Derives the pairwise key of the volatile endpoints; the shared secret is not kept."""
        local = local_participant_crypto_handle
        assert isinstance(local, LocalParticipant)
        remote = RemoteParticipant(
            local,
            exchange_key=SendingKey(
                exchange_key_material(shared_secret),
                self._entropy,
                max_blocks=local.max_blocks,
                replier=shared_secret.is_replier,
            ),
            receiver_key=self._new_receiver_key(local, local.key, local.protection),
            wall_clock=self._wall_clock,
        )
        remote.exchange_ring.replace(exchange_key_material(shared_secret))
        local.remotes.add(remote)
        return remote

    def register_local_datawriter(
        self,
        local_participant_crypto_handle: ParticipantCryptoHandle,
        datawriter_properties: Properties,
        datawriter_security_attributes: EndpointSecurityAttributes,
    ) -> LocalWriter:
        """§8.5.1.7.3.  The volatile writer, told by its BUILTIN_ENDPOINT_NAME, has no key: it uses the pairwise one."""
        local = local_participant_crypto_handle
        assert isinstance(local, LocalParticipant)
        name, key_bits, max_blocks = _endpoint_properties(datawriter_properties, local)
        is_volatile = name == _VOLATILE_WRITER
        writer = LocalWriter(
            local,
            submessage=VOLATILE_PROTECTION if is_volatile else submessage_protection(datawriter_security_attributes),
            payload=None if is_volatile else payload_protection(datawriter_security_attributes),
            is_volatile=is_volatile,
        )
        if writer.submessage is not None and not is_volatile:
            writer.submessage_key = self._new_key(local, writer.submessage, key_bits, max_blocks)
        if writer.payload is not None:
            writer.payload_key = self._new_key(local, writer.payload, key_bits, max_blocks)
        local.endpoints.add(writer)
        return writer

    def register_matched_remote_datareader(
        self,
        local_datawriter_crypto_handle: DatawriterCryptoHandle,
        remote_participant_crypto_handle: ParticipantCryptoHandle,
        shared_secret: SharedSecretHandle,
        *,
        relay_only: bool,
    ) -> RemoteReader:
        """§8.5.1.7.4.  ``relay_only``: it is told the key of the submessages, and not that of the payload."""
        writer, remote = local_datawriter_crypto_handle, remote_participant_crypto_handle
        assert isinstance(writer, LocalWriter)
        assert isinstance(remote, RemoteParticipant)
        reader = RemoteReader(
            writer,
            remote,
            ring=remote.exchange_ring if writer.is_volatile else KeyRing(self._wall_clock, remote.local.rooms),
            receiver_key=self._new_receiver_key(writer.participant, writer.submessage_key, writer.submessage),
            relay_only=relay_only,
        )
        writer.matched.add(reader)
        remote.endpoints.add(reader)
        if writer.is_volatile:
            remote.volatile_reader = reader
        return reader

    def register_local_datareader(
        self,
        local_participant_crypto_handle: ParticipantCryptoHandle,
        datareader_properties: Properties,
        datareader_security_attributes: EndpointSecurityAttributes,
    ) -> LocalReader:
        """§8.5.1.7.5.  The volatile reader, told by its BUILTIN_ENDPOINT_NAME, has no key: it uses the pairwise one."""
        local = local_participant_crypto_handle
        assert isinstance(local, LocalParticipant)
        name, key_bits, max_blocks = _endpoint_properties(datareader_properties, local)
        is_volatile = name == _VOLATILE_READER
        reader = LocalReader(
            local,
            submessage=VOLATILE_PROTECTION if is_volatile else submessage_protection(datareader_security_attributes),
            payload=None if is_volatile else payload_protection(datareader_security_attributes),
            is_volatile=is_volatile,
        )
        if reader.submessage is not None and not is_volatile:
            reader.submessage_key = self._new_key(local, reader.submessage, key_bits, max_blocks)
        local.endpoints.add(reader)
        return reader

    def register_matched_remote_datawriter(
        self,
        local_datareader_crypto_handle: DatareaderCryptoHandle,
        remote_participant_crypto_handle: ParticipantCryptoHandle,
        shared_secret: SharedSecretHandle,
    ) -> RemoteWriter:
        """§8.5.1.7.6."""
        reader, remote = local_datareader_crypto_handle, remote_participant_crypto_handle
        assert isinstance(reader, LocalReader)
        assert isinstance(remote, RemoteParticipant)
        writer = RemoteWriter(
            reader,
            remote,
            ring=remote.exchange_ring if reader.is_volatile else KeyRing(self._wall_clock, remote.local.rooms),
            payload_ring=KeyRing(self._wall_clock, remote.local.rooms),
            receiver_key=self._new_receiver_key(reader.participant, reader.submessage_key, reader.submessage),
        )
        reader.matched.add(writer)
        remote.endpoints.add(writer)
        if reader.is_volatile:
            remote.volatile_writer = writer
        return writer

    # --- unregistering: what was registered under it goes first, the pairwise key last -------------------------

    def unregister_participant(self, participant_crypto_handle: ParticipantCryptoHandle) -> None:
        """§8.5.1.7.7."""
        if isinstance(participant_crypto_handle, LocalParticipant):
            for remote in list(participant_crypto_handle.remotes):
                _unregister_remote_participant(remote)
            for endpoint in list(participant_crypto_handle.endpoints):
                _unregister_local(endpoint)
            participant_crypto_handle.wipe()
        else:
            assert isinstance(participant_crypto_handle, RemoteParticipant)
            _unregister_remote_participant(participant_crypto_handle)

    def unregister_datawriter(self, datawriter_crypto_handle: DatawriterCryptoHandle) -> None:
        """§8.5.1.7.8."""
        if isinstance(datawriter_crypto_handle, LocalWriter):
            _unregister_local(datawriter_crypto_handle)
        else:
            assert isinstance(datawriter_crypto_handle, RemoteWriter)
            _unregister_remote(datawriter_crypto_handle)

    def unregister_datareader(self, datareader_crypto_handle: DatareaderCryptoHandle) -> None:
        """§8.5.1.7.9."""
        if isinstance(datareader_crypto_handle, LocalReader):
            _unregister_local(datareader_crypto_handle)
        else:
            assert isinstance(datareader_crypto_handle, RemoteReader)
            _unregister_remote(datareader_crypto_handle)

    # --- keys ------------------------------------------------------------------------------------------------

    def _new_key(self, local: LocalParticipant, protection: Protection, key_bits: int, max_blocks: int) -> SendingKey:
        kind = protection.kind(key_bits)
        material = KeyMaterial(
            kind,
            bytearray(self._entropy(kind.key_length)),
            local.new_key_id(),
            bytearray(self._entropy(kind.key_length)),
        )
        return SendingKey(material, self._entropy, max_blocks=max_blocks)

    def _new_receiver_key(
        self, local: LocalParticipant, key: SendingKey | None, protection: Protection | None
    ) -> ReceiverKey | None:
        """The receiver-specific key that goes with ``key``, where the origin is to be authenticated."""
        if key is None or protection is None or not protection.origin_authenticated:
            return None
        return ReceiverKey(local.new_key_id(), bytearray(self._entropy(key.material.kind.key_length)))


def _unregister_remote_participant(remote: RemoteParticipant) -> None:
    for endpoint in list(remote.endpoints):
        _unregister_remote(endpoint)
    remote.local.remotes.discard(remote)
    remote.wipe()


def _unregister_local(endpoint: LocalWriter | LocalReader) -> None:
    matched: list[RemoteWriter | RemoteReader] = [*endpoint.matched]
    for remote in matched:
        _unregister_remote(remote)
    endpoint.participant.endpoints.discard(endpoint)
    endpoint.wipe()


def _unregister_remote(endpoint: RemoteWriter | RemoteReader) -> None:
    remote = endpoint.participant
    remote.index(endpoint, ())
    remote.endpoints.discard(endpoint)
    if isinstance(endpoint, RemoteWriter):
        endpoint.reader.matched.discard(endpoint)
        if remote.volatile_writer is endpoint:
            remote.volatile_writer = None
    else:
        endpoint.writer.matched.discard(endpoint)
        if remote.volatile_reader is endpoint:
            remote.volatile_reader = None
    endpoint.wipe()


def _endpoint_properties(properties: Properties, local: LocalParticipant) -> tuple[str, int, int]:
    """The builtin endpoint's name, or "", and key size and blocks of an endpoint; the participant's are the default."""
    name = properties.get(BUILTIN_ENDPOINT_NAME, "")
    rest = {key: value for key, value in properties.items() if key != BUILTIN_ENDPOINT_NAME}
    key_bits, max_blocks = _key_size_and_blocks(rest, local.key_bits, local.max_blocks)
    return name.value if isinstance(name, Property) else str(name), key_bits, max_blocks


def _key_size_and_blocks(properties: Properties, key_bits: int, max_blocks: int) -> tuple[int, int]:
    """As the properties say, or else as given.  Raises ConfigurationError."""
    found = security_properties(properties)
    key_size = found.get(KEY_SIZE, str(key_bits))
    if key_size not in ("128", "256"):
        raise ConfigurationError(f"property {KEY_SIZE} is {key_size!r}: set it to 128 or 256, or leave it out for 256")
    blocks = found.get(MAX_BLOCKS_PER_SESSION, str(max_blocks))
    if not (blocks.isascii() and blocks.isdecimal() and len(blocks) < 20 and 1 <= int(blocks) <= LARGEST_MAX_BLOCKS):
        raise ConfigurationError(
            f"property {MAX_BLOCKS_PER_SESSION} is {blocks!r}: set it to a number of blocks of 16 octets, from 1 to "
            f"{LARGEST_MAX_BLOCKS}, or leave it out for {DEFAULT_MAX_BLOCKS}"
        )
    return int(key_size), int(blocks)
