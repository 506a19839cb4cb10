"""Does an object have the operations of a plugin interface?  Asked once, when a plugin is loaded.

A type checker knows it better and sooner; but who writes a plugin may have none, and a wrong name would show only when
a peer comes.  Looks at names and parameters, not at types; conventions: :mod:`ddsi_security.plugins`.
"""

from __future__ import annotations

import inspect
from collections.abc import Iterator, Mapping

__all__ = ["bypassed", "objections"]

_BY_POSITION_OR_NAME = inspect.Parameter.POSITIONAL_OR_KEYWORD
_VARIABLE = {inspect.Parameter.VAR_POSITIONAL, inspect.Parameter.VAR_KEYWORD}


def objections(plugin: object, interface: type) -> list[str]:
    """What keeps ``plugin`` from being an ``interface``, a clause each; operations that are missing come first."""
    operations = {
        name: function
        for name, function in inspect.getmembers(interface, inspect.isfunction)
        if not name.startswith("_")
    }
    missing = [name for name in operations if not callable(getattr(plugin, name, None))]
    found = [f"lacks {', '.join(missing[:4])}" + (f" and {len(missing) - 4} more" if missing[4:] else "")]
    return (found if missing else []) + [
        f"{name} {objection}"
        for name, function in operations.items()
        if name not in missing
        for objection in _objections_to_operation(getattr(plugin, name), function)
    ]


def bypassed(plugin: object, short_ways: Mapping[str, tuple[str, ...]]) -> list[str]:
    """What is overridden in ``plugin`` and yet never called, since a short way that it inherits goes past it.

    ``short_ways``: which operations each of them stands for.  A clause each, as of :func:`objections`.
    """
    classes = type(plugin).__mro__
    return [
        f"{operation} is overridden, but {short_way}, which it inherits, goes past it: override that too"
        for short_way, operations in short_ways.items()
        for operation in operations
        if _depth(operation, classes) < _depth(short_way, classes) < len(classes)
    ]


def _depth(name: str, classes: tuple[type, ...]) -> int:
    """Which of the classes is the first to define it; their number if none does."""
    return next((depth for depth, one in enumerate(classes) if name in vars(one)), len(classes))


def _objections_to_operation(given: object, function: object) -> Iterator[str]:
    assert callable(given)
    assert callable(function)
    if inspect.iscoroutinefunction(given):
        yield "is async: return Pending(job) for slow work"
    expected = list(inspect.signature(function).parameters.values())[1:]  # without self
    try:
        parameters = list(inspect.signature(given).parameters.values())
    except ValueError:  # written in C, without a signature that can be read
        return
    if not _takes(parameters, expected):
        yield f"takes ({_list(parameters)}) instead of ({_list(expected)})"


def _takes(given: list[inspect.Parameter], expected: list[inspect.Parameter]) -> bool:
    """Can it be called as the interface says: the first ones by position or by name, the others by name?"""
    positional = [parameter.name for parameter in expected if parameter.kind is _BY_POSITION_OR_NAME]
    names = {parameter.name for parameter in expected}
    takes_any = {parameter.kind for parameter in given if parameter.kind in _VARIABLE}
    if takes_any == _VARIABLE:
        return True
    named = [parameter for parameter in given if parameter.kind not in _VARIABLE]
    by_name = {parameter.name for parameter in named if parameter.kind is not inspect.Parameter.POSITIONAL_ONLY}
    in_order = [parameter.name for parameter in named if parameter.kind is _BY_POSITION_OR_NAME]
    return (
        in_order[: len(positional)] == positional
        and (names <= by_name or inspect.Parameter.VAR_KEYWORD in takes_any)
        and all(parameter.name in names or parameter.default is not parameter.empty for parameter in named)
    )


def _list(parameters: list[inspect.Parameter]) -> str:
    """The parameters as they would be written, without types and defaults."""
    bare = [parameter.replace(annotation=parameter.empty) for parameter in parameters]
    return str(inspect.Signature(bare))[1:-1]
