"""SerializedPayload, protected: CryptoHeader, CryptoContent or the plain payload, CryptoFooter.

DDS-Security 1.1 §9.5.3.3 (encode_serialized_payload, decode_serialized_payload), §7.3.6.2.

    GCM:   header (20) || length (u32, big-endian) || cipher text || common_mac (16) || 00 00 00 00
    GMAC:  header (20) || payload                               || common_mac (16) || 00 00 00 00

The zeros are the number of receiver-specific MACs, of which a payload has none.  A fragment run is a payload to this
module.  Payloads are padded to a multiple of 4 before they are protected: Cyclone DDS asks for it, and the padding of
the DATA submessage could not be told from a signed payload else.
"""

from __future__ import annotations

from hmac import compare_digest
from typing import Final

from cryptography.exceptions import InvalidTag

from ddsi.spi import Octets, Outcome, Parts, Refused, Rejected
from ddsi.structure.errors import MalformedMessage

from .aes_gcm import LARGE, decrypt_sealed
from .received_keys import KeyRing, ReceivedKey
from .rooms import Rooms
from .session_keys import NONCE_AT, SendingKey
from .transformation import HEADER_LENGTH, MAC_LENGTH, Protection

__all__ = ["USED_UP", "decode_payload", "encode_payload", "overhead"]

_LONGEST_PADDING: Final = 3
_NO_MACS: Final = bytes(4)
_FOOTER_LENGTH: Final = MAC_LENGTH + len(_NO_MACS)
_CONTENT_AT: Final = HEADER_LENGTH + 4

USED_UP: Final = Refused("the key is used up: all its session ids are spent")


def overhead(protection: Protection | None) -> int:
    """What :func:`encode_payload` adds at most, in octets."""
    if protection is None:
        return 0
    return (_CONTENT_AT if protection.encrypted else HEADER_LENGTH) + _LONGEST_PADDING + _FOOTER_LENGTH


def encode_payload(plain: Octets, key: SendingKey, rooms: Rooms) -> Parts | Refused:
    """The protected form of ``plain``; if it is large, it lies in one of ``rooms``."""
    if len(plain) & 3:
        plain = bytes(plain) + bytes(-len(plain) & 3)
    length = len(plain)
    header = key.next_header(length)
    if header is None:
        return USED_UP
    nonce = header[NONCE_AT:]
    if key.encrypts:
        head = header + length.to_bytes(4, "big")
        if length < LARGE:
            return head, key.aead.encrypt(nonce, plain, None), _NO_MACS
        room = rooms.room(_CONTENT_AT + length + _FOOTER_LENGTH)
        room[:_CONTENT_AT] = head
        key.encrypt_into(nonce, plain, None, room[_CONTENT_AT:-4])
        room[-4:] = _NO_MACS
        return (room,)
    return header, plain, key.aead.encrypt(nonce, b"", plain) + _NO_MACS


def decode_payload(octets: Octets, ring: KeyRing, expected: Protection | None) -> Octets | Outcome:
    """The payload in ``octets``; untrusted.  What was signed is returned as a part of them, not copied if it is large.

    ``expected``: what the reader's attributes ask for; None takes what the key says.
    """
    octets = bytes(octets) if len(octets) < LARGE else memoryview(octets)
    if len(octets) < HEADER_LENGTH + _FOOTER_LENGTH:
        return Rejected(f"a protected payload of {len(octets)} octets")
    header = bytes(octets[:HEADER_LENGTH])
    keys = ring.fitting(header[:4], header[4:8], expected)
    if isinstance(keys, Outcome):
        return keys
    for key in keys:
        try:
            return _open(octets, header, key, ring.rooms)
        except InvalidTag:
            continue
        except MalformedMessage as error:
            return Rejected(str(error))
    return Rejected("the MAC of the payload is wrong")


def _open(octets: bytes | memoryview, header: bytes, key: ReceivedKey, rooms: Rooms) -> bytes | memoryview:
    """Raises InvalidTag, MalformedMessage."""
    mac_at = len(octets) - _FOOTER_LENGTH
    if key.encrypts:
        mac_at = _CONTENT_AT + int.from_bytes(octets[HEADER_LENGTH:_CONTENT_AT], "big")
        # The submessage around it may have been padded to a multiple of 4.
        if not 0 <= len(octets) - _FOOTER_LENGTH - mac_at <= _LONGEST_PADDING:
            raise MalformedMessage("the length of the cipher text is wrong", element="CryptoContent", offset=mac_at)
    end = mac_at + MAC_LENGTH
    if octets[end : end + 4] != _NO_MACS:
        raise MalformedMessage("a payload with receiver-specific MACs", element="CryptoFooter", offset=end)
    session_id, nonce = header[8:12], header[NONCE_AT:]
    session = key.sessions.get(session_id) or key.derive(session_id)
    plain = octets[HEADER_LENGTH:mac_at]
    if key.encrypts:
        plain = decrypt_sealed(session.aead, nonce, octets[_CONTENT_AT:end], rooms)
    elif not compare_digest(session.aead.encrypt(nonce, b"", plain), octets[mac_at:end]):
        raise InvalidTag
    if session_id not in key.sessions:
        key.keep(session_id, session)
    return plain
