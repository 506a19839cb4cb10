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
def test_encrypting_puts_the_cipher_text_and_its_tag_between_what_stands_around_it(size: int, kind: type) -> None:
    scratch, dice = aes_gcm.Scratch(), random.Random(size)
    for length in (size, size, size + 1):
        plain = dice.randbytes(length)
        found = aes_gcm.encrypt_between(b"before", kind(plain), b"behind", AEAD, NONCE, scratch)
        assert found == b"before" + AEAD.encrypt(NONCE, plain, None) + b"behind"


@pytest.mark.usefixtures("_has_into")
def test_a_room_is_as_large_as_asked_for() -> None:
    scratch = aes_gcm.Scratch()
    for length in (100, 100, 7, 0, 1 << 16, 100, 1 << 17, 1 << 17, 100):
        assert len(scratch.room(length)) == length


@pytest.mark.usefixtures("_has_into")
@pytest.mark.parametrize("size", [0, aes_gcm.LARGE])
def test_decrypting_into_a_room(size: int) -> None:
    plain, room = random.Random(size).randbytes(size), memoryview(bytearray(size))
    decrypt_into = aes_gcm.decrypter_into(AEAD)
    sealed = AEAD.encrypt(NONCE, plain, None)
    decrypt_into(NONCE, sealed, None, room)
    assert room == plain
    with pytest.raises(InvalidTag):
        decrypt_into(NONCE, sealed[:-1] + bytes((sealed[-1] ^ 1,)), None, room)


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
