"""Envelopes: a submessage between SEC_PREFIX and SEC_POSTFIX, a message between SRTPS_PREFIX and SRTPS_POSTFIX.

DDS-Security 1.1 §7.3.6.3 to §7.3.6.8 (submessages), §9.5.2.3 to §9.5.2.5 (CryptoHeader, CryptoContent, CryptoFooter),
§9.5.3.3 (transformations).

    0        8        16                32
    +--------+--------+-----------------+
    | PREFIX | flags  | 20              |
    +--------+--------+-----------------+
    | CryptoHeader, 20 octets           |
    +--------+--------+-----------------+  GMAC: in the place of SEC_BODY, what is protected as it was
    | SEC_BODY, flags | length          |
    +--------+--------+-----------------+
    | u32 n, big-endian                 |
    | cipher text, n octets             |
    | padding to a multiple of 4        |
    +--------+--------+-----------------+
    | POSTFIX| flags  | 20 + 20 * count |
    +--------+--------+-----------------+
    | common_mac, 16 octets             |
    | u32 count, big-endian             |
    | count times: key id (4), mac (16) |
    +-----------------------------------+

Flag E is the byte order of these submessage headers alone.  We write little-endian, and every length; others write
big-endian, or 0 as the length of a postfix that ends the message, and all of that is read.
"""

from __future__ import annotations

import hmac
import struct
from collections.abc import Sequence
from typing import Final, NamedTuple

from cryptography.exceptions import InvalidTag

from ddsi.messages.raw_submessage import SubmessageKind, iterate_submessages
from ddsi.spi import Octets, Outcome, Refused, Rejected
from ddsi.structure.errors import MalformedMessage

from .aes_gcm import LARGE, decrypt_joined, encrypt_tail
from .payload import USED_UP
from .received_keys import KeyRing, ReceivedKey, ReceivedSession, fitting_keys
from .session_keys import NONCE_AT, ReceiverKey, SendingKey
from .transformation import HEADER_LENGTH, KEY_ID_LENGTH, MAC_LENGTH, Protection

__all__ = [
    "RECEIVER_MAC_LENGTH",
    "message_overhead",
    "open_message",
    "open_submessage",
    "read_crypto_header",
    "receiver_key_ids",
    "seal_message",
    "seal_submessage",
    "submessage_overhead",
]

RECEIVER_MAC_LENGTH: Final = KEY_ID_LENGTH + MAC_LENGTH

_HEAD_LENGTH: Final = 4
_PREFIX_LENGTH: Final = _HEAD_LENGTH + HEADER_LENGTH
_CONTENT_AT: Final = _HEAD_LENGTH + 4
"""Where in SEC_BODY the cipher text begins."""
_FOOTER_LENGTH: Final = MAC_LENGTH + 4
_LONGEST_PADDING: Final = 3
_LONGEST_BODY: Final = 0xFFFC
"""octetsToNextHeader has 16 bits, and is a multiple of 4."""
_MOST_RECEIVERS: Final = (_LONGEST_BODY - _FOOTER_LENGTH) // RECEIVER_MAC_LENGTH

_HEAD: Final = struct.Struct("<BBH")
_PADDING: Final = (b"", bytes(3), bytes(2), bytes(1))
_NO_MACS: Final = bytes(4)
_INFO_SRC_HEAD: Final = _HEAD.pack(SubmessageKind.INFO_SRC, 1, 20) + bytes(4)
"""With its field ``unused``; version, vendor id and prefix, which follow, lie together in the message's header too."""
_RTPS: Final = b"RTPS"


class _Kind:
    """Which submessages hold the protected octets between them."""

    __slots__ = ("postfix", "postfix_head", "prefix", "prefix_head")

    def __init__(self, prefix: SubmessageKind, postfix: SubmessageKind) -> None:
        self.prefix = prefix
        self.postfix = postfix
        self.prefix_head = _HEAD.pack(prefix, 1, HEADER_LENGTH)
        self.postfix_head = _HEAD.pack(postfix, 1, _FOOTER_LENGTH)


_SUBMESSAGE: Final = _Kind(SubmessageKind.SEC_PREFIX, SubmessageKind.SEC_POSTFIX)
_MESSAGE: Final = _Kind(SubmessageKind.SRTPS_PREFIX, SubmessageKind.SRTPS_POSTFIX)
_ENVELOPE_KINDS: Final = frozenset(range(SubmessageKind.SEC_BODY, SubmessageKind.SRTPS_POSTFIX + 1))


