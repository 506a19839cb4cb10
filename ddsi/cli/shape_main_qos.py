"""From the options of ``ddsi-shape-main`` to QoS and configuration."""

from __future__ import annotations

from dataclasses import replace

from ..config import Config
from ..structure.qos import Qos
from ..structure.qos_policies import (
    AccessScope,
    BestEffort,
    DataRepresentation,
    Deadline,
    Durability,
    Exclusive,
    KeepAll,
    KeepLast,
    Lifespan,
    OwnershipStrength,
    Partition,
    Persistent,
    Presentation,
    Reliable,
    Shared,
    TimeBasedFilter,
    Transient,
    TransientLocal,
    Volatile,
    WriterDataLifecycle,
)
from .shape_main_options import ShapeMainOptions

__all__ = ["content_filter", "endpoint_qos", "group_qos", "participant_config"]

_DURABILITIES: dict[str, type[Durability]] = {
    "v": Volatile,
    "l": TransientLocal,
    "t": Transient,
    "p": Persistent,
}
_SCOPES = {"i": AccessScope.INSTANCE, "t": AccessScope.TOPIC, "g": AccessScope.GROUP}
# What one UDP datagram holds, as Config wants it; the engine lowers it further to what fits beside headers.
_LARGEST_DATAGRAM = 65507


def content_filter(options: ShapeMainOptions) -> tuple[str, tuple[str, ...]] | None:
    """Expression and parameters of a subscriber's filter; None if it is to get everything."""
    if options.publishes:
        return None
    if options.color is not None:
        quoted = options.color.replace("'", "''")
        return "color = %0", (f"'{quoted}'",)
    return (options.filter_expression, ()) if options.filter_expression is not None else None


def participant_config(options: ShapeMainOptions, config: Config) -> Config:
    """What the environment says, changed where the options say more."""
    if options.announcement_ms:
        config = replace(config, spdp_interval=options.announcement_ms / 1000)
    if options.fragment_octets:
        largest = config.max_message_size or _LARGEST_DATAGRAM
        config = replace(config, fragment_size=min(options.fragment_octets, largest))
    return config


def group_qos(options: ShapeMainOptions) -> Qos:
    """Of the publisher or subscriber."""
    qos = Qos(partition=Partition(options.partition)) if options.partition is not None else Qos()
    if options.access_scope is not None or options.is_coherent or options.is_ordered:
        scope = _SCOPES[options.access_scope or "i"]
        qos |= Qos(presentation=Presentation(scope, options.is_coherent, options.is_ordered))
    return qos


def endpoint_qos(options: ShapeMainOptions) -> Qos:
    """Of each writer or reader."""
    qos = Qos(
        reliability=Reliable() if options.is_reliable else BestEffort(),
        durability=_DURABILITIES[options.durability](),
        data_representation=DataRepresentation(options.representation),
        ownership=Exclusive() if options.ownership_strength >= 0 else Shared(),
    )
    if options.history_depth >= 0:
        qos |= Qos(history=KeepLast(options.history_depth) if options.history_depth else KeepAll())
    if options.deadline_ms:
        qos |= Qos(deadline=Deadline(options.deadline_ms / 1000))
    return qos | (_writer_qos(options) if options.publishes else _reader_qos(options))


def _writer_qos(options: ShapeMainOptions) -> Qos:
    qos = Qos()
    if options.ownership_strength >= 0:
        qos |= Qos(ownership_strength=OwnershipStrength(options.ownership_strength))
    if options.lifespan_ms:
        qos |= Qos(lifespan=Lifespan(options.lifespan_ms / 1000))
    # Readers shall see that nobody writes, not that instances are at their end, unless they are disposed on purpose.
    return qos | Qos(writer_data_lifecycle=WriterDataLifecycle(autodispose_unregistered_instances=False))


def _reader_qos(options: ShapeMainOptions) -> Qos:
    return Qos(time_based_filter=TimeBasedFilter(options.time_filter_ms / 1000)) if options.time_filter_ms else Qos()
