"""What writers and readers want sent, as small values; ``engine`` turns them into submessages and packs them.

RTPS 2.5 §8.4 speaks of "sending" a submessage; the machines of this room answer with these instead, so that
they know nothing of datagrams, and tests read what they decided.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..structure.cache_change import CacheChange
from ..structure.dataclass import dataclass
from ..structure.sequence_number import NumberSet

if TYPE_CHECKING:
    from .reader_proxy import ReaderProxy

__all__ = [
    "SendAckNack",
    "SendData",
    "SendFragments",
    "SendGap",
    "SendHeartbeat",
    "SendHeartbeatFrag",
    "SendNackFrag",
    "WriterTransmission",
]


@dataclass(frozen=True, slots=True)
class SendData:
    """A whole change; to one reader, or (None) to all that are matched."""

    change: CacheChange
    reader: ReaderProxy | None = None


@dataclass(frozen=True, slots=True)
class SendFragments:
    """Fragments ``first`` to ``last`` (inclusive, from 1) of a change; to one reader, or (None) to all."""

    change: CacheChange
    first: int
    last: int
    reader: ReaderProxy | None = None


@dataclass(frozen=True, slots=True)
class SendGap:
    """Numbers from ``start`` to ``irrelevant.base - 1``, and the set, will never come.  Always to one reader."""

    reader: ReaderProxy
    start: int
    irrelevant: NumberSet


@dataclass(frozen=True, slots=True)
class SendHeartbeat:
    """Changes ``first`` to ``last`` are available (none if ``first == last + 1``).

    ``final``: no answer is wanted unless something is missing.  ``readers``: to these, None for all.
    """

    first: int
    last: int
    count: int
    final: bool
    readers: tuple[ReaderProxy, ...] | None = None
    liveliness: bool = False


@dataclass(frozen=True, slots=True)
class SendHeartbeatFrag:
    """Fragments 1 to ``last`` of a change that is still being sent are available.  To all readers."""

    change: CacheChange
    last: int
    count: int


WriterTransmission = SendData | SendFragments | SendGap | SendHeartbeat | SendHeartbeatFrag


@dataclass(frozen=True, slots=True)
class SendAckNack:
    """All below ``missing.base`` is here; the members of ``missing`` are asked for."""

    missing: NumberSet
    count: int
    final: bool


@dataclass(frozen=True, slots=True)
class SendNackFrag:
    """Fragments of one change that are asked for."""

    sequence_number: int
    missing: NumberSet
    count: int
