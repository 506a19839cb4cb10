"""AES-GCM over large buffers, with no second buffer of their size where that can be helped.

Nothing of DDS is known here.  Small buffers are better off with plain ``AESGCM.encrypt`` and ``decrypt``: one call that
allocates costs less there than several that do not.
"""

from __future__ import annotations

from typing import Final

from cryptography.hazmat.primitives.ciphers.aead import AESGCM

from ddsi.serialization.cursor import Octets

__all__ = ["LARGE", "TAG_LENGTH", "append_encrypted", "decrypt_joined"]

TAG_LENGTH: Final = 16

LARGE: Final = 1 << 14
"""From so many octets on it pays to spare copies: one of 64 KiB takes a fifth of the time that encrypting them does."""


def append_encrypted(buffer: bytearray, plain: Octets, aead: AESGCM, nonce: bytes, *, lead: bytes = b"") -> None:
    """Append the cipher text of ``lead`` and ``plain`` to ``buffer``, and its tag."""
    if not _HAS_INTO or (lead and not _ENCRYPTS_IN_PLACE):
        buffer += aead.encrypt(nonce, lead + plain if lead else plain, None)
        return
    start = len(buffer)
    # What is appended makes room, and is overwritten.  With a lead it is the plain text too, as there is no other place
    # where both lie together.
    buffer += lead
    buffer += plain
    buffer += bytes(TAG_LENGTH)
    with memoryview(buffer) as whole, whole[start:] as room, room[:-TAG_LENGTH] as joined:
        aead.encrypt_into(nonce, joined if lead else plain, None, room)


def decrypt_joined(aead: AESGCM, nonce: bytes, encrypted: Octets, tag: bytes) -> bytes | bytearray:
    """What ``encrypted`` holds, whose ``tag`` lies elsewhere.  Raises cryptography's InvalidTag."""
    if not _ENCRYPTS_IN_PLACE:
        return aead.decrypt(nonce, b"".join((encrypted, tag)), None)
    buffer = bytearray().join((encrypted, tag))
    with memoryview(buffer) as whole, whole[:-TAG_LENGTH] as room:
        aead.decrypt_into(nonce, whole, None, room)
    del buffer[-TAG_LENGTH:]
    return buffer


def _encrypts_in_place() -> bool:
    """May input and output of ``encrypt_into`` and ``decrypt_into`` begin at the same octet?

    No version of cryptography promises it, and later ones may refuse; so it is asked.
    """
    aead, nonce, plain = AESGCM(bytes(16)), bytes(12), bytes(range(256)) * 4
    view = memoryview(bytearray(plain) + bytes(TAG_LENGTH))
    try:
        aead.encrypt_into(nonce, view[:-TAG_LENGTH], None, view)
        encrypted = view == aead.encrypt(nonce, plain, None)
        aead.decrypt_into(nonce, view, None, view[:-TAG_LENGTH])
    except (ValueError, TypeError, BufferError):
        return False
    return encrypted and view[:-TAG_LENGTH] == plain


_HAS_INTO: Final = hasattr(AESGCM, "encrypt_into") and hasattr(AESGCM, "decrypt_into")
_ENCRYPTS_IN_PLACE: Final = _HAS_INTO and _encrypts_in_place()
