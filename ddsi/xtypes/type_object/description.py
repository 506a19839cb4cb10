"""All that other programs may be told of a type of ours: its TypeInformation and the TypeObjects behind it."""

from __future__ import annotations

from ...structure.dataclass import dataclass
from ..model import Composite
from .builder import BuiltTypes, build
from .information import TypeInformation, information_of
from .kinds import COMPLETE

__all__ = ["TypeDescription", "describe", "remember"]


@dataclass(frozen=True, slots=True)
class TypeDescription:
    """``minimal`` and ``complete``: the TypeObjects of the type and of all that it needs."""

    minimal: BuiltTypes
    complete: BuiltTypes
    information: TypeInformation


_ATTRIBUTE = "__idl_description__"
"""Where a class that was made of somebody's TypeObjects keeps these; looked for in the class itself alone."""


def describe(composite: Composite) -> TypeDescription:
    """BadParameter where an annotation names what is not defined."""
    known: TypeDescription | None = composite.python_class.__dict__.get(_ATTRIBUTE)
    if known is not None:
        return known
    minimal, complete = build(composite, is_complete=False), build(composite, is_complete=True)
    return TypeDescription(minimal, complete, information_of(minimal, complete))


def remember(composite: Composite, types: BuiltTypes, information: TypeInformation | None) -> None:
    """From now on :func:`describe` gives these TypeObjects, as the type was made of them; what they leave open is ours.

    ``information`` is what their author announced.
    """
    is_complete = types.root.kind == COMPLETE
    minimal = build(composite, is_complete=False) if is_complete else types
    complete = types if is_complete else build(composite, is_complete=True)
    description = TypeDescription(minimal, complete, information or information_of(minimal, complete))
    setattr(composite.python_class, _ATTRIBUTE, description)
