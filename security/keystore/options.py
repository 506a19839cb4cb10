"""The options of ``ddsi keystore``'s subcommands, and what their values become.

Kept apart from what the subcommands do, so that ``ddsi --help`` loads no cryptographic library.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Final

from ddsi.structure.errors import BadParameter

from .documents import DATA_KINDS, KINDS, PRESETS, GovernanceDraft, Rights
from .domain_ranges import HIGHEST_DOMAIN, DomainRanges
from .validity import DEFAULT_DAYS

__all__ = [
    "ALGORITHMS",
    "add_algorithm",
    "add_authority",
    "add_days",
    "add_domains",
    "add_force",
    "add_governance",
    "add_json",
    "add_password",
    "add_rights",
    "domain_id",
    "governance_draft",
    "rights",
]

ALGORITHMS: Final = ("EC", "RSA", "EC-P384")
_KINDS_BY_OPTION: Final = ("discovery", "liveliness", "rtps", "metadata", "data")


def add_force(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--force", action="store_true", help="replace files that are there; without, they are kept")


def add_json(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--json", action="store_true", help="print JSON instead, as docs/keystore.md describes")


def add_algorithm(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--algorithm",
        choices=ALGORITHMS,
        default="EC",
        help="of new keys: EC is P-256, RSA has 2048 bits (default: EC)",
    )


def add_days(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--days", type=_days, default=DEFAULT_DAYS, metavar="N", help=f"how long it is valid (default: {DEFAULT_DAYS})"
    )


def add_domains(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "-d", "--domain", type=_domains, default=DomainRanges(((0, 0),)), metavar="N", dest="domains",
        help="domains, such as 0 or 0,5-9 (default: 0)",
    )  # fmt: skip


def add_authority(parser: argparse.ArgumentParser, role: str) -> None:
    parser.add_argument("--keystore", type=Path, metavar="DIR", help=f"take the {role} CA of this keystore")
    parser.add_argument("--ca", type=Path, metavar="FILE", help=f"else the {role} CA's certificate")
    parser.add_argument("--ca-key", type=Path, metavar="FILE", help="and its private key")
    add_password(parser)


def add_password(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--password-file", type=Path, metavar="FILE", help="its first line is the password of the authority's key"
    )


def add_governance(parser: argparse.ArgumentParser) -> None:
    group = parser.add_argument_group("governance")
    group.add_argument("--preset", choices=PRESETS, default="encrypt", help="kinds of protection (default: encrypt)")
    for name in _KINDS_BY_OPTION:
        kinds = DATA_KINDS if name == "data" else KINDS
        group.add_argument(f"--{name}", choices=kinds, metavar="KIND", help=f"this kind instead: {', '.join(kinds)}"
                           if name in ("discovery", "data") else "likewise")  # fmt: skip
    group.add_argument("--allow-unauthenticated", action="store_true", help="let in who has no identity")
    group.add_argument("--no-join-control", action="store_true", help="whoever has an identity may join")
    group.add_argument("--no-read-control", action="store_true", help="whoever joined may subscribe to any topic")
    group.add_argument("--no-write-control", action="store_true", help="whoever joined may publish any topic")


def governance_draft(arguments: argparse.Namespace) -> GovernanceDraft:
    """Raises BadParameter for options that contradict each other."""
    kinds = dict(zip(_KINDS_BY_OPTION, PRESETS[arguments.preset], strict=True))
    kinds |= {name: kind for name in _KINDS_BY_OPTION if (kind := getattr(arguments, name))}
    return GovernanceDraft(
        domains=arguments.domains,
        allow_unauthenticated=arguments.allow_unauthenticated,
        join_access_control=not arguments.no_join_control,
        read_access_control=not arguments.no_read_control,
        write_access_control=not arguments.no_write_control,
        **kinds,
    )


def add_rights(parser: argparse.ArgumentParser) -> None:
    group = parser.add_argument_group("permissions (without any of the first three: all topics, both ways)")
    group.add_argument(
        "--topic", action="append", metavar="NAME", help="may publish and subscribe; a pattern, repeatable"
    )
    group.add_argument("--publish", action="append", metavar="NAME", help="may publish")
    group.add_argument("--subscribe", action="append", metavar="NAME", help="may subscribe")
    group.add_argument("--relay", action="append", metavar="NAME", help="may pass on without reading")
    group.add_argument("--partition", action="append", metavar="NAME", help="in these partitions only (default: *)")


def rights(arguments: argparse.Namespace) -> Rights:
    both = tuple(arguments.topic or ())
    publish, subscribe, relay = (
        tuple(given or ()) for given in (arguments.publish, arguments.subscribe, arguments.relay)
    )
    if not (both or publish or subscribe or relay):
        both = ("*",)
    return Rights(
        domains=arguments.domains,
        publish=both + publish,
        subscribe=both + subscribe,
        relay=relay,
        partitions=tuple(arguments.partition or ("*",)),
    )


def domain_id(text: str) -> int:
    """A single domain.  Raises ArgumentTypeError, as the private ones below do."""
    try:
        number = int(text)
    except ValueError:
        number = -1
    if not 0 <= number <= HIGHEST_DOMAIN:
        raise argparse.ArgumentTypeError(f"a domain is a number from 0 to {HIGHEST_DOMAIN}, not {text!r}")
    return number


def _domains(text: str) -> DomainRanges:
    try:
        return DomainRanges.parse(text)
    except BadParameter as error:
        raise argparse.ArgumentTypeError(str(error)) from error


def _days(text: str) -> int:
    try:
        return int(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"a number of days is wanted, not {text!r}") from None
