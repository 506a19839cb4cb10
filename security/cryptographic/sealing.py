"""Sealing: a submessage, or a message, goes into its envelope.

DDS-Security 1.1 §9.5.3.3 (encode_datawriter_submessage, encode_datareader_submessage, encode_rtps_message).
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Final

from ddsi.messages.raw_submessage import SubmessageKind
from ddsi.spi import Octets, Refused

from .aes_gcm import LARGE, append_encrypted
from .envelope import FOOTER_LENGTH, HEAD, LONGEST_BODY, MESSAGE, RECEIVER_MAC_LENGTH, SUBMESSAGE, Envelope, body_head
from .payload import USED_UP
from .session_keys import NONCE_AT, ReceiverKey, SendingKey
from .transformation import HEADER_LENGTH, MAC_LENGTH

__all__ = ["seal_message", "seal_submessage"]

_MOST_RECEIVERS: Final = (LONGEST_BODY - FOOTER_LENGTH) // RECEIVER_MAC_LENGTH
_PADDING: Final = (b"", bytes(3), bytes(2), bytes(1))
_NO_MACS: Final = bytes(4)

_INFO_SRC_HEAD: Final = HEAD.pack(SubmessageKind.INFO_SRC, 1, 20) + bytes(4)
"""With the field ``unused``.  Version, vendor and prefix, which follow, lie together in the message's header too."""


def seal_submessage(
    buffer: bytearray, submessage: Octets, key: SendingKey, receivers: Sequence[ReceiverKey]
) -> Refused | None:
    """Append a submessage, protected.  Its length must be filled in: it is no longer the last of a message."""
    return _seal(SUBMESSAGE, buffer, b"", submessage, key, receivers)


def seal_message(
    buffer: bytearray, message: Octets, key: SendingKey, receivers: Sequence[ReceiverKey]
) -> Refused | None:
    """Append a message: its header, and protected an INFO_SRC that repeats the header, and all its submessages."""
    start = len(buffer)
    buffer += message[:HEADER_LENGTH]
    rest = message[4:] if len(message) < LARGE else memoryview(message)[4:]
    refused = _seal(MESSAGE, buffer, _INFO_SRC_HEAD, rest, key, receivers)
    if refused is not None:
        del buffer[start:]
    return refused


def _seal(
    envelope: Envelope,
    buffer: bytearray,
    head: bytes,
    body: Octets,
    key: SendingKey,
    receivers: Sequence[ReceiverKey],
) -> Refused | None:
    """Append ``head`` and ``body``, protected as one."""
    length = len(head) + len(body)
    if key.encrypts:
        if length > LONGEST_BODY - 4:
            return Refused(f"{length} octets do not fit into one SEC_BODY")
    elif length & 3:
        return Refused(f"{length} octets are to be signed, which is no multiple of 4")
    if receivers and len(receivers) > _MOST_RECEIVERS:
        return Refused(f"MACs for {len(receivers)} receivers do not fit into one footer")
    header = key.next_header(length)
    if header is None:
        return USED_UP
    nonce = header[NONCE_AT:]
    if not key.encrypts:
        buffer += envelope.prefix_head + header + head
        buffer += body
        with memoryview(buffer) as view, view[-length:] as signed:
            mac = key.aead.encrypt(nonce, b"", signed)
    elif length < LARGE:
        sealed = key.aead.encrypt(nonce, head + body if head else body, None)
        mac = sealed[-MAC_LENGTH:]
        buffer += b"".join((envelope.prefix_head, header, body_head(length), sealed[:-MAC_LENGTH]))
    else:
        buffer += envelope.prefix_head + header + body_head(length)
        spare = FOOTER_LENGTH + RECEIVER_MAC_LENGTH * len(receivers) + 8
        plain = b"".join((head, body)) if head else body
        mac = append_encrypted(buffer, plain, key.aead, nonce, spare=spare)
    if not receivers:
        buffer += _PADDING[length & 3] + envelope.postfix_head + mac + _NO_MACS
        return None
    postfix_head, count = _postfix_head(envelope, len(receivers))
    parts = [_PADDING[length & 3], postfix_head, mac, count]
    for receiver in receivers:
        parts += receiver.key_id, receiver.mac(key, nonce, mac)
    buffer += b"".join(parts)
    return None


@lru_cache(maxsize=256)
def _postfix_head(envelope: Envelope, receivers: int) -> tuple[bytes, bytes]:
    """The head, and the number of receivers as it stands in the footer."""
    length = FOOTER_LENGTH + RECEIVER_MAC_LENGTH * receivers
    return HEAD.pack(envelope.postfix, 1, length), receivers.to_bytes(4, "big")
