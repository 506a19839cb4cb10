"""``ddsi sim handshake``: two secured participants meet, message by message; one message may be lost on its way.

Engines over a simulated network and clock, and the security that is installed: what is told is what they do
(:mod:`.sim_walk`).  The walk follows from the seed and the keystore; one that is made on the spot has other keys each
time, so certificates and signatures may differ by some octets.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

from ..config.secure import secure
from ..simulation import Vendor
from ..structure.qos_policies import Properties
from .command_line import main
from .exit_status import CommandError, ExitStatus
from .sim_handshake_words import KINDS
from .sim_walk import Walk
from .terminal import can_print, terminal_width

__all__ = ["add_arguments", "run"]

_NAMES = ("alice", "bob")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    group = parser.add_argument_group("handshake: two secured participants meet, message by message")
    group.add_argument(
        "--drop", type=_dropped, metavar="MESSAGE",
        help=f"lose the first {', '.join(list(KINDS)[:-1])} or {list(KINDS)[-1]}, or the message of this number, once",
    )  # fmt: skip
    group.add_argument("--step", action="store_true", help="on a terminal: wait for Enter before each datagram")
    group.add_argument(
        "--keystore", type=Path, metavar="DIR", help="the first two identities of this one; default: made on the spot"
    )


def _dropped(text: str) -> str | int:
    """The name of a kind of message, or its number."""
    if text.isascii() and text.isdecimal() and int(text[:9]) > 0:
        return int(text[:9])
    name = text.lower().replace("_", "-").replace(" ", "-")
    if name not in KINDS:
        raise argparse.ArgumentTypeError(f"{text!r} is none of {', '.join(KINDS)}, and no number of a message")
    return name


def run(arguments: argparse.Namespace, vendor: Vendor | None) -> int:
    """Walk, and say at the end what became of the message that was lost; the status tells whether it was repaired.

    ``vendor``: whom the second of the two plays, if not us.
    """
    with _identities(arguments.keystore) as identities:
        walk = Walk(
            identities,
            seed=arguments.seed,
            vendor=vendor,
            dropped=arguments.drop,
            started_ns=arguments.wall_clock(),
            width=terminal_width(),
            ascii_only=not can_print("→✗§"),
            pause=_wait_for_enter if arguments.step and _is_watched() else None,
        )
        is_done = walk.run()
    return ExitStatus.OK if is_done else ExitStatus.NOT_AS_HOPED


def _is_watched() -> bool:
    """Is there a person, who can press Enter?"""
    return sys.stdin is not None and sys.stdin.isatty() and sys.stdout.isatty()


def _wait_for_enter() -> bool:
    """Whether to wait again next time: not when there is nobody any more."""
    try:
        return input("                      Enter: go on; q: go on to the end ").strip() != "q"
    except EOFError:
        return False


@contextlib.contextmanager
def _identities(keystore: Path | None) -> Iterator[dict[str, Properties]]:
    """The security properties of two, by name."""
    if keystore is not None:
        yield _read(keystore)
        return
    with tempfile.TemporaryDirectory(prefix="ddsi-handshake-") as folder:
        made = Path(folder) / "keystore"
        words = ["keystore", "create", str(made), "--topic", "Square"]
        for name in _NAMES:
            words += ["--identity", name]
        complaint = io.StringIO()
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(complaint):
            try:
                status = main(words)
            except SystemExit:  # nobody provides the command
                status = ExitStatus.USAGE
        if status:
            said = complaint.getvalue().strip().removeprefix("ddsi keystore: ") or "no command for it"
            raise CommandError(f"no keystore can be made: {said}")
        yield _read(made)


def _read(keystore: Path) -> dict[str, Properties]:
    folders = sorted(path.parent for path in (keystore / "enclaves").glob("*/cert.pem"))
    if len(folders) < len(_NAMES):
        raise CommandError(
            f"{keystore} is no keystore with two identities below its folder enclaves: "
            "`ddsi keystore create DIR --identity alice --identity bob` makes one"
        )
    return {folder.name: secure(folder).properties or {} for folder in folders[: len(_NAMES)]}
