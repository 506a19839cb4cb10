"""AES-GCM over large buffers, with as few copies of them as the library allows.

Nothing of DDS is known here.  Small buffers are better off with plain ``AESGCM.encrypt`` and ``decrypt``: one call that
allocates costs less there than several that do not.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from cryptography.hazmat.primitives.ciphers.aead import AESGCM

from ddsi.serialization.cursor import Octets

from .rooms import Rooms

__all__ = ["LARGE", "decrypt_joined", "decrypt_sealed", "decrypter_into", "encrypter_into"]

LARGE: Final = 1 << 14
"""From so many octets on it pays to spare copies: one of 64 KiB takes a fifth of the time that encrypting them does."""

_TAG_LENGTH: Final = 16
_HAS_INTO: Final = hasattr(AESGCM, "encrypt_into") and hasattr(AESGCM, "decrypt_into")
"""cryptography has them since version 47."""

Into = Callable[[bytes, Octets, None, memoryview], object]
"""With a nonce, of these octets, and no others, into a room."""


def encrypter_into(aead: AESGCM) -> Into:
    """``encrypt_into`` of the library, or what does the same: the room is 16 octets longer than what is encrypted."""
    if _HAS_INTO:
        return aead.encrypt_into

    def encrypt_into(nonce: bytes, plain: Octets, nothing: None, room: memoryview) -> None:
        room[:] = aead.encrypt(nonce, plain, nothing)

    return encrypt_into


def decrypter_into(aead: AESGCM) -> Into:
    """The same of ``decrypt_into``, which is given octets with their tag.

    It raises cryptography's InvalidTag, and then there is anything.
    """
    if _HAS_INTO:
        return aead.decrypt_into

    def decrypt_into(nonce: bytes, sealed: Octets, nothing: None, room: memoryview) -> None:
        room[:] = aead.decrypt(nonce, sealed, nothing)

    return decrypt_into


def decrypt_joined(
    aead: AESGCM, nonce: bytes, octets: Octets, start: int, end: int, tag: bytes, rooms: Rooms
) -> bytes | memoryview:
    """What ``octets[start:end]`` hold, whose ``tag`` lies elsewhere; if it is large, it lies in one of ``rooms``.

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
    return decrypt_sealed(aead, nonce, sealed, rooms)


def decrypt_sealed(aead: AESGCM, nonce: bytes, sealed: Octets, rooms: Rooms) -> bytes | memoryview:
    """The same of a cipher text with its tag behind it."""
    if len(sealed) < LARGE:
        return aead.decrypt(nonce, sealed, None)
    room = rooms.room(len(sealed) - _TAG_LENGTH)
    decrypter_into(aead)(nonce, sealed, None, room)
    return room
