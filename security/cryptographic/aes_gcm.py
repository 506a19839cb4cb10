"""AES-GCM over large buffers, with as few copies of them as the library allows.

Nothing of DDS is known here.  Small buffers are better off with plain ``AESGCM.encrypt`` and ``decrypt``: one call that
allocates costs less there than several that do not.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from cryptography.hazmat.primitives.ciphers.aead import AESGCM

from ddsi.serialization.cursor import Octets

__all__ = ["LARGE", "Scratch", "decrypt_joined", "decrypt_sealed", "decrypter_into", "encrypt_between"]

LARGE: Final = 1 << 14
"""From so many octets on it pays to spare copies: one of 64 KiB takes a fifth of the time that encrypting them does."""

_TAG_LENGTH: Final = 16
_HAS_INTO: Final = hasattr(AESGCM, "encrypt_into") and hasattr(AESGCM, "decrypt_into")
"""cryptography has them since version 47."""
_LARGEST_KEPT: Final = 1 << 16
"""What comes in one datagram is no larger."""


class Scratch:
    """Room for large octets, each of which their reader is done with before the next ones come.

    The same octets again and again stay in the processor's caches; fresh ones cost as much as decrypting does.
    """

    __slots__ = ("_last", "_octets")

    def __init__(self) -> None:
        self._octets = bytearray()
        self._last = memoryview(self._octets)

    def room(self, length: int) -> memoryview:
        """So many octets, which hold anything."""
        if len(self._last) == length:  # all fragments but one are of one length
            return self._last
        if length > _LARGEST_KEPT:
            return memoryview(bytearray(length))
        if len(self._octets) < length:
            self._octets = bytearray(_LARGEST_KEPT)
        self._last = memoryview(self._octets)[:length]
        return self._last

    def wipe(self) -> None:
        """What was decrypted last is not to be found in memory any more."""
        self._octets[:] = bytes(len(self._octets))


def encrypt_between(head: bytes, plain: Octets, foot: bytes, aead: AESGCM, nonce: bytes, scratch: Scratch) -> Octets:
    """The cipher text of ``plain`` with its tag, between ``head`` and ``foot``; in ``scratch`` if it is large."""
    if len(plain) < LARGE or not _HAS_INTO:
        return b"".join((head, aead.encrypt(nonce, plain, None), foot))
    start, end = len(head), len(head) + len(plain) + _TAG_LENGTH
    room = scratch.room(end + len(foot))
    room[:start] = head
    aead.encrypt_into(nonce, plain, None, room[start:end])
    room[end:] = foot
    return room


def decrypt_joined(
    aead: AESGCM, nonce: bytes, octets: Octets, start: int, end: int, tag: bytes, scratch: Scratch
) -> bytes | memoryview:
    """What ``octets[start:end]`` hold, whose ``tag`` lies elsewhere; if it is large, it lies in ``scratch``.

    If it is large, and ``octets`` can be written to, the tag is put where it belongs, over what follows.  Raises
    cryptography's InvalidTag.
    """
    if end - start < LARGE:
        return aead.decrypt(nonce, b"".join((octets[start:end], tag)), None)
    if isinstance(octets, memoryview) and not octets.readonly and len(octets) >= end + _TAG_LENGTH:
        octets[end : end + _TAG_LENGTH] = tag
        sealed: Octets = octets[start : end + _TAG_LENGTH]
    else:
        sealed = b"".join((octets[start:end], tag))
    return decrypt_sealed(aead, nonce, sealed, scratch)


def decrypt_sealed(aead: AESGCM, nonce: bytes, sealed: Octets, scratch: Scratch) -> bytes | memoryview:
    """The same of a cipher text with its tag behind it."""
    if len(sealed) < LARGE:
        return aead.decrypt(nonce, sealed, None)
    if not _HAS_INTO:
        return memoryview(bytearray(aead.decrypt(nonce, sealed, None)))
    plain = scratch.room(len(sealed) - _TAG_LENGTH)
    aead.decrypt_into(nonce, sealed, None, plain)
    return plain


def decrypter_into(aead: AESGCM) -> Callable[[bytes, Octets, None, memoryview], object]:
    """``decrypt_into`` of the library, or what does the same: nonce, octets with their tag, nothing, where to."""
    if _HAS_INTO:
        return aead.decrypt_into

    def decrypt_into(nonce: bytes, sealed: Octets, associated: None, room: memoryview) -> None:
        room[:] = aead.decrypt(nonce, sealed, associated)

    return decrypt_into
