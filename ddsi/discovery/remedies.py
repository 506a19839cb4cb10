"""What stands between a writer and a reader, all of it at once, and what to do: a sentence for each cause.

DDS 1.4 §2.2.3 has the rules (a reader's request against a writer's offer), DDS-XTypes 1.3 §7.6.3.1 that of data
representation, §7.2.4 that of types, DDS-Security 1.1 §7.4.1.5 that of protection.  Pure functions over what is
announced; whether types can be assigned, and what a security plugin decides, is told to them.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

from ..serialization.parameter_id import ParameterId
from ..structure.dataclass import dataclass
from ..structure.discovered import DiscoveredEndpointData, DiscoveredReaderData, DiscoveredWriterData
from ..structure.qos_policies import DataRepresentationId
from ..trace.wording import seconds_text
from .matching import MatchRefusal, incompatibilities, partitions_match

__all__ = ["Disagreement", "disagreements", "participant_remedy", "security_disagreement", "topic_disagreement"]

_XCDR1_ONLY = (DataRepresentationId.XCDR1,)
_VALID = 1 << 31
_PROTECTIONS = ("read", "write", "discovery", "submessage", "payload", "key", "liveliness")
"""The bits of EndpointSecurityAttributesMask, lowest first.  DDS-Security 1.1 §8.4.2.8."""
_WAYS = ("submessage encrypted", "payload encrypted", "origin authenticated")
"""Those of the builtin plugins' mask.  DDS-Security 1.1 §9.4.2.5."""
_ONE_GOVERNANCE = "give both participants one governance document, or the same rule for this"


@dataclass(frozen=True, slots=True)
class Disagreement:
    """One thing on which writer and reader do not agree, and the remedy.

    ``policy``: a QoS policy's name, or ``topic``, ``type``, ``key``, ``partition``, ``security``, ``locator``.
    ``offered`` is the writer's side, ``requested`` the reader's.  ``detail``: of types, the member that does not fit,
    and why.
    """

    policy: str
    offered: str
    requested: str
    remedy: str
    detail: str = ""


def disagreements(
    writer: DiscoveredWriterData, reader: DiscoveredReaderData, types: MatchRefusal | None
) -> tuple[Disagreement, ...]:
    """All that stands between the two, by what they announce; the remedies are independent of each other.

    ``types``: why the types do not fit, if they do not.
    """
    return tuple(_all(writer, reader, types))


def _all(
    writer: DiscoveredWriterData, reader: DiscoveredReaderData, types: MatchRefusal | None
) -> Iterator[Disagreement]:
    if writer.topic_name != reader.topic_name:
        yield topic_disagreement(writer.topic_name, reader.topic_name)
    if types is not None:
        yield from _of_types(writer, reader, types)
    offered, requested = writer.qos.partition.names, reader.qos.partition.names
    if not partitions_match(offered, requested):
        remedy = _partition_remedy(offered, requested)
        yield Disagreement("partition", _partition_text(offered), _partition_text(requested), remedy)
    for one in incompatibilities(writer, reader):
        yield Disagreement(one.policy, one.offered, one.requested, _qos_remedy(one.policy, writer, reader))
    ours, theirs = _protection(writer), _protection(reader)
    if ours and theirs and any(one & other & _VALID and one != other for one, other in zip(ours, theirs, strict=True)):
        yield Disagreement("security", _protection_text(ours), _protection_text(theirs), f"{_ONE_GOVERNANCE} topic")


# --- topics and types ------------------------------------------------------------------------------------------


def topic_disagreement(offered: str, requested: str) -> Disagreement:
    """Of two topics that were probably meant to be one, or of two endpoints that somebody asked about."""
    if offered.strip() == requested.strip():
        how = "they differ by blanks alone: "
    elif offered.casefold() == requested.casefold():
        how = "they differ by upper and lower case alone: "
    elif offered.rpartition("/")[2].casefold() == requested.rpartition("/")[2].casefold():
        how = "one has a prefix (ROS 2 puts rt/ before its topics) that the other has not: "
    else:
        how = ""
    return Disagreement("topic", repr(offered), repr(requested), f"{how}give both sides one topic name")


