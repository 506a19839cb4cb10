"""The short ways of what is protected as it was before: it is opened as it was before.

DDS-Security 1.1 §9.5.3.3 (decode_rtps_message, decode_datawriter_submessage, decode_datareader_submessage,
decode_serialized_payload).
Under which key and in which session something was protected its first octets tell, and nearly all of one sender begin
with the same ones.  :mod:`.opening` and :mod:`.payload` are the general ways, which open the first; tests hold each
pair against each other.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from functools import lru_cache
from hmac import compare_digest
from typing import Final

from cryptography.exceptions import InvalidTag
from cryptography.hazmat.primitives.ciphers.aead import AESGCM

from ddsi.messages.fast import SENDER_AT
from ddsi.spi import Octets, Outcome

from .aes_gcm import LARGE, decrypter_into
from .envelope import HEAD, MESSAGE, SUBMESSAGE, Envelope, body_head
from .opening import INFO_SRC_HEADS, as_message, with_header
from .received_keys import KeyRing, ReceivedSession
from .rooms import Rooms
from .transformation import HEADER_LENGTH, MAC_LENGTH, Protection

__all__ = [
    "MessageOpener",
    "PayloadOpener",
    "SignedMessageOpener",
    "SignedSubmessageOpener",
    "SubmessageOpener",
    "message_opener",
    "payload_opener",
    "submessage_opener",
]

_RTPS_HEADER: Final = 20
_NONCE_AT: Final = 12
_BODY_AT: Final = 24
_CONTENT_AT: Final = 32
_FOOT: Final = 24
"""The postfix with its header, without receiver-specific MACs."""
_NO_MACS: Final = bytes(4)
_POSTFIX_HEAD: Final = MESSAGE.postfix_head
_SIGNED_AT: Final = _RTPS_HEADER + _BODY_AT
_LEAST_SIGNED: Final = _SIGNED_AT + 24 + _FOOT
"""A signed message with INFO_SRC alone."""
_AROUND: Final = _CONTENT_AT + _FOOT
"""Octets around what is encrypted."""
_LEAST: Final = _AROUND + 4
_AFTER_MAC: Final = len(_NO_MACS) + 4
"""What of the postfix lies behind the MAC while it is where AES-GCM wants it: that is where the header was."""
_SIGNED_HEAD: Final = struct.Struct("<12x12sBBH")
"""Of a signed submessage: the nonce, and its own header, little-endian."""
_SIGNED_FOOT: Final = struct.Struct(f"4s{MAC_LENGTH}s4s")
_LEAST_SIGNED_SUBMESSAGE: Final = _SIGNED_HEAD.size + _FOOT
_LENGTH: Final = struct.Struct("<H")
_LENGTH_AT: Final = _BODY_AT + 2
"""Of SEC_BODY."""
_AROUND_BODY: Final = _BODY_AT + HEAD.size + _FOOT
"""Octets of an envelope beside those that this length counts."""

_PAYLOAD_HEAD: Final = struct.Struct(">8x12sI")
"""The nonce, and how many octets were encrypted."""
_PAYLOAD_CONTENT_AT: Final = HEADER_LENGTH + 4
_PAYLOAD_FOOT: Final = MAC_LENGTH + len(_NO_MACS)


class _Encrypted:
    """Envelopes that begin with the same 16 octets: encrypted, for all receivers alike, in one session."""

    __slots__ = ("_decrypt", "_decrypt_into", "_postfix_head", "_room")

    def __init__(self, envelope: Envelope, aead: AESGCM, rooms: Rooms) -> None:
        self._postfix_head = envelope.postfix_head
        self._decrypt = aead.decrypt
        self._decrypt_into = decrypter_into(aead)
        self._room = rooms.room

    def content(self, octets: Octets, start: int, end: int) -> Octets | None:
        """What lies in the envelope ``octets[start:end]``, which is small; else None, and the octets are as they were.

        None also where they were altered: the general way says in what.
        """
        length = end - start
        if length < _LEAST:
            return None
        take_apart, expected_head = _layout(length)
        nonce, head, cipher_text, postfix_head, mac, count = take_apart(octets, start)
        if head != expected_head or postfix_head != self._postfix_head or count != _NO_MACS:
            return None
        try:
            return self._decrypt(nonce, cipher_text + mac, None)
        except InvalidTag:
            return None

    def large_content(self, octets: memoryview, start: int, end: int) -> Octets | None:
        """Without copying, where ``octets`` can be written to: the MAC goes for a while to where AES-GCM wants it."""
        take_apart, expected_head = _large_layout(end - start)
        nonce, head, postfix_head, mac, count = take_apart(octets, start)
        if head != expected_head or postfix_head != self._postfix_head or count != _NO_MACS:
            return None
        if octets.readonly:
            sealed: Octets = b"".join((octets[start + _CONTENT_AT : end - _FOOT], mac))
        else:
            octets[end - _FOOT : end - _AFTER_MAC] = mac
            sealed = octets[start + _CONTENT_AT : end - _AFTER_MAC]
        room = self._room(end - start - _AROUND)
        try:
            self._decrypt_into(nonce, sealed, None, room)
        except InvalidTag:
            self._put_back(octets, start, end)
            return None
        return room

    def _put_back(self, octets: Octets, start: int, end: int) -> None:
        """The general way is to find the octets as they were: the MAC goes back to its place."""
        view = memoryview(octets)[start:end]
        if not view.readonly and len(view) >= LARGE:
            mac = bytes(view[-_FOOT:-_AFTER_MAC])
            view[-_FOOT:] = b"".join((self._postfix_head, mac, _NO_MACS))


# Few lengths are in use at a time, and one call that takes all apart is quicker than a slice for each.
@lru_cache(maxsize=256)
def _layout(length: int) -> tuple[Callable[[Octets, int], tuple[bytes, ...]], bytes]:
    """Of an envelope with so many octets: its parts, from the nonce on, and the head of SEC_BODY as it must be."""
    content = length - _CONTENT_AT - _FOOT
    parts = struct.Struct(f"{_NONCE_AT}x12s8s{content}s4s{MAC_LENGTH}s4s")
    return parts.unpack_from, b"" if length & 3 else body_head(content)


@lru_cache(maxsize=256)
def _large_layout(length: int) -> tuple[Callable[[Octets, int], tuple[bytes, ...]], bytes]:
    """The same without the content, which stays where it is."""
    content = length - _CONTENT_AT - _FOOT
    parts = struct.Struct(f"{_NONCE_AT}x12s8s{content}x4s{MAC_LENGTH}s4s")
    return parts.unpack_from, b"" if length & 3 else body_head(content)


class SubmessageOpener(_Encrypted):
    """For submessages of the entity with this id."""

    __slots__ = ("_entity_id",)

    def __init__(self, entity_id: bytes, aead: AESGCM, rooms: Rooms) -> None:
        super().__init__(SUBMESSAGE, aead, rooms)
        self._entity_id = entity_id

    def open(self, octets: Octets, start: int, end: int) -> tuple[Octets, int] | None:
        """The one submessage in the envelope at ``octets[start]``, little-endian and with its length, and where the
        envelope ends, at most at ``end``; else None, and the octets are as they were."""
        if end - start < _LEAST:
            return None
        past = start + _AROUND_BODY + _LENGTH.unpack_from(octets, start + _LENGTH_AT)[0]
        if past > end:
            return None
        plain = (
            self.content(octets, start, past) if past - start < LARGE
            else self.large_content(memoryview(octets), start, past)
        )  # fmt: skip
        if plain is None:
            return None
        kind, flags, length = HEAD.unpack_from(plain)
        at = SENDER_AT.get(kind)
        if at is None or not flags & 1 or length != past - start - _LEAST or plain[at : at + 4] != self._entity_id:
            self._put_back(octets, start, past)
            return None
        return plain, past


class SignedSubmessageOpener:
    """The same of submessages that are signed."""

    __slots__ = ("_encrypt", "_entity_id")

    def __init__(self, entity_id: bytes, aead: AESGCM) -> None:
        self._encrypt = aead.encrypt
        self._entity_id = entity_id

    def open(self, octets: Octets, start: int, end: int) -> tuple[Octets, int] | None:
        """As :meth:`SubmessageOpener.open`.  Large octets are not copied."""
        if end - start < _LEAST_SIGNED_SUBMESSAGE:
            return None
        nonce, kind, flags, length = _SIGNED_HEAD.unpack_from(octets, start)
        body = start + _BODY_AT
        foot = body + HEAD.size + length
        at = SENDER_AT.get(kind)
        if at is None or not flags & 1 or length & 3 or foot + _FOOT > end:
            return None
        postfix_head, mac, count = _SIGNED_FOOT.unpack_from(octets, foot)
        signed = octets[body:foot] if foot - body >= LARGE else bytes(octets[body:foot])
        if (
            postfix_head != SUBMESSAGE.postfix_head or count != _NO_MACS or signed[at : at + 4] != self._entity_id
            or not compare_digest(self._encrypt(nonce, b"", signed), mac)
        ):  # fmt: skip
            return None
        return signed, foot + _FOOT


class MessageOpener(_Encrypted):
    """For messages that follow their header with the same 16 octets, and end with SRTPS_POSTFIX: encrypted ones."""

    __slots__ = ()

    def open(self, octets: Octets) -> Octets | None:
        """The message, with its header; else None, and ``octets`` are as they were."""
        length = len(octets)
        if length < LARGE:
            octets = bytes(octets)
            plain = self.content(octets, _RTPS_HEADER, length)
        else:
            octets = memoryview(octets)
            plain = self.large_content(octets, _RTPS_HEADER, length)
        if plain is None:
            return None
        message = as_message(plain, octets)
        if isinstance(message, Outcome):
            self._put_back(octets, _RTPS_HEADER, length)
            return None
        return message


class SignedMessageOpener:
    """The same of messages that are signed."""

    __slots__ = ("_encrypt",)

    def __init__(self, aead: AESGCM) -> None:
        self._encrypt = aead.encrypt

    def open(self, octets: Octets) -> Octets | None:
        """As :meth:`MessageOpener.open`.  Large octets that can be written to are not copied."""
        length = len(octets)
        if length < _LEAST_SIGNED:
            return None
        take_apart = _signed_layout(length)
        source, nonce, head, info_source, postfix_head, mac, count = take_apart(octets)
        if info_source != source or head not in INFO_SRC_HEADS or postfix_head != _POSTFIX_HEAD or count != _NO_MACS:
            return None
        signed = octets[_SIGNED_AT:-_FOOT]
        if not compare_digest(self._encrypt(nonce, b"", signed), mac):
            return None
        return with_header(signed)


# As :func:`_layout`.
@lru_cache(maxsize=256)
def _signed_layout(length: int) -> Callable[[Octets], tuple[bytes, ...]]:
    """Of a signed message with so many octets: its source, the nonce, of INFO_SRC the head and the source, its foot."""
    return struct.Struct(f"8x12s12x12s4s8x12s{length - _LEAST_SIGNED}x4s{MAC_LENGTH}s4s").unpack


class PayloadOpener:
    """For payloads that begin with the same 12 octets: encrypted, in one session."""

    __slots__ = ("_decrypt", "_decrypt_into", "_room")

    def __init__(self, aead: AESGCM, rooms: Rooms) -> None:
        self._decrypt = aead.decrypt
        self._decrypt_into = decrypter_into(aead)
        self._room = rooms.room

    def open(self, octets: Octets, place: memoryview | None = None) -> Octets | None:
        """The payload in ``octets``, behind which is no padding; else None, also where they were altered.

        If it is large, it is put to ``place`` where that is as long as it is.
        """
        length = len(octets)
        content = length - _PAYLOAD_CONTENT_AT - _PAYLOAD_FOOT
        if content < 0:
            return None
        nonce, stated = _PAYLOAD_HEAD.unpack_from(octets)
        if stated != content or octets[-4:] != _NO_MACS:
            return None
        sealed = octets[_PAYLOAD_CONTENT_AT:-4]
        try:
            if length < LARGE:
                return self._decrypt(nonce, sealed, None)
            room = place if place is not None and len(place) == content else self._room(content)
            self._decrypt_into(nonce, sealed, None, room)
            return room
        except InvalidTag:
            return None


def message_opener(
    octets: Octets, ring: KeyRing, expected: Protection | None
) -> MessageOpener | SignedMessageOpener | None:
    """Opens what begins as ``octets``, which were opened with this ring; None where the usual form is not expected.

    It holds until the ring changes.
    """
    at = _RTPS_HEADER + HEAD.size
    session = _session(octets[at : at + 12], ring, expected)
    if session is None or expected is None or octets[_RTPS_HEADER:at] != MESSAGE.prefix_head:
        return None
    if expected.encrypted:
        return MessageOpener(MESSAGE, session.aead, ring.rooms)
    return SignedMessageOpener(session.aead)


def submessage_opener(
    octets: Octets, ring: KeyRing, expected: Protection | None, entity_id: bytes
) -> SubmessageOpener | SignedSubmessageOpener | None:
    """As :func:`message_opener`, of a submessage of the entity with this id."""
    session = _session(octets[4:16], ring, expected)
    if session is None or expected is None or octets[:4] != SUBMESSAGE.prefix_head:
        return None
    if not expected.encrypted:
        return SignedSubmessageOpener(entity_id, session.aead)
    return SubmessageOpener(entity_id, session.aead, ring.rooms)


def payload_opener(octets: Octets, ring: KeyRing, expected: Protection | None) -> PayloadOpener | None:
    """As :func:`message_opener`, of a payload that is encrypted."""
    session = _session(octets[:12], ring, expected)
    if session is None or expected is None or not expected.encrypted:
        return None
    return PayloadOpener(session.aead, ring.rooms)


def _session(octets: Octets, ring: KeyRing, expected: Protection | None) -> ReceivedSession | None:
    """By transformation kind, key id and session id: of the ring's only key, if that does to octets what it should."""
    kind_octets, key_id, session_id = (bytes(octets[at : at + 4]) for at in (0, 4, 8))
    keys = ring.by_id.get(key_id)
    if expected is None or expected.origin_authenticated or ring.previous is not None:
        return None
    if keys is None or keys[0].kind_octets != kind_octets or keys[0].encrypts is not expected.encrypted:
        return None
    return keys[0].sessions.get(session_id)
