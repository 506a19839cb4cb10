"""What to do about endpoints that do not match: a sentence for each policy, with both values in it.

DDS 1.4 §2.2.3 has the rules (a reader's request against a writer's offer), DDS-XTypes 1.3 §7.6.3.1 that of data
representation.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from ..discovery.matching import MatchRefusal, RefusalKind, incompatibilities
from ..structure.discovered import DiscoveredReaderData, DiscoveredWriterData
from ..structure.qos_policies import DataRepresentationId
from ..trace.wording import seconds_text

__all__ = ["Disagreement", "disagreements"]

_XCDR1_ONLY = (DataRepresentationId.XCDR1,)


@dataclass(frozen=True, slots=True)
class Disagreement:
    """One policy (or ``type``, ``partition``) on which writer and reader do not agree, and the remedy."""

    policy: str
    offered: str
    requested: str
    remedy: str


def disagreements(
    writer: DiscoveredWriterData, reader: DiscoveredReaderData, refusal: MatchRefusal
) -> tuple[Disagreement, ...]:
    """All that stands between the two, one by one; the remedies are independent of each other."""
    match refusal.kind:
        case RefusalKind.TYPE:
            if refusal.detail:
                wanted = f"{refusal.requested}; {refusal.detail}"
                return (Disagreement("type", refusal.offered, wanted, _structure_remedy(refusal.detail)),)
            remedy = _type_remedy(writer, reader)
            return (Disagreement("type", refusal.offered, refusal.requested, remedy),)
        case RefusalKind.PARTITION:
            offered, requested = writer.qos.partition.names, reader.qos.partition.names
            remedy = _partition_remedy(offered, requested)
            partition = Disagreement("partition", _partition_text(offered), _partition_text(requested), remedy)
            # In one partition, these would be next to stand between the two: better told at once.
            return (partition, *_qos_disagreements(writer, reader))
        case RefusalKind.QOS:
            return _qos_disagreements(writer, reader)
        case RefusalKind.SECURITY:
            remedy = "compare what governance and permissions say of the topic on both sides"
            return (Disagreement("security", refusal.offered, refusal.requested, remedy),)


def _qos_disagreements(writer: DiscoveredWriterData, reader: DiscoveredReaderData) -> tuple[Disagreement, ...]:
    return tuple(
        Disagreement(one.policy, one.offered, one.requested, _qos_remedy(one.policy, writer, reader))
        for one in incompatibilities(writer, reader)
    )


def _type_remedy(writer: DiscoveredWriterData, reader: DiscoveredReaderData) -> str:
    if writer.type_name == reader.type_name:
        keyed, keyless = ("writer", "reader") if writer.is_keyed else ("reader", "writer")
        return f"the {keyed}'s type has key members, the {keyless}'s has none: declare the same @key on both sides"
    if _last_part(writer.type_name) == _last_part(reader.type_name):
        return "the type is in another module, or a vendor names it otherwise: give it one full name on both sides"
    return "the sides use one topic name for different types: rename one topic, or give both the same type name"


def _structure_remedy(detail: str) -> str:
    if " for the reader, " in detail and " for the writer" in detail:
        return (
            "say @final, @appendable or @mutable in the IDL of both sides: without, Cyclone DDS takes a type for final "
            "and others take it for appendable"
        )
    return "declare the member alike on both sides, or let TypeConsistency of the reader allow the difference"


def _last_part(type_name: str) -> str:
    """``a::msg::dds_::B_`` and ``a/B`` are called after B."""
    return type_name.replace("::", "/").rpartition("/")[2].rstrip("_")


def _partition_text(names: tuple[str, ...]) -> str:
    return ", ".join(map(repr, names)) if names else "none (the default partition)"


def _partition_remedy(offered: tuple[str, ...], requested: tuple[str, ...]) -> str:
    if not any(offered):
        side, names = "writer", requested
    elif not any(requested):
        side, names = "reader", offered
    else:
        return "give the publisher and the subscriber one partition name in common"
    name = next(name for name in names if name)
    return f"put the {side} into Partition({name!r}) too: the default partition is not part of any other"


def _qos_remedy(policy: str, writer: DiscoveredWriterData, reader: DiscoveredReaderData) -> str:
    offered, requested = writer.qos, reader.qos
    match policy:
        case "reliability":
            return "make the writer Reliable(), or let the reader be content with BestEffort()"
        case "durability":
            wanted, given = type(requested.durability).__name__, type(offered.durability).__name__
            return f"let the writer keep its samples with {wanted}(), or let the reader ask for {given}() only"
        case "presentation":
            return "set the publisher's access scope, coherent and ordered access at least to what the subscriber wants"
        case "deadline":
            promised = seconds_text(offered.deadline.period)
            patience = "do without one" if math.isinf(offered.deadline.period) else f"wait {promised} or more"
            return (
                f"let the writer promise Deadline({requested.deadline.period:g}) or shorter, or the reader {patience}"
            )
        case "latency_budget":
            return (
                f"let the writer offer LatencyBudget({requested.latency_budget.duration:g}) or less, or let the "
                f"reader allow {seconds_text(offered.latency_budget.duration)}"
            )
        case "ownership":
            return "choose the same kind on both sides: Shared() or Exclusive()"
        case "liveliness":
            kind = type(requested.liveliness).__name__
            lease = requested.liveliness.lease_duration
            return (
                f"let the writer assert itself at least as {kind} with a lease of {seconds_text(lease)} or shorter, "
                "or let the reader ask for less"
            )
        case "destination_order":
            return "let the writer order BySourceTimestamp(), or let the reader be content with ByReceptionTimestamp()"
        case "data_representation":
            first = (offered.data_representation.ids or _XCDR1_ONLY)[0]
            accepted = (requested.data_representation.ids or _XCDR1_ONLY)[0]
            return (
                f"let the writer use DataRepresentation({accepted.name}), or let the reader accept {first.name} as well"
            )
        case _:
            return "give both sides values that fit"
