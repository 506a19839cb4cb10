"""A participant that was discovered, as security sees it: how far it is trusted, and what is known of it by now."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum

from ddsi.structure.discovered import DiscoveredParticipantData
from ddsi.structure.guid import Guid

from .generic_message import GenericMessage
from .handles import ParticipantCryptoHandle, PermissionsHandle, SharedSecretHandle
from .handshake import Handshake

__all__ = ["RemoteParticipant", "Standing"]


class Standing(Enum):
    """What a remote participant may do."""

    UNAUTHENTICATED = "has no identity; governance admits such participants to what is not protected"
    PENDING = "is being authenticated"
    ADMITTED = "is authenticated, and its permissions let it join"
    REFUSED = "may do nothing"


@dataclass(slots=True)
class RemoteParticipant:
    """``renewal``: another handshake, that will take the first one's place: the peer has lost what it knew of us.
    Whoever says so cannot prove it, so the next one is not begun before ``next_renewal``, in engine seconds.

    ``keys_digest``: of the peer's participant key; after a renewal (``is_renewed``) another one shows that it has
    started again under the same Guid.

    ``early``: key messages for endpoints of ours that are not matched yet, by (local, remote), oldest first.
    """

    data: DiscoveredParticipantData
    standing: Standing
    reason: str = ""
    handshake: Handshake | None = None
    renewal: Handshake | None = None
    next_renewal: float = 0.0
    renewal_pause_s: float = 1.0
    permissions: PermissionsHandle | None = None
    shared_secret: SharedSecretHandle | None = None
    crypto: ParticipantCryptoHandle | None = None
    has_keys: bool = False
    keys_digest: bytes = b""
    is_renewed: bool = False
    early: dict[tuple[Guid, Guid], tuple[GenericMessage, float]] = field(default_factory=dict)

    @property
    def guid(self) -> Guid:
        return self.data.guid
