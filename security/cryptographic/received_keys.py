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
from .rooms import Rooms
from .session_keys import session_key, session_receiver_key
from .transformation import Protection, TransformationKind

__all__ = ["KeyRing", "ReceivedKey", "ReceivedSession"]

_MOST_SESSIONS: Final = 8
_PREVIOUS_KEPT_NS: Final = 60 * 10**9
_NOT_ENCRYPTED: Final = "it is signed, and is to be encrypted"
_NOT_SIGNED: Final = "it is encrypted, and is to be signed"


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
    """A key of a peer, and the ``sessions`` of it that something was verified with, the oldest first.

    ``kind_octets``: the transformation kind as every header that names this key must bear it.
    """

    __slots__ = ("encrypts", "key_id", "kind_octets", "material", "receiver_key_id", "sessions")

    def __init__(self, material: KeyMaterial) -> None:
        self.material = material
        self.key_id = material.sender_key_id
        self.receiver_key_id = material.receiver_specific_key_id
        self.kind_octets = material.kind.to_wire()
        self.encrypts = material.kind.encrypts
        self.sessions: dict[bytes, ReceivedSession] = {}

    def derive(self, session_id: bytes) -> ReceivedSession:
        """A session that is not among ``sessions``; :meth:`keep` it once something was verified with it."""
        return ReceivedSession(self.material, session_id)

    def keep(self, session_id: bytes, session: ReceivedSession) -> None:
        if len(self.sessions) >= _MOST_SESSIONS:
            del self.sessions[next(iter(self.sessions))]
        self.sessions[session_id] = session

    def wipe(self) -> None:
        self.material.wipe()
        self.sessions.clear()

    def __repr__(self) -> str:
        return f"<ReceivedKey {self.material.kind.name} {self.key_id.hex()}>"


class KeyRing:
    """The key of one purpose that a peer gave us, and for a minute the one before: what it protected is under way.

    ``by_id``: one or two for each id, the newest first, as both may have one id.  A third drives out the oldest.
    """

    __slots__ = ("_clock", "_previous_ends", "by_id", "current", "previous", "rooms")

    def __init__(self, wall_clock: Callable[[], int], rooms: Rooms | None = None) -> None:
        """``rooms``: where large octets are decrypted to."""
        self.rooms = Rooms() if rooms is None else rooms
        self.current: ReceivedKey | None = None
        self.previous: ReceivedKey | None = None
        self._clock = wall_clock
        self._previous_ends = 0
        self.by_id: dict[bytes, tuple[ReceivedKey, ...]] = {}

    def fitting(
        self, kind_octets: bytes, key_id: bytes, expected: Protection | None
    ) -> tuple[ReceivedKey, ...] | Outcome:
        """The keys that may open what bears this kind and key id, the newest first, or why there are none.

        The kind must be that of the key, and what it does to octets what is ``expected``: a peer's, or an attacker's,
        word for it that a signature is enough counts for nothing.  None: nothing is due, and what comes is welcome.
        """
        if self.previous is not None and self._clock() >= self._previous_ends:
            self._drop_previous()
        keys = self.by_id.get(key_id)
        if keys is None:
            return NoKeys(key_id)
        key = keys[0]
        if key.kind_octets != kind_octets or len(keys) > 1:
            keys = tuple([key for key in keys if key.kind_octets == kind_octets])
            if not keys:
                return Rejected(f"transformation kind {kind_octets.hex()} is not that of key {key_id.hex()}")
            key = keys[0]
        if expected is not None and key.encrypts is not expected.encrypted:
            return Rejected(_NOT_ENCRYPTED if expected.encrypted else _NOT_SIGNED)
        return keys

    def replace(self, material: KeyMaterial) -> None:
        """Put in a new key, or nothing if it is of kind NONE.  A token that came twice changes nothing.

        The ring keeps a copy: a peer may use one key for two purposes, and either ring wipes its own.
        """
        if self.current is not None and self.current.material == material:
            return
        if self.previous is not None:
            self.previous.wipe()
        self.previous = self.current
        self._previous_ends = self._clock() + _PREVIOUS_KEPT_NS
        self.current = None if material.kind is TransformationKind.NONE else ReceivedKey(material.copy())
        self._index()

    def wipe(self) -> None:
        for key in (self.current, self.previous):
            if key is not None:
                key.wipe()
        self.current = self.previous = None
        self.by_id.clear()

    def _drop_previous(self) -> None:
        if self.previous is not None:
            self.previous.wipe()
        self.previous = None
        self._index()

    def _index(self) -> None:
        self.by_id = {}
        for key in (self.current, self.previous):
            if key is not None:
                self.by_id[key.key_id] = (*self.by_id.get(key.key_id, ()), key)

    def __repr__(self) -> str:
        return f"<KeyRing {self.current!r}>"
