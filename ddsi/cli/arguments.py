"""Options that several subcommands share, and the readers of their values."""

from __future__ import annotations

import argparse
import math

__all__ = ["add_domain", "add_json", "add_listening", "count", "domain_id", "octets", "rate", "seconds"]

_HIGHEST_DOMAIN = 232
_HIGHEST_RATE_HZ = 10_000.0
DEFAULT_LISTENING_S = 2.0
"""Long enough for a participant that answers our announcement at once, as all vendors do."""


def add_domain(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "-d", "--domain", type=domain_id, default=0, metavar="N", help="the domain, 0 to 232 (default: 0)"
    )


def add_json(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--json", action="store_true", help="print JSON instead, as docs/cli.md describes")


def add_listening(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--time",
        type=seconds,
        metavar="SECONDS",
        help=f"how long to listen (default: {DEFAULT_LISTENING_S:g}, and as long again while announcements come in)",
    )


def domain_id(text: str) -> int:
    """A domain id.  Raises ArgumentTypeError, as all of these do."""
    number = _integer(text)
    if not 0 <= number <= _HIGHEST_DOMAIN:
        raise argparse.ArgumentTypeError(f"a domain is a number from 0 to {_HIGHEST_DOMAIN}, not {text!r}")
    return number


def seconds(text: str) -> float:
    """A finite duration above 0."""
    value = _number(text)
    if not 0 < value < math.inf:
        raise argparse.ArgumentTypeError(f"a number of seconds above 0 is wanted, not {text!r}")
    return value


def rate(text: str) -> float:
    """So many a second, above 0."""
    value = _number(text)
    if not 0 < value <= _HIGHEST_RATE_HZ:
        raise argparse.ArgumentTypeError(
            f"a number of samples a second is wanted, above 0 and at most {_HIGHEST_RATE_HZ:g}, not {text!r}"
        )
    return value


def count(text: str) -> int:
    """A number of things, 1 or more."""
    number = _integer(text)
    if number < 1:
        raise argparse.ArgumentTypeError(f"a number from 1 up is wanted, not {text!r}")
    return number


def octets(text: str) -> int:
    """A number of octets, 0 or more."""
    number = _integer(text)
    if number < 0:
        raise argparse.ArgumentTypeError(f"a number of octets is wanted, not {text!r}")
    return number


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return math.nan


def _integer(text: str) -> int:
    try:
        return int(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"a whole number is wanted, not {text!r}") from None
