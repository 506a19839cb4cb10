"""One participant of a capture, played by our crypto plugin: it receives what that participant received.

It does what a security service does for a participant that is authenticated already: registers who is there, takes the
tokens that arrive on the volatile topic, and lets the plugin open messages, submessages and payloads.  The plugin's own
keys are drawn anew and never used, as nothing is sent.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cache
from random import Random

from ddsi.messages.header import HEADER_LENGTH
from ddsi.messages.raw_submessage import SubmessageKind, iterate_submessages
from ddsi.messages.receiver import MessageReceiver
from ddsi.messages.submessages import AckNack, Data, DataFrag, InfoTimestamp, NackFrag, Submessage, decode_submessage
from ddsi.serialization import Octets
from ddsi.spi import Outcome
from ddsi.structure.builtin_entity_ids import (
    PARTICIPANT_MESSAGE_SECURE_READER,
    PARTICIPANT_MESSAGE_SECURE_WRITER,
    PARTICIPANT_VOLATILE_MESSAGE_SECURE_READER,
    PARTICIPANT_VOLATILE_MESSAGE_SECURE_WRITER,
)
from ddsi.structure.guid import EntityId, Guid, GuidPrefix
from ddsi_security.attributes import EndpointSecurityAttributes, ParticipantSecurityAttributes
from ddsi_security.crypto_transform_plugin import SecureSubmessageCategory
from ddsi_security.cryptographic import AesGcmGmac
from ddsi_security.generic_message import GenericMessage, read_generic_message
from ddsi_security.handles import (
    DatareaderCryptoHandle,
    DatawriterCryptoHandle,
    IdentityHandle,
    ParticipantCryptoHandle,
    PermissionsHandle,
    SharedSecretHandle,
)
from ddsi_security.properties import BUILTIN_ENDPOINT_NAME
from tests.captures.capture import Capture, load
from tests.security.captured.whole import Joined, Token, is_volatile

NOW = 1_795_305_600 * 10**9
"""A moment of 22 November 2026, when the captures were made."""
VOLATILE = "BuiltinParticipantVolatileMessageSecure"


# --- what governance asks for, written down once more (DDS-Security 1.1 §9.4.2) -------------------------------------


def participant_attributes(governance: Mapping[str, str]) -> ParticipantSecurityAttributes:
    kinds = [governance[name] for name in ("rtps", "discovery", "liveliness")]
    encrypted = sum(1 << bit for bit, kind in enumerate(kinds) if kind.startswith("ENCRYPT"))
    origin = sum(8 << bit for bit, kind in enumerate(kinds) if kind.endswith("ORIGIN_AUTHENTICATION"))
    rtps, discovery, liveliness = (kind != "NONE" for kind in kinds)
    return ParticipantSecurityAttributes(
        is_access_protected=True,
        is_rtps_protected=rtps,
        is_discovery_protected=discovery,
        is_liveliness_protected=liveliness,
        plugin_participant_attributes=1 << 31 | encrypted | origin,
    )


def endpoint_attributes(governance: Mapping[str, str], entity_id: EntityId) -> EndpointSecurityAttributes:
    """Of a user's endpoint, or of one of the secure builtin ones."""
    metadata, data = governance["metadata"], governance["data"]
    if entity_id.is_builtin:
        liveliness = entity_id in (PARTICIPANT_MESSAGE_SECURE_WRITER, PARTICIPANT_MESSAGE_SECURE_READER)
        metadata, data = governance["liveliness" if liveliness else "discovery"], "NONE"
    mask = 1 << 31 | metadata.startswith("ENCRYPT") | data.startswith("ENCRYPT") << 1
    return EndpointSecurityAttributes(
        is_submessage_protected=metadata != "NONE",
        is_payload_protected=data != "NONE",
        is_key_protected=data == "ENCRYPT",
        plugin_endpoint_attributes=mask | metadata.endswith("ORIGIN_AUTHENTICATION") << 2,
    )


# --- everybody ------------------------------------------------------------------------------------------------------


def roles(name: str) -> list[Role]:
    """Everybody in the capture."""
    capture = load(name)
    return [Role(capture, Guid(bytes.fromhex(peer["guid"]))) for peer in capture.facts["guids"]]


@cache
def played(name: str) -> list[Role]:
    """Everybody, who first heard the key exchange alone, and then everything from the beginning."""
    datagrams = load(name).datagrams
    learned = roles(name)
    for role in learned:
        for number, datagram in enumerate(datagrams):
            if is_volatile(datagram):
                role.hear(number, datagram)
        role.forget()
        for number, datagram in enumerate(datagrams):
            role.hear(number, datagram)
    return learned


