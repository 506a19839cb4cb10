"""TypeLookup: asks other participants for TypeObjects, and answers them (DDS-XTypes 1.3 §7.6.3.3)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..structure.guid import Guid
from ..xtypes.type_object import BuiltTypes, HashedIdentifier, TypeInformation, TypeObject
from .type_registry import TypeRegistry

if TYPE_CHECKING:
    from .participant import Participant

__all__ = ["TypeLookup"]


class TypeLookup:
    """Of one participant."""

    def __init__(self, engine: Participant) -> None:
        self._engine = engine
        self.registry = TypeRegistry()

    def fetch(self, owner: Guid, identifier: HashedIdentifier, now: float) -> TypeObject | str | None:
        """The TypeObject; None while the participant that ``owner`` belongs to is asked; or why it will not come."""
        found = self.registry.known_to(owner.prefix).get(identifier)
        return found if found is not None else "its participant answers no questions about types"

    def fetch_all(
        self, owner: Guid, root: HashedIdentifier, information: TypeInformation, now: float
    ) -> BuiltTypes | str | None:
        """The same with all that it needs.  ``information``: what was announced, which may list these."""
        types, missing = self.registry.collect(root, owner.prefix)
        return types if not missing else "its participant answers no questions about types"
