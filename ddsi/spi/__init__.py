"""The seam to security: the hooks that the core calls, their outcomes, the plain ones, and the loader."""

from .hooks import (
    Announcement,
    Compute,
    Decided,
    HookEffect,
    LocalParticipant,
    Octets,
    Parts,
    ProtectedEndpoint,
    SecurityHooks,
    SendMessage,
)
from .loader import SECURITY_PROPERTY_PREFIX, SPI_VERSION, load_hooks
from .outcomes import (
    ADMITTED,
    NO_OVERHEAD,
    NOT_FOR_US,
    PENDING,
    Admission,
    NoKeys,
    NotForUs,
    Outcome,
    Overhead,
    Refused,
    Rejected,
)
from .plaintext import PLAINTEXT, Plaintext

__all__ = [
    "ADMITTED",
    "NOT_FOR_US",
    "NO_OVERHEAD",
    "PENDING",
    "PLAINTEXT",
    "SECURITY_PROPERTY_PREFIX",
    "SPI_VERSION",
    "Admission",
    "Announcement",
    "Compute",
    "Decided",
    "HookEffect",
    "LocalParticipant",
    "NoKeys",
    "NotForUs",
    "Octets",
    "Outcome",
    "Overhead",
    "Parts",
    "Plaintext",
    "ProtectedEndpoint",
    "Refused",
    "Rejected",
    "SecurityHooks",
    "SendMessage",
    "load_hooks",
]
