"""``ddsi keystore``: make, check and explain identities and permissions.  docs/keystore.md is its manual.

This module declares the subcommands and their options; what they do is imported when one of them is chosen.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import Final, NamedTuple

from . import explain_command
from .lazy_command import run_lazily
from .options import (
    add_algorithm,
    add_authority,
    add_days,
    add_domains,
    add_force,
    add_governance,
    add_json,
    add_password,
    add_rights,
)

__all__ = ["SUMMARY", "add_arguments", "run"]

SUMMARY = "make, sign, check and explain identities, governance and permissions"

_DEFAULT_DAYS_TO_EXPIRY: Final = 30


def add_arguments(parser: argparse.ArgumentParser) -> None:
    subparsers = parser.add_subparsers(metavar="SUBCOMMAND", required=True)
    for name, action in _ACTIONS.items():
        subparser = subparsers.add_parser(
            name, help=action.summary, description=f"{action.summary[0].upper()}{action.summary[1:]}."
        )
        action.add_arguments(subparser)
        subparser.set_defaults(keystore_action=action)


def run(arguments: argparse.Namespace) -> int:
    action: _Action = arguments.keystore_action
    return run_lazily(action.module, action.function, arguments)


# --- the subcommands -----------------------------------------------------------------------------------------


def _create(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("folder", type=Path, metavar="DIR", help="where the keystore is to be")
    parser.add_argument(
        "--identity", action="append", required=True, metavar="NAME", dest="identities",
        help="an identity, in a folder of its own below DIR/enclaves; repeatable",
    )  # fmt: skip
    parser.add_argument(
        "--subject", default="/CN={name}", metavar="NAME",
        help="the pattern of subjects, such as '/O=Example/CN={name}' (default: /CN={name})",
    )  # fmt: skip
    for add in (add_domains, add_algorithm, add_days, add_force, add_governance, add_rights):
        add(parser)


def _ca(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("certificate", type=Path, metavar="CERT", help="the file for the certificate")
    parser.add_argument("key", type=Path, metavar="KEY", help="the file for the private key")
    parser.add_argument("--subject", required=True, metavar="NAME", help="/O=Example/CN=Identity CA, or as RFC 4514")
    for add in (add_algorithm, add_days, add_password, add_force):
        add(parser)


def _identity(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("certificate", type=Path, metavar="CERT", help="the file for the certificate")
    parser.add_argument("key", type=Path, metavar="KEY", help="the file for the private key")
    parser.add_argument("--subject", required=True, metavar="NAME", help="/O=Example/CN=alice, or CN=alice,O=Example")
    add_authority(parser, "identity")
    for add in (add_algorithm, add_days, add_force):
        add(parser)


def _governance(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("signed", type=Path, metavar="SIGNED", help="the file for the signed document: governance.p7s")
    parser.add_argument("--xml", type=Path, metavar="FILE", help="sign this document, instead of one made from options")
    add_authority(parser, "permissions")
    for add in (add_domains, add_force, add_governance):
        add(parser)


def _permissions(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("signed", type=Path, metavar="SIGNED", help="the file for the signed document: permissions.p7s")
    parser.add_argument("--xml", type=Path, metavar="FILE", help="sign this document, instead of one made from options")
    parser.add_argument(
        "--certificate", action="append", type=Path, default=[], metavar="FILE", dest="certificates",
        help="whose permissions: the identity's certificate; repeatable",
    )  # fmt: skip
    parser.add_argument(
        "--subject", action="append", default=[], metavar="NAME", dest="subjects",
        help="whose permissions, by name; repeatable",
    )  # fmt: skip
    add_authority(parser, "permissions")
    for add in (add_domains, add_days, add_force, add_rights):
        add(parser)


def _enclave(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("folder", type=Path, metavar="DIR", help="a keystore: ours, of ROS 2's tools, or of openssl")
    parser.add_argument("name", metavar="NAME", help="the identity: alice, or /robot/arm")
    parser.add_argument("--subject", default="/CN={name}", metavar="NAME", help="its subject (default: /CN={name})")
    for add in (add_domains, add_algorithm, add_days, add_password, add_force, add_rights):
        add(parser)


def _check(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("folders", type=Path, nargs="*", metavar="DIR", help="keystores, or folders of one identity")
    parser.add_argument("--soon", type=int, default=_DEFAULT_DAYS_TO_EXPIRY, metavar="DAYS",
                        help="warn so long before something expires (default: 30)")  # fmt: skip
    parser.add_argument("--ignore", action="append", default=[], metavar="RULE", help="not this rule; repeatable")
    parser.add_argument("--rules", action="store_true", help="list the rules and end")
    add_json(parser)


def _show(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("paths", type=Path, nargs="+", metavar="FILE",
                        help="certificates, keys, governance and permissions; of a folder, all there are")  # fmt: skip
    add_json(parser)


class _Action(NamedTuple):
    summary: str
    add_arguments: Callable[[argparse.ArgumentParser], None]
    module: str
    function: str


_ACTIONS: Final = {
    "create": _Action("make all that a domain needs: authorities, identities, documents", _create, "making", "create"),
    "ca": _Action("make a certificate authority", _ca, "making", "make_authority"),
    "identity": _Action("make the certificate and key of an identity", _identity, "making", "make_identity"),
    "governance": _Action("sign a governance document, or make one", _governance, "making", "make_governance"),
    "permissions": _Action("sign a permissions document, or make one", _permissions, "making", "make_permissions"),
    "enclave": _Action("add an identity to a keystore", _enclave, "making", "make_enclave"),
    "check": _Action("find what is wrong in a keystore, and what to do about it", _check, "checking", "check"),
    "show": _Action("say what certificates, keys and documents hold", _show, "showing", "show"),
    "explain": _Action(
        explain_command.SUMMARY, explain_command.add_arguments, explain_command.MODULE, explain_command.FUNCTION
    ),
}
