"""The errors that users meet, and the ones that hostile or broken octets cause inside.

Whose fault is it?  Everything under :class:`DdsError` is for the application.  :class:`MalformedMessage`
is a peer's fault; it is caught in one place in the engine, counted, and never reaches the application.
"""

from __future__ import annotations

__all__ = [
    "AlreadyDeleted",
    "BadParameter",
    "ConfigurationError",
    "DdsError",
    "DdsTimeout",
    "ImmutablePolicy",
    "InconsistentPolicy",
    "MalformedMessage",
    "MalformedSample",
    "NotAllowedBySecurity",
    "OutOfResources",
    "PreconditionNotMet",
]


class DdsError(Exception):
    """The base of all errors that ``ddsi`` raises to an application."""


class NotAllowedBySecurity(DdsError):
    """Governance or permissions forbid what was asked (DDS-Security 1.1 §7.3.22, NOT_ALLOWED_BY_SECURITY)."""


class InconsistentPolicy(DdsError):
    """Two QoS policies of one entity contradict each other (DDS 1.4 §2.2.3, INCONSISTENT_POLICY)."""


class ImmutablePolicy(DdsError):
    """A policy that is fixed once the entity is enabled was to be changed (DDS 1.4, IMMUTABLE_POLICY)."""


class PreconditionNotMet(DdsError):
    """The operation does not fit the entity's state (DDS 1.4, PRECONDITION_NOT_MET)."""


class OutOfResources(DdsError):
    """A resource limit, the system's or one set by QoS, does not allow it (DDS 1.4, OUT_OF_RESOURCES)."""


class DdsTimeout(DdsError, TimeoutError):
    """What was waited for did not happen in the time allowed (DDS 1.4, TIMEOUT)."""


class AlreadyDeleted(DdsError):
    """The entity was closed before (DDS 1.4, ALREADY_DELETED)."""


class BadParameter(DdsError, ValueError):
    """An argument that cannot be meant (DDS 1.4, BAD_PARAMETER)."""


class ConfigurationError(DdsError):
    """The configuration, by ``Config`` or ``DDSI_URI``, cannot be used; the text says which part and why."""


class MalformedSample(DdsError):
    """Octets that are not a sample of the type they were said to be.

    ``path`` is the member that was being read, as in ``pose.path[3].x``, and empty for the sample as a whole;
    ``offset`` the octet in the payload, counted from its encapsulation header, and -1 where none is to blame.
    """

    def __init__(self, reason: str, *, path: str = "", offset: int = -1) -> None:
        super().__init__(reason)
        self.path = path
        self.offset = offset


class MalformedMessage(Exception):
    """Octets from the network that break the RTPS grammar.  Raised by parsers only; never leaves the engine.

    ``offset`` is where in the datagram (or the part of it that the parser was given), ``element`` what
    was being read.
    """

    def __init__(self, reason: str, *, element: str = "", offset: int = -1) -> None:
        super().__init__(reason)
        self.reason = reason
        self.element = element
        self.offset = offset

    def __str__(self) -> str:
        where = f" at octet {self.offset}" if self.offset >= 0 else ""
        return f"{self.element}{where}: {self.reason}" if self.element else f"{self.reason}{where}"
