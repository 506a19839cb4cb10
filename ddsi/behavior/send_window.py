"""SendWindow: how many octets a reliable writer lets be under way before it waits for acknowledgment.

RTPS leaves flow control to implementations (RTPS 2.5 §8.4.2.2.5 allows a writer to regulate itself).  Without
any, a fast writer fills its reader's socket buffer, the kernel drops what does not fit, and repairs crowd
out fresh samples.  So the window works as TCP's does: it grows with what is acknowledged, and halves, at
most once in a while, when a reader asks for something again.
"""

from __future__ import annotations

__all__ = ["SendWindow"]

# Half of the 208 KiB that Linux gives a socket by default: the smallest buffer to expect at a peer.
_INITIAL_OCTETS = 128 * 1024
_MINIMUM_OCTETS = 32 * 1024
_MAXIMUM_OCTETS = 4 * 1024 * 1024
_HALVE_AT_MOST_EVERY_S = 0.02


class SendWindow:
    """``octets``: the present size.  It says how much; the writer counts what is in flight."""

    __slots__ = ("_last_halved", "octets")

    def __init__(self) -> None:
        self.octets = _INITIAL_OCTETS
        self._last_halved = float("-inf")

    def acknowledged(self, octets: int) -> None:
        """So many octets arrived: room for a quarter more of them."""
        if self.octets < _MAXIMUM_OCTETS:
            self.octets = min(self.octets + octets // 4, _MAXIMUM_OCTETS)

    def lost(self, now: float) -> None:
        """A reader asks again for something that had been sent."""
        if now - self._last_halved >= _HALVE_AT_MOST_EVERY_S:
            self._last_halved = now
            self.octets = max(self.octets // 2, _MINIMUM_OCTETS)
