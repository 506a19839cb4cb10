"""The factory that the core finds under the entry point group ``ddsi.security``.  DDS-Security 1.1 §9.3.1.

At this stage it only refuses: the plugin interfaces are laid (:mod:`ddsi_security.plugins`), the builtin plugins that
implement them come with a later release.  A participant that asks for security never runs without it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, NoReturn

from ddsi.spi import SECURITY_PROPERTY_PREFIX
from ddsi.structure.errors import ConfigurationError
from ddsi.structure.qos_policies import Properties

__all__ = ["load"]


class _BuiltinSecurity:
    """Makes the SecurityHooks of one participant from its properties.  Implements ``ddsi.spi.loader.HooksFactory``."""

    # The version of the seam that this package is written for, not whichever the installed core happens to have.
    spi_version: Final = 1

    def __call__(
        self, properties: Properties, *, entropy: Callable[[int], bytes], wall_clock: Callable[[], int]
    ) -> NoReturn:
        """Raises ConfigurationError: the builtin plugins are not in this release."""
        names = sorted(name for name in properties if name.startswith(SECURITY_PROPERTY_PREFIX))
        raise ConfigurationError(
            f"the participant asks for DDS Security by {', '.join(names) or 'its properties'}, but the builtin plugins "
            f"come with a later release: remove all {SECURITY_PROPERTY_PREFIX}* properties to run it unprotected"
        )


load = _BuiltinSecurity()
