"""CacheChange: one change to one instance, as writers keep it and readers receive it.  RTPS 2.5 §8.2.6."""

from __future__ import annotations

from enum import IntEnum, IntFlag

from .coherence import Coherence
from .guid import GUID_UNKNOWN, Guid

__all__ = ["CacheChange", "ChangeKind", "StatusInfo"]


class StatusInfo(IntFlag):
    """The last octet of PID_STATUS_INFO.  RTPS 2.5 §9.6.4.9."""

    DISPOSED = 1
    UNREGISTERED = 2
    FILTERED = 4


class ChangeKind(IntEnum):
    """What happened to the instance; the number is the StatusInfo that says so on the wire."""

    ALIVE = 0
    NOT_ALIVE_DISPOSED = 1
    NOT_ALIVE_UNREGISTERED = 2
    NOT_ALIVE_DISPOSED_UNREGISTERED = 3


class CacheChange:
    """One change.  A plain slotted class, as tens of thousands are made in a second.

    ``payload`` is the SerializedPayload with its encapsulation header: of the whole sample when ``kind``
    is ALIVE, else of the key alone, or empty where only ``key_hash`` names the instance.
    ``key`` is the instance's key in the canonical form (see ``xtypes``), empty for keyless topics.
    ``source_timestamp`` counts ticks (2^-32 s since 1970).  ``destination`` is the participant or reader that
    the change is meant for, GUID_UNKNOWN for everybody (the filtered path; DDS-Security 1.1 §7.4.4.4).
    ``fragment_octets`` is how large its writer cuts the fragments of a change that is too large for one message; it
    stays so, whatever size newer changes get.  ``related`` is who and which sample this one answers:
    PID_RELATED_SAMPLE_IDENTITY's (Guid, number).  ``sealed`` is the payload as it was protected in one piece, for those
    readers that join fragments first: all its fragments must be of one and the same protection.  ``coherence`` is its
    place in a coherent set and in its publisher's order, where it has one.
    """

    __slots__ = (
        "coherence",
        "destination",
        "expiry",
        "fragment_octets",
        "key",
        "key_hash",
        "kind",
        "original",
        "payload",
        "related",
        "sealed",
        "sequence_number",
        "source_timestamp",
        "verdicts",
        "writer_guid",
    )

    def __init__(
        self,
        kind: ChangeKind,
        writer_guid: Guid,
        sequence_number: int,
        payload: bytes | bytearray | memoryview,
        key: bytes = b"",
        source_timestamp: int = 0,
        *,
        key_hash: bytes = b"",
        destination: Guid = GUID_UNKNOWN,
        related: tuple[Guid, int] | None = None,
        expiry: float = float("inf"),
        coherence: Coherence | None = None,
    ) -> None:
        self.kind = kind
        self.writer_guid = writer_guid
        self.sequence_number = sequence_number
        self.payload = payload
        self.key = key
        self.source_timestamp = source_timestamp
        self.key_hash = key_hash
        self.destination = destination
        self.related = related
        # Of a change that a persistence service hands on: whose it was, and its number there.
        self.original: tuple[Guid, int] | None = None
        self.expiry = expiry
        self.coherence = coherence
        self.fragment_octets = 0
        self.sealed: bytes | bytearray | memoryview | None = None
        # What content filters say of it, by their signatures: found out here, or told by its writer.
        self.verdicts: dict[bytes, bool] | None = None

    @property
    def is_end_of_set(self) -> bool:
        """Is it no sample, but the end of its writer's part in a coherent set?"""
        return self.coherence is not None and self.coherence.is_end

    def __repr__(self) -> str:
        return f"<CacheChange {self.kind.name} {self.writer_guid}#{self.sequence_number}, {len(self.payload)} octets>"
