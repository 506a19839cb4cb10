"""Other stacks to compare ours with: tests are skipped without them, or fail where ``DDSI_REQUIRE_PEERS=1``."""

from __future__ import annotations

import importlib
import os
from typing import Any

import pytest

__all__ = ["peer_module", "peer_must_be_there"]


def peer_must_be_there() -> bool:
    return os.environ.get("DDSI_REQUIRE_PEERS") == "1"


def peer_module(name: str, reason: str) -> Any:
    """The module of that name, which imports the peer; all tests of the file that asks are skipped without it."""
    try:
        return importlib.import_module(name)
    except ImportError:
        if peer_must_be_there():
            raise
        pytest.skip(reason, allow_module_level=True)