# --- sealing -------------------------------------------------------------------------------------------------


def submessage_overhead(protection: Protection | None, receivers: int) -> int:
    """What :func:`seal_submessage` adds at most, in octets."""
    if protection is None:
        return 0
    body = _CONTENT_AT + _LONGEST_PADDING if protection.encrypted else 0
    macs = RECEIVER_MAC_LENGTH * receivers if protection.origin_authenticated else 0
    return _PREFIX_LENGTH + body + _HEAD_LENGTH + _FOOTER_LENGTH + macs


def message_overhead(protection: Protection | None, receivers: int) -> int:
    """What :func:`seal_message` adds at most, in octets: its INFO_SRC comes in addition."""
    return submessage_overhead(protection, receivers) + (_HEAD_LENGTH + 20 if protection is not None else 0)


def seal_submessage(
    buffer: bytearray, submessage: Octets, key: SendingKey, receivers: Sequence[ReceiverKey]
) -> Refused | None:
    """Append a submessage, protected.  Its own length must be filled in, as it is no longer the last of a message."""
    return _seal(_SUBMESSAGE, buffer, b"", submessage, key, receivers)


def seal_message(
    buffer: bytearray, message: Octets, key: SendingKey, receivers: Sequence[ReceiverKey]
) -> Refused | None:
    """Append a message: its header, and protected an INFO_SRC that repeats the header, and all its submessages."""
    with memoryview(message) as view, view[:HEADER_LENGTH] as header, view[4:] as rest:
        start = len(buffer)
        buffer += header
        refused = _seal(_MESSAGE, buffer, _INFO_SRC_HEAD, rest, key, receivers)
    if refused is not None:
        del buffer[start:]
    return refused


def _seal(
    kind: _Kind, buffer: bytearray, lead: bytes, rest: Octets, key: SendingKey, receivers: Sequence[ReceiverKey]
) -> Refused | None:
    """Append ``lead`` and ``rest``, protected as one."""
    length = len(lead) + len(rest)
    if key.encrypts and length > _LONGEST_BODY - 4:
        return Refused(f"{length} octets do not fit into one SEC_BODY")
    if length & 3 and not key.encrypts:
        return Refused(f"{length} octets are to be signed, which is no multiple of 4")
    if len(receivers) > _MOST_RECEIVERS:
        return Refused(f"MACs for {len(receivers)} receivers do not fit into one footer")
    header = key.next_header(length)
    if header is None:
        return USED_UP
    nonce = header[NONCE_AT:]
    if length >= LARGE:
        mac = _append_large(kind, buffer, header, lead, rest, key)
    elif key.encrypts:
        sealed = key.aead.encrypt(nonce, lead + rest if lead else rest, None)
        mac = sealed[-MAC_LENGTH:]
        buffer += b"".join((kind.prefix_head, header, _body_head(length), sealed[:-MAC_LENGTH], _PADDING[length & 3]))
    else:
        plain = lead + rest if lead else rest
        mac = key.aead.encrypt(nonce, b"", plain)
        buffer += b"".join((kind.prefix_head, header, plain))
    if receivers:
        buffer += _HEAD.pack(kind.postfix, 1, _FOOTER_LENGTH + RECEIVER_MAC_LENGTH * len(receivers))
        buffer += mac + len(receivers).to_bytes(4, "big")
        for receiver in receivers:
            buffer += receiver.key_id + receiver.mac(key, nonce, mac)
    else:
        buffer += kind.postfix_head + mac + _NO_MACS
    return None


def _append_large(kind: _Kind, buffer: bytearray, header: bytes, lead: bytes, rest: Octets, key: SendingKey) -> bytes:
    """As :func:`_seal` does it up to the postfix, but copying the octets only once; returns the common MAC."""
    length = len(lead) + len(rest)
    buffer += kind.prefix_head + header
    if key.encrypts:
        buffer += _body_head(length)
    start = len(buffer)
    buffer += lead
    buffer += rest
    if key.encrypts:
        mac = encrypt_tail(buffer, start, key.aead, header[NONCE_AT:])
        buffer += _PADDING[length & 3]
        return mac
    with memoryview(buffer) as whole, whole[start:] as plain:
        return key.aead.encrypt(header[NONCE_AT:], b"", plain)


