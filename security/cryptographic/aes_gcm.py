"""AES-GCM over large buffers, with as few copies of them as the library allows.

Nothing of DDS is known here.  Small buffers are better off with plain ``AESGCM.encrypt`` and ``decrypt``: one call that
allocates costs less there than several that do not.
"""

from __future__ import annotations

from typing import Final

from cryptography.hazmat.primitives.ciphers.aead import AESGCM

from ddsi.serialization.cursor import Octets

__all__ = ["LARGE", "Scratch", "append_encrypted", "decrypt_joined", "decrypt_sealed"]

LARGE: Final = 1 << 14
"""From so many octets on it pays to spare copies: one of 64 KiB takes a fifth of the time that encrypting them does."""

_TAG_LENGTH: Final = 16
_ZEROS: Final = memoryview(bytes((1 << 16) + 256))
_HAS_INTO: Final = hasattr(AESGCM, "encrypt_into") and hasattr(AESGCM, "decrypt_into")
"""cryptography has them since version 47."""
_LARGEST_KEPT: Final = 1 << 16
"""What comes in one datagram is no larger."""


class Scratch:
    """Room for large plain texts, each of which its reader is done with before the next one comes.

    The same octets again and again stay in the processor's caches; fresh ones cost as much as decrypting does.
    """

    __slots__ = ("_octets",)

    def __init__(self) -> None:
        self._octets = bytearray()

    def room(self, length: int) -> memoryview:
        """So many octets, which hold anything."""
        if length > _LARGEST_KEPT:
            return memoryview(bytearray(length))
        if len(self._octets) < length:
            self._octets = bytearray(_LARGEST_KEPT)
        return memoryview(self._octets)[:length]

    def wipe(self) -> None:
        """What was decrypted last is not to be found in memory any more."""
        self._octets[:] = bytes(len(self._octets))


def append_encrypted(buffer: bytearray, plain: Octets, aead: AESGCM, nonce: bytes, *, spare: int) -> bytes:
    """Append the cipher text of ``plain`` to ``buffer`` and return the tag, 16 octets, which may belong elsewhere.

    ``spare``: so many octets more will be appended soon.  A bytearray that has just grown by a lot has no room left,
    and the next octet moves all of it; so it grows once, by whatever is at hand, which is then overwritten.
    """
    if not _HAS_INTO:
        sealed = aead.encrypt(nonce, plain, None)
        buffer += memoryview(sealed)[:-_TAG_LENGTH]
        return sealed[-_TAG_LENGTH:]
    start = len(buffer)
    end = start + len(plain)
    wanted = len(plain) + _TAG_LENGTH + spare
    if wanted <= len(_ZEROS):
        buffer += _ZEROS[:wanted]
    else:
        buffer += plain
        buffer += bytes(_TAG_LENGTH + spare)
    room = memoryview(buffer)[start : end + _TAG_LENGTH]
    aead.encrypt_into(nonce, plain, None, room)
    tag = bytes(room[-_TAG_LENGTH:])
    room.release()  # else the buffer could not change its length
    del buffer[end:]
    return tag


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
