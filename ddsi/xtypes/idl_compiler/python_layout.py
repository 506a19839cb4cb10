"""Python text in lines of bounded width, in the form that ``ruff format`` and ``black`` leave as it is.

An expression is a string, or a :class:`Group` of expressions in brackets; a group that does not fit its line has each
part on a line of its own, with a comma behind the last.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

__all__ = ["Expression", "Group", "call", "docstring", "laid_out", "quoted", "subscript"]

_WIDTH = 88
_INDENT = 4


@dataclass(frozen=True, slots=True)
class Group:
    """``head(parts)`` or ``head[parts]``, and perhaps ``tail`` behind it."""

    head: str
    brackets: str
    parts: tuple[Expression, ...]
    tail: str = ""

    def __str__(self) -> str:
        inside = ", ".join(map(str, self.parts))
        return f"{self.head}{self.brackets[0]}{inside}{self.brackets[1]}{self.tail}"


Expression = str | Group


def call(function: str, parts: Sequence[Expression]) -> Group:
    return Group(function, "()", tuple(parts))


def subscript(head: str, *parts: Expression) -> Group:
    return Group(head, "[]", parts)


def laid_out(expression: Expression, before: str, behind: str = "") -> str:
    """``before``, the expression and ``behind``, in as many lines as it takes; ``before`` begins with the indent."""
    line = f"{before}{expression}{behind}"
    if len(line) <= _WIDTH:
        return line
    indent = " " * (len(before) - len(before.lstrip()))
    if isinstance(expression, str):
        longest = max(len(before) + 1, len(indent) + _INDENT + len(expression))
        fits = before.endswith(" = ") and longest <= _WIDTH
        return f"{before}(\n{indent}{' ' * _INDENT}{expression}\n{indent})" if fits else line
    # A single part of a subscript takes no comma behind it: it would become a tuple.
    comma = "" if expression.brackets == "[]" and len(expression.parts) == 1 else ","
    parts = [laid_out(part, indent + " " * _INDENT, comma) for part in expression.parts]
    opening = f"{before}{expression.head}{expression.brackets[0]}"
    return "\n".join([opening, *parts, f"{indent}{expression.brackets[1]}{expression.tail}{behind}"])


def quoted(text: str) -> str:
    """A literal of a string, in double quotes unless single ones spare escapes."""
    literal = repr(text)
    if literal.startswith("'") and '"' not in text:
        return '"' + literal[1:-1].replace("\\'", "'") + '"'
    return literal


def docstring(text: str, indent: str) -> list[str]:
    """The lines of a docstring."""
    text = text.replace("\\", "\\\\").replace('"""', "'''")
    lines = [line.rstrip() for line in text.splitlines()]
    if len(lines) <= 1:
        only = lines[0] if lines else ""
        return [f'{indent}"""{only}{" " if only.endswith(chr(34)) else ""}"""']
    rest = [f"{indent}{line}" if line else "" for line in lines[1:]]
    return [f'{indent}"""{lines[0]}', *rest, f'{indent}"""']
