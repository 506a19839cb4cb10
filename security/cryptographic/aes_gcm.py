"""AES-GCM over large buffers: encrypted and decrypted where they lie, so that no second buffer of their size is needed.

Nothing of DDS is known here.  Small buffers are better off with plain ``AESGCM.encrypt`` and ``decrypt``: one call that
allocates costs less there than several that do not.
"""

from __future__ import annotations

from typing import Final

from cryptography.hazmat.primitives.ciphers.aead import AESGCM

from ddsi.serialization.cursor import Octets

__all__ = ["LARGE", "decrypt_joined", "encrypt_tail"]

LARGE: Final = 1 << 14
"""From so many octets on it pays to spare the copies: allocating 64 KiB and more costs as much as encrypting it."""

_TAG_LENGTH: Final = 16


def encrypt_tail(buffer: bytearray, start: int, aead: AESGCM, nonce: bytes) -> bytes:
    """Encrypt ``buffer[start:]`` where it lies, and return its tag, 16 octets.  The buffer's length stays."""
    end = len(buffer)
    if not _ENCRYPTS_IN_PLACE:
        sealed = aead.encrypt(nonce, bytes(memoryview(buffer)[start:]), None)
        buffer[start:] = sealed[:-_TAG_LENGTH]
        return sealed[-_TAG_LENGTH:]
    buffer += bytes(_TAG_LENGTH)
    with memoryview(buffer) as whole, whole[start:end] as plain, whole[start:] as room:
        aead.encrypt_into(nonce, plain, None, room)
    tag = bytes(buffer[end:])
    del buffer[end:]
    return tag


def decrypt_joined(aead: AESGCM, nonce: bytes, encrypted: Octets, tag: Octets) -> bytes | bytearray:
    """What ``encrypted`` holds, whose ``tag`` lies elsewhere.  Raises cryptography's InvalidTag."""
    if not _ENCRYPTS_IN_PLACE or len(encrypted) < LARGE:
        return aead.decrypt(nonce, b"".join((encrypted, tag)), None)
    buffer = bytearray(encrypted)
    buffer += tag
    with memoryview(buffer) as whole, whole[:-_TAG_LENGTH] as room:
        aead.decrypt_into(nonce, whole, None, room)
    del buffer[-_TAG_LENGTH:]
    return buffer


def _encrypts_in_place() -> bool:
    """May input and output of ``encrypt_into`` begin at the same octet?

    Older versions of cryptography have no such method, and none promises what it does then; so it is asked.
    """
    if not hasattr(AESGCM, "decrypt_into"):
        return False
    aead, nonce, plain = AESGCM(bytes(16)), bytes(12), bytes(range(256)) * 4
    sealed = aead.encrypt(nonce, plain, None)
    try:
        buffer = bytearray(plain) + bytes(_TAG_LENGTH)
        view = memoryview(buffer)
        aead.encrypt_into(nonce, view[: len(plain)], None, view)
        encrypted = buffer == sealed
        aead.decrypt_into(nonce, view, None, view[: len(plain)])
    except (ValueError, TypeError, BufferError):
        return False
    return encrypted and buffer[: len(plain)] == plain


_ENCRYPTS_IN_PLACE: Final = _encrypts_in_place()
