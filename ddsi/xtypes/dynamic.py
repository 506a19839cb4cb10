"""Types that this program has no source of: what others tell of a type, as a class to be used like any other.

    types = ddsi.type_objects(Pose)      # what this program would tell; or, of somebody else's topic,
    types = await participant.type_objects(participant.discovered_publications()[0])

    Pose = ddsi.dynamic_type(types)
    sample = Pose(x=1.0)

DDS-XTypes 1.3 §7.6.4.  The class remembers what it was made of: it is announced under the identifiers that its author
gave it, also where this program would have made others of it, as vendors set flags differently.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from .model import StructType, UnionType
from .octets import composite_of

if TYPE_CHECKING:
    from .type_object import BuiltTypes, TypeInformation

__all__ = ["dynamic_type", "type_objects"]


def type_objects(python_class: type[Any], *, complete: bool = True) -> BuiltTypes:
    """The TypeObjects of a class that is a topic type, and of all types that it needs (DDS-XTypes 1.3 §7.3.4).

    ``.root`` is the class's TypeIdentifier, ``.objects`` and ``.octets`` hold them by identifier, as values and as they
    are sent.  ``complete``: with names, or the minimal ones, which have hashes in their place.

    Raises BadParameter for a class that is neither struct nor union, or whose annotations cannot be resolved.
    """
    from .type_object import describe

    description = describe(composite_of(python_class))
    return description.complete if complete else description.minimal


def dynamic_type(
    types: BuiltTypes, *, type_name: str | None = None, information: TypeInformation | None = None
) -> type[Any]:
    """A class for the type that TypeObjects describe: as if ``@idl.struct`` had decorated its source.

    ``type_name`` is the name under which it is announced (default: that in the TypeObject); ``information`` what its
    author announced, to be announced again.  Names that are none in Python are changed: ``from`` becomes ``from_``.
    Types made of minimal TypeObjects have members such as ``member_3``, called by their ids, since nobody told more.

    Raises BadParameter, naming type, member and reason, for TypeObjects that are inconsistent, incomplete, or too
    large: more than 512 types, 2048 members in one, 64 types inside one another.
    """
    from .dynamic_classes import make_class
    from .resolution import named_type
    from .type_object.description import remember

    python_class = make_class(types, type_name)
    found = named_type(python_class)
    if isinstance(found, (StructType, UnionType)):
        remember(found, types, information)
    return python_class