def _of_types(
    writer: DiscoveredWriterData, reader: DiscoveredReaderData, refusal: MatchRefusal
) -> Iterator[Disagreement]:
    if writer.is_keyed != reader.is_keyed:
        keyed, keyless = ("writer", "reader") if writer.is_keyed else ("reader", "writer")
        remedy = f"the {keyed}'s type has key members, the {keyless}'s has none: declare the same @key on both sides"
        yield Disagreement("key", _key_text(writer), _key_text(reader), remedy)
        if writer.type_name == reader.type_name:
            return
    remedy = _type_remedy(writer, reader, refusal.detail)
    yield Disagreement("type", writer.type_name, reader.type_name, remedy, refusal.detail)


def _key_text(data: DiscoveredEndpointData) -> str:
    return "with key" if data.is_keyed else "without key"


def _type_remedy(writer: DiscoveredEndpointData, reader: DiscoveredEndpointData, detail: str) -> str:
    if " for the reader, " in detail and " for the writer" in detail:
        return (
            "say @final, @appendable or @mutable in the IDL of both sides: without, Cyclone DDS takes a type for final "
            "and others take it for appendable"
        )
    if detail:
        return (
            "use one definition on both sides (`ddsi typeof` shows both), or let it grow only as its extensibility "
            "allows: @appendable at the end, @mutable anywhere"
        )
    if _last_part(writer.type_name) == _last_part(reader.type_name):
        return "the type is in another module, or a vendor names it otherwise: give it one full name on both sides"
    return "the sides use one topic name for different types: rename one topic, or give both the same type name"


def _last_part(type_name: str) -> str:
    """``a::msg::dds_::B_`` and ``a/B`` are called after B."""
    return type_name.replace("::", "/").rpartition("/")[2].rstrip("_")


# --- security --------------------------------------------------------------------------------------------------


def security_disagreement(reason: str) -> Disagreement:
    """What our own security plugins said of a pair, with the place where that is to be changed."""
    if "governance" in reason:
        remedy = f"{_ONE_GOVERNANCE} topic"
    elif "authenticated" in reason:
        remedy = "give that participant an identity (`ddsi keystore create`), or do not protect the topic in governance"
    else:
        remedy = "grant it in the permissions of the participant that is refused, and sign them anew (`ddsi explain`)"
    return Disagreement("security", reason, "", remedy)


def participant_remedy(reason: str, *, has_identity: bool) -> str:
    """What to do about a participant that our own security plugins did not admit."""
    if not has_identity:
        return "give it an identity (`ddsi keystore create`), or allow unauthenticated participants by governance"
    if "governance protects" in reason:
        return f"{_ONE_GOVERNANCE} domain"
    if "permissions" in reason:
        return "give it permissions for this domain that the permissions CA of both has signed (`ddsi explain`)"
    return "give both identities that one CA has signed, for this domain (`ddsi keystore check`)"


def _protection(data: DiscoveredEndpointData) -> tuple[int, int] | None:
    """The two masks of ENDPOINT_SECURITY_INFO; None where it announces none that are valid."""
    for pid, value in data.security_parameters:
        if pid == ParameterId.ENDPOINT_SECURITY_INFO and len(value) >= 8:
            masks = int.from_bytes(value[:4], "little"), int.from_bytes(value[4:8], "little")
            return masks if masks[0] & _VALID else None
    return None


def _protection_text(masks: tuple[int, int]) -> str:
    names = [name for bit, name in enumerate(_PROTECTIONS) if masks[0] >> bit & 1]
    ways = [way for bit, way in enumerate(_WAYS) if masks[1] >> bit & 1]
    if others := masks[1] & ~_VALID & ~((1 << len(_WAYS)) - 1):
        ways.append(f"plugin attributes {others:#x}")
    return ", ".join([f"{' and '.join(names) or 'nothing'} protected", *ways])


# --- policies --------------------------------------------------------------------------------------------------


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
