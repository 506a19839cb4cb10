"""The short ways of sealing, for receivers that share no key with the sender alone: they all get the same octets.

DDS-Security 1.1 §9.5.3.3 (encode_rtps_message, encode_datawriter_submessage, encode_datareader_submessage,
encode_serialized_payload).
What depends on the key alone is settled once.  :mod:`.sealing` and :mod:`.payload` are the general ways; tests hold
each pair against each other.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from functools import lru_cache
from typing import Final

from ddsi.spi import Octets, Parts, Refused

from .aes_gcm import LARGE
from .envelope import LONGEST_BODY, MESSAGE, SUBMESSAGE, body_head
from .payload import USED_UP, encode_payload
from .rooms import Rooms
from .sealing import INFO_SRC_HEAD, seal_message, seal_submessage
from .session_keys import NONCE_AT, SendingKey
from .transformation import HEADER_LENGTH, MAC_LENGTH

__all__ = ["PayloadSealer", "Sealer", "message_sealer", "payload_sealer", "submessage_sealer"]

Sealer = Callable[[Parts], Parts | Refused]
PayloadSealer = Callable[[Octets], Octets | Refused]

_LONGEST: Final = LONGEST_BODY - 4
_LONGEST_HEAD: Final = 64
"""A message's header, and an INFO_DST."""
_NO_MACS: Final = bytes(4)
_length: Final = struct.Struct(">I").pack
_CONTENT_AT: Final = HEADER_LENGTH + 4
_AROUND: Final = _CONTENT_AT + MAC_LENGTH + len(_NO_MACS)


def submessage_sealer(key: SendingKey, rooms: Rooms) -> Sealer:
    """Does what :func:`~.sealing.seal_submessage` does with this key; what is large lies in one of ``rooms``."""
    if not key.encrypts:
        return lambda submessage: seal_submessage(submessage, key, ())
    prefix_head, postfix_head = SUBMESSAGE.prefix_head, SUBMESSAGE.postfix_head

    def seal(submessage: Parts) -> Parts | Refused:
        body: Octets
        if len(submessage) == 1:
            body = submessage[0]
        elif len(submessage) == 3 and len(submessage[1]) >= LARGE:
            body = rooms.around(*submessage)
        else:
            body = b"".join(submessage)
        length = len(body)
        if length > _LONGEST or length & 3:
            return seal_submessage((body,), key, ())
        header = key.next_header(length)
        if header is None:
            return USED_UP
        content: Octets
        if length < LARGE:
            sealed = key.aead.encrypt(header[NONCE_AT:], body, None)
            content, mac = memoryview(sealed)[:-MAC_LENGTH], sealed[-MAC_LENGTH:]
        else:
            room = rooms.room(length + MAC_LENGTH)
            key.encrypt_into(header[NONCE_AT:], body, None, room)
            mac = bytes(room[-MAC_LENGTH:])
            content = rooms.shortened(room, MAC_LENGTH)
        return prefix_head + header + body_head(length), content, postfix_head + mac + _NO_MACS

    return seal


def message_sealer(key: SendingKey, rooms: Rooms) -> Sealer:
    """Does what :func:`~.sealing.seal_message` does with this key; what is large may lie in one of ``rooms``."""
    if key.encrypts:
        return lambda message: seal_message(message, key, ())
    postfix_head = MESSAGE.postfix_head

    def seal(message: Parts) -> Parts | Refused:
        first = message[0]
        if not HEADER_LENGTH <= len(first) <= _LONGEST_HEAD:
            return seal_message(message, key, ())
        outside, inside = _heads(bytes(first))
        body: Octets
        if len(message) > 2 and len(message[-2]) >= LARGE:
            # A sealed submessage, behind little else.
            body = rooms.around(b"".join((inside, *message[1:-2])), message[-2], message[-1])
        else:
            body = b"".join((inside, *message[1:]))
        length = len(body)
        if length & 3:
            return seal_message(message, key, ())
        header = key.next_header(length)
        if header is None:
            return USED_UP
        mac = key.aead.encrypt(header[NONCE_AT:], b"", body)
        return outside + header, body, postfix_head + mac + _NO_MACS

    return seal


@lru_cache(maxsize=256)
def _heads(first: bytes) -> tuple[bytes, bytes]:
    """How a message, protected, begins that begins like this, up to its CryptoHeader; and how what is in it does."""
    return first[:HEADER_LENGTH] + MESSAGE.prefix_head, INFO_SRC_HEAD + first[4:]


def payload_sealer(key: SendingKey, rooms: Rooms) -> PayloadSealer:
    """Does what :func:`~.payload.encode_payload` does with this key, in one part."""

    def general(plain: Octets) -> Octets | Refused:
        encoded = encode_payload(plain, key, rooms)
        if isinstance(encoded, Refused):
            return encoded
        return encoded[0] if len(encoded) == 1 else b"".join(encoded)

    if not key.encrypts:
        return general

    def seal(plain: Octets) -> Octets | Refused:
        length = len(plain)
        if length & 3:
            return general(plain)
        header = key.next_header(length)
        if header is None:
            return USED_UP
        head = header + _length(length)
        if length < LARGE:
            return head + key.aead.encrypt(header[NONCE_AT:], plain, None) + _NO_MACS
        room = rooms.room(_AROUND + length)
        room[:_CONTENT_AT] = head
        key.encrypt_into(header[NONCE_AT:], plain, None, room[_CONTENT_AT:-4])
        room[-4:] = _NO_MACS
        return room

    return seal
