"""Which policies may change while an entity lives.  DDS 1.4 §2.2.3, the column "changeable" of its table.

What DDS-XTypes 1.3 §7.6.3 and DDS-Security 1.1 §7.2 add to the policies stays as it was, as do names.
"""

from __future__ import annotations

from dataclasses import fields

from .errors import ImmutablePolicy
from .qos import EndpointQos, Qos

__all__ = ["CHANGEABLE", "changed_policies", "check_changeable"]

CHANGEABLE = frozenset(
    {
        "user_data",
        "topic_data",
        "group_data",
        "deadline",
        "latency_budget",
        "lifespan",
        "time_based_filter",
        "ownership_strength",
        "partition",
        "transport_priority",
        "entity_factory",
        "writer_data_lifecycle",
        "reader_data_lifecycle",
    }
)
"""The names, as in :class:`.qos.Qos`, of the policies that an enabled entity may change."""


def changed_policies(before: Qos | EndpointQos, after: Qos | EndpointQos) -> list[str]:
    """The names of the policies that differ, in the order in which the class has them."""
    return [item.name for item in fields(after) if getattr(before, item.name) != getattr(after, item.name)]


def check_changeable(before: Qos | EndpointQos, after: Qos | EndpointQos, whose: str) -> None:
    """Raises ImmutablePolicy, naming each policy that would change and may not; ``whose`` names the entity."""
    fixed = [name for name in changed_policies(before, after) if name not in CHANGEABLE]
    if not fixed:
        return
    # Of properties the names alone: a value may be a secret.
    changes = ", ".join(
        name if name == "properties" else f"{name} (from {getattr(before, name)!r} to {getattr(after, name)!r})"
        for name in fixed
    )
    raise ImmutablePolicy(
        f"{whose}: what was to change is fixed once the entity is enabled: {changes}; make another entity with it"
    )
