"""AEAD: what protecting octets costs when there is nothing around it - bare calls of AES-GCM, and a copy."""

from __future__ import annotations

import os

from cryptography.hazmat.primitives.ciphers.aead import AESGCM

from .bursts import Operation, average
from .protocol import PAYLOAD_BYTE, play


def bare(octets: int, count: int) -> dict[str, float]:
    """Microseconds to ``encrypt``, ``decrypt``, ``sign`` (octets that are only authenticated) and ``copy``.

    Of processor time, and on average, as samples are measured that this is set against.
    """
    aead, nonce = AESGCM(os.urandom(32)), os.urandom(12)
    plain = PAYLOAD_BYTE * octets
    protected = aead.encrypt(nonce, plain, None)
    operations: dict[str, Operation] = {
        "encrypt": lambda: aead.encrypt(nonce, plain, None),
        "decrypt": lambda: aead.decrypt(nonce, protected, None),
        "sign": lambda: aead.encrypt(nonce, b"", plain),
        "copy": lambda: bytearray(plain),
    }
    return {f"{name}_us": seconds * 1e6 for name, seconds in average(operations, count).items()}


if __name__ == "__main__":
    play({"bare": bare})
