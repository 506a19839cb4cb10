"""Large buffers: whatever the library can do, the octets are the same."""

from __future__ import annotations

import random

import pytest
from cryptography.exceptions import InvalidTag
from cryptography.hazmat.primitives.ciphers.aead import AESGCM

from ddsi_security.cryptographic import aes_gcm

NONCE = bytes(range(12))
AEAD = AESGCM(bytes(range(32)))


@pytest.fixture(params=[True, False], ids=["into", "not into"])
def _has_into(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Older versions of the library have no ``encrypt_into``."""
    monkeypatch.setattr(aes_gcm, "_HAS_INTO", request.param and aes_gcm._HAS_INTO)


@pytest.mark.usefixtures("_has_into")
@pytest.mark.parametrize("size", [0, 1, aes_gcm.LARGE + 5, 1 << 17])
@pytest.mark.parametrize("kind", [bytes, bytearray, memoryview])
def test_encrypting_appends_the_cipher_text_and_returns_the_tag(size: int, kind: type) -> None:
    plain = random.Random(size).randbytes(size)
    buffer = bytearray(b"before")
    tag = aes_gcm.append_encrypted(buffer, kind(plain), AEAD, NONCE, spare=24)
    buffer += b"behind"
    sealed = AEAD.encrypt(NONCE, plain, None)
    assert buffer == b"before" + sealed[:-16] + b"behind"
    assert tag == sealed[-16:]


@pytest.mark.usefixtures("_has_into")
@pytest.mark.parametrize("size", [0, 1, aes_gcm.LARGE - 1, aes_gcm.LARGE])
@pytest.mark.parametrize("kind", [bytes, memoryview])
def test_decrypting_joins_cipher_text_and_tag(size: int, kind: type) -> None:
    plain = random.Random(size).randbytes(size)
    sealed = AEAD.encrypt(NONCE, plain, None)
    encrypted, tag = kind(sealed[:-16]), sealed[-16:]
    scratch = aes_gcm.Scratch()
    found = aes_gcm.decrypt_joined(AEAD, NONCE, encrypted, 0, len(encrypted), tag, scratch)
    assert found == plain
    assert isinstance(found, memoryview) is (size >= aes_gcm.LARGE)
    assert encrypted == sealed[:-16], "what came is left as it was"
    with pytest.raises(InvalidTag):
        aes_gcm.decrypt_joined(AEAD, NONCE, encrypted, 0, len(encrypted), bytes(16), scratch)


def test_what_was_decrypted_last_can_be_wiped() -> None:
    scratch = aes_gcm.Scratch()
    room = scratch.room(100)
    room[:] = b"x" * 100
    scratch.wipe()
    assert not any(room)
