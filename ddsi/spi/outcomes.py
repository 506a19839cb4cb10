"""What the security hooks may answer.  Refusals and undecodable octets are values, not exceptions.

DDS-Security 1.1 §8.5.1.9 (crypto transform).  Not to find a key is normal under multicast, and what is
protected for somebody else is no error at all; so each case has a name and dropping needs no ``except``.
"""

from __future__ import annotations

from enum import Enum, IntFlag

from ..structure.dataclass import dataclass

__all__ = [
    "ADMITTED",
    "NOT_FOR_US",
    "NO_OVERHEAD",
    "PENDING",
    "Admission",
    "NoKeys",
    "NotForUs",
    "Outcome",
    "Overhead",
    "Protection",
    "Refused",
    "Rejected",
]


class Protection(IntFlag):
    """How a submessage arrived: inside a protected message, inside a SEC_ envelope of its own, both, or in clear."""

    NONE = 0
    MESSAGE = 1
    SUBMESSAGE = 2


class _Verdict(Enum):
    """Answers to "may this remote participant, or this pair of endpoints, go on?"."""

    ADMITTED = "admitted"
    PENDING = "pending"  # ask nothing more: a hook effect tells when it is decided


ADMITTED = _Verdict.ADMITTED
PENDING = _Verdict.PENDING


@dataclass(frozen=True, slots=True)
class Refused:
    """No, for a reason that a person can act on.  The reason stays here; the peer is not told."""

    reason: str


Admission = _Verdict | Refused


@dataclass(frozen=True, slots=True)
class Outcome:
    """Why octets could not be decoded; one of the classes below."""


@dataclass(frozen=True, slots=True)
class NotForUs(Outcome):
    """Protected for another participant: skipped in silence."""


@dataclass(frozen=True, slots=True)
class NoKeys(Outcome):
    """The key with this identifier has not arrived (yet)."""

    key_id: bytes


@dataclass(frozen=True, slots=True)
class Rejected(Outcome):
    """The octets were tampered with, replayed or malformed."""

    reason: str


NOT_FOR_US = NotForUs()


@dataclass(frozen=True, slots=True)
class Overhead:
    """How many octets protection adds at most, at each level; the packer leaves room for them."""

    payload: int = 0
    submessage: int = 0
    message: int = 0


NO_OVERHEAD = Overhead()
