"""What plugins hand out: handles, which only they look into, and work that takes longer than a call may."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import field
from typing import Generic, TypeVar

from ddsi.structure.dataclass import dataclass

__all__ = [
    "DatareaderCryptoHandle",
    "DatawriterCryptoHandle",
    "HandshakeHandle",
    "IdentityHandle",
    "ParticipantCryptoHandle",
    "Pending",
    "PermissionsHandle",
    "SharedSecretHandle",
]

T = TypeVar("T")


class IdentityHandle:
    """An identity that was validated, local or remote (§8.3.2).  A plugin derives from it what it needs to keep."""

    __slots__ = ()


class HandshakeHandle:
    """A handshake under way (§8.3.2)."""

    __slots__ = ()


class SharedSecretHandle:
    """What both sides of a handshake know and nobody else does (§8.3.2.5).  No repr of it shows a secret.

    The one handle whose content is laid down (§9.3.2.5.3), as key factory and authentication may come from two hands:
    ``challenge1`` of the initiator, ``challenge2`` of the replier, and the secret, the hash of what they agreed on.
    ``is_replier``: we answered the handshake, so ours is the higher Guid of the two.
    """

    __slots__ = ("_secret", "challenge1", "challenge2", "is_replier")

    def __init__(self, challenge1: bytes, challenge2: bytes, shared_secret: bytes, *, is_replier: bool) -> None:
        self.challenge1 = challenge1
        self.challenge2 = challenge2
        self.is_replier = is_replier
        self._secret = bytearray(shared_secret)

    @property
    def shared_secret(self) -> bytes:
        """Empty once it was wiped."""
        return bytes(self._secret)

    def wipe(self) -> None:
        self._secret[:] = bytes(len(self._secret))
        self._secret.clear()

    def __repr__(self) -> str:
        return f"<SharedSecretHandle of the {'replier' if self.is_replier else 'initiator'}>"


class PermissionsHandle:
    """What a participant may do (§8.4.2.3)."""

    __slots__ = ()


class ParticipantCryptoHandle:
    """The keys of a participant, or those shared with a remote one (§8.5.1.2)."""

    __slots__ = ()


class DatawriterCryptoHandle:
    """The keys of a writer, local or remote (§8.5.1.3)."""

    __slots__ = ()


class DatareaderCryptoHandle:
    """The keys of a reader, local or remote (§8.5.1.4)."""

    __slots__ = ()


@dataclass(frozen=True, slots=True)
class Pending(Generic[T]):
    """Slow work, some milliseconds or more: a chain to verify, a token to ask.  Never on the way of data.

    The caller runs ``job`` in a worker thread, whatever the job returns stands in the place of this result, and is
    dropped if meanwhile the peer is gone.  The job must raise nothing that the operation itself would not.
    """

    job: Callable[[], T] = field(repr=False)
