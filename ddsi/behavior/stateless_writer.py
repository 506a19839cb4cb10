"""StatelessWriter: sends its changes to locators and keeps no account of readers.

RTPS 2.5 §8.4.8.1 (best-effort StatelessWriter), §8.5.3.3.1 (SPDPbuiltinParticipantWriter).  SPDP is the user: one
change per participant that is resent again and again, to whoever may listen.
"""

from __future__ import annotations

from ..structure.cache_change import CacheChange, ChangeKind
from ..structure.guid import Guid

__all__ = ["StatelessWriter"]


class StatelessWriter:
    """Keeps the latest change of the one instance that it writes."""

    __slots__ = ("guid", "last_sn", "latest")

    def __init__(self, guid: Guid) -> None:
        self.guid = guid
        self.last_sn = 0
        self.latest: CacheChange | None = None

    def new_change(
        self, kind: ChangeKind, payload: bytes, source_timestamp: int, *, key_hash: bytes = b""
    ) -> CacheChange:
        """Replace what is sent.  The sequence number ascends only when the content changes (RTPS 2.5 §8.5.3.3.2)."""
        self.last_sn += 1
        self.latest = CacheChange(kind, self.guid, self.last_sn, payload, key_hash, source_timestamp, key_hash=key_hash)
        return self.latest
