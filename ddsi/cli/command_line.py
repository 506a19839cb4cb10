"""``main``: finds the subcommand, reads its options, runs it, and turns errors into a sentence and a status."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from importlib import import_module, metadata
from typing import Any, NoReturn, Protocol, cast

from ..structure.errors import DdsError
from ..transport.wall_clock import wall_clock
from .exit_status import CommandError, ExitStatus
from .runner import abandon_output

__all__ = ["ENTRY_POINT_GROUP", "Command", "main"]

ENTRY_POINT_GROUP = "ddsi.cli"

_COMMANDS = {
    "ls": "list participants, topics and endpoints of a domain",
    "typeof": "show the IDL of a topic's type, as those who use it announce it",
    "echo": "print the samples of a topic, of whatever type, as they come",
    "pub": "write samples to a topic, of whatever type",
    "why": "say why endpoints of a topic do not match, and what to do",
    "shapes": "publish or subscribe the shapes of the OMG's demo, drawn in the terminal",
    "trace": "watch or record what goes over the wire, or draw a recording",
    "sim": "run a scenario over a simulated network, from a seed",
    "persist": "keep what transient and persistent writers write, for readers that come when they are gone",
    "idl": "make Python types from an IDL file",
    "demo": "show live data flowing between processes on this host",
    "doctor": "check interfaces, sockets, multicast, buffers and configuration",
    "bench": "measure this stack beside the C-backed Python binding, and print ratios",
}
"""The subcommands of this room, each a module of its name, with the line that ``ddsi --help`` gives it."""


class Command(Protocol):
    """What a subcommand is: a module, or what an entry point of the group ``ddsi.cli`` names."""

    SUMMARY: str
    """A line for ``ddsi --help``."""

    def add_arguments(self, parser: argparse.ArgumentParser) -> None:
        """Declare options and positional arguments."""

    def run(self, arguments: argparse.Namespace) -> int:
        """Do it; returns the exit status.  CommandError and DdsError become one sentence and status 2.

        A command of another package finds in ``arguments.wall_clock`` a function that gives the ns since 1970.
        """
        ...


class _Parser(argparse.ArgumentParser):
    """One sentence for a mistake, instead of the usage and a sentence.

    ``is_intermixed``: options may stand between arguments too, as in ``ddsi pub TOPIC -n 3 x=1``.
    """

    is_intermixed = False

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:  # pyright: ignore[reportIncompatibleMethodOverride]
        if not self.is_intermixed:
            return super().parse_known_args(args, namespace)
        self.is_intermixed = False  # what follows calls this
        try:
            return self.parse_known_intermixed_args(args, namespace)
        finally:
            self.is_intermixed = True

    def error(self, message: str) -> NoReturn:
        self.exit(ExitStatus.USAGE, f"{self.prog}: {message}; see {self.prog} --help\n")


def main(words: Sequence[str] | None = None) -> int:
    """Run the command line ``words`` (default: the process's own) and return the exit status.

    ``--help``, ``--version`` and wrong arguments raise SystemExit, as argparse does.
    """
    words = sys.argv[1:] if words is None else list(words)
    _tolerate_narrow_encodings()
    name = f"ddsi {words[0]}" if words else "ddsi"
    try:
        command, arguments = _parse(words)
        status = command.run(arguments)
        if sys.stdout is not None:
            sys.stdout.flush()
        return status
    except KeyboardInterrupt:
        return ExitStatus.INTERRUPTED
    except BrokenPipeError:
        abandon_output()
        return ExitStatus.BROKEN_PIPE
    except (CommandError, DdsError) as error:
        return _complain(name, str(error))
    except OSError as error:
        return _complain(name, _os_error_text(error))


def _parse(words: Sequence[str]) -> tuple[Command, argparse.Namespace]:
    """The subcommand and its arguments.  Only the chosen one is imported, as start-up is waited for by a person."""
    chosen = words[0] if words and not words[0].startswith("-") else ""
    parser = _Parser(
        prog="ddsi",
        description="See and try what happens in a DDS domain.",
        epilog="`ddsi COMMAND --help` tells the options of a command.  DDSI_URI chooses interfaces and peers.",
    )
    parser.add_argument("--version", action="version", version=f"ddsi {_version()}")
    subparsers = parser.add_subparsers(metavar="COMMAND", required=True)
    command: Command | None = None
    if chosen in _COMMANDS:
        command = cast(Command, import_module(f"{__package__}.{chosen}"))
        _add(subparsers, chosen, command)
    for name, summary in _COMMANDS.items():
        if name != chosen:
            subparsers.add_parser(name, help=summary)
    if command is None:
        command = _add_foreign(subparsers, chosen)
    arguments = parser.parse_args(words, argparse.Namespace(wall_clock=wall_clock))
    if command is None:
        parser.error("a command is wanted")
    return command, arguments


def _add(subparsers: argparse._SubParsersAction[_Parser], name: str, command: Command) -> None:
    subparser = subparsers.add_parser(name, help=command.SUMMARY, description=_sentence(command.SUMMARY))
    command.add_arguments(subparser)
    subparser.is_intermixed = getattr(command, "IS_INTERMIXED", False)


def _add_foreign(subparsers: argparse._SubParsersAction[_Parser], chosen: str) -> Command | None:
    """Subcommands of installed packages: the chosen one is returned; for the help, all are asked for their line."""
    found: Command | None = None
    for entry_point in metadata.entry_points(group=ENTRY_POINT_GROUP):
        if entry_point.name in subparsers.choices:
            continue
        if chosen and entry_point.name != chosen:
            subparsers.add_parser(entry_point.name)  # named where the chosen one is not known
            continue
        try:
            command: Command = entry_point.load()
        except Exception as error:  # a broken package must not take the others with it
            if chosen:
                raise CommandError(f"{entry_point.value} cannot be loaded: {error}") from error
            subparsers.add_parser(entry_point.name, help=f"cannot be loaded: {error}".replace("%", "%%"))
            continue
        _add(subparsers, entry_point.name, command)
        found = command if entry_point.name == chosen else found
    return found


def _sentence(summary: str) -> str:
    return f"{summary[:1].upper()}{summary[1:]}."


def _version() -> str:
    try:
        return metadata.version("ddsi")
    except metadata.PackageNotFoundError:
        return "(not installed)"


def _complain(name: str, sentence: str) -> int:
    print(f"{name}: {' '.join(sentence.split())}", file=sys.stderr)
    return ExitStatus.USAGE


def _os_error_text(error: OSError) -> str:
    if error.filename is not None:
        return f"{error.filename}: {error.strerror}"
    return error.strerror or str(error)


def _tolerate_narrow_encodings() -> None:
    """A terminal without Unicode shows "?" rather than a traceback."""
    for stream in (sys.stdout, sys.stderr):
        reconfigure = getattr(stream, "reconfigure", None)
        if reconfigure is not None:
            reconfigure(errors="replace")
