"""Do a writer and a reader fit?  And if not: which policy, what is offered, what is requested.

DDS 1.4 §2.2.3 (the RxO column), DDS-XTypes 1.3 §7.6.3.1 (data representation), RTPS 2.5 §8.5.4.  Pure functions over
what endpoints announce; the same for local and remote ones.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from enum import StrEnum
from functools import lru_cache

from ..structure.dataclass import dataclass
from ..structure.discovered import DiscoveredEndpointData, DiscoveredReaderData, DiscoveredWriterData
from ..structure.qos import EndpointQos
from ..structure.qos_policies import DataRepresentation, DataRepresentationId
from ..structure.status import Incompatibility

__all__ = [
    "MatchRefusal",
    "RefusalKind",
    "incompatibilities",
    "judge",
    "names_refusal",
    "partitions_match",
    "policies_refusal",
]

# QosPolicyId_t, DDS 1.4 §2.3.3 and DDS-XTypes 1.3 annex D.
_DURABILITY, _PRESENTATION, _DEADLINE, _LATENCY_BUDGET, _OWNERSHIP = 2, 3, 4, 5, 6
_LIVELINESS, _RELIABILITY, _DESTINATION_ORDER, _DATA_REPRESENTATION = 8, 11, 12, 23

_XCDR1_ONLY = (DataRepresentationId.XCDR1,)
_NO_PARTITION = ("",)


class RefusalKind(StrEnum):
    """What stands between two endpoints of one topic."""

    TYPE = "type"
    PARTITION = "partition"
    QOS = "qos"
    SECURITY = "security"


@dataclass(frozen=True, slots=True)
class MatchRefusal:
    """Why a writer and a reader of the same topic do not match, kept as a value because people will ask.

    ``offered`` is the writer's side, ``requested`` the reader's; ``incompatibilities`` names every policy when it is
    QoS.  ``detail``: where type names do not tell, what is between the types, the member's path first.
    """

    kind: RefusalKind
    offered: str
    requested: str
    incompatibilities: tuple[Incompatibility, ...] = ()
    detail: str = ""

    def __str__(self) -> str:
        if self.incompatibilities:
            return "; ".join(map(str, self.incompatibilities))
        sides = f"{self.kind}: offered {self.offered}, requested {self.requested}"
        return f"{sides}: {self.detail}" if self.detail else sides


def judge(writer: DiscoveredWriterData, reader: DiscoveredReaderData) -> MatchRefusal | None:
    """None if the two, of the same topic, match; else why they do not.  Types go by name here."""
    return names_refusal(writer, reader) or policies_refusal(writer, reader)


def policies_refusal(writer: DiscoveredWriterData, reader: DiscoveredReaderData) -> MatchRefusal | None:
    """The same of two whose types fit."""
    offered, requested = writer.qos.partition.names, reader.qos.partition.names
    if not partitions_match(offered, requested):
        return MatchRefusal(RefusalKind.PARTITION, repr(offered or _NO_PARTITION), repr(requested or _NO_PARTITION))
    reasons = incompatibilities(writer, reader)
    if reasons:
        return MatchRefusal(RefusalKind.QOS, reasons[0].offered, reasons[0].requested, reasons)
    return None


def _type_text(data: DiscoveredEndpointData) -> str:
    return f"{data.type_name} ({'with' if data.is_keyed else 'without'} key)"


def names_refusal(writer: DiscoveredWriterData, reader: DiscoveredReaderData) -> MatchRefusal | None:
    """None if both have one type name, and both are keyed or both keyless (Fast DDS judges the latter by the entity
    kind too); what types are made of is judged elsewhere."""
    if writer.type_name == reader.type_name and writer.is_keyed == reader.is_keyed:
        return None
    return MatchRefusal(RefusalKind.TYPE, _type_text(writer), _type_text(reader))


def partitions_match(offered: tuple[str, ...], requested: tuple[str, ...]) -> bool:
    """Does a name of one fit a name of the other?  DDS 1.4 §2.2.3.13.

    No partition is the partition with the empty name.  ``*`` and ``?`` are wildcards on either side; a
    pattern never fits another pattern.
    """
    return any(_names_match(one, other) for one in offered or _NO_PARTITION for other in requested or _NO_PARTITION)


def incompatibilities(writer: DiscoveredWriterData, reader: DiscoveredReaderData) -> tuple[Incompatibility, ...]:
    """Every policy of which the writer offers less than the reader requests; empty when they fit.

    In the order in which Cyclone DDS compares, so that the first is the one that others report too.
    """
    return tuple(_compare(writer.qos, reader.qos))


def _compare(offered: EndpointQos, requested: EndpointQos) -> Iterator[Incompatibility]:
    if offered.reliability.KIND < requested.reliability.KIND:
        yield _kinds("reliability", _RELIABILITY, offered.reliability, requested.reliability)
    if offered.durability.KIND < requested.durability.KIND:
        yield _kinds("durability", _DURABILITY, offered.durability, requested.durability)
    presented, wanted = offered.presentation, requested.presentation
    if (
        presented.access_scope < wanted.access_scope
        or presented.coherent_access < wanted.coherent_access
        or presented.ordered_access < wanted.ordered_access
    ):
        yield _values("presentation", _PRESENTATION, presented, wanted)
    if offered.deadline.period > requested.deadline.period:
        yield _values("deadline", _DEADLINE, offered.deadline, requested.deadline)
    if offered.latency_budget.duration > requested.latency_budget.duration:
        yield _values("latency_budget", _LATENCY_BUDGET, offered.latency_budget, requested.latency_budget)
    if offered.ownership.KIND != requested.ownership.KIND:
        yield _kinds("ownership", _OWNERSHIP, offered.ownership, requested.ownership)
    if (
        offered.liveliness.KIND < requested.liveliness.KIND
        or offered.liveliness.lease_duration > requested.liveliness.lease_duration
    ):
        yield _values("liveliness", _LIVELINESS, offered.liveliness, requested.liveliness)
    if offered.destination_order.KIND < requested.destination_order.KIND:
        yield _kinds("destination_order", _DESTINATION_ORDER, offered.destination_order, requested.destination_order)
    yield from _compare_representation(offered.data_representation, requested.data_representation)


def _compare_representation(offered: DataRepresentation, requested: DataRepresentation) -> Iterator[Incompatibility]:
    """A writer uses the first that it offers; an absent or empty list means XCDR1 alone."""
    first = (offered.ids or _XCDR1_ONLY)[0]
    accepted = requested.ids or _XCDR1_ONLY
    if first not in accepted:
        yield Incompatibility(
            policy="data_representation",
            policy_id=_DATA_REPRESENTATION,
            offered=first.name,
            requested=" or ".join(representation.name for representation in accepted),
        )


def _kinds(policy: str, policy_id: int, offered: object, requested: object) -> Incompatibility:
    names = {"offered": type(offered).__name__, "requested": type(requested).__name__}
    return Incompatibility(policy=policy, policy_id=policy_id, **names)


def _values(policy: str, policy_id: int, offered: object, requested: object) -> Incompatibility:
    return Incompatibility(policy=policy, policy_id=policy_id, offered=repr(offered), requested=repr(requested))


def _names_match(one: str, other: str) -> bool:
    if one == other:
        return not _is_pattern(one)
    if _is_pattern(one):
        return not _is_pattern(other) and _pattern(one).fullmatch(other) is not None
    return _is_pattern(other) and _pattern(other).fullmatch(one) is not None


def _is_pattern(name: str) -> bool:
    return "*" in name or "?" in name


@lru_cache(maxsize=256)
def _pattern(name: str) -> re.Pattern[str]:
    """The name as an expression that takes time proportional to what it is matched with.

    Names come from strangers.  Of a naive expression, each further star would multiply the time to find that
    nothing fits.  But between stars the first place where a piece fits is as good as any later one, so each piece is
    an atomic group, to which nobody comes back.
    """
    first, *pieces = ("".join("." if char == "?" else re.escape(char) for char in piece) for piece in name.split("*"))
    if not pieces:
        return re.compile(first, re.DOTALL)
    middle = "".join(f"(?>.*?{piece})" for piece in pieces[:-1] if piece)
    return re.compile(f"{first}{middle}.*{pieces[-1]}", re.DOTALL)
