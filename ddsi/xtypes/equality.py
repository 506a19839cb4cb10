"""Equality of samples by value: a list of numbers equals the ``array.array`` that it comes back as."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

__all__ = ["same", "same_members"]


def same_members(self: Any, other: Any) -> bool:
    """``__eq__`` of every IDL struct: same class and equal members, whatever kind of sequence holds elements."""
    if other.__class__ is not self.__class__:
        return NotImplemented  # type: ignore[no-any-return]
    return all(same(getattr(self, field.name), getattr(other, field.name)) for field in fields(self))


def same(one: Any, other: Any) -> bool:
    """Equality of two values of members."""
    if one is other:
        return True
    if isinstance(one, dict) and isinstance(other, dict):
        return one.keys() == other.keys() and all(same(value, other[key]) for key, value in one.items())
    if _has_elements(one) and _has_elements(other) and not (type(one) is type(other) and isinstance(one, (str, bytes))):
        return len(one) == len(other) and all(map(same, _items(one), _items(other)))
    return bool(one == other)


def _has_elements(value: Any) -> bool:
    return hasattr(value, "__len__") and not isinstance(value, int)  # an IntFlag has a length too


def _items(value: Any) -> Any:
    return value.tolist() if hasattr(value, "tolist") else value