def _body_head(length: int) -> bytes:
    """SEC_BODY up to the cipher text, which has so many octets."""
    return _HEAD.pack(SubmessageKind.SEC_BODY, 1, 4 + length + (-length & 3)) + length.to_bytes(4, "big")


# --- opening -------------------------------------------------------------------------------------------------


def read_crypto_header(octets: Octets) -> bytes:
    """The CryptoHeader, 20 octets, of what begins with SEC_PREFIX; untrusted.  Raises MalformedMessage."""
    return _read_prefix(_SUBMESSAGE, octets, 0)


def receiver_key_ids(octets: Octets, *, encrypted: bool) -> frozenset[bytes]:
    """Whom a protected submessage has MACs for; untrusted.  Raises MalformedMessage."""
    found = _locate(_SUBMESSAGE, octets, _PREFIX_LENGTH, encrypted=encrypted)
    return frozenset(
        bytes(octets[at : at + KEY_ID_LENGTH]) for at in range(found.macs_at, found.end, RECEIVER_MAC_LENGTH)
    )


def open_submessage(octets: Octets, ring: KeyRing, expected: Protection | None) -> Octets | Outcome:
    """The one submessage in ``octets``, which begin with SEC_PREFIX and end with SEC_POSTFIX; untrusted.

    ``expected``: what the receiver's attributes ask for; None takes what the key says.
    """
    try:
        plain = _open(_SUBMESSAGE, octets, 0, ring, expected)
        if not isinstance(plain, Outcome):
            _check_submessage(plain)
    except MalformedMessage as error:
        return Rejected(str(error))
    return plain


def open_message(octets: Octets, ring: KeyRing, expected: Protection | None) -> Octets | Outcome:
    """The message in ``octets``, whose first submessage is SRTPS_PREFIX; untrusted.

    What is returned is a message with its header, which is made of the INFO_SRC that was protected: so all of it was
    authenticated.  The INFO_SRC has no further part in it.  What follows SRTPS_POSTFIX is in clear, and left out.
    """
    try:
        plain = _open(_MESSAGE, octets, HEADER_LENGTH, ring, expected)
        if isinstance(plain, Outcome):
            return plain
        _check_info_source(plain, bytes(octets[8:HEADER_LENGTH]))
    except MalformedMessage as error:
        return Rejected(str(error))
    # INFO_SRC is laid out as a message's header, with `unused` where that has "RTPS".
    if isinstance(plain, bytearray):
        plain[4:8] = _RTPS
        return memoryview(plain)[4:]
    return b"".join((_RTPS, plain[8:]))


def _open(
    kind: _Kind, octets: Octets, at: int, ring: KeyRing, expected: Protection | None
) -> bytes | bytearray | memoryview | Outcome:
    """What lies in the envelope that begins at ``octets[at]``.  Raises MalformedMessage."""
    octets = bytes(octets) if len(octets) < LARGE else memoryview(octets)
    header = _read_prefix(kind, octets, at)
    keys = fitting_keys(ring, header, expected)
    if isinstance(keys, Outcome):
        return keys
    found = _locate(kind, octets, at + _PREFIX_LENGTH, encrypted=keys[0].encrypts)
    session_id, nonce = header[8:12], header[NONCE_AT:]
    content = octets[found.content_at : found.content_end]
    mac = octets[found.mac_at : found.mac_at + MAC_LENGTH]
    plain: bytes | bytearray | memoryview
    for key in keys:
        session = key.session(session_id)
        try:
            if key.encrypts:
                plain = decrypt_joined(session.aead, nonce, content, mac)
            else:
                session.aead.decrypt(nonce, mac, content)
                plain = content
        except InvalidTag:
            continue
        if expected is not None and expected.origin_authenticated:
            _check_receiver_mac(octets, found, key, session, nonce)
        key.keep(session_id, session)
        return plain
    return Rejected("the common MAC is wrong")


class _Located(NamedTuple):
    """Where the parts of an envelope lie: ``content`` is what is protected, ``macs`` the receiver-specific ones."""

    content_at: int
    content_end: int
    mac_at: int
    macs_at: int
    end: int


def _read_prefix(kind: _Kind, octets: Octets, at: int) -> bytes:
    header = bytes(octets[at + _HEAD_LENGTH : at + _PREFIX_LENGTH])
    if len(header) < HEADER_LENGTH or _read_head(octets, at) != (kind.prefix, HEADER_LENGTH):
        raise MalformedMessage(f"no {kind.prefix.name}", element="envelope", offset=at)
    return header


