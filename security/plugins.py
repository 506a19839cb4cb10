"""The OMG's Service Plugin Interfaces as protocols: what a third party implements to replace one plugin.

DDS-Security 1.1 §8.3 (Authentication), §8.4 (AccessControl), §8.5 (Cryptographic), §8.6 (Logging), §8.7 (DataTagging).
Operations bear the OMG's names in snake case.  What differs from its IDL, everywhere alike:

* what the OMG returns through ``inout`` parameters is returned; the one that is left, ``extra_inline_qos``, must stay
  empty: see :meth:`CryptoTransform.encode_serialized_payload`;
* there is no ``SecurityException`` parameter: a local mistake is raised (ConfigurationError, NotAllowedBySecurity), and
  whatever a peer can bring about is a value - :class:`Refused`, or a decode outcome - because a peer's fault is no
  exception;
* ``VALIDATION_PENDING_RETRY`` is :class:`Pending`, with the work to be done meanwhile;
* the ``return_`` operations remain only where what is returned may hold secrets, which are then to be wiped.

A plugin belongs to one participant.  It takes neither time nor entropy for itself: its :class:`PluginFactory` is given
``entropy(n) -> n octets`` and ``wall_clock() -> nanoseconds since 1970``.  All calls come from one thread, but for the
jobs of :class:`Pending`, which run in another and must touch nothing that is shared.  How one is chosen, and what is
checked before it is used: :mod:`ddsi_security.loading`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, Protocol, TypeVar

from ddsi.structure.qos_policies import Properties

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
from .logging_plugin import BuiltinLoggingTypeV2, DataTagging, Logging, LoggingListener, LogLevel, LogOptions

__all__ = [
    "PLUGIN_VERSION",
    "AccessControl",
    "AccessControlListener",
    "AuthStatusKind",
    "Authentication",
    "AuthenticationListener",
    "BuiltinLoggingTypeV2",
    "CryptoKeyExchange",
    "CryptoKeyFactory",
    "CryptoTransform",
    "Cryptographic",
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
    "PluginFactory",
    "ReaderAdmission",
    "RemoteIdentity",
    "SecureSubmessage",
    "SecureSubmessageCategory",
    "SharedSecretHandle",
    "ValidationResult",
]

PLUGIN_VERSION: Final = 1
"""Raised whenever an interface changes incompatibly.  A plugin, or its factory, bears the version that it is written
for as ``plugin_version``, a number and not this name: else it would claim to fit whatever is installed."""

P_co = TypeVar("P_co", covariant=True)


class PluginFactory(Protocol[P_co]):
    """What the property of a plugin names: a class, or a function."""

    def __call__(
        self, properties: Properties, *, entropy: Callable[[int], bytes], wall_clock: Callable[[], int]
    ) -> P_co:
        """The plugin of a participant with these properties.  Raises ConfigurationError for those it cannot use."""
        ...


class Cryptographic(CryptoKeyFactory, CryptoKeyExchange, CryptoTransform, Protocol):
    """The three interfaces of §8.5, which share their keys and so are one plugin."""
