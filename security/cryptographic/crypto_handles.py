"""What the plugin hands out: for each participant, writer and reader, local or remote, the keys that belong to it.

DDS-Security 1.1 §8.5.1.2 to §8.5.1.4.  A remote endpoint stands here once for every local one that it is matched with,
as each pair has a receiver-specific key of its own.

    LocalParticipant ---- RemoteParticipant          one of these for every remote participant
      LocalWriter   ----    RemoteReader             one for every reader that the writer is matched with
      LocalReader   ----    RemoteWriter             one for every writer that the reader is matched with

Nobody else looks into them.  A repr tells the kind and the id of keys, never a key.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Final

from ddsi.spi import Refused

from ..crypto_transform_plugin import SecureSubmessage, SecureSubmessageCategory
from ..handles import DatareaderCryptoHandle, DatawriterCryptoHandle, ParticipantCryptoHandle
from .received_keys import KeyRing
from .rooms import Rooms
from .session_keys import ReceiverKey, SendingKey
from .transformation import Protection

__all__ = [
    "NO_KEY",
    "LocalParticipant",
    "LocalReader",
    "LocalWriter",
    "RemoteParticipant",
    "RemoteReader",
    "RemoteWriter",
]

NO_KEY: Final = Refused("there is no key to protect it with")

VOLATILE_PROTECTION: Final = Protection(encrypted=True)
"""What the volatile endpoints are always protected by, with the pairwise key of two participants."""


class LocalParticipant(ParticipantCryptoHandle):
    """``key``: of whole messages; None where they are not protected.  ``protection`` likewise.

    ``rooms``: for large octets, plain and protected.
    """

    __slots__ = (
        "_last_key_id",
        "endpoints",
        "key",
        "key_bits",
        "max_blocks",
        "protection",
        "remotes",
        "rooms",
    )

    def __init__(self, protection: Protection | None, *, key_bits: int, max_blocks: int, first_key_id: int) -> None:
        self.protection = protection
        self.rooms = Rooms()
        self.key_bits = key_bits
        self.max_blocks = max_blocks
        self.key: SendingKey | None = None
        self.remotes: set[RemoteParticipant] = set()
        self.endpoints: set[LocalWriter | LocalReader] = set()
        self._last_key_id = first_key_id

    def new_key_id(self) -> bytes:
        """Four octets that no other key of this participant has, and that are not all zero."""
        self._last_key_id = self._last_key_id % 0xFFFFFFFF + 1
        return self._last_key_id.to_bytes(4, "big")

    def wipe(self) -> None:
        _wipe(self.key, self.rooms)
        self.key = None

    def __repr__(self) -> str:
        return f"<LocalParticipant {self.key!r}>"


class RemoteParticipant(ParticipantCryptoHandle):
    """``ring``: the keys of its messages.  ``exchange_key`` and ``exchange_ring``: the pairwise key, for both ways.

    Every submessage of all volatile endpoints of the two counts with the one ``exchange_key``.
    """

    __slots__ = (
        "endpoints",
        "exchange_key",
        "exchange_ring",
        "local",
        "receiver_key",
        "ring",
        "senders",
        "volatile_reader",
        "volatile_writer",
    )

    def __init__(
        self,
        local: LocalParticipant,
        *,
        exchange_key: SendingKey,
        receiver_key: ReceiverKey | None,
        wall_clock: Callable[[], int],
    ) -> None:
        self.local = local
        self.exchange_key: SendingKey | None = exchange_key
        self.exchange_ring = KeyRing(wall_clock, local.rooms)
        self.receiver_key = receiver_key
        self.ring = KeyRing(wall_clock, local.rooms)
        self.endpoints: set[RemoteWriter | RemoteReader] = set()
        self.volatile_writer: RemoteWriter | None = None
        self.volatile_reader: RemoteReader | None = None
        # Whose submessages a key id announces.  Key ids mean something only together with the participant.
        self.senders: dict[bytes, list[RemoteWriter | RemoteReader]] = {}

    def index(self, sender: RemoteWriter | RemoteReader, key_ids: Iterable[bytes]) -> None:
        """From now on these ids, and no others, announce submessages of ``sender``."""
        for key_id in sender.key_ids:
            senders = self.senders[key_id]
            senders.remove(sender)
            if not senders:
                del self.senders[key_id]
        sender.key_ids = tuple(key_ids)
        for key_id in sender.key_ids:
            self.senders.setdefault(key_id, []).append(sender)

    def wipe(self) -> None:
        _wipe(self.exchange_key, self.receiver_key, self.ring, self.exchange_ring)
        self.exchange_key = self.receiver_key = None

    def __repr__(self) -> str:
        return f"<RemoteParticipant {self.ring!r}>"


class LocalWriter(DatawriterCryptoHandle):
    """``submessage_key`` and ``payload_key``: None where there is no such protection, and for the volatile writer."""

    __slots__ = ("is_volatile", "matched", "participant", "payload", "payload_key", "submessage", "submessage_key")

    def __init__(
        self,
        participant: LocalParticipant,
        *,
        submessage: Protection | None,
        payload: Protection | None,
        is_volatile: bool,
    ) -> None:
        self.participant = participant
        self.submessage = submessage
        self.payload = payload
        self.is_volatile = is_volatile
        self.submessage_key: SendingKey | None = None
        self.payload_key: SendingKey | None = None
        self.matched: set[RemoteReader] = set()

    def wipe(self) -> None:
        _wipe(self.submessage_key, self.payload_key)
        self.submessage_key = self.payload_key = None

    def __repr__(self) -> str:
        return f"<LocalWriter {self.submessage_key!r}, payload {self.payload_key!r}>"


class LocalReader(DatareaderCryptoHandle):
    """``submessage_key``: of its ACKNACKs.  ``submessage`` and ``payload``: also what it expects of writers."""

    __slots__ = ("is_volatile", "matched", "participant", "payload", "submessage", "submessage_key")

    def __init__(
        self,
        participant: LocalParticipant,
        *,
        submessage: Protection | None,
        payload: Protection | None,
        is_volatile: bool,
    ) -> None:
        self.participant = participant
        self.submessage = submessage
        self.payload = payload
        self.is_volatile = is_volatile
        self.submessage_key: SendingKey | None = None
        self.matched: set[RemoteWriter] = set()

    def wipe(self) -> None:
        _wipe(self.submessage_key)
        self.submessage_key = None

    def __repr__(self) -> str:
        return f"<LocalReader {self.submessage_key!r}>"


class RemoteReader(DatareaderCryptoHandle):
    """A reader that ``writer`` is matched with.  ``ring``: the keys of its ACKNACKs; ``receiver_key``: for it.

    ``key_ids``: under which :meth:`RemoteParticipant.index` knows it.  ``whose``: what is told of its submessages.
    """

    __slots__ = ("key_ids", "participant", "receiver_key", "relay_only", "ring", "whose", "writer")

    def __init__(
        self,
        writer: LocalWriter,
        participant: RemoteParticipant,
        *,
        ring: KeyRing,
        receiver_key: ReceiverKey | None,
        relay_only: bool,
    ) -> None:
        self.writer = writer
        self.participant = participant
        self.ring = ring
        self.receiver_key = receiver_key
        self.relay_only = relay_only
        self.key_ids: tuple[bytes, ...] = ()
        self.whose = SecureSubmessage(SecureSubmessageCategory.DATAREADER_SUBMESSAGE, writer, self)

    def wipe(self) -> None:
        _wipe(self.receiver_key)
        self.receiver_key = None
        if self.ring is not self.participant.exchange_ring:
            self.ring.wipe()

    def __repr__(self) -> str:
        return f"<RemoteReader {self.ring!r}>"


class RemoteWriter(DatawriterCryptoHandle):
    """A writer that ``reader`` is matched with.  ``ring``, ``payload_ring``: its keys; ``receiver_key``: for it.

    ``key_ids``: under which :meth:`RemoteParticipant.index` knows it.  ``whose``: what is told of its submessages.
    """

    __slots__ = ("key_ids", "participant", "payload_ring", "reader", "receiver_key", "ring", "whose")

    def __init__(
        self,
        reader: LocalReader,
        participant: RemoteParticipant,
        *,
        ring: KeyRing,
        payload_ring: KeyRing,
        receiver_key: ReceiverKey | None,
    ) -> None:
        self.reader = reader
        self.participant = participant
        self.ring = ring
        self.payload_ring = payload_ring
        self.receiver_key = receiver_key
        self.key_ids: tuple[bytes, ...] = ()
        self.whose = SecureSubmessage(SecureSubmessageCategory.DATAWRITER_SUBMESSAGE, self, reader)

    def wipe(self) -> None:
        _wipe(self.receiver_key, self.payload_ring)
        self.receiver_key = None
        if self.ring is not self.participant.exchange_ring:
            self.ring.wipe()

    def __repr__(self) -> str:
        return f"<RemoteWriter {self.ring!r}, payload {self.payload_ring!r}>"


def _wipe(*secrets: SendingKey | ReceiverKey | KeyRing | Rooms | None) -> None:
    for secret in secrets:
        if secret is not None:
            secret.wipe()
