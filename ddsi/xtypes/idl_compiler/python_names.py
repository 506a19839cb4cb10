"""What declarations are called in Python: one flat scope of unique names, and names that Python keeps for itself.

A declaration has its own name where that is free; of two with one name in different modules, each has its module's
before it.  A member or literal whose name is no name in Python gets an underscore behind it.
"""

from __future__ import annotations

from collections.abc import Iterable

from .declarations import Declaration, Module
from .python_identifiers import literal_identifier, literal_name_in_idl, python_identifier

__all__ = ["literal_identifier", "literal_name_in_idl", "python_identifier", "python_names"]


def python_names(root: Module, declarations: Iterable[Declaration]) -> dict[Declaration, str]:
    """A unique global name for each declaration; outermost modules keep theirs, as they become classes."""
    taken = {python_identifier(member.name) for member in root.members.values() if isinstance(member, Module)}
    counts: dict[str, int] = {}
    found = list(declarations)
    for declaration in found:
        counts[declaration.name] = counts.get(declaration.name, 0) + 1
    names: dict[Declaration, str] = {}
    for declaration in sorted(found, key=lambda declaration: len(declaration.path) > 1):  # those without a module first
        plain = declaration.name
        is_free = counts[plain] == 1 or len(declaration.path) == 1
        if is_free and python_identifier(plain) == plain and plain not in taken:
            name = plain
        else:
            name = python_identifier("_".join(declaration.path), taken)
        names[declaration] = name
        taken.add(name)
    return names
