"""What participants announce of themselves and of their endpoints.

RTPS 2.5 §8.5.3.2 (SPDPdiscoveredParticipantData), §8.5.4.4 (DiscoveredWriterData, DiscoveredReaderData).
Values only; ``discovery`` turns them into parameter lists and back.
"""

from __future__ import annotations

from .builtin_entity_ids import BuiltinEndpoints
from .dataclass import dataclass
from .guid import EntityId, Guid
from .locator import Locator
from .qos import EndpointQos
from .qos_policies import BinaryProperty, Property
from .vendor import OUR_VENDOR_ID, PROTOCOL_VERSION, VendorId

__all__ = [
    "REPLAY_USER_DATA",
    "ContentFilterProperty",
    "DiscoveredEndpointData",
    "DiscoveredParticipantData",
    "DiscoveredReaderData",
    "DiscoveredWriterData",
]

REPLAY_USER_DATA = b"ddsi.persistence-service"
"""User data of the writers by which a persistence service hands on what others wrote."""

Parameter = tuple[int, bytes]
"""A parameter that the core carries but does not read: its id, and its value as little-endian octets."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DiscoveredParticipantData:
    """A participant as announced by SPDP.  ``lease_duration`` in seconds.  Other name: spdp data."""

    guid: Guid
    vendor_id: VendorId = OUR_VENDOR_ID
    protocol_version: tuple[int, int] = PROTOCOL_VERSION
    domain_id: int | None = None
    domain_tag: str = ""
    metatraffic_unicast: tuple[Locator, ...] = ()
    metatraffic_multicast: tuple[Locator, ...] = ()
    default_unicast: tuple[Locator, ...] = ()
    default_multicast: tuple[Locator, ...] = ()
    builtin_endpoints: BuiltinEndpoints = BuiltinEndpoints(0)
    builtin_endpoint_qos: int = 0
    lease_duration: float = 100.0
    manual_liveliness_count: int = 0
    entity_name: str = ""
    user_data: bytes = b""
    properties: tuple[tuple[str, Property | BinaryProperty], ...] = ()
    security_parameters: tuple[Parameter, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class ContentFilterProperty:
    """ContentFilterProperty_t: what a reader lets pass.  RTPS 2.5 §9.6.4.1."""

    content_filtered_topic_name: str
    related_topic_name: str
    filter_class_name: str
    filter_expression: str
    expression_parameters: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class DiscoveredEndpointData:
    """What writers and readers announce alike.  Empty locator lists: those of the participant hold.

    ``group_entity_id``: the publisher or subscriber that it belongs to, where that matters (PID_GROUP_ENTITYID).
    """

    guid: Guid
    topic_name: str
    type_name: str
    qos: EndpointQos
    vendor_id: VendorId = OUR_VENDOR_ID
    unicast: tuple[Locator, ...] = ()
    multicast: tuple[Locator, ...] = ()
    group_entity_id: EntityId = EntityId.UNKNOWN
    type_information: bytes = b""
    security_parameters: tuple[Parameter, ...] = ()

    @property
    def is_keyed(self) -> bool:
        return self.guid.entity_id.is_keyed


@dataclass(frozen=True, slots=True, kw_only=True)
class DiscoveredWriterData(DiscoveredEndpointData):
    """A writer as announced by SEDP.  Other names: publication, proxy writer's data."""

    max_serialized_size: int | None = None

    @property
    def is_replay(self) -> bool:
        """Does it belong to a persistence service, and send each reader what that one lacks, and no other?"""
        return self.qos.user_data.value == REPLAY_USER_DATA


@dataclass(frozen=True, slots=True, kw_only=True)
class DiscoveredReaderData(DiscoveredEndpointData):
    """A reader as announced by SEDP.  Other names: subscription, proxy reader's data."""

    expects_inline_qos: bool = False
    content_filter: ContentFilterProperty | None = None
