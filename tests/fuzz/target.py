"""What can be fuzzed: a parser of hostile octets, and what it may answer.

A target gives octets to code that meets them in real life and returns its verdict: "accepted", or the name of the
refusal, an error that the code promises or a value such as Refused, with its reason.  Anything else that it raises is a
finding.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

from ddsi.spi import Outcome, Refused

__all__ = ["ACCEPTED", "Target", "verdict"]

ACCEPTED = "accepted"
LONGEST_REASON = 2000


@dataclass(frozen=True)
class Target:
    """``seeds`` are well-formed inputs to begin with, beside those that are kept in ``corpus/``."""

    run: Callable[[bytes], str]
    seeds: Callable[[], Iterable[bytes]]
    most_octets: int = 4096
    """Longer inputs are cut: what is interesting happens in few octets, and short ones are tried faster."""
    is_text: bool = False
    """Made of words: a fuzzer that is told them gets further than one that must spell them."""
    enormous: int = 8 << 20
    """Octets that must not be too many for it; a datagram cannot have more than 65,507."""
    good: str = ACCEPTED
    """What most seeds are answered."""


def verdict(call: Callable[[], object], *errors: type[Exception]) -> str:
    """What ``call`` says; ``errors`` are those that it promises to raise.

    Reasons are for people to read in one line of a log, whatever a stranger wrote.
    """
    try:
        result = call()
    except errors as error:
        return _named(error, str(error))
    if isinstance(result, (Refused, Outcome)):
        return _named(result, getattr(result, "reason", ""))
    return ACCEPTED


def _named(refusal: object, reason: str) -> str:
    assert reason.isprintable(), reason
    assert len(reason) < LONGEST_REASON, reason
    return f"{type(refusal).__name__}: {reason}"
