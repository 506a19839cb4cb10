"""Sealing: a submessage, or a message, goes into its envelope.

DDS-Security 1.1 §9.5.3.3 (encode_datawriter_submessage, encode_datareader_submessage, encode_rtps_message).
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Final

from ddsi.messages.raw_submessage import SubmessageKind
from ddsi.spi import Octets, Parts, Refused

from .aes_gcm import LARGE
from .envelope import FOOTER_LENGTH, HEAD, LONGEST_BODY, MESSAGE, RECEIVER_MAC_LENGTH, SUBMESSAGE, Envelope, body_head
from .payload import USED_UP
from .session_keys import NONCE_AT, ReceiverKey, SendingKey
from .transformation import HEADER_LENGTH, MAC_LENGTH

__all__ = ["INFO_SRC_HEAD", "seal_message", "seal_submessage"]

_MOST_RECEIVERS: Final = (LONGEST_BODY - FOOTER_LENGTH) // RECEIVER_MAC_LENGTH
_PADDING: Final = (b"", bytes(3), bytes(2), bytes(1))
_NO_MACS: Final = bytes(4)

INFO_SRC_HEAD: Final = HEAD.pack(SubmessageKind.INFO_SRC, 1, 20) + bytes(4)
"""With the field ``unused``.  Version, vendor and prefix, which follow, lie together in the message's header too."""


def seal_submessage(submessage: Parts, key: SendingKey, receivers: Sequence[ReceiverKey]) -> Parts | Refused:
    """A submessage, protected.  Its length must be filled in: it is no longer the last of a message."""
    return _seal(SUBMESSAGE, b"", submessage, key, receivers)


def seal_message(message: Parts, key: SendingKey, receivers: Sequence[ReceiverKey]) -> Parts | Refused:
    """A message: its header, and protected an INFO_SRC that repeats the header, and all its submessages."""
    first, *rest = message
    if len(first) < HEADER_LENGTH:
        first, rest = b"".join(message), []
    if len(first) >= LARGE:
        first = memoryview(first)
    return _seal(MESSAGE, bytes(first[:HEADER_LENGTH]), (INFO_SRC_HEAD, first[4:], *rest), key, receivers)


def _seal(
    envelope: Envelope, head: bytes, parts: Parts, key: SendingKey, receivers: Sequence[ReceiverKey]
) -> Parts | Refused:
    """``parts``, protected as one, behind ``head``, which is in clear."""
    body = parts[0] if len(parts) == 1 else b"".join(parts)
    length = len(body)
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
    padding = b""
    content: Octets
    if key.encrypts:
        sealed = key.aead.encrypt(nonce, body, None)
        header += body_head(length)
        content, mac, padding = memoryview(sealed)[:-MAC_LENGTH], sealed[-MAC_LENGTH:], _PADDING[length & 3]
    else:
        content, mac = body, key.aead.encrypt(nonce, b"", body)
    if not receivers:
        foot = padding + envelope.postfix_head + mac + _NO_MACS
    else:
        postfix_head, count = _postfix_head(envelope, len(receivers))
        macs = [part for receiver in receivers for part in (receiver.key_id, receiver.mac(key, nonce, mac))]
        foot = b"".join((padding, postfix_head, mac, count, *macs))
    return head + envelope.prefix_head + header, content, foot


@lru_cache(maxsize=256)
def _postfix_head(envelope: Envelope, receivers: int) -> tuple[bytes, bytes]:
    """The head, and the number of receivers as it stands in the footer."""
    length = FOOTER_LENGTH + RECEIVER_MAC_LENGTH * receivers
    return HEAD.pack(envelope.postfix, 1, length), receivers.to_bytes(4, "big")
