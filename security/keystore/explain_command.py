"""``ddsi explain`` and ``ddsi keystore explain``: may this identity do it, how is it protected, and by which lines?"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Final

from .lazy_command import run_lazily
from .options import add_json, domain_id

__all__ = ["FUNCTION", "MODULE", "SUMMARY", "add_arguments", "run"]

SUMMARY = "say what an identity may do, how it will be protected, and why"

MODULE: Final = "explaining"
FUNCTION: Final = "explain"
"""What :func:`run` runs: in a module of its own, as it needs the cryptographic library."""

_QUESTIONS: Final = ("publish", "subscribe", "relay", "join")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "folder", type=Path, metavar="DIR", help="the folder of an identity, or a keystore with --identity"
    )
    parser.add_argument(
        "question", choices=_QUESTIONS, metavar="publish|subscribe|relay|join", help="what it wants to do"
    )
    parser.add_argument("topic", nargs="?", metavar="TOPIC", help="the name of the topic; not with join")
    parser.add_argument("-d", "--domain", type=domain_id, default=0, metavar="N", help="the domain (default: 0)")
    parser.add_argument(
        "-p", "--partition", action="append", default=[], metavar="NAME", dest="partitions",
        help="a partition of the publisher or subscriber; repeatable (default: the empty one)",
    )  # fmt: skip
    parser.add_argument(
        "--tag", action="append", default=[], metavar="NAME=VALUE", dest="tags",
        help="a data tag of the writer or reader; repeatable",
    )  # fmt: skip
    parser.add_argument("--identity", metavar="NAME", help="which identity of the keystore: the name of its folder")
    add_json(parser)


def run(arguments: argparse.Namespace) -> int:
    return run_lazily(MODULE, FUNCTION, arguments)
