"""Censuses to order: participants and endpoints that were seen, without a network."""

from __future__ import annotations

from ddsi.cli.census import Census, SeenEndpoint, SeenParticipant
from ddsi.structure.discovered import (
    DiscoveredEndpointData,
    DiscoveredParticipantData,
    DiscoveredReaderData,
    DiscoveredWriterData,
)
from ddsi.structure.guid import EntityId, EntityKind, Guid, GuidPrefix
from ddsi.structure.qos import EndpointQos
from ddsi.structure.qos_policies import Property, Reliable
from ddsi.structure.vendor import CYCLONE, VendorId

__all__ = ["census", "participant", "reader", "writer"]

RELIABLE = EndpointQos(reliability=Reliable())


def _prefix(number: int) -> GuidPrefix:
    return GuidPrefix(b"\x01\x10" + bytes(9) + bytes((number,)))


def writer(
    topic: str = "Square",
    *,
    of: int = 1,
    number: int = 1,
    qos: EndpointQos = RELIABLE,
    type_name: str = "ShapeType",
    keyed: bool = True,
) -> DiscoveredWriterData:
    kind = EntityKind.WRITER_WITH_KEY if keyed else EntityKind.WRITER_NO_KEY
    guid = Guid.of(_prefix(of), EntityId.user(number, kind))
    return DiscoveredWriterData(guid=guid, topic_name=topic, type_name=type_name, qos=qos)


def reader(
    topic: str = "Square",
    *,
    of: int = 2,
    number: int = 1,
    qos: EndpointQos = RELIABLE,
    type_name: str = "ShapeType",
    keyed: bool = True,
) -> DiscoveredReaderData:
    kind = EntityKind.READER_WITH_KEY if keyed else EntityKind.READER_NO_KEY
    guid = Guid.of(_prefix(of), EntityId.user(number, kind))
    return DiscoveredReaderData(guid=guid, topic_name=topic, type_name=type_name, qos=qos)


def participant(
    number: int, *endpoints: DiscoveredEndpointData, name: str = "", host: str = "", vendor_id: VendorId = CYCLONE
) -> SeenParticipant:
    """Without anybody's matches: what is not asked for here is ``take_census``'s business."""
    properties = (("__Hostname", Property(host, propagate=True)),) if host else ()
    data = DiscoveredParticipantData(
        guid=Guid.of(_prefix(number), EntityId.PARTICIPANT),
        vendor_id=vendor_id,
        entity_name=name,
        properties=properties,
    )
    return SeenParticipant(data, tuple(SeenEndpoint(endpoint, ()) for endpoint in endpoints))


def census(*endpoints: DiscoveredEndpointData) -> Census:
    """The endpoints with participants around them."""
    by_number: dict[int, list[DiscoveredEndpointData]] = {}
    for endpoint in endpoints:
        by_number.setdefault(endpoint.guid[11], []).append(endpoint)
    return Census(0, tuple(participant(number, *group) for number, group in sorted(by_number.items())))
