"""``ddsi idl``: an IDL file as Python source, on standard output or in a file.

The work is done by the IDL compiler of ``ddsi.xtypes``; here are the options, the file, and what is said of errors and
of what was left out.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from ..xtypes import Extensibility
from ..xtypes.idl_compiler import IdlError
from ..xtypes.idl_compiler.loading import compile_file
from ..xtypes.idl_compiler.python_source import PythonSource
from .exit_status import ExitStatus

__all__ = ["SUMMARY", "add_arguments", "run"]

SUMMARY = "make Python types from an IDL file"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("file", type=Path, metavar="FILE.idl", help="the IDL file")
    parser.add_argument(
        "-o", "--output", type=Path, metavar="FILE.py", help="write there; by default to standard output"
    )
    parser.add_argument(
        "-I",
        "--include",
        type=Path,
        action="append",
        default=[],
        metavar="FOLDER",
        help="where #include looks, behind the file's own folder; may be given several times",
    )
    parser.add_argument(
        "-D",
        "--define",
        type=_definition,
        action="append",
        default=[],
        metavar="NAME[=VALUE]",
        help="a macro that is there from the start; may be given several times",
    )
    parser.add_argument(
        "--default-extensibility",
        type=Extensibility,
        choices=list(Extensibility),
        default=Extensibility.APPENDABLE,
        metavar="KIND",
        help="of types that say none: appendable (default, as in IDL 4.2), final or mutable",
    )


def run(arguments: argparse.Namespace) -> int:
    try:
        compilation = compile_file(
            arguments.file,
            include=arguments.include,
            defines=dict(arguments.define),
            default_extensibility=arguments.default_extensibility,
        )
    except IdlError as error:
        print(error, file=sys.stderr)  # whole: the line with its caret is half of what it says
        return ExitStatus.USAGE
    for warning in compilation.warnings:
        print(f"{warning.place}: warning: {warning.reason}", file=sys.stderr)
    text = PythonSource(compilation, arguments.file.name).text()
    if arguments.output is None:
        sys.stdout.write(text)
    else:
        arguments.output.write_text(text, encoding="utf-8")
    return ExitStatus.OK


def _definition(text: str) -> tuple[str, str]:
    """``NAME=VALUE``, or ``NAME``, which is 1."""
    name, _, value = text.partition("=")
    if not (name.isascii() and name.isidentifier()):
        raise argparse.ArgumentTypeError(f"NAME or NAME=VALUE is wanted, not {text!r}")
    return name, value if "=" in text else "1"
