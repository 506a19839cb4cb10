"""The participant properties that configure security, under their OMG names.

DDS-Security 1.1 §9.3.1 (authentication), §9.4.1 (access control), §9.5.1 (cryptography), §9.6 (logging).  Other stacks
spell some of them otherwise; their spellings are translated here, so that a configuration written for them serves.
What the values mean, the plugins know.
"""

from __future__ import annotations

import difflib
from typing import Final

from ddsi.spi import SECURITY_PROPERTY_PREFIX
from ddsi.structure.errors import ConfigurationError
from ddsi.structure.qos_policies import BinaryProperty, Properties, Property

from .resources import resource_name

__all__ = [
    "ACCESS_PLUGIN",
    "AUTH_PLUGIN",
    "BUILTIN_ENDPOINT_NAME",
    "CRYPTO_PLUGIN",
    "GOVERNANCE",
    "HANDSHAKE_LIMIT",
    "IDENTITY_CA",
    "IDENTITY_CERTIFICATE",
    "IDENTITY_CRL",
    "KEY_SIZE",
    "LOG_DISTRIBUTE",
    "LOG_FILE",
    "LOG_LEVEL",
    "LOG_PLUGIN",
    "MAX_BLOCKS_PER_SESSION",
    "PASSWORD",
    "PERMISSIONS",
    "PERMISSIONS_CA",
    "PRIVATE_KEY",
    "TRUSTED_CA_DIR",
    "security_properties",
]

IDENTITY_CA: Final = "dds.sec.auth.identity_ca"
IDENTITY_CERTIFICATE: Final = "dds.sec.auth.identity_certificate"
PRIVATE_KEY: Final = "dds.sec.auth.private_key"
PASSWORD: Final = "dds.sec.auth.password"
IDENTITY_CRL: Final = "dds.sec.auth.crl"
TRUSTED_CA_DIR: Final = "dds.sec.auth.trusted_ca_dir"
HANDSHAKE_LIMIT: Final = "dds.sec.auth.max_handshakes"
PERMISSIONS_CA: Final = "dds.sec.access.permissions_ca"
GOVERNANCE: Final = "dds.sec.access.governance"
PERMISSIONS: Final = "dds.sec.access.permissions"
KEY_SIZE: Final = "dds.sec.crypto.keysize"
MAX_BLOCKS_PER_SESSION: Final = "dds.sec.crypto.maxblockspersession"
LOG_LEVEL: Final = "dds.sec.log.log_level"
LOG_FILE: Final = "dds.sec.log.log_file"
LOG_DISTRIBUTE: Final = "dds.sec.log.distribute"

# Which plugin: "builtin", the name of an entry point, or "module:factory".
AUTH_PLUGIN: Final = "dds.sec.auth.plugin"
ACCESS_PLUGIN: Final = "dds.sec.access.plugin"
CRYPTO_PLUGIN: Final = "dds.sec.crypto.plugin"
LOG_PLUGIN: Final = "dds.sec.log.plugin"

BUILTIN_ENDPOINT_NAME: Final = "dds.sec.builtin_endpoint_name"
"""Given by the service with each builtin endpoint that it registers; never by a user (§8.8.8.1)."""

_NAMES: Final = (
    *(IDENTITY_CA, IDENTITY_CERTIFICATE, PRIVATE_KEY, PASSWORD, IDENTITY_CRL, TRUSTED_CA_DIR, HANDSHAKE_LIMIT),
    *(PERMISSIONS_CA, GOVERNANCE, PERMISSIONS),
    *(KEY_SIZE, MAX_BLOCKS_PER_SESSION),
    *(LOG_LEVEL, LOG_FILE, LOG_DISTRIBUTE),
    *(AUTH_PLUGIN, ACCESS_PLUGIN, CRYPTO_PLUGIN, LOG_PLUGIN),
)

