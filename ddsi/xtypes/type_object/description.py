"""All that other programs may be told of a type of ours: its TypeInformation and the TypeObjects behind it."""

from __future__ import annotations

from ...structure.dataclass import dataclass
from ..model import Composite
from .builder import BuiltTypes, build
from .information import TypeInformation, information_of

__all__ = ["TypeDescription", "describe"]


@dataclass(frozen=True, slots=True)
class TypeDescription:
    """``minimal`` and ``complete``: the TypeObjects of the type and of all that it needs."""

    minimal: BuiltTypes
    complete: BuiltTypes
    information: TypeInformation


def describe(composite: Composite) -> TypeDescription:
    """BadParameter where an annotation names what is not defined."""
    minimal, complete = build(composite, is_complete=False), build(composite, is_complete=True)
    return TypeDescription(minimal, complete, information_of(minimal, complete))
