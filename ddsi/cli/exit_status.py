"""How the command ends: its statuses, and the error that stands for one sentence to the user."""

from __future__ import annotations

from enum import IntEnum

__all__ = ["CommandError", "ExitStatus"]


class ExitStatus(IntEnum):
    """What the shell gets.  A signal's status is 128 and its number, as shells have it."""

    OK = 0
    NOT_AS_HOPED = 1
    """The command did its work, and what it checked is not so: something did not arrive, match or hold."""
    USAGE = 2
    """The command could not do its work: arguments, configuration, a file, a port."""
    INTERRUPTED = 130
    BROKEN_PIPE = 141


class CommandError(Exception):
    """The command cannot go on, and the user can do something about it; the text is one sentence."""
