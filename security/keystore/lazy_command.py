"""Commands whose work needs packages of the extra ``security``, imported only once one is chosen."""

from __future__ import annotations

import argparse
from importlib import import_module

from ddsi.structure.errors import ConfigurationError

__all__ = ["run_lazily"]


def run_lazily(module: str, function: str, arguments: argparse.Namespace) -> int:
    """Import what needs the packages, and run it.  Raises ConfigurationError where they are not installed."""
    try:
        actions = import_module(f"{__package__}.{module}")
    except ModuleNotFoundError as error:
        package = (error.name or "").partition(".")[0]
        if package not in ("cryptography", "lxml"):
            raise
        raise ConfigurationError(f"keystores need the package {package}: pip install 'ddsi[security]'") from error
    status: int = getattr(actions, function)(arguments)
    return status
