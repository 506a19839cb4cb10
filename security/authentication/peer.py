"""Peer: who shows these credentials, and by what it is judged.  DDS-Security 1.1 §9.3.2.5, §9.3.4.

Values only, so that certificates can be verified in a worker thread.
"""

from __future__ import annotations

from dataclasses import field

from ddsi.structure.dataclass import dataclass
from ddsi.structure.guid import Guid

from ..tokens import IdentityToken
from .adjusted_guid import subject_octets
from .algorithms import signature_algorithm_named
from .certificate import Certificate
from .handshake_tokens import Credentials
from .not_trusted import NotTrusted
from .participant_data import ParticipantData
from .trust_anchors import TrustAnchors

__all__ = ["Expected", "Peer"]


@dataclass(frozen=True, slots=True)
class Peer:
    """``valid_until``: when its certificate, or that of its CA, expires, in nanoseconds since 1970."""

    certificate: Certificate
    valid_until: int
    credentials: Credentials


@dataclass(frozen=True, slots=True)
class Expected:
    """What is known of a participant before it proves itself, and whom we believe, at one moment.

    ``challenge``: the one that it promised, None if it promised none.  ``certificate``: the one that it proved itself
    with before and may not change, None if it never did.
    """

    guid: Guid
    identity_token: IdentityToken
    challenge: bytes | None = field(repr=False)
    certificate: Certificate | None
    anchors: TrustAnchors
    now: int

    def peer(self, theirs: Credentials) -> Peer:
        """The owner of these credentials, if its certificate is good and the participant its own.  Slow.

        A captured certificate does not help another participant: the Guid in its participant data must be the one that
        it was discovered under, and belong to the certificate's subject.  That the certificate's owner speaks, only a
        signature proves.  Raises NotTrusted.
        """
        certificate = Certificate.from_pem(theirs.c_id)
        authority = self.anchors.verify(certificate, self.now)
        # Which algorithm it is, the certificate's key alone decides: Fast DDS (2.9) names here the one of its CA's key.
        if signature_algorithm_named(theirs.c_dsign_algo) is None:
            raise NotTrusted(
                f"it says to sign by {theirs.c_dsign_algo[:64]!r}, which is not known; "
                f"its certificate's key is {certificate.algorithm.key}"
            )
        announced = ParticipantData.read(theirs.c_pdata)
        if announced.guid != self.guid:
            raise NotTrusted("the Guid in its participant data (c.pdata) is not the one that it announces")
        if announced.identity_token not in (None, self.identity_token):
            raise NotTrusted("the identity token in its participant data (c.pdata) is not the one that it announces")
        owned = subject_octets(certificate.subject_der)
        if not self.guid.startswith(owned):
            raise NotTrusted(
                f"its Guid does not belong to {certificate.subject}: it would begin with {owned.hex()}, "
                f"and not with {self.guid[: len(owned)].hex()}"
            )
        if self.certificate is not None and self.certificate != certificate:
            raise NotTrusted("it shows another certificate than before")
        return Peer(certificate, min(certificate.valid_until, authority.valid_until), theirs)
