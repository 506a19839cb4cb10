"""The ``ddsi`` command.  Not a chapter of any specification; ``docs/cli.md`` says what each subcommand does.

Subcommands are modules of this room, imported when they are used; those of other packages come by the entry point
group ``ddsi.cli``.
"""

from .command_line import main

__all__ = ["main"]
