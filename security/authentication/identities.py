"""What this plugin keeps behind its identity handles: ours, and each remote one that asks to be believed.

DDS-Security 1.1 §8.3.2.1 (IdentityHandle).  Only the caller's thread changes them; jobs are given what they need.
"""

from __future__ import annotations

from typing import Final

from ddsi.structure.guid import Guid
from ddsi.structure.vendor import VendorId

from ..handles import IdentityHandle
from ..tokens import IdentityToken
from .certificate import Certificate
from .identity_material import IdentityMaterial
from .peer import Expected, Peer
from .signatures import PrivateKey
from .trust_anchors import TrustAnchors

__all__ = ["LocalIdentityHandle", "RemoteIdentityHandle"]


class LocalIdentityHandle(IdentityHandle):
    """Who we are.  ``credential`` is the signed permissions document that goes to peers as ``c.perm``.

    ``peers`` are the remote identities in use.  A participant has more than one while it authenticates anew.
    """

    __slots__ = ("anchors", "certificate", "credential", "guid", "identity_token", "key", "peers", "pem", "valid_until")

    def __init__(self, guid: Guid, material: IdentityMaterial, identity_token: IdentityToken) -> None:
        self.guid: Final = guid
        self.certificate: Final[Certificate] = material.certificate
        self.pem: Final = material.certificate.pem
        self.key: Final[PrivateKey] = material.key
        self.anchors: Final[TrustAnchors] = material.anchors
        self.identity_token: Final = identity_token
        self.valid_until: Final = min(material.certificate.valid_until, material.authority.valid_until)
        self.credential = b""
        self.peers: Final[dict[Guid, list[RemoteIdentityHandle]]] = {}

    def add(self, remote: RemoteIdentityHandle) -> None:
        self.peers.setdefault(remote.guid, []).append(remote)

    def discard(self, remote: RemoteIdentityHandle) -> None:
        handles = self.peers.get(remote.guid, [])
        if remote in handles:
            handles.remove(remote)
        if not handles:
            self.peers.pop(remote.guid, None)

    def certificate_of(self, guid: Guid) -> Certificate | None:
        """What a participant proved itself with; None if it never did."""
        proven = (remote.peer for remote in self.peers.get(guid, ()) if remote.peer is not None)
        return next((peer.certificate for peer in proven), None)

    def __repr__(self) -> str:
        return f"<LocalIdentityHandle {self.certificate.subject} {self.guid}>"


class RemoteIdentityHandle(IdentityHandle):
    """Who somebody says it is; with a ``peer``, it was proven.

    ``our_challenge`` is the future challenge that we promised, None if we promised none; ``its_challenge`` that of the
    peer.  Who saw the first message can so be told from who did not (§8.3.2.11.3).
    """

    __slots__ = ("guid", "identity_token", "its_challenge", "local", "our_challenge", "peer", "vendor_id")

    def __init__(
        self,
        local: LocalIdentityHandle,
        guid: Guid,
        identity_token: IdentityToken,
        vendor_id: VendorId | None,
        *,
        our_challenge: bytes | None,
        its_challenge: bytes | None,
    ) -> None:
        self.local: Final = local
        self.guid: Final = guid
        self.identity_token: Final = identity_token
        self.vendor_id: Final = vendor_id
        self.our_challenge: Final = our_challenge
        self.its_challenge: Final = its_challenge
        self.peer: Peer | None = None

    def expected(self, now: int) -> Expected:
        known = self.local.certificate_of(self.guid)
        return Expected(self.guid, self.identity_token, self.its_challenge, known, self.local.anchors, now)

    def __repr__(self) -> str:
        name = self.peer.certificate.subject if self.peer else "not authenticated"
        return f"<RemoteIdentityHandle {name} {self.guid}>"
