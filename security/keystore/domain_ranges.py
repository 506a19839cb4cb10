"""Sets of domain ids, as options and documents have them.  DDS-Security 1.1 §9.4.1.2.4.1 (Domains Section)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Self

from ddsi.structure.errors import BadParameter

__all__ = ["CYCLONE_HIGHEST_DOMAIN", "HIGHEST_DOMAIN", "DomainRanges"]

HIGHEST_DOMAIN: Final = 232
"""The port numbers end there (RTPS 2.5 §9.6.2.3)."""
CYCLONE_HIGHEST_DOMAIN: Final = 230
"""Cyclone DDS refuses a document that names a higher one."""


@dataclass(frozen=True, slots=True)
class DomainRanges:
    """Lowest and highest, both inclusive, of each run."""

    ranges: tuple[tuple[int, int], ...]

    @classmethod
    def parse(cls, text: str) -> Self:
        """``0``, ``0,7`` or ``0-9,20``.  Raises BadParameter."""
        ranges = []
        for part in text.split(","):
            first, dash, last = part.strip().partition("-")
            try:
                lowest, highest = int(first), int(last if dash else first)
            except ValueError:
                raise BadParameter(f"domains are numbers and ranges such as 0,5-9, not {text!r}") from None
            if not 0 <= lowest <= highest <= HIGHEST_DOMAIN:
                raise BadParameter(
                    f"a domain is a number from 0 to {HIGHEST_DOMAIN}, the lower first; not {part.strip()!r}"
                )
            ranges.append((lowest, highest))
        return cls(tuple(ranges))

    def __str__(self) -> str:
        return ",".join(str(first) if first == last else f"{first}-{last}" for first, last in self.ranges)
