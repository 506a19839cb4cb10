"""QoS for people and for programs: short words for a table, plain objects for JSON; only what is not the default.

Reliability and durability are always said, as they are what people look for first.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass
from enum import Enum

from ..structure import qos_policies as p
from ..structure.qos import EndpointQos
from ..trace.wording import seconds_text

__all__ = ["policy_json", "qos_json", "qos_words"]

_SILENT = EndpointQos()
_ALWAYS = frozenset({"reliability", "durability"})
_WORDS: dict[type, str] = {
    p.Reliable: "reliable",
    p.BestEffort: "best-effort",
    p.Volatile: "volatile",
    p.TransientLocal: "transient-local",
    p.Transient: "transient",
    p.Persistent: "persistent",
    p.Exclusive: "exclusive",
    p.BySourceTimestamp: "by-source-timestamp",
    p.Automatic: "automatic liveliness",
    p.ManualByParticipant: "manual-by-participant liveliness",
    p.ManualByTopic: "manual-by-topic liveliness",
}


def qos_words(qos: EndpointQos) -> str:
    """``reliable, transient-local, keep-last 10, deadline 1 s``."""
    return ", ".join(_words(qos))


def _words(qos: EndpointQos) -> Iterator[str]:
    yield _WORDS[type(qos.reliability)]
    yield _WORDS[type(qos.durability)]
    if isinstance(qos.history, p.KeepAll):
        yield "keep-all"
    elif qos.history.depth > 1:
        yield f"keep-last {qos.history.depth}"
    yield from _limits(qos.resource_limits)
    yield from _durations(qos)
    if qos.liveliness != _SILENT.liveliness:
        lease = qos.liveliness.lease_duration
        yield _WORDS[type(qos.liveliness)] + ("" if math.isinf(lease) else f" {seconds_text(lease)}")
    if isinstance(qos.ownership, p.Exclusive):
        yield "exclusive"
    if qos.ownership_strength.value:
        yield f"strength {qos.ownership_strength.value}"
    if isinstance(qos.destination_order, p.BySourceTimestamp):
        yield "by-source-timestamp"
    if qos.presentation != _SILENT.presentation:
        yield _presentation(qos.presentation)
    if qos.partition.names:
        yield f"partition {' '.join(repr(name) for name in qos.partition.names)}"
    if qos.transport_priority.value:
        yield f"priority {qos.transport_priority.value}"
    if qos.data_representation.ids not in ((), (p.DataRepresentationId.XCDR1,)):
        yield "/".join(representation.name for representation in qos.data_representation.ids)
    if qos.type_consistency.kind == p.TypeConsistency.DISALLOW_TYPE_COERCION:
        yield "no type coercion"
    if qos.data_tags.tags:
        yield f"tags {' '.join(repr(f'{name}={value}') for name, value in qos.data_tags.tags)}"
    for name in ("user_data", "topic_data", "group_data"):
        if octets := getattr(qos, name).value:
            yield f"{name.replace('_', ' ')} {len(octets)} B"


def _durations(qos: EndpointQos) -> Iterator[str]:
    given = {
        "deadline": (qos.deadline.period, math.inf),
        "latency budget": (qos.latency_budget.duration, 0.0),
        "lifespan": (qos.lifespan.duration, math.inf),
        "at most every": (qos.time_based_filter.minimum_separation, 0.0),
    }
    return (f"{name} {seconds_text(value)}" for name, (value, default) in given.items() if value != default)


def _limits(limits: p.ResourceLimits) -> Iterator[str]:
    names = {
        "samples": limits.max_samples,
        "instances": limits.max_instances,
        "samples an instance": limits.max_samples_per_instance,
    }
    return (f"at most {value} {name}" for name, value in names.items() if value != p.LENGTH_UNLIMITED)


def _presentation(presentation: p.Presentation) -> str:
    words = [f"{presentation.access_scope.name.lower()} access"]
    words += ["coherent"] if presentation.coherent_access else []
    words += ["ordered"] if presentation.ordered_access else []
    return " ".join(words)


def qos_json(qos: EndpointQos) -> dict[str, object]:
    """Each policy by its name in ``ddsi.Qos``, as an object of its fields; policies with kinds bear a ``kind``."""
    return {
        item.name: policy_json(getattr(qos, item.name))
        for item in fields(qos)
        if item.name in _ALWAYS or getattr(qos, item.name) != getattr(_SILENT, item.name)
    }


def policy_json(value: object) -> object:
    """A policy, or a value in one, as JSON has it: octets in hexadecimal, an endless duration as ``"infinite"``."""
    if isinstance(value, Enum):
        return value.name
    if isinstance(value, float) and math.isinf(value):
        return "infinite"
    if isinstance(value, bytes):
        return value.hex()
    if isinstance(value, tuple):
        return [policy_json(item) for item in value]
    if is_dataclass(value):
        form = {item.name: policy_json(getattr(value, item.name)) for item in fields(value)}
        return {"kind": type(value).__name__, **form} if hasattr(value, "KIND") else form
    if isinstance(value, Mapping):
        return {str(name): policy_json(getattr(item, "value", item)) for name, item in value.items()}
    return value