# Prefixes, then single names, of other stacks and what they are here.
_FAST_DDS_PREFIXES: Final = {
    "dds.sec.auth.builtin.PKI-DH.": "dds.sec.auth.",
    "dds.sec.access.builtin.Access-Permissions.": "dds.sec.access.",
    "dds.sec.crypto.builtin.AES-GCM-GMAC.": "dds.sec.crypto.",
    "dds.sec.log.builtin.DDS_LogTopic.": "dds.sec.log.",
}
_SPELLINGS: Final = {
    "org.eclipse.cyclonedds.sec.auth.crl": IDENTITY_CRL,
    "org.eclipse.cyclonedds.sec.auth.trusted_ca_dir": TRUSTED_CA_DIR,
    "dds.sec.auth.identity_crl": IDENTITY_CRL,
    "dds.sec.log.logging_level": LOG_LEVEL,
}

# They name shared libraries, or tune what is ours to decide: a configuration shared with other stacks may hold them.
_IGNORED: Final = frozenset(
    [
        f"dds.sec.{plugin}.library.{part}"
        for plugin in ("auth", "access", "crypto")
        for part in ("path", "init", "finalize")
    ]
    + [
        "dds.sec.auth.preferred_key_agreement",
        "dds.sec.auth.key_establishment_algorithm",
        "dds.sec.auth.transmit_algorithms_as_legacy",
        "dds.sec.auth.max_handshake_requests",
        "dds.sec.auth.initial_handshake_resend_period",
        "dds.sec.auth.handshake_resend_period_gain",
    ]
)


def security_properties(properties: Properties) -> dict[str, str]:
    """The values of all security properties by their OMG names; what other stacks alone understand is left out.

    Properties of a third party's plugin, which is named by its ``....plugin`` property, may bear any name that begins
    with ``dds.sec.<kind>.``; they are returned as they are.  Raises ConfigurationError for names that nobody knows, for
    octets where text is due, and for one property that was given twice, in two spellings, with two values.
    """
    found: dict[str, str] = {}
    own = _third_party_prefixes(properties)
    for name, value in properties.items():
        canonical = _canonical(name)
        if not canonical.startswith(SECURITY_PROPERTY_PREFIX) or canonical in _IGNORED:
            continue
        if canonical not in _NAMES and not canonical.startswith(own):
            raise ConfigurationError(_unknown(name, canonical))
        text = _text(name, value)
        if not _are_alike(found.setdefault(canonical, text), text):
            raise ConfigurationError(
                f"property {canonical} is given twice, in two spellings, with different values: keep one"
            )
    return found


def _are_alike(one: str, other: str) -> bool:
    """``file:/x`` is how Cyclone DDS is told of a file, ``file:///x`` how Fast DDS is."""
    files = one.startswith("file:") and other.startswith("file:")
    return one == other or (files and resource_name(one) == resource_name(other))


def _canonical(name: str) -> str:
    for theirs, ours in _FAST_DDS_PREFIXES.items():
        if name.startswith(theirs):
            name = ours + name.removeprefix(theirs)
    return _SPELLINGS.get(name, name)


def _third_party_prefixes(properties: Properties) -> tuple[str, ...]:
    """What begins the names of a plugin that is not the builtin one, which reads properties that only it knows."""
    kinds = {AUTH_PLUGIN: "auth", ACCESS_PLUGIN: "access", CRYPTO_PLUGIN: "crypto", LOG_PLUGIN: "log"}
    return tuple(
        f"{SECURITY_PROPERTY_PREFIX}{kind}."
        for name, kind in kinds.items()
        if name in properties and not _text(name, properties[name]).startswith("builtin")
    )


def _text(name: str, value: str | Property | BinaryProperty) -> str:
    if isinstance(value, BinaryProperty):
        raise ConfigurationError(f"property {name} is text; give it as a string, not as a BinaryProperty")
    return value.value if isinstance(value, Property) else value


def _unknown(name: str, canonical: str) -> str:
    nearest = difflib.get_close_matches(canonical, _NAMES, n=1, cutoff=0.6)
    hint = f"did you mean {nearest[0]}?" if nearest else f"known are {', '.join(_NAMES)}"
    return f"unknown security property {name}: {hint}"
