"""The keys that a peer gave us, with the sessions that it was seen to use.  DDS-Security 1.1 §9.5.3.3.

Any session id may come with any message: what is stored encrypted is sent again, messages overtake each other.  A
session key costs one HMAC; a few are kept, and only of messages whose MAC was right, so that who has no key can neither
fill nor empty this store.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from cryptography.hazmat.primitives.ciphers.aead import AESGCM

from ddsi.spi import NoKeys, Outcome, Rejected

from .key_material import KeyMaterial
from .session_keys import session_key, session_receiver_key
from .transformation import Protection, TransformationKind

__all__ = ["KeyRing", "ReceivedKey", "ReceivedSession", "fitting_keys"]

_MOST_SESSIONS: Final = 8
_PREVIOUS_KEPT_NS: Final = 60 * 10**9


class ReceivedSession:
    """``aead``: of the session's key.  ``receiver_aead``: of the key that the sender shares with us alone, if any."""

    __slots__ = ("aead", "receiver_aead")

    def __init__(self, material: KeyMaterial, session_id: bytes) -> None:
        self.aead = AESGCM(session_key(material, session_id))
        self.receiver_aead: AESGCM | None = None
        if material.master_receiver_specific_key:
            key = session_receiver_key(material.master_receiver_specific_key, material, session_id)
            self.receiver_aead = AESGCM(key)


class ReceivedKey:
    """A key of a peer.  ``kind_octets``: the transformation kind as every header that names this key must bear it."""

    __slots__ = ("_sessions", "encrypts", "key_id", "kind_octets", "material", "receiver_key_id")

    def __init__(self, material: KeyMaterial) -> None:
        self.material = material
        self.key_id = material.sender_key_id
        self.receiver_key_id = material.receiver_specific_key_id
        self.kind_octets = material.kind.to_wire()
        self.encrypts = material.kind.encrypts
        self._sessions: dict[bytes, ReceivedSession] = {}

    def session(self, session_id: bytes) -> ReceivedSession:
        """The session of that id, kept or just derived.  :meth:`keep` it once something was verified with it."""
        return self._sessions.get(session_id) or ReceivedSession(self.material, session_id)

    def keep(self, session_id: bytes, session: ReceivedSession) -> None:
        sessions = self._sessions
        if session_id not in sessions:
            if len(sessions) >= _MOST_SESSIONS:
                del sessions[next(iter(sessions))]
            sessions[session_id] = session

    def wipe(self) -> None:
        self.material.wipe()
        self._sessions.clear()

    def __repr__(self) -> str:
        return f"<ReceivedKey {self.material.kind.name} {self.key_id.hex()}>"


class KeyRing:
    """The key of one purpose that a peer gave us, and for a minute the one before: what it protected is under way.

    Both may have one id.  A new key takes the place of the old at once; the older of two that were replaced is gone.
    """

    __slots__ = ("_by_id", "_clock", "_previous_ends", "current", "previous")

    def __init__(self, wall_clock: Callable[[], int]) -> None:
        self.current: ReceivedKey | None = None
        self.previous: ReceivedKey | None = None
        self._clock = wall_clock
        self._previous_ends = 0
        self._by_id: dict[bytes, tuple[ReceivedKey, ...]] = {}

    def find(self, key_id: bytes) -> tuple[ReceivedKey, ...]:
        """The keys of that id, the newest first: none, one, or two."""
        if self.previous is not None and self._clock() >= self._previous_ends:
            self._drop_previous()
        return self._by_id.get(key_id, ())

    def replace(self, material: KeyMaterial) -> None:
        """Put in a new key; of kind NONE, put in nothing.  A token that came twice changes nothing."""
        if self.current is not None and self.current.material == material:
            return
        if self.previous is not None:
            self.previous.wipe()
        self.previous = self.current
        self._previous_ends = self._clock() + _PREVIOUS_KEPT_NS
        self.current = None if material.kind is TransformationKind.NONE else ReceivedKey(material)
        self._index()

    @property
    def key_ids(self) -> tuple[bytes, ...]:
        return tuple(self._by_id)

    def wipe(self) -> None:
        for key in (self.current, self.previous):
            if key is not None:
                key.wipe()
        self.current = self.previous = None
        self._by_id.clear()

    def _drop_previous(self) -> None:
        if self.previous is not None:
            self.previous.wipe()
        self.previous = None
        self._index()

    def _index(self) -> None:
        self._by_id = {}
        for key in (self.current, self.previous):
            if key is not None:
                self._by_id[key.key_id] = (*self._by_id.get(key.key_id, ()), key)

    def __repr__(self) -> str:
        return f"<KeyRing {self.current!r}>"


def fitting_keys(ring: KeyRing, header: bytes, expected: Protection | None) -> tuple[ReceivedKey, ...] | Outcome:
    """The keys that may open what begins with this CryptoHeader, the newest first, or why there are none.

    The kind must be that of the key, and what it does to octets what is expected: a peer's, or an attacker's, word for
    it that a signature is enough counts for nothing.  ``expected`` None: nothing is due, and what comes is welcome.
    """
    key_id = header[4:8]
    keys = ring.find(key_id)
    if not keys:
        return NoKeys(key_id)
    if len(keys) > 1 or keys[0].kind_octets != header[:4]:
        keys = tuple(key for key in keys if key.kind_octets == header[:4])
        if not keys:
            return Rejected(f"transformation kind {header[:4].hex()} is not that of key {key_id.hex()}")
    if expected is not None and keys[0].encrypts is not expected.encrypted:
        due, found = ("encrypted", "signed") if expected.encrypted else ("signed", "encrypted")
        return Rejected(f"it is {found}, and it is to be {due}")
    return keys
