"""Protects what a participant sends and opens what it receives: from the core's Guids to the plugin's handles.

DDS-Security 1.1 §8.8.10 (what is protected with what), §8.5.1.9.  And one thing more, which no plugin can know: what
ought to have arrived protected (:meth:`Protection.admits`), and whether the key that opened a submessage is that of the
endpoint which it names.  Without the latter, an authenticated insider could speak for any endpoint of its participant,
and without the former, anybody for anyone.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from ddsi.messages.fast import SENDER_AT
from ddsi.messages.raw_submessage import SubmessageKind
from ddsi.spi import NO_OVERHEAD, NOT_FOR_US, NoKeys, Octets, Outcome, Overhead, Parts, Refused, Rejected
from ddsi.spi import Protection as Level
from ddsi.structure.builtin_entity_ids import SPDP_WRITER
from ddsi.structure.errors import ConfigurationError
from ddsi.structure.guid import Guid
from ddsi.structure.vendor import FAST_DDS, OPENDDS, RTI, RTI_MICRO, VendorId

from .attributes import ParticipantSecurityAttributes
from .crypto_transform_plugin import OpensAlike, SealsAlike, SecureSubmessageCategory
from .handles import DatareaderCryptoHandle, DatawriterCryptoHandle, ParticipantCryptoHandle
from .key_exchange import KeyExchange, Pair
from .local_endpoint import NEVER_IN_MESSAGES, PLAIN_BUILTIN, LocalEndpoint
from .plugins import Cryptographic
from .remote_participant import RemoteParticipant, Standing

__all__ = ["Protection"]

_CYCLONE_DDS: Final = VendorId(b"\x01\x10")
_SUBMESSAGE_HEADER: Final = 4

_INFO_TS: Final = int(SubmessageKind.INFO_TS)
_NOTHING: Parts = ()
_NONE, _MESSAGE, _SUBMESSAGE = int(Level.NONE), int(Level.MESSAGE), int(Level.SUBMESSAGE)
_IMPOSSIBLE: Final = 1 << 8
_DATAREADER_SUBMESSAGE: Final = SecureSubmessageCategory.DATAREADER_SUBMESSAGE
_ENDS_BY_HASH_ALONE: Final = frozenset((FAST_DDS, RTI, RTI_MICRO))
"""They dispose and unregister without a payload, so nothing is there that could be protected."""
_NO_RECEIVER: Final = Refused("none of the receivers has a key")
_UNPROVEN_END: Final = Rejected("it ends an instance, and nothing of it is protected")
_ALIKE: Final = 16
"""So many octets at the head of a protected submessage tell the sender, the key and the session."""
_PAYLOADS_ALIKE: Final = 12
_RTPS_HEADER: Final = 20
_MESSAGES_ALIKE: Final = _RTPS_HEADER + _ALIKE
_MOST_OPENERS: Final = 4096
_SMALL: Final = 1 << 12
"""Octets are quicker to take apart as ``bytes`` than through a view, unless it costs more to copy them."""


Encoder = Callable[[Parts], Parts | Refused]
PayloadEncoder = Callable[[Octets], Octets | Refused]
Opener = Callable[[Octets], Octets | None]
PayloadOpener = Callable[[Octets, memoryview | None], Octets | None]
EnvelopeOpener = Callable[[memoryview, int, int], tuple[Octets, int] | None]


class Protection:
    """For one participant of ours.  Its tables are those of the service and of the key exchange; it only reads them."""

    def __init__(
        self,
        cryptographic: Cryptographic,
        local_participant: ParticipantCryptoHandle,
        attributes: ParticipantSecurityAttributes,
        local_endpoints: dict[Guid, LocalEndpoint],
        remotes: dict[bytes, RemoteParticipant],
        keys: KeyExchange,
    ) -> None:
        self._cryptographic = cryptographic
        self._local_participant = local_participant
        self._is_rtps_protected = attributes.is_rtps_protected
        self._local_endpoints = local_endpoints
        self._remotes = remotes
        self._keys = keys
        self._payload_encoders: dict[Guid, PayloadEncoder | None] = {}
        self._submessage_encoders: dict[tuple[Guid, tuple[Guid, ...]], Encoder] = {}
        """By sender and receivers."""
        self._message_encoders: dict[tuple[Guid, ...], Encoder] = {}
        """By receivers."""
        self._short_ways = cryptographic if isinstance(cryptographic, OpensAlike) else None
        self._sealing = cryptographic if isinstance(cryptographic, SealsAlike) else None
        self._message_openers: dict[bytes, tuple[bytes, Opener, RemoteParticipant]] = {}
        """By source: what followed the header of its last message, and what opened it."""
        self._openers: dict[bytes, tuple[EnvelopeOpener, RemoteParticipant]] = {}
        """By source and first octets of submessages: what opens the like of them, and whose they are."""
        self._payload_openers: dict[Guid, tuple[bytes, PayloadOpener]] = {}
        """By remote writer: how its last payload began, and what opened it."""
        self._payload_pairs: dict[Guid, Pair | None] = {}
        """By remote writer: with whom it shares the key of its payloads; None where they are in clear."""
        self._required: dict[bytes, int] = {}
        """What the submessages of a remote endpoint need; by its Guid, until anything about it changes."""
        self.refused = 0
        """How many submessages and messages were not sent, as there is no key to protect them with."""

    def changed(self) -> None:
        """Endpoints or participants came or went."""
        self._required.clear()
        self._payload_encoders.clear()
        self._submessage_encoders.clear()
        self._message_encoders.clear()
        self._message_openers.clear()
        self._openers.clear()
        self._payload_openers.clear()
        self._payload_pairs.clear()

    # --- outwards ----------------------------------------------------------------------------------------

    def overhead(self, sender: Guid, receivers: tuple[Guid, ...]) -> Overhead:
        endpoint, count = self._local_endpoints.get(sender), max(len(receivers), 1)
        payload = submessage = message = 0
        if endpoint is not None and endpoint.handle is not None:
            added = self._cryptographic.overhead(endpoint.handle, count)
            payload, submessage = added.payload, added.submessage
        if self._is_rtps_protected and sender.entity_id not in NEVER_IN_MESSAGES:
            message = self._cryptographic.overhead(self._local_participant, count).message
        return Overhead(payload, submessage, message) if payload or submessage or message else NO_OVERHEAD

    def encode_payload(self, writer: Guid, payload: Octets) -> Octets:
        try:
            encode = self._payload_encoders[writer]
        except KeyError:
            encode = self._payload_encoders[writer] = self._payload_encoder(writer)
        if encode is None:
            return payload
        encoded = encode(payload)
        assert not isinstance(encoded, Refused), encoded
        return encoded

    def _payload_encoder(self, writer: Guid) -> PayloadEncoder | None:
        """The same for every payload of this writer; None where they are not protected."""
        endpoint = self._local_endpoints.get(writer)
        if endpoint is None or not endpoint.attributes.is_payload_protected:
            return None
        handle, general_way = endpoint.handle, self._cryptographic.encode_serialized_payload
        assert isinstance(handle, DatawriterCryptoHandle), "a writer whose payload is protected has keys"
        short = None if self._sealing is None else self._sealing.payload_sealer(handle)
        if short is not None:
            return short

        def encode(payload: Octets) -> Octets | Refused:
            extra_inline_qos = bytearray()
            encoded = general_way(extra_inline_qos, payload, handle)
            if extra_inline_qos:
                raise ConfigurationError(
                    f"{type(self._cryptographic).__name__} adds extra_inline_qos to a payload, which nobody carries: "
                    "what a reader needs to know must be in the payload"
                )
            return encoded if isinstance(encoded, Refused) else b"".join(encoded)

        return encode

    def encode_submessage(self, sender: Guid, receivers: tuple[Guid, ...], submessage: Parts) -> Parts:
        key = (sender, receivers)
        encode = self._submessage_encoders.get(key)
        if encode is None:
            encode = self._submessage_encoders[key] = self._submessage_encoder(sender, receivers)
        encoded = encode(submessage)
        return self._nothing() if isinstance(encoded, Refused) else encoded

    def _submessage_encoder(self, sender: Guid, receivers: tuple[Guid, ...]) -> Encoder:
        """The same for every submessage of this sender to them, until somebody comes or goes."""
        endpoint = self._local_endpoints.get(sender)
        if endpoint is None or not endpoint.attributes.is_submessage_protected:
            return _leave_it
        pairs = (self._keys.pairs.get((sender, receiver)) for receiver in receivers)
        handles = [pair.handle for pair in pairs if pair is not None and pair.is_open]
        handle, cryptographic, short_ways = endpoint.handle, self._cryptographic, self._sealing
        readers = [handle for handle in handles if isinstance(handle, DatareaderCryptoHandle)]
        writers = [handle for handle in handles if isinstance(handle, DatawriterCryptoHandle)]
        if isinstance(handle, DatawriterCryptoHandle) and readers:
            of_writer = cryptographic.encode_datawriter_submessage
            short = None if short_ways is None else short_ways.submessage_sealer(handle, readers)
            return short or (lambda submessage: of_writer(submessage, handle, readers))
        if isinstance(handle, DatareaderCryptoHandle) and writers:
            of_reader = cryptographic.encode_datareader_submessage
            short = None if short_ways is None else short_ways.submessage_sealer(handle, writers)
            return short or (lambda submessage: of_reader(submessage, handle, writers))
        return _refuse_it

    def encode_message(self, receivers: tuple[Guid, ...], message: Parts) -> Parts:
        if not self._is_rtps_protected:
            return message
        encode = self._message_encoders.get(receivers)
        if encode is None:
            encode = self._message_encoders[receivers] = self._message_encoder(receivers)
        encoded = encode(message)
        return self._nothing() if isinstance(encoded, Refused) else encoded

    def _message_encoder(self, receivers: tuple[Guid, ...]) -> Encoder:
        """The same of messages to them."""
        if not receivers or receivers[0].entity_id in NEVER_IN_MESSAGES:
            return _leave_it
        remotes = (self._remotes.get(prefix) for prefix in dict.fromkeys(receiver[:12] for receiver in receivers))
        handles = [remote.crypto for remote in remotes if remote is not None and remote.crypto is not None]
        if not handles:
            return _refuse_it
        encode, ours = self._cryptographic.encode_rtps_message, self._local_participant
        short = None if self._sealing is None else self._sealing.message_sealer(ours, handles)
        return short or (lambda message: encode(message, ours, handles))

    def _nothing(self) -> Parts:
        self.refused += 1
        return _NOTHING

    # --- inwards -----------------------------------------------------------------------------------------

    def decode_message(self, message: Octets, source: bytes) -> Octets | Outcome:
        known = self._message_openers.get(source)
        if known is not None and message[_RTPS_HEADER:_MESSAGES_ALIKE] == known[0]:
            plain = known[1](message)
            if plain is not None:
                known[2].opened += 1
                return plain
        return self._decode_message(message, source)

    def _decode_message(self, message: Octets, source: bytes) -> Octets | Outcome:
        """The general way of :meth:`decode_message`, and of the first that each participant protects."""
        remote = self._remotes.get(source)
        if remote is None or remote.crypto is None:
            return _no_keys(message, _RTPS_HEADER)
        plain = self._cryptographic.decode_rtps_message(message, self._local_participant, remote.crypto)
        if isinstance(plain, Outcome):
            return plain
        remote.opened += 1
        if self._short_ways is not None:
            opener = self._short_ways.message_opener(message, remote.crypto)
            if opener is not None:
                self._message_openers[source] = bytes(message[_RTPS_HEADER:_MESSAGES_ALIKE]), opener, remote
        return plain

    def open_envelope(self, message: memoryview, start: int, end: int, source: bytes) -> tuple[Octets, int] | None:
        known = self._openers.get(source + message[start : start + _ALIKE])
        if known is None:
            return None
        opened = known[0](message, start, end)
        if opened is not None:
            known[1].opened += 1
        return opened

    def decode_submessage(self, protected: Octets, source: bytes) -> Octets | Outcome:
        remote = self._remotes.get(source)
        if remote is None or remote.crypto is None:
            return _no_keys(protected, 0)
        whose = self._cryptographic.preprocess_secure_submsg(protected, self._local_participant, remote.crypto)
        if isinstance(whose, Outcome):
            return whose
        is_readers = whose.category is _DATAREADER_SUBMESSAGE
        sender = whose.datareader if is_readers else whose.datawriter
        pair = self._open_pair(sender) if sender is not None else None
        if pair is None:
            return NOT_FOR_US
        receiver, sender = pair.local.handle, pair.handle
        if isinstance(receiver, DatareaderCryptoHandle):
            assert isinstance(sender, DatawriterCryptoHandle)
            plain = self._cryptographic.decode_datawriter_submessage(protected, receiver, sender)
        else:
            assert isinstance(sender, DatareaderCryptoHandle)
            assert receiver is not None
            plain = self._cryptographic.decode_datareader_submessage(protected, receiver, sender)
        if isinstance(plain, Outcome):
            return plain
        if len(plain) < _SUBMESSAGE_HEADER:
            return Rejected("what was protected is no submessage")
        remote.opened += 1
        # One key protects both directions' submessages on the volatile topic.
        if not (_is_volatile(plain) if pair.is_volatile else _names(plain, pair.remote_entity)):
            return _speaks_for_another(pair)
        if pair.is_volatile and remote.handshake is not None:
            # Only who shares the secret can have said that.  A peer may have no key for us (OpenDDS), but it answers.
            remote.handshake.confirm()
        if self._short_ways is not None and not pair.is_volatile:
            opener = self._short_ways.submessage_opener(protected, sender, pair.remote_entity)
            if opener is not None:
                if len(self._openers) >= _MOST_OPENERS:
                    self._openers.clear()
                self._openers[source + bytes(protected[:_ALIKE])] = opener, remote
        return plain

    def _open_pair(self, sender: DatawriterCryptoHandle | DatareaderCryptoHandle) -> Pair | None:
        """The pair that has this handle of a sender; or, if that has parted, another that has the sender's key."""
        pair = self._keys.by_handle.get(sender)
        if pair is None or pair.is_open:
            return pair
        return next((other for other in self._keys.by_remote[pair.remote] if other.is_open), None)

    def decode_payload(self, writer: Guid, payload: Octets, place: memoryview | None = None) -> Octets | Outcome:
        if len(payload) < _SMALL:
            payload = bytes(payload)
        known = self._payload_openers.get(writer)
        if known is not None and payload[:_PAYLOADS_ALIKE] == known[0]:
            plain = known[1](payload, place)
            if plain is not None:
                return plain
        return self._decode_payload(writer, payload)

    def _decode_payload(self, writer: Guid, payload: Octets) -> Octets | Outcome:
        """The general way of :meth:`decode_payload`, and of the first that each writer protects."""
        pair = self._payload_pair(writer)
        if pair is None:
            return payload
        if not pair.is_open:
            return NOT_FOR_US
        local, remote = pair.local.handle, pair.handle
        assert isinstance(local, DatareaderCryptoHandle)
        assert isinstance(remote, DatawriterCryptoHandle)
        if not len(payload):
            return payload if pair.participant.data.vendor_id in _ENDS_BY_HASH_ALONE else _UNPROVEN_END
        plain = self._cryptographic.decode_serialized_payload(payload, b"", local, remote)
        if self._short_ways is not None and not isinstance(plain, Outcome):
            opener = self._short_ways.payload_opener(payload, remote)
            if opener is not None:
                self._payload_openers[writer] = bytes(payload[:_PAYLOADS_ALIKE]), opener
        return plain

    def protects_payload(self, writer: Guid) -> bool:
        try:
            return self._payload_pairs[writer] is not None
        except KeyError:
            return self._payload_pair(writer) is not None

    def opens_after_joining(self, reader: Guid) -> bool:
        """Only the vendor tells: nothing on the wire announces it, and who cannot open a sample says nothing."""
        return any(
            pair.local.attributes.is_payload_protected and pair.participant.data.vendor_id == OPENDDS
            for pair in self._keys.by_remote.get(reader, ())
        )

    def _payload_pair(self, writer: Guid) -> Pair | None:
        """One that is open, if there is any."""
        try:
            return self._payload_pairs[writer]
        except KeyError:
            pairs = [
                pair for pair in self._keys.by_remote.get(writer, ()) if pair.local.attributes.is_payload_protected
            ]
            found = max(pairs, key=lambda pair: pair.is_open, default=None)
            self._payload_pairs[writer] = found
            return found

    # --- what must be protected --------------------------------------------------------------------------

    def admits(self, sender: bytes, protection: int) -> bool:
        required = self._required.get(sender)
        if required is None:
            required = self._required[sender] = self._requirement(Guid(sender))
        return required & protection == required

    def _requirement(self, sender: Guid) -> int:
        """What a submessage of this remote endpoint needs.  Never less than our governance says of its topic."""
        remote = self._remotes.get(sender.prefix)
        if remote is None or remote.standing is Standing.UNAUTHENTICATED:
            return _NONE
        entity = sender.entity_id
        if entity == SPDP_WRITER and remote.standing is Standing.ADMITTED:
            return _IMPOSSIBLE  # anybody can write there; it speaks of itself on the secure topic now (§7.4.1.6)
        required = _NONE
        for pair in self._keys.by_remote.get(sender, ()):
            if pair.local.attributes.is_submessage_protected:
                required |= _SUBMESSAGE
        if not self._is_rtps_protected or entity in NEVER_IN_MESSAGES:
            return required
        if entity in PLAIN_BUILTIN and remote.data.vendor_id == _CYCLONE_DDS:
            return required
        return required | _MESSAGE


def _names(submessage: Octets, entity: bytes) -> bool:
    """Is this the sender that a submessage names?  INFO_TS names none (Fast DDS)."""
    start = SENDER_AT.get(submessage[0])
    return submessage[0] == _INFO_TS if start is None else submessage[start : start + 4] == entity


def _is_volatile(submessage: Octets) -> bool:
    """Is it of one of the two endpoints of the volatile topic?"""
    start = SENDER_AT.get(submessage[0])
    if start is None:
        return submessage[0] == _INFO_TS
    named = bytes(submessage[start : start + 4])
    return named in NEVER_IN_MESSAGES and named[0] == 0xFF


def _speaks_for_another(pair: Pair) -> Rejected:
    return Rejected(f"it was protected by {pair.remote}, and speaks for another")


def _leave_it(parts: Parts) -> Parts:
    return parts


def _refuse_it(parts: Parts) -> Refused:
    return _NO_RECEIVER


def _no_keys(octets: Octets, offset: int) -> NoKeys:
    """The key id stands behind the submessage header and the transformation kind of SEC_PREFIX or SRTPS_PREFIX."""
    return NoKeys(bytes(octets[offset + 8 : offset + 12]))
