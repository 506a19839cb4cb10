"""Owners: who of several writers may change an instance when OWNERSHIP is exclusive.  DDS 1.4 §2.2.3.9.2.

The strongest writer that writes an instance owns it; of equally strong ones the one with the lower Guid, so that all
readers decide alike.  Each instance has its owner; it loses it when the writer unregisters it, is lost, or misses its
deadline.
"""

from __future__ import annotations

__all__ = ["Owners"]


class Owners:
    """The strengths of the matched writers, by Guid."""

    __slots__ = ("_strengths",)

    def __init__(self) -> None:
        self._strengths: dict[bytes, int] = {}

    def writer_matched(self, writer: bytes, strength: int) -> None:
        """A writer was matched, or has another strength now."""
        self._strengths[writer] = strength

    def writer_lost(self, writer: bytes) -> None:
        self._strengths.pop(writer, None)

    def may_write(self, writer: bytes, owner: bytes | None) -> bool:
        """Does the writer own an instance that has this owner now, or does it take it over?"""
        if owner is None or owner == writer:
            return True
        ours, theirs = self._strengths.get(writer, 0), self._strengths.get(owner, 0)
        return ours > theirs or (ours == theirs and writer < owner)
