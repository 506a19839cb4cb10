"""Large buffers: whatever the library can do in place, the octets are the same."""

from __future__ import annotations

import random

import pytest
from cryptography.exceptions import InvalidTag
from cryptography.hazmat.primitives.ciphers.aead import AESGCM

from ddsi_security.cryptographic import aes_gcm

NONCE = bytes(range(12))
AEAD = AESGCM(bytes(range(32)))
PLAIN = random.Random(1).randbytes(aes_gcm.LARGE + 5)

ABILITIES = [(True, True), (True, False), (False, False)]
"""Has the library encrypt_into?  Does it work in place?  The first only where the one that runs has it."""


@pytest.fixture(params=ABILITIES, ids=["in place", "into", "neither"])
def _abilities(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    has_into, in_place = request.param
    monkeypatch.setattr(aes_gcm, "_HAS_INTO", has_into and aes_gcm._HAS_INTO)
    monkeypatch.setattr(aes_gcm, "_ENCRYPTS_IN_PLACE", in_place and aes_gcm._ENCRYPTS_IN_PLACE)


@pytest.mark.usefixtures("_abilities")
@pytest.mark.parametrize("lead", [b"", b"12345678"])
@pytest.mark.parametrize("kind", [bytes, bytearray, memoryview])
def test_encrypting_appends_cipher_text_and_tag(lead: bytes, kind: type) -> None:
    buffer = bytearray(b"before")
    aes_gcm.append_encrypted(buffer, kind(PLAIN), AEAD, NONCE, lead=lead)
    assert buffer == b"before" + AEAD.encrypt(NONCE, lead + PLAIN, None)


@pytest.mark.usefixtures("_abilities")
@pytest.mark.parametrize("kind", [bytes, memoryview])
def test_decrypting_joins_cipher_text_and_tag(kind: type) -> None:
    sealed = AEAD.encrypt(NONCE, PLAIN, None)
    encrypted, tag = kind(sealed[:-16]), sealed[-16:]
    assert aes_gcm.decrypt_joined(AEAD, NONCE, encrypted, tag) == PLAIN
    assert encrypted == sealed[:-16], "what came is left as it was"
    with pytest.raises(InvalidTag):
        aes_gcm.decrypt_joined(AEAD, NONCE, encrypted, bytes(16))


class Refusing:
    """A library that looks for overlapping buffers."""

    def __init__(self, key: bytes) -> None:
        self._aead = AESGCM(key)

    def encrypt(self, nonce: bytes, data: bytes, associated_data: None) -> bytes:
        return self._aead.encrypt(nonce, data, associated_data)

    def encrypt_into(self, nonce: bytes, data: memoryview, associated_data: None, buf: memoryview) -> int:
        raise ValueError("overlapping buffers")


class Spoiling(Refusing):
    """One that does not, and overwrites what it has yet to read."""

    def encrypt_into(self, nonce: bytes, data: memoryview, associated_data: None, buf: memoryview) -> int:
        buf[:] = bytes(len(buf))
        return len(buf)

    def decrypt_into(self, nonce: bytes, data: memoryview, associated_data: None, buf: memoryview) -> int:
        return len(buf)


@pytest.mark.parametrize("library", [Refusing, Spoiling])
def test_a_library_that_fails_in_place_is_found_out(library: type, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(aes_gcm, "AESGCM", library)
    assert not aes_gcm._encrypts_in_place()