# --- one participant ------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Opened:
    """One envelope that was opened: what it was, where in its message, what went in and came out.

    ``decode`` is how: it can be asked again, with other octets.  ``has_receiver_mac``: our own MAC was checked.
    """

    kind: str
    position: int
    encoded: Octets = field(repr=False)
    plain: Octets = field(repr=False)
    decode: Callable[[Octets], Octets | Outcome]
    has_receiver_mac: bool = False


@dataclass
class Role:
    """``opened`` by number of the datagram; ``refused`` what could not be opened, and why."""

    capture: Capture
    guid: Guid
    opened: dict[int, list[Opened]] = field(default_factory=dict)
    refused: list[tuple[int, Outcome]] = field(default_factory=list)
    tokens: list[Token] = field(default_factory=list)
    changes: dict[tuple[Guid, int], bytes] = field(default_factory=dict)
    key_only: set[tuple[Guid, int]] = field(default_factory=set)
    clear: Counter[EntityId] = field(default_factory=Counter)
    """DATA by writer that came without an envelope of its own."""

    def __post_init__(self) -> None:
        governance = self.capture.facts["governance"]
        self.governance: dict[str, str] = governance
        self.plugin = AesGcmGmac({}, entropy=Random(self.guid.hex()).randbytes, wall_clock=lambda: NOW)
        self.local = self.plugin.register_local_participant(
            IdentityHandle(), PermissionsHandle(), {}, participant_attributes(governance)
        )
        self.secrets: dict[GuidPrefix, SharedSecretHandle] = {}
        self.remotes: dict[GuidPrefix, ParticipantCryptoHandle] = {}
        self.local_readers: dict[EntityId, DatareaderCryptoHandle] = {}
        self.local_writers: dict[EntityId, DatawriterCryptoHandle] = {}
        self.remote_writers: dict[tuple[EntityId, Guid], DatawriterCryptoHandle] = {}
        """By the local reader and the remote writer."""
        self.remote_readers: dict[tuple[EntityId, Guid], DatareaderCryptoHandle] = {}
        """By the local writer and the remote reader."""
        self.owners: dict[object, Guid] = {}
        """Whose keys a remote handle stands for."""
        self.fragments: dict[tuple[Guid, int], Joined] = {}
        volatile_reader, volatile_writer = (
            PARTICIPANT_VOLATILE_MESSAGE_SECURE_READER,
            PARTICIPANT_VOLATILE_MESSAGE_SECURE_WRITER,
        )
        nothing = EndpointSecurityAttributes()
        self.local_readers[volatile_reader] = self.plugin.register_local_datareader(
            self.local, {BUILTIN_ENDPOINT_NAME: f"{VOLATILE}Reader"}, nothing
        )
        self.local_writers[volatile_writer] = self.plugin.register_local_datawriter(
            self.local, {BUILTIN_ENDPOINT_NAME: f"{VOLATILE}Writer"}, nothing
        )
        for remote, secret in self._shared_secrets():
            self.secrets[remote] = secret
            self.remotes[remote] = self.plugin.register_matched_remote_participant(
                self.local, IdentityHandle(), PermissionsHandle(), secret
            )
            self.remote_writer(volatile_reader, Guid.of(remote, volatile_writer))
            self.remote_reader(volatile_writer, Guid.of(remote, volatile_reader))

    def _shared_secrets(self) -> Iterator[tuple[GuidPrefix, SharedSecretHandle]]:
        for kx in self.capture.facts["kx"]:
            sides = [Guid(bytes.fromhex(kx[side])) for side in ("initiator_guid", "replier_guid")]
            if self.guid in sides:
                is_replier = self.guid == sides[1]
                texts = kx["challenge1"], kx["challenge2"], kx["shared_secret"]
                secret = SharedSecretHandle(*map(bytes.fromhex, texts), is_replier=is_replier)
                yield sides[not is_replier].prefix, secret

    # --- registering --------------------------------------------------------------------------------------------

    def remote_writer(self, reader_id: EntityId, writer: Guid) -> DatawriterCryptoHandle:
        """The handle of the pair; both are registered when they are heard of first."""
        if reader_id not in self.local_readers:
            attributes = endpoint_attributes(self.governance, reader_id)
            self.local_readers[reader_id] = self.plugin.register_local_datareader(self.local, {}, attributes)
        if (reader_id, writer) not in self.remote_writers:
            handle = self.plugin.register_matched_remote_datawriter(
                self.local_readers[reader_id], self.remotes[writer.prefix], self.secrets[writer.prefix]
            )
            self.remote_writers[reader_id, writer] = handle
            self.owners[handle] = writer
        return self.remote_writers[reader_id, writer]

    def remote_reader(self, writer_id: EntityId, reader: Guid) -> DatareaderCryptoHandle:
        if writer_id not in self.local_writers:
            attributes = endpoint_attributes(self.governance, writer_id)
            self.local_writers[writer_id] = self.plugin.register_local_datawriter(self.local, {}, attributes)
        if (writer_id, reader) not in self.remote_readers:
            handle = self.plugin.register_matched_remote_datareader(
                self.local_writers[writer_id],
                self.remotes[reader.prefix],
                self.secrets[reader.prefix],
                relay_only=False,
            )
            self.remote_readers[writer_id, reader] = handle
            self.owners[handle] = reader
        return self.remote_readers[writer_id, reader]

    def forget(self) -> None:
        """All that was received, but no key."""
        for received in (self.opened, self.refused, self.tokens, self.changes, self.key_only, self.clear):
            received.clear()

    # --- receiving ----------------------------------------------------------------------------------------------

    def hear(self, number: int, datagram: Octets) -> None:
        """A datagram of the capture, by its number; our own and those of strangers are none of our business."""
        source = GuidPrefix(bytes(datagram[8:20]))
        if source not in self.remotes:
            return
        first = next(iterate_submessages(datagram))
        message = datagram
        if first.kind == SubmessageKind.SRTPS_PREFIX:
            remote = self.remotes[source]

            def decode(octets: Octets) -> Octets | Outcome:
                return self.plugin.decode_rtps_message(octets, self.local, remote)

            has_mac = "ORIGIN" in self.governance["rtps"]
            opened = self._open(number, "rtps_messages", 0, datagram, decode, has_receiver_mac=has_mac)
            if opened is None:
                return
            message = opened
            assert bytes(message[:HEADER_LENGTH]) == datagram[:HEADER_LENGTH]
        self._walk(number, source, message)

    def _walk(self, number: int, source: GuidPrefix, message: Octets) -> None:
        """The submessages that are for us, out of their envelopes."""
        receiver = MessageReceiver(message)
        walk = iter(iterate_submessages(message))
        for raw in walk:
            if raw.kind == SubmessageKind.SEC_PREFIX:
                _, end = next(walk), next(walk)
                if receiver.state.is_addressed_to(self.guid.prefix):
                    self._triple(number, source, message[raw.offset : end.end], raw.offset)
                continue
            submessage = decode_submessage(raw)
            receiver.state = receiver.state.interpret(submessage)
            if isinstance(submessage, (Data, DataFrag)) and receiver.state.is_addressed_to(self.guid.prefix):
                self.clear[submessage.writer_id] += 1
                self._change(number, raw.offset, source, submessage)

    def _triple(self, number: int, source: GuidPrefix, encoded: Octets, position: int) -> None:
        found = self.plugin.preprocess_secure_submsg(encoded, self.local, self.remotes[source])
        if isinstance(found, Outcome):
            self.refused.append((number, found))
            return
        reader, writer = found.datareader, found.datawriter
        assert reader is not None
        assert writer is not None
        is_reader = found.category == SecureSubmessageCategory.DATAREADER_SUBMESSAGE

        def decode(octets: Octets) -> Octets | Outcome:
            if is_reader:
                return self.plugin.decode_datareader_submessage(octets, writer, reader)
            return self.plugin.decode_datawriter_submessage(octets, reader, writer)

        sender_id = self.owners[reader if is_reader else writer].entity_id
        kind = "datareader_submessages" if is_reader else "datawriter_submessages"
        if found.category == SecureSubmessageCategory.INFO_SUBMESSAGE:
            kind = "volatile_submessages"
        has_mac = self._is_origin_authenticated(sender_id, kind)
        plain = self._open(number, kind, position, encoded, decode, has_receiver_mac=has_mac)
        if plain is None:
            return
        (raw,) = iterate_submessages(plain, start=0)
        submessage = decode_submessage(raw)
        self._check_owner(sender_id, kind, submessage)
        if isinstance(submessage, (Data, DataFrag)):
            self._change(number, position, source, submessage)

    def _is_origin_authenticated(self, sender_id: EntityId, kind: str) -> bool:
        mask = endpoint_attributes(self.governance, sender_id).plugin_endpoint_attributes
        return kind != "volatile_submessages" and bool(mask & 4)

    def _check_owner(self, owner: EntityId, kind: str, submessage: Submessage) -> None:
        """What is inside must be about the endpoint whose key it came under."""
        if kind == "volatile_submessages" or isinstance(submessage, InfoTimestamp):
            return
        is_readers = isinstance(submessage, (AckNack, NackFrag))
        assert (kind == "datareader_submessages") == is_readers
        assert getattr(submessage, "reader_id" if is_readers else "writer_id") == owner

    def _open(
        self,
        number: int,
        kind: str,
        position: int,
        encoded: Octets,
        decode: Callable[[Octets], Octets | Outcome],
        *,
        has_receiver_mac: bool = False,
    ) -> Octets | None:
        """The plain octets; what was opened and what was not is noted."""
        plain = decode(encoded)
        if isinstance(plain, Outcome):
            self.refused.append((number, plain))
            return None
        opened = Opened(kind, position, encoded, plain, decode, has_receiver_mac)
        self.opened.setdefault(number, []).append(opened)
        return plain

    # --- changes ------------------------------------------------------------------------------------------------

    def _change(self, number: int, position: int, source: GuidPrefix, submessage: Data | DataFrag) -> None:
        writer = Guid.of(source, submessage.writer_id)
        is_volatile = submessage.writer_id == PARTICIPANT_VOLATILE_MESSAGE_SECURE_WRITER
        if submessage.writer_id.is_builtin and not is_volatile:
            return
        payload: Octets | None = submessage.serialized_payload
        if payload and not is_volatile and self.governance["data"] != "NONE":
            payload = self._open_payload(number, position, writer, submessage)
        if payload is None:
            return
        change = writer, submessage.writer_sn
        if isinstance(submessage, DataFrag):
            joined = self.fragments.setdefault(change, Joined(bytearray(submessage.sample_size)))
            if not joined.add(submessage.run_start, bytes(payload[: submessage.run_length])):
                return
            payload = bytes(self.fragments.pop(change).octets)
        if is_volatile:
            self._key_exchange(source, read_generic_message(payload))
        elif submessage.is_key or not payload:
            self.key_only.add(change)
        else:
            self.changes[change] = bytes(payload)

    def _open_payload(self, number: int, position: int, writer: Guid, submessage: Data | DataFrag) -> Octets | None:
        """As whichever of our readers is matched with the writer; None where there is none."""
        pairs = [(reader_id, handle) for (reader_id, guid), handle in self.remote_writers.items() if guid == writer]
        if not pairs:
            return None
        reader_id, handle = pairs[0]
        reader = self.local_readers[reader_id]

        def decode(octets: Octets) -> Octets | Outcome:
            return self.plugin.decode_serialized_payload(octets, b"", reader, handle)

        kind = "fragment_payloads" if isinstance(submessage, DataFrag) else "payloads"
        return self._open(number, kind, position, submessage.serialized_payload, decode)

    def _key_exchange(self, source: GuidPrefix, message: GenericMessage) -> None:
        assert message.message_identity.source_guid.prefix == source
        if message.destination_participant_guid != self.guid:
            return
        destination, owner = message.destination_endpoint_guid, message.source_endpoint_guid
        kind = message.message_class_id.removeprefix("dds.sec.").removesuffix("_crypto_tokens")
        tokens = message.message_data
        if kind == "participant":
            destination, owner = self.guid, Guid.of(source, EntityId.PARTICIPANT)
            refused = self.plugin.set_remote_participant_crypto_tokens(self.local, self.remotes[source], tokens)
        elif kind == "datawriter":
            writer = self.remote_writer(destination.entity_id, owner)
            reader = self.local_readers[destination.entity_id]
            refused = self.plugin.set_remote_datawriter_crypto_tokens(reader, writer, tokens)
        else:
            assert kind == "datareader"
            remote_reader = self.remote_reader(destination.entity_id, owner)
            local_writer = self.local_writers[destination.entity_id]
            refused = self.plugin.set_remote_datareader_crypto_tokens(local_writer, remote_reader, tokens)
        assert refused is None, refused
        for index, token in enumerate(tokens):
            keymat = token.binary_property("dds.cryp.keymat")
            assert keymat is not None
            self.tokens.append(Token(kind, owner.hex(), destination.hex(), index, keymat.hex()))
