"""What applications read of the builtin topics DCPSParticipant, DCPSTopic, DCPSPublication and DCPSSubscription.

DDS 1.4 §2.2.5 (Built-in Topics), with what DDS-Security 1.1 §7.4.1.4 to §7.4.1.8 adds to them.  Values only: they say
who is there.  Where an entity lives, and what else SPDP and SEDP say for the protocol's own use, is in ``discovered``.
"""

from __future__ import annotations

from typing import ClassVar

from .dataclass import dataclass
from .discovered import ContentFilterProperty
from .guid import Guid
from .qos import EndpointQos
from .qos_policies import BinaryProperty, Property
from .security_information import EndpointSecurity, ParticipantSecurity
from .vendor import VendorId, vendor_name

__all__ = [
    "BuiltinTopicData",
    "ParticipantBuiltinTopicData",
    "PublicationBuiltinTopicData",
    "SubscriptionBuiltinTopicData",
    "TopicBuiltinTopicData",
]


@dataclass(frozen=True, slots=True, kw_only=True)
class ParticipantBuiltinTopicData:
    """A participant.  ``key``: its Guid.  ``lease_duration``: seconds after which it counts as gone when it is silent.

    ``properties``: those that it propagates.  All but ``security`` is what it announces of itself; of an authenticated
    participant, what it announced in clear until its protected announcement takes that one's place.
    """

    TOPIC_NAME: ClassVar[str] = "DCPSParticipant"

    key: Guid
    user_data: bytes
    entity_name: str
    vendor_id: VendorId
    protocol_version: tuple[int, int]
    domain_id: int | None
    lease_duration: float
    properties: tuple[tuple[str, Property | BinaryProperty], ...]
    security: ParticipantSecurity

    @property
    def vendor_name(self) -> str:
        return vendor_name(self.vendor_id)


@dataclass(frozen=True, slots=True, kw_only=True)
class _EndpointBuiltinTopicData:
    key: Guid
    topic_name: str
    type_name: str
    qos: EndpointQos
    vendor_id: VendorId
    type_information: bytes
    security: EndpointSecurity

    @property
    def participant_key(self) -> Guid:
        """The Guid of its participant."""
        return self.key.participant

    @property
    def user_data(self) -> bytes:
        return self.qos.user_data.value

    @property
    def data_tags(self) -> tuple[tuple[str, str], ...]:
        """Names and values.  DDS-Security 1.1 §7.2.5; anybody's claim unless ``security.is_discovery_protected``."""
        return self.qos.data_tags.tags

    @property
    def vendor_name(self) -> str:
        return vendor_name(self.vendor_id)


@dataclass(frozen=True, slots=True, kw_only=True)
class PublicationBuiltinTopicData(_EndpointBuiltinTopicData):
    """A writer.  ``key``: its Guid, which a sample's ``info.publication_handle`` is too.

    ``qos``: every policy; those that are not announced, as a remote writer's history, have their defaults.
    ``type_information``: the XTypes TypeInformation as it was announced; empty if it was not.
    """

    TOPIC_NAME: ClassVar[str] = "DCPSPublication"


@dataclass(frozen=True, slots=True, kw_only=True)
class SubscriptionBuiltinTopicData(_EndpointBuiltinTopicData):
    """A reader.  ``key``: its Guid.  ``content_filter``: what it lets pass; None for all.

    ``qos``: every policy; those that are not announced, as a remote reader's history, have their defaults.
    ``type_information``: the XTypes TypeInformation as it was announced; empty if it was not.
    """

    TOPIC_NAME: ClassVar[str] = "DCPSSubscription"

    content_filter: ContentFilterProperty | None


@dataclass(frozen=True, slots=True, kw_only=True)
class TopicBuiltinTopicData:
    """A topic that somebody writes or reads.  ``key``: made from its name and that of its type.

    Gathered from the announcements of writers and readers, as few stacks announce topics: ``qos`` and
    ``type_information`` are those of the endpoint by which it became known.
    """

    TOPIC_NAME: ClassVar[str] = "DCPSTopic"

    key: Guid
    name: str
    type_name: str
    qos: EndpointQos
    type_information: bytes


BuiltinTopicData = (
    ParticipantBuiltinTopicData | TopicBuiltinTopicData | PublicationBuiltinTopicData | SubscriptionBuiltinTopicData
)
