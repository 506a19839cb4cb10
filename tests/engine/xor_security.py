"""XorSecurity: hooks that do everything which real ones do, with toys in the place of cryptography.

A participant is authenticated when each side has greeted and was answered, over the stateless topic.  Then keys (one
octet each) go over the volatile topic: the participant's, and one for every pair of endpoints, which is matched when
the other side's has come.  Payloads, submessages and messages are XORed, and framed as DDS-Security 1.1 §8.5.1.9 frames
them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import count

from ddsi.spi import (
    ADMITTED,
    NOT_FOR_US,
    PENDING,
    Admission,
    Announcement,
    Decided,
    HookEffect,
    LocalParticipant,
    NoKeys,
    Octets,
    Outcome,
    Overhead,
    Parts,
    ProtectedEndpoint,
    Protection,
    Refused,
    Rejected,
    SendMessage,
)
from ddsi.spi.plaintext import Plaintext
from ddsi.structure import builtin_entity_ids as ids
from ddsi.structure.builtin_entity_ids import BuiltinEndpoints
from ddsi.structure.cache_change import CacheChange, ChangeKind
from ddsi.structure.discovered import DiscoveredParticipantData, DiscoveredReaderData, DiscoveredWriterData
from ddsi.structure.guid import EntityId, Guid, GuidPrefix
from ddsi.structure.security_information import ParticipantSecurity

__all__ = ["SECURE_BITS", "STATUS_TOKEN", "STRANGE_ISSUER", "TRUSTED_ISSUER", "XorSecurity"]

TRUSTED_ISSUER, STRANGE_ISSUER = b"\7\0\0\x80" + bytes(4), b"\x66\0\0\x80" + bytes(4)
STATUS_TOKEN = (0x1006, b"\2\0\0\0s\0\0\0" + bytes(8))
SECURE_BITS = BuiltinEndpoints(0xF_0FFF_0000)
IDENTITY = 0x1005

STATELESS = (ids.PARTICIPANT_STATELESS_MESSAGE_WRITER, ids.PARTICIPANT_STATELESS_MESSAGE_READER)
VOLATILE = (ids.PARTICIPANT_VOLATILE_MESSAGE_SECURE_WRITER, ids.PARTICIPANT_VOLATILE_MESSAGE_SECURE_READER)
PLAIN = (
    *(ids.TYPE_LOOKUP_REQUEST_WRITER, ids.TYPE_LOOKUP_REQUEST_READER),
    *(ids.TYPE_LOOKUP_REPLY_WRITER, ids.TYPE_LOOKUP_REPLY_READER),
    ids.SEDP_PUBLICATIONS_WRITER,
    ids.SEDP_PUBLICATIONS_READER,
    ids.SEDP_SUBSCRIPTIONS_WRITER,
    ids.SEDP_SUBSCRIPTIONS_READER,
    ids.PARTICIPANT_MESSAGE_WRITER,
    ids.PARTICIPANT_MESSAGE_READER,
)
_HEADER = b"\0\1\0\0"
_MAC = b"MAC!"
_RESEND_S = 0.2
_LONG = bytes(4000)  # a handshake message is larger than a datagram
_sessions = count(1)


@dataclass
class Peer:
    """``session``: by which name it greets; another is that of a program that has started since (``is_renewed``)."""

    session: bytes = b""
    is_renewed: bool = False
    greeted: bool = False
    answered: bool = False
    greet_at: float = 0.0

    @property
    def is_authenticated(self) -> bool:
        return self.greeted and self.answered


@dataclass
class XorSecurity(Plaintext):
    """``issuer``: who vouches for us.  ``withholds``: keys are kept back until :meth:`release`.

    ``announces_openly``: its endpoints are announced in clear, whatever governance says.  ``protects_liveliness``: the
    secure topic of assertions is what its name says.
    """

    issuer: bytes = TRUSTED_ISSUER
    withholds: bool = False
    announces_openly: bool = False
    protects_liveliness: bool = True
    peers: dict[bytes, Peer] = field(default_factory=dict)
    changed: list[DiscoveredParticipantData] = field(default_factory=list)
    keys: dict[tuple[Guid, Guid], int] = field(default_factory=dict)
    sender_keys: dict[Guid, int] = field(default_factory=dict)
    participant_keys: dict[bytes, int] = field(default_factory=dict)
    pending: set[tuple[Guid, Guid]] = field(default_factory=set)
    effects: list[HookEffect] = field(default_factory=list)
    withheld: list[HookEffect] = field(default_factory=list)
    said: bytes = b""

    # --- lifecycle ---------------------------------------------------------------------------------------

    def local_participant(self, candidate: LocalParticipant) -> Guid:
        self.guid = candidate.guid
        self.session = next(_sessions).to_bytes(8, "big")
        return candidate.guid

    def announcement(self) -> Announcement:
        return Announcement(((IDENTITY, self.issuer),), SECURE_BITS, (STATUS_TOKEN,))

    def announced(self, parameters: bytes) -> None:
        self.said = parameters

    def participant_security(self, participant: Guid) -> ParticipantSecurity:
        return ParticipantSecurity(is_authenticated=True, is_liveliness_protected=self.protects_liveliness)

    def local_writer(self, data: DiscoveredWriterData) -> ProtectedEndpoint:
        is_secret = not (data.topic_name.startswith("Open") or self.announces_openly)
        return ProtectedEndpoint(discovery_protected=is_secret, liveliness_protected=is_secret)

    def local_reader(self, data: DiscoveredReaderData) -> ProtectedEndpoint:
        is_secret = not (data.topic_name.startswith("Open") or self.announces_openly)
        return ProtectedEndpoint(discovery_protected=is_secret, liveliness_protected=is_secret)

    def remote_participant(self, data: DiscoveredParticipantData, now: float) -> Admission:
        issuer = dict(data.security_parameters).get(IDENTITY)
        if issuer != TRUSTED_ISSUER:
            return Refused("it has no identity" if issuer is None else "somebody else vouches for it")
        self.peers[data.guid.prefix] = Peer(greet_at=now)
        return PENDING

    def remote_participant_changed(self, data: DiscoveredParticipantData, now: float) -> Admission:
        self.changed.append(data)
        peer = self.peers.get(data.guid.prefix)
        if peer is None:
            return self.remote_participant(data, now)
        return ADMITTED if peer.is_authenticated else PENDING

    def remote_participant_lost(self, guid: Guid) -> None:
        self.peers.pop(guid.prefix, None)
        self.participant_keys.pop(guid.prefix, None)
        self.keys = {pair: key for pair, key in self.keys.items() if pair[0].prefix != guid.prefix}
        self.sender_keys = {sender: key for sender, key in self.sender_keys.items() if sender.prefix != guid.prefix}
        self.pending = {pair for pair in self.pending if pair[1].prefix != guid.prefix}

    def admits_announcement(self, data: DiscoveredWriterData | DiscoveredReaderData, *, is_secure: bool) -> bool:
        return is_secure is not data.topic_name.startswith("Open")

    def match(self, local: Guid, remote: DiscoveredWriterData | DiscoveredReaderData) -> Admission:
        entity = local.entity_id
        if entity == VOLATILE[0]:
            self._send(VOLATILE[0], remote.guid, b"P" + bytes((_key(self.guid),)))
        if entity in (*STATELESS, *VOLATILE, *PLAIN):
            return ADMITTED
        if remote.topic_name == "Forbidden":
            return Refused("its permissions do not name topic Forbidden")
        self._send(VOLATILE[0], remote.guid, b"T" + local + remote.guid + bytes((_key(local),)), keeps=self.withholds)
        if (remote.guid, local) in self.keys:
            return ADMITTED
        self.pending.add((local, remote.guid))
        return PENDING

    def release(self) -> None:
        """The keys that were kept back go out now."""
        self.withholds = False
        self.effects += self.withheld
        self.withheld.clear()

    # --- messages and the clock --------------------------------------------------------------------------

    def receive_message(self, change: CacheChange, now: float) -> None:
        self.now = now
        to, content = bytes(change.payload[4:16]), bytes(change.payload[16:])
        source = change.writer_guid
        peer = self.peers.get(source.prefix)
        if peer is None or to != self.guid.prefix:
            return
        if source.entity_id == STATELESS[0]:
            self._greeted_or_answered(peer, source, content)
        elif content[:1] == b"P":
            self.participant_keys[source.prefix] = content[1]
        elif content[:1] == b"T":
            remote, local, key = Guid(content[1:17]), Guid(content[17:33]), content[33]
            self.keys[(remote, local)] = self.sender_keys[remote] = key
            if (local, remote) in self.pending:
                self.pending.discard((local, remote))
                self.effects.append(Decided(local, remote, ADMITTED))

    def _greeted_or_answered(self, peer: Peer, source: Guid, content: bytes) -> None:
        if content[:1] == b"H" and peer.greeted and content[1:9] != peer.session:
            self.remote_participant_lost(source.participant)
            peer = self.peers[source.prefix] = Peer(greet_at=self.now, is_renewed=peer.is_authenticated)
        was_authenticated = peer.is_authenticated
        if content[:1] == b"H":
            peer.greeted, peer.session = True, content[1:9]
            self._send(STATELESS[0], source, b"W" + content[1:9] + _LONG)
        elif content[:1] == b"W" and content[1:9] == self.session:
            peer.answered = True
        if peer.is_authenticated and not was_authenticated:
            if peer.is_renewed:
                self._begin_anew(source.prefix)
            self.effects.append(Decided(self.guid, source.participant, ADMITTED))

    def _begin_anew(self, prefix: GuidPrefix) -> None:
        """Its volatile endpoints count from 1 again, and it has to be told our key."""
        writer, reader = VOLATILE
        for ours, theirs in ((writer, reader), (reader, writer)):
            self.effects.append(Decided(Guid.of(self.guid.prefix, ours), Guid.of(prefix, theirs), ADMITTED))
        self._send(writer, Guid.of(prefix, reader), b"P" + bytes((_key(self.guid),)))

    def handle_timeout(self, now: float) -> None:
        for prefix, peer in self.peers.items():
            if not peer.answered and peer.greet_at <= now:
                peer.greet_at = now + _RESEND_S
                to = Guid.of(GuidPrefix(prefix), EntityId.PARTICIPANT)
                self._send(STATELESS[0], to, b"H" + self.session + _LONG)

    def next_deadline(self) -> float:
        return min((peer.greet_at for peer in self.peers.values() if not peer.answered), default=math.inf)

    def _send(self, writer: EntityId, to: Guid, content: bytes, *, keeps: bool = False) -> None:
        payload = _HEADER + to.prefix + content
        change = CacheChange(
            ChangeKind.ALIVE, Guid.of(self.guid.prefix, writer), 0, payload, destination=to.participant
        )
        (self.withheld if keeps else self.effects).append(SendMessage(writer, change))

    def drain_effects(self) -> Sequence[HookEffect]:
        effects, self.effects = self.effects, []
        return effects

    # --- transform ---------------------------------------------------------------------------------------

    def overhead(self, sender: Guid, receivers: tuple[Guid, ...]) -> Overhead:
        return Overhead(submessage=44, message=44)

    def encode_payload(self, writer: Guid, payload: Octets) -> Octets:
        return payload if writer.entity_id.is_builtin else _xor(payload, 0x5A)

    def decode_payload(self, writer: Guid, payload: Octets, place: memoryview | None = None) -> Octets | Outcome:
        return payload if writer.entity_id.is_builtin else _xor(payload, 0x5A)

    def encode_submessage(self, sender: Guid, receivers: tuple[Guid, ...], submessage: Parts) -> Parts:
        entity = sender.entity_id
        if entity in (*STATELESS, *PLAIN):
            return submessage
        if not receivers:
            return ()
        key = self._kx_key(receivers[0].prefix) if entity in VOLATILE else _key(sender)
        return _frame(0x31, sender, key, b"".join(submessage))

    def decode_submessage(self, protected: Octets, source: bytes) -> Octets | Outcome:
        sender = Guid(protected[4:20])
        if sender.prefix != source:
            return Rejected(f"{sender} speaks as {source.hex()}")
        is_kx = sender.entity_id in VOLATILE
        key = self._kx_key(source) if is_kx and source in self.peers else self.sender_keys.get(sender)
        plain = _open(protected, key)
        return NOT_FOR_US if is_kx and isinstance(plain, Rejected) else plain

    def encode_message(self, receivers: tuple[Guid, ...], message: Parts) -> Parts:
        if receivers[0].entity_id in (*STATELESS, *VOLATILE):
            return message
        octets = b"".join(message)
        return (octets[:20], *_frame(0x33, self.guid, _key(self.guid), octets[20:]))

    def decode_message(self, message: Octets, source: bytes) -> Octets | Outcome:
        plain = _open(message[20:], self.participant_keys.get(source))
        return plain if isinstance(plain, Outcome) else bytes(message[:20]) + bytes(plain)

    def _kx_key(self, prefix: bytes) -> int:
        return _key(self.guid.prefix) ^ _key(prefix) | 1

    def admits(self, sender: bytes, protection: int) -> bool:
        entity = EntityId(sender[12:])
        if entity == ids.SPDP_WRITER:
            peer = self.peers.get(sender[:12])
            return peer is None or not peer.is_authenticated
        if entity in STATELESS:
            return True
        required = 0 if entity in VOLATILE else Protection.MESSAGE
        if entity not in PLAIN:
            required |= Protection.SUBMESSAGE
        return protection & required == required


def _key(octets: bytes) -> int:
    """Not 0, and another one for nearly everybody."""
    return sum((index + 1) * octet for index, octet in enumerate(octets)) % 255 + 1


def _xor(octets: Octets, key: int) -> bytes:
    return bytes(octets).translate(bytes(octet ^ key for octet in range(256)))


def _frame(kind: int, sender: Guid, key: int, plain: bytes) -> Parts:
    """``kind``: SEC_PREFIX or SRTPS_PREFIX."""
    body = len(plain).to_bytes(4, "little") + _xor(plain + _MAC, key)
    body += bytes(-len(body) % 4)
    return (
        bytes((kind, 1, 16, 0)) + sender,
        b"\x30\x01" + len(body).to_bytes(2, "little") + body,
        bytes((kind + 1, 1, 4, 0)) + b"stop",
    )


def _open(framed: Octets, key: int | None) -> Octets | Outcome:
    if key is None:
        return NoKeys(bytes(framed[16:20]))
    length = int.from_bytes(framed[24:28], "little")
    plain = _xor(framed[28 : 28 + length + 4], key)
    return plain[:-4] if plain[-4:] == _MAC else Rejected("the MAC is wrong")
