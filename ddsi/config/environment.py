"""Reading ``DDSI_URI`` from the environment: the only place of the core that looks there."""

from __future__ import annotations

import os
from collections.abc import Mapping

from .config import Config

__all__ = ["ENVIRONMENT_VARIABLE", "load_config"]

ENVIRONMENT_VARIABLE = "DDSI_URI"


def load_config(domain_id: int = 0, environ: Mapping[str, str] = os.environ) -> Config:
    """The Config that ``DDSI_URI`` sets for the domain, or the defaults where it is not set.

    Raises ConfigurationError, naming the element and its line.  See :meth:`Config.from_uri` for what it may hold.
    """
    text = environ.get(ENVIRONMENT_VARIABLE, "")
    return Config.from_uri(text, domain_id=domain_id, environ=environ) if text.strip() else Config()
