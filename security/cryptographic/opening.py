"""Opening: a submessage, or a message, comes out of its envelope, or it is said why it does not.

DDS-Security 1.1 §9.5.3.3 (decode_datawriter_submessage, decode_datareader_submessage, decode_rtps_message).  All
octets are untrusted until the common MAC was verified, and where the origin is authenticated, our own MAC too.
"""

from __future__ import annotations

import struct
from hmac import compare_digest
from typing import Final

from cryptography.exceptions import InvalidTag

from ddsi.messages.raw_submessage import SubmessageKind
from ddsi.spi import NOT_FOR_US, Octets, Outcome, Rejected
from ddsi.structure.errors import MalformedMessage

from .aes_gcm import LARGE, decrypt_joined
from .envelope import (
    ENVELOPE_KINDS,
    HEAD,
    MAY_BE_EMPTY,
    MESSAGE,
    RECEIVER_MAC_LENGTH,
    SUBMESSAGE,
    Envelope,
    read_envelope,
    swapped,
)
from .received_keys import KeyRing
from .transformation import HEADER_LENGTH, KEY_ID_LENGTH, MAC_LENGTH, Protection

__all__ = ["INFO_SRC_HEADS", "as_message", "open_message", "open_submessage", "with_header"]

_RTPS: Final = b"RTPS"
INFO_SRC_HEADS: Final = (bytes((SubmessageKind.INFO_SRC, 1, 20, 0)), bytes((SubmessageKind.INFO_SRC, 0, 0, 20)))
_ENDS_TOO_SOON: Final = "the octets end within the envelope"

_Plain = bytes | bytearray | memoryview


def open_submessage(octets: Octets, ring: KeyRing, expected: Protection | None) -> Octets | Outcome:
    """The one submessage in ``octets``, which begin with SEC_PREFIX and end with SEC_POSTFIX.

    ``expected``: what the receiver's attributes ask for; None takes what the key says.
    """
    try:
        plain = _open(SUBMESSAGE, octets, 0, ring, expected)
        if not isinstance(plain, Outcome):
            _check_submessage(plain)
        return plain
    except MalformedMessage as error:
        return Rejected(str(error))
    except struct.error:
        return Rejected(_ENDS_TOO_SOON)


def open_message(octets: Octets, ring: KeyRing, expected: Protection | None) -> Octets | Outcome:
    """The message in ``octets``, whose first submessage is SRTPS_PREFIX.

    What is returned is a message with its header, which is made of the INFO_SRC that was protected: so all of it was
    authenticated.  The INFO_SRC has no further part in it.  What follows SRTPS_POSTFIX is in clear, and left out: Fast
    DDS ends all its messages so.  Large octets that can be written to are: it spares copying them.
    """
    try:
        plain = _open(MESSAGE, octets, HEADER_LENGTH, ring, expected)
        if isinstance(plain, Outcome):
            return plain
    except MalformedMessage as error:
        return Rejected(str(error))
    except struct.error:
        return Rejected(_ENDS_TOO_SOON)
    return as_message(plain, octets)


def as_message(plain: Octets, octets: Octets) -> Octets | Outcome:
    """The message of which ``plain`` was protected; it came in ``octets``, and both name the same participant."""
    info_source = bytes(plain[:24])
    if info_source[:4] not in INFO_SRC_HEADS or len(info_source) < 24:
        return Rejected("there is no INFO_SRC at the head of what was protected")
    if info_source[12:] != octets[8:HEADER_LENGTH]:
        return Rejected("INFO_SRC names another participant than the header")
    return with_header(plain)


def with_header(plain: Octets) -> Octets:
    """The message of what begins with INFO_SRC, which is laid out as a header, with `unused` where that has "RTPS".

    What is large and can be written to is not copied.
    """
    whole = memoryview(plain)
    if whole.readonly:
        return _RTPS + whole[8:]
    whole[4:8] = _RTPS
    return whole[4:]


def _open(envelope: Envelope, octets: Octets, at: int, ring: KeyRing, expected: Protection | None) -> _Plain | Outcome:
    """What lies in the envelope that begins at ``octets[at]``.  Raises MalformedMessage, struct.error."""
    octets = bytes(octets) if len(octets) < LARGE else memoryview(octets)
    kind_octets, key_id, nonce, content_at, content_end, mac, macs_at, end = read_envelope(envelope, octets, at)
    keys = ring.fitting(kind_octets, key_id, expected)
    if isinstance(keys, Outcome):
        return keys
    content = octets[content_at:content_end]
    session_id = nonce[:4]
    for key in keys:
        session = key.sessions.get(session_id) or key.derive(session_id)
        plain: _Plain = content
        if not key.encrypts:
            if not compare_digest(session.aead.encrypt(nonce, b"", content), mac):
                continue
        else:
            try:
                plain = decrypt_joined(session.aead, nonce, octets, content_at, content_end, mac, ring.rooms)
            except InvalidTag:
                continue
        if expected is not None and expected.origin_authenticated:
            receiver_mac = _find_receiver_mac(octets, macs_at, end, key.receiver_key_id)
            if session.receiver_aead is None or macs_at == end:
                return Rejected("nothing proves to us where it comes from")
            if receiver_mac is None:
                return NOT_FOR_US  # it proves it to others, whom alone it is for
            if not compare_digest(session.receiver_aead.encrypt(nonce, b"", mac), receiver_mac):
                return Rejected("the MAC for us is wrong")
        if session_id not in key.sessions:
            key.keep(session_id, session)
        return plain
    return Rejected("the common MAC is wrong")


def _find_receiver_mac(octets: bytes | memoryview, start: int, end: int, key_id: bytes) -> bytes | memoryview | None:
    """The MAC that the sender made for us alone: without it, any fellow receiver might have sent this."""
    for at in range(start + KEY_ID_LENGTH, end, RECEIVER_MAC_LENGTH):
        if octets[at - KEY_ID_LENGTH : at] == key_id:
            return octets[at : at + MAC_LENGTH]
    return None


def _check_submessage(plain: _Plain) -> None:
    """One submessage and nothing else, and none that is an envelope itself."""
    kind, flags, length = HEAD.unpack_from(plain)
    if not flags & 1:
        length = swapped(length)
    # A length of 0 says "to the end", but of those that may be empty.
    if length != len(plain) - 4 and (length or kind in MAY_BE_EMPTY):
        raise MalformedMessage(f"{len(plain)} octets are not one submessage", element="envelope")
    if kind in ENVELOPE_KINDS:
        raise MalformedMessage("an envelope within an envelope", element="envelope")
