"""Large buffers: whatever the library can do, the octets are the same."""

from __future__ import annotations

import random

import pytest
from cryptography.exceptions import InvalidTag
from cryptography.hazmat.primitives.ciphers.aead import AESGCM

from ddsi_security.cryptographic import aes_gcm
from ddsi_security.cryptographic.rooms import Rooms

NONCE = bytes(range(12))
AEAD = AESGCM(bytes(range(32)))


@pytest.fixture(params=[True, False], ids=["into", "not into"])
def _has_into(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Older versions of the library have no ``encrypt_into``."""
    monkeypatch.setattr(aes_gcm, "_HAS_INTO", request.param and aes_gcm._HAS_INTO)


@pytest.mark.usefixtures("_has_into")
@pytest.mark.parametrize("size", [0, 1, aes_gcm.LARGE])
@pytest.mark.parametrize("kind", [bytes, bytearray, memoryview])
def test_into_a_room_and_out_of_it(size: int, kind: type) -> None:
    plain, room = random.Random(size).randbytes(size), memoryview(bytearray(size + 16))
    aes_gcm.encrypter_into(AEAD)(NONCE, kind(plain), None, room)
    assert room == AEAD.encrypt(NONCE, plain, None)
    found, decrypt_into = memoryview(bytearray(size)), aes_gcm.decrypter_into(AEAD)
    decrypt_into(NONCE, room, None, found)
    assert found == plain
    room[-1] ^= 1
    with pytest.raises(InvalidTag):
        decrypt_into(NONCE, room, None, found)


@pytest.mark.usefixtures("_has_into")
@pytest.mark.parametrize("size", [0, 1, aes_gcm.LARGE - 1, aes_gcm.LARGE])
@pytest.mark.parametrize("kind", [bytes, memoryview])
def test_decrypting_joins_cipher_text_and_tag(size: int, kind: type) -> None:
    plain = random.Random(size).randbytes(size)
    sealed = AEAD.encrypt(NONCE, plain, None)
    encrypted, tag = kind(sealed[:-16]), sealed[-16:]
    rooms = Rooms()
    found = aes_gcm.decrypt_joined(AEAD, NONCE, encrypted, 0, len(encrypted), tag, rooms)
    assert found == plain
    assert isinstance(found, memoryview) is (size >= aes_gcm.LARGE)
    assert encrypted == sealed[:-16], "what came is left as it was"
    with pytest.raises(InvalidTag):
        aes_gcm.decrypt_joined(AEAD, NONCE, encrypted, 0, len(encrypted), bytes(16), rooms)
