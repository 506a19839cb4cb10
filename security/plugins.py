"""The OMG's Service Plugin Interfaces as protocols: what a third party implements to replace one plugin.

DDS-Security 1.1 §8.3 (Authentication), §8.4 (AccessControl), §8.5 (Cryptographic), §8.6 (Logging), §8.7 (DataTagging).
Operations bear the OMG's names in snake case.  What differs from its IDL, everywhere alike:

* what the OMG returns through ``inout`` parameters is returned; only encoders append to the caller's buffer;
* there is no ``SecurityException`` parameter: a local mistake is raised (ConfigurationError, NotAllowedBySecurity), and
  whatever a peer can bring about is a value - :class:`Refused`, or a decode outcome - because a peer's fault is no
  exception;
* ``VALIDATION_PENDING_RETRY`` is :class:`Pending`, with the work to be done meanwhile;
* the ``return_`` operations remain only where what is returned may hold secrets, which are then to be wiped.

A plugin belongs to one participant.  It takes neither time nor entropy for itself: its factory is given
``entropy(n) -> n octets`` and ``wall_clock() -> nanoseconds since 1970``.  All calls come from one thread, but for the
jobs of :class:`Pending`, which run in another and must touch nothing that is shared.
"""

from __future__ import annotations

from .access_control_plugin import AccessControl, AccessControlListener, ReaderAdmission
from .authentication_plugin import (
    Authentication,
    AuthenticationListener,
    AuthStatusKind,
    HandshakeStep,
    LocalIdentity,
    RemoteIdentity,
    ValidationResult,
)
from .crypto_key_plugins import CryptoKeyExchange, CryptoKeyFactory
from .crypto_transform_plugin import CryptoTransform, SecureSubmessage, SecureSubmessageCategory
from .handles import (
    DatareaderCryptoHandle,
    DatawriterCryptoHandle,
    HandshakeHandle,
    IdentityHandle,
    ParticipantCryptoHandle,
    Pending,
    PermissionsHandle,
    SharedSecretHandle,
)
from .logging_plugin import DataTagging, Logging, LoggingListener, LogLevel, LogOptions

__all__ = [
    "AccessControl",
    "AccessControlListener",
    "AuthStatusKind",
    "Authentication",
    "AuthenticationListener",
    "CryptoKeyExchange",
    "CryptoKeyFactory",
    "CryptoTransform",
    "DataTagging",
    "DatareaderCryptoHandle",
    "DatawriterCryptoHandle",
    "HandshakeHandle",
    "HandshakeStep",
    "IdentityHandle",
    "LocalIdentity",
    "LogLevel",
    "LogOptions",
    "Logging",
    "LoggingListener",
    "ParticipantCryptoHandle",
    "Pending",
    "PermissionsHandle",
    "ReaderAdmission",
    "RemoteIdentity",
    "SecureSubmessage",
    "SecureSubmessageCategory",
    "SharedSecretHandle",
    "ValidationResult",
]
