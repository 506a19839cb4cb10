"""Whom an endpoint tells what it has no use for: repetitions, what is out of order, what finds no room.

RTPS leaves it open.  None of it is an error, all of it is counted by its reason.
"""

from __future__ import annotations

from collections.abc import Callable

from ..structure.guid import Guid
from ..trace.reasons import DropReason

__all__ = ["WhenDropped", "drop_silently"]

WhenDropped = Callable[[DropReason, Guid, int], None]
"""Takes the reason, the remote endpoint, and a sequence number (or, of a stale submessage, its count)."""


def drop_silently(reason: DropReason, remote: Guid, number: int) -> None:
    """Nobody wants to know."""
