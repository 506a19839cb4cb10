"""Which nested structs get a function of their own in generated code, and which are written in line.

In line is faster, since runs merge.  A struct that contains itself must be a function; and so must the rest of a
type whose nesting multiplies beyond a bound, or the source would grow exponentially with its depth.
"""

from __future__ import annotations

from .model import StructType, nested_structs, reachable_structs

__all__ = ["FunctionPlan", "is_recursive"]

_MOST_INLINED = 128
"""Structs put in line in one generated module; those beyond become functions."""


def is_recursive(struct: StructType) -> bool:
    """Whether values of the struct may contain values of itself."""
    return any(
        inner is struct
        for member in struct.members
        for nested in nested_structs(member.type)
        for inner in reachable_structs(nested)
    )


class FunctionPlan:
    """Decides while one module is generated."""

    def __init__(self, root: StructType) -> None:
        self._recursive = {id(struct) for struct in reachable_structs(root) if is_recursive(struct)}
        self._functions: dict[int, str] = {}
        self._inlined = 0

    def function(self, struct: StructType) -> tuple[str, bool] | None:
        """None: write it in line.  Else the function's name, and True when it is yet to be written."""
        known = self._functions.get(id(struct))
        if known is not None:
            return known, False
        if id(struct) not in self._recursive and self._inlined < _MOST_INLINED:
            self._inlined += 1
            return None
        name = f"{struct.python_class.__name__}_{len(self._functions)}"
        self._functions[id(struct)] = name
        return name, True
