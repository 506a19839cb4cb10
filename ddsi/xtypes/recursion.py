"""Which nested structs get a function of their own in generated code, and which are written in line.

In line is faster, since runs merge.  A struct that contains itself must be a function; so must one nested deeply, as
Python bounds the nesting of blocks; and so must the rest of a type whose nesting multiplies beyond a bound, or the
source would grow exponentially with its depth.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from .components import strongly_connected
from .model import Composite, nested_structs

__all__ = ["DEEPEST_COLLECTION", "FunctionPlan", "is_recursive"]

_MOST_INLINED = 128
"""Structs put in line in one generated module; those beyond become functions."""

_DEEPEST_INLINED = 8
"""Structs and loops inside one another, up to which a struct is put in line.  Python nests 20 loops, and the struct's
own members may have ``DEEPEST_COLLECTION`` more."""

DEEPEST_COLLECTION = 12
"""Sequences, arrays and maps of one member inside one another."""


def is_recursive(struct: Composite) -> bool:
    """Whether values of the struct may contain values of itself."""
    return struct in _recursive(struct)


def _recursive(root: Composite) -> set[Composite]:
    """Of all structs and unions that ``root`` may contain, itself included, those whose values may contain their kind.

    Found together, in time linear in the type: asking each struct for itself is quadratic, and types come from peers.
    """
    _, components = strongly_connected(root, _nested)
    return {struct for one in components for struct in one if len(one) > 1 or struct in _nested(struct)}


def _nested(struct: Composite) -> list[Composite]:
    return [nested for member in struct.members for nested in nested_structs(member.type)]


class FunctionPlan:
    """Decides while one module is generated."""

    def __init__(self, root: Composite) -> None:
        self._recursive = _recursive(root)
        self._functions: dict[int, str] = {}
        self._inlined = 0
        self._depth = 0
        self._inlining_all = False

    def function(self, struct: Composite) -> tuple[str, bool] | None:
        """None: write it in line.  Else the function's name, and True when it is yet to be written."""
        if self._inlining_all:
            return None
        known = self._functions.get(id(struct))
        if known is not None:
            return known, False
        fits = self._inlined < _MOST_INLINED and self._depth < _DEEPEST_INLINED
        if fits and struct not in self._recursive:
            self._inlined += 1
            return None
        name = f"{struct.python_class.__name__}_{len(self._functions)}"
        self._functions[id(struct)] = name
        return name, True

    @contextmanager
    def inside(self, depth: int | None = None) -> Iterator[None]:
        """While a struct is written in line, or a loop; ``depth`` 0 while it is written as a function."""
        before = self._depth
        self._depth = before + 1 if depth is None else depth
        yield
        self._depth = before

    @contextmanager
    def inlining_all(self) -> Iterator[None]:
        """While a struct is written of which all parts are known to be few, and none recursive."""
        before, self._inlining_all = self._inlining_all, True
        yield
        self._inlining_all = before
