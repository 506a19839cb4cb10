"""Which policies mean something to which entity.  DDS 1.4 §2.2.3, the column "Concerns" of its table.

One Qos may be given to a writer and a reader, or to all entities of a program: each acts on what concerns it, and the
rest means nothing to it.  That is no error, and silent; :func:`unused_policies` tells it to whoever wonders.

Wider than the table: topics and groups hand on what they have to their endpoints, and an endpoint may have what is a
group's (partition, presentation, group data) of its own.
"""

from __future__ import annotations

from dataclasses import fields
from typing import Literal

from .qos import Qos

__all__ = ["QosOwner", "unused_policies"]

QosOwner = Literal["participant", "topic", "publisher", "subscriber", "writer", "reader"]

_OF_WRITERS = frozenset(
    {"durability_service", "lifespan", "ownership_strength", "transport_priority", "writer_data_lifecycle"}
)
_OF_READERS = frozenset({"time_based_filter", "reader_data_lifecycle", "type_consistency"})
_OF_PARTICIPANTS = frozenset({"user_data", "entity_factory", "entity_name", "properties"})
_OF_FACTORIES = frozenset({"entity_factory"})
_ALL = frozenset(item.name for item in fields(Qos))

_UNUSED: dict[QosOwner, frozenset[str]] = {
    "participant": _ALL - _OF_PARTICIPANTS,
    "topic": _OF_FACTORIES,
    "publisher": _OF_READERS,
    "subscriber": _OF_WRITERS,
    "writer": _OF_READERS | _OF_FACTORIES,
    "reader": _OF_WRITERS | _OF_FACTORIES,
}


def unused_policies(qos: Qos, owner: QosOwner) -> tuple[str, ...]:
    """The names of the policies that ``qos`` sets and that mean nothing to such an entity, in the order of Qos."""
    names = (item.name for item in fields(Qos) if item.name in _UNUSED[owner])
    return tuple(name for name in names if getattr(qos, name) is not None)
