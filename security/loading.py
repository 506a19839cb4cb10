"""Chooses and loads the plugins of a participant, at run time, by its properties.

DDS-Security 1.1 §8.2.4 (plugins are replaceable).  The value of ``dds.sec.auth.plugin`` and of its three siblings is
``builtin`` (the default), the name of an entry point, or ``module:factory``.  Whatever is wrong with a plugin is said
here, in one sentence and before the participant exists.  Nothing is kept from one participant to the next.

The builtin plugins are imported when they are chosen, and not before: they need what the extra ``security`` installs.
"""

from __future__ import annotations

import difflib
import inspect
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from importlib import import_module
from importlib.metadata import entry_points
from typing import Final, cast

from ddsi.structure.dataclass import dataclass
from ddsi.structure.errors import ConfigurationError
from ddsi.structure.qos_policies import Properties

from .conformance import bypassed, objections
from .crypto_transform_plugin import SHORT_WAYS
from .data_tagging import QosDataTagging
from .plugins import (
    PLUGIN_VERSION,
    AccessControl,
    Authentication,
    Cryptographic,
    DataTagging,
    Logging,
    PluginFactory,
)
from .properties import ACCESS_PLUGIN, AUTH_PLUGIN, CRYPTO_PLUGIN, LOG_PLUGIN, security_properties

__all__ = ["BUILTIN", "KINDS", "PluginKind", "Plugins", "load_plugins"]

BUILTIN: Final = "builtin"
_EXTRA_PACKAGES: Final = ("cryptography", "lxml")


@dataclass(frozen=True, slots=True)
class Plugins:
    """The plugins of one participant.  ``cryptographic`` is one object for the three interfaces of §8.5."""

    authentication: Authentication
    access_control: AccessControl
    cryptographic: Cryptographic
    logging: Logging
    data_tagging: DataTagging


@dataclass(frozen=True, slots=True)
class PluginKind:
    """One of the four that can be chosen.  ``vendor_spelling``: how Fast DDS calls the builtin one."""

    property_name: str
    interface: type
    entry_point_group: str
    builtin: str
    vendor_spelling: str


KINDS: Final = (
    PluginKind(
        AUTH_PLUGIN,
        Authentication,
        "ddsi_security.authentication",
        "ddsi_security.authentication:PkiDhAuthentication",
        "builtin.PKI-DH",
    ),
    PluginKind(
        ACCESS_PLUGIN,
        AccessControl,
        "ddsi_security.access_control",
        "ddsi_security.access_control:PermissionsAccessControl",
        "builtin.Access-Permissions",
    ),
    PluginKind(
        CRYPTO_PLUGIN,
        Cryptographic,
        "ddsi_security.cryptographic",
        "ddsi_security.cryptographic:AesGcmGmac",
        "builtin.AES-GCM-GMAC",
    ),
    PluginKind(
        LOG_PLUGIN,
        Logging,
        "ddsi_security.logging",
        "ddsi_security.logging:LogTopic",
        "builtin.DDS_LogTopic",
    ),
)


def load_plugins(properties: Properties, *, entropy: Callable[[int], bytes], wall_clock: Callable[[], int]) -> Plugins:
    """The plugins that the properties choose, made for one participant.

    ``entropy(n)`` gives n octets, ``wall_clock()`` nanoseconds since 1970.  Raises ConfigurationError, naming property
    and value, for a plugin that is not there, cannot be imported, is made for another :data:`PLUGIN_VERSION`, fails to
    start, lacks operations of its interface, or overrides some that are never called; and for a ``dds.sec.*`` property
    that nobody knows.
    """
    chosen = security_properties(properties)
    authentication, access_control, cryptographic, logging = (
        _Choice(kind, chosen.get(kind.property_name, BUILTIN)).plugin(
            properties, entropy=entropy, wall_clock=wall_clock
        )
        for kind in KINDS
    )
    return Plugins(  # each was checked against its interface
        authentication=cast(Authentication, authentication),
        access_control=cast(AccessControl, access_control),
        cryptographic=cast(Cryptographic, cryptographic),
        logging=cast(Logging, logging),
        data_tagging=QosDataTagging(),
    )


