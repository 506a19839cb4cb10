"""Which other TypeObjects a TypeObject needs: the identifiers with a hash that it names (DDS-XTypes 1.3 §7.3.4.2)."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from .identifiers import (
    ArrayIdentifier,
    ComponentIdentifier,
    HashedIdentifier,
    HashIdentifier,
    MapIdentifier,
    SequenceIdentifier,
    TypeIdentifier,
)
from .objects import (
    AliasObject,
    ArrayObject,
    MapObject,
    SequenceObject,
    StructObject,
    TypeObject,
    UnionObject,
)

__all__ = ["hashed_only", "hashes_in", "plain_parts", "references"]


def references(type_object: TypeObject) -> Iterator[HashedIdentifier]:
    """In the order in which it names them; one that is named twice comes twice."""
    for identifier in _named(type_object):
        yield from hashes_in(identifier)


def hashed_only(identifiers: Iterable[TypeIdentifier]) -> list[HashedIdentifier]:
    """Those that stand for a TypeObject."""
    return [identifier for identifier in identifiers if isinstance(identifier, HashedIdentifier)]


def hashes_in(identifier: TypeIdentifier) -> Iterator[HashedIdentifier]:
    """The identifier itself where it is a hash, or those inside a collection's."""
    match identifier:
        case HashIdentifier() | ComponentIdentifier():
            yield identifier
        case SequenceIdentifier(element=element) | ArrayIdentifier(element=element):
            yield from hashes_in(element)
        case MapIdentifier(key=key, element=element):
            yield from hashes_in(key)
            yield from hashes_in(element)
        case _:
            pass


def plain_parts(type_object: TypeObject) -> Iterator[TypeIdentifier]:
    """The primitives and strings that it names, also as elements of collections."""
    for identifier in _named(type_object):
        yield from _plain(identifier)


def _plain(identifier: TypeIdentifier) -> Iterator[TypeIdentifier]:
    match identifier:
        case SequenceIdentifier(element=element) | ArrayIdentifier(element=element):
            yield from _plain(element)
        case MapIdentifier(key=key, element=element):
            yield from _plain(key)
            yield from _plain(element)
        case HashIdentifier() | ComponentIdentifier():
            pass
        case _:
            yield identifier


def _named(type_object: TypeObject) -> Iterator[TypeIdentifier]:
    match type_object.body:
        case StructObject(base=base, members=members):
            if base is not None:
                yield base
            for member in members:
                yield member.type
        case UnionObject(discriminator=discriminator, cases=cases):
            yield discriminator
            for case in cases:
                yield case.type
        case AliasObject(related=related):
            yield related
        case SequenceObject(element=element) | ArrayObject(element=element):
            yield element
        case MapObject(key=key, element=element):
            yield key
            yield element
        case _:
            pass
