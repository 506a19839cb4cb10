"""TypeRegistry: the TypeObjects that a participant knows, by TypeIdentifier; its own, and what peers told it.

DDS-XTypes 1.3 §7.6.3.3.  A TypeObject from the network is taken only under the identifier that is its hash, so it does
not matter who sent it.  The types of a strongly connected component share one hash, which vendors compute differently;
what a peer says of those is kept apart, and serves to judge that peer's endpoints alone.

Peers' types are bounded in number and octets; when there are too many, those that came first are forgotten, and would
be asked for again.  Our own are never displaced.
"""

from __future__ import annotations

from collections import ChainMap, OrderedDict
from collections.abc import Iterable, Mapping

from ..structure.errors import MalformedMessage
from ..xtypes.type_object import (
    BuiltTypes,
    ComponentIdentifier,
    HashedIdentifier,
    HashIdentifier,
    TypeDescription,
    TypeIdentifier,
    TypeObject,
    decode_type_object,
    equivalence_hash,
)
from ..xtypes.type_object.kinds import COMPLETE
from ..xtypes.type_object.references import hashed_only, references
from .type_quirks import has_new_kinds

__all__ = ["MOST_NEEDED", "TypeRegistry"]

MOST_NEEDED = 1024
"""Of how many TypeObjects one type may be made, for us to collect them."""

_MOST_TYPES = 8192
_MOST_OCTETS = 16 << 20


class TypeRegistry:
    """Of one participant."""

    def __init__(self) -> None:
        self._own: dict[HashedIdentifier, TypeObject] = {}
        self._own_octets: dict[HashedIdentifier, bytes] = {}
        self._with_new_kinds: set[HashedIdentifier] = set()
        self._minimal_of: dict[HashedIdentifier, HashedIdentifier] = {}
        self._others: OrderedDict[tuple[bytes, HashedIdentifier], bytes] = OrderedDict()  # prefix empty: anybody's
        self._objects: dict[HashedIdentifier, TypeObject] = {}
        self._components: dict[bytes, dict[HashedIdentifier, TypeObject]] = {}
        self._octet_count = 0

    # --- ours --------------------------------------------------------------------------------------------

    def add_own(self, description: TypeDescription) -> None:
        """A type of this program, and all that it needs: from now on others may ask for it."""
        for types in (description.minimal, description.complete):
            self._own |= types.objects
            self._own_octets |= types.octets
            new = {identifier for identifier, found in types.objects.items() if has_new_kinds(found)}
            self._with_new_kinds |= new | ({types.root} if new else set())
        self._minimal_of[description.complete.root] = description.minimal.root

    def own_octets(self, identifier: TypeIdentifier) -> bytes | None:
        """The TypeObject of one of our types as it is sent; None if it is none of ours."""
        return self._own_octets.get(identifier) if isinstance(identifier, HashedIdentifier) else None

    def has_new_kinds(self, identifier: TypeIdentifier) -> bool:
        """Has this type of ours, or does a topic type need, what some peers cannot be told (``type_quirks``)?"""
        return identifier in self._with_new_kinds

    def minimal_of(
        self, identifiers: Iterable[TypeIdentifier]
    ) -> tuple[tuple[HashedIdentifier, HashedIdentifier], ...]:
        """The complete identifiers of our topic types that are among them, each with its minimal one.

        Of the types that these need it is not told: several of them may have one minimal TypeObject.
        """
        complete = [one for one in hashed_only(identifiers) if one in self._minimal_of]
        return tuple((one, self._minimal_of[one]) for one in complete)

    # --- peers' ------------------------------------------------------------------------------------------

    def add(self, prefix: bytes, identifier: HashedIdentifier, octets: bytes) -> None:
        """What the participant with this prefix says the identifier stands for; little endian.

        MalformedMessage where it is no TypeObject, or another than the identifier names.
        """
        if identifier in self.known_to(prefix):
            return
        found = decode_type_object(octets)
        if found.is_complete != (identifier.kind == COMPLETE):
            raise MalformedMessage(f"a TypeObject of the other kind under {identifier!r}", element="TypeObject")
        if isinstance(identifier, HashIdentifier):
            if equivalence_hash(octets) != identifier.hash:
                raise MalformedMessage(f"a TypeObject that is not {identifier!r}", element="TypeObject")
            self._objects[identifier] = found
            prefix = b""
        else:
            self._components.setdefault(prefix, {})[identifier] = found
        self._others[prefix, identifier] = octets
        self._octet_count += len(octets)
        while self._octet_count > _MOST_OCTETS or len(self._others) > _MOST_TYPES:
            self._forget(*next(iter(self._others)))

    def participant_lost(self, prefix: bytes) -> None:
        """What only it could say is forgotten."""
        for identifier in list(self._components.get(prefix, ())):
            self._forget(prefix, identifier)

    def _forget(self, prefix: bytes, identifier: HashedIdentifier) -> None:
        self._octet_count -= len(self._others.pop((prefix, identifier)))
        if prefix:
            del self._components[prefix][identifier]
            if not self._components[prefix]:
                del self._components[prefix]
        else:
            del self._objects[identifier]

    # --- all ---------------------------------------------------------------------------------------------

    def known_to(self, *prefixes: bytes) -> Mapping[HashedIdentifier, TypeObject]:
        """Every TypeObject by which types of these participants are judged: ours, those everybody knows, theirs."""
        return ChainMap(self._own, self._objects, *(self._components.get(prefix, {}) for prefix in prefixes))

    def collect(self, root: HashedIdentifier, prefix: bytes) -> tuple[BuiltTypes, list[HashedIdentifier]]:
        """The type and all that it needs, as far as they are known, and the identifiers of those that are not.

        The first in order is ``root``; there are at most :data:`MOST_NEEDED` of both together.
        """
        objects = self.known_to(prefix)
        found: dict[HashedIdentifier, TypeObject] = {}
        octets: dict[HashedIdentifier, bytes] = {}
        missing: list[HashedIdentifier] = []
        waiting = {root: None}  # a dict serves as an ordered set
        seen = {root}
        while waiting:
            identifier = next(iter(waiting))
            del waiting[identifier]
            type_object = objects.get(identifier)
            if type_object is None:
                missing.append(identifier)
                continue
            found[identifier] = type_object
            octets[identifier] = self._octets(prefix, identifier)
            for needed in references(type_object):
                if needed not in seen and len(seen) < MOST_NEEDED:
                    seen.add(needed)
                    waiting[needed] = None
        return BuiltTypes(root, found, octets), missing

    def _octets(self, prefix: bytes, identifier: HashedIdentifier) -> bytes:
        own = self._own_octets.get(identifier)
        if own is not None:
            return own
        return self._others[prefix if isinstance(identifier, ComponentIdentifier) else b"", identifier]
