"""What can be fuzzed: a parser of hostile octets, and what it may answer.

A target gives octets to code that meets them in real life and returns one word: "accepted", or the name of the refusal,
an error that the code promises or a value such as Refused.  Anything else that it raises is a finding.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

from ddsi.spi import Outcome, Refused

__all__ = ["ACCEPTED", "Target", "verdict"]

ACCEPTED = "accepted"


@dataclass(frozen=True)
class Target:
    """``seeds`` are well-formed inputs to begin with, beside those that are kept in ``corpus/``."""

    run: Callable[[bytes], str]
    seeds: Callable[[], Iterable[bytes]]
    most_octets: int = 4096
    """Longer inputs are cut: what is interesting happens in few octets, and short ones are tried faster."""
    good: str = ACCEPTED
    """What most seeds are answered."""


def verdict(call: Callable[[], object], *errors: type[Exception]) -> str:
    """The word for what ``call`` does; ``errors`` are those that it promises to raise."""
    try:
        result = call()
    except errors as error:
        return type(error).__name__ if str(error).isprintable() else "an error that garbles the log"
    return type(result).__name__ if isinstance(result, (Refused, Outcome)) else ACCEPTED
