"""Finds the hooks that a participant's properties ask for, at run time.

The core knows no security package by name: whoever provides one registers a factory under the entry point
group ``ddsi.security``.  DDS-Security 1.1 §9.3.1 (all its properties begin with ``dds.sec.``).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Protocol, cast

from ..structure.errors import ConfigurationError
from ..structure.qos_policies import Properties
from .hooks import SecurityHooks
from .plaintext import PLAINTEXT

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

__all__ = ["ENTRY_POINT_GROUP", "SECURITY_PROPERTY_PREFIX", "SPI_VERSION", "HooksFactory", "load_hooks"]

ENTRY_POINT_GROUP = "ddsi.security"
SECURITY_PROPERTY_PREFIX = "dds.sec."
SPI_VERSION = 1
"""Raised whenever :class:`SecurityHooks` changes incompatibly; a factory says which version it is made for."""


class HooksFactory(Protocol):
    """What an entry point of the group names."""

    spi_version: int

    def __call__(
        self, properties: Properties, *, entropy: Callable[[int], bytes], wall_clock: Callable[[], int]
    ) -> SecurityHooks: ...


def load_hooks(
    properties: Properties,
    *,
    entropy: Callable[[int], bytes],
    wall_clock: Callable[[], int],
    providers: Iterable[EntryPoint] | None = None,
) -> SecurityHooks:
    """PLAINTEXT when no property configures security, else what the one installed provider makes of them.

    ``entropy(n)`` gives n octets, ``wall_clock()`` nanoseconds since 1970.  Raises ConfigurationError, with the
    remedy, when security is asked for and cannot be had: it never falls back to plain text.
    """
    if not any(name.startswith(SECURITY_PROPERTY_PREFIX) for name in properties):
        return PLAINTEXT
    found = list(_installed() if providers is None else providers)
    if not found:
        raise ConfigurationError(
            f"the participant has {SECURITY_PROPERTY_PREFIX}* properties, but no security provider is installed: "
            "pip install 'ddsi[security]'"
        )
    if len(found) > 1:
        names = ", ".join(sorted(f"{entry.name} ({entry.value})" for entry in found))
        raise ConfigurationError(f"several security providers are installed, keep one of them: {names}")
    return _load_factory(found[0])(properties, entropy=entropy, wall_clock=wall_clock)


def _installed() -> Iterable[EntryPoint]:
    from importlib.metadata import entry_points  # takes as long to import as a tenth of all this; few need it

    return entry_points(group=ENTRY_POINT_GROUP)


def _load_factory(entry: EntryPoint) -> HooksFactory:
    try:
        factory = entry.load()
    except ImportError as error:
        raise ConfigurationError(
            f"security provider {entry.value!r} cannot be imported ({error}): pip install 'ddsi[security]'"
        ) from error
    version = getattr(factory, "spi_version", None)
    if version != SPI_VERSION:
        raise ConfigurationError(
            f"security provider {entry.value!r} is made for version {version} of the seam, this is {SPI_VERSION}: "
            "install matching releases"
        )
    return cast(HooksFactory, factory)
