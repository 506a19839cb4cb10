"""Scopes: who is meant by a name (OMG IDL 4.2 §7.5).

A name is looked for from the innermost module outwards, an absolute one (``::a::b``) from the file's own scope.  Names
keep their case, but no two in one scope may differ in case only, and a use must spell what was declared.
"""

from __future__ import annotations

import difflib

from .declarations import Declaration, EnumDeclaration, Module
from .source_text import IdlError, Place
from .syntax import Name

__all__ = ["declare", "look_up"]

_LONGEST_COMPARED = 64
"""Characters; comparing takes quadratic time."""


def declare(scope: Module, declaration: Declaration) -> None:
    """Add a declaration to a scope.  IdlError where the name is taken, be it in other case."""
    name = declaration.name
    taken = scope.folded.get(name.lower())
    if taken is not None:
        earlier = scope.members[taken]
        where = f"at {earlier.place}"
        if taken == name:
            raise IdlError(declaration.place, f"{name} is defined already, {where}")
        raise IdlError(declaration.place, f"{name} differs from {taken}, defined {where}, only in case")
    scope.members[name] = declaration
    scope.folded[name.lower()] = name


def look_up(name: Name, scope: Module) -> Declaration:
    """What a name means in a scope.  IdlError, with the nearest name that is known, where it means nothing."""
    innermost: Module | None = scope
    if name.is_absolute:
        innermost = _root(scope)
    first = name.parts[0]
    while innermost is not None:
        found = _member(innermost, first, name.place)
        if found is not None:
            return _inner(found, name)
        innermost = None if name.is_absolute else innermost.parent
    raise IdlError(name.place, f"{name} is not defined{_nearest(first, scope)}")


def _inner(found: Declaration, name: Name) -> Declaration:
    for part in name.parts[1:]:
        inner: Declaration | None = None
        if isinstance(found, Module):
            inner = _member(found, part, name.place)
        elif isinstance(found, EnumDeclaration):  # not IDL, where literals belong to the scope around, but common
            inner = next((literal for literal in found.literals if literal.name == part), None)
        if inner is None:
            near = _nearest(part, found) if isinstance(found, Module) else ""
            raise IdlError(name.place, f"{name} is not defined: {found.scoped_name} has no {part}{near}")
        found = inner
    return found


def _member(scope: Module, name: str, place: Place) -> Declaration | None:
    spelt = scope.folded.get(name.lower())
    if spelt is not None and spelt != name:
        raise IdlError(place, f"{name} is not defined; {scope.members[spelt].scoped_name} differs from it in case")
    return None if spelt is None else scope.members[spelt]


def _nearest(name: str, scope: Module) -> str:
    known: list[str] = []
    around: Module | None = scope
    while around is not None and len(known) < 2_000:
        known += around.members
        around = around.parent
    if len(name) > _LONGEST_COMPARED:
        return ""
    known = [candidate for candidate in known[:2_000] if len(candidate) <= _LONGEST_COMPARED]
    close = difflib.get_close_matches(name, known, n=1)
    return f"; is {close[0]} meant?" if close else ""


def _root(scope: Module) -> Module:
    while scope.parent is not None:
        scope = scope.parent
    return scope
