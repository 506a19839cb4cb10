"""Structured events of what the engine does, and their rendering as JSON lines, pcapng, words and diagrams.

The debugging tool of everything else.  The engine holds one :data:`~ddsi.trace.sink.TraceSink` or None; nothing is
built, not even the event, when it is None.  This room has no file, no socket and no clock: writers are given a
stream, times are those that the engine was given.  The written schema is ``docs/trace.md``.

``trace.events`` is imported when it is first used: its thirty classes take tens of milliseconds to make, which a
program that traces nothing should not wait for.  So the engine writes::

    from .. import trace

    if self.trace is not None:
        self.trace(trace.events.MessageSent(now, prefix, destinations, octets))
"""

from __future__ import annotations

import importlib
from types import ModuleType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from . import events as events
    from . import reasons as reasons

__all__ = ["events", "reasons"]


def __getattr__(name: str) -> ModuleType:
    """A submodule that is not imported yet (PEP 562); from then on it is an attribute like any other."""
    if name in __all__:
        return importlib.import_module(f".{name}", __name__)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