class _Choice:
    """What one property says, and the way from there to a plugin."""

    def __init__(self, kind: PluginKind, value: str) -> None:
        self._kind = kind
        self._value = value

    def plugin(
        self, properties: Properties, *, entropy: Callable[[int], bytes], wall_clock: Callable[[], int]
    ) -> object:
        factory = self._factory()
        self._check_version(factory, is_due=False)
        try:
            inspect.signature(factory).bind(properties, entropy=entropy, wall_clock=wall_clock)
        except TypeError as error:
            raise self._refused(f"is called as factory(properties, *, entropy, wall_clock): {error}") from error
        except ValueError:
            pass  # written in C, without a signature that can be read: the call will tell
        try:
            plugin = factory(properties, entropy=entropy, wall_clock=wall_clock)
        except ConfigurationError:
            raise  # it says itself which property, and what to do
        except Exception as error:
            raise self._refused(f"failed to start: {_told(error)}") from error
        self._check_version(plugin, is_due=getattr(factory, "plugin_version", None) is None)
        if found := objections(plugin, self._kind.interface):
            made = f"the {type(plugin).__name__} it makes is no {self._kind.interface.__name__}"
            raise self._refused(f"{made}: {'; '.join(found)}")
        if found := bypassed(plugin, SHORT_WAYS):
            raise self._refused(f"of the {type(plugin).__name__} it makes, {'; '.join(found)}")
        return plugin

    def _check_version(self, bearer: object, *, is_due: bool) -> None:
        version = getattr(bearer, "plugin_version", None)
        if version is None and is_due:
            raise self._refused(f"bears no plugin_version: it must say {PLUGIN_VERSION}, if it is written for that")
        if version is not None and version != PLUGIN_VERSION:
            reason = f"is written for version {version!r} of the plugin interfaces, these are {PLUGIN_VERSION}"
            raise self._refused(f"{reason}: install matching releases")

    # --- finding the factory -----------------------------------------------------------------------------

    def _factory(self) -> PluginFactory[object]:
        if self._value in (BUILTIN, self._kind.vendor_spelling):
            reference = self._kind.builtin
        elif ":" in self._value:
            reference = self._value
        else:
            reference = self._entry_point()
        module_name, _, attribute = reference.partition(":")
        if not module_name or module_name.startswith("."):
            raise self._refused("write module:factory, with the module's whole name")
        with self._import_errors_explained(module_name):
            found: object = import_module(module_name)
            for name in attribute.split("."):
                if not hasattr(found, name):
                    raise self._refused(f"{module_name} has no {attribute}{_nearest(name, dir(found))}")
                found = getattr(found, name)
        if not callable(found):
            raise self._refused(f"{attribute} is of type {type(found).__name__}, and nothing that makes a plugin")
        return cast(PluginFactory[object], found)

    def _entry_point(self) -> str:
        """What the entry point of this name refers to, as ``module:factory``."""
        group = self._kind.entry_point_group
        installed = entry_points(group=group)
        # A package may be seen twice, as installed and as checked out; that is no conflict.
        references = {entry.value for entry in installed if entry.name == self._value}
        if len(references) > 1:
            raise self._refused(f"several packages provide it ({', '.join(sorted(references))}): keep one of them")
        if not references:
            names = {self._kind.vendor_spelling, BUILTIN, *(entry.name for entry in installed)}
            raise self._refused(
                f"no installed package has an entry point of that name in the group {group}"
                f"{_nearest(self._value, names) or '; or write module:factory'}"
            )
        return references.pop()

    @contextmanager
    def _import_errors_explained(self, module_name: str) -> Iterator[None]:
        """Around the import, and around getting a name out of the module, which may import more."""
        try:
            yield
        except ConfigurationError:
            raise
        except ImportError as error:
            absent = error.name or ""
            if (package := absent.partition(".")[0]) in _EXTRA_PACKAGES:
                raise self._refused(f"needs the package {package}: pip install 'ddsi[security]'") from error
            if isinstance(error, ModuleNotFoundError) and f"{module_name}.".startswith(f"{absent}."):
                raise self._refused(f"there is no module {absent}: install what holds it, or correct it") from error
            raise self._refused(f"{module_name} cannot be imported: {_told(error)}") from error
        except Exception as error:
            raise self._refused(f"{module_name} cannot be imported: {_told(error)}") from error

    def _refused(self, reason: str) -> ConfigurationError:
        return ConfigurationError(f"property {self._kind.property_name} is {self._value!r}: {reason}")


def _nearest(name: str, known: Iterable[str]) -> str:
    nearest = difflib.get_close_matches(name, sorted(known), n=1)
    return f": did you mean {nearest[0]}?" if nearest else ""


def _told(error: Exception) -> str:
    """An error of somebody else's code, on one line."""
    return " ".join(f"{type(error).__name__}: {error}".split())[:300]