def _locate(kind: _Kind, octets: Octets, at: int, *, encrypted: bool) -> _Located:
    """What follows the prefix, from ``octets[at]`` on; only the key knows whether it is encrypted or in clear."""
    if encrypted:
        found, length = _read_head(octets, at)
        content_at = at + _CONTENT_AT
        postfix_at = at + _HEAD_LENGTH + length
        content_end = content_at + int.from_bytes(octets[content_at - 4 : content_at], "big")
        if found != SubmessageKind.SEC_BODY or not 0 <= postfix_at - content_end <= _LONGEST_PADDING:
            raise MalformedMessage("no SEC_BODY with as much as it says", element="envelope", offset=at)
    else:
        content_at = at
        content_end = postfix_at = _find_postfix(kind, octets, at)
    found, length = _read_head(octets, postfix_at)
    mac_at = postfix_at + _HEAD_LENGTH
    macs_at = mac_at + _FOOTER_LENGTH
    end = mac_at + length if length else len(octets)
    count = int.from_bytes(octets[macs_at - 4 : macs_at], "big")
    if found != kind.postfix or end > len(octets) or end - macs_at != count * RECEIVER_MAC_LENGTH:
        reason = f"no {kind.postfix.name} with as many MACs as it says"
        raise MalformedMessage(reason, element="envelope", offset=postfix_at)
    return _Located(content_at, content_end, mac_at, macs_at, end)


def _find_postfix(kind: _Kind, octets: Octets, start: int) -> int:
    """Where the postfix begins that ends the submessages in clear from ``octets[start]`` on."""
    for raw in iterate_submessages(octets, start=start):
        if raw.kind == kind.postfix:
            return raw.offset
        if raw.kind == kind.prefix:
            break
    raise MalformedMessage(f"no {kind.postfix.name}", element="envelope", offset=start)


def _read_head(octets: Octets, at: int) -> tuple[int, int]:
    """Kind and length of the submessage at ``octets[at]``."""
    if len(octets) - at < _HEAD_LENGTH:
        raise MalformedMessage("the octets end", element="envelope", offset=at)
    kind, flags, length = _HEAD.unpack_from(octets, at)
    return kind, length if flags & 1 else length >> 8 | (length & 0xFF) << 8


# --- what must be true of what was opened --------------------------------------------------------------------


def _check_receiver_mac(
    octets: Octets, found: _Located, key: ReceivedKey, session: ReceivedSession, nonce: bytes
) -> None:
    """The MAC that the sender made for us alone, without which any fellow receiver might have sent this."""
    if session.receiver_aead is None:
        raise MalformedMessage("the sender gave us no receiver-specific key", element="CryptoFooter")
    for at in range(found.macs_at, found.end, RECEIVER_MAC_LENGTH):
        mac_at = at + KEY_ID_LENGTH
        if octets[at:mac_at] == key.receiver_key_id:
            common_mac = octets[found.mac_at : found.mac_at + MAC_LENGTH]
            due = session.receiver_aead.encrypt(nonce, b"", common_mac)
            if hmac.compare_digest(due, octets[mac_at : mac_at + MAC_LENGTH]):
                return
            raise MalformedMessage("our receiver-specific MAC is wrong", element="CryptoFooter", offset=at)
    raise MalformedMessage("there is no receiver-specific MAC for us", element="CryptoFooter", offset=found.macs_at)


def _check_submessage(plain: Octets) -> None:
    """One submessage and nothing else, and none that is an envelope itself."""
    kind, length = _read_head(plain, 0)
    if length not in (len(plain) - _HEAD_LENGTH, 0):
        raise MalformedMessage(f"{len(plain)} octets are not one submessage", element="envelope")
    if kind in _ENVELOPE_KINDS:
        raise MalformedMessage("an envelope within an envelope", element="envelope")


def _check_info_source(plain: Octets, prefix: bytes) -> None:
    """INFO_SRC is the first, and authenticates what the header, in clear, said."""
    if _read_head(plain, 0) != (SubmessageKind.INFO_SRC, 20) or len(plain) < _HEAD_LENGTH + 20:
        raise MalformedMessage("no INFO_SRC at the head of a protected message", element="INFO_SRC")
    if plain[12:24] != prefix:
        raise MalformedMessage("INFO_SRC names another participant than the header", element="INFO_SRC")
