"""Session keys of what we send, and the only place where nonces are made.

DDS-Security 1.1 §9.5.3.3 (SessionKey, SessionReceiverSpecificKey, initialization vectors).

AES-GCM stands and falls with its nonce: two messages under one key and one nonce give away the difference of the
plain texts and the key that authenticates.  A nonce here is session_id || initialization_vector_suffix, and the session
id also enters into the key, so what must never repeat is (master key, session id, suffix):

* the suffix is a counter of 63 bits that begins anywhere and is never put back;
* a session ends, long before the counter could come round, after ``max_blocks`` blocks of the cipher, of which every
  operation takes at least one; the next session has the next id, hence another key;
* when the ids come round to the first one, the key is used up and refuses.

The pairwise key of the volatile endpoints is the same on both sides, which both encrypt with it.  The highest bit of
the suffix tells the sides apart: the replier of the handshake sets it, the initiator does not, so they cannot meet.
The first session id and the first count are random, so that nothing repeats either when a key is had again.
"""

from __future__ import annotations

import hmac
import struct
from collections.abc import Callable
from typing import Final

from cryptography.hazmat.primitives.ciphers.aead import AESGCM

from .aes_gcm import encrypter_into
from .key_material import KeyMaterial

__all__ = [
    "DEFAULT_MAX_BLOCKS",
    "LARGEST_MAX_BLOCKS",
    "NONCE_AT",
    "ReceiverKey",
    "SendingKey",
    "session_key",
    "session_receiver_key",
]

LARGEST_MAX_BLOCKS: Final = (1 << 63) - 1
DEFAULT_MAX_BLOCKS: Final = 1 << 32
"""Blocks of 16 octets under one session key: 64 GiB, where AES still is far from showing that it is a permutation."""

NONCE_AT: Final = 8
"""Where in a CryptoHeader the nonce begins, which goes to its end."""

_COUNTER_MASK: Final = (1 << 63) - 1
_REPLIERS_BIT: Final = 1 << 63
_SESSION_MASK: Final = (1 << 32) - 1
_pack_suffix: Final = struct.Struct(">Q").pack


def session_key(material: KeyMaterial, session_id: bytes) -> bytes:
    """HMAC(master_sender_key, "SessionKey" || master_salt || session_id), cut to the length of the key."""
    text = b"SessionKey" + material.master_salt + session_id
    return hmac.digest(material.master_sender_key, text, "sha256")[: material.kind.key_length]


def session_receiver_key(master: bytearray, material: KeyMaterial, session_id: bytes) -> bytes:
    """HMAC(master_receiver_specific_key, "SessionReceiverKey" || master_salt || session_id), cut likewise."""
    text = b"SessionReceiverKey" + material.master_salt + session_id
    return hmac.digest(master, text, "sha256")[: material.kind.key_length]


class SendingKey:
    """A key of ours with its current session.  ``aead`` and ``encrypt_into`` are of it, and change with ``session_id``.

    Invariant: of two headers that it hands out, no two are equal.
    """

    __slots__ = (
        "_blocks_left",
        "_count",
        "_first_session",
        "_head",
        "_max_blocks",
        "_session",
        "_session_began_at",
        "_side",
        "aead",
        "encrypt_into",
        "encrypts",
        "material",
        "session_id",
    )

    def __init__(
        self,
        material: KeyMaterial,
        entropy: Callable[[int], bytes],
        *,
        max_blocks: int = DEFAULT_MAX_BLOCKS,
        replier: bool = False,
    ) -> None:
        """``replier``: we are the replier of the two that hold this key.  A key that only we send with has no sides."""
        assert 1 <= max_blocks <= LARGEST_MAX_BLOCKS
        self.material = material
        self.encrypts = material.kind.encrypts
        self._max_blocks = max_blocks
        self._side = _REPLIERS_BIT if replier else 0
        self._count = int.from_bytes(entropy(8), "big") & _COUNTER_MASK
        self._first_session = int.from_bytes(entropy(4), "big")
        self._begin_session(self._first_session, max_blocks)

    def next_header(self, octets: int) -> bytes | None:
        """The CryptoHeader of one operation over so many octets, never given out before; None: the key is used up.

        Its last 12 octets, from NONCE_AT on, are the nonce; what is of the session is read after this, not before.
        """
        self._blocks_left -= (octets >> 4) + 1
        if self._blocks_left < 0 and not self._end_session((octets >> 4) + 1):
            return None
        self._count = count = self._count + 1 & _COUNTER_MASK
        assert count != self._session_began_at, "a nonce would be used twice"
        return self._head + _pack_suffix(self._side | count)

    def wipe(self) -> None:
        self.material.wipe()
        self._blocks_left = -1
        self._session = self._first_session - 1 & _SESSION_MASK  # the last one of all

    def _end_session(self, blocks: int) -> bool:
        """Go over to the next session and take so many blocks of it.  False: there is none left."""
        following = self._session + 1 & _SESSION_MASK
        if following == self._first_session:
            return False
        self._begin_session(following, max(self._max_blocks, blocks) - blocks)
        return True

    def _begin_session(self, session: int, blocks: int) -> None:
        self._session = session
        self._session_began_at = self._count
        self._blocks_left = blocks
        self.session_id = session.to_bytes(4, "big")
        self.aead = AESGCM(session_key(self.material, self.session_id))
        self.encrypt_into = encrypter_into(self.aead)
        self._head = self.material.kind.to_wire() + self.material.sender_key_id + self.session_id

    def __repr__(self) -> str:
        return f"<SendingKey {self.material.kind.name} {self.material.sender_key_id.hex()}>"


class ReceiverKey:
    """The key that we share with one receiver alone, so that it can tell us from its fellow receivers.

    It is derived anew with each session of the sending key that it goes with, and authenticates the common MAC under
    the same nonce: of another key, so that is no reuse.
    """

    __slots__ = ("_aead", "_master", "_session_id", "key_id")

    def __init__(self, key_id: bytes, master: bytearray) -> None:
        self.key_id = key_id
        self._master = master
        self._session_id = b""
        self._aead: AESGCM | None = None

    def token_material(self, sending: SendingKey) -> KeyMaterial:
        """What this receiver, and no other, is told of the sending key."""
        return sending.material.for_receiver(self.key_id, self._master)

    def mac(self, sending: SendingKey, nonce: bytes, common_mac: bytes) -> bytes:
        """receiver_specific_mac: the GMAC of ``common_mac``, 16 octets."""
        aead = self._aead
        if aead is None or self._session_id != sending.session_id:
            self._session_id = sending.session_id
            key = session_receiver_key(self._master, sending.material, self._session_id)
            aead = self._aead = AESGCM(key)
        return aead.encrypt(nonce, b"", common_mac)

    def wipe(self) -> None:
        self._master[:] = bytes(len(self._master))
        self._aead = None

    def __repr__(self) -> str:
        return f"<ReceiverKey {self.key_id.hex()}>"
