"""LinkConditions: the weather between two hosts.  Not a chapter of the specification, which expects all of it (RTPS
2.5 §9.1)."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["GOOD_WEATHER", "SAME_HOST", "LinkConditions"]


@dataclass(frozen=True, slots=True, kw_only=True)
class LinkConditions:
    """What happens to datagrams on their way from one host to another.  Times in seconds, probabilities from 0 to 1.

    A datagram takes ``delay`` to ``delay + jitter``.  Datagrams stay in order, but each is held back by up to
    ``reordering_delay`` more with probability ``reordering``, so that later ones overtake it.  ``duplication``: it
    comes twice.  ``mtu``: the largest payload that gets through, in octets.
    """

    loss: float = 0.0
    duplication: float = 0.0
    reordering: float = 0.0
    reordering_delay: float = 0.005
    delay: float = 0.0002
    jitter: float = 0.0
    mtu: int = 65_507

    def __post_init__(self) -> None:
        for name in ("loss", "duplication", "reordering"):
            if not 0 <= getattr(self, name) <= 1:
                raise ValueError(f"{name} is a probability from 0 to 1, not {getattr(self, name)!r}")
        if min(self.delay, self.jitter, self.reordering_delay) < 0 or self.mtu < 0:
            raise ValueError(f"no time and no size is below 0: {self}")


GOOD_WEATHER = LinkConditions()
SAME_HOST = LinkConditions(delay=0.00002)
"""Loopback: what a host sends to itself does not meet the weather."""
