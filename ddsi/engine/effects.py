"""What the engine asks its shell to do: small frozen values, in the order in which they are to be done.

``Participant.drain_effects`` gives them out; transport and simulation act on them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import field

from ..structure.dataclass import dataclass
from ..structure.guid import Guid
from ..structure.locator import Locator
from ..structure.status import Status

__all__ = [
    "Compute",
    "DataAvailable",
    "DiscoveryChanged",
    "Effect",
    "MatchRefused",
    "SendDatagram",
    "StatusChanged",
    "WriterProgress",
]

Octets = bytes | bytearray | memoryview


@dataclass(frozen=True, slots=True)
class SendDatagram:
    """Send these parts, joined, to each of the locators.  The parts must not be kept: later writes may change them.

    ``priority``: TRANSPORT_PRIORITY of the writer (DDS 1.4 §2.2.3.15), as far as it says more than the default.
    """

    destinations: tuple[Locator, ...]
    parts: Sequence[Octets]
    priority: int = 0


@dataclass(frozen=True, slots=True)
class DataAvailable:
    """A reader has samples to take: wake who waits for it."""

    reader: Guid


@dataclass(frozen=True, slots=True)
class WriterProgress:
    """A writer was acknowledged, or has room again: wake who waits for it."""

    writer: Guid


@dataclass(frozen=True, slots=True)
class StatusChanged:
    """A communication status of an entity changed: hand the event to whoever listens."""

    entity: Guid
    status: Status


@dataclass(frozen=True, slots=True)
class MatchRefused:
    """An endpoint of ours and another of its topic do not match, and that is news: tell whoever reads the log."""

    local: Guid
    remote: Guid


@dataclass(frozen=True, slots=True)
class DiscoveryChanged:
    """The tables of remote participants and endpoints changed: wake who watches them."""


@dataclass(frozen=True, slots=True)
class Compute:
    """Run ``job`` in a worker thread and give its result to ``computed`` with the engine's time."""

    job: Callable[[], object] = field(repr=False)
    computed: Callable[[object, float], None] = field(repr=False)


Effect = SendDatagram | DataAvailable | WriterProgress | StatusChanged | MatchRefused | DiscoveryChanged | Compute
