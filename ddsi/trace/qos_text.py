"""QoS policies as short texts for events: only what differs from the default, in words that people wrote."""

from __future__ import annotations

from dataclasses import fields, is_dataclass
from enum import Enum

from ..structure.qos import EndpointQos
from .event import Pairs

__all__ = ["policy_text", "qos_texts"]

# Not needed to understand a match; properties might hold what is nobody's business, user data might be large.
_LEFT_OUT = frozenset({"properties", "user_data", "topic_data", "group_data", "entity_name"})
_SILENT = EndpointQos()


def qos_texts(qos: EndpointQos) -> Pairs:
    """Each policy that is not the default of a peer that announces nothing, by its name."""
    return tuple(
        (item.name, policy_text(getattr(qos, item.name)))
        for item in fields(qos)
        if item.name not in _LEFT_OUT and getattr(qos, item.name) != getattr(_SILENT, item.name)
    )


def policy_text(policy: object) -> str:
    """A policy as it would be written in a program: ``Reliable(max_blocking_time=0.1)``, ``KeepAll()``.

    Not ``repr``: that of enumeration members is for debuggers, and has changed between versions of Python.
    """
    if isinstance(policy, Enum):
        return policy.name
    if isinstance(policy, tuple):
        return f"({', '.join(policy_text(item) for item in policy)})"
    if not is_dataclass(policy):
        return repr(policy)
    values = [(item.name, getattr(policy, item.name)) for item in fields(policy)]
    # Partition("a", "b") and DataRepresentation(XCDR1) take what they hold one by one.
    arguments = (
        policy_text(value)[1:-1] if isinstance(value, tuple) else f"{name}={policy_text(value)}"
        for name, value in values
    )
    return f"{type(policy).__name__}({', '.join(arguments)})"
