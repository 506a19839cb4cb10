"""MessagePacker: submessages into messages of a bounded size.  Other name: xpack.  RTPS 2.5 §8.3.3.

One packer per destination.  It holds buffers, not copies: a message leaves as a list of parts that are given to the
socket together.
"""

from __future__ import annotations

from collections.abc import Sequence

from ..serialization.cursor import Octets
from .header import HEADER_LENGTH

__all__ = ["MessagePacker"]


class MessagePacker:
    """The message under construction.  ``head`` is its RTPS header, with an INFO_DST behind it where there is one.

    ``capacity``: octets that it may have; it may change between two messages.
    """

    __slots__ = ("_head", "capacity", "octets", "parts", "timestamp")

    def __init__(self, head: bytes, capacity: int) -> None:
        assert len(head) >= HEADER_LENGTH
        self._head = head
        self.capacity = capacity
        self.parts: list[Octets] = [head]
        self.octets = len(head)
        self.timestamp = -1  # the source timestamp (ticks) that the last INFO_TS set; -1: none yet

    @property
    def is_empty(self) -> bool:
        return len(self.parts) == 1

    def fits(self, octets: int) -> bool:
        """Is there room for so many more?  A message without submessages takes anything."""
        return self.octets + octets <= self.capacity or len(self.parts) == 1

    def add(self, parts: Sequence[Octets], octets: int) -> None:
        self.parts.extend(parts)
        self.octets += octets

    def take(self) -> list[Octets]:
        """The message's parts; the packer begins a new one."""
        parts = self.parts
        self.parts = [self._head]
        self.octets = len(self._head)
        self.timestamp = -1
        return parts
