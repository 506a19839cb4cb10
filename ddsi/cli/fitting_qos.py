"""QoS that fits whoever is there: what a reader may request of the writers found, what a writer must offer the readers.

DDS 1.4 §2.2.3: of each policy that is compared, a reader requests the least that any writer offers, and a writer offers
the most that any reader requests; the partitions are those of all together.  Where that is impossible, as exclusive and
shared ownership exclude each other, the first that was found decides.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from ..structure import qos_policies as p
from ..structure.qos import EndpointQos, Qos

__all__ = ["common_partition", "offered_to", "requested_of"]

_BLOCKING_S = 10.0

_DURABILITIES: dict[int, p.Durability] = {
    durability.KIND: durability for durability in (p.Volatile(), p.TransientLocal(), p.Transient(), p.Persistent())
}
_XCDR1_ALONE = (p.DataRepresentationId.XCDR1,)


def requested_of(writers: Sequence[EndpointQos]) -> Qos:
    """For a reader that takes what all these writers send: reliable if all are, and with history if all have it."""
    first = writers[0] if writers else EndpointQos()
    is_reliable = bool(writers) and all(isinstance(qos.reliability, p.Reliable) for qos in writers)
    durability = min((qos.durability.KIND for qos in writers), default=0)
    return Qos(
        reliability=p.Reliable() if is_reliable else p.BestEffort(),
        durability=_DURABILITIES[durability],
        history=p.KeepAll(),
        ownership=first.ownership,
    )


def offered_to(readers: Sequence[EndpointQos], preferred: Sequence[p.DataRepresentationId]) -> Qos:
    """For a writer that all these readers take from.

    ``preferred``: the representations that the type can be sent in, best first; the first that all readers understand
    is taken.
    """
    first = readers[0] if readers else EndpointQos()
    strictest = max((qos.liveliness for qos in readers), key=lambda liveliness: liveliness.KIND, default=p.Automatic())
    lease = min((qos.liveliness.lease_duration for qos in readers), default=p.Automatic().lease_duration)
    understood = [qos.data_representation.ids or _XCDR1_ALONE for qos in readers]
    common = [one for one in preferred if all(one in ids for ids in understood)]
    return Qos(
        reliability=p.Reliable(max_blocking_time=_BLOCKING_S),
        durability=_DURABILITIES[max((qos.durability.KIND for qos in readers), default=0)],
        history=p.KeepAll(),
        deadline=p.Deadline(min((qos.deadline.period for qos in readers), default=p.Deadline().period)),
        latency_budget=p.LatencyBudget(min((qos.latency_budget.duration for qos in readers), default=0.0)),
        liveliness=type(strictest)(lease),
        ownership=first.ownership,
        destination_order=max(
            (qos.destination_order for qos in readers), key=lambda order: order.KIND, default=p.ByReceptionTimestamp()
        ),
        data_representation=p.DataRepresentation(*(common or preferred)[:1]),
    )


def common_partition(peers: Iterable[EndpointQos]) -> p.Partition:
    """Names of which one at least fits each peer; where a peer has a pattern, a name that it fits."""
    names: dict[str, None] = {}
    for qos in peers:
        names |= dict.fromkeys(map(_without_wildcards, qos.partition.names or ("",)))
    return p.Partition(*names) if names and tuple(names) != ("",) else p.Partition()


def _without_wildcards(pattern: str) -> str:
    """A name that fits the pattern, as patterns never fit each other."""
    return pattern.replace("*", "").replace("?", "_")
