"""NotTrusted: why a certificate, a key or a message is not believed."""

from __future__ import annotations

from typing import Final

__all__ = ["NotTrusted"]

_LONGEST_REASON: Final = 1000


class NotTrusted(Exception):
    """Never leaves this package: what it says of a peer becomes Refused, of our own material ConfigurationError.

    The text is for people, begins in lower case and holds no secret.  Names in it are often a stranger's: it is cut,
    and what would not print, such as line ends or a terminal's commands, is escaped.
    """

    def __init__(self, reason: str) -> None:
        shown = (char if char.isprintable() else ascii(char)[1:-1] for char in reason[:_LONGEST_REASON])
        super().__init__("".join(shown) + ("..." if len(reason) > _LONGEST_REASON else ""))
