"""PLAINTEXT: the hooks of a participant without security.

The shortest description of what each hook may return; everybody is admitted, nothing is transformed.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from ..structure.cache_change import CacheChange
from ..structure.discovered import DiscoveredParticipantData, DiscoveredReaderData, DiscoveredWriterData
from ..structure.guid import Guid
from ..structure.security_information import EndpointSecurity, ParticipantSecurity
from .hooks import Announcement, Compute, HookEffect, LocalParticipant, Octets, Parts, ProtectedEndpoint
from .outcomes import ADMITTED, NO_OVERHEAD, NOT_FOR_US, Admission, Outcome, Overhead

__all__ = ["PLAINTEXT", "Plaintext"]

_NO_ANNOUNCEMENT = Announcement()
_UNPROTECTED = ProtectedEndpoint()
_NO_IDENTITY = ParticipantSecurity()
_NO_SECURITY = EndpointSecurity()


class Plaintext:
    """Implements :class:`ddsi.spi.SecurityHooks` by letting everything pass as it is.  It has no state."""

    __slots__ = ()

    def local_participant(self, candidate: LocalParticipant) -> Guid:
        return candidate.guid

    def announcement(self) -> Announcement:
        return _NO_ANNOUNCEMENT

    def announced(self, parameters: bytes) -> None:
        """Nobody is told by other means."""

    def local_writer(self, data: DiscoveredWriterData) -> ProtectedEndpoint:
        return _UNPROTECTED

    def local_reader(self, data: DiscoveredReaderData) -> ProtectedEndpoint:
        return _UNPROTECTED

    def local_endpoint_changed(self, data: DiscoveredWriterData | DiscoveredReaderData) -> ProtectedEndpoint:
        return _UNPROTECTED

    def local_endpoint_deleted(self, guid: Guid) -> None:
        """Nothing was kept."""

    def remote_participant(self, data: DiscoveredParticipantData, now: float) -> Admission:
        return ADMITTED

    def remote_participant_changed(self, data: DiscoveredParticipantData, now: float) -> Admission:
        return ADMITTED

    def remote_participant_lost(self, guid: Guid) -> None:
        """Nothing was kept."""

    def admits_announcement(self, data: DiscoveredWriterData | DiscoveredReaderData, *, is_secure: bool) -> bool:
        return True

    def match(self, local: Guid, remote: DiscoveredWriterData | DiscoveredReaderData) -> Admission:
        return ADMITTED

    def unmatch(self, local: Guid, remote: Guid) -> None:
        """Nothing was kept."""

    def remote_endpoint_lost(self, guid: Guid) -> None:
        """Nothing was kept."""

    def local_participant_deleted(self) -> None:
        """Nothing was kept."""

    def participant_security(self, participant: Guid) -> ParticipantSecurity:
        return _NO_IDENTITY

    def endpoint_security(self, endpoint: DiscoveredWriterData | DiscoveredReaderData) -> EndpointSecurity:
        return _NO_SECURITY

    def receive_message(self, change: CacheChange, now: float) -> None:
        """The endpoints of generic messages are not announced, so none comes."""

    def computed(self, effect: Compute, result: object, now: float) -> None:
        """Nothing was asked."""

    def handle_timeout(self, now: float) -> None:
        """No timer was asked for."""

    def next_deadline(self) -> float:
        return math.inf

    def drain_effects(self) -> Sequence[HookEffect]:
        return ()

    def overhead(self, sender: Guid, receivers: tuple[Guid, ...]) -> Overhead:
        return NO_OVERHEAD

    def encode_payload(self, writer: Guid, payload: Octets) -> Octets:
        return payload

    def encode_submessage(self, sender: Guid, receivers: tuple[Guid, ...], submessage: Parts) -> Parts:
        return submessage

    def encode_message(self, receivers: tuple[Guid, ...], message: Parts) -> Parts:
        return message

    def decode_message(self, message: Octets, source: bytes) -> Octets | Outcome:
        return NOT_FOR_US  # protected: we have no keys, so it cannot be meant for us

    def decode_submessage(self, protected: Octets, source: bytes) -> Octets | Outcome:
        return NOT_FOR_US

    def open_envelope(self, message: memoryview, start: int, end: int, source: bytes) -> tuple[Octets, int] | None:
        return None

    def decode_payload(self, writer: Guid, payload: Octets, place: memoryview | None = None) -> Octets | Outcome:
        return payload

    def protects_payload(self, writer: Guid) -> bool:
        return False

    def opens_after_joining(self, reader: Guid) -> bool:
        return False

    def admits(self, sender: bytes, protection: int) -> bool:
        return True


PLAINTEXT = Plaintext()
