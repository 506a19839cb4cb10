"""A participant that was discovered, as security sees it: how far it is trusted, and what is known of it by now."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from enum import Enum

from ddsi.structure.cache_change import CacheChange
from ddsi.structure.discovered import DiscoveredParticipantData, Parameter
from ddsi.structure.guid import Guid

from .generic_message import GenericMessage
from .handles import ParticipantCryptoHandle, PermissionsHandle, SharedSecretHandle
from .handshake import Handshake, Send

__all__ = ["RemoteParticipant", "Standing"]


class Standing(Enum):
    """What a remote participant may do."""

    UNAUTHENTICATED = "has no identity; governance admits such participants to what is not protected"
    PENDING = "is being authenticated"
    ADMITTED = "is authenticated, and its permissions let it join"
    REFUSED = "may do nothing"


@dataclass(slots=True)
class RemoteParticipant:
    """``opened`` counts what was opened with its keys; ``due`` is when one of its handshakes wants to be called.

    ``renewal``: another handshake, that will take the first one's place, as the peer has lost what it knew of us.  Who
    says so in its name cannot prove it: ``renewal_asked`` is when that was said first, and what ``opened`` was then.

    ``said``: the last handshake message of one that waits for its turn.

    ``posted``: the last handshake message to it, and the change that carried it.

    ``vouched``: what it announced of its security, in the words that it signed.

    ``early``: key messages for endpoints of ours that are not matched yet, by (local, remote), oldest first.
    """

    data: DiscoveredParticipantData
    standing: Standing
    reason: str = ""
    handshake: Handshake | None = None
    renewal: Handshake | None = None
    renewal_asked: tuple[float, int] | None = None
    vouched: tuple[Parameter, ...] = ()
    said: GenericMessage | None = None
    posted: tuple[Send, CacheChange] | None = None
    permissions: PermissionsHandle | None = None
    shared_secret: SharedSecretHandle | None = None
    crypto: ParticipantCryptoHandle | None = None
    has_keys: bool = False
    opened: int = 0
    due: float = math.inf
    early: dict[tuple[Guid, Guid], tuple[GenericMessage, float]] = field(default_factory=dict)

    @property
    def guid(self) -> Guid:
        return self.data.guid

    @property
    def unfinished(self) -> Handshake | None:
        """The handshake that still has to be done, of the two that there may be."""
        for handshake in (self.renewal, self.handshake):
            if handshake is not None and not handshake.is_done:
                return handshake
        return None
